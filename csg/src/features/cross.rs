//! Crossings of a third surface with the intersection curve of two others.

use super::contact::{Contact, Kind};
use super::neighborhood::Tolerances;
use super::octree::{Octree, can_meet};
use super::trace::{Trace, along, step_box};
use crate::interval::Cell;
use crate::project::project_to_both;
use crate::{Geometry, Interval, Point, Surface, SurfaceId, Vector};
use nalgebra::Matrix3;
use std::collections::BTreeMap;
use std::iter;

/// A point where another surface crosses or touches a trace.
#[derive(Clone, Copy, Debug)]
pub(super) struct Crossing {
    /// The parameter on the trace: index of the step plus the fraction of the step.
    pub position: f64,
    /// The coordinates.
    pub point: Point,
    /// The volume spanned by the three unit normals, a measure of how well the point is determined.
    pub volume: f64,
}

/// Crossings closer than this many merge tolerances (a thousandth of the diagonal) may be the same.
const NEAR: f64 = 1e5;

/// All crossings of a trace with other relevant surfaces, sorted by position.
pub(super) fn crossings(
    geometry: &Geometry,
    tree: &Octree,
    trace: &Trace,
    tolerances: &Tolerances,
) -> Vec<Crossing> {
    let [a, b] = trace.pair.map(|s| &geometry.surfaces[s.index()]);
    let mut by_surface: BTreeMap<SurfaceId, Vec<Crossing>> = BTreeMap::new();
    let mut found = Vec::new();
    // An apex on the curve need not separate the inside of its cone from the outside there.
    let apexes = geometry.surfaces.iter().filter_map(Surface::apex);
    let is_on_both = |p: &Point| a.distance(p).max(b.distance(p)) <= tolerances.on_surface;
    let given: Vec<Point> =
        geometry.user_points.iter().map(|user| user.point).chain(apexes).filter(is_on_both).collect();
    for (index, ends) in trace.points.windows(2).enumerate() {
        for id in tree.surfaces_in(&step_box(&ends[0], &ends[1])) {
            if trace.pair.contains(&id) {
                continue;
            }
            if tree.is_tangent_along(trace.pair, id) {
                continue;
            }
            let third = &geometry.surfaces[id.index()];
            let is_relevant = |cell: &Cell| tree.surfaces_in(cell).binary_search(&id).is_ok();
            // If the third surface is tangent to one of the pair, the crossing is ill-conditioned:
            // intersect with the seam's auxiliary surfaces instead.
            let auxiliaries = auxiliaries(geometry, trace.pair, id);
            let targets = if auxiliaries.is_empty() { vec![third] } else { auxiliaries };
            let mut finder = Finder { a, b, third, is_relevant: &is_relevant, tolerances, found: Vec::new() };
            if finder.contains_curve(ends) {
                continue;
            }
            for surface in targets {
                finder.third = surface;
                if !finder.contains_curve(ends) {
                    finder.find(&ends[0], &ends[1], 0);
                }
                finder.found.retain(|p| third.distance(p) <= tolerances.merge);
                by_surface.entry(id).or_default().extend(finder.crossings(index, ends));
            }
        }
        // Points where the seam and the residual intersection of a tangent pair cross.
        for id in residual_surfaces(geometry, tree, trace.pair) {
            let third = &geometry.surfaces[id.index()];
            let mut finder = Finder { a, b, third, is_relevant: &|_| true, tolerances, found: Vec::new() };
            if !finder.contains_curve(ends) {
                finder.find(&ends[0], &ends[1], 0);
                by_surface.entry(id).or_default().extend(finder.crossings(index, ends));
            }
        }
        for &point in &given {
            if let Some(part) = along(ends, &point) {
                found.push(Crossing { position: index as f64 + part, point, volume: 0.0 });
            }
        }
    }
    for (id, mut crossings) in by_surface {
        // A surface through a branch point is tangent there too; crossings close to it are rounding
        // errors.
        let last = trace.points.len() - 1;
        for (position, _) in [0, last].into_iter().zip(trace.branches).filter(|end| end.1) {
            let point = trace.points[position];
            if geometry.surfaces[id.index()].distance(&point) <= tolerances.on_surface {
                crossings.push(Crossing { position: position as f64, point, volume: 0.0 });
            }
        }
        found.extend(distinct(&geometry.surfaces[id.index()], crossings, tolerances));
    }
    for crossing in &mut found {
        crossing.point = snapped(geometry, tree, trace, crossing, tolerances);
    }
    found.sort_by(|x, y| x.position.total_cmp(&y.position));
    found
}

