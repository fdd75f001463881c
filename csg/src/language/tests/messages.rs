//! Messages: text, position and help.

use super::*;

/// Checks that the statements give a single error in line 2 at `column`, whose text contains
/// `parts`.
#[track_caller]
fn expect_error(statements: &str, column: u32, parts: &[&str]) {
    let text = error(statements);
    assert!(text.starts_with(&format!("t.geo:2:{column}: ")), "{text}");
    for part in parts {
        assert!(text.contains(part), "no {part:?} in\n{text}");
    }
}

#[test]
fn a_message_has_position_source_line_and_help() {
    let text = errors("solid ball = sphere (0, 0, 0, 1);").to_string();
    let expected = "t.geo:2:29: error: expected `;`, found `,`
    2 | solid ball = sphere (0, 0, 0, 1);
      |                             ^
      = help: write sphere (cx, cy, cz; r)";
    assert_eq!(text, expected);
}

#[test]
fn wrong_arguments_are_answered_with_the_syntax() {
    expect_error(
        "solid a = plane (0,0; 0,0,1);",
        21,
        &["expected `,`, found `;`", "plane (px, py, pz; nx, ny, nz)"],
    );
    expect_error(
        "solid a = cone (0,0,0; 1; 1,0,0);",
        32,
        &["expected `;`, found `)`", "cone (ax, ay, az; ra;"],
    );
    expect_error("solid a = torus 0,0,0;", 17, &["expected `(`, found the number 0", "torus (cx, cy, cz;"]);
    expect_error("solid a = sphere (0,0,r; 1);", 23, &["expected a number, found `r`", "no variables"]);
    expect_error("solid a = cylinder (0,0,0; 1,0,0; 1;", 36, &["expected `)`, found `;`"]);
    expect_error("solid a = translate (1,0,0, b);", 27, &["expected `;`", "translate (dx, dy, dz; SOLID)"]);
    expect_error(
        "solid a = rotate (0,0,0; 1,0,0; sphere (0,0,0; 1);",
        50,
        &["expected `)` for the `(` of line 2, column 11"],
    );
}

#[test]
fn misspelled_words_get_a_suggestion() {
    expect_error(
        "sold a = sphere (0,0,0; 1); tlo a;",
        1,
        &["expected a statement, found `sold`", "did you mean `solid`?"],
    );
    expect_error(
        "solid a = spehre (0,0,0; 1);",
        11,
        &["unknown primitive `spehre`", "did you mean `sphere`?"],
    );
    expect_error(
        "solid ball = sphere (0,0,0; 1); tlo bal;",
        37,
        &["there is no solid `bal`", "did you mean `ball`?"],
    );
    expect_error("solid a = box;", 11, &["there is no solid `box`", "defined before it is used"]);
    expect_error("identify perodic a b;", 10, &["`closesurfaces` or `periodic`", "did you mean `periodic`?"]);
    expect_error("singular egde a b;", 10, &["expected `face` or `edge` or `point`", "did you mean `edge`?"]);
    expect_error("define konstant a = 1;", 8, &["expected `constant`", "did you mean `constant`?"]);
}

#[test]
fn keywords_cannot_be_names() {
    expect_error("solid plane = sphere (0,0,0; 1);", 7, &["`plane` is a keyword and cannot name a solid"]);
    expect_error("solid a = tube (0,0,0; 1);", 11, &["`tube` is not a primitive"]);
    expect_error(
        "solid my-box = sphere (0,0,0; 1);",
        9,
        &["expected `=`, found `-`", "letters, digits and _"],
    );
    expect_error(
        "solid 2a = sphere (0,0,0; 1);",
        7,
        &["expected the name of a solid", "begin with a letter"],
    );
    expect_error("solid a = sphere (0,0,0; 1) -material=solid;", 39, &["`solid` is a keyword"]);
}

#[test]
fn a_missing_semicolon_is_reported_where_it_is_missing() {
    expect_error(
        "solid a = sphere (0,0,0; 1) tlo a;",
        28,
        &["expected `;` at the end of the statement, found `tlo`"],
    );
    expect_error("solid a = sphere (0,0,0; 1)\n\ntlo a;", 28, &["expected `;`", "found `tlo`"]);
    expect_error("solid a = sphere (0,0,0; 1); tlo a", 35, &["expected `;`", "found the end of the file"]);
    expect_error("solid a = sphere (0,0,0; 1); tlo a solid b = a;", 35, &["expected `;`", "found `solid`"]);
}

