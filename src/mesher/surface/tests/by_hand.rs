//! Each kind of surface and boundary once, from the coarsest possible to fine meshes.

use super::*;
use crate::ground::size::UniformSize;
use csg::primitive::{Cone, Ellipsoid, EllipticCone, EllipticCylinder, Sphere, Torus};

/// A square of side 4 with a round hole of radius 1 in `n` segments.
fn square_with_hole(n: usize, side: usize, normal: f64) -> Made {
    let mut made = Made::new(vec![plane(0.0, normal), z_cylinder(1.0)]);
    let at = [(-2., -2.), (2., -2.), (2., 2.), (-2., 2.)].map(|(x, y)| Point::new(x, y, 0.0));
    // The side walls do not matter here, so the plane replaces them.
    let corners = at.map(|p| made.corner(p, &[0]));
    let mut boundary = Vec::new();
    for k in 0..4 {
        let (p, q) = (at[k], at[(k + 1) % 4]);
        let c = made.arc([0, 0], [corners[k], corners[(k + 1) % 4]], side, |t| p + (q - p) * t);
        boundary.push((c, normal > 0.0));
    }
    let hole = made.ring([0, 1], n, circle(Point::origin(), 1.0, 0.0));
    boundary.push((hole, normal < 0.0));
    made.patch(0, false, &boundary, &[]);
    made
}

#[test]
fn a_square_with_a_hole_is_filled_with_good_triangles() {
    for (n, side, h) in [(30, 20, 0.2), (6, 4, 1.0), (100, 80, 0.05), (4, 1, 4.0), (3, 1, 10.0), (60, 2, 2.0)]
    {
        for normal in [1.0, -1.0] {
            let made = square_with_hole(n, side, normal);
            let (mesh, report) = made.mesh(&UniformSize(h));
            let polygon = 0.5 * n as f64 * (TAU / n as f64).sin();
            assert!((area(&mesh) - (16.0 - polygon)).abs() < 1e-12);
            assert_eq!(euler(&mesh), 0);
            if n == 30 || n == 100 {
                assert!(report.min_angle() > 25.0 && report.mean_quality() > 0.94, "{report:?}");
            }
        }
    }
}

fn whole(surface: Surface, seed: Point) -> Made {
    let mut made = Made::new(vec![surface]);
    made.patch(0, false, &[], &[seed]);
    made
}

#[test]
fn a_sphere_is_closed_at_any_size() {
    let sphere = Surface::Sphere(Sphere { center: Point::new(1.0, 2.0, 3.0), radius: 2.0 });
    let made = whole(sphere, Point::new(3.0, 2.0, 3.0));
    for (h, range) in [(1e10, 20..51), (2.0, 20..51), (1.0, 80..300), (0.2, 2500..4000)] {
        let (mesh, report) = made.mesh(&UniformSize(h));
        assert_eq!(euler(&mesh), 2);
        assert!(range.contains(&mesh.triangles.len()), "{h}: {}", mesh.triangles.len());
        assert!(report.worst_normal() < 45.0 && report.min_angle() > 25.0, "{report:?}");
    }
}

#[test]
fn a_torus_and_an_ellipsoid_are_closed_at_any_size() {
    let axis = Vector::new(1.0, 0.5, 0.2).normalize();
    let torus = Torus { center: Point::new(0.1, 0.2, 0.3), axis, major: 2.0, minor: 1.0 };
    let on_tube = axis.cross(&Vector::z()).normalize() * 3.0;
    let torus = whole(Surface::Torus(torus.clone()), torus.center + on_tube);
    for h in [1e10, 0.7, 0.2] {
        let (mesh, report) = torus.mesh(&UniformSize(h));
        assert_eq!(euler(&mesh), 0);
        assert!(report.worst_normal() < 60.0 && report.min_angle() > 20.0, "{report:?}");
    }
    let ellipsoid = Ellipsoid {
        center: Point::new(0.5, 0.0, 0.0),
        axes: [Vector::x(), Vector::y(), Vector::z()],
        radii: [2.0, 1.0, 0.7],
    };
    let ellipsoid = whole(Surface::Ellipsoid(ellipsoid), Point::new(2.5, 0.0, 0.0));
    for (h, normal) in [(1e10, 70.0), (0.5, 60.0), (0.1, 20.0)] {
        let (mesh, report) = ellipsoid.mesh(&UniformSize(h));
        assert_eq!(euler(&mesh), 2);
        assert!(report.worst_normal() < normal && report.min_angle() > 20.0, "{report:?}");
    }
}