/// The point of a crossing, or the point of tangency of two surfaces if rounding cannot separate
/// both.
///
/// Example: a line in the tangent plane at the throat of a torus, along a branch of their
/// intersection, leaves the torus with the third power of the distance. Its crossing with the torus
/// is accurate only to the cube root of rounding; the point of contact is much more accurate.
fn snapped(
    geometry: &Geometry,
    tree: &Octree,
    trace: &Trace,
    crossing: &Crossing,
    tolerances: &Tolerances,
) -> Point {
    let at = crossing.point;
    let is_on = |s: &SurfaceId, p: &Point| geometry.surfaces[s.index()].distance(p) <= tolerances.on_surface;
    let is_same = |contact: &&Contact| {
        let middle = nalgebra::center(&at, &contact.point);
        (contact.point - at).norm() <= NEAR * tolerances.merge
            && contact.kind == Kind::Tangent
            && contact.pair.iter().all(|s| is_on(s, &at) && is_on(s, &middle))
            && trace.pair.iter().all(|s| is_on(s, &contact.point) && is_on(s, &middle))
            && geometry.seam(contact.pair).is_none()
    };
    tree.contacts.iter().find(is_same).map_or(at, |contact| contact.point)
}

/// The auxiliary surfaces that replace `third` if it is tangent to one of a pair along a seam.
///
/// They cut both tangent surfaces in their whole intersection. Empty if there is no seam, or if the
/// intersection is not completely known.
fn auxiliaries(geometry: &Geometry, pair: [SurfaceId; 2], third: SurfaceId) -> Vec<&Surface> {
    let seam_with =
        |s: SurfaceId| geometry.seam([s.min(third), s.max(third)]).filter(|seam| seam.is_complete);
    let Some(seam) = pair.into_iter().find_map(seam_with) else { return Vec::new() };
    let surfaces = iter::once(seam.surfaces).chain(seam.residual).flatten();
    surfaces.filter(|c| !seam.pair.contains(c)).map(|c| &geometry.surfaces[c.index()]).collect()
}

/// The surfaces that cut the residual intersection of the pairs tangent along the curve of `pair`.
fn residual_surfaces(geometry: &Geometry, tree: &Octree, pair: [SurfaceId; 2]) -> Vec<SurfaceId> {
    let seams = tree.tangent_pairs(pair).iter().filter_map(|&tangent| geometry.seam(tangent));
    let surfaces = seams.filter_map(|seam| Some([seam.surfaces, seam.residual?])).flatten().flatten();
    let mut found: Vec<SurfaceId> = surfaces.filter(|c| !pair.contains(c)).collect();
    found.sort_unstable();
    found.dedup();
    found
}

/// Removes repeated crossings with one surface: crossings are the same if the trace is on the
/// surface between them.
///
/// Rounding splits a point of tangency into two crossings, or into a crossing and an extremum.
/// Keeps the extremum, or else the crossing closest to the surface.
fn distinct(third: &Surface, mut crossings: Vec<Crossing>, tolerances: &Tolerances) -> Vec<Crossing> {
    /// The volume at an extremum found by bisection is below this (rounding).
    const EXTREMUM: f64 = 1e-10;
    crossings.sort_by(|x, y| x.position.total_cmp(&y.position));
    let rank = |c: &Crossing| if c.volume <= EXTREMUM { -1.0 } else { third.distance(&c.point) };
    let mut kept: Vec<Crossing> = Vec::new();
    let mut last: Option<Crossing> = None;
    for crossing in crossings {
        let repeats = last.is_some_and(|last| {
            let middle = nalgebra::center(&last.point, &crossing.point);
            let near = (crossing.point - last.point).norm() <= NEAR * tolerances.merge;
            near && third.distance(&middle) <= tolerances.on_surface
        });
        last = Some(crossing);
        match kept.last_mut().filter(|_| repeats) {
            Some(best) if rank(&crossing) < rank(best) => *best = crossing,
            Some(_) => {}
            None => kept.push(crossing),
        }
    }
    kept
}

fn nearer_end(ends: &[Point], point: &Point) -> f64 {
    if (point - ends[0]).norm_squared() <= (point - ends[1]).norm_squared() { 0.0 } else { 1.0 }
}

/// The volume spanned by the three unit normals.
fn volume(surfaces: &[&Surface; 3], at: &Point) -> f64 {
    let [u, v, w] = surfaces.map(|s| s.normal(at));
    u.cross(&v).dot(&w).abs()
}

/// Finds the points on the `third` surface along one step of the intersection of `a` and `b`.
struct Finder<'a> {
    a: &'a Surface,
    b: &'a Surface,
    third: &'a Surface,
    /// Whether the original third surface is relevant in a box.
    is_relevant: &'a dyn Fn(&Cell) -> bool,
    tolerances: &'a Tolerances,
    found: Vec<Point>,
}

