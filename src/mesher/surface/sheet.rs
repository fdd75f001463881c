//! A triangulation of one connected sheet of a surface under construction.

use super::Settings;
use super::chart::{Chart, Site, nappe};
use super::topology::{NONE, Topology, last, next};
use crate::ground::kernel::predicates::Sign;
use crate::ground::kernel::simplex::area_vector;
use crate::ground::size::SizeField;
use crate::{Point, Vector};
use csg::{ProjectionFailed, Surface};

/// Why meshing a sheet stopped.
#[derive(Clone, Copy, Debug)]
pub(super) enum Stop {
    /// A point has no unique projection onto the surface.
    Projection(ProjectionFailed),
    /// The size field returned this value at a point.
    Size(Point, f64),
}

impl From<ProjectionFailed> for Stop {
    fn from(failed: ProjectionFailed) -> Self {
        Self::Projection(failed)
    }
}

/// How a vertex may be changed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    /// On a corner or a curve: it must not change.
    Fixed,
    /// Inside the patch.
    Free,
    /// Inside the patch, from the initial triangulation: the front may move it to a new position.
    Helper,
    /// Not on the surface: a vertex of the initial triangulation that marks the outside.
    Outside,
}

/// A vertex.
#[derive(Clone, Copy, Debug)]
pub(super) struct Node {
    /// Its position.
    pub point: Point,
    /// The unit normal of the surface; zero at the apex of a cone.
    pub normal: Vector,
    /// Its site in the chart.
    pub site: Site,
    /// The wanted edge length.
    pub size: f64,
    /// How it may be changed.
    pub kind: Kind,
}

/// A segment that triangles must not cross.
#[derive(Clone, Copy, Debug)]
pub(super) struct Piece {
    /// Its end vertices.
    pub ends: [u32; 2],
    /// Directions of the curve at the ends, into the segment; zero if unknown.
    pub tangents: [Vector; 2],
}

impl Piece {
    /// The direction in which the segment leaves one of its ends.
    fn leaving(&self, v: u32) -> Option<&Vector> {
        self.ends.iter().position(|&e| e == v).map(|k| &self.tangents[k])
    }
}

/// Cosine below which two segments form one smooth curve at a common end.
///
/// A triangle with both on its sides would flatten in refinement. Arcs that meet smoothly at a
/// corner enclose 180° up to rounding; at a corner of 170° a triangle keeps an angle of 170° in all
/// refinements, as the geometry requires.
const SMOOTH_COSINE: f64 = -0.996;

/// Least cosine between a triangle's normal and the surface's at a vertex without penalty: 60°. A
/// cylinder with three segments per circle has 60°, with four it has 45°.
const NORMAL_COSINE: f64 = 0.5;
/// Penalty per missing cosine; more than the price of any shape that is not degenerate.
pub(super) const NORMAL_PRICE: f64 = 1e4;
/// Penalty of a triangle that faces away from the surface's normal, also per sum of squared edges
/// over squared size.
const FOLDED_PRICE: f64 = 1e6;
/// Penalty of two sides on one smooth curve.
const FLATTENING_PRICE: f64 = 1e5;
/// Price of a triangle without area.
pub(super) const DEGENERATE_PRICE: f64 = 1e12;
/// Least relative gain of a change, so that rounding cannot cause cycles.
pub(super) const GAIN: f64 = 1e-9;

/// A triangulation of one connected sheet of a surface.
pub(super) struct Sheet<'a> {
    /// The surface.
    pub surface: &'a Surface,
    /// Its chart.
    pub chart: Chart,
    /// The wanted size, not limited by curvature.
    pub field: &'a dyn SizeField,
    /// The settings of the caller.
    pub settings: &'a Settings,
    /// The vertices.
    pub nodes: Vec<Node>,
    /// The triangles.
    pub mesh: Topology,
    /// The segments; sides of triangles refer to them.
    pub pieces: Vec<Piece>,
    /// Scratch memory for stars.
    pub ring: Vec<u32>,
    stack: Vec<u32>,
}

