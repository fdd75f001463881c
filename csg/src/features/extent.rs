//! The bounding box of all bodies.

use super::Features;
use super::neighborhood::{Tolerances, sheet_at};
use super::octree::Octree;
use crate::project::project_to_both;
use crate::{Aabb, Geometry, Point, Surface, SurfaceId, Vector};

/// The bounding box of corners, curves and closed surfaces.
///
/// A coordinate attains its maximum at a corner, inside a curve, or inside a patch at a point whose
/// normal is parallel to the axis. On planes, cylinders and cones such points form whole lines,
/// which end on curves.
pub(super) fn extent(
    geometry: &Geometry,
    tree: &Octree,
    features: &Features,
    tolerances: &Tolerances,
) -> Aabb {
    let mut points: Vec<Point> = features.corners.iter().map(|c| c.point).collect();
    for curve in &features.curves {
        let closed = curve.ends.is_none();
        let trace = &curve.trace;
        points.extend(trace);
        let last = trace.len() - 1;
        let surfaces = curve.surfaces.map(|s| &geometry.surfaces[s.index()]);
        for i in 0..last {
            // In a closed trace, the point before the first is the last but one.
            let before = match i {
                0 if closed => trace[last - 1],
                0 => continue,
                _ => trace[i - 1],
            };
            for axis in 0..3 {
                let steps = [trace[i][axis] - before[axis], trace[i + 1][axis] - trace[i][axis]];
                if steps[0] * steps[1] <= 0.0 && steps != [0.0; 2] {
                    let sign = if steps[0] > 0.0 || steps[1] < 0.0 { 1.0 } else { -1.0 };
                    points.push(turning_point(surfaces, [before, trace[i + 1]], axis, sign, tolerances));
                }
            }
        }
    }
    for (i, surface) in geometry.surfaces.iter().enumerate() {
        for axis in [Vector::x(), Vector::y(), Vector::z()] {
            for point in [surface.support(&axis), surface.support(&-axis)].into_iter().flatten() {
                if may_be_boundary(geometry, tree, SurfaceId::new(i), &point, tolerances) {
                    points.push(point);
                }
            }
        }
    }
    let mut bounds = Aabb { min: points[0], max: points[0] };
    for point in &points {
        bounds.min = bounds.min.inf(point);
        bounds.max = bounds.max.sup(point);
    }
    bounds
}

/// Whether a surface is a boundary at a point, for some choice of sides of the other surfaces
/// through the point.
fn may_be_boundary(
    geometry: &Geometry,
    tree: &Octree,
    id: SurfaceId,
    point: &Point,
    tolerances: &Tolerances,
) -> bool {
    let Some(leaf) = tree.leaf(point) else { return false };
    let touches =
        |s: &SurfaceId| *s != id && geometry.surfaces[s.index()].distance(point) <= tolerances.on_surface;
    let touching: Vec<SurfaceId> = leaf.surfaces.iter().copied().filter(touches).collect();
    (0..1_u32 << touching.len().min(8)).any(|sides| {
        let other_side = |s: SurfaceId| match touching.iter().position(|&t| t == s) {
            Some(i) => sides >> i & 1 == 1,
            None => geometry.surfaces[s.index()].value(point) > 0.0,
        };
        // An error belongs to sides that do not occur: bodies overlap on them.
        matches!(sheet_at(geometry, tree, id, point, &other_side), Ok(Some(_)))
    })
}

/// The point between two points of a curve at which `sign` times a coordinate is largest (ternary
/// search).
fn turning_point(
    [a, b]: [&Surface; 2],
    [mut from, mut to]: [Point; 2],
    axis: usize,
    sign: f64,
    tolerances: &Tolerances,
) -> Point {
    /// Each step keeps two thirds. Below 10⁻⁸ of the interval the coordinate no longer changes.
    const STEPS: usize = 45;
    let on = |p: Point| project_to_both(a, b, &p, tolerances.exact).unwrap_or(p);
    for _ in 0..STEPS {
        let (p, q) = (on(from + (to - from) / 3.0), on(to + (from - to) / 3.0));
        if sign * p[axis] < sign * q[axis] {
            from = p;
        } else {
            to = q;
        }
    }
    on(nalgebra::center(&from, &to))
}
