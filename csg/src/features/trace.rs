//! Intersection curves of pairs of surfaces, followed from seeds.

use super::around::Tolerances;
use super::contact::{Contact, Kind};
use super::octree::{Octree, is_monotone};
use crate::interval::Cell;
use crate::project::{project_to_both, shortest_step};
use crate::{Curve, Geometry, Interval, Point, Surface, SurfaceId, Vector};

/// A piece of the intersection of two surfaces.
#[derive(Clone, Debug)]
pub(super) struct Trace {
    /// The surfaces, ascending.
    pub pair: [SurfaceId; 2],
    /// Points on it, along the cross product of the two gradients. A closed one repeats the first at the end.
    pub points: Vec<Point>,
    /// Whether it is a closed curve.
    pub closed: bool,
    /// Whether it starts and ends at a point where the surfaces are tangent.
    pub branches: [bool; 2],
}

/// The largest angle, in radians, that a curve turns by from one point to the next: under the quarter that
/// [`Curve::trace`] promises.
const TURN: f64 = 0.2;
/// By how much of a step the box around it is larger than the box of its ends: an arc that turns by [`TURN`] leaves
/// its chord by less than a twentieth.
const ROOM: f64 = 0.1;
/// A step below this part of the diagonal gets nowhere.
const LEAST_STEP: f64 = 1e-9;
/// A curve with more points than this does not end.
const MOST_POINTS: usize = 1_000_000;
/// Near a branch point within this part of the radius of curvature, a curve that heads for it is taken to reach it.
const NEAR_BRANCH: f64 = 1e-2;

impl Trace {
    /// Whether a point of the intersection of its two surfaces lies on this piece.
    ///
    /// In the box around a step the curve has one point on each plane across the step (see [`is_monotone`]).
    pub fn passes(&self, point: &Point) -> bool {
        self.points.windows(2).any(|ends| along(ends, point).is_some())
    }

    /// The point at a position: a step, plus the part of the step before it. On the chord of that step.
    pub fn at(&self, position: f64) -> Point {
        let step = (position.max(0.0) as usize).min(self.points.len() - 2);
        self.points[step] + (self.points[step + 1] - self.points[step]) * (position - step as f64)
    }
}

/// The position of a point of the curve along a step, 0 to 1, if it is in the box of the step.
pub(super) fn along(ends: &[Point], point: &Point) -> Option<f64> {
    /// Rounding of the position.
    const SLACK: f64 = 1e-9;
    let chord = ends[1] - ends[0];
    let position = (point - ends[0]).dot(&chord) / chord.norm_squared();
    let cell = step_box(&ends[0], &ends[1]);
    ((-SLACK..=1.0 + SLACK).contains(&position) && (0..3).all(|i| cell[i].contains(point[i])))
        .then_some(position.clamp(0.0, 1.0))
}

/// The box around a step in which the curve stays between its ends.
pub(super) fn step_box(p: &Point, q: &Point) -> Cell {
    let room = ROOM * (q - p).norm();
    [0, 1, 2].map(|i| Interval::new(p[i].min(q[i]) - room, p[i].max(q[i]) + room))
}

/// Follows one curve.
pub(super) struct Tracer<'a> {
    tree: &'a Octree,
    pair: [SurfaceId; 2],
    surfaces: [&'a Surface; 2],
    tolerances: &'a Tolerances,
    diagonal: f64,
    /// Where the two surfaces are tangent and the curve may branch, and where it ends at an apex.
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

    /// The curve through a point of the intersection.
    pub fn trace(&self, seed: &Point) -> Trace {
        let closed = |points| Trace { pair: self.pair, points, closed: true, branches: [false; 2] };
        let (mut points, end) = self.follow(seed, seed, 1.0);
        if end == End::Closed {
            return closed(points);
        }
        // Steps the other way may pass over the gap where this end was left.
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

    /// The points from the seed on, along the tangent times `sign`, at most to `stop`.
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
            // The first step begins at the stop if that is the seed.
            if (points.len() > 1 || stop != seed) && along(&[at, next], stop).is_some() {
                points.push(*stop);
                return (points, End::Closed);
            }
            points.push(next);
            if !self.matters(&next) {
                return (points, End::Left);
            }
            reach = 2.0 * step;
        }
    }

    /// Whether the intersection matters at a point.
    fn matters(&self, point: &Point) -> bool {
        self.tree.leaf(point).is_some_and(|leaf| self.tree.matters(leaf, self.pair))
    }

    fn direction(&self, at: &Point, sign: f64) -> (Vector, f64) {
        let [a, b] = self.surfaces;
        (tangent(a, b, at) * sign, curvature(a, b, at))
    }

    /// A point one step on, if it is proved to be on the same piece and the curve turns little.
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

    /// The branch point that the curve is about to reach.
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