/// A wall between two circles with two caps. Surface 0 is the wall, with the given radii at heights
/// 0 and `height`.
fn can(wall: Surface, radii: [f64; 2], stretch: f64, height: f64, n: [usize; 2], shift: f64) -> Made {
    let mut made = Made::new(vec![wall, plane(0.0, -1.0), plane(height, 1.0)]);
    let at = |k: usize, z: f64, shift: f64| {
        move |t: f64| {
            let (s, c) = (TAU * (t + shift)).sin_cos();
            Point::new(radii[k] * c, stretch * radii[k] * s, z)
        }
    };
    let bottom = made.ring([0, 1], n[0], at(0, 0.0, 0.0));
    let top = made.ring([0, 2], n[1], at(1, height, shift));
    made.patch(0, false, &[(bottom, true), (top, false)], &[]);
    made.patch(1, false, &[(bottom, false)], &[]);
    made.patch(2, false, &[(top, true)], &[]);
    made
}

#[test]
fn a_cylinder_is_closed_with_few_and_many_segments() {
    for (n, h, height) in [
        ([3, 3], 10.0, 2.0),
        ([4, 6], 10.0, 0.3),
        ([4, 4], 1.0, 3.0),
        ([5, 3], 1.0, 10.0),
        ([24, 24], 0.25, 2.0),
        ([100, 30], 0.1, 0.5),
    ] {
        for shift in [0.0, 0.03, 0.5 / n[1] as f64] {
            let made = can(z_cylinder(1.0), [1.0, 1.0], 1.0, height, n, shift);
            let (mesh, report) = made.mesh(&UniformSize(h));
            assert_eq!(euler(&mesh), 2);
            assert!(report.worst_normal() < 80.0, "{n:?} {height}: {report:?}");
        }
    }
}

#[test]
fn cones_and_elliptic_walls_are_closed() {
    let cone = |r: f64, slope: f64| {
        Surface::Cone(Cone { point: Point::origin(), axis: Vector::z(), radius: r, slope })
    };
    let axes = [Vector::x(), Vector::y()];
    let elliptic =
        Surface::EllipticCylinder(EllipticCylinder { point: Point::origin(), axes, radii: [1.0, 0.5] });
    let elliptic_cone = Surface::EllipticCone(EllipticCone {
        point: Point::origin(),
        axes,
        radii: [1.0, 0.5],
        axis: Vector::z(),
        rate: -0.25,
    });
    for (n, h) in [([8, 6], 10.0), ([8, 6], 0.8), ([40, 30], 0.15)] {
        for made in [
            can(cone(1.0, -0.3), [1.0, 0.4], 1.0, 2.0, n, 0.1),
            can(cone(0.5, 2.0), [0.5, 2.5], 1.0, 1.0, n, 0.1),
            can(elliptic.clone(), [1.0, 1.0], 0.5, 2.0, n, 0.1),
            can(elliptic_cone.clone(), [1.0, 0.5], 0.5, 2.0, n, 0.1),
        ] {
            let (mesh, report) = made.mesh(&UniformSize(h));
            assert_eq!(euler(&mesh), 2);
            assert!(report.worst_normal() < 80.0, "{report:?}");
        }
    }
}

