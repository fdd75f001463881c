//! The adjacency of the mesh of all ranks: which edges and faces there are, which of them a tet
//! has, and the upward lists.
//!
//! Entities are numbered from 0 by their **rows** in the file. A vertex row belongs to the part
//! that owns the vertex, and an edge or face to the rank with the row of its first vertex. This
//! rank collects its edges and faces from all tets that have them, sorts them, and so numbers them
//! lexicographically by their ascending vertices. Most of them come from its own tets; the messages
//! have the size of the interfaces.
//!
//! ```text
//! tets ─► sides: (vertices, tet) ─► rank of the first vertex: sort, number ─► (number) ─► tets
//!                                        └─► rows of edges, faces; their tets
//! pairs (entity, one above it)   ─► rank of the entity: sort ─► upward list
//! ```
//! Not here: the same numbers for any number of parts. Rows of vertices and tets depend on the
//! parts too, and other numbers would send every edge and face to another rank.

mod lists;
mod sides;
mod write;

use super::Numbering;
use crate::files::node_order::VTK;
use crate::ground::comm::{CommError, Communicator};
use crate::ground::mesh::stream::{MeshStream, TetBlock};
use crate::ground::mesh::{EDGE_BETWEEN, TET_EDGES, TET_FACES};
use lists::{Lists, Rows};
use sides::{Sides, Tets};
pub(super) use write::add_to;

/// Stands for no tet; as a signed number it is -1.
const NONE: u64 = u64::MAX;

/// The columns of `tet_edges`: the edges 01 12 02 03 13 23, as VTK orders the nodes on them.
const EDGES: [[usize; 2]; 6] = {
    let mut edges = [[0; 2]; 6];
    let mut column = 0;
    while column < 6 {
        edges[column] = TET_EDGES[VTK[column]];
        column += 1;
    }
    edges
};

/// The columns of `tet_faces`: face k is opposite vertex k.
const FACES: [[usize; 3]; 4] = TET_FACES;

/// The edges of a face by its ascending vertices.
const OF_FACE: [[usize; 2]; 3] = [[0, 1], [1, 2], [0, 2]];

/// The adjacency that this rank writes.
#[derive(Debug)]
pub(super) struct Adjacency {
    vertices: Rows,
    tets: Rows,
    /// The edges and faces of this rank's rows, with their tets; those of each tet of this part.
    edges: Sides<2, 6>,
    faces: Sides<3, 4>,
    /// The edges of each face, by its ascending vertices: 01 12 02.
    face_edges: Vec<[u64; 3]>,
    edge_faces: Lists,
    vertex_edges: Lists,
    vertex_tets: Lists,
}

impl Adjacency {
    /// **Collective.** Computes the adjacency of all parts.
    pub fn of(
        comm: &dyn Communicator,
        part: &dyn MeshStream,
        numbering: &Numbering,
    ) -> Result<Self, CommError> {
        let vertices = Rows::of(comm, numbering.owned.end - numbering.owned.start)?;
        let tets = Tets { part, numbering, rows: Rows::of(comm, part.counts().tets)? };
        let faces: Sides<3, 4> = sides::number::<3, 4, 4>(comm, &tets, &vertices, &FACES)?;
        let edges: Sides<2, 6> = sides::number::<2, 3, 6>(comm, &tets, &vertices, &EDGES)?;
        let face_edges = face_edges(comm, &tets, &edges, &faces)?;
        let of_face = |(face, edges): (u64, &[u64; 3])| edges.map(|edge| [edge, face]);
        let pairs = (faces.owned.own()).zip(&face_edges).flat_map(of_face);
        let edge_faces = Lists::of(comm, &edges.owned, 3 * face_edges.len(), pairs)?;
        let pairs = edges.rows_with_numbers().flat_map(|(edge, ends)| ends.map(|vertex| [vertex, edge]));
        let vertex_edges = Lists::of(comm, &vertices, 2 * edges.rows.len(), pairs)?;
        let vertex_tets = vertex_tets(comm, &tets, &vertices)?;
        let tets = tets.rows;
        Ok(Self { vertices, tets, edges, faces, face_edges, edge_faces, vertex_edges, vertex_tets })
    }

    /// The one or two tets of each face of this rank's rows.
    ///
    /// # Panics
    /// If a face has more tets.
    fn face_tets(&self) -> impl Iterator<Item = [u64; 2]> {
        let tets = &self.faces.tets;
        self.faces.rows.iter().enumerate().map(move |(face, vertices)| match *tets.list(face) {
            [one] => [one, NONE],
            [one, two] => [one, two],
            ref more => panic!("face {vertices:?} has the tets {more:?}"),
        })
    }
}

/// **Collective.** The edges of each face of this rank's rows.
fn face_edges(
    comm: &dyn Communicator,
    tets: &Tets,
    edges: &Sides<2, 6>,
    faces: &Sides<3, 4>,
) -> Result<Vec<[u64; 3]>, CommError> {
    let first = faces.owned.own().start;
    let mut found = vec![[NONE; 3]; faces.rows.len()];
    let mut to_each: Vec<Vec<[u64; 4]>> = vec![Vec::new(); comm.size() as usize];
    tets.for_each(|index, _, vertices| {
        for (corners, &face) in FACES.iter().zip(&faces.of_tet[index]) {
            let mut ascending = *corners;
            ascending.sort_unstable_by_key(|&corner| vertices[corner]);
            let [a, b, c] =
                OF_FACE.map(|ends| edges.of_tet[index][column_between(ends.map(|end| ascending[end]))]);
            if faces.owned.own().contains(&face) {
                found[(face - first) as usize] = [a, b, c];
            } else {
                to_each[faces.owned.rank_of(face) as usize].push([face, a, b, c]);
            }
        }
    });
    for [face, a, b, c] in comm.all_to_all(to_each)?.into_iter().flatten() {
        found[(face - first) as usize] = [a, b, c];
    }
    Ok(found)
}

/// The column of `tet_edges` with the edge between two corners.
fn column_between([i, j]: [usize; 2]) -> usize {
    let edge = EDGE_BETWEEN[i][j];
    VTK.iter().position(|&of_column| of_column == edge).expect("each edge has a column")
}

/// **Collective.** The tets of each vertex of this rank's rows.
fn vertex_tets(comm: &dyn Communicator, tets: &Tets, vertices: &Rows) -> Result<Lists, CommError> {
    let mut gathered = lists::Pairs::new(comm, vertices, 4 * tets.part.counts().tets as usize);
    tets.for_each(|_, tet, corners| corners.iter().for_each(|&vertex| gathered.push([vertex, tet])));
    gathered.lists(comm)
}

impl Tets<'_> {
    /// Calls `f(index in the part, row, rows of the corners)` for each tet of the part.
    fn for_each(&self, mut f: impl FnMut(usize, u64, [u64; 4])) {
        let first = self.numbering.first_tet - 1;
        let mut block = TetBlock::default();
        for index in 0..self.part.tet_blocks() {
            self.part.tet_block(index, &mut block);
            for (place, tet) in (block.first_local..).zip(&block.tets) {
                let corners = tet.map(|vertex| self.numbering.vertex(vertex) - 1);
                f(place as usize, first + place, corners);
            }
        }
    }
}
