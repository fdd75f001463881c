//! Revolutions and extrusions, compared with hand-written inside functions.

use super::*;
use proptest::prelude::*;

/// The geometry of a file with the given curves and one solid.
fn swept(curves: &str, solid: &str) -> Geometry {
    geometry(&format!("{curves} solid s = {solid}; tlo s;"))
}

/// A `curve2d` of lines through points.
fn polygon(points: &[[f64; 2]], closed: bool) -> String {
    let n = points.len();
    let places: String = points.iter().map(|[x, y]| format!("{x:?}, {y:?}; ")).collect();
    let lines: Vec<String> =
        (1..=if closed { n } else { n - 1 }).map(|i| format!("2, {i}, {}", i % n + 1)).collect();
    format!("curve2d p = ({n}; {places}{}; {});", lines.len(), lines.join("; "))
}

/// Whether a point is in a polygon, by the even-odd rule.
fn is_in(points: &[[f64; 2]], [x, y]: [f64; 2]) -> bool {
    let crosses = |i: usize| {
        let ([a, b], [c, d]) = (points[i], points[(i + 1) % points.len()]);
        (b > y) != (d > y) && x < a + (y - b) * (c - a) / (d - b)
    };
    (0..points.len()).filter(|&i| crosses(i)).count() % 2 == 1
}

/// A simple polygon, star-shaped about (0, 2), from radii in order of the angle.
fn star() -> impl Strategy<Value = Vec<[f64; 2]>> {
    prop::collection::vec(0.6..1.8f64, 3..14).prop_map(|radii| {
        let n = radii.len() as f64;
        let angle = |i: usize| (i as f64 + 0.1) / n * std::f64::consts::TAU;
        radii.iter().enumerate().map(|(i, r)| [r * angle(i).cos(), 2.0 + r * angle(i).sin()]).collect()
    })
}

proptest! {
    #![proptest_config(crate::seeded())]

    #[test]
    fn a_revolution_of_any_polygon_has_the_right_inside(points in star(), clockwise: bool) {
        let mut given = points.clone();
        if clockwise { given.reverse(); }
        let geometry = swept(&polygon(&given, true), "revolution (0, 0, 0; 1, 0, 0; p)");
        assert_is(&geometry, |p| is_in(&points, [p.x, p.y.hypot(p.z)]));
    }

    #[test]
    fn an_extrusion_of_any_polygon_is_a_prism(points in star()) {
        let path = "curve3d q = (2; 0, 0, -1; 0, 0, 2; 1; 2, 1, 2);";
        let geometry = swept(&(path.to_owned() + &polygon(&points, true)), "extrusion (q; p; 0, 1, 0)");
        // x' = (0, 0, 1) × (0, 1, 0).
        assert_is(&geometry, |p| p.z > -1.0 && p.z < 2.0 && is_in(&points, [-p.x, p.y]));
    }
}

#[test]
fn a_revolution_of_a_nonconvex_staircase_has_the_right_inside() {
    let points = [
        [-2., 0.5],
        [-2., 2.5],
        [-1., 2.5],
        [-1., 1.],
        [0., 1.],
        [0.5, 2.5],
        [1., 1.],
        [1.5, 1.],
        [1.5, 2.5],
        [2., 2.5],
        [2., 0.5],
    ];
    let geometry = swept(&polygon(&points, true), "revolution (0, 0, 0; 2, 0, 0; p)");
    assert_is(&geometry, |p| is_in(&points, [p.x, p.y.hypot(p.z)]));
}

#[test]
fn a_profile_closed_by_the_axis_has_cones_planes_and_cylinders() {
    let points = [[-2., 0.], [-2., 1.], [0., 1.], [0., 2.], [2., 0.]];
    let geometry = swept(&polygon(&points, false), "revolution (0, 0, 0; 2, 0, 0; p)");
    assert_is(&geometry, |p| is_in(&points, [p.x, p.y.hypot(p.z)]));
    let kinds = geometry.surfaces.iter().map(|s| match s {
        Surface::Plane(_) => 'p',
        Surface::Cylinder(_) => 'c',
        Surface::Nappe(_) => 'n',
        _ => '?',
    });
    assert_eq!(kinds.collect::<String>(), "npcp");
}