#[test]
fn the_apex_of_a_cone_is_a_vertex_of_its_wall() {
    for (slope, n, h) in [(-0.5, 3, 5.0), (-0.5, 20, 0.3), (-4.0, 12, 0.1), (-0.1, 6, 0.5)] {
        let height = -1.0 / slope;
        let cone = Cone { point: Point::origin(), axis: Vector::z(), radius: 1.0, slope };
        let mut made = Made::new(vec![Surface::Cone(cone), plane(0.0, -1.0)]);
        made.corner(Point::new(0.0, 0.0, height), &[0]);
        let base = made.ring([0, 1], n, circle(Point::origin(), 1.0, 0.0));
        made.patch(0, false, &[(base, true)], &[]);
        made.patch(1, false, &[(base, false)], &[]);
        let (mesh, _) = made.mesh(&UniformSize(h));
        assert_eq!(euler(&mesh), 2);
    }
}

/// A ball cut at height z: a part of the sphere and a disk.
fn cut_ball(z: f64, n: usize) -> Made {
    let sphere = Surface::Sphere(Sphere { center: Point::origin(), radius: 1.0 });
    let mut made = Made::new(vec![sphere, plane(z, -1.0)]);
    let rim = made.ring([0, 1], n, circle(Point::origin(), (1.0 - z * z).sqrt(), z));
    made.patch(0, false, &[(rim, true)], &[]);
    made.patch(1, false, &[(rim, false)], &[]);
    made
}

#[test]
fn a_cut_ball_is_closed() {
    for z in [0.0, 0.9, -0.9] {
        for (n, h) in [(3, 1.0), (5, 1.0), (12, 0.5), (60, 0.1)] {
            let (mesh, report) = cut_ball(z, n).mesh(&UniformSize(h));
            assert_eq!(euler(&mesh), 2);
            assert!(report.worst_normal() < 75.0, "{z} {n}: {report:?}");
        }
    }
}

#[test]
fn a_disk_in_three_segments_gets_a_vertex_inside() {
    let (mesh, report) = can(z_cylinder(1.0), [1.0, 1.0], 1.0, 2.0, [3, 3], 0.0).mesh(&UniformSize(10.0));
    // One triangle would have all its edges on one circle.
    assert_eq!(mesh.triangles.iter().filter(|t| t.patch == PatchId(1)).count(), 3);
    assert_eq!(report.flattening_repaired(), 2);
}

#[test]
fn points_and_curves_inside_a_patch_are_kept() {
    let mut made = square_with_hole(12, 4, 1.0);
    let at = [(-1.8, -1.5), (-1.2, 1.7)].map(|(x, y)| Point::new(x, y, 0.0));
    // The new corners are not the first vertices, so they get explicit numbers.
    let first = made.curves.points.len();
    let corners = at.map(|p| made.corner(p, &[0]));
    let alone = made.corner(Point::new(1.5, 1.5, 0.0), &[0]);
    assert_eq!(alone.index(), 6);
    let vertices = [VertexId::new(first), VertexId::new(first + 1)];
    let curve = CurveId::new(made.features.curves.len());
    made.curves.segments.push(Segment { vertices, curve });
    let fins = [true, false].map(|forward| Fin { patch: PatchId(0), forward }).to_vec();
    let surfaces = [SurfaceId(0), SurfaceId(0)];
    made.features.curves.push(Curve { surfaces, ends: Some(corners), trace: at.to_vec(), fins });
    made.features.patches[0].boundary.extend([(curve, true), (curve, false)]);
    let (mesh, _) = made.mesh(&UniformSize(0.5));
    assert!(mesh.triangles.iter().any(|t| t.vertices.contains(&VertexId::new(first + 2))));
    assert_eq!(euler(&mesh), 0);
}

#[test]
fn a_circle_with_the_same_patch_on_both_sides_is_kept() {
    let sphere = Surface::Sphere(Sphere { center: Point::origin(), radius: 1.0 });
    let mut made = Made::new(vec![sphere, plane(0.2, 1.0)]);
    let rim = made.ring([0, 1], 9, circle(Point::origin(), 0.96_f64.sqrt(), 0.2));
    made.patch(0, false, &[(rim, true), (rim, false)], &[]);
    let (mesh, _) = made.mesh(&UniformSize(0.4));
    assert_eq!(euler(&mesh), 2);
}

