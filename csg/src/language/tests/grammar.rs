//! Special cases of the grammar.

use super::*;
use crate::{BodyId, SingularPlace, SurfaceId};

#[test]
fn layout_and_comments_are_ignored() {
    let text = "# comment; solid\n#\n\nalgebraic3d#x\r\nsolid\ta=sphere(0,#c ( [\r\n0 ,0;1)and\r\nplane(0,0,0;\n0,0,1);tlo a";
    let parsed = parse_geometry(&format!("{text};"), "t.geo").unwrap();
    assert_eq!(parsed.geometry.surfaces.len(), 2);
}

#[test]
fn a_file_may_end_without_a_newline_and_after_a_comment() {
    for end in ["", "\n", "# end", ";;; ; # end"] {
        parsed(&format!("solid a = sphere (0,0,0; 1); tlo a;{end}"));
    }
}

#[test]
fn numbers_take_any_count_of_minus_signs_but_no_plus() {
    let geometry = solid("sphere (--1, - - -2, .5; 1e0)");
    let Surface::Sphere(sphere) = &geometry.surfaces[0] else { panic!() };
    assert_eq!(sphere.center, Point::new(1.0, -2.0, 0.5));
    assert!(error("solid a = sphere (+1, 0, 0; 1);").contains("no leading +"));
}

#[test]
fn stray_semicolons_are_skipped_as_is_the_one_after_a_constant() {
    let text =
        "; define constant identprec = 1e-5 ; define constant k = -3 solid a = sphere (0,0,0; 1);; tlo a;";
    let warnings = parsed(text).warnings;
    assert_eq!(warnings.len(), 2);
    assert!(warnings[0].message.contains("`identprec` has no effect"));
}

#[test]
fn names_are_case_sensitive_and_may_begin_like_keywords() {
    let text = "solid A = sphere (0,0,0; 1); solid a = sphere (5,0,0; 1); solid planet = A or a; solid or1 = planet; tlo or1;";
    assert_eq!(geometry(text).surfaces.len(), 2);
}

#[test]
fn the_same_name_may_be_a_solid_and_a_curve() {
    let text = "curve2d a = (2; 0,0; 1,1; 1; 2,1,2); curve3d a = (2; 0,0,0; 1,1,1; 1; 2,1,2);
                solid a = sphere (0,0,0; 1); tlo a;";
    geometry(text);
}

#[test]
fn box_points_and_flags_are_read() {
    let text = "boundingbox (-1,-1,-1; 2,2,2.5); point (0.5, 0, 0); point (0,0,0) -factor=0;
                solid a = sphere (0,0,0; 1); tlo a;";
    let geometry = geometry(text);
    let stated = geometry.stated_box.unwrap();
    assert_eq!((stated.min, stated.max), (Point::new(-1., -1., -1.), Point::new(2., 2., 2.5)));
    assert_eq!(geometry.user_points[0].point, Point::new(0.5, 0.0, 0.0));
    assert_eq!(geometry.user_points[1].span.column, 53);
}

#[test]
fn singularities_are_read_and_have_no_effect() {
    let text = "solid a = sphere (0,0,0; 1); solid b = plane (0,0,0; 0,0,1); solid c = a and b; tlo c;
                singular edge a b -factor=2 -tlo=c; singular face c a; singular point a b c -factor=1;";
    let warnings = parsed(text).warnings;
    assert_eq!(warnings.len(), 3);
    assert!(warnings.iter().all(|w| w.message == "`singular` has no effect on the mesh"));
}

#[test]
fn singularities_keep_their_surfaces_factors_and_sizes() {
    let text = "solid a = sphere (0,0,0; 1); solid b = plane (0,0,0; 0,0,1); solid c = a and b; tlo c;
                singular edge a b -factor=2 -tlo=c -maxh=0.1; singular face c a; singular point a b c -tlo=c;";
    let Parsed { geometry, warnings } = parsed(text);
    let [edge, face, point] = &geometry.singularities[..] else { panic!("{:?}", geometry.singularities) };
    assert_eq!((edge.factor, edge.maxh, face.factor), (2, Some(0.1), 1));
    let (ball, plane) = (vec![SurfaceId(0)], vec![SurfaceId(1)]);
    let body = BodyId(0);
    assert_eq!(edge.place, SingularPlace::Edge { surfaces: [ball.clone(), plane.clone()], body: Some(body) });
    assert_eq!(face.place, SingularPlace::Face { surfaces: ball.clone(), body });
    let both = [ball.clone(), plane.clone()].concat();
    assert_eq!(point.place, SingularPlace::Point { surfaces: [ball, plane, both] });
    assert!(warnings.iter().any(|w| w.message == "the flag -tlo has no effect here"));
}

/// The profile reaches the centers of curvature of the path, an arc of an ellipse.
const CURVES: &str = "curve2d ring = (4; 1,1; 1,6; 6,6; 6,1; 4; 2,1,2; 2,2,3; 2,3,4; 2,4,1);
    curve3d path = (3; 0,0,0; 0,0,9; 20,0,9; 1; 3,1,2,3);";

#[test]
fn unsupported_sweeps_are_rejected_only_where_they_are_used() {
    let sphere = "solid a = sphere (0,0,0; 1); tlo a;";
    geometry(&format!("{CURVES} solid e = extrusion (path; ring; 0,1,0) -bc=2; {sphere}"));
    for text in ["extrusion (path; ring; 0,1,0)", "translate (1,0,0; extrusion (path; ring; 0,1,0))"] {
        let errors = errors(&format!("{CURVES} solid e = {text} and plane (0,0,0; 0,0,1); tlo e;"));
        assert!(is_unsupported(&errors), "{errors}");
        assert!(errors.to_string().contains("too wide for segment 1 of the path"), "{errors}");
    }
}

