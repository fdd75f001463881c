//! Unification of equal surfaces.

use super::*;

#[test]
fn adjacent_bricks_share_a_plane_with_opposite_sides() {
    let geometry =
        geometry("solid a = orthobrick (0,0,0; 1,1,1); solid b = orthobrick (1,0,0; 2,1,1); tlo a; tlo b;");
    // The interface, and the four planes common to both bricks: twelve less five.
    assert_eq!(geometry.surfaces.len(), 7);
    let [in_a, in_b] = [0, 1].map(|body| {
        let at = |x| is_inside(&geometry, &geometry.bodies[body].solid, &Point::new(x, 0.5, 0.4));
        [at(0.5), at(1.5)]
    });
    assert_eq!([in_a, in_b], [[true, false], [false, true]]);
}

#[test]
fn planes_through_different_points_are_unified() {
    let geometry = solid("plane (0,0,1; 0,0,1) and plane (7,8,1; 0,0,3) and plane (-1,0,0; -1,0,0)");
    assert_eq!(geometry.surfaces.len(), 2);
    assert!(matches!(&geometry.bodies[0].solid, Solid::And(members) if members.len() == 2));
}

#[test]
fn equal_surfaces_of_every_kind_are_one() {
    for pair in [
        "sphere (0,0,0; 1) or sphere (0,0,0; 1)",
        "cylinder (0,0,0; 0,0,1; 1) or cylinder (0,0,5; 0,0,-3; 1)",
        "cone (0,0,0; 2; 0,0,1; 1) or cone (0,0,1; 1; 0,0,-1; 3)",
        "torus (0,0,0; 0,0,1; 2; 1) or torus (0,0,0; 0,0,-1; 2; 1)",
        "ellipsoid (0,0,0; 1,0,0; 0,2,0; 0,0,3) or ellipsoid (0,0,0; 0,-2,0; 0,0,3; 1,0,0)",
        "ellipticcylinder (0,0,0; 1,0,0; 0,2,0) or ellipticcylinder (0,0,9; 0,2,0; 1,0,0)",
        "ellipticcone (0,0,0; 2,0,0; 0,1,0; 2; 0.5) or ellipticcone (0,0,2; 1,0,0; 0,-0.5,0; 2; 2)",
        "ellipticcylinder (0,0,0; 1,0,0; 0,1,0) or cylinder (0,0,0; 0,0,1; 1)",
    ] {
        assert_eq!(solid(pair).surfaces.len(), 1, "{pair}");
    }
}

#[test]
fn equal_surfaces_are_unified_after_transforms() {
    let text = "solid a = orthobrick (0,0,0; 1,1,1);
                solid b = rotate (1,0,0; 1.5708,0,0; orthobrick (0,0,0; 1,1,1));
                solid c = translate (0.1,0,0; translate (0.2,0,0; orthobrick (0.7,0,0; 1.7,1,1)));
                tlo a; tlo b; tlo c;";
    let geometry = geometry(text);
    // b is the unit cube rotated about its edge x = 1, y = 0 by a right angle: [1,2]×[0,1]×[0,1],
    // the same as c.
    assert_eq!(geometry.surfaces.len(), 7);
}

#[test]
fn thin_layers_stay_apart() {
    assert_eq!(solid("sphere (0,0,0; 1) and not sphere (0,0,0; 0.999999)").surfaces.len(), 2);
    assert_eq!(solid("orthobrick (0,0,0; 1,1,0.000001)").surfaces.len(), 6);
}

#[test]
fn tolerance_depends_on_the_size_of_the_geometry_but_not_on_its_position() {
    for (scale, shift) in [(1e-9, 0.0), (1e9, 0.0), (1.0, 1e5)] {
        let at = |x: f64| x * scale + shift;
        let brick = |x: f64| {
            let (low, high) = (at(0.0), at(1.0));
            format!("orthobrick ({},{low},{low}; {},{high},{high})", at(x), at(x + 1.0))
        };
        let text = format!("solid a = {}; solid b = {}; tlo a; tlo b;", brick(0.0), brick(1.0));
        assert_eq!(geometry(&text).surfaces.len(), 7, "scale {scale}, shift {shift}");
    }
}

#[test]
fn unused_solids_leave_no_surfaces() {
    let geometry = geometry("solid b = sphere (0,0,0; 5); solid a = sphere (0,0,0; 1); tlo a;");
    assert_eq!(geometry.surfaces.len(), 1);
}

#[test]
fn many_equal_surfaces_are_found_in_a_large_array() {
    // 20 × 20 × 20 bricks side by side: 21 planes in each direction.
    let row = "multitranslate (1,0,0; 19; multitranslate (0,1,0; 19; multitranslate (0,0,1; 19; orthobrick (0,0,0; 1,1,1))))";
    assert_eq!(solid(row).surfaces.len(), 63);
}

#[test]
fn surfaces_within_the_length_to_merge_are_one_and_told() {
    let text = "algebraic3d
        solid outer = sphere (0, 0, 0; 1);
        solid inner = sphere (0, 0, 0; 0.9999);
        tlo outer;
        solid plate = orthobrick (0.5, -1, -1; 2, 1, 1) and not inner;
        tlo plate;";
    let read = |merge: f64| parse_geometry_with(text, "shell.geo", &Settings { merge }).unwrap();
    let (apart, merged) = (read(0.0), read(2e-4));
    assert_eq!([apart.geometry.surfaces.len(), merged.geometry.surfaces.len()], [8, 7]);
    assert!(apart.warnings.is_empty() && merged.warnings.len() == 1, "{:?}", merged.warnings);
    let told = merged.warnings[0].to_string();
    assert!(
        told.contains("of `inner` is 1.0e-4 from one of `outer` (line 2): both are taken as one"),
        "{told}"
    );
}