/// The location of a site in the triangulation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Place {
    /// Inside a triangle.
    Inside(u32),
    /// Inside a side.
    OnSide(u32, usize),
    /// On a vertex.
    OnVertex(u32),
}

impl<'a> Sheet<'a> {
    /// A sheet without vertices.
    pub fn new(surface: &'a Surface, chart: Chart, field: &'a dyn SizeField, settings: &'a Settings) -> Self {
        Self {
            surface,
            chart,
            field,
            settings,
            nodes: Vec::new(),
            mesh: Topology::default(),
            pieces: Vec::new(),
            ring: Vec::new(),
            stack: Vec::new(),
        }
    }

    /// The size wanted at a point of the surface: that of the size field, limited by curvature.
    ///
    /// # Errors
    /// [`Stop::Size`] if the field returns a value that is not positive and finite.
    pub fn wanted_size(&self, point: &Point) -> Result<f64, Stop> {
        let size = self.field.size_at(point);
        if size.is_nan() || size <= 0.0 || size.is_infinite() {
            return Err(Stop::Size(*point, size));
        }
        // At the apex of a cone the curvature is infinite, NaN, or, some ulp away, so large that it
        // would give sizes of 10⁻¹⁰, so it is not used.
        if nappe(self.surface, point) == 0.0 {
            return Ok(size);
        }
        let bound = self.settings.turn / self.surface.curvature(point);
        Ok(if bound > 0.0 { size.min(bound) } else { size })
    }

    /// The node of a point on the surface.
    pub fn node(&self, point: Point, size: f64, kind: Kind) -> Node {
        let site = self.chart.site(self.surface, &point);
        // The computed apex is some ulp off the true one, so its normal would be noise.
        let normal = if self.chart.is_pole(&site) { Vector::zeros() } else { self.surface.normal(&point) };
        Node { point, normal, site, size, kind }
    }

    /// A free node at the projection of `point` onto the surface, with the size wanted there.
    ///
    /// # Errors
    /// [`Stop::Projection`] if the projection fails, [`Stop::Size`] if the size is not positive and
    /// finite.
    pub fn project(&self, point: &Point) -> Result<Node, Stop> {
        let point = self.surface.project(point)?;
        Ok(self.node(point, self.wanted_size(&point)?, Kind::Free))
    }

    /// Like [`project`](Self::project); `None` if the projection fails, for example on the axis of
    /// a cone.
    pub fn try_project(&self, point: &Point) -> Result<Option<Node>, Stop> {
        match self.project(point) {
            Err(Stop::Projection(_)) => Ok(None),
            found => found.map(Some),
        }
    }

    /// The vertices of a triangle.
    #[inline]
    pub fn corners(&self, t: u32) -> [&Node; 3] {
        self.mesh.at(t).v.map(|v| &self.nodes[v as usize])
    }

    /// Whether three vertices form a counter-clockwise triangle in the chart.
    #[inline]
    pub fn fits(&self, a: u32, b: u32, c: u32) -> bool {
        let site = |v: u32| &self.nodes[v as usize].site;
        self.chart.orient(site(a), site(b), site(c)) == Sign::Positive
    }

