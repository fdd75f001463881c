//! Features of tangent surfaces, and of cones with their apexes.

use super::tests::{counts, find, refused};
use crate::Interval;

#[test]
fn fillets_and_caps_have_seams_even_with_rounded_decimals() {
    // Sources, and numbers of corners, curves between corners, closed curves and patches.
    let cases = [
        ("solid s = cylinder (0,0,0; 0,0,1; 1) and plane (0,0,0; 0,0,-1) and plane (0,0,1; 0,0,1)
            and plane (1,0,0; 1,0,0) and plane (0,-1.000000001,0; 0,-1,0); tlo s;", [0, 0, 2, 3]),
        ("solid rod = cylinder (0,0,0; 0,0,1; 1) and plane (0,0,0; 0,0,-1) and plane (0,0,2; 0,0,1);
            solid s = rod or sphere (0,0,0; 1.000000001) or sphere (0,0,2; 0.9999999995); tlo s;", [0, 0, 2, 3]),
        ("solid up = cylinder (0,0,0; 0,0,1; 0.5000000001) and plane (0,0,0; 0,0,1) and plane (0,0,-2; 0,0,-1);
            solid bend = torus (1.5,0,0; 0,1,0; 1.5000000002; 0.5) and plane (0,0,0; 0,0,-1) and plane (1.5,0,0; 1,0,0);
            solid s = up or bend; tlo s;", [0, 0, 3, 4]),
        ("solid a = torus (1,0,0; 0,1,0; 1; 0.3) and plane (0,0,0; 0,0,-1) and plane (1,0,0; 1,0,0);
            solid b = torus (-1,0,0; 0,1,0; 1; 0.3) and plane (0,0,0; 0,0,1) and plane (-1,0,0; -1,0,0);
            solid s = a or b; tlo s;", [0, 0, 3, 4]),
        ("solid horn = cone (0,0,0; 1; 0,0,2; 0.5) and plane (0,0,0; 0,0,-1) and plane (0,0,2; 0,0,1);
            solid s = horn or sphere (0,0,1.875; 0.515388203); tlo s;", [0, 0, 2, 3]),
        ("solid box = orthobrick (0,0,0; 3,2,1);
            solid corner = orthobrick (-1,-1,-1; 0.3,0.3,2) and not cylinder (0.3,0.3,0; 0.3,0.3,1; 0.3);
            solid s = box and not corner; tlo s;", [10, 15, 0, 7]),
        ("solid s = torus (0,0,0; 0,0,1; 2; 0.5) and plane (0,0,0.5; 0,0,1) and plane (2.5,0,0; 1,0,0); tlo s;", [0, 0, 0, 1]),
        ("solid s = cylinder (0,0,0; 0,0,1; 1) and plane (0,0,0; 0,0,-1) and plane (0,0,1; 0,0,1)
            and plane (0.6000000003,0.8,0; 0.6,0.8,0); tlo s;", [0, 0, 2, 3]),
        (
            "solid rod = ellipticcylinder (0,0,0; 2,0,0; 0,1,0) and plane (0,0,0; 0,0,-1) and plane (0,0,3; 0,0,1);
            solid s = rod or ellipsoid (0,0,0; 2,0,0; 0,1,0; 0,0,1.5) or ellipsoid (0,0,3; 2,0,0; 0,1,0; 0,0,0.3); tlo s;",
            [0, 0, 2, 3],
        ),
    ];
    for (source, expected) in cases {
        let features = find(source);
        assert_eq!(counts(&features), expected, "{source}");
        assert!(features.curves.iter().all(|c| c.fins.len() == 2), "{source}");
    }
}

#[test]
fn seams_are_found_in_any_orientation() {
    let rim = "solid disk = cylinder (0,0,0; 0,0,1; 2) and plane (0,0,0; 0,0,-1) and plane (0,0,1; 0,0,1);
        solid corner = cylinder (0,0,0; 0,0,1; 3) and not cylinder (0,0,0; 0,0,1; 1.7) and plane (0,0,0.7; 0,0,-1);
        solid rim = disk and not corner or torus (0,0,0.7; 0,0,1; 1.7; 0.3);";
    for k in 0..6 {
        let turn = 0.37 * f64::from(k);
        let source = format!(
            "{rim} solid s = translate (3, {k}, -7; rotate ({turn}, 0.2, 0.3; 0.4, {turn}, 1.1; rim)); tlo s;"
        );
        assert_eq!(counts(&find(&source)), [0, 0, 3, 4], "turned by {turn}");
    }
}

#[test]
fn the_apex_of_a_cone_is_a_corner() {
    let cone = "solid c = cone (0,0,0; 1; 0,0,1; 0.5) and plane (0,0,0; 0,0,-1)";
    let cases = [
        ("and plane (0,0,2; 0,0,1); tlo c;", [1, 0, 1, 2]),
        ("and plane (0,0,4; 0,0,1); tlo c;", [1, 0, 2, 3]),
        ("and plane (0,0,2; 0,0,1) and plane (0,0,0; 0,1,0); tlo c;", [3, 4, 0, 3]),
        ("and plane (0,0,2; 0,0,1) and plane (0,0,0; 0,1,0) and plane (0,0,0; 1,0,0); tlo c;", [4, 6, 0, 4]),
        ("and plane (0,0,2; 0,0,1); solid t = rotate (0.3,0.5,1.1; 0.4,0.7,1.1; c); tlo t;", [1, 0, 1, 2]),
        // Inside a ball it is not on the boundary.
        ("and plane (0,0,2.2; 0,0,1) or sphere (0,0,2; 0.5); tlo c;", [0, 0, 2, 3]),
    ];
    for (rest, expected) in cases {
        assert_eq!(counts(&find(&format!("{cone} {rest}"))), expected, "{rest}");
    }
    let pit = "solid pit = cone (0,0,1; 1; 0,0,0.5; 0.5) and plane (0,0,0; 0,0,-1);
        solid s = orthobrick (-2,-2,-1; 2,2,1) and not pit; tlo s;";
    assert_eq!(counts(&find(pit)), [9, 12, 1, 7]);
}

#[test]
fn a_plane_two_rods_and_a_ball_touching_at_a_point_form_a_rounded_corner() {
    // One corner of a block with rounded edges.
    let corner = "solid s = (orthobrick (0,0,0; 1,1,1) and not orthobrick (0.7,0.7,-1; 2,2,2) and not orthobrick (0.7,-1,0.7; 2,2,2)
            and not orthobrick (-1,0.7,0.7; 2,2,2))
        or cylinder (0.7,0.7,0; 0.7,0.7,1; 0.3) and plane (0,0,0; 0,0,-1) and plane (0,0,0.7; 0,0,1)
        or cylinder (0.7,0,0.7; 0.7,1,0.7; 0.3) and plane (0,0,0; 0,-1,0) and plane (0,0.7,0; 0,1,0)
        or cylinder (0,0.7,0.7; 1,0.7,0.7; 0.3) and plane (0,0,0; -1,0,0) and plane (0.7,0,0; 1,0,0)
        or sphere (0.7,0.7,0.7; 0.3); tlo s;";
    assert_eq!(counts(&find(corner)), [13, 21, 0, 10]);
}

/// A rod of radius 1 and length 1 along z.
fn rod(x: f64) -> String {
    format!("cylinder ({x},0,0; {x},0,1; 1) and plane (0,0,0; 0,0,-1) and plane (0,0,1; 0,0,1)")
}

#[test]
fn boundaries_that_touch_from_outside_share_a_corner_or_a_curve() {
    let cases = [
        ("solid a = sphere (0,0,0; 1); solid b = sphere (2,0,0; 1); tlo a; tlo b;", [1, 0, 0, 2]),
        ("solid a = sphere (0,0,0; 1); solid b = sphere (2.0000000005,0,0; 1); tlo a; tlo b;", [1, 0, 0, 2]),
        ("solid a = sphere (0,0,0; 1) or orthobrick (-2,-2,-2; 2,2,-1); tlo a;", [9, 12, 0, 7]),
        // A ball in a hole of more than twice its radius.
        (
            "solid a = sphere (0,0,0; 1) and not sphere (0,0,0; 0.9) or sphere (0,0,-0.6; 0.3); tlo a;",
            [1, 0, 0, 3],
        ),
        (&format!("solid a = {}; solid b = {}; tlo a; tlo b;", rod(0.0), rod(2.0)), [2, 5, 0, 6]),
        (
            "solid a = torus (0,0,0.5; 0,0,1; 2; 0.5); solid b = orthobrick (-3,-3,-1; 3,3,0); solid c = a or b; tlo c;",
            [8, 12, 1, 7],
        ),
        // A ball touches the end of a rod at its rim, which gets a corner there.
        (&format!("solid a = {} or sphere (1,0,2; 1); tlo a;", rod(0.0)), [1, 1, 1, 4]),
    ];
    for (source, expected) in cases {
        let features = find(source);
        assert_eq!(counts(&features), expected, "{source}");
        let is_inner = |corner: usize| {
            let of = features.patches.iter().filter(|p| p.corners.iter().any(|c| c.index() == corner));
            of.count()
        };
        let ends = features.curves.iter().flat_map(|curve| curve.ends.into_iter().flatten());
        let ends: Vec<usize> = ends.map(|c| c.index()).collect();
        for corner in (0..features.corners.len()).filter(|c| !ends.contains(c)) {
            assert_eq!(is_inner(corner), 2, "{source}: both boundaries have the corner inside");
        }
    }
}

#[test]
fn a_cylinder_is_excluded_on_its_axis_where_it_has_no_gradient() {
    let cell = [-0.1, -0.1, 0.0].map(|low| Interval::new(low, low + 0.2));
    let geometry = super::tests::geometry(&format!("solid a = {}; tlo a;", rod(0.0)));
    let [round, end] = [0, 1].map(|i| &geometry.surfaces[i]);
    assert_eq!([round.kind(), end.kind()], ["cylinder", "plane"]);
    assert!(!super::octree::can_meet(end, round, &cell));
}

#[test]
fn cusps_inside_bodies_are_cut_off_with_a_note() {
    let block = "orthobrick (-3,-3,-1; 4,3,3)";
    let rods = format!("solid a = {}; solid b = {};", rod(0.0), rod(2.0));
    let cases = [
        // The body to be cut, whether along a curve, and the numbers of entities.
        (
            "solid a = sphere (0,0,0; 1) and not sphere (0.5,0,0; 0.5); tlo a;".to_owned(),
            "a",
            false,
            [0, 0, 2, 3],
        ),
        (
            format!(
                "solid a = sphere (0,0,1; 1) or orthobrick (-3,-3,-1; 4,3,0); solid rest = {block} and not a; tlo a; tlo rest;"
            ),
            "rest",
            false,
            [13, 20, 2, 15],
        ),
        (
            format!("{rods} solid rest = {block} and not a and not b; tlo a; tlo b; tlo rest;"),
            "rest",
            true,
            [18, 33, 2, 21],
        ),
    ];
    for (source, body, is_curve, expected) in cases {
        let mut geometry = super::tests::geometry(&source);
        let (features, cusps) = super::find_and_cut_cusps(&mut geometry).unwrap();
        assert_eq!(counts(&features), expected, "{source}");
        let [cusp] = &cusps[..] else { panic!("{cusps:?}") };
        assert_eq!((cusp.body.as_ref().unwrap().1.solid.as_ref(), cusp.is_curve), (body, is_curve));
        assert!(cusp.radius > 0.05 && cusp.radius < 0.35, "{cusp}");
        assert!(cusp.to_string().contains(&format!("solid `{body}`")), "{cusp}");
    }
}

#[test]
fn a_spike_that_tapers_with_the_fourth_power_is_cut_off_where_it_is_thick_enough() {
    // The tube of the torus lies in the rod and touches its lowest line; then it bends away.
    let spike = "solid s = torus (0,0,0; 0,0,1; 0.5; 0.25) and not
        (cylinder (0,0.5,0.25; 1,0.5,0.25; 0.5) and plane (0,0,0; -1,0,0) and plane (0.6,0,0; 1,0,0)); tlo s;";
    let turned = "solid s = torus (0,0,0; 0,0,1; 0.5; 0.25) and not
        (cylinder (0,0.5,0.25; 1,0.5,0.25; 0.5) and plane (0,0,0; -1,0,0) and plane (0.6,0,0; 1,0,0));
        solid t = rotate (0.3, 0.5, 1.1; 0.4, 0.7, 1.1; s); tlo t;";
    for source in [spike, turned] {
        let mut geometry = super::tests::geometry(source);
        let (_, cusps) = super::find_and_cut_cusps(&mut geometry).unwrap();
        let [cusp] = &cusps[..] else { panic!("{cusps:?}") };
        assert!(cusp.is_curve && cusp.body.is_none() && cusp.radius > 0.05 && cusp.radius < 0.25, "{cusp}");
    }
}

#[test]
fn wedges_of_zero_angle_are_rejected_with_both_names_and_coordinates() {
    let cases = [
        (
            "solid a = sphere (0,0,0; 1) and not sphere (0.5,0,0; 0.5); tlo a;",
            "surfaces of solid `a`, its sphere (2:11) and its sphere (2:37), touch at (1.000000, ",
        ),
        // A ball in a hole hardly larger: triangles of the two would intersect.
        (
            "solid a = orthobrick (-2,-2,-2; 2,2,2) and not sphere (0,0,0; 1) or sphere (0,0,-0.1; 0.9); tlo a;",
            "surfaces of solid `a`, its sphere (2:48) and its sphere (2:69), touch at (0.000000, 0.000000, -1.000000)",
        ),
        // A plane tangent to a torus at its inner equator cuts it into lobes that meet at a point.
        (
            "solid a = torus (0,0,0; 0,0,1; 2; 0.5) and plane (1.5,0,0; 1,0,0); tlo a;",
            "surfaces of solid `a`, its torus (2:11) and its plane (2:44), touch at (1.500000, ",
        ),
    ];
    for (source, message) in cases {
        let error = refused(source);
        assert!(error.starts_with(message), "{error} does not start with {message}");
    }
}

/// Two cones and a slab: apexes on the line x = y = 0, tangent along it; the second cone's axis is
/// on the side `side`.
fn cones_on_a_line(tips: [f64; 2], side: f64, solid: &str) -> String {
    let cone = |tip: f64, [x, z, r]: [f64; 3]| format!("cone (0,0,{tip}; 0; {x},0,{}; {r})", tip - z);
    let [a, b] = [cone(tips[0], [-0.6, 1.44, 0.65]), cone(tips[1], [-1.344 * side, 4.608, 1.4])];
    format!(
        "solid a = {a};\nsolid b = {b};\nsolid slab = plane (0,0,0; 0,0,-1) and plane (0,0,2; 0,0,1);
        solid c = ({solid}) and slab; solid s = translate (3,-1,2; rotate (0.3,0,0; 0.4,0.7,1.1; c)); tlo s;"
    )
}

#[test]
fn cones_tangent_along_a_line_may_also_meet_in_an_ellipse() {
    // The cones exchange sides at the ellipse. With a common apex there is no ellipse; tangent from
    // outside, they do not cross.
    assert_eq!(counts(&find(&cones_on_a_line([3.0, 4.0], 1.0, "a or b"))), [0, 0, 3, 4]);
    assert_eq!(counts(&find(&cones_on_a_line([3.0, 4.0], 1.0, "a and b"))), [0, 0, 3, 4]);
    assert_eq!(counts(&find(&cones_on_a_line([3.0, 3.0], 1.0, "a or b"))), [0, 0, 2, 3]);
    assert_eq!(counts(&find(&cones_on_a_line([3.0, 4.0], -1.0, "a and not b"))), [0, 0, 2, 3]);
    let error = refused(&cones_on_a_line([3.0, 4.0], 1.0, "a and not b"));
    let names = error.contains("(2:11)") && error.contains("(3:11)");
    assert!(names && error.contains("without an angle"), "{error}");
    // From outside they share the line.
    assert_eq!(counts(&find(&cones_on_a_line([3.0, 4.0], -1.0, "a or b"))), [2, 5, 0, 4]);
}

#[test]
fn a_cone_tangent_to_a_rod_along_a_line_exchanges_sides_with_it() {
    let parts = "solid rod = cylinder (0,0,0; 0,0,1; 1);\nsolid horn = cone (1,0,5; 0; -0.344,0,0.392; 1.4);
        solid slab = plane (0,0,0; 0,0,-1) and plane (0,0,3; 0,0,1);";
    for solid in ["rod or horn", "rod and horn"] {
        assert_eq!(counts(&find(&format!("{parts} solid s = ({solid}) and slab; tlo s;"))), [0, 0, 3, 4]);
    }
    // Without the wedge the solid is valid; with the wedge it is rejected.
    let cut = format!("{parts} solid s = rod and slab and not horn and plane (0.5,0,0; 1,0,0); tlo s;");
    assert!(counts(&find(&cut))[3] > 3);
    let error = refused(&format!("{parts} solid s = rod and slab and not horn; tlo s;"));
    assert!(error.contains("touch at (1.000000, 0.000000"), "{error}");
}

#[test]
fn corners_and_edges_may_touch_the_interior_of_a_face() {
    let tip = |z: f64| format!("cone (0,0,{z}; 0.5; 0,0,{}; 0) and plane (0,0,{z}; 0,0,1)", z - 1.0);
    let block = "solid block = orthobrick (-1,-1,-1; 1,1,0);";
    let cases = [
        // The corner of a tetrahedron on a plate; the rim of a disk on a ball.
        (
            format!("{block}\nsolid top = polyhedron (0.25,0,0; 0,0,1; 0.5,0,1; 0,0.5,1; ; 1,3,2; 1,2,4; 1,4,3; 2,3,4); solid s = block or top; tlo s;"),
            [0.25, 0.0, 0.0], 1,
        ),
        (
            "solid ball = sphere (0,0,0; 0.5);\nsolid disk = cylinder (0,1,0; 0.3,1,0; 0.5) and plane (0,1,0; -1,0,0) and plane (0.3,1,0; 1,0,0);
                solid s = ball or disk and plane (0.1,0,0; 1,0,0); tlo s;"
                .to_owned(),
            [0.0, 0.5, 0.0], 1,
        ),
    ];
    for (source, place, patches) in cases {
        let features = find(&source);
        let place = crate::Point::from(place);
        let corner = features.corners.iter().position(|c| (c.point - place).norm() < 1e-9).unwrap();
        let inside = features.patches.iter().filter(|p| p.corners.iter().any(|c| c.index() == corner));
        assert_eq!(inside.count(), patches, "{source}");
    }
    // On an edge of the plate.
    let plates = "orthobrick (-1,-1,1; 0,1,2)";
    let edge = format!(
        "solid top = cone (0,0,-1; 1; 0,0,1; 0) and plane (0,0,-1; 0,0,-1) and plane (0,0,1; 0,0,1);
        solid s = {plates} or top; tlo s;"
    );
    assert_eq!(counts(&find(&edge)), [9, 13, 1, 8]);
    // Inside the plate, or away from it, the apex is allowed.
    let sunk = format!(
        "{block} solid top = {}; solid s = block or top and plane (0,0,-0.1; 0,0,-1); tlo s;",
        tip(0.9)
    );
    assert_eq!(counts(&find(&sunk))[0], 8, "the tip is buried");
    let away =
        format!("{block} solid top = {} and plane (0,0,0; 0,0,-1); solid s = block or top; tlo s;", tip(1.1));
    assert_eq!(counts(&find(&away))[0], 9, "the tip is a corner");
}

#[test]
fn smooth_joints_of_revolved_profiles_are_curves() {
    let revolved = |points: &str, segments: &str| {
        format!("curve2d p = ({points} {segments}); solid s = revolution (0,0,0; 0,0,1; p); tlo s;")
    };
    let cases = [
        // A line that continues smoothly in an arc of a circle, and in one of an ellipse.
        (revolved("5; 0,1; 2,2; 2.4,2.2; 2.2,1.8; 1,1;", "4; 2,1,2; 3,2,3,4; 2,4,5; 2,5,1"), [0, 0, 4, 4]),
        (revolved("5; 0,1; 2,2; 3,2.5; 3,2; 3,1;", "4; 2,1,2; 3,2,3,4; 2,4,5; 2,5,1"), [0, 0, 4, 4]),
        // A half circle, and ellipses that continue each other.
        (revolved("5; 0,1; 1,2; 2,3; 4,5; 5,1;", "3; 3,1,2,3; 3,3,4,5; 2,5,1"), [0, 0, 3, 3]),
        // A tip at the end of a straight segment.
        (revolved("3; 0,0; 1,1; 1,0;", "2; 2,1,2; 2,2,3"), [1, 0, 1, 2]),
        (revolved("4; 0,0; 1,1; 2,1; 4,0;", "3; 2,1,2; 2,2,3; 2,3,4"), [2, 0, 2, 3]),
    ];
    for (source, expected) in cases {
        assert_eq!(counts(&find(&source)), expected, "{source}");
    }
}

#[test]
fn extrusion_segments_with_different_frames_are_joined() {
    let square = "curve2d p = (4; 1,1; 1,-1; -1,-1; -1,1; 4; 2,1,2; 2,2,3; 2,3,4; 2,4,1);";
    let line = "curve3d q = (4; -10,0,-5; 0,0,0; 10,0,5; 10,10,10; 2; 2,1,2; 3,2,3,4);";
    let arc = "curve3d q = (5; 0,0,0; 10,0,5; 10,10,10; 10,20,15; 0,20,20; 2; 3,1,2,3; 3,3,4,5);";
    for path in [line, arc] {
        let source = format!("{path} {square} solid s = extrusion (q; p; 0,0,1); tlo s;");
        assert_eq!(counts(&find(&source)), [12, 20, 0, 10], "{path}");
    }
}

#[test]
fn a_face_may_end_in_a_cusp_between_curves_that_bend_differently() {
    // On the step between the two blocks, the circle of the ball is tangent to the edge of the
    // lower block.
    let step = "solid high = orthobrick (0,-1,-1; 1,1,0.6) and not sphere (0,0,0.5; 0.5);
        solid low = orthobrick (-1,-1,-1; 0,1,0); solid s = high or low; tlo s;";
    assert_eq!(counts(&find(step)), [15, 23, 0, 9]);
    // A thinner rod flush with the rod below leaves a crescent with two cusps.
    let flush = |r: f64| {
        format!(
            "solid low = cylinder (0,0,0; 0,0,1; 1) and plane (0,0,0; 0,0,-1) and plane (0,0,1; 0,0,1);
            solid high = cylinder ({x},0,0; {x},0,1; {r}) and plane (0,0,1; 0,0,-1) and plane (0,0,2; 0,0,1);
            solid s = low or high; tlo s;",
            x = 1.0 - r
        )
    };
    for r in [0.25, 0.8, 0.98, 0.999] {
        assert_eq!(counts(&find(&flush(r))), [1, 2, 2, 5], "radius {r}");
    }
    // The rim of the rod is tangent to the circle of contact between the torus and the rod's end;
    // the torus separates from it with the fourth power.
    let rod = "solid ring = torus (0,0,0; 1,0,0; 0.75; 0.25);
        solid rod = cylinder (-1,0.25,0; 1,0.25,0; 0.5) and plane (-1,0,0; -1,0,0) and plane (0.25,0,0; 1,0,0);
        solid s = ring or rod; tlo s;";
    let reason = refused(rod);
    assert!(reason.contains("cusp") && reason.contains("(0.250000, 0.750000, 0.000000)"), "{reason}");
}
