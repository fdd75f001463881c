//! Traces intersection curves of pairs of surfaces from seeds.

use super::contact::{Contact, Kind};
use super::neighborhood::Tolerances;
use super::octree::{Octree, is_monotone};
use crate::interval::Cell;
use crate::project::{project_to_both, shortest_step};
use crate::{Curve, Geometry, Interval, Point, Surface, SurfaceId, Vector};
use std::ops::Range;

/// A piece of the intersection curve of two surfaces.
#[derive(Clone, Debug)]
pub(super) struct Trace {
    /// The surfaces, ascending.
    pub pair: [SurfaceId; 2],
    /// Points on it, in the direction of the cross product of the two gradients. A closed trace
    /// repeats the first point at the end.
    pub points: Vec<Point>,
    /// Whether it is a closed curve.
    pub closed: bool,
    /// Whether its start and its end are branch points: tangencies of the surfaces, or an apex.
    pub branches: [bool; 2],
}

/// Largest angle (radians) between consecutive points, below the quarter radian of
/// [`Curve::trace`].
const TURN: f64 = 0.2;
/// Margin of the box around a step, as a fraction of the step. An arc that turns by [`TURN`]
/// deviates from its chord by less than a twentieth.
const ROOM: f64 = 0.1;
/// Smallest step as a fraction of the diagonal.
const LEAST_STEP: f64 = 1e-9;
/// Largest number of points of a trace.
const MOST_POINTS: usize = 1_000_000;
/// A curve heading for a branch point within this fraction of the radius of curvature reaches it.
const NEAR_BRANCH: f64 = 1e-2;

impl Trace {
    /// Whether a point of the intersection of both surfaces lies on one of some steps.
    ///
    /// In the box of a step, the curve has at most one point on each plane perpendicular to the
    /// step (see [`is_monotone`]).
    pub fn passes(&self, steps: Range<usize>, point: &Point) -> bool {
        let points = &self.points[steps.start..self.points.len().min(steps.end + 1)];
        points.windows(2).any(|ends| along(ends, point).is_some())
    }

    /// The point at a position (step index plus fraction), on the chord of the step.
    pub fn at(&self, position: f64) -> Point {
        let step = (position.max(0.0) as usize).min(self.points.len() - 2);
        self.points[step] + (self.points[step + 1] - self.points[step]) * (position - step as f64)
    }
}

/// The fraction (0 to 1) along a step of a point on the curve, if the point is in the box of the
/// step.
pub(super) fn along(ends: &[Point], point: &Point) -> Option<f64> {
    /// Tolerance for rounding of the fraction.
    const SLACK: f64 = 1e-9;
    let chord = ends[1] - ends[0];
    let position = (point - ends[0]).dot(&chord) / chord.norm_squared();
    let cell = step_box(&ends[0], &ends[1]);
    ((-SLACK..=1.0 + SLACK).contains(&position) && (0..3).all(|i| cell[i].contains(point[i])))
        .then_some(position.clamp(0.0, 1.0))
}

/// The box that contains the curve along a step.
pub(super) fn step_box(p: &Point, q: &Point) -> Cell {
    let room = ROOM * (q - p).norm();
    [0, 1, 2].map(|i| Interval::new(p[i].min(q[i]) - room, p[i].max(q[i]) + room))
}

/// Traces one intersection curve.
pub(super) struct Tracer<'a> {
    tree: &'a Octree,
    pair: [SurfaceId; 2],
    surfaces: [&'a Surface; 2],
    tolerances: &'a Tolerances,
    diagonal: f64,
    /// Contacts of the pair: the curve may branch at tangencies and ends at an apex.
    branch_points: Vec<Contact>,
}

impl<'a> Tracer<'a> {
    pub fn new(
        geometry: &'a Geometry,
        tree: &'a Octree,
        pair: [SurfaceId; 2],
        tolerances: &'a Tolerances,
    ) -> Self {
        let surfaces = pair.map(|s| &geometry.surfaces[s.index()]);
        let diagonal = tree.root.iter().map(|side| side.width().powi(2)).sum::<f64>().sqrt();
        let branch_points = tree.contacts.iter().filter(|c| c.pair == pair).copied().collect();
        Self { tree, pair, surfaces, tolerances, diagonal, branch_points }
    }

