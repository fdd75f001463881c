//! Random solids: features must agree with the regions sampled around random points.

use super::*;
use crate::geometry::{Body, SurfaceInfo};
use crate::primitive::{Cylinder, Ellipsoid, EllipticCone, EllipticCylinder, Plane, Sphere, Torus, quadric};
use crate::project::project_to_both;
use crate::{Solid, Surface, Vector};
use proptest::prelude::*;

fn point(reach: f64) -> impl Strategy<Value = Point> {
    [-reach..reach, -reach..reach, -reach..reach].prop_map(Point::from)
}

fn direction() -> impl Strategy<Value = Vector> {
    point(1.0).prop_filter_map("a direction", |p| p.coords.try_normalize(0.1))
}

fn surface() -> impl Strategy<Value = Surface> {
    let radii = [0.15..0.9f64, 0.15..0.9f64, 0.15..0.9f64];
    (0..7, point(0.6), direction(), radii, 0.05..0.2f64).prop_map(|(kind, at, axis, radii, rate)| {
        let (u, v) = quadric::tangents(&axis);
        let [a, b, _] = radii;
        match kind {
            0 => Surface::Plane(Plane { point: at, normal: axis }),
            1 => Surface::Sphere(Sphere { center: at, radius: a }),
            2 => Surface::Cylinder(Cylinder { point: at, axis, radius: 0.6 * a }),
            3 => Surface::Torus(Torus { center: at, axis, major: a, minor: a * b }),
            4 => Surface::Ellipsoid(Ellipsoid { center: at, axes: [axis, u, v], radii }),
            5 => Surface::EllipticCylinder(EllipticCylinder {
                point: at,
                axes: [u, v],
                radii: [0.6 * a, 0.6 * b],
            }),
            _ => Surface::EllipticCone(EllipticCone {
                point: at,
                axes: [u, v],
                radii: [0.5 * a, 0.5 * b],
                axis,
                rate,
            }),
        }
    })
}

fn geometry() -> impl Strategy<Value = Geometry> {
    prop::collection::vec((surface(), any::<bool>(), 0..3), 1..6).prop_map(|parts| {
        let half = |i: usize, positive: bool| Solid::Half { surface: SurfaceId::new(i), positive };
        let ball = Surface::Sphere(Sphere { center: Point::new(0.01, 0.02, 0.03), radius: 1.3 });
        let mut surfaces = vec![ball];
        let mut solid = Solid::Or(Vec::new());
        for (i, (surface, positive, operation)) in parts.into_iter().enumerate() {
            surfaces.push(surface);
            let part = half(i + 1, positive);
            solid = match operation {
                _ if i == 0 => part,
                0 => Solid::And(vec![solid, part]),
                1 => Solid::Or(vec![solid, part]),
                _ => Solid::And(vec![solid, Solid::Not(Box::new(part))]),
            };
        }
        let inside = Solid::And(vec![half(0, false), solid.clone()]);
        let rest = Solid::And(vec![half(0, false), Solid::Not(Box::new(solid))]);
        Geometry {
            surface_info: vec![SurfaceInfo::default(); surfaces.len()],
            surfaces,
            bodies: [inside, rest].into_iter().map(body).collect(),
            ..Geometry::default()
        }
    })
}

fn body(solid: Solid) -> Body {
    Body {
        name: "body".to_owned(),
        solid,
        number: 1,
        maxh: None,
        material: None,
        color: None,
        transparent: false,
        layer: 1,
        span: crate::geometry::Span::default(),
    }
}

fn body_at(geometry: &Geometry, at: &Point) -> Option<BodyId> {
    let positive = |s: SurfaceId| geometry.surfaces[s.index()].value(at) > 0.0;
    geometry.bodies.iter().position(|b| b.solid.contains(&positive)).map(BodyId::new)
}

