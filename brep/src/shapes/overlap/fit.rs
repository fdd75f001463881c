//! The curve through the points of a branch: a line, a circle, or a spline.

use super::trace::{Branch, OFF, arc, poles};
use crate::bspline::{Basis, SplineCurve};
use crate::{Curve, Point, Vector};
use std::f64::consts::TAU;

/// Points are on a line or circle if they are this close to it (fraction of the diagonal).
const EXACT: f64 = 1e-11;

/// A curve along a branch.
pub(super) struct Fitted {
    pub curve: Curve<3>,
    /// The parameters of the first and the last point.
    pub range: [f64; 2],
    pub is_closed: bool,
}

/// The curve along a branch; `None` if that has one point.
pub(super) fn curve(branch: &Branch, size: f64) -> Option<Fitted> {
    if branch.points.len() < 2 {
        return None;
    }
    let room = EXACT * size;
    let found = line(branch, room).or_else(|| circle(branch, room)).or_else(|| spline(branch));
    found.map(|(curve, range)| Fitted { curve, range, is_closed: branch.is_closed })
}

/// How far such a curve is from the surfaces at most (fraction of the diagonal).
pub(super) const ACCURACY: f64 = OFF;

fn line(branch: &Branch, room: f64) -> Option<(Curve<3>, [f64; 2])> {
    let [first, last] = [&branch.points[0], &branch.points[branch.points.len() - 1]];
    let way = (last.point - first.point).try_normalize(0.0)?;
    let off = |to: Vector| (to - way * way.dot(&to)).norm();
    // Tangents tell an arc between two points.
    let length = (last.point - first.point).norm();
    let is_straight =
        branch.points.iter().all(|m| off(m.point - first.point) <= room && off(m.tangent) * length <= room);
    let direction = last.point - first.point;
    is_straight.then_some((Curve::Line { start: first.point.coords, direction }, [0.0, 1.0]))
}

fn circle(branch: &Branch, room: f64) -> Option<(Curve<3>, [f64; 2])> {
    let first = &branch.points[0];
    let far = branch.points[branch.points.len() / 2].point - first.point;
    let out = far - first.tangent * first.tangent.dot(&far);
    let to_center = out.try_normalize(0.0)?;
    let radius = far.norm_squared() / (2.0 * out.norm());
    let center = first.point + to_center * radius;
    let (x, y) = (-to_center, first.tangent);
    let axis = x.cross(&y);
    let is_on = |p: &Point| {
        let to = p - center;
        axis.dot(&to).abs() <= room && (to.norm() - radius).abs() <= room
    };
    if !branch.points.iter().all(|m| is_on(&m.point) && axis.dot(&m.tangent).abs() * radius <= room) {
        return None;
    }
    let angle = |p: &Point| (p - center).dot(&y).atan2((p - center).dot(&x));
    let turned = |w: &[super::trace::Meeting]| (angle(&w[1].point) - angle(&w[0].point)).rem_euclid(TAU);
    let end = if branch.is_closed { TAU } else { branch.points.windows(2).map(turned).sum() };
    let curve = Curve::Ellipse { center: center.coords, axes: [x * radius, y * radius] };
    (end <= TAU).then_some((curve, [0.0, end]))
}

/// The spline of degree 5 through all points with their derivatives, over the length of the branch.
fn spline(branch: &Branch) -> Option<(Curve<3>, [f64; 2])> {
    const DEGREE: usize = 5;
    let points = &branch.points;
    let mut knots = vec![0.0];
    let mut all = vec![points[0].point.coords];
    for w in points.windows(2) {
        let ends = [&w[0], &w[1]];
        knots.push(knots[knots.len() - 1] + arc(ends));
        all.extend(&poles(ends)[1..]);
    }
    let basis = Basis::clamped(DEGREE, &knots, DEGREE).ok()?;
    let range = basis.range();
    Some((Curve::Spline(SplineCurve { basis, poles: all, weights: Vec::new() }), range))
}
