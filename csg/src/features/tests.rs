//! Features of small geometries, with counts determined by hand.

use super::trace::curve_tangent;
use super::*;
use crate::{Projector, Vector, language};

pub(super) fn geometry(source: &str) -> Geometry {
    let source = format!("algebraic3d\n{source}");
    language::parse_geometry(&source, "test.geo").unwrap_or_else(|e| panic!("{e}")).geometry
}

pub(super) fn find(source: &str) -> Features {
    let geometry = geometry(source);
    let features = Features::find(&geometry).unwrap_or_else(|e| panic!("{e}"));
    check_traces(&geometry, &features);
    features
}

pub(super) fn refused(source: &str) -> String {
    Features::find(&geometry(source)).unwrap_err().to_string()
}

/// Numbers of corners, curves between corners, closed curves and patches.
pub(super) fn counts(features: &Features) -> [usize; 4] {
    let closed = features.curves.iter().filter(|c| c.ends.is_none()).count();
    [features.corners.len(), features.curves.len() - closed, closed, features.patches.len()]
}

/// Checks that traces lie on both surfaces and turn by less than a quarter radian per step.
fn check_traces(geometry: &Geometry, features: &Features) {
    let tolerance = Projector::new(geometry, features).tolerance();
    for curve in &features.curves {
        let tangents: Vec<Vector> = curve.trace.iter().map(|p| curve_tangent(geometry, curve, p)).collect();
        for (ends, directions) in curve.trace.windows(2).zip(tangents.windows(2)) {
            let on = |s: SurfaceId| geometry.surfaces[s.index()].distance(&ends[0]) <= tolerance;
            assert!(curve.surfaces.into_iter().all(on), "{} is not on the curve", ends[0]);
            assert!(directions[0].angle(&directions[1]) < 0.25);
            assert!(directions[0].angle(&(ends[1] - ends[0])) < 0.25);
            assert!(curve_curvature(geometry, curve, &ends[0]).is_finite());
        }
    }
}

const CUBE: &str = "solid cube = orthobrick (0, 0, 0; 1, 1, 1);";

#[test]
fn a_cube_has_eight_corners_twelve_curves_and_six_patches() {
    let features = find(&format!("{CUBE} tlo cube;"));
    assert_eq!(counts(&features), [8, 12, 0, 6]);
    assert_eq!(features.bounds, Aabb { min: Point::origin(), max: Point::new(1.0, 1.0, 1.0) });
    for curve in &features.curves {
        assert_eq!(curve.fins.len(), 2);
        assert!((curve.length() - 1.0).abs() < 1e-15);
        assert_eq!(curve_curvature(&geometry(&format!("{CUBE} tlo cube;")), curve, &curve.trace[0]), 0.0);
    }
    for corner in &features.corners {
        assert_eq!(corner.surfaces.len(), 3);
    }
}

#[test]
fn the_normal_of_an_outer_patch_leaves_the_body_and_its_boundary_runs_counterclockwise() {
    let source =
        "solid hole = orthobrick (0, 0, 0; 4, 4, 1) and not cylinder (2, 2, 0; 2, 2, 1; 1); tlo hole;";
    let (geometry, features) = (geometry(source), find(source));
    assert_eq!(counts(&features), [8, 12, 2, 7]);
    for patch in &features.patches {
        assert_eq!((patch.inside, patch.outside), (Some(BodyId(0)), None));
        let surface = &geometry.surfaces[patch.surface.index()];
        for &(curve, forward) in &patch.boundary {
            let projector = Projector::new(&geometry, &features);
            let trace = &features.curve(curve).trace;
            let at = projector.project_curve(curve, &nalgebra::center(&trace[0], &trace[1])).unwrap();
            let curve = features.curve(curve);
            let along = curve_tangent(&geometry, curve, &at) * if forward { 1.0 } else { -1.0 };
            let normal = surface.normal(&at) * if patch.flipped { -1.0 } else { 1.0 };
            // To the left of the curve on the surface: just below that point is inside, just above
            // outside.
            let left = surface.project(&(at + normal.cross(&along) * 1e-3)).unwrap();
            let solid = &geometry.bodies[0].solid;
            let side = |p: Point| solid.side(&geometry.surfaces, &p, 1e-9);
            assert_eq!(side(left - normal * 1e-5), crate::solid::Side::Inside);
            assert_eq!(side(left + normal * 1e-5), crate::solid::Side::Outside);
        }
    }
}

