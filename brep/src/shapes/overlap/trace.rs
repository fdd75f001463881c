//! Branches of the intersection of two surfaces, followed point by point.
//!
//! Each point is on both surfaces up to rounding, by Newton's method in the plane of their normals;
//! the next one is sought along the cross product of the normals (Patrikalakis and Maekawa 2002,
//! "Shape Interrogation for Computer Aided Design and Manufacturing", sections 5.8.1 and 5.8.2).

use crate::nearest::nearest_on_surface;
use crate::project::project_to_surface;
use crate::{Point, Surface, Vector};

/// The most steps of Newton's method; it converges quadratically.
const NEWTON_STEPS: usize = 30;
/// Surfaces that meet at a smaller angle (radians) touch each other: no branch is followed.
const LEAST_ANGLE: f64 = 1e-5;
/// A branch turns at most by this angle (radians) in a step.
const MOST_TURN: f64 = 0.4;
/// The curve between two points is this close to the surfaces (fraction of the diagonal).
pub(super) const OFF: f64 = 1e-9;
/// Steps are not shorter (fraction of the diagonal).
const SHORTEST: f64 = 1e-7;
/// The first step (fraction of the box around both faces).
const FIRST_STEP: f64 = 0.02;
/// A branch has at most this many points in one direction.
const MOST_POINTS: usize = 5_000;

/// A point of two surfaces.
#[derive(Clone, Copy)]
pub(super) struct Meeting {
    pub point: Point,
    /// Its parameters on both surfaces.
    parameters: [[f64; 2]; 2],
    /// The unit tangent of the branch.
    pub tangent: Vector,
    /// The second derivative along the length of the branch.
    pub bend: Vector,
}

impl Meeting {
    /// The same point of the branch in the direction in which another tangent points.
    fn along(self, other: &Self) -> Self {
        let sign = if self.tangent.dot(&other.tangent) < 0.0 { -1.0 } else { 1.0 };
        Self { tangent: self.tangent * sign, ..self }
    }
}

/// Points along a branch, the first of a closed one also at its end.
pub(super) struct Branch {
    pub points: Vec<Meeting>,
    pub is_closed: bool,
}

impl Branch {
    /// Starts a closed branch at another one of its points.
    pub fn rotate(&mut self, start: usize) {
        self.points.pop();
        self.points.rotate_left(start);
        self.points.push(self.points[0]);
    }
}

/// Two surfaces within a box.
pub(super) struct Pair<'a> {
    pub surfaces: [&'a Surface; 2],
    pub bounds: [Point; 2],
    /// The diagonal of the model.
    pub size: f64,
}

