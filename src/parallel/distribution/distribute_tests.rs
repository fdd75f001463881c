use super::*;
use crate::ground::comm::thread;
use crate::ground::mesh::fixtures::{lattice_box, lattice_cube};
use crate::ground::mesh::{BoundaryTriangle, Class, Segment};
use crate::parallel::distribution::CheckError;
use crate::parallel::partition::{self, Method, Settings};
use csg::{BodyId, CurveId, PatchId};
use proptest::collection::vec;
use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use std::collections::BTreeMap;

/// Distributes over threads and checks.
fn parts(mesh: &Mesh, part: &[Rank], ranks: u32) -> Vec<DistMesh> {
    thread::run(ranks, |comm| {
        let given = (comm.rank() == 0).then(|| (mesh.clone(), part.to_vec()));
        let part = distribute(comm, given).unwrap();
        part.check(comm).unwrap();
        part
    })
    .unwrap()
}

fn error(change: impl Fn(&mut Mesh, &mut Vec<Rank>)) -> DistError {
    let mut mesh = lattice_box([2, 1, 1], |_| 0);
    let mut part = vec![0, 0, 0, 0, 0, 0, 1, 1, 1, 1, 1, 1];
    change(&mut mesh, &mut part);
    let errors = thread::run(2, |comm| {
        distribute(comm, (comm.rank() == 0).then(|| (mesh.clone(), part.clone()))).unwrap_err()
    });
    let [here, there]: [DistError; 2] = errors.unwrap().try_into().unwrap();
    assert_eq!(
        there,
        DistError::Comm(CommError::Elsewhere { rank: 0, kind: here.kind(), message: here.to_string() })
    );
    here
}

fn two_bodies(n: usize) -> Mesh {
    lattice_box([2 * n, n, n], |[x, _, _]| u32::from(x >= n))
}

#[test]
fn ranks_agree_on_cubes_and_on_boxes_of_several_bodies() {
    let four_bodies = lattice_box([4, 4, 3], |[x, y, _]| (x / 2 + 2 * (y / 2)) as u32);
    for mesh in [lattice_cube(4), two_bodies(3), four_bodies] {
        for ranks in [1, 2, 3, 4, 7, 16] {
            let (part, metrics) = partition::partition(&mesh, ranks, &Settings::default()).unwrap();
            let parts = parts(&mesh, &part, ranks);
            let cut: usize = parts.iter().map(|part| part.shared_faces.len()).sum();
            assert_eq!(cut, 2 * metrics.edge_cut);
            let tets: Vec<_> = parts.iter().map(|part| part.tets.len()).collect();
            assert_eq!(tets.iter().max(), Some(&metrics.largest));
        }
    }
}

#[test]
fn a_part_for_every_tet_and_scattered_parts_are_distributed_too() {
    let mesh = two_bodies(2);
    let tets = mesh.tets.len() as u32;
    let one_each: Vec<Rank> = (0..tets).collect();
    assert!(parts(&mesh, &one_each, tets).iter().all(|part| part.tets.len() == 1));
    // Neighbours in the list on different ranks, most of the mesh shared, and a rank without tets.
    let scattered: Vec<Rank> = (0..tets).map(|tet| tet * 7 % 5).collect();
    assert!(parts(&mesh, &scattered, 6)[5].tets.is_empty());
}

#[test]
fn each_entity_has_the_same_id_class_and_vertices_for_every_number_of_ranks() {
    let mesh = two_bodies(3);
    let entities = |ranks: u32| {
        let settings = Settings { method: Method::Bisection, ..Settings::default() };
        let (part, _) = partition::partition(&mesh, ranks, &settings).unwrap();
        let mut edges = BTreeMap::new();
        let mut faces = BTreeMap::new();
        let mut tets = BTreeMap::new();
        for part in parts(&mesh, &part, ranks) {
            let global = |v: VertexId| part.vertex_ids[v.index()];
            for (i, id) in part.edge_ids.iter().enumerate() {
                let entry = (part.edges[i].map(global), part.edge_classes[i]);
                assert!(edges.insert(*id, entry).is_none_or(|other| other == entry));
            }
            for (i, id) in part.face_ids.iter().enumerate() {
                let entry = (part.faces[i].map(global), part.face_classes[i]);
                assert!(faces.insert(*id, entry).is_none_or(|other| other == entry));
            }
            for (i, id) in part.tet_ids.iter().enumerate() {
                tets.insert(*id, (part.tets[i].map(global), part.tet_bodies[i]));
            }
        }
        (edges, faces, tets)
    };
    let whole = entities(1);
    assert_eq!(whole.2.len(), mesh.tets.len());
    assert!(mesh.tets.iter().zip(whole.2.values()).all(|(a, (b, _))| a.map(|v| u64::from(v.0)) == *b));
    for ranks in [2, 3, 7] {
        assert_eq!(entities(ranks), whole);
    }
}