    /// The price of a triangle: Σl²/area relative to the regular triangle, which has 1, plus
    /// penalties.
    ///
    /// Swaps and moves lower the sum over all triangles. In the plane the Delaunay triangulation
    /// minimises the sum of Σl²/area (Musin 1997, "Properties of the Delaunay triangulation"), so a
    /// swap that lowers it is a Delaunay flip. As every swap lowers the sum, swaps terminate on any
    /// surface.
    pub fn price(&self, corners: [&Node; 3]) -> f64 {
        let [a, b, c] = corners;
        let area = area_vector(&a.point, &b.point, &c.point);
        let double = area.norm();
        let squares = (b.point - a.point).norm_squared()
            + (c.point - b.point).norm_squared()
            + (a.point - c.point).norm_squared();
        // q = 4√3·area / Σl² is 1 for the regular triangle.
        let inverse = squares / (2.0 * 3.0_f64.sqrt() * double);
        if inverse.is_nan() || inverse > DEGENERATE_PRICE {
            return DEGENERATE_PRICE;
        }
        let mut least = double;
        for node in corners {
            // The apex of a cone has no normal and is not checked.
            if node.normal != Vector::zeros() {
                least = least.min(area.dot(&node.normal));
            }
        }
        let lacking = NORMAL_COSINE - least / double;
        if lacking <= 0.0 {
            return inverse;
        }
        let turned = inverse + NORMAL_PRICE * lacking;
        if lacking < NORMAL_COSINE {
            return turned;
        }
        // Folds arise if the vertices next to a long edge are on other sides of it in the chart
        // than in space. Short edges remove them, so their price favours short edges even if that
        // needs more folded triangles temporarily.
        let size = (a.size + b.size + c.size) / 3.0;
        turned + FOLDED_PRICE * (1.0 + squares / (size * size))
    }

    /// The price of a triangle given by its corners and the segments on its sides, with the penalty
    /// for smooth curves.
    pub fn price_of(&self, v: [u32; 3], segments: [u32; 3]) -> f64 {
        let shape = self.price(v.map(|v| &self.nodes[v as usize]));
        shape + FLATTENING_PRICE * self.flattenings(v, segments) as f64
    }

    /// The price of a triangle of the mesh.
    pub fn price_at(&self, t: u32) -> f64 {
        let x = self.mesh.at(t);
        self.price_of(x.v, x.segment)
    }

    /// The number of corners of a triangle at which it has both sides on one smooth curve.
    pub fn flattenings(&self, v: [u32; 3], segments: [u32; 3]) -> usize {
        let straight = |i: usize| {
            let (x, y) = (segments[next(i)], segments[last(i)]);
            if x == NONE || y == NONE {
                return false;
            }
            let leaving = [x, y].map(|s| self.pieces[s as usize].leaving(v[i]));
            matches!(leaving, [Some(p), Some(q)] if p.dot(q) < SMOOTH_COSINE)
        };
        (0..3).filter(|&i| straight(i)).count()
    }

    /// Σl²/area of a triangle on the unrolled surface; infinite if the chart is not unrolled there.
    fn unrolled_price(&self, v: [u32; 3], _: [u32; 3]) -> f64 {
        let site = |k: usize| &self.nodes[v[k] as usize].site;
        let edge = |from: usize, to: usize| self.chart.unrolled(site(from), site(to));
        let (Some([x1, y1]), Some([x2, y2])) = (edge(0, 1), edge(0, 2)) else { return f64::INFINITY };
        let squares = x1 * x1 + y1 * y1 + x2 * x2 + y2 * y2 + (x2 - x1).powi(2) + (y2 - y1).powi(2);
        (squares / (x1 * y2 - x2 * y1)).abs().min(DEGENERATE_PRICE)
    }

    /// Swaps the diagonal at a side if that lowers the price and is valid in the chart.
    pub fn try_flip(&mut self, t: u32, i: usize) -> bool {
        self.flip_for(t, i, Self::price_of)
    }

    /// Swaps diagonals of folded triangles and beside them until they are Delaunay on the unrolled
    /// surface; returns the number of swaps.
    ///
    /// Where the surface bends sharply, swaps by the price can end with triangles that connect its
    /// two sides through the inside: each single swap would raise the price. On the unrolled
    /// surface swaps always end with the Delaunay triangulation.
    pub fn unfold(&mut self) -> usize {
        let folded: Vec<u32> = self.mesh.living().filter(|&t| self.price_at(t) > NORMAL_PRICE).collect();
        self.flip_all(folded, |sheet, t, i| sheet.flip_for(t, i, Self::unrolled_price))
    }

