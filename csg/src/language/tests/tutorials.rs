//! NETGEN's tutorials, if they are available.

use super::*;
use std::path::PathBuf;

/// The folder of the tutorials: in `TETMILL_SHARED`, or in `shared` next to the project.
fn folder() -> Option<PathBuf> {
    let beside = concat!(env!("CARGO_MANIFEST_DIR"), "/../../shared");
    let shared = std::env::var_os("TETMILL_SHARED").map_or_else(|| PathBuf::from(beside), PathBuf::from);
    let folder = shared.join("netgen-tutorials");
    if !folder.is_dir() {
        eprintln!("SKIPPED: no tutorials in {}; set TETMILL_SHARED", folder.display());
        return None;
    }
    Some(folder)
}

fn read(name: &str) -> Option<Result<Parsed, Diagnostics>> {
    let source = std::fs::read(folder()?.join(name)).expect(name);
    Some(parse_geometry_bytes(&source, name, &Settings::default()))
}

/// Numbers of surfaces and bodies of each tutorial, counted by hand.
const COUNTS: [(&str, usize, usize); 25] = [
    ("boundarycondition", 8, 2),
    ("boxcyl", 10, 1),
    ("circle_on_cube", 7, 1),
    ("cone", 3, 1),
    ("cube", 6, 1),
    ("cubeandspheres", 8, 1),
    ("cubemsphere", 7, 1),
    ("cylinder", 3, 1),
    ("ellipsoid", 1, 1),
    ("ellipticcyl", 3, 1),
    // Four arcs with four sides and a torus each, five planes between them; a brick; a ball.
    ("extrusion", 32, 1),
    ("fichera", 12, 1),
    ("manyholes", 106, 1),
    ("matrix", 14, 2),
    ("ortho", 6, 1),
    ("period", 8, 2),
    ("revolution", 6, 1),
    ("sculpture", 5, 1),
    ("shaft", 27, 1),
    ("shell", 2, 1),
    ("sphere", 1, 1),
    ("sphereincube", 7, 2),
    ("torus", 1, 1),
    ("trafo", 26, 5),
    ("twocubes", 7, 2),
];

#[test]
fn every_tutorial_is_read() {
    for (name, surfaces, bodies) in COUNTS {
        let Some(result) = read(&format!("{name}.geo")) else { return };
        let geometry = result.unwrap_or_else(|errors| panic!("{errors}")).geometry;
        // Auxiliary surfaces of seams belong to no solid of the file.
        let of_file = geometry.surface_info.iter().filter(|info| !info.solid.is_empty()).count();
        assert_eq!((of_file, geometry.bodies.len()), (surfaces, bodies), "{name}");
    }
}

/// Asserts that the first body of a tutorial agrees with `inside` at samples of a box.
fn tutorial_is(name: &str, low: Point, high: Point, inside: impl Fn(&Point) -> bool) {
    let Some(result) = read(name) else { return };
    let geometry = result.unwrap_or_else(|errors| panic!("{errors}")).geometry;
    let mut count = 0;
    for sample in samples() {
        let part = (sample.coords / 6.0).add_scalar(0.5);
        let point = low + (high - low).component_mul(&part);
        let expected = inside(&point);
        count += usize::from(expected);
        assert_eq!(is_inside(&geometry, &geometry.bodies[0].solid, &point), expected, "{name} at {point}");
    }
    assert!((100..3900).contains(&count), "too few samples inside or outside: {count}");
}

#[test]
fn the_shaft_is_the_union_of_its_parts() {
    // A web between `from` and `to`; its flanks converge toward the crank pin at y = 30·`side`.
    let web = |p: &Point, [from, to]: [f64; 2], side: f64| {
        let (y, flank) = (side * p.y, side * p.y - 3.0 * 28.0 + 3.0 * p.z.abs());
        let within = p.x > from && p.x < to;
        within
            && ((flank < 0.0 && y > 0.0 && y < 30.0) || y.hypot(p.z) < 30.0 || (y - 30.0).hypot(p.z) < 20.0)
    };
    let rod = |p: &Point, [from, to]: [f64; 2], y: f64, radius: f64| {
        p.x > from && p.x < to && (p.y - y).hypot(p.z) < radius
    };
    tutorial_is("shaft.geo", Point::new(-45., -55., -35.), Point::new(170., 55., 35.), |p| {
        web(p, [0., 10.], -1.)
            || web(p, [35., 45.], -1.)
            || web(p, [80., 90.], 1.)
            || web(p, [115., 125.], 1.)
            || rod(p, [-40., 5.], 0., 15.)
            || rod(p, [40., 85.], 0., 15.)
            || rod(p, [120., 165.], 0., 15.)
            || rod(p, [5., 40.], -30., 10.)
            || rod(p, [85., 120.], 30., 10.)
    });
}

#[test]
fn the_plate_has_its_holes() {
    tutorial_is("manyholes.geo", Point::new(-1., -1., -0.5), Point::new(11., 11., 1.5), |p| {
        let in_plate = (0.0..10.0).contains(&p.x) && (0.0..10.0).contains(&p.y) && (0.0..1.0).contains(&p.z);
        in_plate && (p.x.fract() - 0.5).hypot(p.y.fract() - 0.5) > 0.2
    });
}

#[test]
fn the_fichera_cube_has_its_numbers() {
    let Some(result) = read("fichera.geo") else { return };
    let geometry = result.unwrap_or_else(|errors| panic!("{errors}")).geometry;
    let numbers: Vec<_> = geometry.surface_info.iter().map(|info| info.bc).collect();
    assert_eq!(numbers, [[Some(2); 6], [Some(1); 6]].concat());
}

#[test]
fn two_bricks_share_planes_and_one_number_is_overridden() {
    let Some(result) = read("boundarycondition.geo") else { return };
    let Parsed { geometry, warnings } = result.unwrap_or_else(|errors| panic!("{errors}"));
    assert_eq!(geometry.boundary_overrides.len(), 1);
    assert!(warnings[0].message.contains("`brick2` is also one of `brick1`"), "{}", warnings[0]);
}
