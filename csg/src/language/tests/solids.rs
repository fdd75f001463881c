//! Primitives, transforms and Boolean operations, compared with hand-written inside functions.

use super::*;
use crate::Vector;
use std::f64::consts::FRAC_PI_2;

#[test]
fn a_plane_has_its_inside_opposite_to_its_normal_of_any_length() {
    assert_is(&solid("plane (1, 0, 0; 5, 5, 0)"), |p| p.x + p.y < 1.0);
    assert_is(&solid("plane (1, 0, 0; 1e-30, 1e-30, 0)"), |p| p.x + p.y < 1.0);
}

#[test]
fn a_sphere_is_a_ball() {
    assert_is(&solid("sphere (1, 0, --1; 2)"), |p| (p - Point::new(1., 0., 1.)).norm() < 2.0);
}

#[test]
fn a_cylinder_is_infinite_both_ways() {
    assert_is(&solid("cylinder (0, 0, 1; 0, 0, 1.5; 1)"), |p| p.x.hypot(p.y) < 1.0);
}

#[test]
fn a_cone_has_both_nappes() {
    let inside = |p: &Point| p.y.hypot(p.z) < (1.0 - 0.5 * p.x).abs();
    assert_is(&solid("cone (0, 0, 0; 1; 1, 0, 0; 0.5)"), inside);
    assert_is(&solid("cone (1, 0, 0; 0.5; 0, 0, 0; 1)"), inside);
    assert_is(&solid("cone (2, 0, 0; 0; 0, 0, 0; 1)"), inside);
}

#[test]
fn a_cone_with_equal_radii_is_a_cylinder() {
    let geometry = solid("cone (0, 0, 0; 1; 0, 0, 5; 1)");
    assert!(matches!(geometry.surfaces[0], Surface::Cylinder(_)));
}

#[test]
fn an_elliptic_cylinder_has_vectors_as_semi_axes() {
    assert_is(&solid("ellipticcylinder (0, 0, 0; 1, 0, 0; 0, 2, 0)"), |p| {
        p.x.powi(2) + (p.y / 2.0).powi(2) < 1.0
    });
}

#[test]
fn an_ellipsoid_has_vectors_as_semi_axes() {
    assert_is(&solid("ellipsoid (0, 0, 1; 0, 3, 0; 1, 0, 0; 0, 0, 2)"), |p| {
        p.x.powi(2) + (p.y / 3.0).powi(2) + ((p.z - 1.0) / 2.0).powi(2) < 1.0
    });
}

#[test]
fn round_ellipses_are_circles() {
    assert!(matches!(solid("ellipsoid (0,0,0; 0,2,0; 2,0,0; 0,0,2)").surfaces[0], Surface::Sphere(_)));
    let cylinder = solid("ellipticcylinder (0,0,0; 0.6,0.8,0; -0.8,0.6,0)");
    assert!(matches!(cylinder.surfaces[0], Surface::Cylinder(_)));
    let cone = solid("ellipticcone (0,0,0; 2,0,0; 0,2,0; 4; 0.5)");
    assert!(matches!(cone.surfaces[0], Surface::Cone(_)));
    assert_is(&cone, |p| p.x.hypot(p.y) < 2.0 - p.z / 4.0);
}

#[test]
fn an_elliptic_cone_shrinks_along_long_cross_short() {
    let at = |height: f64| move |p: &Point| (p.x / 2.0).hypot(p.y) < (1.0 - 0.5 * p.z / height).abs();
    assert_is(&solid("ellipticcone (0,0,0; 2,0,0; 0,1,0; 2; 0.5)"), at(2.0));
    assert_is(&solid("ellipticcone (0,0,0; 2,0,0; 0,1,0; 1; 0)"), |p| {
        (p.x / 2.0).hypot(p.y) < (1.0 - p.z).abs()
    });
    let swapped = parsed("solid a = ellipticcone (0,0,0; 0,1,0; 2,0,0; 2; 0.5); tlo a;");
    assert!(swapped.warnings[0].message.contains("second × first"));
    // (2,0,0) × (0,1,0) is +z: the height is measured upward although the text gives the axes in
    // the other order.
    assert_is(&swapped.geometry, at(2.0));
}

