//! Distance from an ellipse and range of its normal, for elliptic sweep paths.
//!
//! Let a and b be the semi-axes. At the normal (cos φ, sin φ) the radius of curvature is ρ =
//! a²b²/h³ with h² = a² cos² φ + b² sin² φ (do Carmo 1976, Differential geometry of curves and
//! surfaces, section 1-7). A point at signed distance q (positive outside) is ρ + q from the center
//! of curvature, so φ changes by 1/(ρ + q) per unit of length along the ellipse.

use super::quadric::nearest_on_ellipsoid;
use crate::Interval;

/// The nearest point of an ellipse about the origin, seen from a point.
#[derive(Clone, Copy, Debug)]
pub(super) struct Foot {
    /// The unit normal at the nearest point.
    pub normal: [f64; 2],
    /// The distance of the point from the ellipse, negative inside.
    pub distance: f64,
    /// The radius of curvature at the nearest point, and its derivative with respect to the angle
    /// of the normal.
    pub curvature_radius: [f64; 2],
}

/// The foot of a point on the ellipse.
pub(super) fn foot(radii: [f64; 2], at: [f64; 2]) -> Foot {
    let [a, b] = radii;
    let foot = nearest_on_ellipsoid(at, radii);
    let normal = unit([foot[0] / (a * a), foot[1] / (b * b)]);
    let distance = (at[0] - foot[0]) * normal[0] + (at[1] - foot[1]) * normal[1];
    let [c, s] = normal;
    let square = (a * c).powi(2) + (b * s).powi(2);
    let radius = (a * b).powi(2) / (square * square.sqrt());
    Foot { normal, distance, curvature_radius: [radius, 3.0 * radius * (a * a - b * b) * c * s / square] }
}

/// The unit normal at a parameter.
pub(super) fn normal_at([a, b]: [f64; 2], angle: f64) -> [f64; 2] {
    let (sin, cos) = angle.sin_cos();
    unit([b * cos, a * sin])
}

/// The parameter at which the ellipse has the given normal.
pub(super) fn angle_of([a, b]: [f64; 2], [c, s]: [f64; 2]) -> f64 {
    (b * s).atan2(a * c)
}

/// The least radius of curvature. Points closer to the ellipse than this have a unique nearest
/// point.
pub(super) fn least_curvature_radius([a, b]: [f64; 2]) -> f64 {
    a.min(b).powi(2) / a.max(b)
}

fn unit([x, y]: [f64; 2]) -> [f64; 2] {
    let length = x.hypot(y);
    [x / length, y / length]
}

/// Ranges over a disk around a point: of the normal, and of the distance from the center of
/// curvature.
///
/// Points on a segment of the longer axis have two nearest points; away from it the normal turns
/// smoothly. The normal turns by less than an angle if the radius of curvature within that angle is
/// large enough. If no bound is found, the ranges are all normals and all nonnegative distances.
pub(super) fn ranges(radii: [f64; 2], at: [f64; 2], reach: f64) -> ([Interval; 2], Interval) {
    /// Trial angles, relative to the angle for the radius of curvature at the center.
    const TRIALS: [f64; 3] = [1.2, 2.0, 5.0];
    let [a, b] = radii;
    let seen = foot(radii, at);
    // Rounding errors of the nearest point and of its normal.
    let slack = 16.0 * f64::EPSILON * (a.max(b) + at[0].hypot(at[1]));
    let blur = slack / least_curvature_radius(radii);
    let (along, across) = if a > b { (at[0], at[1]) } else { (at[1], at[0]) };
    let room = reach + slack;
    let has_two = across.abs() <= room && along.abs() - room <= (a * a - b * b).abs() / a.max(b);
    let middle = seen.curvature_radius[0] + seen.distance;
    for trial in TRIALS.map(|trial| trial * reach / middle + 2.0 * blur) {
        if has_two || !(trial > 0.0 && trial < std::f64::consts::FRAC_PI_2) {
            break;
        }
        let far = |turn: f64| curvature_radius_range(radii, turned(seen.normal, turn));
        let arm = |radius: Interval| radius + Interval::new(seen.distance - room, seen.distance + room);
        let least = arm(far(trial)).lo;
        let turn = reach / least + blur;
        if least > 0.0 && turn <= trial {
            return (turned(seen.normal, turn), arm(far(turn)));
        }
    }
    ([Interval::new(-1.0, 1.0); 2], Interval::new(0.0, f64::INFINITY))
}

/// The range of a unit vector rotated by at most the angle `turn`, less than a right angle.
fn turned([c, s]: [f64; 2], turn: f64) -> [Interval; 2] {
    let cos = Interval::new(turn.cos() - f64::EPSILON, 1.0);
    let sin = Interval::new(-turn.sin(), turn.sin());
    [cos * c - sin * s, cos * s + sin * c].map(|x| x.intersect(Interval::new(-1.0, 1.0)))
}

/// The range of the radius of curvature for a range of normals.
fn curvature_radius_range([a, b]: [f64; 2], normal: [Interval; 2]) -> Interval {
    let (least, most) = (a.min(b).powi(2), a.max(b).powi(2));
    let square = (normal[0] * a).square() + (normal[1] * b).square();
    let square = Interval::new(square.lo.max(least), square.hi.min(most).max(least));
    Interval::point((a * b).powi(2)) / (square * square.sqrt())
}
