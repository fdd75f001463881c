use super::*;
use crate::ground::mesh::fixtures::{lattice_box, lattice_cube};
use crate::ground::mesh::{TetId, VertexId};

const METHODS: &[Method] =
    if cfg!(feature = "metis") { &[Method::Metis, Method::Bisection] } else { &[Method::Bisection] };

fn with(method: Method) -> Settings {
    Settings { method, ..Settings::default() }
}

#[test]
fn parts_are_balanced_and_repeatable() {
    let mesh = lattice_cube(8);
    for &method in METHODS {
        for parts in [1, 2, 3, 4, 7, 16, 100] {
            let (part, metrics) = partition(&mesh, parts, &with(method)).unwrap();
            assert!(metrics.imbalance < 1.1, "{method} {parts}: {metrics:?}");
            assert_eq!((metrics.method, metrics.parts), (Some(method), parts));
            assert!(metrics.pieces >= parts as usize);
            assert!(part.iter().all(|&p| p < parts));
            assert_eq!(partition(&mesh, parts, &with(method)).unwrap().0, part);
        }
    }
}

#[test]
fn a_cube_is_cut_in_half_by_coordinates() {
    let (part, metrics) = partition(&lattice_cube(4), 2, &with(Method::Bisection)).unwrap();
    // The plane x = 1/2 cuts 4 × 4 cells with two faces each.
    assert_eq!((metrics.edge_cut, metrics.pieces, metrics.smallest, metrics.largest), (32, 2, 192, 192));
    assert_eq!(part.iter().filter(|&&p| p == 0).count(), 192);
}

#[cfg(feature = "metis")]
#[test]
fn metis_cuts_less_than_coordinates() {
    let mesh = lattice_box([16, 8, 8], |_| 0);
    let cut = |method| partition(&mesh, 7, &with(method)).unwrap().1.edge_cut;
    assert!(cut(Method::Metis) < cut(Method::Bisection));
}

#[cfg(feature = "metis")]
#[test]
fn metis_may_be_called_from_many_threads() {
    let mesh = lattice_cube(4);
    let expected = partition(&mesh, 5, &Settings::default()).unwrap().0;
    let results =
        crate::ground::comm::thread::run(8, |_| partition(&mesh, 5, &Settings::default()).unwrap().0)
            .unwrap();
    assert!(results.iter().all(|part| *part == expected));
}

#[cfg(not(feature = "metis"))]
#[test]
fn without_metis_it_is_refused_and_not_the_default() {
    let mesh = lattice_cube(2);
    assert_eq!(partition(&mesh, 2, &with(Method::Metis)).unwrap_err(), PartitionError::NoMetis);
    assert_eq!(partition(&mesh, 2, &Settings::default()).unwrap().1.method, Some(Method::Bisection));
}

#[test]
fn every_part_gets_a_tet_even_where_parts_are_as_many_as_tets() {
    let mesh = lattice_cube(2);
    for &method in METHODS {
        for parts in [40, 47, 48] {
            let (_, metrics) = partition(&mesh, parts, &with(method)).unwrap();
            assert!(metrics.smallest >= 1, "{metrics:?}");
        }
    }
}

#[test]
fn more_parts_than_tets_are_refused_with_the_numbers() {
    let error = partition(&lattice_cube(1), 7, &Settings::default()).unwrap_err();
    assert_eq!(error, PartitionError::MoreParts { parts: 7, tets: 6 });
    assert!(error.to_string().contains("7 parts") && error.to_string().contains("has 6"), "{error}");
    assert_eq!(partition(&lattice_cube(1), 0, &Settings::default()).unwrap_err(), PartitionError::NoParts);
}

#[test]
fn a_face_of_three_tets_is_refused() {
    let tet = |d| [VertexId(0), VertexId(1), VertexId(2), VertexId(d)];
    let mut mesh = lattice_cube(1);
    mesh.tets = vec![tet(3), tet(4), tet(5)];
    let error = partition(&mesh, 2, &Settings::default()).unwrap_err();
    assert_eq!(error, PartitionError::NotAMesh { vertices: [0, 1, 2] });
}

#[test]
fn empty_parts_are_filled_from_the_largest() {
    let mesh = lattice_cube(2);
    let faces = matched_faces(&mesh).unwrap();
    let dual = dual::dual(&faces);
    let mut part = vec![1; 48];
    part[TetId(0).index()] = 3;
    assert_eq!(metrics::fill_empty_parts(&dual, &mut part, 5), 3);
    let measured = metrics::measure(&faces.tets, &part, 5, Some(Method::Bisection), 3);
    assert_eq!((measured.smallest, measured.largest, measured.repaired), (1, 44, 3));
}

#[test]
fn parts_of_two_bodies_that_do_not_touch_are_counted_as_pieces() {
    // Drop the middle third of a bar: two cubes, one part.
    let mut mesh = lattice_box([3, 1, 1], |_| 0);
    mesh.tets.drain(6..12);
    mesh.bodies.drain(6..12);
    assert_eq!(partition(&mesh, 1, &Settings::default()).unwrap().1.pieces, 2);
}

#[test]
fn both_tets_of_an_interface_are_in_one_part() {
    let mesh = lattice_box([6, 6, 6], |[x, y, _]| u32::from(x + y > 5));
    for &method in METHODS {
        for parts in [2, 4, 7] {
            let (part, metrics) = partition(&mesh, parts, &with(method)).unwrap();
            assert_eq!(metrics.cut_interfaces, 0, "{method} in {parts}");
            assert!(metrics.imbalance < 1.1, "{method} in {parts}: {}", metrics.imbalance);
            let faces = topology::faces(mesh.points.len(), &mesh.tets);
            let sides = topology::face_tets(faces.faces.len(), &faces.tet_faces).unwrap();
            let between = sides
                .iter()
                .filter(|[a, b]| *b != u32::MAX && mesh.bodies[*a as usize] != mesh.bodies[*b as usize]);
            assert!(between.clone().count() > 50);
            assert!(between.into_iter().all(|[a, b]| part[*a as usize] == part[*b as usize]));
        }
    }
}

#[test]
fn bodies_one_tet_thick_do_not_become_one_part() {
    let mesh = lattice_box([12, 12, 3], |[_, _, z]| z as u32);
    let (_, metrics) = partition(&mesh, 8, &Settings::default()).unwrap();
    assert!(metrics.imbalance < 1.15, "{}", metrics.imbalance);
}

/// A bar of cubes along x, of which the first half has tets of weight 9.
#[test]
fn parts_have_equal_weight_instead_of_equal_numbers() {
    let mesh = lattice_cube(6);
    let is_heavy =
        |tet: &[VertexId; 4]| tet.iter().map(|v| mesh.points[v.index()].x).sum::<f64>() / 4.0 < 0.5;
    let weights: Vec<f64> = mesh.tets.iter().map(|tet| if is_heavy(tet) { 9.0 } else { 1.0 }).collect();
    let (part, metrics) =
        partition_weighted(&mesh, 4, &Ties::default(), Some(&weights), &Settings::default()).unwrap();
    assert_eq!(metrics.imbalance, metrics::imbalance(&part, 4, &weights));
    if cfg!(feature = "metis") {
        assert!(metrics.imbalance < 1.05, "{metrics:?}");
        assert!(metrics.largest > 2 * metrics.smallest, "{metrics:?}");
    }
}
