//! Properties of all primitives, tested on one of each kind in a skew position.

use super::*;
use crate::Surface;
use nalgebra::Translation3;
use proptest::prelude::*;

fn skew() -> Isometry3<f64> {
    Isometry3::from_parts(
        Translation3::new(0.3, -0.2, 0.1),
        nalgebra::UnitQuaternion::from_euler_angles(0.4, -0.9, 1.3),
    )
}

/// One surface of each kind, of about unit size.
fn straight() -> Vec<Surface> {
    let (x, y, z) = (Vector::x(), Vector::y(), Vector::z());
    let o = Point::origin();
    vec![
        Surface::Plane(Plane { point: o, normal: z }),
        Surface::Sphere(Sphere { center: o, radius: 0.8 }),
        Surface::Cylinder(Cylinder { point: o, axis: z, radius: 0.6 }),
        Surface::Cone(Cone { point: o, axis: z, radius: 0.7, slope: -0.5 }),
        Surface::Torus(Torus { center: o, axis: z, major: 0.9, minor: 0.3 }),
        Surface::Ellipsoid(Ellipsoid { center: o, axes: [x, y, z], radii: [1.2, 0.5, 0.8] }),
        Surface::EllipticCylinder(EllipticCylinder { point: o, axes: [x, y], radii: [0.4, 1.1] }),
        Surface::EllipticCone(EllipticCone { point: o, axes: [x, y], radii: [0.5, 0.9], axis: z, rate: 0.6 }),
        Surface::Nappe(Nappe { point: o, axis: z, radius: 0.7, slope: 0.4 }),
        Surface::Revolved(Revolved { point: o, axis: z, profile: ellipse([0.9, 0.1], [0.5, 0.3]) }),
        Surface::Revolved(Revolved { point: o, axis: z, profile: ellipse([0.2, 0.0], [0.5, 0.8]) }),
        sweep([1.2; 2], Section::Line { normal: [0.28, 0.96], offset: 0.2 }),
        sweep([1.2; 2], Section::Ellipse(ellipse([0.1, 0.0], [0.5, 0.4]))),
        sweep([1.3, 1.0], Section::Line { normal: [0.28, 0.96], offset: 0.2 }),
        sweep([1.1, 1.4], Section::Ellipse(ellipse([0.1, 0.0], [0.3, 0.4]))),
    ]
}

fn ellipse(center: [f64; 2], radii: [f64; 2]) -> Ellipse {
    Ellipse { center, axis: [0.8, 0.6], radii }
}

/// A sweep along an ellipse about the origin.
fn sweep(radii: [f64; 2], section: Section) -> Surface {
    let (axis, start, up) = (Vector::z(), Vector::x(), Vector::new(0.48, 0.36, 0.8));
    Surface::Sweep(Sweep { center: Point::origin(), axis, start, radii, up, section })
}

fn surface() -> impl Strategy<Value = Surface> {
    (0..straight().len(), any::<bool>()).prop_map(|(kind, moved)| {
        let surface = straight().swap_remove(kind);
        if moved { surface.transformed(&skew()) } else { surface }
    })
}

fn point() -> impl Strategy<Value = Point> {
    [-1.5..1.5f64, -1.5..1.5f64, -1.5..1.5f64].prop_map(Point::from)
}

/// Whether a point is near the axis of a torus or another surface of revolution, where derivatives
/// are undefined.
fn on_torus_axis(surface: &Surface, point: &Point) -> bool {
    let (center, axis) = match surface {
        Surface::Torus(t) => (t.center, t.axis),
        Surface::Nappe(n) => (n.point, n.axis),
        Surface::Revolved(r) => (r.point, r.axis),
        Surface::Sweep(s) => (s.center, s.axis),
        _ => return false,
    };
    (point - center).cross(&axis).norm() < 0.05
}

/// Whether a point is so far inside an elliptic sweep path that the normals of the path nearly
/// meet.
fn is_near_path_evolute(surface: &Surface, point: &Point) -> bool {
    let Surface::Sweep(s) = surface else { return false };
    let arm = point - s.center;
    let at = [arm.dot(&s.start), arm.dot(&s.axis.cross(&s.start))];
    !s.is_round() && elliptic_path::foot(s.radii, at).distance < -0.8 * s.least_curvature_radius()
}

