//! Pairs of surfaces that are tangent along a curve.
//!
//! The intersection of a tangent pair is ill-conditioned: decimals rounded by 10⁻¹⁰ leave a gap, or
//! split the curve into two that are 10⁻⁵ apart. The intended curve, the **seam**, is a line or an
//! ellipse. It is detected from the parameters of the surfaces and stored as the intersection of
//! one surface of the pair with an auxiliary surface (a plane, or a cylinder about the common
//! axis).
//!
//! For planes, spheres, circular cylinders, cones and tori, three families cover almost all cases:
//!
//! * lines: a plane and a ruled surface, or parallel cylinders;
//! * surfaces of revolution about one axis whose meridians (lines and circles in a half-plane) are
//!   tangent;
//! * tubes of equal radius that continue each other: a torus and a sphere, a cylinder or another
//!   torus.
//!
//! The fourth family is an ellipsoid tangent to a circumscribed cylinder, or to another ellipsoid
//! with the same circumscribed cylinder. The fifth is cones and cylinders that are tangent along a
//! common line (`ruled`); they may also share a conic.
//!
//! Other tangencies of ellipsoids are not detected here; the octree cells handle them.

use super::ruled::{TangentLine, tangent_line};
use crate::geometry::SurfaceInfo;
use crate::primitive::{
    Cylinder, Ellipse, Ellipsoid, EllipticCone, EllipticCylinder, Plane, Torus, quadric::tangents,
};
use crate::{Geometry, Point, Seam, Surface, SurfaceId, Vector};

/// Surfaces with a gap below this fraction of the total size count as tangent. The same tolerance
/// decides whether two surfaces are equal.
const TANGENT_GAP: f64 = 1e-8;
/// Directions are parallel if the sine of their angle is at most this. Directions given with nine
/// digits are off by 10⁻⁹. Over the length of the whole geometry, 10⁻⁷ opens a gap of ten times
/// [`TANGENT_GAP`]; shorter seams are not affected.
pub(super) const PARALLEL: f64 = 1e-7;

/// A seam without ids.
struct Found {
    /// Index of the surface in the pair that defines the seam together with the auxiliary surface.
    base: usize,
    auxiliary: Surface,
    /// The surface that cuts the base surface in the residual intersection, if there is one.
    residual: Option<Surface>,
    /// Whether seam and residual intersection are the whole intersection of the pair.
    is_complete: bool,
}

impl Found {
    /// A seam that is the whole intersection of its pair.
    fn complete(base: usize, auxiliary: Surface) -> Self {
        Self { base, auxiliary, residual: None, is_complete: true }
    }
}

/// Finds the seams of all pairs of surfaces and appends their auxiliary surfaces to the geometry.
pub(crate) fn find_seams(geometry: &mut Geometry) {
    let count = geometry.surfaces.len();
    let tolerance = TANGENT_GAP * size(&geometry.surfaces);
    let (flat, curved): (Vec<usize>, Vec<usize>) =
        (0..count).partition(|&i| matches!(geometry.surfaces[i], Surface::Plane(_)));
    let mut seams = Vec::new();
    for (k, &i) in curved.iter().enumerate() {
        for &j in flat.iter().chain(&curved[k + 1..]) {
            let Some(found) = seam([i, j].map(|s| &geometry.surfaces[s]), tolerance) else { continue };
            // If the seam is not the whole intersection, a plane of the file may separate the pair
            // elsewhere: reuse it as the auxiliary surface.
            let first = if found.is_complete { count } else { 0 };
            let auxiliary = auxiliary_id(geometry, first, found.auxiliary, tolerance);
            let pair = [i.min(j), i.max(j)].map(SurfaceId::new);
            let base = SurfaceId::new([i, j][found.base]);
            let with_base = |other: SurfaceId| [base.min(other), base.max(other)];
            let residual =
                found.residual.map(|other| with_base(auxiliary_id(geometry, count, other, tolerance)));
            seams.push(Seam {
                pair,
                surfaces: with_base(auxiliary),
                residual,
                is_complete: found.is_complete,
            });
        }
    }
    // The geometry already has the seams at joints of extrusions; seams found here take precedence.
    seams.append(&mut geometry.seams);
    seams.sort_by_key(|seam| seam.pair);
    seams.dedup_by_key(|seam| seam.pair);
    geometry.seams = seams;
}