#[test]
fn an_elliptic_cone_of_ratio_one_is_a_cylinder() {
    let geometry = solid("ellipticcone (0,0,0; 2,0,0; 0,1,0; 2; 1)");
    assert!(matches!(geometry.surfaces[0], Surface::EllipticCylinder(_)));
}

#[test]
fn a_brick_has_six_planes_in_the_order_of_netgen() {
    let geometry = solid("orthobrick (-1, -2, 0; 1, 2, 0.5)");
    assert_is(&geometry, |p| p.x.abs() < 1.0 && p.y.abs() < 2.0 && p.z > 0.0 && p.z < 0.5);
    let origin = Point::new(0.0, 0.0, 0.25);
    let distances: Vec<f64> = geometry.surfaces.iter().map(|s| -s.value(&origin)).collect();
    assert_eq!(distances, [0.25, 0.25, 2.0, 2.0, 1.0, 1.0]);
}

#[test]
fn a_torus_is_a_ring() {
    assert_is(&solid("torus (0,0,0; 0,0,3; 2; 0.5)"), |p| (p.x.hypot(p.y) - 2.0).hypot(p.z) < 0.5);
    // Without a hole, the dimples are filled near the axis.
    for (major, minor) in [(1.0, 1.0), (0.8, 1.0), (0.1, 1.0)] {
        let radius = f64::min(0.1, 0.5 * major);
        let end = (minor - major + radius).sqrt() * (minor + major - radius).sqrt();
        let text = format!("algebraic3d solid a = torus (0,0,0; 0,0,3; {major}; {minor}); tlo a;");
        let parsed = parse_geometry(&text, "t.geo").unwrap();
        assert!(parsed.warnings[0].to_string().contains("no hole"), "{}", parsed.warnings[0]);
        assert_is(&parsed.geometry, |p| {
            let distance = p.x.hypot(p.y);
            (distance - major).hypot(p.z) < minor || distance < radius && p.z.abs() < end
        });
    }
}

const CUBE: &str = "polyhedron (0,0,0; 1,0,0; 1,1,0; 0,1,0; 0,0,1; 1,0,1; 1,1,1; 0,1,1 ;;
    1,4,3,2; 5,6,7,8; 1,2,6,5; 2,3,7,6; 3,4,8,7; 4,1,5,8)";

#[test]
fn a_convex_polyhedron_is_an_intersection() {
    let geometry = solid(&format!("translate (-0.5, 0, 0; {CUBE})"));
    assert_eq!(geometry.surfaces.len(), 6);
    assert!(matches!(&geometry.bodies[0].solid, Solid::And(halves) if halves.len() == 6));
    assert_is(&geometry, |p| p.x.abs() < 0.5 && (0.0..1.0).contains(&p.y) && (0.0..1.0).contains(&p.z));
}

/// A prism from z = 0 to z = `height` over a counterclockwise polygon.
fn prism(polygon: &[[f64; 2]], height: f64) -> String {
    let n = polygon.len();
    let mut points = String::new();
    for z in [0.0, height] {
        for [x, y] in polygon {
            points += &format!("{x},{y},{z}; ");
        }
    }
    let mut faces: Vec<String> =
        (1..=n).map(|i| (i, i % n + 1)).map(|(i, j)| format!("{i},{j},{},{}", j + n, i + n)).collect();
    // Lids are fans around a point from which the whole polygon is visible.
    points += &format!("0,0,0; 0,0,{height};");
    for (i, j) in (1..=n).map(|i| (i, i % n + 1)) {
        faces.push(format!("{j},{i},{}", 2 * n + 1));
        faces.push(format!("{},{},{}", i + n, j + n, 2 * n + 2));
    }
    format!("polyhedron ({points}; {})", faces.join("; "))
}