proptest! {
    #![proptest_config(crate::seeded())]

    #[test]
    fn gradient_and_hessian_agree_with_finite_differences(s in surface(), p in point()) {
        prop_assume!(!on_torus_axis(&s, &p));
        let h = 1e-5;
        for i in 0..3 {
            let mut step = Vector::zeros();
            step[i] = h;
            let slope = (s.value(&(p + step)) - s.value(&(p - step))) / (2.0 * h);
            prop_assert!((slope - s.gradient(&p)[i]).abs() < 1e-7);
            let column = (s.gradient(&(p + step)) - s.gradient(&(p - step))) / (2.0 * h);
            prop_assert!((column - s.hessian(&p).column(i)).amax() < 1e-5);
        }
    }

    #[test]
    fn projection_lies_on_the_surface_and_is_idempotent(s in surface(), p in point()) {
        let q = s.project(&p).unwrap();
        prop_assert!(s.distance(&q) <= 8.0 * f64::EPSILON, "{} away", s.distance(&q));
        let again = s.project(&q).unwrap();
        prop_assert!((again - q).norm() <= 8.0 * f64::EPSILON);
    }

    #[test]
    fn no_other_point_of_the_surface_is_nearer_than_the_projection(
        s in surface(), p in point(), others in prop::collection::vec(point(), 40),
    ) {
        // Sweeps find the nearest point only from nearby.
        prop_assume!(!matches!(s, Surface::Sweep(_)) || (s.distance(&p) < 0.2 && !on_torus_axis(&s, &p)));
        let q = s.project(&p).unwrap();
        for other in others {
            // Points near the foot test local optimality, distant points detect a wrong branch.
            for candidate in [other, q + (other - q) * 0.01] {
                let on = s.project(&candidate).unwrap();
                prop_assert!((p - q).norm() <= (p - on).norm() + 1e-13);
            }
        }
    }

    #[test]
    fn ranges_over_a_box_contain_the_values_in_it(
        s in surface(), p in point(), size in 1e-4..1.0f64, at in [0.0..=1.0f64, 0.0..=1.0f64, 0.0..=1.0f64],
    ) {
        let cell = [0, 1, 2].map(|i| Interval::new(p[i], p[i] + size));
        let q = Point::from([0, 1, 2].map(|i| cell[i].lo + at[i] * cell[i].width()));
        prop_assume!(!on_torus_axis(&s, &q));
        // The value at the point has rounding errors too.
        let slack = 1e-14;
        let range = s.value_range(&cell);
        prop_assert!(range.lo - slack <= s.value(&q) && s.value(&q) <= range.hi + slack);
        let (ranges, gradient) = (s.gradient_range(&cell), s.gradient(&q));
        for i in 0..3 {
            prop_assert!(ranges[i].lo - slack <= gradient[i] && gradient[i] <= ranges[i].hi + slack);
        }
    }

    #[test]
    fn ranges_over_small_boxes_are_tight(s in surface(), p in point()) {
        let size = 1e-3;
        let q = s.project(&p).unwrap();
        prop_assume!(!is_near_path_evolute(&s, &q));
        prop_assume!(s.gradient(&q).norm() > 0.1 && !on_torus_axis(&s, &q));
        let cell = [0, 1, 2].map(|i| Interval::new(q[i] - size, q[i] + size));
        let slope: f64 = s.gradient(&q).iter().map(|g| g.abs()).sum();
        prop_assert!(s.value_range(&cell).width() <= 2.0 * size * slope * 1.2);
    }

    #[test]
    fn a_moved_surface_has_the_same_values_at_moved_points(s in surface(), p in point()) {
        let moved = s.transformed(&skew());
        prop_assert!((moved.value(&(skew() * p)) - s.value(&p)).abs() < 1e-13);
    }

    #[test]
    fn curvature_is_the_rate_of_rotation_of_the_normal(s in surface(), p in point()) {
        let q = s.project(&p).unwrap();
        prop_assume!(s.curvature(&q) < 20.0);
        let normal = s.normal(&q);
        let (u, v) = quadric::tangents(&normal);
        let h = 1e-6;
        let turn = |angle: f64| {
            let step = (u * angle.cos() + v * angle.sin()) * h;
            let turned = s.normal(&(q + step)) - s.normal(&(q - step));
            (turned / (2.0 * h)).norm()
        };
        let largest = (0..180).map(|i| turn(f64::from(i).to_radians())).fold(0.0, f64::max);
        prop_assert!((largest - s.curvature(&q)).abs() <= 1e-3 * (1.0 + largest));
    }
}