/// The id of an auxiliary surface: that of an equal surface with index `first` or higher, or a new
/// one.
fn auxiliary_id(geometry: &mut Geometry, first: usize, surface: Surface, tolerance: f64) -> SurfaceId {
    let known = geometry.surfaces[first..].iter().position(|s| s.same_as(&surface, tolerance).is_some());
    if known.is_none() {
        geometry.surfaces.push(surface);
        geometry.surface_info.push(SurfaceInfo::default());
    }
    SurfaceId::new(known.map_or(geometry.surfaces.len() - 1, |i| first + i))
}

/// The diagonal of a box around the points and radii that define the surfaces.
fn size(surfaces: &[Surface]) -> f64 {
    let mut low = Vector::repeat(f64::INFINITY);
    let mut high = -low;
    for surface in surfaces {
        let (point, reach) = match surface {
            Surface::Plane(p) => (p.point, 0.0),
            Surface::Sphere(s) => (s.center, s.radius),
            Surface::Cylinder(c) => (c.point, c.radius),
            Surface::Cone(c) => (c.point, c.radius),
            Surface::Torus(t) => (t.center, t.major + t.minor),
            _ => continue,
        };
        low = low.inf(&(point.coords - Vector::repeat(reach)));
        high = high.sup(&(point.coords + Vector::repeat(reach)));
    }
    if low.x > high.x { 0.0 } else { (high - low).norm() }
}

/// The seam of a pair of surfaces, if they are tangent along a known curve.
fn seam(surfaces: [&Surface; 2], tolerance: f64) -> Option<Found> {
    let swapped = [surfaces[1], surfaces[0]];
    let ordered = |surfaces| {
        line(surfaces, tolerance)
            .or_else(|| tube(surfaces, tolerance))
            .or_else(|| around_axis(surfaces, tolerance))
            .or_else(|| equator(surfaces, tolerance))
    };
    let turned = |found: Found| Found { base: 1 - found.base, ..found };
    ordered(surfaces).or_else(|| ordered(swapped).map(turned))
}

fn is_parallel(a: &Vector, b: &Vector) -> bool {
    a.cross(b).norm() <= PARALLEL
}

/// The plane through `point` with the direction `normal`; `None` if `normal` is nearly zero.
pub(super) fn plane(point: Point, normal: Vector) -> Option<Surface> {
    Some(Surface::Plane(Plane { point, normal: normal.try_normalize(PARALLEL)? }))
}

/// The seam of surfaces that are tangent along a straight line.
fn line([a, b]: [&Surface; 2], tolerance: f64) -> Option<Found> {
    let (base, auxiliary) = match (a, b) {
        (Surface::Cylinder(c), Surface::Cylinder(d)) => {
            let between = perpendicular(&(d.point - c.point), &c.axis);
            let distance = between.norm();
            let gap =
                (distance - (c.radius + d.radius)).abs().min((distance - (c.radius - d.radius).abs()).abs());
            if !is_parallel(&c.axis, &d.axis) || gap > tolerance || distance <= tolerance {
                return None;
            }
            (0, plane(c.point, c.axis.cross(&between) / distance)?)
        }
        (Surface::Cylinder(c), Surface::Plane(p)) => {
            let (u, v) = tangents(&c.axis);
            let round = EllipticCylinder { point: c.point, axes: [u, v], radii: [c.radius; 2] };
            (1, plane_on_cylinder(&round, p, tolerance)?)
        }
        (Surface::EllipticCylinder(c), Surface::Plane(p)) => (1, plane_on_cylinder(c, p, tolerance)?),
        (Surface::Cone(c), Surface::Plane(p)) => {
            (1, plane_on_cone(&as_elliptic(c.point, c.axis, c.radius, c.slope), p, tolerance)?)
        }
        (Surface::Nappe(c), Surface::Plane(p)) => {
            (1, plane_on_cone(&as_elliptic(c.point, c.axis, c.radius, c.slope), p, tolerance)?)
        }
        (Surface::EllipticCone(c), Surface::Plane(p)) => (1, plane_on_cone(c, p, tolerance)?),
        _ => {
            // A cylinder is the better base surface because it has no apex.
            let base = usize::from(b.apex().is_none());
            let ordered = if base == 0 { [a, b] } else { [b, a] };
            let TangentLine { auxiliary, residual } =
                tangent_line(ordered, tolerance, tolerance / TANGENT_GAP)?;
            return Some(Found { residual, ..Found::complete(base, auxiliary) });
        }
    };
    Some(Found::complete(base, auxiliary))
}

