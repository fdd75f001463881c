//! Cells that separate surfaces: in each, what matters there.

use super::around::Tolerances;
use super::bounds::split;
use super::contact::{self, Contact};
use super::swept::Swept;
use super::{FeatureError, Named, Place, apex};
use crate::interval::{Cell, dot, middle, offset};
use crate::solid::{Pruned, prune_in};
use crate::{BodyId, Geometry, Interval, Point, Solid, Surface, SurfaceId, Vector};
use std::cell::OnceCell;
use std::collections::BTreeMap;
use std::iter;

/// A cell in which any two surfaces are told apart.
#[derive(Debug)]
pub(super) struct Leaf {
    /// Its box.
    pub cell: Cell,
    /// The surfaces that matter in it, ascending.
    pub surfaces: Vec<SurfaceId>,
    /// What is left of the bodies in it; a body that fills it is `And([])`.
    pub bodies: Vec<(BodyId, Solid)>,
    /// What is left of the solids of those cutouts whose surface matters in it, by index.
    pub cutouts: Vec<(u32, Solid)>,
    /// The pairs of its surfaces that may meet in it, in a curve monotone along its middle's direction.
    pub pairs: Vec<[SurfaceId; 2]>,
}

impl Leaf {
    /// Whether both surfaces matter in it.
    pub fn has_both(&self, pair: [SurfaceId; 2]) -> bool {
        pair.iter().all(|s| self.surfaces.binary_search(s).is_ok())
    }
}

/// An octree of such cells.
#[derive(Debug)]
pub(super) struct Octree {
    /// The box of all.
    pub root: Cell,
    nodes: Vec<Node>,
    /// Its leaves, in the order in which they were made.
    pub leaves: Vec<Leaf>,
    /// Places where surfaces of a cell touch or cross too flatly for curves to be monotone.
    pub contacts: Vec<Contact>,
    /// By the surfaces that carry seams, or the rest of what their surfaces have in common: the pairs that they stand for.
    seams: BTreeMap<[SurfaceId; 2], Vec<[SurfaceId; 2]>>,
}

#[derive(Debug)]
enum Node {
    Inner { middle: Point, first: usize },
    Leaf(usize),
}

/// No cell is split deeper: it would be smaller than rounding.
const MAX_DEPTH: u32 = 44;
/// More nodes than any real part needs (the densest example, a plate with 400 holes, needs some ten thousand).
const MAX_NODES: usize = 4_000_000;
/// Cells with more surfaces than this are split a few levels although their pairs are told apart: fewer pairs are followed
/// where they do not matter.
const CROWD: usize = 6;
/// How many levels.
const CROWD_DEPTH: u32 = 7;
/// If gradients vary by less than this part over a cell and still are not told apart from parallel, the cell is
/// searched for a point of contact. Larger: curves so short that they fit beside a contact in a cell are lost; smaller:
/// more cells along a curve of contact (ten thousands at 10⁻³).
const FLAT: f64 = 0.05;