#[test]
fn boundary_triangles_keep_their_direction_and_interfaces_their_sides() {
    let mesh = two_bodies(2);
    // The parts are the bodies: the interface is between the ranks.
    let part: Vec<Rank> = mesh.bodies.iter().map(|body| body.0).collect();
    let parts = parts(&mesh, &part, 2);
    let expected: BTreeMap<[u32; 3], BoundaryTriangle> = mesh
        .triangles
        .iter()
        .map(|t| {
            let mut key = t.vertices.map(|v| v.0);
            key.sort_unstable();
            (key, *t)
        })
        .collect();
    let mut interfaces = [0, 0];
    for part in &parts {
        for triangle in &part.boundary {
            let vertices = part.boundary_vertices(triangle).map(|v| part.vertex_ids[v.index()] as u32);
            let mut key = vertices;
            key.sort_unstable();
            let BoundaryTriangle { vertices: [a, b, c], patch } = expected[&key];
            assert!([[a, b, c], [b, c, a], [c, a, b]].contains(&vertices.map(VertexId)));
            assert_eq!(triangle.patch, patch);
            if part.shared_faces.holders_of(triangle.face.0).is_some() {
                interfaces[part.rank as usize] += 1;
                assert_eq!(triangle.parents.map(|p| p.is_some()), [part.rank == 0, part.rank == 1]);
            }
        }
    }
    assert_eq!(interfaces, [8, 8]);
}

/// Three tets around the edge 0 1, which is a curve between the patches 0 (at vertex 2) and 1 (at
/// vertex 5).
///
/// ```text
///   5---4        The middle tet has the edge, but no triangle at it.
///    \ / \
///    01---3
///      \ /
///       2
/// ```
fn fan() -> Mesh {
    let at = |x, y, z| crate::Point::new(x, y, z);
    let v = VertexId;
    let mut mesh = Mesh {
        points: vec![
            at(0., 0., 0.),
            at(0., 0., 1.),
            at(1., -1., 0.),
            at(1., 0., 0.),
            at(0., 1., 0.),
            at(-1., 1., 0.),
        ],
        tets: [[2, 3], [3, 4], [4, 5]].map(|[a, b]| [v(0), v(a), v(b), v(1)]).to_vec(),
        bodies: vec![BodyId(0); 3],
        ..Mesh::default()
    };
    let triangle =
        |vertices: [u32; 3], patch| BoundaryTriangle { vertices: vertices.map(v), patch: PatchId(patch) };
    mesh.triangles = vec![triangle([0, 2, 1], 0), triangle([0, 1, 5], 1)];
    for a in 2..5 {
        mesh.triangles.extend([triangle([0, a + 1, a], 2), triangle([1, a, a + 1], 2)]);
    }
    let ends = [[0, 1], [0, 2], [1, 2], [0, 5], [1, 5]];
    mesh.segments =
        (0..).map(CurveId).zip(ends).map(|(curve, e)| Segment { vertices: e.map(v), curve }).collect();
    mesh.classes = vec![Class::Patch(PatchId(2)); 6];
    for corner in [0, 1, 2, 5] {
        mesh.classes[corner as usize] = Class::Corner(csg::CornerId(corner));
    }
    mesh
}

#[test]
fn an_edge_on_a_curve_is_known_also_where_the_triangles_beside_it_are_elsewhere() {
    let mesh = fan();
    assert!(mesh.tets.iter().all(|tet| {
        let [a, b, c, d] = tet.map(|v| mesh.points[v.index()]);
        (b - a).cross(&(c - a)).dot(&(d - a)) > 0.0
    }));
    let middle = &parts(&mesh, &[0, 1, 2], 3)[1];
    let edge = middle.edges[0].map(|v| middle.vertex_ids[v.index()]);
    assert_eq!((edge, middle.edge_classes[0]), ([0, 1], Class::Curve(CurveId(0))));
    assert_eq!(middle.edge_holders(crate::ground::mesh::EdgeId(0)), [0, 1, 2]);
    assert!(middle.boundary.iter().all(|triangle| triangle.patch == PatchId(2)));
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 64, rng_seed: RngSeed::Fixed(1), ..ProptestConfig::default() })]
    #[test]
    fn any_partition_whatever_is_distributed_so_that_all_agree(part in vec(0..5u32, 96)) {
        let sizes: Vec<usize> = parts(&two_bodies(2), &part, 5).iter().map(|part| part.tets.len()).collect();
        prop_assert_eq!(sizes, (0..5).map(|rank| part.iter().filter(|&&p| p == rank).count()).collect::<Vec<_>>());
    }
}