/// A circular cone as an elliptic one: `radius` at `point`, growing by `slope` per unit along
/// `axis`.
fn as_elliptic(point: Point, axis: Vector, radius: f64, slope: f64) -> EllipticCone {
    let (u, v) = tangents(&axis);
    EllipticCone { point, axes: [u, v], radii: [radius; 2], axis, rate: slope / radius }
}

/// The component of a vector perpendicular to a unit vector.
pub(super) fn perpendicular(vector: &Vector, axis: &Vector) -> Vector {
    vector - axis * vector.dot(axis)
}

/// The plane through the line where a plane touches a cylinder, perpendicular to that plane.
fn plane_on_cylinder(c: &EllipticCylinder, p: &Plane, tolerance: f64) -> Option<Surface> {
    let axis = c.axis();
    if p.normal.dot(&axis).abs() > PARALLEL {
        return None;
    }
    // The distance to the extreme point of the ellipse along the normal is its support function.
    let [x, y] = [0, 1].map(|i| c.radii[i] * p.normal.dot(&c.axes[i]));
    let reach = x.hypot(y);
    let height = (p.point - c.point).dot(&p.normal);
    if (height.abs() - reach).abs() > tolerance {
        return None;
    }
    let arm = (c.axes[0] * (c.radii[0] * x) + c.axes[1] * (c.radii[1] * y)) * (height.signum() / reach);
    plane(c.point + arm, axis.cross(&p.normal))
}

/// The plane through the line where a plane touches a cone, perpendicular to that plane.
fn plane_on_cone(c: &EllipticCone, p: &Plane, tolerance: f64) -> Option<Surface> {
    let apex = c.apex();
    if (apex - p.point).dot(&p.normal).abs() > tolerance {
        return None;
    }
    // The line of contact leads from the apex to the point (x, y) of the base ellipse and 1/rate
    // along the axis.
    let [x, y] = [0, 1].map(|i| c.radii[i] * p.normal.dot(&c.axes[i]));
    let (reach, rise) = (x.hypot(y), p.normal.dot(&c.axis) / c.rate);
    let scale = c.radii[0].max(c.radii[1]).max(1.0 / c.rate.abs());
    if (reach - rise.abs()).abs() > PARALLEL * scale || reach == 0.0 {
        return None;
    }
    let foot = (c.axes[0] * (c.radii[0] * x) + c.axes[1] * (c.radii[1] * y)) * (-rise.signum() / reach);
    let line = foot + c.axis / c.rate;
    plane(apex, line.normalize().cross(&p.normal))
}

/// The seam of a torus with a sphere, cylinder or torus of the same tube radius that continues it.
fn tube([a, b]: [&Surface; 2], tolerance: f64) -> Option<Found> {
    let Surface::Torus(t) = a else { return None };
    let same = |x: f64, y: f64| (x - y).abs() <= tolerance;
    match b {
        Surface::Sphere(s) if same(s.radius, t.minor) => {
            let arm = s.center - t.center;
            let radial = perpendicular(&arm, &t.axis);
            (same(radial.norm(), t.major) && same(arm.dot(&t.axis), 0.0)).then_some(())?;
            let auxiliary = plane(s.center, t.axis.cross(&radial) / t.major)?;
            Some(Found::complete(1, auxiliary))
        }
        Surface::Cylinder(c) if same(c.radius, t.minor) => {
            let arm = perpendicular(&(c.point - t.center), &c.axis);
            let fits = c.axis.dot(&t.axis).abs() <= PARALLEL
                && same(arm.dot(&t.axis), 0.0)
                && same(arm.norm(), t.major);
            let auxiliary = plane(t.center + arm, c.axis)?;
            fits.then_some(Found { is_complete: false, ..Found::complete(1, auxiliary) })
        }
        Surface::Torus(s) if same(s.minor, t.minor) => {
            let (point, direction) = center_line_tangency(t, s, tolerance)?;
            Some(Found { is_complete: false, ..Found::complete(0, plane(point, direction)?) })
        }
        _ => None,
    }
}