impl Octree {
    /// The cells of the bodies in the box `root`.
    ///
    /// # Errors
    /// If more cells are needed than memory should hold.
    pub fn new(geometry: &Geometry, root: Cell, tolerances: &Tolerances) -> Result<Self, FeatureError> {
        let bodies = geometry.bodies.iter().enumerate();
        let bodies = bodies.map(|(i, body)| (BodyId::new(i), body.solid.clone())).collect();
        let cutouts = (0..).zip(geometry.cutouts.iter().map(|cutout| cutout.solid.clone())).collect();
        let mut seams: BTreeMap<[SurfaceId; 2], Vec<[SurfaceId; 2]>> = BTreeMap::new();
        for seam in &geometry.seams {
            for carrier in iter::once(seam.carrier).chain(seam.rest) {
                seams.entry(carrier).or_default().push(seam.pair);
            }
        }
        let nodes = vec![Node::Leaf(0)];
        let mut tree = Self { root, nodes, leaves: Vec::new(), contacts: Vec::new(), seams };
        let mut open = vec![(0, root, (bodies, cutouts), 0)];
        while let Some((node, cell, solids, depth)) = open.pop() {
            let (bodies, cutouts) = prune_all(geometry, &cell, solids);
            let surfaces = surfaces_of(&bodies, &cutouts);
            let solids = (bodies, cutouts);
            let dividers = OnceCell::new();
            let judge = Judge {
                geometry,
                cell: &cell,
                solids: &solids,
                surfaces: &surfaces,
                dividers,
                depth,
                tolerances,
            };
            let pairs = judge.all();
            let (bodies, cutouts) = solids;
            let crowded = surfaces.len() > CROWD && depth < CROWD_DEPTH;
            if depth < MAX_DEPTH && (crowded || pairs.undecided.is_some()) {
                if let (Some(pair), true) = (pairs.undecided, tree.nodes.len() > MAX_NODES) {
                    let [first, second] = pair.map(|s| Named::surface(geometry, s));
                    return Err(FeatureError::TooIntricate { first, second, place: Place(middle(&cell)) });
                }
                let first = tree.nodes.len();
                tree.nodes[node] = Node::Inner { middle: middle(&cell), first };
                for (child, part) in split(&cell).into_iter().enumerate() {
                    tree.nodes.push(Node::Leaf(usize::MAX));
                    open.push((first + child, part, (bodies.clone(), cutouts.clone()), depth + 1));
                }
            } else {
                tree.nodes[node] = Node::Leaf(tree.leaves.len());
                tree.contacts.extend(pairs.contacts);
                let at_the_end = pairs.undecided.map(|pair| Contact::at_middle(pair, &cell));
                tree.contacts.extend(at_the_end);
                tree.leaves.push(Leaf { cell, surfaces, bodies, cutouts, pairs: pairs.regular });
            }
        }
        Ok(tree)
    }

    /// The leaf that contains `point`, `None` outside the root.
    pub fn leaf(&self, point: &Point) -> Option<&Leaf> {
        if !(0..3).all(|i| self.root[i].contains(point[i])) {
            return None;
        }
        let mut node = 0;
        loop {
            match &self.nodes[node] {
                Node::Leaf(leaf) => return Some(&self.leaves[*leaf]),
                Node::Inner { middle, first } => {
                    let bit = |i: usize| usize::from(point[i] > middle[i]) << i;
                    node = first + bit(0) + bit(1) + bit(2);
                }
            }
        }
    }

    /// Whether the intersection of a pair of surfaces matters in a leaf: both do, or those do whose seam it carries.
    pub fn matters(&self, leaf: &Leaf, pair: [SurfaceId; 2]) -> bool {
        leaf.has_both(pair) || self.sewn(leaf, pair).next().is_some()
    }

    /// Whether a surface is one of those whose seam a pair carries.
    pub fn is_seam(&self, pair: [SurfaceId; 2], surface: SurfaceId) -> bool {
        self.sewn_pairs(pair).iter().flatten().any(|&s| s == surface)
    }

    /// The surfaces that matter in a leaf and are tangent along the intersection of a pair that carries their seams.
    pub fn sewn<'a>(&'a self, leaf: &'a Leaf, pair: [SurfaceId; 2]) -> impl Iterator<Item = SurfaceId> + 'a {
        self.sewn_pairs(pair).iter().copied().filter(|&sewn| leaf.has_both(sewn)).flatten()
    }

    /// The pairs of surfaces that are tangent along the intersection of a pair that carries their seams.
    pub fn sewn_pairs(&self, pair: [SurfaceId; 2]) -> &[[SurfaceId; 2]] {
        self.seams.get(&pair).map_or(&[], Vec::as_slice)
    }