#[test]
fn a_serial_mesh_is_the_part_of_a_single_rank() {
    let mesh = lattice_cube(2);
    let part = from_serial(mesh.clone()).unwrap();
    part.check(&thread::alone()).unwrap();
    assert_eq!(part.points, mesh.points);
    assert_eq!(part.tets, mesh.tets);
    assert!(part.shared_vertices.is_empty() && part.neighbours().is_empty());
}

#[test]
fn faults_are_found_on_all_ranks() {
    let mesh = two_bodies(2);
    let (part, _) = partition::partition(&mesh, 3, &Settings::default()).unwrap();
    let spoil: [fn(&mut DistMesh); 8] = [
        |part| part.points[part.shared_vertices.ids[0] as usize].x += 1e-9,
        |part| part.vertex_classes[part.shared_vertices.ids[0] as usize] = Class::Body(BodyId(9)),
        |part| part.tets[0].swap(0, 1),
        |part| part.shared_edges = Shared::default(),
        |part| _ = part.boundary.pop(),
        |part| part.boundary[0].parents.swap(0, 1),
        |part| part.edge_classes[0] = Class::Body(BodyId(9)),
        |part| part.totals.faces += 1,
    ];
    for (number, spoil) in spoil.into_iter().enumerate() {
        let results = thread::run(3, |comm| {
            let mut mine =
                distribute(comm, (comm.rank() == 0).then(|| (mesh.clone(), part.clone()))).unwrap();
            if comm.rank() == 1 {
                spoil(&mut mine);
            }
            mine.check(comm)
        });
        let results = results.unwrap();
        let found = |result: &Result<(), CheckError>| matches!(result, Err(CheckError::Faults(_)));
        assert!(results.iter().any(found), "fault {number} was not found: {results:?}");
        assert!(results.iter().all(Result::is_err), "fault {number} is not known to all: {results:?}");
    }
}

#[test]
fn bad_meshes_are_refused_with_the_place_on_all_ranks() {
    assert_eq!(error(|_, part| _ = part.pop()), DistError::PartsMismatch { tets: 12, parts: 11 });
    assert_eq!(error(|_, part| part[3] = 2), DistError::NoSuchRank { tet: 3, part: 2, ranks: 2 });
    assert_eq!(error(|mesh, _| mesh.points.push(mesh.points[0])), DistError::UnusedVertex { vertex: 12 });
    assert!(matches!(error(|mesh, _| _ = mesh.triangles.pop()), DistError::FaceOnNoPatch { .. }));
    assert!(matches!(error(|mesh, _| mesh.bodies[0] = BodyId(1)), DistError::FaceOnNoPatch { .. }));
    assert!(matches!(error(|mesh, _| _ = mesh.segments.pop()), DistError::EdgeOnTwoPatches { .. }));
    let twice = error(|mesh, _| mesh.triangles.push(mesh.triangles[0]));
    assert!(matches!(twice, DistError::TriangleTwice { .. }));
    let twice = error(|mesh, _| mesh.segments.push(mesh.segments[0]));
    assert!(matches!(twice, DistError::SegmentTwice { .. }));
    let vertices = [0, 5, 8].map(VertexId);
    let off = error(|mesh, _| mesh.triangles[3] = BoundaryTriangle { vertices, patch: PatchId(0) });
    assert_eq!(off, DistError::TriangleNotAFace { triangle: 3, vertices: [0, 5, 8] });
    let vertices = [0, 8].map(VertexId);
    let off = error(|mesh, _| mesh.segments[3] = Segment { vertices, curve: CurveId(0) });
    assert_eq!(off, DistError::SegmentNotAnEdge { segment: 3, vertices: [0, 8] });
    let overlap = error(|mesh, part| {
        mesh.tets.push(mesh.tets[0]);
        mesh.bodies.push(mesh.bodies[0]);
        part.push(0);
    });
    assert!(matches!(overlap, DistError::FaceOfThreeTets { .. }));
}

#[test]
fn no_mesh_on_rank_0_is_an_error_on_all() {
    let errors = thread::run(2, |comm| distribute(comm, None).unwrap_err().to_string()).unwrap();
    assert_eq!(errors, ["rank 0 gave no mesh to distribute", "rank 0: rank 0 gave no mesh to distribute"]);
}