/// How a curve ends.
#[derive(Clone, Copy, PartialEq, Eq)]
enum End {
    /// Where it was to stop.
    Closed,
    /// Where one of its surfaces no longer matters.
    Left,
    /// At a point where its surfaces are tangent.
    Branch,
    /// Where steps became too small.
    Lost,
}

/// The unit tangent of the intersection of two surfaces, along the cross product of their gradients.
pub(super) fn tangent(a: &Surface, b: &Surface, at: &Point) -> Vector {
    a.gradient(at).cross(&b.gradient(at)).try_normalize(0.0).unwrap_or_default()
}

/// The curvature of the intersection of two surfaces, 1/length; infinite where they are tangent.
///
/// Along the curve by arc length, ∇f·c'' = -c'ᵀ(∇²f)c' for both functions, and c''·c' = 0
/// (Goldman 2005, Curvature formulas for implicit curves and surfaces, section 5).
fn curvature(a: &Surface, b: &Surface, at: &Point) -> f64 {
    let t = tangent(a, b, at);
    let gradients = [a.gradient(at), b.gradient(at)];
    let values = [a, b].map(|s| t.dot(&(s.hessian(at) * t)));
    let squares = gradients.map(|g| g.norm_squared());
    shortest_step(values, gradients, squares).map_or(f64::INFINITY, |bend| bend.norm())
}

/// The unit tangent of a curve at a point on it, in its direction.
///
/// At an end where its surfaces are tangent, that of the trace there.
pub fn curve_tangent(geometry: &Geometry, curve: &Curve, at: &Point) -> Vector {
    let [a, b] = curve.surfaces.map(|s| &geometry.surfaces[s.index()]);
    let step = nearest_step(curve, at);
    tangent_along(a, b, at, &(curve.trace[step + 1] - curve.trace[step]))
}

/// The unit tangent of the intersection of two surfaces in the direction of a chord nearby; the chord's own where the
/// surfaces are tangent.
pub(super) fn tangent_along(a: &Surface, b: &Surface, at: &Point, chord: &Vector) -> Vector {
    let along = tangent(a, b, at);
    match (cross_well(a, b, at, chord), along.dot(chord) < 0.0) {
        (false, _) => chord.normalize(),
        (true, true) => -along,
        (true, false) => along,
    }
}

/// The curvature of a curve at a point on it, 1/length.
///
/// At an end where its surfaces are tangent, that at the middle of the step of the trace there.
pub fn curve_curvature(geometry: &Geometry, curve: &Curve, at: &Point) -> f64 {
    let [a, b] = curve.surfaces.map(|s| &geometry.surfaces[s.index()]);
    let chord = inward(curve, at);
    if cross_well(a, b, at, &chord) { curvature(a, b, at) } else { curvature(a, b, &(at + chord * 0.5)) }
}

/// Whether two surfaces cross at an angle at which their gradients tell the tangent of the intersection; a chord gives the size
/// of things.
fn cross_well(a: &Surface, b: &Surface, at: &Point, chord: &Vector) -> bool {
    /// The sine; the second derivatives of the intersection lose twice its digits.
    const LEAST_SINE: f64 = 1e-4;
    /// An apex is nearer than this part of the chord, or it is elsewhere.
    const APEX: f64 = 1e-6;
    let within = APEX * chord.norm();
    let is_regular = ![a, b].iter().any(|s| s.has_apex_at(at, within));
    is_regular && a.normal(at).cross(&b.normal(at)).norm() > LEAST_SINE
}

/// The step of the trace that is nearest to a point.
fn nearest_step(curve: &Curve, at: &Point) -> usize {
    let middle = |i: usize| nalgebra::center(&curve.trace[i], &curve.trace[i + 1]);
    let distance = |i: usize| (middle(i) - at).norm() - 0.5 * (curve.trace[i + 1] - curve.trace[i]).norm();
    (1..curve.trace.len() - 1).fold(0, |best, i| if distance(i) < distance(best) { i } else { best })
}

/// The way from a point at an end of a step of the trace to its other end.
fn inward(curve: &Curve, at: &Point) -> Vector {
    let i = nearest_step(curve, at);
    let ends = [curve.trace[i] - at, curve.trace[i + 1] - at];
    if ends[0].norm_squared() > ends[1].norm_squared() { ends[0] } else { ends[1] }
}
