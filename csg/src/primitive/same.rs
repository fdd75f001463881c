//! Comparison of surfaces as point sets.

use super::quadric::tangents;
use super::{Ellipsoid, EllipticCone, EllipticCylinder, Nappe, Plane, Revolved, Section, Sweep, Torus};
use crate::{Surface, Vector};
use nalgebra::Matrix3;

/// Largest sine of an angle, and largest relative difference of slopes, between equal surfaces.
///
/// Directions in files have five or six digits: 1.5708 for a right angle is off by 3.7e-6 and means
/// the same surface. Two surfaces that cross at a smaller angle leave a wedge that no mesh
/// resolves. (NETGEN uses 1.4e-4.)
const SAME_DIRECTION: f64 = 1e-5;

fn parallel(a: &Vector, b: &Vector) -> bool {
    a.cross(b).norm() <= SAME_DIRECTION
}

/// Converts spheres to ellipsoids, and circular cylinders and cones to elliptic ones.
fn generalized(surface: &Surface) -> Surface {
    match surface {
        Surface::Sphere(s) => Surface::Ellipsoid(Ellipsoid {
            center: s.center,
            axes: [Vector::x(), Vector::y(), Vector::z()],
            radii: [s.radius; 3],
        }),
        Surface::Cylinder(c) => {
            let (u, v) = tangents(&c.axis);
            Surface::EllipticCylinder(EllipticCylinder { point: c.point, axes: [u, v], radii: [c.radius; 2] })
        }
        Surface::Cone(c) => {
            let (u, v) = tangents(&c.axis);
            Surface::EllipticCone(EllipticCone {
                point: c.point,
                axes: [u, v],
                radii: [c.radius; 2],
                axis: c.axis,
                rate: c.slope / c.radius,
            })
        }
        other => other.clone(),
    }
}

/// Compares two surfaces, see [`Surface::same_as`].
pub fn same(a: &Surface, b: &Surface, tolerance: f64) -> Option<bool> {
    match (generalized(a), generalized(b)) {
        (Surface::Plane(a), Surface::Plane(b)) => same_plane(&a, &b, tolerance),
        (Surface::Torus(a), Surface::Torus(b)) => same_torus(&a, &b, tolerance).then_some(true),
        (Surface::Ellipsoid(a), Surface::Ellipsoid(b)) => same_ellipsoid(&a, &b, tolerance).then_some(true),
        (Surface::EllipticCylinder(a), Surface::EllipticCylinder(b)) => {
            same_elliptic_cylinder(&a, &b, tolerance).then_some(true)
        }
        (Surface::EllipticCone(a), Surface::EllipticCone(b)) => {
            same_elliptic_cone(&a, &b, tolerance).then_some(true)
        }
        (Surface::Nappe(a), Surface::Nappe(b)) => same_nappe(&a, &b, tolerance).then_some(true),
        (Surface::Sweep(a), Surface::Sweep(b)) => same_sweep(&a, &b, tolerance).then_some(true),
        (Surface::Revolved(a), Surface::Revolved(b)) => same_revolved(&a, &b, tolerance).then_some(true),
        _ => None,
    }
}

fn same_plane(a: &Plane, b: &Plane, tolerance: f64) -> Option<bool> {
    let between = b.point - a.point;
    let apart = a.normal.dot(&between).abs().max(b.normal.dot(&between).abs());
    (parallel(&a.normal, &b.normal) && apart <= tolerance).then(|| a.normal.dot(&b.normal) > 0.0)
}

fn same_torus(a: &Torus, b: &Torus, tolerance: f64) -> bool {
    parallel(&a.axis, &b.axis)
        && (a.center - b.center).norm() <= tolerance
        && (a.major - b.major).abs() <= tolerance
        && (a.minor - b.minor).abs() <= tolerance
}

/// The matrix with the given eigenvectors and eigenvalues; independent of the order and choice of
/// axes.
fn shape(axes: &[Vector], radii: &[f64]) -> Matrix3<f64> {
    axes.iter().zip(radii).map(|(axis, &radius)| axis * axis.transpose() * radius).sum()
}

