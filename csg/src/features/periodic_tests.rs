//! Periodic faces of small geometries.

use crate::{CornerId, Features, Point, language};

fn find(statements: &str) -> Result<Features, crate::FeatureError> {
    let source = format!("algebraic3d\n{statements}");
    let geometry =
        language::parse_geometry(&source, "t.geo").unwrap_or_else(|error| panic!("{error}")).geometry;
    Features::find(&geometry)
}

/// A unit cube of named planes, followed by other statements.
fn cube(more: &str) -> String {
    format!(
        "solid l = plane (0,0,0; -1,0,0); solid r = plane (1,0,0; 1,0,0);
         solid f = plane (0,0,0; 0,-1,0); solid b = plane (0,1,0; 0,1,0);
         solid d = plane (0,0,0; 0,0,-1); solid u = plane (0,0,1; 0,0,1);
         solid cell = l and r and f and b and d and u; {more}"
    )
}

const ALL: &str = "identify periodic l r; identify periodic f b; identify periodic d u;";

#[test]
fn a_cube_with_three_periods_has_one_corner_three_curves_and_three_patches() {
    let features = find(&cube(&format!("tlo cell; {ALL}"))).unwrap();
    let origins = features.masters();
    let copies = |list: &[Option<super::Master>]| list.iter().flatten().count();
    assert_eq!([&origins.corners, &origins.curves, &origins.patches].map(|o| copies(o)), [7, 9, 3]);
    for (i, origin) in origins.corners.iter().enumerate().filter_map(|(i, o)| Some((i, (*o)?))) {
        let first = features.corner(CornerId::new(origin.index)).point;
        assert_eq!(first, Point::origin());
        assert_eq!(origin.motion * first, features.corners[i].point);
    }
}

#[test]
fn holes_through_periodic_faces_are_periodic_copies() {
    let features =
        find(&cube(&format!("solid p = cell and not cylinder (0,0.5,0.5; 1,0.5,0.5; 0.2); tlo p; {ALL}")))
            .unwrap();
    let identified = &features.identified[0];
    assert_eq!((identified.corners.len(), identified.curves.len(), identified.patches.len()), (4, 5, 1));
    let circle = |id| features.curve(id).ends.is_none();
    assert_eq!(identified.curves.iter().filter(|c| circle(c.master) && circle(c.copy)).count(), 1);
}

#[test]
fn sheared_and_turned_faces_are_found() {
    let sheared = find(
        "solid l = plane (0,0,0; -1,0.3,0); solid r = plane (1,0,0; 1,-0.3,0);
         solid f = plane (0,0,0; 0,-1,0); solid b = plane (0,1,0; 0,1,0);
         solid c = l and r and f and b and plane (0,0,0; 0,0,-1) and plane (0,0,1; 0,0,1); tlo c;
         identify periodic f b;",
    )
    .unwrap();
    assert!(
        (sheared.identified[0].motion.translation.vector - crate::Vector::new(0.3, 1.0, 0.0)).norm() < 1e-14
    );
    let turned = find(
        "solid f = plane (0,0,0; 0,-1,0); solid s = plane (0,0,0; -1,0,0);
         solid q = f and s and cylinder (0,0,0; 0,0,1; 1) and plane (0,0,0; 0,0,-1) and plane (0,0,1; 0,0,1); tlo q;
         identify periodic f s;",
    )
    .unwrap();
    let motion = turned.identified[0].motion;
    assert!((motion * Point::new(1.0, 0.0, 0.5) - Point::new(0.0, 1.0, 0.5)).norm() < 1e-15);
    // The axis is its own copy.
    assert_eq!(turned.masters().curves.iter().flatten().count(), 3);
}

#[test]
fn faces_that_do_not_match_are_rejected_with_coordinates() {
    let hole = "cylinder (0.5,0.5,0.5; 1,0.5,0.5; 0.2) and plane (0.5,0,0; -1,0,0)";
    let cases = [
        (cube(&format!("solid p = cell and not ({hole}); tlo p; {ALL}")), "the curve at (1.000000"),
        (cube("solid p = cell and plane (1,0.9,0; 1,1,0); tlo p; identify periodic l r;"), "no counterpart"),
        (
            cube("solid s = cell and not sphere (0,0,0; 0.2); tlo s; identify periodic d u;"),
            "the corner at (0.",
        ),
        (
            cube(
                "solid s = sphere (0.5,0.5,0.5; 0.2); tlo s; solid p = cell and not s; tlo p; identify periodic l s;",
            ),
            "no rigid motion maps",
        ),
    ];
    for (statements, message) in cases {
        let error = find(&statements).unwrap_err().to_string();
        assert!(error.contains(message) && error.contains("line"), "{error}");
    }
}

#[test]
fn a_point_on_one_face_only_is_rejected() {
    let error = find(&cube("tlo cell; point (0,0.5,0.5); identify periodic l r;")).unwrap_err().to_string();
    assert!(error.contains("the corner at (0.000000, 0.500000, 0.500000) has no counterpart"), "{error}");
}