/// The point where the center lines of two tori are tangent, and their direction there.
fn center_line_tangency(t: &Torus, s: &Torus, tolerance: f64) -> Option<(Point, Vector)> {
    let direction = if is_parallel(&t.axis, &s.axis) {
        t.axis.cross(&(s.center - t.center))
    } else {
        t.axis.cross(&s.axis)
    };
    let direction = direction.try_normalize(tolerance)?;
    let ends = |t: &Torus| {
        let arm = direction.cross(&t.axis) * t.major;
        [t.center + arm, t.center - arm]
    };
    let (of_t, of_s) = (ends(t), ends(s));
    let point = of_t.into_iter().find(|p| of_s.iter().any(|q| (p - q).norm() <= tolerance))?;
    Some((point, direction))
}

/// The seam of an ellipsoid along its equator in one of its axes.
///
/// The other surface is the cylinder circumscribed along that axis, or a concentric sphere or
/// ellipsoid with the same circumscribed cylinder.
fn equator([a, b]: [&Surface; 2], tolerance: f64) -> Option<Found> {
    let Surface::Ellipsoid(e) = a else { return None };
    let same_center = |center: &Point| (center - e.center).norm() <= tolerance;
    (0..3).find_map(|k| {
        let cylinder = circumscribed_cylinder(e, k);
        let is_same = |other: &Surface| cylinder.same_as(other, tolerance).is_some();
        let fits = match b {
            Surface::Cylinder(_) | Surface::EllipticCylinder(_) => is_same(b),
            Surface::Sphere(s) if same_center(&s.center) => {
                is_same(&Surface::Cylinder(Cylinder { point: s.center, axis: e.axes[k], radius: s.radius }))
            }
            Surface::Ellipsoid(f) if same_center(&f.center) => {
                (0..3).any(|l| is_same(&circumscribed_cylinder(f, l)))
            }
            _ => false,
        };
        let auxiliary = plane(e.center, e.axes[k])?;
        fits.then_some(Found::complete(1, auxiliary))
    })
}

/// The cylinder circumscribed about an ellipsoid along one of its axes.
fn circumscribed_cylinder(e: &Ellipsoid, along: usize) -> Surface {
    let [i, j] = [(along + 1) % 3, (along + 2) % 3];
    Surface::EllipticCylinder(EllipticCylinder {
        point: e.center,
        axes: [e.axes[i], e.axes[j]],
        radii: [e.radii[i], e.radii[j]],
    })
}

/// The profile curve of a surface of revolution in the half-plane of (radius, height).
#[derive(Clone, Copy)]
enum Meridian {
    Line {
        point: [f64; 2],
        direction: [f64; 2],
    },
    Circle {
        center: [f64; 2],
        radius: f64,
    },
    /// An ellipse with different radii.
    Ellipse(Ellipse),
}