#[test]
fn closed_surfaces_without_curves_get_a_seed() {
    let features = find("solid s = sphere (0, 0, 0; 2) and not torus (0, 0, 0; 1, 1, 0; 1; 0.5); tlo s;");
    assert_eq!(counts(&features), [0, 0, 0, 2]);
    assert!(features.patches.iter().all(|p| p.seeds.len() == 1 && p.boundary.is_empty()));
    // The torus bounds the body from inside, so its gradient points into the body.
    assert_eq!(features.patches.iter().map(|p| p.flipped).collect::<Vec<_>>(), [false, true]);
    assert!((features.bounds.max - Point::new(2.0, 2.0, 2.0)).norm() < 1e-12);
}

#[test]
fn the_walls_of_a_shell_may_be_very_thin() {
    for inner in [0.99, 0.9999, 0.999999, 0.9999999] {
        let shell = format!("solid s = sphere (0,0,0; 1) and not sphere (0,0,0; {inner}); tlo s;");
        assert_eq!(counts(&find(&shell)), [0, 0, 0, 2], "{inner}");
    }
}

#[test]
fn an_interface_is_one_patch_with_the_earlier_body_inside() {
    let features = find(&format!(
        "{CUBE} solid ball = sphere (0.5, 0.5, 0.5; 0.2); solid rest = cube and not ball; tlo rest; tlo ball;"
    ));
    assert_eq!(counts(&features), [8, 12, 0, 7]);
    let interface = features.patches.iter().find(|p| p.outside.is_some()).unwrap();
    assert_eq!((interface.inside, interface.outside), (Some(BodyId(0)), Some(BodyId(1))));
    assert!(interface.flipped);
}

#[test]
fn three_regions_around_a_curve_make_three_fins() {
    let features = find(&format!(
        "{CUBE} solid cut = plane (0.5, 0, 0; 1, 0, 0.1); solid a = cube and cut; solid b = cube and not cut; tlo a; tlo b;"
    ));
    assert_eq!(counts(&features), [12, 20, 0, 11]);
    assert_eq!(features.curves.iter().filter(|c| c.fins.len() == 3).count(), 4);
}

#[test]
fn many_planes_through_one_point_or_one_line_make_one_corner_or_curve() {
    let pyramid = "solid p = plane (0,0,1; 1,0,1) and plane (0,0,1; -1,0,1) and plane (0,0,1; 0,1,1)
        and plane (0,0,1; 0,-1,1) and plane (0,0,1; 1,1,1.3) and plane (0,0,1; -1,-1,1.3) and plane (0,0,0; 0,0,-1);";
    assert_eq!(counts(&find(&format!("{pyramid} tlo p;"))), [7, 12, 0, 7]);
    let fan = "solid box = orthobrick (-1, -1, 0; 1, 1, 1);
        solid a = box and plane (0, 0, 0; 1, 0, 0) and plane (0, 0, 0; -1, 1, 0);
        solid b = box and not plane (0, 0, 0; 1, 0, 0) and plane (0, 0, 0; 1, 2, 0);
        solid c = box and not plane (0, 0, 0; 1, 0, 0) and not plane (0, 0, 0; 1, 2, 0);
        tlo a; tlo b; tlo c;";
    let features = find(fan);
    let fins = |n: usize| features.curves.iter().filter(|c| c.fins.len() == n).count();
    // On the axis: the two sides of a, the interface of b and c, and the part of x = 0 beside b and
    // c.
    assert!(fins(4) == 1, "{}", fins(4));
}

