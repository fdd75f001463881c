//! Revolutions and extrusions, compared with inside functions written by hand.

use super::*;
use proptest::prelude::*;

/// The only body of a file with these curves and this solid.
fn swept(curves: &str, solid: &str) -> Geometry {
    geometry(&format!("{curves} solid s = {solid}; tlo s;"))
}

/// A `curve2d` through points, by lines.
fn polygon(points: &[[f64; 2]], closed: bool) -> String {
    let n = points.len();
    let places: String = points.iter().map(|[x, y]| format!("{x:?}, {y:?}; ")).collect();
    let lines: Vec<String> =
        (1..=if closed { n } else { n - 1 }).map(|i| format!("2, {i}, {}", i % n + 1)).collect();
    format!("curve2d p = ({n}; {places}{}; {});", lines.len(), lines.join("; "))
}

/// Whether a point is in a polygon, by parity.
fn is_in(points: &[[f64; 2]], [x, y]: [f64; 2]) -> bool {
    let crosses = |i: usize| {
        let ([a, b], [c, d]) = (points[i], points[(i + 1) % points.len()]);
        (b > y) != (d > y) && x < a + (y - b) * (c - a) / (d - b)
    };
    (0..points.len()).filter(|&i| crosses(i)).count() % 2 == 1
}

/// A polygon without crossings, star-shaped about (0, 2): radii in order of the angle.
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
    fn a_revolution_of_any_polygon_is_what_turns(points in star(), clockwise: bool) {
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
fn a_staircase_with_dents_is_where_it_should_be() {
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

/// Four quarter arcs about (x, y).
fn ring(x: f64, y: f64, r: f64, s: f64) -> String {
    let p = |i: f64, j: f64| format!("{:?}, {:?}; ", x + i * r, y + j * s);
    let points = [[1., 0.], [1., 1.], [0., 1.], [-1., 1.], [-1., 0.], [-1., -1.], [0., -1.], [1., -1.]];
    let points: String = points.iter().map(|[i, j]| p(*i, *j)).collect();
    format!("curve2d p = (8; {points}4; 3,1,2,3; 3,3,4,5; 3,5,6,7; 3,7,8,1);")
}

#[test]
fn a_turned_circle_is_one_torus() {
    let geometry = swept(&ring(0.5, 2.0, 0.5, 0.5), "revolution (0, 0, 0; 1, 0, 0; p)");
    assert!(matches!(&geometry.surfaces[..], [Surface::Torus(t)] if t.major == 2.0));
    assert_is(&geometry, |p| (p.x - 0.5).hypot(p.y.hypot(p.z) - 2.0) < 0.5);
}

#[test]
fn a_moved_circle_is_one_cylinder_between_planes() {
    let path = "curve3d q = (2; 0, 0, 0; 0, 2, 0; 1; 2, 1, 2);";
    let geometry = swept(&(path.to_owned() + &ring(0.5, 0.0, 1.0, 1.0)), "extrusion (q; p; 0, 0, 1)");
    assert_eq!(geometry.surfaces.len(), 3);
    // x' = (0, 1, 0) × (0, 0, 1).
    assert_is(&geometry, |p| p.y > 0.0 && p.y < 2.0 && (p.x - 0.5).hypot(p.z) < 1.0);
}

/// A point of a segment of kind 3.
fn at(points: [[f64; 2]; 3], t: f64) -> [f64; 2] {
    let [p, q, r] = points.map(|[x, y]| crate::Vector::new(x, y, 0.0));
    let w = (r - p).norm() / (0.5 * ((q - p).norm_squared() + (r - q).norm_squared())).sqrt();
    let [b, c, d] = [(1.0 - t) * (1.0 - t), w * t * (1.0 - t), t * t];
    let x = (p * b + q * c + r * d) / (b + c + d);
    [x.x, x.y]
}

#[test]
fn arcs_bulge_out_of_polygons_and_into_them() {
    // A stadium with a groove; the cap of the arc on the right reaches above the line at its top.
    let text = "curve2d p = (9; -1,1; 1,1; 2.5,2.5; 1,3; 0.5,3; 0,2; -0.5,3; -1,3; -2,2;
        6; 2,1,2; 3,2,3,4; 2,4,5; 3,5,6,7; 2,7,8; 3,8,9,1);";
    let geometry = swept(text, "revolution (0, 0, 0; 1, 0, 0; p)");
    // The same curve, cut into short lines.
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
fn a_cap_on_the_axis_is_smooth_and_its_chord_stays_away() {
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
fn profiles_that_cross_are_named() {
    let solid = "solid s = revolution (0,0,0; 1,0,0; p); tlo s;";
    let crossing = error(&format!("{} {solid}", polygon(&[[0., 1.], [2., 2.], [2., 1.], [0., 3.]], true)));
    assert!(crossing.contains("cross"), "{crossing}");
    let below = error(&format!("{} {solid}", polygon(&[[0., 1.], [2., -1.], [2., 2.]], true)));
    assert!(below.contains("beyond the axis"), "{below}");
}

#[test]
fn a_path_with_corners_is_mitred() {
    // Legs of 2.5 and 2; the profile is a square of side 1, whose y is along z.
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
fn arcs_of_a_profile_that_turns_about_its_path_are_followed_over_a_joint() {
    // Beside the joint the arc before it and the chord of the one behind it cross where neither matters.
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
fn paths_that_run_back_or_are_too_short_for_their_corners_are_refused() {
    let bar = polygon(&[[-0.1, -0.1], [0.1, -0.1], [0.1, 0.1], [-0.1, 0.1]], true);
    for path in [
        "curve3d q = (3; 0,0,0; 2,0,0; 1,0,0; 2; 2,1,2; 2,2,3);",
        "curve3d q = (4; 0,0,0; 2,0,0; 2,0.1,0; 4,0.1,0; 3; 2,1,2; 2,2,3; 2,3,4);",
    ] {
        let message = error(&format!("{path} {bar} solid s = extrusion (q; p; 0,0,1); tlo s;"));
        assert!(message.contains("too short for its corners"), "{message}");
    }
}

#[test]
fn thin_shells_between_arcs_have_their_arcs_halved() {
    // Two arcs of different ellipses between the same points: the chords coincide.
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
    // The planes across the ends of a path have none.
    let path = "curve3d q = (2; 0,0,0; 0,0,5; 1; 2,1,2);";
    let bar = geometry(&format!("{path} {square} solid s = extrusion (q; p; 0,1,0) -bc=[1,2,3,4]; tlo s;"));
    assert_eq!(bar.surfaces.len(), 6);
    assert_eq!(bar.surface_info.iter().filter(|info| info.bc.is_none()).count(), 2);
}

#[test]
fn points_on_a_straight_side_of_a_profile_change_nothing() {
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