/// Four quarter arcs of an ellipse about (x, y).
fn ring(x: f64, y: f64, r: f64, s: f64) -> String {
    let p = |i: f64, j: f64| format!("{:?}, {:?}; ", x + i * r, y + j * s);
    let points = [[1., 0.], [1., 1.], [0., 1.], [-1., 1.], [-1., 0.], [-1., -1.], [0., -1.], [1., -1.]];
    let points: String = points.iter().map(|[i, j]| p(*i, *j)).collect();
    format!("curve2d p = (8; {points}4; 3,1,2,3; 3,3,4,5; 3,5,6,7; 3,7,8,1);")
}

#[test]
fn a_revolved_circle_is_one_torus() {
    let geometry = swept(&ring(0.5, 2.0, 0.5, 0.5), "revolution (0, 0, 0; 1, 0, 0; p)");
    assert!(matches!(&geometry.surfaces[..], [Surface::Torus(t)] if t.major == 2.0));
    assert_is(&geometry, |p| (p.x - 0.5).hypot(p.y.hypot(p.z) - 2.0) < 0.5);
}

#[test]
fn an_extruded_circle_is_one_cylinder_between_planes() {
    let path = "curve3d q = (2; 0, 0, 0; 0, 2, 0; 1; 2, 1, 2);";
    let geometry = swept(&(path.to_owned() + &ring(0.5, 0.0, 1.0, 1.0)), "extrusion (q; p; 0, 0, 1)");
    assert_eq!(geometry.surfaces.len(), 3);
    // x' = (0, 1, 0) × (0, 0, 1).
    assert_is(&geometry, |p| p.y > 0.0 && p.y < 2.0 && (p.x - 0.5).hypot(p.z) < 1.0);
}

/// The point of a segment of kind 3 at the parameter `t`.
fn at(points: [[f64; 2]; 3], t: f64) -> [f64; 2] {
    let [p, q, r] = points.map(|[x, y]| crate::Vector::new(x, y, 0.0));
    let w = (r - p).norm() / (0.5 * ((q - p).norm_squared() + (r - q).norm_squared())).sqrt();
    let [b, c, d] = [(1.0 - t) * (1.0 - t), w * t * (1.0 - t), t * t];
    let x = (p * b + q * c + r * d) / (b + c + d);
    [x.x, x.y]
}

#[test]
fn arcs_may_bulge_outward_and_inward() {
    // A stadium with a groove; the cap of the right arc extends above the line at its top.
    let text = "curve2d p = (9; -1,1; 1,1; 2.5,2.5; 1,3; 0.5,3; 0,2; -0.5,3; -1,3; -2,2;
        6; 2,1,2; 3,2,3,4; 2,4,5; 3,5,6,7; 2,7,8; 3,8,9,1);";
    let geometry = swept(text, "revolution (0, 0, 0; 1, 0, 0; p)");
    // The same curve, approximated by short lines.
    let mut fine = vec![[-1., 1.]];
    for arc in [
        [[1., 1.], [2.5, 2.5], [1., 3.]],
        [[0.5, 3.], [0., 2.], [-0.5, 3.]],
        [[-1., 3.], [-2., 2.], [-1., 1.]],
    ] {
        fine.extend((0..=4000).map(|i| at(arc, f64::from(i) / 4000.0)));
    }
    assert_is(&geometry, |p| is_in(&fine, [p.x, p.y.hypot(p.z)]));
}

#[test]
fn a_half_circle_on_the_axis_is_a_ball() {
    let text = "curve2d p = (5; -1,0; -1,1; 0,1; 1,1; 1,0; 2; 3,1,2,3; 3,3,4,5);";
    let geometry = swept(text, "revolution (0, 0, 0; 1, 0, 0; p)");
    assert!(matches!(&geometry.surfaces[..], [Surface::Sphere(_)]));
    assert_is(&geometry, |p| p.coords.norm() < 1.0);
}