/// The seam of two surfaces of revolution about a common axis, a circle.
fn around_axis([a, b]: [&Surface; 2], tolerance: f64) -> Option<Found> {
    let (origin, axis) = match a {
        Surface::Torus(t) => (t.center, t.axis),
        Surface::Cylinder(c) => (c.point, c.axis),
        Surface::Cone(c) => (c.point, c.axis),
        Surface::Nappe(c) => (c.point, c.axis),
        Surface::Revolved(r) => (r.point, r.axis),
        _ => return None,
    };
    let meridians = [meridian(a, &origin, &axis, tolerance)?, meridian(b, &origin, &axis, tolerance)?];
    let ([radius, height], slope) = tangent_point(meridians, tolerance)?;
    // For a torus or a double cone the meridian counts on both sides of the axis, for the others
    // only on one.
    let is_beyond = matches!(
        (a, b),
        (Surface::Nappe(_) | Surface::Revolved(_), _) | (_, Surface::Nappe(_) | Surface::Revolved(_))
    ) && radius < 0.0;
    if is_beyond || radius.abs() <= PARALLEL.sqrt() * tolerance / TANGENT_GAP {
        return None;
    }
    /// From this sine on, the plane perpendicular to the axis cuts the surfaces well enough;
    /// otherwise a cylinder about the axis does.
    const STEEP: f64 = 0.5;
    let auxiliary = if slope[1].abs() >= STEEP {
        Surface::Plane(Plane { point: origin + axis * height, normal: axis })
    } else {
        Surface::Cylinder(Cylinder { point: origin, axis, radius: radius.abs() })
    };
    // Prefer the base surface that the auxiliary surface cuts in the fewest circles.
    let rank = |s: &Surface| match s {
        Surface::Plane(_) => 0,
        Surface::Cylinder(_) | Surface::Cone(_) | Surface::Nappe(_) => 1,
        Surface::Sphere(_) => 2,
        _ => 3,
    };
    let base = usize::from(rank(b) < rank(a));
    // The line of a double cone continues beyond the apex, where it may cut a circle again.
    let crosses_again = |a: &Surface, b: &Surface| {
        matches!(
            (a, b),
            (Surface::Cone(_), Surface::Torus(_) | Surface::Revolved(_))
                | (Surface::Revolved(_), Surface::Revolved(_))
        )
    };
    let is_complete = !crosses_again(a, b) && !crosses_again(b, a);
    Some(Found { is_complete, ..Found::complete(base, auxiliary) })
}

/// The meridian of a surface of revolution about the given axis, `None` for other surfaces.
fn meridian(surface: &Surface, origin: &Point, axis: &Vector, tolerance: f64) -> Option<Meridian> {
    let height = |p: &Point| (p - origin).dot(axis);
    let on_axis = |p: &Point| perpendicular(&(p - origin), axis).norm() <= tolerance;
    match surface {
        Surface::Plane(p) if is_parallel(&p.normal, axis) => {
            Some(Meridian::Line { point: [0.0, height(&p.point)], direction: [1.0, 0.0] })
        }
        Surface::Sphere(s) if on_axis(&s.center) => {
            Some(Meridian::Circle { center: [0.0, height(&s.center)], radius: s.radius })
        }
        Surface::Cylinder(c) if on_axis(&c.point) && is_parallel(&c.axis, axis) => {
            Some(Meridian::Line { point: [c.radius, 0.0], direction: [0.0, 1.0] })
        }
        Surface::Cone(c) if on_axis(&c.point) && is_parallel(&c.axis, axis) => {
            let slope = c.slope * c.axis.dot(axis).signum();
            let length = slope.hypot(1.0);
            Some(Meridian::Line {
                point: [c.radius, height(&c.point)],
                direction: [slope / length, 1.0 / length],
            })
        }
        Surface::Nappe(c) if on_axis(&c.point) && is_parallel(&c.axis, axis) => {
            let slope = c.slope * c.axis.dot(axis).signum();
            let length = slope.hypot(1.0);
            Some(Meridian::Line {
                point: [c.radius, height(&c.point)],
                direction: [slope / length, 1.0 / length],
            })
        }
        Surface::Revolved(r) if on_axis(&r.point) && is_parallel(&r.axis, axis) => {
            let Ellipse { center: [out, up], axis: [c, s], radii } = r.profile;
            let sign = r.axis.dot(axis).signum();
            let center = [out, height(&r.point) + sign * up];
            Some(if radii[0] == radii[1] {
                Meridian::Circle { center, radius: radii[0] }
            } else if sign > 0.0 {
                Meridian::Ellipse(Ellipse { center, ..r.profile })
            } else {
                Meridian::Ellipse(Ellipse { center, axis: [c, -s], radii })
            })
        }
        Surface::Torus(t) if on_axis(&t.center) && is_parallel(&t.axis, axis) => {
            Some(Meridian::Circle { center: [t.major, height(&t.center)], radius: t.minor })
        }
        _ => None,
    }
}

