//! An octree whose leaves separate the surfaces of a geometry.

use super::bounds::split;
use super::contact::{self, Contact};
use super::neighborhood::Tolerances;
use super::swept::Swept;
use super::{FeatureError, Named, Place, apex};
use crate::interval::{Cell, dot, middle, offset};
use crate::solid::{Pruned, prune_in};
use crate::{BodyId, Geometry, Interval, Point, Solid, Surface, SurfaceId, Vector};
use nalgebra::Matrix3;
use std::cell::OnceCell;
use std::collections::BTreeMap;
use std::iter;

/// A cell in which the intersection of any two surfaces is known.
#[derive(Debug)]
pub(super) struct Leaf {
    /// The box of the cell.
    pub cell: Cell,
    /// The relevant surfaces, ascending.
    pub surfaces: Vec<SurfaceId>,
    /// The bodies pruned to the cell; `And([])` if a body contains the cell.
    pub bodies: Vec<(BodyId, Solid)>,
    /// The solids of cutouts whose surface is relevant, pruned to the cell, with the index of the
    /// cutout.
    pub cutouts: Vec<(u32, Solid)>,
    /// The pairs of surfaces that may meet in the cell, each in a curve that is monotone along the
    /// curve direction at the center.
    pub pairs: Vec<[SurfaceId; 2]>,
}

impl Leaf {
    /// Whether both surfaces are relevant in the cell.
    pub fn has_both(&self, pair: [SurfaceId; 2]) -> bool {
        pair.iter().all(|s| self.surfaces.binary_search(s).is_ok())
    }
}

/// An octree of such cells.
#[derive(Debug)]
pub(super) struct Octree {
    /// The box of the root.
    pub root: Cell,
    nodes: Vec<Node>,
    /// The leaves, in order of creation.
    pub leaves: Vec<Leaf>,
    /// Points in leaves where surfaces are tangent, or cross at too small an angle for monotone
    /// curves.
    pub contacts: Vec<Contact>,
    /// For each pair of seam surfaces (or surfaces of a residual intersection), the tangent pairs
    /// it represents.
    tangent_pairs: BTreeMap<[SurfaceId; 2], Vec<[SurfaceId; 2]>>,
}

#[derive(Debug)]
enum Node {
    Inner { middle: Point, first: usize },
    Leaf(usize),
}

/// Largest depth of a cell; deeper cells would be smaller than rounding.
const MAX_DEPTH: u32 = 44;
/// Largest number of nodes. The densest known example, a plate with 400 holes, needs some ten
/// thousand.
const MAX_NODES: usize = 4_000_000;
/// Cells with more surfaces than this are split further even if all pairs are separated: then fewer
/// pairs are traced where they are irrelevant.
const CROWD: usize = 6;
/// Largest depth of this additional splitting.
const CROWD_DEPTH: u32 = 7;
/// If the gradients vary by less than this fraction over a cell and still may be parallel, the cell
/// is searched for a point of contact. A larger value loses short curves next to a contact; a
/// smaller one needs more cells along a curve of contact (tens of thousands at 10⁻³).
const FLAT: f64 = 0.05;