#[test]
fn a_spherical_cap_on_the_axis_has_the_right_inside() {
    let text = "curve2d p = (5; -1,0; -1,1; 0,1; 2,1; 2,0; 3; 3,1,2,3; 2,3,4; 2,4,5);";
    let geometry = swept(text, "revolution (0, 0, 0; 1, 0, 0; p)");
    assert_is(&geometry, |p| {
        let y = p.y.hypot(p.z);
        (p.x < 0.0 && p.coords.norm() < 1.0) || (p.x >= 0.0 && p.x < 2.0 && y < 1.0)
    });
    let tips = geometry.surfaces.iter().filter_map(|s| s.apex());
    assert!(tips.into_iter().all(|tip| tip.x > 0.0));
}

#[test]
fn a_pipe_bend_is_cylinders_and_a_torus() {
    let path = "curve3d q = (5; -2,0,0; 0,0,0; 2,0,0; 2,2,0; 2,3,0; 3; 2,1,2; 3,2,3,4; 2,4,5);";
    let geometry = swept(&(path.to_owned() + &ring(0.0, 0.0, 0.5, 0.5)), "extrusion (q; p; 0, 0, 1)");
    assert_is(&geometry, |p| {
        let bend = p.x > 0.0 && p.y < 2.0 && ((p.x).hypot(p.y - 2.0) - 2.0).hypot(p.z) < 0.5;
        let before = p.x > -2.0 && p.x <= 0.0 && p.y.hypot(p.z) < 0.5;
        let after = p.y >= 2.0 && p.y < 3.0 && (p.x - 2.0).hypot(p.z) < 0.5;
        bend || before || after
    });
    let count = |kind: fn(&Surface) -> bool| geometry.surfaces.iter().filter(|s| kind(s)).count();
    assert_eq!(count(|s| matches!(s, Surface::Torus(_))), 1);
    assert_eq!(count(|s| matches!(s, Surface::Cylinder(_))), 2);
}

#[test]
fn invalid_profiles_are_reported() {
    let solid = "solid s = revolution (0,0,0; 1,0,0; p); tlo s;";
    let crossing = error(&format!("{} {solid}", polygon(&[[0., 1.], [2., 2.], [2., 1.], [0., 3.]], true)));
    assert!(crossing.contains("cross"), "{crossing}");
    let below = error(&format!("{} {solid}", polygon(&[[0., 1.], [2., -1.], [2., 2.]], true)));
    assert!(below.contains("beyond the axis"), "{below}");
}

#[test]
fn a_path_with_corners_is_mitred() {
    // Legs of length 2.5 and 2; the profile is a unit square with its y axis along z.
    let path = "curve3d q = (3; 0,0,0; 2.5,0,0; 2.5,2,0; 2; 2,1,2; 2,2,3);";
    let bar = polygon(&[[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]], true);
    let geometry = swept(&format!("{path} {bar}"), "extrusion (q; p; 0,0,1)");
    let is_bar = |p: &Point| {
        let first = p.y.abs() < 0.5 && p.x > 0.0 && p.x < 3.0;
        let second = (p.x - 2.5).abs() < 0.5 && p.y > -0.5 && p.y < 2.0;
        p.z.abs() < 0.5 && (first || second)
    };
    assert_is(&geometry, is_bar);
    let features = crate::Features::find(&geometry).unwrap();
    assert_eq!([features.corners.len(), features.curves.len(), features.patches.len()], [12, 18, 8]);
}

#[test]
fn arcs_of_a_rotating_profile_continue_across_a_joint() {
    // Near the joint, the arc before it and the chord of the one after it cross where neither is
    // relevant.
    let path = "curve3d q = (5; 0,0,0; 4,0,2; 4,4,4; 4,8,6; 0,8,8; 2; 3,1,2,3; 3,3,4,5);";
    let profile = "curve2d p = (4; -1,0; -0.7,0.7; 0,1; 0.5,-0.8; 3; 3,1,2,3; 2,3,4; 2,4,1);";
    let features =
        crate::Features::find(&swept(&format!("{path} {profile}"), "extrusion (q; p; 0,0,1)")).unwrap();
    assert_eq!([features.corners.len(), features.curves.len(), features.patches.len()], [9, 15, 8]);
}