#[test]
fn flags_within_a_solid_are_explained() {
    expect_error(
        "solid a = sphere (0,0,0; 1) -bc=1 or plane (0,0,0; 0,0,1);",
        35,
        &["flags follow the whole solid"],
    );
    expect_error(
        "solid a = (sphere (0,0,0; 1) -bc=1);",
        30,
        &["expected `)`", "flags follow the whole solid"],
    );
    expect_error("solid a = sphere (0,0,0; 1) -maxh=;", 35, &["expected the value of the flag"]);
    expect_error("solid a = sphere (0,0,0; 1) - -maxh=1;", 31, &["expected the name of a flag"]);
    expect_error("solid a = sphere (0,0,0; 1) -bc=[1,2;", 37, &["expected `]`, found `;`"]);
    expect_error("solid a = -b;", 11, &["expected a solid, found `-`", "write `a and not b`"]);
}

#[test]
fn a_solid_behind_a_minus_sign_is_an_error() {
    let solids = "solid block = orthobrick (0,0,0; 1,1,1); solid hole = sphere (0,0,0; 0.5);";
    let difference = ["there is no operator `-`, and `hole` is a solid", "write `and not hole`"];
    expect_error(&format!("{solids} solid part = block - hole; tlo part;"), 95, &difference);
    expect_error(&format!("{solids} solid part = block -hole; tlo part;"), 95, &difference);
    expect_error(&format!("{solids} tlo block - hole;"), 86, &difference);
    // The solid may be defined later in the file.
    let later = "solid a = sphere (0,0,0; 1) - b; solid b = sphere (1,0,0; 1); tlo a;";
    expect_error(later, 29, &["`b` is a solid", "write `and not b`"]);
    // In places where no flag can be, the help also has the difference.
    for part in ["(block - hole)", "block - hole and block", "block - sphere (0,0,0; 1)"] {
        let text = error(&format!("{solids} solid part = {part}; tlo block;"));
        assert!(text.contains("a difference is `a and not b`"), "{text}");
    }
    // A known flag is a flag, and other unknown flags are warnings.
    geometry("solid maxh = sphere (0,0,0; 1) -maxh=1; tlo maxh -maxh=0.5;");
    assert!(warning("solid a = sphere (0,0,0; 1) -holes; tlo a;").contains("-holes is ignored"));
}

#[test]
fn quoted_strings_are_answered_with_the_words_of_the_file() {
    let no_quotes = "there are no quoted strings";
    let sphere = "solid a = sphere (0,0,0; 1)";
    expect_error(&format!("{sphere} -material=\"air\";"), 39, &[no_quotes, "help: write -material=air"]);
    expect_error(&format!("{sphere} -bcname='fixed wall';"), 37, &[no_quotes, "write -bcname=fixed_wall"]);
    expect_error(&format!("{sphere} -bcname=[\"in\", out];"), 38, &["write in without quotes"]);
    expect_error("boundaryconditionname a a \"wall\";", 27, &["write wall without quotes"]);
    expect_error(&format!("{sphere} -maxh=\"0.5\";"), 35, &["write -maxh=0.5"]);
    expect_error(&format!("{sphere} -bcname=\"\";"), 37, &["write -bcname=WORD, a word of letters"]);
}

#[test]
fn a_file_must_begin_with_its_keyword() {
    let whole = |source: &str| parse_geometry(source, "t.geo").unwrap_err().to_string();
    assert!(whole("").starts_with("t.geo:1:1: error: the file is empty"));
    assert!(whole("# nothing\n").contains("the file is empty"));
    assert!(whole("solid a = sphere (0,0,0; 1); tlo a;").contains("begins with the word `algebraic3d`"));
    let stl = whole("facet normal 0 0 1\nouter loop\n");
    assert_eq!(stl.matches("error:").count(), 1);
    assert!(stl.contains("a file of another kind"), "{stl}");
    assert!(whole("algebraic3d").contains("there is no top-level object, hence nothing to mesh"));
}

#[test]
fn independent_errors_are_reported_without_consequences() {
    let text = "solid a = sphere (0,0,0);\nsolid b = a and plane (0,0,0; 0,0,0);\nsolid c = a or b or ball;\ntlo c; tlo a;\nboundarycondition c d 1;";
    let errors = errors(text);
    let places: Vec<_> = errors.errors().map(|e| (e.span.line, e.span.column)).collect();
    assert_eq!(places, [(2, 24), (3, 17), (4, 21), (6, 21)], "{errors}");
}

#[test]
fn a_broken_curve_gives_one_error() {
    error("curve2d p = (2; 0,0; 1; 2,1,2); solid a = revolution (0,0,0; 1,0,0; p); tlo a;");
}