impl Octree {
    /// Builds the octree of all bodies in the box `root`.
    ///
    /// # Errors
    /// [`FeatureError::TooIntricate`] if more than [`MAX_NODES`] nodes are needed.
    pub fn new(geometry: &Geometry, root: Cell, tolerances: &Tolerances) -> Result<Self, FeatureError> {
        let bodies = geometry.bodies.iter().enumerate();
        let bodies = bodies.map(|(i, body)| (BodyId::new(i), body.solid.clone())).collect();
        let cutouts = (0..).zip(geometry.cutouts.iter().map(|cutout| cutout.solid.clone())).collect();
        let mut tangent_pairs: BTreeMap<[SurfaceId; 2], Vec<[SurfaceId; 2]>> = BTreeMap::new();
        for seam in &geometry.seams {
            for surfaces in iter::once(seam.surfaces).chain(seam.residual) {
                tangent_pairs.entry(surfaces).or_default().push(seam.pair);
            }
        }
        let nodes = vec![Node::Leaf(0)];
        let mut tree = Self { root, nodes, leaves: Vec::new(), contacts: Vec::new(), tangent_pairs };
        let mut open = vec![(0, root, (bodies, cutouts), 0)];
        while let Some((node, cell, solids, depth)) = open.pop() {
            let (bodies, cutouts) = prune_all(geometry, &cell, solids);
            let surfaces = surfaces_of(&bodies, &cutouts);
            let solids = (bodies, cutouts);
            let dividers = OnceCell::new();
            let classifier = PairClassifier {
                geometry,
                cell: &cell,
                solids: &solids,
                surfaces: &surfaces,
                dividers,
                depth,
                tolerances,
            };
            let pairs = classifier.classify_all();
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

    /// The leaf that contains `point`; `None` outside the root.
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

    /// Whether the intersection of a pair is relevant in a leaf: both surfaces are, or both of a
    /// tangent pair represented by it.
    pub fn is_relevant(&self, leaf: &Leaf, pair: [SurfaceId; 2]) -> bool {
        leaf.has_both(pair) || self.tangent_surfaces(leaf, pair).next().is_some()
    }

    /// Whether a surface is tangent to another along the intersection of a pair of seam surfaces.
    pub fn is_tangent_along(&self, pair: [SurfaceId; 2], surface: SurfaceId) -> bool {
        self.tangent_pairs(pair).iter().flatten().any(|&s| s == surface)
    }

    /// The relevant surfaces of a leaf that are tangent along the intersection of a pair of seam
    /// surfaces.
    pub fn tangent_surfaces<'a>(
        &'a self,
        leaf: &'a Leaf,
        pair: [SurfaceId; 2],
    ) -> impl Iterator<Item = SurfaceId> + 'a {
        self.tangent_pairs(pair).iter().copied().filter(|&tangent| leaf.has_both(tangent)).flatten()
    }

    /// The pairs of surfaces that are tangent along the intersection of a pair of seam surfaces.
    pub fn tangent_pairs(&self, pair: [SurfaceId; 2]) -> &[[SurfaceId; 2]] {
        self.tangent_pairs.get(&pair).map_or(&[], Vec::as_slice)
    }

    /// The surfaces that are relevant anywhere in a box, ascending.
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

/// Bodies and cutout solids with their ids.
type Solids = (Vec<(BodyId, Solid)>, Vec<(u32, Solid)>);

/// Prunes the bodies to a cell, and the cutouts whose surface is relevant to the bodies there.
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

/// Classification of the pairs of surfaces in a cell.
#[derive(Default)]
struct Pairs {
    regular: Vec<[SurfaceId; 2]>,
    contacts: Vec<Contact>,
    undecided: Option<[SurfaceId; 2]>,
}

/// Classifies the pairs of surfaces in a cell.
struct PairClassifier<'a> {
    geometry: &'a Geometry,
    cell: &'a Cell,
    solids: &'a Solids,
    surfaces: &'a [SurfaceId],
    /// Computed on demand by [`sides_of_planes`](Self::sides_of_planes).
    dividers: OnceCell<Vec<(SurfaceId, [Vec<SurfaceId>; 2])>>,
    depth: u32,
    tolerances: &'a Tolerances,
}

