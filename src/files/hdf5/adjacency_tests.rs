//! The adjacency in the file, compared with sets and with itself. That h5py reads it is tested with
//! the program.

use super::tests::Found;
use super::{CONNECTIVITY, ELEMENT_IDS, NODE_IDS, Settings};
use crate::files::plain::PlainPart;
use crate::files::testing::{cube, names, scattered, slabs};
use crate::ground::mesh::{Mesh, Rank};
use std::collections::{BTreeMap, BTreeSet};

const EDGES: [[usize; 2]; 6] = [[0, 1], [1, 2], [0, 2], [0, 3], [1, 3], [2, 3]];

/// The tables of a file, by row.
struct Tables(Found);

impl Tables {
    fn of(mesh: &Mesh, tet_to_rank: &[Rank], ranks: u32) -> Self {
        let dir = tempfile::tempdir().unwrap();
        let part = |rank| PlainPart::part(mesh, tet_to_rank, ranks, rank);
        let settings = Settings { adjacency: true };
        Self(Found::written(|comm| part(comm.rank()), &names(), ranks, settings, dir.path()))
    }

    fn table<const N: usize>(&self, name: &str) -> Vec<[i64; N]> {
        let values = self.0.longs(&format!("/adjacency/{name}"));
        values.chunks_exact(N).map(|row| row.try_into().unwrap()).collect()
    }

    fn tets(&self) -> Vec<[i64; 4]> {
        self.0.longs(CONNECTIVITY).chunks_exact(4).map(|tet| tet.try_into().unwrap()).collect()
    }

    fn lists(&self, name: &str) -> Vec<Vec<i64>> {
        let values = self.0.longs(&format!("/adjacency/{name}"));
        let offsets = self.0.longs(&format!("/adjacency/{name}_offsets"));
        assert_eq!((offsets[0], *offsets.last().unwrap()), (0, values.len() as i64));
        offsets.windows(2).map(|ends| values[ends[0] as usize..ends[1] as usize].to_vec()).collect()
    }
}

fn sorted<const N: usize>(mut vertices: [i64; N]) -> [i64; N] {
    vertices.sort_unstable();
    vertices
}

/// The transpose of downward rows: for each of `count` entities the rows that have it, ascending.
fn transposed<const N: usize>(rows: &[[i64; N]], count: usize) -> Vec<Vec<i64>> {
    let mut lists = vec![Vec::new(); count];
    for (row, entities) in (0..).zip(rows) {
        entities.iter().for_each(|&entity| lists[entity as usize].push(row));
    }
    lists
}

fn cases(mesh: &Mesh) -> [(u32, Vec<Rank>); 5] {
    [
        (1, slabs(mesh, 1)),
        (2, slabs(mesh, 2)),
        (3, scattered(mesh, 3)),
        (7, scattered(mesh, 7)),
        // Four ranks have no tets.
        (7, slabs(mesh, 3)),
    ]
}

#[test]
fn tables_have_each_edge_and_face_once_and_the_right_ones_of_each_tet() {
    let mesh = cube(4);
    for (ranks, tet_to_rank) in cases(&mesh) {
        let tables = Tables::of(&mesh, &tet_to_rank, ranks);
        let (edges, faces) = (tables.table::<2>("edges"), tables.table::<3>("faces"));
        let [tet_edges, tet_faces] =
            [tables.table::<6>("tet_edges").len(), tables.table::<4>("tet_faces").len()];
        assert_eq!([tet_edges, tet_faces], [384; 2]);
        // A ball has the Euler characteristic 1.
        assert_eq!(125 - edges.len() as i64 + faces.len() as i64 - 384, 1, "{ranks} ranks");
        assert!(edges.is_sorted_by(|a, b| a < b) && edges.iter().all(|edge| edge.is_sorted()));
        assert!(faces.is_sorted_by(|a, b| a < b) && faces.iter().all(|face| face.is_sorted()));
        let of_tets = tables.table::<6>("tet_edges").into_iter().zip(tables.table::<4>("tet_faces"));
        for (tet, (of_edges, of_faces)) in tables.tets().iter().zip(of_tets) {
            for (ends, edge) in EDGES.iter().zip(of_edges) {
                assert_eq!(edges[edge as usize], sorted(ends.map(|end| tet[end])));
            }
            for (opposite, face) in of_faces.into_iter().enumerate() {
                let mut vertices = tet.to_vec();
                vertices.remove(opposite);
                vertices.sort_unstable();
                assert_eq!(faces[face as usize].to_vec(), vertices);
            }
        }
        for (face, of_edges) in faces.iter().zip(tables.table::<3>("face_edges")) {
            for (ends, edge) in EDGES.iter().zip(of_edges) {
                assert_eq!(edges[edge as usize], ends.map(|end| face[end]));
            }
        }
    }
}

#[test]
fn upward_lists_are_the_transposes_of_downward_tables() {
    let mesh = cube(4);
    for (ranks, tet_to_rank) in cases(&mesh) {
        let tables = Tables::of(&mesh, &tet_to_rank, ranks);
        let (edges, faces) = (tables.table::<2>("edges"), tables.table::<3>("faces"));
        let of_tets = transposed(&tables.table::<4>("tet_faces"), faces.len());
        let two = |tets: Vec<i64>| [tets[0], tets.get(1).copied().unwrap_or(-1)];
        assert_eq!(tables.table::<2>("face_tets"), of_tets.into_iter().map(two).collect::<Vec<_>>());
        let of_faces = transposed(&tables.table::<3>("face_edges"), edges.len());
        assert_eq!(tables.lists("edge_faces"), of_faces);
        let of_tets = transposed(&tables.table::<6>("tet_edges"), edges.len());
        assert_eq!(tables.lists("edge_tets"), of_tets);
        assert_eq!(tables.lists("vertex_edges"), transposed(&edges, 125));
        assert_eq!(tables.lists("vertex_tets"), transposed(&tables.tets(), 125), "{ranks} ranks");
    }
}

/// The tets of each face, all by their ids in the whole mesh.
fn by_ids(tables: &Tables) -> BTreeMap<[i64; 3], BTreeSet<i64>> {
    let (nodes, tets) = (tables.0.longs(NODE_IDS), tables.0.longs(ELEMENT_IDS));
    let ids = |face: [i64; 3]| sorted(face.map(|vertex| nodes[vertex as usize]));
    let of_face = |sides: [i64; 2]| {
        sides.iter().filter(|tet| **tet >= 0).map(|tet| tets[*tet as usize]).collect::<BTreeSet<_>>()
    };
    tables
        .table::<3>("faces")
        .into_iter()
        .map(ids)
        .zip(tables.table::<2>("face_tets").into_iter().map(of_face))
        .collect()
}

#[test]
fn any_number_of_ranks_write_the_same_adjacency_by_global_ids() {
    let mesh = cube(4);
    let alone = by_ids(&Tables::of(&mesh, &slabs(&mesh, 1), 1));
    for (ranks, tet_to_rank) in cases(&mesh) {
        assert_eq!(by_ids(&Tables::of(&mesh, &tet_to_rank, ranks)), alone, "{ranks} ranks");
    }
}