    /// Traces the curve through a point of the intersection, both ways.
    pub fn trace(&self, seed: &Point) -> Trace {
        let closed = |points| Trace { pair: self.pair, points, closed: true, branches: [false; 2] };
        let (mut points, end) = self.follow(seed, seed, 1.0);
        if end == End::Closed {
            return closed(points);
        }
        // The steps of the other direction may pass over the gap at which this end stopped.
        let stop = if end == End::Left { points[points.len() - 1] } else { *seed };
        let (mut backward, start) = self.follow(seed, &stop, -1.0);
        backward.reverse();
        backward.pop();
        backward.append(&mut points);
        if start == End::Closed {
            return closed(backward);
        }
        let branches = [start, end].map(|e| e == End::Branch);
        Trace { pair: self.pair, points: backward, closed: false, branches }
    }

    /// The points from the seed along `sign` times the tangent, at most up to `stop`.
    fn follow(&self, seed: &Point, stop: &Point, sign: f64) -> (Vec<Point>, End) {
        let mut points = vec![*seed];
        let mut reach = f64::INFINITY;
        loop {
            let at = points[points.len() - 1];
            let (tangent, curvature) = self.direction(&at, sign);
            if let Some(branch) = self.branch_ahead(&at, &tangent) {
                points.push(branch);
                return (points, End::Branch);
            }
            let mut step = reach.min(TURN / curvature).min(self.diagonal);
            let next = loop {
                if step < LEAST_STEP * self.diagonal || points.len() > MOST_POINTS {
                    return (points, End::Lost);
                }
                match self.step(&at, &tangent, step, sign) {
                    Some(next) => break next,
                    None => step *= 0.5,
                }
            };
            // If the stop is the seed, the first step starts there.
            if (points.len() > 1 || stop != seed) && along(&[at, next], stop).is_some() {
                points.push(*stop);
                return (points, End::Closed);
            }
            points.push(next);
            if !self.is_relevant(&next) {
                return (points, End::Left);
            }
            reach = 2.0 * step;
        }
    }

    /// Whether the intersection is relevant at a point.
    fn is_relevant(&self, point: &Point) -> bool {
        self.tree.leaf(point).is_some_and(|leaf| self.tree.is_relevant(leaf, self.pair))
    }

    fn direction(&self, at: &Point, sign: f64) -> (Vector, f64) {
        let [a, b] = self.surfaces;
        (tangent(a, b, at) * sign, curvature(a, b, at))
    }

    /// The next point, if it is proved to be on the same piece and the curve turns little.
    fn step(&self, at: &Point, tangent: &Vector, step: f64, sign: f64) -> Option<Point> {
        let [a, b] = self.surfaces;
        let next = project_to_both(a, b, &(at + tangent * step), self.tolerances.exact).ok()?;
        let chord = next - at;
        let length = chord.norm();
        if !(0.5 * step..=1.5 * step).contains(&length) {
            return None;
        }
        let turned = |u: &Vector, v: &Vector| u.dot(v).clamp(-1.0, 1.0).acos() > 1.2 * TURN;
        let ahead = self.direction(&next, sign).0;
        if turned(tangent, &ahead) || turned(tangent, &(chord / length)) {
            return None;
        }
        is_monotone(a, b, &step_box(at, &next), &(chord * sign)).then_some(next)
    }

    /// The branch point directly ahead, if the curve is close to one.
    fn branch_ahead(&self, at: &Point, tangent: &Vector) -> Option<Point> {
        let curvature = self.surfaces.iter().map(|s| s.curvature(at)).fold(0.0, f64::max);
        let is_ahead = |branch: &&Contact| {
            let way = branch.point - at;
            let distance = way.norm();
            let is_near = match branch.kind {
                Kind::Tangent => distance * curvature <= NEAR_BRANCH,
                Kind::Apex => distance <= branch.reach,
            };
            is_near && way.dot(tangent) > 0.995 * distance
        };
        self.branch_points.iter().find(is_ahead).map(|branch| branch.point)
    }
}

/// Why tracing stopped.
#[derive(Clone, Copy, PartialEq, Eq)]
enum End {
    /// It reached the stop point.
    Closed,
    /// One of the surfaces is no longer relevant.
    Left,
    /// It reached a tangency of the surfaces, or an apex.
    Branch,
    /// The steps became too small.
    Lost,
}

/// The unit tangent of the intersection of two surfaces in the direction of the cross product of
/// their gradients.
pub(super) fn tangent(a: &Surface, b: &Surface, at: &Point) -> Vector {
    a.gradient(at).cross(&b.gradient(at)).try_normalize(0.0).unwrap_or_default()
}