#[test]
fn close_surfaces_are_ignored_with_a_warning() {
    let solids = "solid a = plane (0,0,0; 0,0,-1); solid b = orthobrick (0,0,0; 1,1,1); tlo b;";
    let warning =
        warning(&format!("{solids} identify closesurfaces a b -tlo=b -slices=[0.2,0.5] -direction=[0,0,1];"));
    assert!(warning.contains(":2:") && warning.contains("`identify closesurfaces` is ignored"), "{warning}");
}

#[test]
fn surface_objects_and_identifications_name_first_surfaces() {
    let Parsed { geometry, warnings } = parsed(
        "solid low = plane (0,0,0; 0,0,-1); solid high = plane (0,0,1; 0,0,1) -bc=4;
         solid b = orthobrick (0,0,0; 1,1,1) and low and high; solid disk = cylinder (0.5,0.5,0; 0.5,0.5,1; 0.2) and high;
         tlo b; tlo disk high -col=[1,0,0] -bc=5 -bcname=lid -maxh=0.1; identify periodic low high; tlo disk disk;",
    );
    let [cutout, idle] = &geometry.cutouts[..] else { panic!("{:?}", geometry.cutouts) };
    let [low, high] = geometry.identifications[0].surfaces;
    assert_eq!((cutout.surface, cutout.number, cutout.bc, cutout.maxh), (high, 2, Some(5), Some(0.1)));
    assert_eq!(cutout.bc_name.as_deref(), Some("lid"));
    assert_eq!([low, high].map(|s| geometry.surface_info[s.index()].bc), [None, Some(4)]);
    assert_eq!(idle.number, 3);
    assert!(warnings.iter().any(|w| w.message.contains("bounds no body")));
}

#[test]
fn surface_objects_and_identifications_of_nothing_are_errors() {
    let solids = "solid a = plane (0,0,0; 0,0,-1); solid far = plane (9,0,0; 1,0,0);
                  solid b = orthobrick (0,0,0; 1,1,1); tlo b;";
    for (text, message) in [
        ("identify periodic a far;", "the first surface of `far` bounds no body"),
        ("identify periodic a b;", "the first surfaces of `a` and `b` are the same"),
        ("tlo b a -bc=[1,2];", "a surface has one -bc and one -bcname, not a list"),
        ("tlo b a; boundarycondition a nix 2;", "there is no top-level object `nix`"),
    ] {
        let errors = errors(&format!("{solids} {text}"));
        assert!(errors.to_string().contains(message), "{text}: {errors}");
    }
}

#[test]
fn other_errors_beside_unsupported_ones_are_errors() {
    let errors = errors("solid a = gencyl; tlo b;");
    assert_eq!(errors.errors().count(), 2, "{errors}");
    assert!(!is_unsupported(&errors));
}

#[test]
fn comments_may_have_any_encoding() {
    let source = b"algebraic3d # W\xfcrfel\nsolid a = sphere (0,0,0; 1); tlo a; # \xff\xfe";
    assert!(parse_geometry_bytes(source, "t.geo", &Settings::default()).unwrap().warnings.is_empty());
    let errors = parse_geometry_bytes(
        b"algebraic3d\nsolid W\xfcrfel = sphere (0,0,0; 1);",
        "t.geo",
        &Settings::default(),
    )
    .unwrap_err();
    let message = errors.to_string();
    assert!(message.starts_with("t.geo:2:8: error") && message.contains("save it as UTF-8"), "{message}");
}

#[test]
fn nesting_has_a_large_limit() {
    let nested = |depth: usize| format!("{}sphere (0,0,0; 1){}", "(".repeat(depth), ")".repeat(depth));
    solid(&nested(150));
    solid(&format!("{}sphere (0,0,0; 1)", "not ".repeat(150)));
    assert!(error(&format!("solid a = {};", nested(100_000))).contains("nested more than 200 deep"));
    assert!(error(&format!("solid a = {}b;", "not ".repeat(100_000))).contains("nested more than 200 deep"));
}

#[test]
fn trees_have_limits() {
    let mut doubled = String::from("solid a0 = sphere (0,0,0; 1) and plane (0,0,0; 0,0,1);");
    let mut ladder = String::from("solid a0 = sphere (0,0,0; 1);");
    for i in 1..1000 {
        let word = if i % 2 == 0 { "and" } else { "or" };
        if i < 60 {
            doubled += &format!(
                "solid a{i} = (a{0} and plane ({i},0,0; 1,0,0)) or (a{0} and plane (0,{i},0; 0,1,0));",
                i - 1
            );
        }
        ladder += &format!("solid a{i} = a{} {word} sphere ({i},0,0; 1);", i - 1);
    }
    assert!(error(&format!("{doubled} tlo a59;")).contains("more than 1000000 half-spaces"));
    assert!(error(&format!("{ladder} tlo a999;")).contains("more than 400 deep"));
    let copies =
        "solid b = multitranslate (1,0,0; 999; multitranslate (0,1,0; 2000; sphere (0,0,0; 1))); tlo b;";
    assert!(error(copies).contains("more than 1000000 surfaces"));
}