#[test]
fn arcs_may_be_shallow() {
    let path = "curve3d q = (3; 0,0,0; 10,0,2; 10,10,4; 1; 3,1,2,3);";
    let profile = "curve2d p = (5; 0,1; 0,2; 1.5,2.002; 3,2; 3,1; 4; 2,1,2; 3,2,3,4; 2,4,5; 2,5,1);";
    for solid in ["extrusion (q; p; 0,0,1)", "revolution (0,0,0; 1,0,0; p)"] {
        let features = crate::Features::find(&swept(&format!("{path} {profile}"), solid)).unwrap();
        assert!(features.patches.len() >= 4, "{solid}");
    }
}

#[test]
fn paths_that_run_back_or_are_too_short_for_their_corners_are_rejected() {
    let bar = polygon(&[[-0.1, -0.1], [0.1, -0.1], [0.1, 0.1], [-0.1, 0.1]], true);
    for path in [
        "curve3d q = (3; 0,0,0; 2,0,0; 1,0,0; 2; 2,1,2; 2,2,3);",
        "curve3d q = (4; 0,0,0; 2,0,0; 2,0.1,0; 4,0.1,0; 3; 2,1,2; 2,2,3; 2,3,4);",
    ] {
        let message = error(&format!("{path} {bar} solid s = extrusion (q; p; 0,0,1); tlo s;"));
        assert!(message.contains("too short for its mitred corners"), "{message}");
    }
}

#[test]
fn arcs_of_thin_shells_are_bisected() {
    // Two arcs of different ellipses between the same points: their chords coincide.
    let text = "curve2d p = (4; -2,1; 1,4; 2,1; 0.8,2.8; 2; 3,1,2,3; 3,3,4,1);";
    let geometry = swept(text, "revolution (0, 0, 0; 1, 0, 0; p)");
    let mut fine = Vec::new();
    for arc in [[[-2., 1.], [1., 4.], [2., 1.]], [[2., 1.], [0.8, 2.8], [-2., 1.]]] {
        fine.extend((0..4000).map(|i| at(arc, f64::from(i) / 4000.0)));
    }
    assert_is(&geometry, |p| is_in(&fine, [p.x, p.y.hypot(p.z)]));
    assert_eq!(geometry.surfaces.iter().filter(|s| matches!(s, Surface::Revolved(_))).count(), 2);
}

#[test]
fn a_list_of_numbers_has_one_for_each_segment_of_the_profile() {
    let square = polygon(&[[-1., 1.], [1., 1.], [1., 2.], [-1., 2.]], true);
    let ring = geometry(&format!("{square} solid s = revolution (0,0,0; 1,0,0; p) -bc=[1,2,3,4]; tlo s;"));
    let number = |geometry: &Geometry, is: fn(&Surface) -> bool| {
        let index = geometry.surfaces.iter().position(is).expect("a surface of this kind");
        geometry.surface_info[index].bc
    };
    assert_eq!(number(&ring, |s| matches!(s, Surface::Cylinder(c) if c.radius == 1.0)), Some(1));
    assert_eq!(number(&ring, |s| matches!(s, Surface::Plane(p) if p.point.x == 1.0)), Some(2));
    assert_eq!(number(&ring, |s| matches!(s, Surface::Cylinder(c) if c.radius == 2.0)), Some(3));
    // The planes at the ends of a path have no number.
    let path = "curve3d q = (2; 0,0,0; 0,0,5; 1; 2,1,2);";
    let bar = geometry(&format!("{path} {square} solid s = extrusion (q; p; 0,1,0) -bc=[1,2,3,4]; tlo s;"));
    assert_eq!(bar.surfaces.len(), 6);
    assert_eq!(bar.surface_info.iter().filter(|info| info.bc.is_none()).count(), 2);
}

#[test]
fn points_on_a_straight_side_of_a_profile_have_no_effect() {
    let points = [
        [-2., 0.],
        [-2., 1.],
        [-1.8, 1.2],
        [-1., 1.2],
        [-1., 2.],
        [-0.5, 2.],
        [0., 2.],
        [0., 1.5],
        [1., 1.5],
        [1.5, 1.],
        [2., 1.],
        [2.3, 0.7],
        [2.3, 0.],
    ];
    let geometry = swept(&polygon(&points, false), "revolution (0, 0, 0; 2, 0, 0; p)");
    assert_is(&geometry, |p| is_in(&points, [p.x, p.y.hypot(p.z)]));
}