#[test]
fn degenerate_primitives_are_located() {
    for (text, message) in [
        ("sphere (0,0,0; 0)", "`sphere` needs a positive radius, not 0"),
        ("sphere (0,0,0; -1)", "`sphere` needs a positive radius, not -1"),
        ("plane (0,0,0; 0,0,0)", "the normal of the plane (0, 0, 0) has no direction"),
        ("plane (1e99,0,0; 0,0,1)", "a coordinate is larger than 1e60"),
        ("cylinder (1,2,3; 1,2,3; 1)", "the two points on the axis of `cylinder` coincide"),
        ("cylinder (0.1,0.2,0.3; 0.1,0.2,0.3000000000000001; 1)", "coincide"),
        ("cylinder (0,0,0; 0,0,1; 0)", "`cylinder` needs a positive radius"),
        ("cone (0,0,0; 0; 0,0,1; 0)", "`cone` cannot have the radii 0 and 0"),
        ("cone (0,0,0; 1; 0,0,1; -1)", "`cone` cannot have the radii 1 and -1"),
        ("cone (0,0,0; 1; 0,0,0; 2)", "coincide"),
        ("orthobrick (0,0,0; 1,0,1)", "`orthobrick` has no extent along y: from 0 to 0"),
        ("orthobrick (1,0,0; 0,1,1)", "`orthobrick` has no extent along x: from 1 to 0"),
        ("torus (0,0,0; 0,0,0; 2; 1)", "the axis of `torus` (0, 0, 0) has no direction"),
        ("ellipsoid (0,0,0; 1,0,0; 0,0,0; 0,0,1)", "a semi-axis of `ellipsoid`"),
        ("ellipsoid (0,0,0; 1,0,0; 1,1,0; 0,0,1)", "at 45.0000 degrees, not at right angles"),
        ("ellipticcylinder (0,0,0; 1,0,0; -2,0,0)", "at 0.0000 degrees"),
        ("ellipticcone (0,0,0; 1,0,0; 0,2,0; 0; 0.5)", "`ellipticcone` cannot have the height 0"),
        ("ellipticcone (0,0,0; 2,0,0; 0,1,0; 1; -0.5)", "`ellipticcone` cannot have the ratio -0.5"),
        ("multitranslate (1,0,0; -1; sphere (0,0,0; 1))", "there cannot be -1 copies"),
        ("translate (1e300,0,0; sphere (0,0,0; 1))", "larger than 1e60"),
    ] {
        let text = error(&format!("solid a = {text}; tlo a;"));
        assert!(text.contains(message) && text.starts_with("t.geo:2:"), "{message}\n{text}");
    }
}

#[test]
fn degenerate_primitives_are_rejected_inside_transforms() {
    expect_error("solid a = translate (1,0,0; sphere (0,0,0; 0)); tlo a;", 29, &["positive radius"]);
}

#[test]
fn almost_orthogonal_semi_axes_are_turned_with_a_warning() {
    let text = warning("solid a = ellipsoid (0,0,0; 2,0.001,0; 0,1,0; 0,0,1); tlo a;");
    assert!(text.contains("were turned to 90"), "{text}");
}

#[test]
fn wrong_polyhedra_are_located() {
    let points = "0,0,0; 1,0,0; 0,1,0; 0,0,1 ;;";
    for (faces, message) in [
        ("1,3,2; 1,2,4; 2,3,4", "do not close at the edge from point 1 to point 3"),
        ("1,3,2; 1,2,4; 2,3,4; 1,3,4", "do not close at the edge from point 1 to point 3"),
        ("1,2,3; 1,4,2; 2,4,3; 1,3,4", "enclose no volume, or are oriented inward"),
        ("1,3,2; 1,2,4; 2,3,5; 1,4,3", "there is no point 5 in this `polyhedron`"),
        ("1,3,2; 1,2,2; 2,3,4; 1,4,3", "needs three different points"),
        ("1,3,2; 1,2,1.5; 2,3,4; 1,4,3", "there is no point 1.5"),
    ] {
        let text = error(&format!("solid a = polyhedron ({points} {faces}); tlo a;"));
        assert!(text.contains(message), "{faces}: {text}");
    }
    expect_error("solid a = polyhedron (0,0,0; 1,0,0; 1,2,3);", 42, &["x, y, z; ... ;; i, j, k"]);
}

#[test]
fn a_self_intersecting_polyhedron_is_rejected() {
    // A tetrahedron through another one: closed and oriented, but not a solid.
    let text = "solid a = polyhedron (0,0,0; 3,0,0; 0,3,0; 0,0,3; 0.5,0.5,0.5; 0.5,0.5,-2; 2.5,0.5,0.4; 0.6,2.5,0.6 ;;
        1,3,2; 1,2,4; 2,3,4; 1,4,3; 5,7,6; 5,6,8; 6,7,8; 5,8,7); tlo a;";
    let message = error(text);
    assert!(message.contains("cross") || message.contains("no volume"), "{message}");
}

