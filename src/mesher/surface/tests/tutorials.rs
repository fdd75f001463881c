//! NETGEN's tutorials from text to triangles, if the folder with them exists.

use super::*;
use crate::ground::size::{GeometricSize, SizeSettings};
use crate::mesher::surface::curves::mesh_curves;
use std::path::PathBuf;

/// The folder with the tutorials, if it exists.
fn folder() -> Option<PathBuf> {
    let shared = std::env::var_os("TETMILL_SHARED")
        .map_or_else(|| PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../shared")), PathBuf::from);
    let folder = shared.join("netgen-tutorials");
    folder.is_dir().then_some(folder)
}

/// Tutorials with primitives that can be meshed, one of each kind.
const TUTORIALS: [&str; 14] = [
    "boxcyl",
    "cone",
    "cube",
    "cubeandspheres",
    "cubemsphere",
    "cylinder",
    "ellipsoid",
    "fichera",
    "matrix",
    "sculpture",
    "shaft",
    "sphere",
    "torus",
    "trafo",
];

#[test]
fn tutorials_are_meshed_without_a_fault() {
    let Some(folder) = folder() else {
        eprintln!("SKIPPED: no folder with NETGEN's tutorials; set TETMILL_SHARED");
        return;
    };
    for name in TUTORIALS {
        let text = std::fs::read_to_string(folder.join(name).with_extension("geo")).expect(name);
        let geometry = csg::language::parse_geometry(&text, name).expect(name).geometry;
        let features = Features::find(&geometry).expect(name);
        let projector = Projector::new(&geometry, &features);
        let size = GeometricSize::new(&geometry, &features, &SizeSettings::default());
        let curves = mesh_curves(&features, &projector, &size).expect(name);
        let (mesh, report) =
            mesh_patches(&geometry, &features, curves, &size, &Settings::default()).expect(name);
        assert_eq!(mesh.check(&features, &projector), [], "{name}");
        assert_eq!(report.flattening_left(), 0, "{name}");
        assert!(report.worst_normal() < 40.0, "{name}: {report:?}");
        // The least angle is 28°, in cubeandspheres, between curves that are close to each other.
        assert!(report.min_angle() > 25.0 && report.mean_quality() > 0.85, "{name}: {report:?}");
    }
}

#[test]
fn the_result_does_not_depend_on_the_number_of_threads() {
    let Some(folder) = folder() else {
        eprintln!("SKIPPED: no folder with NETGEN's tutorials; set TETMILL_SHARED");
        return;
    };
    let text = std::fs::read_to_string(folder.join("trafo.geo")).expect("trafo.geo");
    let geometry = csg::language::parse_geometry(&text, "trafo.geo").expect("a geometry").geometry;
    let features = Features::find(&geometry).expect("features");
    let projector = Projector::new(&geometry, &features);
    let size = GeometricSize::new(&geometry, &features, &SizeSettings::default());
    let curves = mesh_curves(&features, &projector, &size).expect("curves");
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        let settings = Settings::default();
        pool.install(|| mesh_patches(&geometry, &features, curves.clone(), &size, &settings)).expect("a mesh")
    };
    let ((one, first), (three, second)) = (run(1), run(3));
    assert_eq!((one.points, one.triangles), (three.points, three.triangles));
    assert_eq!(first, second);
}