    /// Swaps the diagonal at a side if that lowers the sum of a price and is valid in the chart.
    fn flip_for(&mut self, t: u32, i: usize, price: impl Fn(&Self, [u32; 3], [u32; 3]) -> f64) -> bool {
        let x = *self.mesh.at(t);
        if x.segment[i] != NONE || x.near[i] == NONE {
            return false;
        }
        let (u, j) = self.mesh.twin(t, i).expect("a side with two triangles");
        let y = *self.mesh.at(u);
        let [p, a, b, d] = [x.v[i], x.v[next(i)], x.v[last(i)], y.v[j]];
        if [p, a, b, d].iter().any(|&v| self.nodes[v as usize].kind == Kind::Outside) {
            return false;
        }
        let before = price(self, x.v, x.segment) + price(self, y.v, y.segment);
        let after = price(self, [p, a, d], [y.segment[next(j)], NONE, x.segment[last(i)]])
            + price(self, [p, d, b], [y.segment[last(j)], x.segment[next(i)], NONE]);
        // Also if both are infinite.
        if after >= before * (1.0 - GAIN) || !self.fits(p, a, d) || !self.fits(p, d, b) {
            return false;
        }
        self.mesh.flip(t, i);
        true
    }

    /// Swaps diagonals around a new vertex until none gains (Lawson's algorithm).
    pub fn legalise(&mut self, v: u32, parts: &[u32]) {
        let mut stack = std::mem::take(&mut self.stack);
        stack.extend_from_slice(parts);
        while let Some(t) = stack.pop() {
            let x = self.mesh.at(t);
            if !x.v.contains(&v) {
                continue;
            }
            let i = x.corner(v);
            let u = x.near[i];
            if self.try_flip(t, i) {
                stack.extend([t, u]);
            }
        }
        self.stack = stack;
    }

    /// Swaps diagonals everywhere until none gains; returns the number of swaps.
    pub fn legalise_all(&mut self) -> usize {
        let all = self.mesh.living().collect();
        self.flip_all(all, Self::try_flip)
    }

    /// Swaps diagonals at the sides of some triangles, and then beside those that changed, until
    /// `flip` swaps none; returns the number of swaps.
    fn flip_all(&mut self, first: Vec<u32>, flip: impl Fn(&mut Self, u32, usize) -> bool) -> usize {
        let mut waiting = vec![false; self.mesh.triangles.len()];
        first.iter().for_each(|&t| waiting[t as usize] = true);
        let mut queue = std::collections::VecDeque::from(first);
        let mut swaps = 0;
        while let Some(t) = queue.pop_front() {
            waiting[t as usize] = false;
            for i in 0..3 {
                let u = self.mesh.at(t).near[i];
                // The side is tested with the neighbour, which is in the queue.
                if u != NONE && waiting[u as usize] {
                    continue;
                }
                if flip(self, t, i) {
                    swaps += 1;
                    for s in [t, u] {
                        if !std::mem::replace(&mut waiting[s as usize], true) {
                            queue.push_back(s);
                        }
                    }
                    break;
                }
            }
        }
        swaps
    }

    /// The location of a site in a triangle; `None` if it is outside.
    fn place_in(&self, t: u32, site: &Site) -> Option<Place> {
        let v = self.mesh.at(t).v;
        let mut on = [false; 3];
        for i in 0..3 {
            let [a, b] = [v[next(i)], v[last(i)]].map(|v| &self.nodes[v as usize].site);
            match self.chart.orient(a, b, site) {
                Sign::Negative => return None,
                Sign::Zero => on[i] = true,
                Sign::Positive => {}
            }
        }
        Some(match on {
            [false, false, false] => Place::Inside(t),
            [true, false, false] => Place::OnSide(t, 0),
            [false, true, false] => Place::OnSide(t, 1),
            [false, false, true] => Place::OnSide(t, 2),
            // On two sides: at their common corner.
            [true, true, _] => Place::OnVertex(v[2]),
            [_, true, true] => Place::OnVertex(v[0]),
            [true, _, true] => Place::OnVertex(v[1]),
        })
    }