#[test]
fn both_nappes_of_a_cone_meet_at_the_apex() {
    let cone = Cone { point: Point::origin(), axis: Vector::z(), radius: 1.0, slope: -0.5 };
    let mut made = Made::new(vec![Surface::Cone(cone), plane(0.0, -1.0), plane(3.5, 1.0)]);
    made.corner(Point::new(0.0, 0.0, 2.0), &[0]);
    let bottom = made.ring([0, 1], 20, circle(Point::origin(), 1.0, 0.0));
    let top = made.ring([0, 2], 15, circle(Point::origin(), 0.75, 3.5));
    made.patch(0, false, &[(bottom, true), (top, false)], &[]);
    let (mesh, _) = made.mesh(&UniformSize(0.3));
    // Two disks with one vertex in common.
    assert_eq!(euler(&mesh), 1);
}

#[test]
fn a_flipped_patch_has_the_opposite_triangles() {
    let sphere = Surface::Sphere(Sphere { center: Point::origin(), radius: 1.0 });
    let mut made = Made::new(vec![sphere]);
    made.patch(0, true, &[], &[Point::new(0.0, 0.0, 1.0)]);
    let (mesh, _) = made.mesh(&UniformSize(0.5));
    assert_eq!(euler(&mesh), 2);
}

#[test]
fn segments_that_cross_are_named() {
    let mut made = Made::new(vec![plane(0.0, 1.0), z_cylinder(1.0)]);
    let a = made.ring([0, 1], 3, circle(Point::origin(), 1.0, 0.0));
    let b = made.ring([0, 1], 3, |t| circle(Point::origin(), 0.9, 0.0)(t + 0.5));
    made.patch(0, false, &[(a, true), (b, false)], &[]);
    let error = mesh_patches(
        &made.geometry,
        &made.features,
        made.curves.clone(),
        &UniformSize(0.3),
        &Settings::default(),
    )
    .expect_err("the triangles cross");
    let SurfaceError::TooCoarse { segments, other, .. } = error else { panic!("{error}") };
    assert_eq!(segments, [0, 1, 2, 3, 4, 5]);
    assert!(other.is_some());
}

#[test]
fn a_curve_with_the_wrong_direction_is_an_error() {
    let mut made = square_with_hole(12, 3, 1.0);
    for entry in &mut made.features.patches[0].boundary {
        entry.1 = !entry.1;
    }
    let error = mesh_patches(
        &made.geometry,
        &made.features,
        made.curves.clone(),
        &UniformSize(0.3),
        &Settings::default(),
    )
    .expect_err("the outside is not bounded");
    assert!(matches!(error, SurfaceError::NotEnclosed(_)), "{error}");
}

#[test]
fn a_size_that_is_not_a_positive_length_is_an_error() {
    struct Bad;
    impl SizeField for Bad {
        fn size_at(&self, point: &Point) -> f64 {
            if point.x > 0.0 { f64::NAN } else { 1.0 }
        }
    }
    let made = square_with_hole(12, 3, 1.0);
    let error = mesh_patches(&made.geometry, &made.features, made.curves.clone(), &Bad, &Settings::default())
        .expect_err("half of the sizes are NaN");
    assert!(matches!(error, SurfaceError::BadSize { .. }), "{error}");
}

#[test]
fn the_size_field_is_followed_where_it_varies() {
    struct Graded;
    impl SizeField for Graded {
        fn size_at(&self, point: &Point) -> f64 {
            0.04 + 0.2 * (point - Point::new(1.0, 0.0, 0.0)).norm()
        }
    }
    let sphere = Surface::Sphere(Sphere { center: Point::origin(), radius: 1.0 });
    let made = whole(sphere, Point::new(0.0, 0.0, 1.0));
    let (mesh, report) = made.mesh(&Graded);
    assert!(report.min_angle() > 20.0 && report.mean_quality() > 0.9, "{report:?}");
    for t in &mesh.triangles {
        for (a, b) in [(0, 1), (1, 2), (2, 0)] {
            let [a, b] = [a, b].map(|k: usize| mesh.points[t.vertices[k].index()]);
            let ratio = (b - a).norm() / Graded.size_at(&nalgebra::center(&a, &b));
            assert!((0.4..2.0).contains(&ratio), "{ratio} at {a}");
        }
    }
}