/// Whether all surfaces except those in `but` are far from a point.
fn is_clear(geometry: &Geometry, at: &Point, but: &[usize]) -> bool {
    (0..geometry.surfaces.len()).all(|i| but.contains(&i) || geometry.surfaces[i].distance(at) > 1e-3)
}

/// If the regions in the four quadrants between two surfaces depend on both, there must be a curve.
fn check_curve(
    geometry: &Geometry,
    features: &Features,
    [i, j]: [usize; 2],
    start: &Point,
) -> Result<(), TestCaseError> {
    let (a, b) = (&geometry.surfaces[i], &geometry.surfaces[j]);
    let Ok(at) = project_to_both(a, b, start, 1e-13) else { return Ok(()) };
    let (u, v) = (a.normal(&at), b.normal(&at));
    if u.cross(&v).norm() < 0.02 || !is_clear(geometry, &at, &[i, j]) {
        return Ok(());
    }
    // Each shift is tangent to one of the two surfaces.
    let (p, q) = ((u - v * u.dot(&v)).normalize() * 1e-6, (v - u * u.dot(&v)).normalize() * 1e-6);
    let [pp, np, nn, pn] = [p + q, q - p, -p - q, p - q].map(|shift| body_at(geometry, &(at + shift)));
    if (pp == pn && np == nn) || (pp == np && nn == pn) {
        return Ok(());
    }
    let pair = [SurfaceId::new(i.min(j)), SurfaceId::new(i.max(j))];
    let passes = |curve: &&Curve| {
        curve.trace.windows(2).any(|ends| {
            let chord = ends[1] - ends[0];
            let part = ((at - ends[0]).dot(&chord) / chord.norm_squared()).clamp(0.0, 1.0);
            (at - (ends[0] + chord * part)).norm() <= 0.06 * chord.norm() + 1e-9
        })
    };
    let here = features.curves.iter().filter(|c| c.surfaces == pair).any(|c| passes(&c));
    prop_assert!(here, "no curve of surfaces {i} and {j} at {at}");
    Ok(())
}

/// If the regions on both sides of a surface differ, there must be a patch with these regions.
fn check_patch(
    geometry: &Geometry,
    features: &Features,
    i: usize,
    start: &Point,
) -> Result<(), TestCaseError> {
    let Ok(at) = geometry.surfaces[i].project(start) else { return Ok(()) };
    if !is_clear(geometry, &at, &[i]) {
        return Ok(());
    }
    let up = geometry.surfaces[i].normal(&at) * 1e-6;
    let sides = [body_at(geometry, &(at - up)), body_at(geometry, &(at + up))];
    if sides[0] == sides[1] {
        return Ok(());
    }
    let matches = |patch: &&Patch| {
        let of_patch =
            if patch.flipped { [patch.outside, patch.inside] } else { [patch.inside, patch.outside] };
        patch.surface.index() == i && of_patch == sides
    };
    prop_assert!(features.patches.iter().any(|p| matches(&p)), "no patch of surface {i} at {at}");
    let bounds = &features.bounds;
    prop_assert!((0..3).all(|k| bounds.min[k] - 1e-9 <= at[k] && at[k] <= bounds.max[k] + 1e-9));
    Ok(())
}

proptest! {
    #![proptest_config(proptest::test_runner::Config { cases: 100, ..crate::seeded() })]

    #[test]
    fn curves_and_patches_are_where_regions_meet(
        geometry in geometry(),
        probes in prop::collection::vec((point(1.3), any::<[prop::sample::Index; 2]>()), 100),
    ) {
        let features = match Features::find(&geometry) {
            Ok(features) => features,
            Err(FeatureError::Empty(_)) => return Ok(()),
            Err(error) => return Err(TestCaseError::fail(error.to_string())),
        };
        for (start, indices) in probes {
            let [i, j] = indices.map(|index| index.index(geometry.surfaces.len()));
            check_patch(&geometry, &features, i, &start)?;
            if i != j {
                check_curve(&geometry, &features, [i, j], &start)?;
            }
        }
    }
}