    /// Walks from a triangle to a site without crossing segments; `None` if a segment is in between
    /// or the walk is longer than `limit`.
    pub fn walk(&self, from: u32, site: &Site, limit: usize) -> Option<Place> {
        let mut t = from;
        let mut came_from = NONE;
        for _ in 0..limit {
            let x = self.mesh.at(t);
            let out = (0..3).find(|&i| {
                let [a, b] = [x.v[next(i)], x.v[last(i)]].map(|v| &self.nodes[v as usize].site);
                x.near[i] != came_from && self.chart.orient(a, b, site) == Sign::Negative
            });
            match out {
                None => return self.place_in(t, site),
                Some(i) if x.segment[i] != NONE || x.near[i] == NONE => return None,
                Some(i) => (came_from, t) = (t, x.near[i]),
            }
        }
        None
    }

    /// Locates a site by walking, or else by testing all triangles.
    pub fn locate(&self, from: u32, site: &Site) -> Option<Place> {
        /// Vertices are inserted in the order of curves, so the next one is close.
        const STEPS: usize = 1000;
        let walked = if from == NONE { None } else { self.walk(from, site, STEPS) };
        walked.or_else(|| self.mesh.living().find_map(|t| self.place_in(t, site)))
    }

    /// Inserts a new vertex and swaps around it; returns its number, or `None` if it is on a vertex
    /// or a segment.
    pub fn insert(&mut self, node: Node, place: Place) -> Option<u32> {
        let free = match place {
            Place::OnVertex(_) => false,
            Place::OnSide(t, i) => self.mesh.at(t).segment[i] == NONE && self.mesh.at(t).near[i] != NONE,
            Place::Inside(_) => true,
        };
        if !free {
            return None;
        }
        let v = self.nodes.len() as u32;
        self.nodes.push(node);
        self.mesh.add_vertex();
        self.insert_vertex(v, place);
        Some(v)
    }

    /// Inserts a vertex that is in no triangle yet and swaps around it.
    ///
    /// # Panics
    /// If the place is a vertex.
    pub fn insert_vertex(&mut self, v: u32, place: Place) {
        match place {
            Place::OnSide(t, i) => {
                let parts = self.mesh.split_side(t, i, v);
                self.legalise(v, &parts);
            }
            Place::Inside(t) => {
                let parts = self.mesh.split_triangle(t, v);
                self.legalise(v, &parts);
            }
            Place::OnVertex(w) => panic!("vertex {v} lies on vertex {w}"),
        }
    }

    /// The length of an edge, in units of the mean wanted size at its ends.
    pub fn length(&self, a: u32, b: u32) -> f64 {
        let [a, b] = [a, b].map(|v| &self.nodes[v as usize]);
        2.0 * (b.point - a.point).norm() / (a.size + b.size)
    }

    /// The largest price and the sum of squared prices of the triangles around a vertex, if it were
    /// `node`; `None` if one would be inverted in the chart.
    pub fn star_price(&self, v: u32, node: &Node, ring: &[u32]) -> Option<(f64, f64)> {
        let (mut worst, mut sum) = (0.0_f64, 0.0);
        for &t in ring {
            let x = self.mesh.at(t);
            let k = x.corner(v);
            let (a, b) = (&self.nodes[x.v[next(k)] as usize], &self.nodes[x.v[last(k)] as usize]);
            if self.chart.orient(&node.site, &a.site, &b.site) != Sign::Positive {
                return None;
            }
            let price = self.price([node, a, b]);
            worst = worst.max(price);
            sum += price * price;
        }
        Some((worst, sum))
    }
}