#[test]
fn bodies_that_touch_in_an_edge_or_a_corner_keep_it() {
    let edge = "solid s = orthobrick (0, 0, 0; 1, 1, 1) or orthobrick (1, 1, 0; 2, 2, 1); tlo s;";
    let features = find(edge);
    assert_eq!(counts(&features), [14, 23, 0, 10]);
    assert_eq!(features.curves.iter().filter(|c| c.fins.len() == 4).count(), 1);
    let corner = "solid s = orthobrick (0, 0, 0; 1, 1, 1) or orthobrick (1, 1, 1; 2, 2, 2); tlo s;";
    assert_eq!(counts(&find(corner)), [15, 24, 0, 12]);
}

#[test]
fn a_curve_on_three_surfaces_is_found_once() {
    let rocket = "solid tank = cylinder (0,0,0; 0,0,1; 1) and plane (0,0,0; 0,0,-1) and plane (0,0,2; 0,0,1);
        solid nose = cone (0,0,2; 1; 0,0,4; 0.25) and plane (0,0,2; 0,0,-1) and plane (0,0,3.5; 0,0,1);";
    assert_eq!(counts(&find(&format!("{rocket} solid rocket = tank or nose; tlo rocket;"))), [0, 0, 3, 4]);
    assert_eq!(counts(&find(&format!("{rocket} tlo tank; tlo nose;"))), [0, 0, 3, 5]);
}

#[test]
fn smoothly_joined_surfaces_have_a_curve_between_them() {
    let capsule =
        "solid pipe = cylinder (0,0,0; 0,0,1; 1) and plane (0,0,0; 0,0,-1) and plane (0,0,2; 0,0,1);
        solid capsule = pipe or sphere (0,0,0; 1) or sphere (0,0,2; 1); tlo capsule;";
    assert_eq!(counts(&find(capsule)), [0, 0, 2, 3]);
    let elbow = "solid up = cylinder (0,0,0; 0,0,1; 0.5) and plane (0,0,0; 0,0,1) and plane (0,0,-2; 0,0,-1);
        solid bend = torus (1.5,0,0; 0,1,0; 1.5; 0.5) and plane (0,0,0; 0,0,-1) and plane (1.5,0,0; 1,0,0);
        solid elbow = up or bend; tlo elbow;";
    assert_eq!(counts(&find(elbow)), [0, 0, 3, 4]);
    let rounded = "solid s = orthobrick (0.2,0,0; 1,1,1) or orthobrick (0,0.2,0; 1,1,1)
        or cylinder (0.2,0.2,0; 0.2,0.2,1; 0.2) and plane (0,0,0; 0,0,-1) and plane (0,0,1; 0,0,1); tlo s;";
    assert_eq!(counts(&find(rounded)), [10, 15, 0, 7]);
}

#[test]
fn surfaces_that_only_touch_the_boundary_add_no_features() {
    let inscribed = "solid s = orthobrick (-1,-1,0; 1,1,2) and cylinder (0,0,0; 0,0,1; 1);";
    assert_eq!(counts(&find(&format!("{inscribed} tlo s;"))), [0, 0, 2, 3]);
    let turned = format!("{inscribed} solid t = rotate (0.1,0.2,0.3; 0.4,0.7,1.1; s); tlo t;");
    assert_eq!(counts(&find(&turned)), [0, 0, 2, 3]);
    assert_eq!(
        counts(&find("solid s = orthobrick (-1,-1,-1; 1,1,1) and sphere (0,0,0; 1); tlo s;")),
        [0, 0, 0, 1]
    );
}

