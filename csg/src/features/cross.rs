//! Where a third surface crosses the intersection of two others.

use super::around::Tolerances;
use super::octree::Octree;
use super::trace::{Trace, along, step_box};
use crate::project::project_to_both;
use crate::{Geometry, Interval, Point, Surface, Vector};
use nalgebra::Matrix3;

/// A point where another surface crosses or touches a trace.
#[derive(Clone, Copy, Debug)]
pub(super) struct Crossing {
    /// Its position: the step in which it lies, plus the part of the step before it.
    pub position: f64,
    /// Where.
    pub point: Point,
    /// The volume spanned by the three unit normals: how well the point is determined.
    pub volume: f64,
}

/// The crossings of a trace with all other surfaces that matter there, in order.
pub(super) fn crossings(
    geometry: &Geometry,
    tree: &Octree,
    trace: &Trace,
    tolerances: &Tolerances,
) -> Vec<Crossing> {
    let [a, b] = trace.pair.map(|s| &geometry.surfaces[s.index()]);
    let mut found = Vec::new();
    for (index, ends) in trace.points.windows(2).enumerate() {
        for id in tree.surfaces_in(&step_box(&ends[0], &ends[1])) {
            if trace.pair.contains(&id) {
                continue;
            }
            let mut finder =
                Finder { a, b, third: &geometry.surfaces[id.index()], tolerances, found: Vec::new() };
            if !finder.contains_curve(ends) {
                finder.find(&ends[0], &ends[1], 0);
            }
            for point in finder.found {
                let position = index as f64 + along(ends, &point).unwrap_or_else(|| nearer_end(ends, &point));
                found.push(Crossing { position, point, volume: volume(&[a, b, finder.third], &point) });
            }
        }
        for user in &geometry.user_points {
            let on_both = a.distance(&user.point).max(b.distance(&user.point)) <= tolerances.on_surface;
            if let (true, Some(part)) = (on_both, along(ends, &user.point)) {
                found.push(Crossing { position: index as f64 + part, point: user.point, volume: 0.0 });
            }
        }
    }
    found.sort_by(|x, y| x.position.total_cmp(&y.position));
    found
}

fn nearer_end(ends: &[Point], point: &Point) -> f64 {
    if (point - ends[0]).norm_squared() <= (point - ends[1]).norm_squared() { 0.0 } else { 1.0 }
}

/// The volume spanned by the three unit normals.
fn volume(surfaces: &[&Surface; 3], at: &Point) -> f64 {
    let [u, v, w] = surfaces.map(|s| s.normal(at));
    u.cross(&v).dot(&w).abs()
}

/// Finds the points of one step of the intersection of `a` and `b` on the `third` surface.
struct Finder<'a> {
    a: &'a Surface,
    b: &'a Surface,
    third: &'a Surface,
    tolerances: &'a Tolerances,
    found: Vec<Point>,
}

impl Finder<'_> {
    /// Whether the step lies in the third surface.
    fn contains_curve(&self, ends: &[Point]) -> bool {
        let near = |p: &Point| self.third.distance(p) <= self.tolerances.on_surface;
        let between = |part: f64| {
            let start = ends[0] + (ends[1] - ends[0]) * part;
            project_to_both(self.a, self.b, &start, self.tolerances.exact).is_ok_and(|p| near(&p))
        };
        near(&ends[0]) && near(&ends[1]) && between(0.31) && between(0.64)
    }

    /// Splits the step until on each part the third function excludes zero or is monotone along the curve.
    fn find(&mut self, p: &Point, q: &Point, depth: u32) {
        /// A part of 10⁻⁹ of a step on which the function is not monotone is a touching point.
        const DEPTH: u32 = 30;
        if depth == 0 {
            // An end of the step on the surface may be lost to rounding on both sides of it.
            let tolerance = self.tolerances.on_surface;
            self.found.extend([p, q].into_iter().filter(|x| self.third.distance(x) <= tolerance).copied());
        }
        let cell = step_box(p, q);
        if !self.third.value_range(&cell).contains_zero() {
            return;
        }
        let (u, v) = (self.a.gradient_range(&cell), self.b.gradient_range(&cell));
        let w = self.third.gradient_range(&cell);
        let cross = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
        let slope: Interval = w[0] * cross[0] + w[1] * cross[1] + w[2] * cross[2];
        let (at_p, at_q) = (self.third.value(p), self.third.value(q));
        if !slope.contains_zero() {
            if (at_p < 0.0) != (at_q < 0.0) {
                self.found.push(self.root(*p, *q));
            }
            return;
        }
        let middle = nalgebra::center(p, q);
        let middle = project_to_both(self.a, self.b, &middle, self.tolerances.exact).unwrap_or(middle);
        if depth == DEPTH {
            if (at_p < 0.0) != (at_q < 0.0) || self.third.distance(&middle) <= self.tolerances.on_surface {
                self.found.push(middle);
            }
            return;
        }
        self.find(p, &middle, depth + 1);
        self.find(&middle, q, depth + 1);
    }

    /// The one root between two points with values of opposite signs.
    fn root(&self, mut p: Point, mut q: Point) -> Point {
        /// Bisection halves the step to less than its rounding.
        const STEPS: usize = 60;
        let cell = step_box(&p, &q);
        let (low, high) = (self.third.value(&p), self.third.value(&q));
        let secant = p + (q - p) * (low / (low - high));
        if let Some(point) = self.newton(secant) {
            if (0..3).all(|i| cell[i].contains(point[i])) {
                return point;
            }
        }
        for _ in 0..STEPS {
            let middle = nalgebra::center(&p, &q);
            let Ok(middle) = project_to_both(self.a, self.b, &middle, self.tolerances.exact) else { break };
            if (self.third.value(&middle) < 0.0) == (low < 0.0) {
                p = middle;
            } else {
                q = middle;
            }
        }
        p
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
