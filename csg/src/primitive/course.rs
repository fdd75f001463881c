//! Points beside an ellipse: their distance from it, and how its normal turns.
//!
//! An ellipse with semi-axes a and b has the normal (cos φ, sin φ) where its radius of curvature is ρ = a²b²/h³ with h² = a² cos² φ + b² sin² φ
//! (do Carmo 1976, Differential geometry of curves and surfaces, section 1-7). A point at the distance q from it, outside positive,
//! is ρ + q away from the centre of curvature: φ changes by 1/(ρ + q) per unit of length along it.

use super::quadric::nearest_on_ellipsoid;
use crate::Interval;

/// What an ellipse about the origin is seen from a point.
#[derive(Clone, Copy, Debug)]
pub(super) struct Beside {
    /// Its unit normal at the nearest point.
    pub normal: [f64; 2],
    /// How far the point is from it, negative inside.
    pub distance: f64,
    /// Its radius of curvature at the nearest point, and the derivative of that by the angle of the normal.
    pub bend: [f64; 2],
}

/// The ellipse as seen from a point.
pub(super) fn beside(radii: [f64; 2], at: [f64; 2]) -> Beside {
    let [a, b] = radii;
    let foot = nearest_on_ellipsoid(at, radii);
    let normal = unit([foot[0] / (a * a), foot[1] / (b * b)]);
    let distance = (at[0] - foot[0]) * normal[0] + (at[1] - foot[1]) * normal[1];
    let [c, s] = normal;
    let square = (a * c).powi(2) + (b * s).powi(2);
    let radius = (a * b).powi(2) / (square * square.sqrt());
    Beside { normal, distance, bend: [radius, 3.0 * radius * (a * a - b * b) * c * s / square] }
}

/// The unit normal where the parameter has this value.
pub(super) fn normal_at([a, b]: [f64; 2], angle: f64) -> [f64; 2] {
    let (sin, cos) = angle.sin_cos();
    unit([b * cos, a * sin])
}

/// The parameter where the normal is this one.
pub(super) fn angle_of([a, b]: [f64; 2], [c, s]: [f64; 2]) -> f64 {
    (b * s).atan2(a * c)
}

/// The least radius of curvature: nearer than that to the ellipse each point has one nearest point.
pub(super) fn least_bend([a, b]: [f64; 2]) -> f64 {
    a.min(b).powi(2) / a.max(b)
}

fn unit([x, y]: [f64; 2]) -> [f64; 2] {
    let length = x.hypot(y);
    [x / length, y / length]
}

/// Ranges over a disk around a point: of the normal, and of the distance from the centre of curvature (all that are not negative where
/// that is not known).
///
/// Off the segment of its longer axis whose points have two nearest ones the normal turns smoothly. It turns by less than an angle if within that
/// angle the radius of curvature is large enough that it could not have turned so far.
pub(super) fn ranges(radii: [f64; 2], at: [f64; 2], reach: f64) -> ([Interval; 2], Interval) {
    /// Angles that are tried, in those by which the normal turns where the radius of curvature is that at the middle.
    const TRIALS: [f64; 3] = [1.2, 2.0, 5.0];
    let [a, b] = radii;
    let seen = beside(radii, at);
    // Rounding of the nearest point, and of the normal there.
    let slack = 16.0 * f64::EPSILON * (a.max(b) + at[0].hypot(at[1]));
    let blur = slack / least_bend(radii);
    let (along, across) = if a > b { (at[0], at[1]) } else { (at[1], at[0]) };
    let room = reach + slack;
    let has_two = across.abs() <= room && along.abs() - room <= (a * a - b * b).abs() / a.max(b);
    let middle = seen.bend[0] + seen.distance;
    for trial in TRIALS.map(|trial| trial * reach / middle + 2.0 * blur) {
        if has_two || !(trial > 0.0 && trial < std::f64::consts::FRAC_PI_2) {
            break;
        }
        let far = |turn: f64| bend_range(radii, turned(seen.normal, turn));
        let arm = |bend: Interval| bend + Interval::new(seen.distance - room, seen.distance + room);
        let least = arm(far(trial)).lo;
        let turn = reach / least + blur;
        if least > 0.0 && turn <= trial {
            return (turned(seen.normal, turn), arm(far(turn)));
        }
    }
    ([Interval::new(-1.0, 1.0); 2], Interval::new(0.0, f64::INFINITY))
}

/// The range of a unit vector that turns by an angle at most, less than a right one.
fn turned([c, s]: [f64; 2], turn: f64) -> [Interval; 2] {
    let cos = Interval::new(turn.cos() - f64::EPSILON, 1.0);
    let sin = Interval::new(-turn.sin(), turn.sin());
    [cos * c - sin * s, cos * s + sin * c].map(|x| x.intersect(Interval::new(-1.0, 1.0)))
}

/// The range of the radius of curvature where the normal is in a range.
fn bend_range([a, b]: [f64; 2], normal: [Interval; 2]) -> Interval {
    let (least, most) = (a.min(b).powi(2), a.max(b).powi(2));
    let square = (normal[0] * a).square() + (normal[1] * b).square();
    let square = Interval::new(square.lo.max(least), square.hi.min(most).max(least));
    Interval::point((a * b).powi(2)) / (square * square.sqrt())
}