#[test]
fn pipes_of_one_radius_branch_where_they_are_tangent() {
    let pipes = "solid a = cylinder (-5,0,0; 5,0,0; 1) and plane (-3,0,0; -1,0,0) and plane (3,0,0; 1,0,0);
        solid b = cylinder (0,-5,0; 0,5,0; 1) and plane (0,3,0; 0,1,0)";
    let cross = find(&format!("{pipes} and plane (0,-3,0; 0,-1,0); solid s = a or b; tlo s;"));
    assert_eq!(counts(&cross), [2, 4, 4, 6]);
    let source = format!("{pipes} and plane (0,0,0; 0,-1,0); solid s = a or b;");
    // The result does not depend on rounding in a skew position.
    let turned = find(&format!("{source} solid t = rotate (0.1,0.2,0.3; 0.4,0.7,1.1; s); tlo t;"));
    assert_eq!(counts(&turned), [2, 2, 3, 5]);
    let tee = find(&format!("{source} tlo s;"));
    assert_eq!(counts(&tee), [2, 2, 3, 5]);
    assert!(tee.corners.iter().all(|c| (c.point.z.abs() - 1.0).abs() < 1e-12));
}

#[test]
fn a_circle_has_the_curvature_of_its_radius() {
    let source =
        "solid s = cylinder (0,0,0; 0,0,1; 0.25) and plane (0,0,0; 0,0,-1) and plane (0,0,1; 0,0,1); tlo s;";
    let (geometry, features) = (geometry(source), find(source));
    for curve in &features.curves {
        assert!((curve_curvature(&geometry, curve, &curve.trace[3]) - 4.0).abs() < 1e-12);
        let circumference = 0.5 * std::f64::consts::PI;
        assert!((curve.length() - circumference).abs() < 0.01 * circumference);
    }
}

#[test]
fn points_of_the_file_are_corners_and_split_curves() {
    let points = "point (0,0,0); point (0.3,0,0); point (0.5,0.5,0); point (0.5,0.4,0.3);";
    let features = find(&format!("{CUBE} tlo cube; {points}"));
    assert_eq!(counts(&features), [11, 13, 0, 6]);
    let cylinder =
        "solid s = cylinder (0,0,0; 0,0,1; 1) and plane (0,0,0; 0,0,-1) and plane (0,0,1; 0,0,1); tlo s;";
    let features = find(&format!("{cylinder} point (1, 0, 0);"));
    assert_eq!(counts(&features), [1, 1, 1, 3]);
    let cut = features.curves.iter().find_map(|c| c.ends).unwrap();
    assert_eq!(cut, [CornerId(0), CornerId(0)]);
}

#[test]
fn features_do_not_depend_on_size_and_distance_from_the_origin() {
    let part = |size: f64, x: f64| {
        let at = |u: f64| x + u * size;
        format!(
            "solid s = cylinder ({c},0,0; {c},0,1; {size}) and plane ({c},0,0; 0.1,0.2,-1) and plane ({c},0,{size}; 0,0.1,1)
            and not sphere ({e},0,{h}; {r}); tlo s;",
            c = at(0.0),
            e = at(1.0),
            h = 0.5 * size,
            r = 0.3 * size,
        )
    };
    for (size, x) in [(1.0, 0.0), (1e-6, 0.0), (1e6, 0.0), (1.0, 1e6), (1e-3, 100.0)] {
        assert_eq!(counts(&find(&part(size, x))), [0, 0, 3, 4], "size {size} at {x}");
    }
}

#[test]
fn thin_plates_and_sharp_wedges_are_bounded() {
    let box_of = |source: &str| find(source).bounds;
    let plate = box_of("solid s = orthobrick (0,0,0; 1,1,0.0001); tlo s;");
    assert_eq!(plate.max, Point::new(1.0, 1.0, 0.0001));
    let wedge = box_of(
        "solid s = plane (0,0,0; -0.01,0,1) and plane (0,0,0; 0,0,-1) and plane (1,0,0; 1,0,0)
        and plane (0,0,0; 0,-1,0) and plane (0,1,0; 0,1,0); tlo s;",
    );
    assert!((wedge.max - Point::new(1.0, 1.0, 0.01)).norm() < 1e-12);
}

