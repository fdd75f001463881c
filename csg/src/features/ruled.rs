//! Cones and cylinders that are tangent along a common line.
//!
//! Let z be the height over the common tangent plane and y the distance from the line within that
//! plane. Both functions contain only the terms y², yz, z² and z times a linear function. Scaled to
//! the same coefficient of y², their difference is z times a linear function. So the intersection
//! is the line, counted twice, and a conic in a plane (Levin 1976 calls such a member of the pencil
//! a pair of planes). Where that plane crosses the line, both surfaces have equal curvature and
//! exchange sides.

use super::seam::{PARALLEL, perpendicular, plane};
use crate::primitive::Cone;
use crate::{Point, Surface, Vector};

/// The plane of a conic at more than this many extents of all surfaces cuts none of the bodies.
const FAR: f64 = 1e6;

/// A line along which two surfaces are tangent.
pub(super) struct TangentLine {
    /// A plane that cuts the first surface in the line.
    pub auxiliary: Surface,
    /// The plane that cuts the first surface in the residual intersection of both.
    pub residual: Option<Surface>,
}

/// The line along which two cones, or a cone and a cylinder, are tangent.
///
/// `tolerance` is the largest gap between coincident objects, `extent` the size of the geometry.
pub(super) fn tangent_line([a, b]: [&Surface; 2], tolerance: f64, extent: f64) -> Option<TangentLine> {
    let [a, b] = [quadric(a)?, quadric(b)?];
    let [point, along] = candidates([&a, &b], tolerance).into_iter().find_map(|(point, along)| {
        // Far enough from both apexes for the directions to be significant.
        let at = point + along * extent;
        let off = b.project(&at).map_or(f64::INFINITY, |p| (p - at).norm());
        let is_tangent = a.normal(&at).cross(&b.normal(&at)).norm() <= PARALLEL;
        (b.distance(&point) <= tolerance && off <= PARALLEL * extent + tolerance && is_tangent)
            .then_some([point.coords, along])
    })?;
    let at = Point::from(point) + along * extent;
    let normal = a.normal(&at);
    let auxiliary = plane(Point::from(point), along.cross(&normal))?;
    Some(TangentLine { auxiliary, residual: residual([&a, &b], &at, &along, &normal, extent) })
}

/// The quadric that contains a ruled surface.
fn quadric(surface: &Surface) -> Option<Surface> {
    match surface {
        Surface::Nappe(c) => {
            Some(Surface::Cone(Cone { point: c.point, axis: c.axis, radius: c.radius, slope: c.slope }))
        }
        Surface::Cone(_) | Surface::EllipticCone(_) | Surface::Cylinder(_) | Surface::EllipticCylinder(_) => {
            Some(surface.clone())
        }
        _ => None,
    }
}

/// Lines of the first surface that may also lie on the second, each as a point and a direction.
fn candidates([a, b]: [&Surface; 2], tolerance: f64) -> Vec<(Point, Vector)> {
    // The line of a cone nearest to a point other than its apex.
    let line_to = |cone: &Surface, apex: Point, target: Point| {
        let on = cone.project(&target).ok()?;
        Some((apex, (on - apex).try_normalize(tolerance)?))
    };
    let found = match (a.apex(), b.apex()) {
        (Some(p), Some(q)) if (q - p).norm() > tolerance => line_to(a, p, q),
        (Some(p), Some(_)) => return lines_between_axes(a, b, p),
        (Some(p), None) => direction(b).and_then(|along| line_to(a, p, p + along)),
        (None, Some(q)) => direction(a).and_then(|along| Some((a.project(&q).ok()?, along))),
        (None, None) => None,
    };
    found.into_iter().collect()
}

/// The direction of the generators of a cylinder.
fn direction(surface: &Surface) -> Option<Vector> {
    match surface {
        Surface::Cylinder(c) => Some(c.axis),
        Surface::EllipticCylinder(c) => Some(c.axis()),
        _ => None,
    }
}

/// The lines of a circular cone in the plane of its axis and the axis of another cone with the same
/// apex.
fn lines_between_axes(a: &Surface, b: &Surface, apex: Point) -> Vec<(Point, Vector)> {
    let (Surface::Cone(c), Surface::Cone(d)) = (a, b) else { return Vec::new() };
    let Some(side) = perpendicular(&d.axis, &c.axis).try_normalize(PARALLEL) else { return Vec::new() };
    [c.slope, -c.slope].map(|slope| (apex, (c.axis + side * slope).normalize())).into()
}

/// The plane of the residual conic of two quadrics that are tangent along a line through `at`.
fn residual(
    [a, b]: [&Surface; 2],
    at: &Point,
    along: &Vector,
    normal: &Vector,
    extent: f64,
) -> Option<Surface> {
    let side = along.cross(normal);
    let [p, q] = [a, b].map(|s| {
        let hessian = s.hessian(at);
        let bend = side.dot(&(hessian * side));
        (s.gradient(at) / bend, hessian / bend)
    });
    let (slope, bend) = (normal.dot(&(p.0 - q.0)), (p.1 - q.1) * normal);
    let gradient = bend - normal * (0.5 * normal.dot(&bend));
    let steepness = gradient.norm();
    if slope.abs() >= FAR * extent * steepness {
        return None;
    }
    plane(at - gradient * (slope / (steepness * steepness)), gradient / steepness)
}