#[test]
fn a_nonconvex_polyhedron_has_the_inside_of_its_faces() {
    let star: Vec<[f64; 2]> = (0..10)
        .map(|i| (f64::from(i) * 0.1 * std::f64::consts::TAU, if i % 2 == 0 { 2.9 } else { 1.0 }))
        .map(|(angle, radius)| [radius * angle.cos(), radius * angle.sin()])
        .collect();
    let geometry = solid(&prism(&star, 2.0));
    assert_eq!(geometry.surfaces.len(), 12, "ten walls, two lids");
    let in_star = |p: &Point| {
        // Even-odd rule.
        let crossings = (0..10).filter(|&i| {
            let ([ax, ay], [bx, by]) = (star[i], star[(i + 1) % 10]);
            (ay > p.y) != (by > p.y) && p.x < ax + (p.y - ay) / (by - ay) * (bx - ax)
        });
        crossings.count() % 2 == 1
    };
    assert_is(&geometry, |p| (0.0..2.0).contains(&p.z) && in_star(p));
}

#[test]
fn a_polyhedron_may_have_a_hollow() {
    let inner = "polyhedron (-1,-1,-1; 1,-1,-1; 1,1,-1; -1,1,-1; -1,-1,1; 1,-1,1; 1,1,1; -1,1,1;
        -2,-2,-2; 2,-2,-2; 2,2,-2; -2,2,-2; -2,-2,2; 2,-2,2; 2,2,2; -2,2,2 ;;
        2,3,4,1; 8,7,6,5; 5,6,2,1; 6,7,3,2; 7,8,4,3; 8,5,1,4;
        9,12,11,10; 13,14,15,16; 9,10,14,13; 10,11,15,14; 11,12,16,15; 12,9,13,16)";
    assert_is(&solid(inner), |p| p.coords.amax() < 2.0 && p.coords.amax() > 1.0);
}

#[test]
fn and_binds_tighter_than_or_and_not_tightest() {
    let named =
        "solid x = plane (0,0,0; -1,0,0); solid y = plane (0,0,0; 0,-1,0); solid z = plane (0,0,0; 0,0,-1);";
    let with = |body: &str| geometry(&format!("{named} solid a = {body}; tlo a;"));
    assert_is(&with("x and y or z"), |p| (p.x > 0.0 && p.y > 0.0) || p.z > 0.0);
    assert_is(&with("x and (y or z)"), |p| p.x > 0.0 && (p.y > 0.0 || p.z > 0.0));
    assert_is(&with("not x and y"), |p| p.x < 0.0 && p.y > 0.0);
    assert_is(&with("not (x and y)"), |p| !(p.x > 0.0 && p.y > 0.0));
    assert_is(&with("not not x"), |p| p.x > 0.0);
    assert_is(&with("not (not (x or not y))"), |p| p.x > 0.0 || p.y < 0.0);
}

#[test]
fn rotations_are_clockwise_and_in_radians() {
    // +x is mapped to -y.
    let geometry = solid("rotate (0,0,0; 1.5708,0,0; plane (1,0,0; 1,0,0))");
    assert_is(&geometry, |p| p.y > -1.0);
    let Surface::Plane(plane) = &geometry.surfaces[0] else { panic!() };
    assert!((plane.normal + Vector::y()).norm() < 1e-15, "1.5708 is a right angle: {}", plane.normal);
}

#[test]
fn euler_angles_are_z_x_z_about_the_given_center() {
    let (alpha, beta, gamma) = (0.3_f64, 0.5_f64, -0.7_f64);
    let geometry = solid("rotate (1,2,3; 0.3,0.5,-0.7; orthobrick (-1,-1.5,0; 1,1.5,2.5))");
    let center = Vector::new(1.0, 2.0, 3.0);
    let about_z =
        |a: f64, v: Vector| Vector::new(v.x * a.cos() + v.y * a.sin(), -v.x * a.sin() + v.y * a.cos(), v.z);
    let about_x =
        |a: f64, v: Vector| Vector::new(v.x, v.y * a.cos() + v.z * a.sin(), -v.y * a.sin() + v.z * a.cos());
    assert_is(&geometry, |p| {
        let back = about_z(-alpha, about_x(-beta, about_z(-gamma, p.coords - center))) + center;
        back.x.abs() < 1.0 && back.y.abs() < 1.5 && back.z > 0.0 && back.z < 2.5
    });
}

