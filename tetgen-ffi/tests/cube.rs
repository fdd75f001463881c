//! TetGen on a cube, through the worker.

use tetgen_ffi::{Error, TetgenMesh, available, tetrahedralize};
use thiserror as _;

const CORNERS: [[f64; 3]; 8] = [
    [0., 0., 0.],
    [1., 0., 0.],
    [1., 1., 0.],
    [0., 1., 0.],
    [0., 0., 1.],
    [1., 0., 1.],
    [1., 1., 1.],
    [0., 1., 1.],
];

/// The sides of the cube, two triangles each.
fn sides() -> Vec<[u32; 3]> {
    let sides = [[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]];
    sides.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect()
}

fn has_tetgen() -> bool {
    let has = available();
    if !has {
        eprintln!("skipped: TetGen is not available");
    }
    has
}

/// Six times the volume of each tet.
fn determinants(mesh: &TetgenMesh) -> Vec<f64> {
    let point = |v: u32| mesh.points[v as usize];
    let determinant = |&[a, b, c, d]: &[u32; 4]| {
        let [u, v, w] =
            [b, c, d].map(|end| std::array::from_fn::<f64, 3, _>(|i| point(end)[i] - point(a)[i]));
        let normal = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
        normal[0] * w[0] + normal[1] * w[1] + normal[2] * w[2]
    };
    mesh.tets.iter().map(determinant).collect()
}

#[test]
fn a_cube_has_volume_one_and_its_tets_are_positive() {
    if !has_tetgen() {
        return;
    }
    for (switches, fewest) in [("p", 5), ("pYq1.4", 12), ("pq1.4a0.01", 100)] {
        let mesh = tetrahedralize(&CORNERS, &sides(), switches).unwrap();
        let determinants = determinants(&mesh);
        assert!(mesh.tets.len() >= fewest && determinants.iter().all(|&d| d > 0.0), "{switches}: {mesh:?}");
        assert!((determinants.iter().sum::<f64>() / 6.0 - 1.0).abs() < 1e-12);
        assert_eq!(mesh.points[..8], CORNERS);
        assert!(mesh.regions.is_empty());
    }
}

#[test]
fn regions_are_numbered_with_the_switch_for_it() {
    if !has_tetgen() {
        return;
    }
    // A diagonal wall across the cube.
    let mut facets = sides();
    facets.extend([[0, 2, 6], [0, 6, 4]]);
    let mesh = tetrahedralize(&CORNERS, &facets, "pA").unwrap();
    let mut regions = mesh.regions.clone();
    regions.sort_unstable();
    regions.dedup();
    assert_eq!((mesh.regions.len(), regions.len()), (mesh.tets.len(), 2));
}

#[test]
fn input_on_which_tetgen_fails_is_an_error_not_a_crash_of_the_test() {
    if !has_tetgen() {
        return;
    }
    // Two intersecting triangles.
    let mut facets = sides();
    facets.extend([[0, 2, 6], [1, 3, 7]]);
    let error = tetrahedralize(&CORNERS, &facets, "p").unwrap_err();
    assert!(matches!(error, Error::Crashed { .. } | Error::Refused { .. }), "{error}");
    let error = tetrahedralize(&CORNERS, &[[0, 1, 8]], "p").unwrap_err();
    assert!(matches!(error, Error::Refused { .. }), "{error}");
}