#[test]
fn wrong_curves_are_located() {
    for (curve, message) in [
        ("curve2d c = (2; 0,0; 1,1; 1; 2,1,3);", "there is no point 3 in this curve"),
        ("curve2d c = (2; 0,0; 1,1; 1; 2,1,0);", "there is no point 0 in this curve"),
        ("curve2d c = (3; 0,0; 1,1; 2,0; 1; 4,1,2,3);", "segments of kind 4 have no tangents"),
        ("curve2d c = (2; 0,0; 1,1; 1; 3,1,2);", "no segment of kind 3 with 2 points"),
        ("curve2d c = (2; 0,0; 1,1; 1; 7,1,2);", "no segment of kind 7"),
        (
            "curve2d c = (4; 0,0; 1,1; 2,2; 3,3; 2; 2,1,2; 2,3,4);",
            "begins at point 3, but the one before ends at 2",
        ),
        ("curve2d c = (3; 0,0; 1,1; 1; 2,1,2);", "another coordinate (2 of 3 points are complete)"),
        ("curve2d c = (1; 0,0; 1,1; 1; 2,1,2);", "the curve declares 1 points"),
        ("curve2d c = (0; 1; 2,1,2);", "a curve cannot have 0 points"),
        ("curve3d c = (2; 0,0; 1,1,1; 1; 2,1,2);", "another coordinate"),
        ("curve3d c = (4e9; 0,0,0; 1,1,1; 1; 2,1,2);", "another coordinate"),
    ] {
        let text = error(curve);
        assert!(text.contains(message), "{curve}: {text}");
    }
    let open = "curve2d f = (2; 0,0; 1,1; 1; 2,1,2); solid a = revolution (0,0,0; 1,0,0; f); tlo a;";
    assert!(error(open).contains("is open, and not closed by the axis either"));
    let order = "curve2d f = (2; 0,0; 1,1; 1; 2,1,2); curve3d p = (2; 0,0,0; 1,1,1; 1; 2,1,2); solid a = extrusion (f; p; 0,0,1); tlo a;";
    assert!(error(order).contains("takes a curve3d (the path) first"));
}

#[test]
fn unknown_names_everywhere_are_errors() {
    let solid = "solid a = sphere (0,0,0; 1); tlo a; ";
    for (text, name) in [
        ("identify periodic a nix;", "nix"),
        ("identify closesurfaces nix a;", "nix"),
        ("identify closesurfaces a a -tlo=nix;", "nix"),
        ("singular face nix a;", "nix"),
        ("singular face a nix;", "nix"),
        ("singular edge a nix;", "nix"),
        ("singular edge a a -tlo=nix;", "nix"),
        ("singular point a a nix;", "nix"),
        ("boundarycondition nix a 1;", "nix"),
        ("boundarycondition a nix 1;", "nix"),
        ("boundaryconditionname a nix wall;", "nix"),
        ("tlo a nix;", "nix"),
        ("solid b = revolution (0,0,0; 1,0,0; nix);", "nix"),
    ] {
        let text = error(&format!("{solid}{text}"));
        assert!(text.contains(&format!("`{name}`")) && text.contains("there is no"), "{text}");
    }
}

#[test]
fn solids_that_contain_themselves_are_rejected() {
    assert!(
        error("solid a = sphere (0,0,0; 1); solid a = a and plane (0,0,0; 0,0,1); tlo a;")
            .contains("`a` contains itself")
    );
    assert!(error("solid a = a; tlo a;").contains("there is no solid `a`"));
    let around = "solid a = sphere (0,0,0; 1); solid b = not a; solid a = b or plane (0,0,0; 0,0,1); tlo b;";
    assert!(error(around).contains("`a` contains itself"));
}

#[test]
fn a_repeated_top_level_object_is_rejected() {
    assert!(
        error("solid a = sphere (0,0,0; 1); tlo a; tlo a;")
            .contains("`a` is already a top-level object, in line 2")
    );
}

#[test]
fn an_empty_box_is_rejected() {
    assert!(error("boundingbox (0,0,0; 1,-1,1);").contains("the box of `boundingbox` is empty"));
}

#[test]
fn a_boundary_number_begins_with_one() {
    assert!(
        error("solid a = sphere (0,0,0; 1); tlo a; boundarycondition a a 0;")
            .contains("0 is not a boundary-condition number")
    );
}

#[test]
fn the_number_of_reported_errors_is_limited() {
    let errors = errors(&"solid = sphere (0,0,0; 1);\n".repeat(10_000));
    assert_eq!(errors.messages.len(), 20);
    assert!(errors.to_string().contains("more than 20 errors"));
}