fn same_ellipsoid(a: &Ellipsoid, b: &Ellipsoid, tolerance: f64) -> bool {
    (a.center - b.center).norm() <= tolerance
        && (shape(&a.axes, &a.radii) - shape(&b.axes, &b.radii)).amax() <= tolerance
}

fn same_elliptic_cylinder(a: &EllipticCylinder, b: &EllipticCylinder, tolerance: f64) -> bool {
    let across = (b.point - a.point).cross(&a.axis()).norm();
    parallel(&a.axis(), &b.axis())
        && across <= tolerance
        && (shape(&a.axes, &a.radii) - shape(&b.axes, &b.radii)).amax() <= tolerance
}

fn same_elliptic_cone(a: &EllipticCone, b: &EllipticCone, tolerance: f64) -> bool {
    let slopes = |c: &EllipticCone| shape(&c.axes, &c.radii.map(|r| r * c.rate.abs()));
    let (of_a, of_b) = (slopes(a), slopes(b));
    parallel(&a.axis, &b.axis)
        && (a.apex() - b.apex()).norm() <= tolerance
        && (of_a - of_b).amax() <= SAME_DIRECTION * of_a.amax()
}

fn same_nappe(a: &Nappe, b: &Nappe, tolerance: f64) -> bool {
    // Points in the direction in which the radius grows.
    let slopes = |c: &Nappe| c.axis * c.slope;
    (a.apex() - b.apex()).norm() <= tolerance
        && (slopes(a) - slopes(b)).norm() <= SAME_DIRECTION * slopes(a).norm()
}

/// Whether two sweeps are equal and have the same direction; sweeps with opposite direction count
/// as different.
fn same_sweep(a: &Sweep, b: &Sweep, tolerance: f64) -> bool {
    let near = |[p, q]: [f64; 2], [r, s]: [f64; 2], room: f64| (p - r).abs() <= room && (q - s).abs() <= room;
    let sections = match (&a.section, &b.section) {
        (Section::Line { normal, offset }, Section::Line { normal: other, offset: further }) => {
            near(*normal, *other, SAME_DIRECTION) && (offset - further).abs() <= tolerance
        }
        (Section::Ellipse(e), Section::Ellipse(f)) => {
            near(e.center, f.center, tolerance)
                && near(e.radii, f.radii, tolerance)
                && near(e.axis, f.axis, SAME_DIRECTION)
        }
        _ => false,
    };
    sections
        && (a.center - b.center).norm() <= tolerance
        && same_path(a, b, tolerance)
        && (a.axis - b.axis).norm() <= SAME_DIRECTION
        && (a.up - b.up).norm() <= SAME_DIRECTION
}

/// Whether two concentric coplanar ellipses are equal, whichever axis is the first.
fn same_path(a: &Sweep, b: &Sweep, tolerance: f64) -> bool {
    let side = b.axis.cross(&b.start);
    let [p, q] = b.radii;
    [(b.start, [p, q]), (side, [q, p])].into_iter().any(|(start, radii)| {
        (0..2).all(|i| (a.radii[i] - radii[i]).abs() <= tolerance)
            && (a.is_round() || a.start.cross(&start).norm() <= SAME_DIRECTION)
    })
}

fn same_revolved(a: &Revolved, b: &Revolved, tolerance: f64) -> bool {
    // Compare centers and shapes in the half-plane, with heights along the axis of `a`.
    let up = if a.axis.dot(&b.axis) < 0.0 { -1.0 } else { 1.0 };
    let center = |r: &Revolved, sign: f64| {
        let foot = r.point + r.axis * r.profile.center[1];
        (r.profile.center[0], foot, [r.profile.axis[0], sign * r.profile.axis[1]])
    };
    let ((distance_a, foot_a, axis_a), (distance_b, foot_b, axis_b)) = (center(a, 1.0), center(b, up));
    let shape = |[c, s]: [f64; 2], [p, q]: [f64; 2]| {
        Vector::new(c * c * p + s * s * q, c * s * (p - q), s * s * p + c * c * q)
    };
    parallel(&a.axis, &b.axis)
        && (foot_a - foot_b).norm() <= tolerance
        && (distance_a - distance_b).abs() <= tolerance
        && (shape(axis_a, a.profile.radii) - shape(axis_b, b.profile.radii)).amax() <= tolerance
}