/// The point where two meridians are tangent, and their common direction.
fn tangent_point(meridians: [Meridian; 2], tolerance: f64) -> Option<([f64; 2], [f64; 2])> {
    match meridians {
        [Meridian::Ellipse(e), other] | [other, Meridian::Ellipse(e)] => {
            ellipse_tangent_point(&e, other, tolerance)
        }
        [Meridian::Line { point, direction }, Meridian::Circle { center, radius }]
        | [Meridian::Circle { center, radius }, Meridian::Line { point, direction }] => {
            let arm = [center[0] - point[0], center[1] - point[1]];
            let along = arm[0] * direction[0] + arm[1] * direction[1];
            let foot = [point[0] + along * direction[0], point[1] + along * direction[1]];
            let distance = (center[0] - foot[0]).hypot(center[1] - foot[1]);
            ((distance - radius).abs() <= tolerance).then_some((foot, direction))
        }
        [Meridian::Circle { center: p, radius: r }, Meridian::Circle { center: q, radius: s }] => {
            let arm = [q[0] - p[0], q[1] - p[1]];
            let distance = arm[0].hypot(arm[1]);
            let reach =
                if (distance - (r + s)).abs() <= tolerance || distance + s <= r + tolerance { r } else { -r };
            let gap = (distance - (r + s)).abs().min((distance - (r - s).abs()).abs());
            if gap > tolerance || distance <= tolerance {
                return None;
            }
            let unit = [arm[0] / distance, arm[1] / distance];
            Some(([p[0] + reach * unit[0], p[1] + reach * unit[1]], [-unit[1], unit[0]]))
        }
        _ => None,
    }
}

/// The point where an ellipse is tangent to another meridian, and the direction there.
fn ellipse_tangent_point(e: &Ellipse, other: Meridian, tolerance: f64) -> Option<([f64; 2], [f64; 2])> {
    let other = match other {
        Meridian::Line { point, direction: [x, y] } => {
            let normal = [y, -x];
            let gap = |p: &[f64; 2]| ((p[0] - point[0]) * normal[0] + (p[1] - point[1]) * normal[1]).abs();
            let foot =
                [normal, normal.map(|n| -n)].map(|n| e.support(n)).into_iter().find(|p| gap(p) <= tolerance);
            return foot.map(|p| (p, [x, y]));
        }
        Meridian::Circle { center, radius } => Ellipse { center, axis: [1.0, 0.0], radii: [radius; 2] },
        Meridian::Ellipse(other) => other,
    };
    // On the ellipse, the other curve's function has an extremum at a point of tangency: bisect its
    // derivative.
    const PARTS: u32 = 64;
    /// Enough to bisect a part down to rounding.
    const HALVINGS: usize = 50;
    let step = std::f64::consts::TAU / f64::from(PARTS);
    let direction = |angle: f64| {
        let (sin, cos) = angle.sin_cos();
        let ([c, s], [a, b]) = (e.axis, e.radii);
        [-c * a * sin - s * b * cos, -s * a * sin + c * b * cos]
    };
    let slope = |angle: f64| {
        let ([gx, gy], [x, y]) = (other.gradient(e.point(angle)), direction(angle));
        gx * x + gy * y
    };
    (0..PARTS).find_map(|i| {
        let [mut low, mut high] = [f64::from(i), f64::from(i + 1)].map(|k| k * step);
        let negative = slope(low) < 0.0;
        (negative != (slope(high) < 0.0)).then_some(())?;
        for _ in 0..HALVINGS {
            let middle = 0.5 * (low + high);
            *(if (slope(middle) < 0.0) == negative { &mut low } else { &mut high }) = middle;
        }
        let (point, [x, y]) = (e.point(low), direction(low));
        let ([gx, gy], length) = (other.gradient(point), x.hypot(y));
        (other.value(point).abs() <= tolerance * gx.hypot(gy)).then_some((point, [x / length, y / length]))
    })
}