impl Pair<'_> {
    pub fn contains(&self, point: &Point) -> bool {
        (0..3).all(|axis| (self.bounds[0][axis]..=self.bounds[1][axis]).contains(&point[axis]))
    }

    /// How far the surfaces are apart at a place near them.
    pub fn gap(&self, place: &Point) -> f64 {
        let [a, b] = self.surfaces.map(|surface| nearest_on_surface(surface, place).point);
        (b - a).norm()
    }

    /// The point of both surfaces nearest to one near them; `None` if there is none, or if the
    /// surfaces are tangent there.
    pub fn meet(&self, near: Point, mut parameters: [[f64; 2]; 2]) -> Option<Meeting> {
        let mut point = near;
        let rounding = 1e-13 * (self.size + near.coords.amax());
        for _ in 0..NEWTON_STEPS {
            let feet = [0, 1].map(|k| project_to_surface(self.surfaces[k], &point, parameters[k]));
            if feet.iter().any(|foot| !foot.is_converged) {
                return None;
            }
            parameters = feet.map(|foot| foot.parameters);
            let [m, n] = feet.map(|foot| foot.normal);
            let off = feet.map(|foot| (foot.point - point).dot(&foot.normal));
            let tangent = m.cross(&n);
            let squared = tangent.norm_squared();
            // Poles have no normal.
            if squared.is_nan() || squared < LEAST_ANGLE * LEAST_ANGLE {
                return None;
            }
            let cosine = m.dot(&n);
            // The vector across the branch with these components along both normals.
            let across =
                |[a, b]: [f64; 2]| m * ((a - cosine * b) / squared) + n * ((b - cosine * a) / squared);
            let step = across(off);
            point += step;
            if step.norm() <= rounding {
                let tangent = tangent / squared.sqrt();
                let curvature = |k: usize| self.normal_curvature(k, parameters[k], &feet[k].normal, &tangent);
                let bend = across([0, 1].map(curvature));
                return Some(Meeting { point, parameters, tangent, bend });
            }
        }
        None
    }

    /// The curvature of a surface along a tangent, in the direction of its normal.
    fn normal_curvature(&self, which: usize, [u, v]: [f64; 2], normal: &Vector, tangent: &Vector) -> f64 {
        let d = self.surfaces[which].jet(u, v, 2).d;
        let form = [d[1][0].norm_squared(), d[1][0].dot(&d[0][1]), d[0][1].norm_squared()];
        let along = [tangent.dot(&d[1][0]), tangent.dot(&d[0][1])];
        let determinant = form[0] * form[2] - form[1] * form[1];
        let a = (form[2] * along[0] - form[1] * along[1]) / determinant;
        let b = (form[0] * along[1] - form[1] * along[0]) / determinant;
        normal.dot(&(d[2][0] * (a * a) + d[1][1] * (2.0 * a * b) + d[0][2] * (b * b)))
    }

    /// The branch through a point, as far as it is inside the box.
    pub fn branch(&self, start: Meeting) -> Branch {
        let (mut points, is_closed) = self.follow(start);
        if !is_closed {
            let back = Meeting { tangent: -start.tangent, ..start };
            let (before, _) = self.follow(back);
            let turned = before.into_iter().skip(1).rev().map(|m| Meeting { tangent: -m.tangent, ..m });
            points = turned.chain(points).collect();
        }
        Branch { points, is_closed }
    }

    /// Points along a branch in the direction of the tangent, and whether it came back.
    fn follow(&self, start: Meeting) -> (Vec<Meeting>, bool) {
        let mut step = FIRST_STEP * (self.bounds[1] - self.bounds[0]).norm();
        let mut points = vec![start];
        let mut last = start;
        while step > SHORTEST * self.size && points.len() < MOST_POINTS {
            let Some(next) = self.step(&last, step) else {
                step *= 0.5;
                continue;
            };
            if points.len() > 2 && passes(&last, &next, &start) {
                points.push(start);
                return (points, true);
            }
            points.push(next);
            last = next;
            if !self.contains(&next.point) {
                break;
            }
            step *= 1.5;
        }
        (points, false)
    }

    /// The point after one; `None` if the step is too long.
    fn step(&self, from: &Meeting, step: f64) -> Option<Meeting> {
        let ahead = from.point + from.tangent * step + from.bend * (0.5 * step * step);
        let next = self.meet(ahead, from.parameters)?.along(from);
        let way = next.point - from.point;
        let is_near = way.norm() < 1.5 * step && way.dot(&from.tangent) > 0.5 * step;
        if !is_near || from.tangent.angle(&next.tangent) > MOST_TURN {
            return None;
        }
        let [a, b, c, d, e, f] = poles([from, &next]);
        let middle = Point::from((a + f + (b + e) * 5.0 + (c + d) * 10.0) / 32.0);
        let exact = self.meet(middle, from.parameters)?;
        ((exact.point - middle).norm() <= OFF * self.size).then_some(next)
    }

    /// The surface, and the direction of its parameters, that a closed branch goes around.
    pub fn surrounded(&self, branch: &Branch) -> Option<(usize, usize)> {
        let all = (0..2).flat_map(|which| (0..2).map(move |direction| (which, direction)));
        all.into_iter().find(|&(which, direction)| {
            let Some(period) = self.surfaces[which].periods()[direction] else { return false };
            let steps = branch.points.windows(2).map(|w| {
                let step = w[1].parameters[which][direction] - w[0].parameters[which][direction];
                step - period * (step / period).round()
            });
            steps.sum::<f64>().abs() > 0.5 * period
        })
    }

    /// Starts a closed branch where a parameter of a surface that it goes around has a value;
    /// `false` if that place is not found.
    pub fn start_at(&self, branch: &mut Branch, which: usize, direction: usize, at: f64) -> bool {
        /// Steps to the place.
        const STEPS: usize = 4;
        /// No point is added this close to another one (fraction of the distance of the next).
        const BESIDE: f64 = 0.01;
        let Some(period) = self.surfaces[which].periods()[direction] else { return false };
        let off = |m: &Meeting| {
            let off = m.parameters[which][direction] - at;
            off - period * (off / period).round()
        };
        for k in 0..branch.points.len() - 1 {
            let (mut low, mut high) = (branch.points[k], branch.points[k + 1]);
            let crosses = |a: &Meeting, b: &Meeting| (off(a) < 0.0) != (off(b) < 0.0);
            if !crosses(&low, &high) || (off(&low) - off(&high)).abs() > 0.5 * period {
                continue;
            }
            for _ in 0..STEPS {
                let share = off(&low) / (off(&low) - off(&high));
                let near = low.point + (high.point - low.point) * share;
                let Some(found) = self.meet(near, low.parameters) else { return false };
                let found = found.along(&low);
                if crosses(&low, &found) { high = found } else { low = found }
            }
            let start = if off(&low).abs() < off(&high).abs() { low } else { high };
            let [before, after] = [k, k + 1].map(|k| (branch.points[k].point - start.point).norm());
            let near = BESIDE * (before + after);
            if before > near && after > near {
                branch.points.insert(k + 1, start);
            }
            branch.rotate(if before > near { k + 1 } else { k });
            return true;
        }
        false
    }

    /// Whether a point of both surfaces is on a branch.
    pub fn is_on(&self, branch: &Branch, place: &Meeting) -> bool {
        /// Points beside a chord, in its length, may be on the branch: more than it bends by.
        const BESIDE: f64 = 0.1;
        branch.points.windows(2).any(|w| {
            let way = w[1].point - w[0].point;
            let to = place.point - w[0].point;
            let share = (to.dot(&way) / way.norm_squared()).clamp(0.0, 1.0);
            let on = w[0].point + way * share;
            if (place.point - on).norm() > BESIDE * way.norm() {
                return false;
            }
            let same = self.meet(on, w[0].parameters);
            // The branch turns from its chord by half of that at most.
            let near = (place.point - on).norm() * MOST_TURN + SHORTEST * self.size;
            same.is_some_and(|same| (same.point - place.point).norm() <= near)
        })
    }
}