    /// The surfaces that matter anywhere in a box, ascending.
    pub fn surfaces_in(&self, cell: &Cell) -> Vec<SurfaceId> {
        let mut found = Vec::new();
        let mut open = vec![0];
        while let Some(node) = open.pop() {
            match &self.nodes[node] {
                Node::Leaf(leaf) => found.extend(&self.leaves[*leaf].surfaces),
                Node::Inner { middle, first } => {
                    let on_side = |child: usize, i: usize| {
                        if child >> i & 1 == 0 { cell[i].lo <= middle[i] } else { cell[i].hi >= middle[i] }
                    };
                    open.extend((0..8).filter(|&c| (0..3).all(|i| on_side(c, i))).map(|c| first + c));
                }
            }
        }
        found.sort_unstable();
        found.dedup();
        found
    }
}

/// The bodies that matter in a cell, and the solids of cutouts.
type Solids = (Vec<(BodyId, Solid)>, Vec<(u32, Solid)>);

/// What is left of the bodies in a cell, and of the cutouts of surfaces that matter to the bodies there.
fn prune_all(geometry: &Geometry, cell: &Cell, (bodies, mut cutouts): Solids) -> Solids {
    let bodies = prune_in(&geometry.surfaces, cell, bodies);
    if !cutouts.is_empty() {
        let surfaces = surfaces_of(&bodies, &[]);
        cutouts.retain(|(i, _)| surfaces.binary_search(&geometry.cutouts[*i as usize].surface).is_ok());
        cutouts = prune_in(&geometry.surfaces, cell, cutouts);
    }
    (bodies, cutouts)
}

fn surfaces_of(bodies: &[(BodyId, Solid)], cutouts: &[(u32, Solid)]) -> Vec<SurfaceId> {
    let mut surfaces: Vec<_> = bodies.iter().flat_map(|(_, solid)| solid.surfaces()).collect();
    surfaces.extend(cutouts.iter().flat_map(|(_, solid)| solid.surfaces()));
    surfaces.sort_unstable();
    surfaces.dedup();
    surfaces
}

/// What is known of the pairs of surfaces in a cell.
#[derive(Default)]
struct Pairs {
    regular: Vec<[SurfaceId; 2]>,
    contacts: Vec<Contact>,
    undecided: Option<[SurfaceId; 2]>,
}

/// Judges the pairs of surfaces in a cell.
struct Judge<'a> {
    geometry: &'a Geometry,
    cell: &'a Cell,
    solids: &'a Solids,
    surfaces: &'a [SurfaceId],
    /// See [`Judge::sides_of_planes`].
    dividers: OnceCell<Vec<(SurfaceId, [Vec<SurfaceId>; 2])>>,
    depth: u32,
    tolerances: &'a Tolerances,
}