#[test]
fn gradients_are_unit_vectors_on_plane_sphere_cylinder_and_torus() {
    for s in straight().iter().filter(|s| {
        matches!(s, Surface::Plane(_) | Surface::Sphere(_) | Surface::Cylinder(_) | Surface::Torus(_))
    }) {
        let q = s.project(&Point::new(0.7, 0.5, 0.2)).unwrap();
        assert!((s.gradient(&q).norm() - 1.0).abs() < 1e-14, "{s:?}");
    }
}

#[test]
fn the_center_of_an_ellipsoid_projects_to_the_end_of_its_shortest_axis() {
    let [_, _, _, _, _, ellipsoid, cylinder, ..] = &straight()[..] else { unreachable!() };
    assert!((ellipsoid.project(&Point::origin()).unwrap() - Point::new(0.0, 0.5, 0.0)).norm() < 1e-15);
    assert!((cylinder.project(&Point::origin()).unwrap() - Point::new(0.4, 0.0, 0.0)).norm() < 1e-15);
}

#[test]
fn the_center_of_a_sphere_has_no_projection() {
    assert!(straight()[1].project(&Point::origin()).is_err());
}

#[test]
fn points_on_the_axes_of_an_elliptic_cone_are_projected() {
    let cone = &straight()[7];
    for p in [Point::new(0.0, 0.0, 0.4), Point::new(0.3, 0.0, -1.0 / 0.6), Point::new(0.0, 0.0, -1.0 / 0.6)] {
        let q = cone.project(&p).unwrap();
        assert!(cone.value(&q).abs() < 1e-14, "{p} is projected to {q}");
    }
}

#[test]
fn equal_surfaces_with_different_parameters_are_recognized() {
    let shifted = |s: &Surface, by: Vector| s.transformed(&Isometry3::translation(by.x, by.y, by.z));
    for (i, a) in straight().iter().enumerate() {
        for (j, b) in straight().iter().enumerate() {
            assert_eq!(a.same_as(b, 1e-8), (i == j).then_some(true), "{a:?} {b:?}");
        }
        assert_eq!(a.same_as(&shifted(a, Vector::new(1e-3, 2e-3, 3e-3)), 1e-8), None);
    }
    let plane = straight().swap_remove(0);
    assert_eq!(plane.same_as(&shifted(&plane, Vector::new(5.0, 2.0, 0.0)), 1e-8), Some(true));
    let turned = Surface::Plane(Plane { point: Point::new(1.0, 1.0, 0.0), normal: -Vector::z() });
    assert_eq!(plane.same_as(&turned, 1e-8), Some(false));
    let cylinder = straight().swap_remove(2);
    let same =
        Surface::Cylinder(Cylinder { point: Point::new(0.0, 0.0, 4.0), axis: -Vector::z(), radius: 0.6 });
    assert_eq!(cylinder.same_as(&same, 1e-8), Some(true));
    let axes = [Vector::y(), Vector::x()];
    let round = EllipticCylinder { point: Point::origin(), axes, radii: [0.6; 2] };
    assert_eq!(cylinder.same_as(&Surface::EllipticCylinder(round), 1e-8), Some(true));
    let cone = straight().swap_remove(3);
    let same =
        Surface::Cone(Cone { point: Point::new(0.0, 0.0, 1.0), axis: -Vector::z(), radius: 0.2, slope: 0.5 });
    assert_eq!(cone.same_as(&same, 1e-8), Some(true));
}