/// The poles of the curve of degree 5 between two points, with the first two derivatives that the
/// branch has along its length.
pub(super) fn poles([a, b]: [&Meeting; 2]) -> [Vector; 6] {
    let length = arc([a, b]);
    let [first, second] = [length / 5.0, length * length / 20.0];
    [
        a.point.coords,
        a.point.coords + a.tangent * first,
        a.point.coords + a.tangent * (2.0 * first) + a.bend * second,
        b.point.coords - b.tangent * (2.0 * first) + b.bend * second,
        b.point.coords - b.tangent * first,
        b.point.coords,
    ]
}

/// The length of the branch between two points, as of an arc with these tangents.
pub(super) fn arc(ends: [&Meeting; 2]) -> f64 {
    let half = 0.5 * ends[0].tangent.angle(&ends[1].tangent);
    let chord = (ends[1].point - ends[0].point).norm();
    if half < 1e-4 { chord } else { chord * half / half.sin() }
}

/// Whether the way between two points of a branch passes through a third one.
fn passes(from: &Meeting, to: &Meeting, place: &Meeting) -> bool {
    let way = to.point - from.point;
    let share = (place.point - from.point).dot(&way) / way.norm_squared();
    let beside = (from.point + way * share - place.point).norm();
    (0.0..=1.0).contains(&share) && beside <= MOST_TURN * way.norm() && from.tangent.dot(&place.tangent) > 0.5
}