impl PairClassifier<'_> {
    /// Classifies all pairs, up to the first undecided one.
    fn classify_all(&self) -> Pairs {
        let mut pairs = Pairs::default();
        for (i, &first) in self.surfaces.iter().enumerate() {
            for &second in &self.surfaces[i + 1..] {
                if !self.classify([first, second], &mut pairs) {
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

    /// Classifies a pair; false if its intersection in the cell is undecided.
    fn classify(&self, pair: [SurfaceId; 2], pairs: &mut Pairs) -> bool {
        match self.geometry.seam(pair) {
            None => self.classify_crossing(pair, pairs),
            // The seam surfaces replace the pair if the whole intersection is known.
            Some(seam) if seam.is_complete => iter::once(seam.surfaces)
                .chain(seam.residual)
                .all(|surfaces| self.classify_crossing(surfaces, pairs)),
            Some(seam) => {
                self.classify_crossing(seam.surfaces, pairs)
                    && (self.is_divided(pair)
                        || contact::on_seam(self.geometry, seam, self.cell, &mut pairs.contacts)
                        || self.classify_crossing(pair, pairs))
            }
        }
    }

    /// Whether a plane separates two surfaces: on each side of the plane, at most one of them is
    /// relevant.
    ///
    /// Both surfaces must miss the plane or cross it in a monotone curve, so that their
    /// intersection on the plane itself is found from their intersections with the plane.
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

    /// The planes in the cell, each with the surfaces that are relevant on its two sides.
    fn sides_of_planes(&self) -> Vec<(SurfaceId, [Vec<SurfaceId>; 2])> {
        /// With more surfaces, this search takes longer than splitting the cell.
        const MOST_SURFACES: usize = 24;
        if self.surfaces.len() > MOST_SURFACES {
            return Vec::new();
        }
        let sides = [(f64::NEG_INFINITY, -f64::MIN_POSITIVE), (f64::MIN_POSITIVE, f64::INFINITY)];
        let sides = sides.map(|(lo, hi)| Interval::new(lo, hi));
        let anything = Interval::new(f64::NEG_INFINITY, f64::INFINITY);
        let (bodies, cutouts) = self.solids;
        let relevant = |plane: SurfaceId, side: Interval| {
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
        planes.map(|plane| (plane, sides.map(|side| relevant(plane, side)))).collect()
    }

    /// Classifies an intersection as empty, a monotone curve, a point of contact, or an apex; false
    /// if undecided.
    fn classify_crossing(&self, pair: [SurfaceId; 2], pairs: &mut Pairs) -> bool {
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

/// Whether two surfaces may meet in a box.
///
/// Evaluates the ranges of both functions, and of the linear combination whose gradient at the
/// center is smallest: it separates nearly parallel sheets.
pub(super) fn can_meet(a: &Surface, b: &Surface, cell: &Cell) -> bool {
    if let Some(swept) = Swept::new(a, b, cell) {
        return swept.can_meet();
    }
    if !(a.value_range(cell).contains_zero() && b.value_range(cell).contains_zero()) {
        return false;
    }
    let factor = factor_of_difference(a, b, cell);
    // On the axis of a cylinder there is no gradient.
    if !factor.is_finite() {
        return true;
    }
    let difference = if a.is_quadric() && b.is_quadric() {
        QuadricDifference::new(a, b, factor, cell).range()
    } else {
        difference_by_mean_value(a, b, factor, cell)
    };
    difference.contains_zero()
}

/// The factor for which the gradient of `a - factor * b` at the center of a box is smallest; not
/// finite where `b` has no gradient.
fn factor_of_difference(a: &Surface, b: &Surface, cell: &Cell) -> f64 {
    let center = middle(cell);
    let gradient = b.gradient(&center);
    a.gradient(&center).dot(&gradient) / gradient.norm_squared()
}

/// A range of `a - factor * b` over a box, by the mean-value form.
fn difference_by_mean_value(a: &Surface, b: &Surface, factor: f64, cell: &Cell) -> Interval {
    let center = middle(cell);
    let at = [0, 1, 2].map(|i| Interval::point(center[i]));
    let (ra, rb) = (a.gradient_range(cell), b.gradient_range(cell));
    let arm = offset(cell, &center);
    let slope = |i: usize| (ra[i] - rb[i] * factor) * arm[i];
    a.value_range(&at) - b.value_range(&at) * factor + slope(0) + slope(1) + slope(2)
}

/// The second-order expansion of `a - factor * b` around the center of a box for two quadrics.
///
/// Their Hessians are constant, so the common part cancels. The walls of a thin pipe are separated
/// in cells much larger than the wall thickness.
struct QuadricDifference {
    /// Ranges at the center, which contain the rounding error.
    value: Interval,
    gradient: Cell,
    hessian: Matrix3<f64>,
    /// The rounding error of the entries of the Hessian, which are sums of few products.
    slack: Interval,
    /// The box, relative to the center.
    arm: Cell,
}

impl QuadricDifference {
    fn new(a: &Surface, b: &Surface, factor: f64, cell: &Cell) -> Self {
        let center = middle(cell);
        let at = [0, 1, 2].map(|i| Interval::point(center[i]));
        let (ra, rb) = (a.gradient_range(&at), b.gradient_range(&at));
        let (ha, hb) = (a.hessian(&center), b.hessian(&center) * factor);
        let slack = 16.0 * f64::EPSILON * (ha.amax() + hb.amax());
        Self {
            value: a.value_range(&at) - b.value_range(&at) * factor,
            gradient: [0, 1, 2].map(|i| ra[i] - rb[i] * factor),
            hessian: ha - hb,
            slack: Interval::new(-slack, slack),
            arm: offset(cell, &center),
        }
    }

    /// The range over the box.
    fn range(&self) -> Interval {
        let Self { value, gradient, hessian, slack, arm } = self;
        let mut range = *value;
        for i in 0..3 {
            range = range
                + gradient[i] * arm[i]
                + arm[i].square() * (*slack + Interval::point(0.5 * hessian[(i, i)]));
            for j in i + 1..3 {
                range = range + arm[i] * arm[j] * (*slack + Interval::point(hessian[(i, j)]));
            }
        }
        range
    }

    /// The range of the gradient over the box.
    fn gradient_range(&self) -> Cell {
        [0, 1, 2].map(|i| {
            let turn = |j: usize| self.arm[j] * (self.slack + Interval::point(self.hessian[(i, j)]));
            self.gradient[i] + turn(0) + turn(1) + turn(2)
        })
    }
}

/// Whether the intersection of two surfaces runs forward along `direction` everywhere in a box.
///
/// Then it has at most one point on each plane perpendicular to `direction`: the two equations
/// restricted to the plane have a regular Jacobian for any choice of gradients, row by row, in
/// their ranges (Neumaier 1990, Interval methods for systems of equations, section 5.1).
pub(super) fn is_monotone(a: &Surface, b: &Surface, cell: &Cell, direction: &Vector) -> bool {
    let in_plane = Swept::new(a, b, cell).and_then(|swept| swept.is_monotone(direction));
    in_plane.unwrap_or_else(|| is_monotone_in_space(a, b, cell, direction))
}

/// The same as [`is_monotone`], from the ranges of the gradients in space.
fn is_monotone_in_space(a: &Surface, b: &Surface, cell: &Cell, direction: &Vector) -> bool {
    let (u, v) = (a.gradient_range(cell), b.gradient_range(cell));
    if dot(direction, &cross(&u, &v)).lo > 0.0 {
        return true;
    }
    if !(a.is_quadric() && b.is_quadric()) {
        return false;
    }
    // Quadrics that cross at a small angle: the intersection is also that of the first with the
    // combination whose gradient at the center is smallest. Two balls have a plane in common.
    let factor = factor_of_difference(a, b, cell);
    if !factor.is_finite() || factor == 0.0 {
        return false;
    }
    let gradient = QuadricDifference::new(a, b, factor, cell).gradient_range();
    let along = dot(direction, &cross(&u, &gradient)) * -factor;
    along.lo > 0.0
}

fn cross(u: &Cell, v: &Cell) -> Cell {
    [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]]
}

/// Whether the gradient of a surface is nearly constant over a box.
pub(super) fn is_flat(surface: &Surface, cell: &Cell) -> bool {
    let widest = surface.gradient_range(cell).iter().map(Interval::width).fold(0.0, f64::max);
    widest <= FLAT * surface.gradient(&middle(cell)).norm()
}
