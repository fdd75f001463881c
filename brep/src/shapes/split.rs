//! Edges that pass through a pole of their surface, divided there, and those that bound no face.
//!
//! At a pole of a sphere, or the apex of a cone, the direction around the axis jumps, which a curve
//! in the parameters can do at its ends only.

use super::Shapes;
use crate::model::{Corner, EdgeCurve};
use crate::nearest::nearest_on_curve;
use crate::{Point, Surface};

/// Edges at most this far from a pole pass through it (fraction of the diagonal).
const THROUGH: f64 = 1e-7;

/// Divides the edges of all faces at the poles of the faces' surfaces.
pub(super) fn divide_at_poles(shapes: &mut Shapes, diagonal: f64) {
    for number in 0..shapes.faces.len() {
        for pole in poles(&shapes.faces[number].surface, diagonal) {
            let mut curves: Vec<usize> =
                shapes.faces[number].loops.iter().flatten().map(|edge| edge.0).collect();
            curves.sort_unstable();
            curves.dedup();
            for curve in curves {
                let through = THROUGH * diagonal;
                if let Some(at) = inner_parameter(&shapes.curves[curve], &pole, through, 10.0 * through) {
                    let tolerance = shapes.curves[curve].tolerance;
                    let corner =
                        shapes.add_corner(Corner { point: pole, tolerance }, shapes.body_of_curve[curve]);
                    divide(shapes, curve, at, corner);
                }
            }
        }
    }
}

fn poles(surface: &Surface, diagonal: f64) -> Vec<Point> {
    if !matches!(surface, Surface::Round { .. } | Surface::Revolution { .. }) {
        return Vec::new();
    }
    let height = |is_upper: bool| surface.pole(1, is_upper, THROUGH * diagonal);
    [false, true].into_iter().filter_map(height).map(|v| surface.point([0.0, v])).collect()
}

/// The parameter at which a curve passes through a point, if it does so further than `at_end` from
/// its ends.
pub(super) fn inner_parameter(edge: &EdgeCurve, point: &Point, tolerance: f64, at_end: f64) -> Option<f64> {
    let foot = nearest_on_curve(&edge.curve, point);
    if (foot.point - point).norm() > tolerance {
        return None;
    }
    let [low, high] = edge.range;
    let mut at = foot.parameter;
    if let Some(period) = edge.curve.period() {
        at = low + (at - low).rem_euclid(period);
    }
    let is_inner = low < at && at < high;
    let is_at_end = |end: f64| (Point::from(edge.curve.point(end)) - point).norm() <= at_end;
    (is_inner && !is_at_end(low) && !is_at_end(high)).then_some(at)
}

/// Divides a curve at a corner; all loops follow both halves afterwards. The first half keeps the
/// index of the curve.
fn divide(shapes: &mut Shapes, curve: usize, at: f64, corner: usize) {
    let faces: Vec<usize> = (0..shapes.faces.len()).collect();
    divide_in(shapes, &faces, curve, at, corner);
}

/// Divides a curve that only these faces may have at a corner.
pub(super) fn divide_in(shapes: &mut Shapes, faces: &[usize], curve: usize, at: f64, corner: usize) {
    let second = shapes.curves.len();
    let edge = &mut shapes.curves[curve];
    let [low, high] = edge.range;
    let half = EdgeCurve { range: [at, high], ends: [corner, edge.ends[1]], ..edge.clone() };
    (edge.range, edge.ends) = ([low, at], [edge.ends[0], corner]);
    shapes.curves.push(half);
    shapes.body_of_curve.push(shapes.body_of_curve[curve]);
    for &face in faces {
        let face = &mut shapes.faces[face];
        for edges in &mut face.loops {
            // From the end: the places before stay.
            for k in (0..edges.len()).rev().filter(|&k| edges[k].0 == curve).collect::<Vec<_>>() {
                let is_forward = edges[k].1;
                edges.insert(k + usize::from(is_forward), (second, is_forward));
            }
        }
        if face.inner.contains(&curve) {
            face.inner.push(second);
        }
    }
}

/// Drops edges of planes that a loop follows forth and at once back, and no other loop follows:
/// they have the face on both sides. Returns a note.
pub(super) fn drop_spurs(shapes: &mut Shapes) -> Option<String> {
    let mut uses = vec![0; shapes.curves.len()];
    let edges = shapes.faces.iter().flat_map(|face| face.loops.iter().flatten());
    edges.for_each(|edge| uses[edge.0] += 1);
    let (mut dropped, mut first) = (0, 0);
    for (number, face) in shapes.faces.iter_mut().enumerate().filter(|(_, face)| face.surface.is_plane()) {
        for edges in &mut face.loops {
            let spur = |edges: &[(usize, bool)]| {
                let next = edges.iter().cycle().skip(1);
                let mut pairs = edges.iter().zip(next).filter(|_| edges.len() > 2);
                pairs
                    .find(|(one, next)| one.0 == next.0 && one.1 != next.1 && uses[one.0] == 2)
                    .map(|pair| pair.0.0)
            };
            while let Some(curve) = spur(edges) {
                edges.retain(|edge| edge.0 != curve);
                (dropped, first) = (dropped + 1, if dropped == 0 { number + 1 } else { first });
            }
        }
    }
    (dropped > 0).then(|| {
        format!("{dropped} edges with one face on both sides are left out, the first in face {first}")
    })
}