/// The curvature of the intersection of two surfaces, 1/length; infinite where they are tangent.
///
/// In terms of arc length, ∇f·c'' = -c'ᵀ(∇²f)c' for both functions, and c''·c' = 0 (Goldman 2005,
/// Curvature formulas for implicit curves and surfaces, section 5).
fn curvature(a: &Surface, b: &Surface, at: &Point) -> f64 {
    let t = tangent(a, b, at);
    let gradients = [a.gradient(at), b.gradient(at)];
    let values = [a, b].map(|s| t.dot(&(s.hessian(at) * t)));
    let squares = gradients.map(|g| g.norm_squared());
    shortest_step(values, gradients, squares).map_or(f64::INFINITY, |bend| bend.norm())
}

/// The unit tangent of a curve at one of its points, in the curve's direction.
///
/// At an end where its surfaces are tangent, the direction of the adjacent trace step.
#[cfg(test)]
pub(super) fn curve_tangent(geometry: &Geometry, curve: &Curve, at: &Point) -> Vector {
    let [a, b] = curve.surfaces.map(|s| &geometry.surfaces[s.index()]);
    let step = nearest_step(curve, at);
    tangent_along(a, b, at, &(curve.trace[step + 1] - curve.trace[step]))
}

/// The unit tangent of the intersection of two surfaces, oriented along a nearby chord.
///
/// Where the surfaces are tangent, the direction of the chord.
pub(super) fn tangent_along(a: &Surface, b: &Surface, at: &Point, chord: &Vector) -> Vector {
    let along = tangent(a, b, at);
    match (is_transversal(a, b, at, chord), along.dot(chord) < 0.0) {
        (false, _) => chord.normalize(),
        (true, true) => -along,
        (true, false) => along,
    }
}

/// The curvature of a curve at one of its points, 1/length.
///
/// Near an end where its surfaces are tangent, the curvature at the middle of the trace step, or
/// that of the trace if the surfaces are nearly tangent there too.
pub(super) fn curve_curvature(geometry: &Geometry, curve: &Curve, at: &Point) -> f64 {
    let [a, b] = curve.surfaces.map(|s| &geometry.surfaces[s.index()]);
    let chord = inward(curve, at);
    let middle = at + chord * 0.5;
    let steady = [*at, middle].into_iter().find(|p| is_transversal(a, b, p, &chord));
    steady.map_or_else(|| trace_curvature(curve, at, chord.norm()), |p| curvature(a, b, &p))
}

/// The curvature of the trace next to a point: the turn between its nearest step and the next one
/// of at least half its length, per distance of their middles.
fn trace_curvature(curve: &Curve, at: &Point, length: f64) -> f64 {
    let (trace, step) = (&curve.trace, nearest_step(curve, at));
    let far = |i: &usize| (trace[*i] - trace[step + 1]).norm() >= 0.5 * length;
    let far_back = |i: &usize| (trace[*i] - trace[step]).norm() >= 0.5 * length;
    let own = trace[step + 1] - trace[step];
    let other = match (step + 2..trace.len()).find(far) {
        Some(i) => trace[i] - trace[step + 1],
        None => match (0..step).rev().find(far_back) {
            Some(i) => trace[step] - trace[i],
            None => return 0.0,
        },
    };
    own.angle(&other) / (0.5 * (own.norm() + other.norm()))
}

/// Whether two surfaces cross at an angle large enough to compute the tangent from their gradients.
///
/// `chord` sets the length scale.
fn is_transversal(a: &Surface, b: &Surface, at: &Point, chord: &Vector) -> bool {
    /// Smallest sine; second derivatives of the intersection lose twice its digits.
    const LEAST_SINE: f64 = 1e-4;
    /// An apex counts only within this fraction of the chord.
    const APEX: f64 = 1e-6;
    let within = APEX * chord.norm();
    let is_regular = ![a, b].iter().any(|s| s.has_apex_at(at, within));
    is_regular && a.normal(at).cross(&b.normal(at)).norm() > LEAST_SINE
}

/// Index of the trace step nearest to a point.
fn nearest_step(curve: &Curve, at: &Point) -> usize {
    let middle = |i: usize| nalgebra::center(&curve.trace[i], &curve.trace[i + 1]);
    let distance = |i: usize| (middle(i) - at).norm() - 0.5 * (curve.trace[i + 1] - curve.trace[i]).norm();
    (1..curve.trace.len() - 1).fold(0, |best, i| if distance(i) < distance(best) { i } else { best })
}

/// The vector from a point at one end of a trace step to the other end.
fn inward(curve: &Curve, at: &Point) -> Vector {
    let i = nearest_step(curve, at);
    let ends = [curve.trace[i] - at, curve.trace[i + 1] - at];
    if ends[0].norm_squared() > ends[1].norm_squared() { ends[0] } else { ends[1] }
}