impl Finder<'_> {
    /// Returns the crossings found on the step with this index.
    fn crossings(&mut self, index: usize, ends: &[Point]) -> Vec<Crossing> {
        let crossing = |point: Point| {
            let position = index as f64 + along(ends, &point).unwrap_or_else(|| nearer_end(ends, &point));
            Crossing { position, point, volume: volume(&[self.a, self.b, self.third], &point) }
        };
        self.found.drain(..).map(crossing).collect()
    }

    /// Whether the step lies in the third surface.
    fn contains_curve(&self, ends: &[Point]) -> bool {
        let near = |p: &Point| self.third.distance(p) <= self.tolerances.on_surface;
        let between = |part: f64| {
            let start = ends[0] + (ends[1] - ends[0]) * part;
            project_to_both(self.a, self.b, &start, self.tolerances.exact).is_ok_and(|p| near(&p))
        };
        near(&ends[0]) && near(&ends[1]) && between(0.31) && between(0.64)
    }

    /// Subdivides the step until the third function excludes zero, is monotone along the curve, or
    /// has one extremum.
    fn find(&mut self, p: &Point, q: &Point, depth: u32) {
        /// A fraction 10⁻⁹ of a step that is still unresolved contains at most one point.
        const DEPTH: u32 = 30;
        /// On 1/32 of a step, a derivative whose sign changes has exactly one root.
        const SHORT: u32 = 5;
        /// Depth at which relevance of the third surface is tested. Elsewhere the surface may be
        /// singular, and a long step may run along the singularity.
        const LOCAL: u32 = 6;
        if depth == 0 {
            // If an end of the step is on the surface, rounding may lose it in both adjacent steps.
            let ends: Vec<Point> = [p, q].into_iter().filter(|x| self.is_on(x)).copied().collect();
            self.found.extend(ends);
        }
        let cell = step_box(p, q);
        // A surface beside one of the two, such as a parallel plane, is excluded by a difference.
        if [self.a, self.b].iter().any(|near| !can_meet(near, self.third, &cell)) {
            return;
        }
        if depth == LOCAL && !(self.is_relevant)(&cell) {
            return;
        }
        let (u, v) = (self.a.gradient_range(&cell), self.b.gradient_range(&cell));
        let w = self.third.gradient_range(&cell);
        let cross = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
        let slope: Interval = w[0] * cross[0] + w[1] * cross[1] + w[2] * cross[2];
        if !slope.contains_zero() {
            self.find_between(p, q);
            return;
        }
        if depth >= SHORT && self.slope(p) * self.slope(q) < 0.0 {
            let extremum = self.bisect(*p, *q, |at| self.slope(at));
            if self.is_on(&extremum) {
                self.found.push(extremum);
            } else {
                self.find_between(p, &extremum);
                self.find_between(&extremum, q);
            }
            return;
        }
        let middle = self.middle(p, q);
        // A curve with contact of high order stays on the surface for some length: one node
        // represents it.
        if depth == DEPTH || [p, &middle, q].into_iter().all(|x| self.is_on(x)) {
            if self.is_on(&middle) {
                self.found.push(middle);
            } else {
                self.find_between(p, q);
            }
            return;
        }
        self.find(p, &middle, depth + 1);
        self.find(&middle, q, depth + 1);
    }

    fn is_on(&self, point: &Point) -> bool {
        self.third.distance(point) <= self.tolerances.on_surface
    }

    /// The derivative of the third function along the curve, up to a positive factor.
    fn slope(&self, at: &Point) -> f64 {
        self.third.gradient(at).dot(&self.a.gradient(at).cross(&self.b.gradient(at)))
    }

    /// The point of the curve halfway between two.
    fn middle(&self, p: &Point, q: &Point) -> Point {
        let middle = nalgebra::center(p, q);
        project_to_both(self.a, self.b, &middle, self.tolerances.exact).unwrap_or(middle)
    }

    /// The root of a function with values of opposite signs at two points of the curve, between
    /// them.
    fn bisect(&self, mut p: Point, mut q: Point, function: impl Fn(&Point) -> f64) -> Point {
        /// Enough to bisect a step down to rounding.
        const STEPS: usize = 56;
        let negative = function(&p) < 0.0;
        for _ in 0..STEPS {
            let middle = self.middle(&p, &q);
            if (function(&middle) < 0.0) == negative {
                p = middle;
            } else {
                q = middle;
            }
        }
        p
    }

    /// Finds the root between two points if the third function, monotone there, changes sign.
    fn find_between(&mut self, p: &Point, q: &Point) {
        let (low, high) = (self.third.value(p), self.third.value(q));
        if (low < 0.0) == (high < 0.0) {
            return;
        }
        let cell = step_box(p, q);
        let secant = p + (q - p) * (low / (low - high));
        let newton = self.newton(secant).filter(|x| (0..3).all(|i| cell[i].contains(x[i])));
        let root = newton.unwrap_or_else(|| self.bisect(*p, *q, |at| self.third.value(at)));
        self.found.push(root);
    }

    /// Newton's method on the three equations.
    fn newton(&self, start: Point) -> Option<Point> {
        const STEPS: usize = 20;
        let surfaces = [self.a, self.b, self.third];
        let mut at = start;
        let mut best = f64::INFINITY;
        for _ in 0..STEPS {
            let distance = surfaces.iter().map(|s| s.distance(&at)).fold(0.0, f64::max);
            if distance == 0.0 || (distance >= best && best <= self.tolerances.exact) {
                return Some(at);
            }
            best = best.min(distance);
            let gradients = surfaces.map(|s| s.gradient(&at).transpose());
            let values = Vector::from(surfaces.map(|s| s.value(&at)));
            at -= Matrix3::from_rows(&gradients).lu().solve(&values)?;
        }
        (best <= self.tolerances.exact).then_some(at)
    }
}