impl Judge<'_> {
    /// Judges all pairs, up to the first that is not told apart.
    fn all(&self) -> Pairs {
        let mut pairs = Pairs::default();
        for (i, &first) in self.surfaces.iter().enumerate() {
            for &second in &self.surfaces[i + 1..] {
                if !self.pair([first, second], &mut pairs) {
                    pairs.undecided = Some([first, second]);
                    if self.depth < MAX_DEPTH {
                        return pairs;
                    }
                }
            }
        }
        pairs.regular.sort_unstable();
        pairs.regular.dedup();
        pairs
    }

    /// Whether two surfaces of the cell are told apart in it.
    fn pair(&self, pair: [SurfaceId; 2], pairs: &mut Pairs) -> bool {
        match self.geometry.seam(pair) {
            None => self.crossing(pair, pairs),
            // Where the seam is all they have in common, its carrier stands for them.
            Some(seam) if seam.is_alone => {
                iter::once(seam.carrier).chain(seam.rest).all(|carrier| self.crossing(carrier, pairs))
            }
            Some(seam) => {
                self.crossing(seam.carrier, pairs)
                    && (self.is_divided(pair)
                        || contact::on_seam(self.geometry, seam, self.cell, &mut pairs.contacts)
                        || self.crossing(pair, pairs))
            }
        }
    }

    /// Whether solids keep two surfaces apart: on each side of a plane that both cross cleanly, or miss, only one of them matters.
    ///
    /// What the two have in common on the plane itself is seen where each of them meets it.
    fn is_divided(&self, pair: [SurfaceId; 2]) -> bool {
        let has_both = |side: &Vec<SurfaceId>| pair.iter().all(|s| side.contains(s));
        let is_clear = |s: SurfaceId, plane: SurfaceId| {
            let [a, b] = [s, plane].map(|s| &self.geometry.surfaces[s.index()]);
            let center = middle(self.cell);
            let direction = a.gradient(&center).cross(&b.gradient(&center));
            !can_meet(a, b, self.cell) || is_monotone(a, b, self.cell, &direction)
        };
        let dividers = self.dividers.get_or_init(|| self.sides_of_planes());
        pair.iter().all(|s| self.surfaces.binary_search(s).is_ok())
            && dividers.iter().any(|(plane, sides)| {
                !pair.contains(plane)
                    && !sides.iter().any(has_both)
                    && pair.iter().all(|&s| is_clear(s, *plane))
            })
    }

    /// The planes of the cell, and the surfaces that matter on both sides of each.
    fn sides_of_planes(&self) -> Vec<(SurfaceId, [Vec<SurfaceId>; 2])> {
        /// In a cell with more surfaces the search for dividers would take longer than splitting it.
        const MOST_SURFACES: usize = 24;
        if self.surfaces.len() > MOST_SURFACES {
            return Vec::new();
        }
        let sides = [(f64::NEG_INFINITY, -f64::MIN_POSITIVE), (f64::MIN_POSITIVE, f64::INFINITY)];
        let sides = sides.map(|(lo, hi)| Interval::new(lo, hi));
        let anything = Interval::new(f64::NEG_INFINITY, f64::INFINITY);
        let (bodies, cutouts) = self.solids;
        let mattering = |plane: SurfaceId, side: Interval| {
            let solids = bodies.iter().map(|b| &b.1).chain(cutouts.iter().map(|c| &c.1));
            let mut range = |id| if id == plane { side } else { anything };
            let left = solids.filter_map(|solid| match solid.prune(&mut range) {
                Pruned::Part(part) => Some(part.surfaces()),
                Pruned::Empty | Pruned::Full => None,
            });
            left.flatten().collect()
        };
        let is_plane = |s: &SurfaceId| matches!(self.geometry.surfaces[s.index()], Surface::Plane(_));
        let planes = self.surfaces.iter().copied().filter(is_plane);
        planes.map(|plane| (plane, sides.map(|side| mattering(plane, side)))).collect()
    }

    /// Whether what two surfaces have in common in the cell is known: nothing, a monotone curve, a point of contact, or an apex.
    fn crossing(&self, pair: [SurfaceId; 2], pairs: &mut Pairs) -> bool {
        let Self { geometry, cell, depth, tolerances, .. } = *self;
        let [a, b] = pair.map(|s| &geometry.surfaces[s.index()]);
        if !can_meet(a, b, cell) || self.is_divided(pair) {
            return true;
        }
        let center = middle(cell);
        let direction = a.gradient(&center).cross(&b.gradient(&center));
        if is_monotone(a, b, cell, &direction) {
            pairs.regular.push(pair);
            return true;
        }
        let contact = match apex::in_cell(geometry, pair, cell, depth, tolerances) {
            None if is_flat(a, cell) && is_flat(b, cell) => contact::find(geometry, pair, cell, tolerances),
            apex => apex,
        };
        pairs.contacts.extend(contact);
        contact.is_some()
    }
}

