//! The group `/adjacency` of the file.

use super::lists::{Lists, Rows};
use super::{Adjacency, NONE};
use crate::files::WriteError;
use crate::files::hdf5::fill::Datasets;
use crate::files::hdf5::tree::{Kind, Tree};
use crate::files::lines::FLUSH_AT;
use bytemuck::cast_slice;

/// Paths of tables.
const EDGES: &str = "/adjacency/edges";
const FACES: &str = "/adjacency/faces";
const TET_EDGES: &str = "/adjacency/tet_edges";
const TET_FACES: &str = "/adjacency/tet_faces";
const FACE_EDGES: &str = "/adjacency/face_edges";
const FACE_TETS: &str = "/adjacency/face_tets";

/// Paths of lists of values, one after the other; [`offsets`] has where each begins.
const EDGE_FACES: &str = "/adjacency/edge_faces";
const EDGE_TETS: &str = "/adjacency/edge_tets";
const VERTEX_EDGES: &str = "/adjacency/vertex_edges";
const VERTEX_TETS: &str = "/adjacency/vertex_tets";

/// The path of the places where lists begin.
fn offsets(path: &str) -> String {
    format!("{path}_offsets")
}

/// Adds the datasets of the adjacency.
pub(in crate::files::hdf5) fn add_to(tree: &mut Tree, adjacency: &Adjacency) {
    let [edges, faces] = [&adjacency.edges.owned, &adjacency.faces.owned].map(Rows::total);
    let tets = adjacency.tets.total();
    for (path, shape) in [
        (EDGES, [edges, 2]),
        (FACES, [faces, 3]),
        (TET_EDGES, [tets, 6]),
        (TET_FACES, [tets, 4]),
        (FACE_EDGES, [faces, 3]),
        (FACE_TETS, [faces, 2]),
    ] {
        tree.add(path, Kind::I64, &shape);
    }
    for (path, rows, lists) in adjacency.lists() {
        tree.add(&offsets(path), Kind::I64, &[rows.total() + 1]);
        tree.add(path, Kind::I64, &[lists.total]);
    }
}

impl Adjacency {
    /// The upward lists, with their paths and the rows of the entities that have them.
    fn lists(&self) -> [(&'static str, &Rows, &Lists); 4] {
        [
            (EDGE_FACES, &self.edges.owned, &self.edge_faces),
            (EDGE_TETS, &self.edges.owned, &self.edges.tets),
            (VERTEX_EDGES, &self.vertices, &self.vertex_edges),
            (VERTEX_TETS, &self.vertices, &self.vertex_tets),
        ]
    }

    /// Writes this rank's share; the last rank also writes the ends of the lists.
    pub fn fill(&self, file: &Datasets, is_last: bool) -> Result<(), WriteError> {
        let [edge, face, tet] =
            [&self.edges.owned, &self.faces.owned, &self.tets].map(|rows| rows.own().start);
        table(file, EDGES, edge, &self.edges.rows)?;
        table(file, FACES, face, &self.faces.rows)?;
        table(file, TET_EDGES, tet, &self.edges.of_tet)?;
        table(file, TET_FACES, tet, &self.faces.of_tet)?;
        table(file, FACE_EDGES, face, &self.face_edges)?;
        let mut output = file.at(FACE_TETS, 2 * face)?;
        let mut bytes = Vec::new();
        for tets in self.face_tets() {
            bytes.extend_from_slice(cast_slice(&tets));
            output.flush_past(FLUSH_AT, &mut bytes)?;
        }
        output.flush_past(0, &mut bytes)?;
        for (path, rows, lists) in self.lists() {
            file.at(&offsets(path), rows.own().start)?.write(cast_slice(&lists.begins))?;
            if is_last {
                file.at(&offsets(path), rows.total())?.write(&lists.total.to_ne_bytes())?;
            }
            file.at(path, lists.first())?.write(cast_slice(&lists.values))?;
        }
        Ok(())
    }
}

/// Writes rows of a table.
fn table<const N: usize>(
    file: &Datasets,
    path: &str,
    first: u64,
    rows: &[[u64; N]],
) -> Result<(), WriteError> {
    debug_assert!(rows.iter().all(|row| !row.contains(&NONE)), "{path} has gaps");
    file.at(path, N as u64 * first)?.write(cast_slice(rows.as_flattened()))
}