#[test]
fn invalid_geometries_are_rejected_with_coordinates() {
    let cases = [
        (
            "solid a = cylinder (0,0,0; 1,1,1; 0.5) and plane (0,0,0; 0,0,-1); tlo a;",
            "solid `a` (line 2) is not bounded",
        ),
        ("solid a = sphere (0,0,0; 1) and sphere (5,0,0; 1); tlo a;", "solid `a` (line 2) contains nothing"),
        ("solid a = sphere (0,0,0; 1) and sphere (2,0,0; 1); tlo a;", "solid `a` (line 2) contains nothing"),
        (
            "solid a = cylinder (0,0,0; 1,0,0; 1) and plane (0,0,1; 0,0,-1) and sphere (0,0,0; 3); tlo a;",
            "solid `a` (line 2) contains nothing",
        ),
        (
            "solid a = orthobrick (0,0,0; 1,1,1); solid b = sphere (0.5,0.5,0.5; 0.2); tlo a; tlo b;",
            "solid `a` (line 2) and solid `b` (line 2) overlap near",
        ),
        (
            "solid plate = orthobrick (-2,-2,-1; 2,2,0);\nsolid ball = sphere (0,0,1; 1);\nsolid a = plate or ball;
            solid gap = orthobrick (-2,-2,-1; 2,2,1) and not a; tlo a; tlo gap;",
            "surfaces of solid `plate` (line 2) and solid `ball` (line 3) touch at (0.000000, ",
        ),
        (
            "solid a = orthobrick (-2,-2,-1; 2,2,0)\n  and not sphere (0,0,-0.25; 0.25);\ntlo a;",
            "surfaces of solid `a`, its plane (2:11) and its sphere (3:11), touch at (0.000000, ",
        ),
        (
            "solid a = sphere (0,0,0; 1); tlo a;\npoint (2, 0, 0);",
            "the point (2.000000, 0.000000, 0.000000) (line 3)",
        ),
    ];
    for (source, message) in cases {
        assert!(refused(source).starts_with(message), "{} does not start with {message}", refused(source));
    }
    assert_eq!(Features::find(&Geometry::default()).unwrap_err(), FeatureError::NoBody);
}

#[test]
fn the_tutorials_have_the_features_counted_by_hand() {
    let folder = std::env::var("TETMILL_SHARED")
        .unwrap_or_else(|_| concat!(env!("CARGO_MANIFEST_DIR"), "/../../shared").to_owned());
    let expected = [
        ("boundarycondition", [12, 20, 0, 11]),
        ("boxcyl", [8, 12, 4, 9]),
        ("cone", [0, 0, 2, 3]),
        ("cube", [8, 12, 0, 6]),
        ("cubeandspheres", [24, 36, 6, 8]),
        ("cubemsphere", [8, 12, 1, 7]),
        ("cylinder", [0, 0, 2, 3]),
        ("ellipsoid", [0, 0, 0, 1]),
        ("ellipticcyl", [0, 0, 2, 3]),
        ("fichera", [14, 21, 0, 9]),
        ("manyholes", [8, 12, 200, 106]),
        ("matrix", [8, 12, 5, 14]),
        ("ortho", [8, 12, 0, 6]),
        ("sculpture", [0, 0, 6, 5]),
        ("shaft", [32, 48, 10, 20]),
        ("shell", [0, 0, 0, 2]),
        ("sphere", [1, 0, 0, 1]),
        ("sphereincube", [8, 12, 0, 7]),
        ("torus", [0, 0, 0, 1]),
        ("trafo", [32, 48, 12, 30]),
        ("twocubes", [12, 20, 0, 11]),
    ];
    for (name, hand) in expected {
        let file = format!("{folder}/netgen-tutorials/{name}.geo");
        let Ok(source) = std::fs::read_to_string(&file) else {
            eprintln!("SKIPPED: {file} not found (set TETMILL_SHARED)");
            return;
        };
        let geometry = language::parse_geometry(&source, name).unwrap().geometry;
        let features = Features::find(&geometry).unwrap_or_else(|e| panic!("{name}: {e}"));
        check_traces(&geometry, &features);
        assert_eq!(counts(&features), hand, "{name}");
    }
}