#[test]
fn every_primitive_can_be_moved() {
    let shift = Vector::new(0.5, -0.25, 1.0);
    for text in [
        "plane (1,0,0; 5,5,0)",
        "sphere (0,0,0; 2)",
        "cylinder (0,0,0; 1,1,1; 1)",
        "cone (0,0,0; 1; 1,0,0; 0.5)",
        "ellipticcylinder (0,0,0; 1,0,0; 0,2,0)",
        "ellipticcone (0,0,0; 2,0,0; 0,1,0; 2; 0.5)",
        "ellipsoid (0,0,0; 0,3,0; 1,0,0; 0,0,2)",
        "orthobrick (-1,-1,-1; 1,1,1)",
        "torus (0,0,0; 0,0,1; 2; 0.5)",
        CUBE,
    ] {
        let original = solid(text);
        let copy = solid(&format!("translate (0.5, -0.25, 1; {text})"));
        assert_is(&copy, |p| is_inside(&original, &original.bodies[0].solid, &(p - shift)));
        let turned = solid(&format!("rotate (0,0,0; 0,{FRAC_PI_2},0; {text})"));
        assert_is(&turned, |p| is_inside(&original, &original.bodies[0].solid, &Point::new(p.x, -p.z, p.y)));
    }
}

#[test]
fn multitranslate_makes_one_more_than_its_count() {
    let geometry = solid("multitranslate (1.5,0,0; 2; sphere (-1.5,0,0; 0.6))");
    assert_eq!(geometry.surfaces.len(), 3);
    assert_is(&geometry, |p| [-1.5, 0.0, 1.5].iter().any(|x| (p - Point::new(*x, 0., 0.)).norm() < 0.6));
}

#[test]
fn multirotate_makes_as_many_as_its_count() {
    let geometry = solid(&format!("multirotate (0,0,0; {FRAC_PI_2},0,0; 3; sphere (2,0,0; 0.9))"));
    assert_eq!(geometry.surfaces.len(), 3);
    let centers = [[2., 0.], [0., -2.], [-2., 0.]];
    assert_is(&geometry, |p| centers.iter().any(|[x, y]| (p - Point::new(*x, *y, 0.)).norm() < 0.9));
}

#[test]
fn transforms_nest() {
    let geometry =
        solid("multitranslate (1,0,0; 9; multitranslate (0,1,0; 9; cylinder (0.5,0.5,-1; 0.5,0.5,3; 0.2)))");
    assert_eq!(geometry.surfaces.len(), 100);
}

#[test]
fn a_chain_of_thousands_of_definitions_is_one_union() {
    let mut text = String::from("solid a0 = sphere (0,0,0; 0.5);\n");
    for i in 1..20_000 {
        text += &format!("solid a{i} = a{} or sphere ({i},0,0; 0.5);\n", i - 1);
    }
    let geometry = geometry(&(text + "tlo a19999;"));
    assert!(matches!(&geometry.bodies[0].solid, Solid::Or(members) if members.len() == 20_000));
}

#[test]
fn a_copy_uses_the_current_definition_of_its_solid() {
    let text = "solid b = sphere (0,0,0; 1); solid c = translate (1,0,0; b); solid b = sphere (0,0,0; 2);
                solid a = b and c; tlo a;";
    let parsed = parsed(text);
    assert_is(&parsed.geometry, |p| p.coords.norm() < 2.0 && (p - Point::new(1., 0., 0.)).norm() < 1.0);
}

#[test]
fn a_redefinition_changes_earlier_uses() {
    let text = "solid b = sphere (0,0,0; 1); solid a = b and plane (0,0,0; 1,0,0); solid b = sphere (0,0,0; 2); tlo a;";
    let parsed = parsed(text);
    assert!(parsed.warnings[0].message.contains("`b` is already defined in line 2"));
    assert_is(&parsed.geometry, |p| p.coords.norm() < 2.0 && p.x < 0.0);
}
