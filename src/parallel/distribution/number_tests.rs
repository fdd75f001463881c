use super::super::distribute;
use super::*;
use crate::ground::comm::thread;
use crate::ground::mesh::fixtures::{lattice_box, lattice_cube};
use crate::ground::mesh::{BoundaryTriangle, Mesh};
use csg::{BodyId, PatchId};

/// Distributes, drops edges and faces, reconstructs them, and returns both parts of each rank.
fn dropped_and_reconstructed(mesh: &Mesh, part: &[Rank], ranks: u32) -> Vec<[DistMesh; 2]> {
    thread::run(ranks, |comm| {
        let given = (comm.rank() == 0).then(|| (mesh.clone(), part.to_vec()));
        let known = distribute(comm, given).unwrap();
        let settled = number_shared(comm, known.clone().into()).unwrap();
        settled.check(comm).unwrap();
        [known, settled]
    })
    .unwrap()
}

fn expect_same(mesh: &Mesh, part: &[Rank], ranks: u32) {
    for [known, settled] in dropped_and_reconstructed(mesh, part, ranks) {
        let rank = known.rank;
        assert_eq!(settled.totals, known.totals, "rank {rank}");
        assert_eq!(settled.edge_ids, known.edge_ids, "rank {rank}");
        assert_eq!(settled.edge_classes, known.edge_classes, "rank {rank}");
        assert_eq!(settled.face_ids, known.face_ids, "rank {rank}");
        assert_eq!(settled.face_classes, known.face_classes, "rank {rank}");
        assert_eq!(settled.boundary, known.boundary, "rank {rank}");
        assert_eq!(settled.shared_edges, known.shared_edges, "rank {rank}");
        assert_eq!(settled.shared_faces, known.shared_faces, "rank {rank}");
    }
}

#[test]
fn edges_and_faces_get_the_ids_classes_and_holders_that_rank_0_would_have_given() {
    let mesh = lattice_box([4, 2, 2], |[x, _, _]| u32::from(x >= 2));
    let tets = mesh.tets.len() as u32;
    for ranks in [1, 2, 3, 7, 16] {
        let slabs: Vec<Rank> = (0..tets).map(|tet| tet * ranks / tets).collect();
        expect_same(&mesh, &slabs, ranks);
        let scattered: Vec<Rank> = (0..tets).map(|tet| tet * 7 % ranks).collect();
        expect_same(&mesh, &scattered, ranks);
    }
    // One rank has all tets, the others none.
    expect_same(&lattice_cube(2), &[3; 48], 5);
}

/// Three tets that have vertices a and b, each on another rank; only the middle one has the edge
/// between them (figure 4.8 of the thesis).
///
/// ```text
///          c          rank 0: a tet at a and one at b
///        / | \        rank 1: the tet with the edge a b
///       a--+--b       rank 2: as rank 0, on the other side
/// ```
#[test]
fn of_three_ranks_with_both_ends_only_the_one_with_the_edge_is_its_holder() {
    // Vertices: a, b, then the two others of the tet with the edge, then three for each of the
    // other four tets.
    let mut points = vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.5, 1.0, 0.0], [0.5, 0.5, 1.0]];
    let mut tets = vec![[0, 1, 2, 3]];
    let mut part = vec![1];
    for (rank, end, away) in [(0, 0, -1.0), (0, 1, 1.0), (2, 0, -3.0), (2, 1, 3.0)] {
        let first = points.len() as u32;
        let [x, _, _] = points[end as usize];
        points.extend([[x + away, -1.0, -1.0], [x + away, -1.0, -2.0], [x + away, -2.0, -1.0]]);
        let tet = [end, first, first + 1, first + 2];
        tets.push(if away < 0.0 { tet } else { [end, first, first + 2, first + 1] });
        part.push(rank);
    }
    let mut mesh = Mesh {
        points: points.into_iter().map(Point::from).collect(),
        tets: tets.into_iter().map(|tet: [u32; 4]| tet.map(VertexId)).collect(),
        bodies: vec![BodyId(0); part.len()],
        ..Mesh::default()
    };
    for (tet, face) in mesh.tets.iter().flat_map(|tet| crate::ground::mesh::TET_FACES.map(|face| (tet, face)))
    {
        mesh.triangles.push(BoundaryTriangle { vertices: face.map(|k| tet[k]), patch: PatchId(0) });
    }
    mesh.classes = vec![Class::Patch(PatchId(0)); mesh.points.len()];
    expect_same(&mesh, &part, 3);
    let parts = dropped_and_reconstructed(&mesh, &part, 3);
    for [_, settled] in &parts {
        assert_eq!(settled.vertex_holders(VertexId(0)), [0, 1, 2]);
        assert_eq!(settled.vertex_holders(VertexId(1)), [0, 1, 2]);
        let edge = settled.edges.iter().position(|ends| *ends == [VertexId(0), VertexId(1)]);
        assert_eq!(edge.is_some(), settled.rank == 1, "rank {}", settled.rank);
        assert!(settled.shared_edges.is_empty());
    }
}

#[test]
fn a_face_of_three_ranks_is_refused_on_all() {
    let errors = thread::run(3, |comm| {
        let rank = comm.rank();
        let bare = BareMesh {
            rank,
            ranks: 3,
            totals: crate::ground::mesh::stream::Counts { vertices: 6, tets: 3, boundary: 0 },
            points: vec![[0.0; 3]; 4],
            vertex_ids: vec![0, 1, 2, 3 + u64::from(rank)],
            vertex_classes: vec![Class::Body(BodyId(0)); 4],
            shared: Shared { ids: vec![0, 1, 2], offsets: vec![0, 3, 6, 9], holders: [0, 1, 2].repeat(3) },
            tets: vec![[0, 1, 2, 3].map(VertexId)],
            tet_ids: vec![u64::from(rank)],
            tet_bodies: vec![BodyId(0)],
            ..BareMesh::default()
        };
        number_shared(comm, bare).unwrap_err()
    })
    .unwrap();
    assert_eq!(errors[0], NumberError::FaceOfManyRanks { vertices: [0, 1, 2], holders: 3 });
    assert_eq!(
        errors[2],
        NumberError::Comm(CommError::Elsewhere {
            rank: 0,
            kind: errors[0].kind(),
            message: errors[0].to_string()
        })
    );
}