/// Whether two surfaces that both pass through a box may meet in it.
///
/// Beside the ranges of both functions, the range of that combination of them is asked whose gradient is
/// least in the middle: it tells nearly parallel sheets apart.
pub(super) fn can_meet(a: &Surface, b: &Surface, cell: &Cell) -> bool {
    if let Some(swept) = Swept::new(a, b, cell) {
        return swept.can_meet();
    }
    let center = middle(cell);
    let (ga, gb) = (a.gradient(&center), b.gradient(&center));
    let factor = ga.dot(&gb) / gb.norm_squared();
    if !factor.is_finite() {
        return true;
    }
    let difference =
        if a.is_quadric() && b.is_quadric() { quadratic_difference } else { difference_by_mean_value };
    difference(a, b, factor, cell).contains_zero()
        && a.value_range(cell).contains_zero()
        && b.value_range(cell).contains_zero()
}

/// A range of a - `factor` b over a box, by the mean-value form.
fn difference_by_mean_value(a: &Surface, b: &Surface, factor: f64, cell: &Cell) -> Interval {
    let center = middle(cell);
    let at = [0, 1, 2].map(|i| Interval::point(center[i]));
    let (ra, rb) = (a.gradient_range(cell), b.gradient_range(cell));
    let arm = offset(cell, &center);
    let slope = |i: usize| (ra[i] - rb[i] * factor) * arm[i];
    a.value_range(&at) - b.value_range(&at) * factor + slope(0) + slope(1) + slope(2)
}

/// The same for two quadrics, whose second derivatives are constant: what is alike in both cancels, so that the walls of a thin
/// pipe are told apart in cells much larger than the wall.
fn quadratic_difference(a: &Surface, b: &Surface, factor: f64, cell: &Cell) -> Interval {
    let center = middle(cell);
    let at = [0, 1, 2].map(|i| Interval::point(center[i]));
    let (ra, rb) = (a.gradient_range(&at), b.gradient_range(&at));
    let (ha, hb) = (a.hessian(&center), b.hessian(&center) * factor);
    let bend = ha - hb;
    // Rounding of the entries, which are sums of few products.
    let slack = 16.0 * f64::EPSILON * (ha.amax() + hb.amax());
    let slack = Interval::new(-slack, slack);
    let arm = offset(cell, &center);
    let mut range = a.value_range(&at) - b.value_range(&at) * factor;
    for i in 0..3 {
        range = range
            + (ra[i] - rb[i] * factor) * arm[i]
            + arm[i].square() * (slack + Interval::point(0.5 * bend[(i, i)]));
        for j in i + 1..3 {
            range = range + arm[i] * arm[j] * (slack + Interval::point(bend[(i, j)]));
        }
    }
    range
}

/// Whether the intersection of two surfaces runs forward along `direction` everywhere in a box.
///
/// It then has at most one point on each plane across `direction`: the two equations restricted to that plane have
/// a regular Jacobian for any choice of gradients, row by row, in their ranges (Neumaier 1990, Interval methods for
/// systems of equations, section 5.1).
pub(super) fn is_monotone(a: &Surface, b: &Surface, cell: &Cell, direction: &Vector) -> bool {
    let in_plane = Swept::new(a, b, cell).and_then(|swept| swept.is_monotone(direction));
    in_plane.unwrap_or_else(|| is_monotone_in_space(a, b, cell, direction))
}

/// The same from the ranges of the gradients.
pub(super) fn is_monotone_in_space(a: &Surface, b: &Surface, cell: &Cell, direction: &Vector) -> bool {
    let (u, v) = (a.gradient_range(cell), b.gradient_range(cell));
    let cross = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
    dot(direction, &cross).lo > 0.0
}

/// Whether a gradient hardly varies over a box.
pub(super) fn is_flat(surface: &Surface, cell: &Cell) -> bool {
    let widest = surface.gradient_range(cell).iter().map(Interval::width).fold(0.0, f64::max);
    widest <= FLAT * surface.gradient(&middle(cell)).norm()
}
