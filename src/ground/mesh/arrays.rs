//! A part as flat arrays, for programs that need all of it at once.

use super::stream::{BoundaryBlock, MeshStream, TetBlock};
use super::{GlobalId, Order};
use csg::{BodyId, PatchId};

/// One rank's part of a mesh as flat arrays.
///
/// Local indices are positions in `points`. A shared vertex is in the arrays of each of its ranks,
/// with the same global id and coordinates; each tet is on one rank. [`Sharing`](super::Sharing)
/// lists the ranks that share a vertex.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Arrays {
    /// Coordinates of the vertices.
    pub points: Vec<[f64; 3]>,
    /// Global ids of the vertices: 0 to the number of vertices of the whole mesh, without gaps.
    pub vertex_ids: Vec<GlobalId>,
    /// The order of the elements.
    pub order: Order,
    /// The corners of each tet by local index, positively oriented: (v1−v0)×(v2−v0)·(v3−v0) > 0.
    pub tets: Vec<[u32; 4]>,
    /// For second order, the nodes on the edges of each tet, in the order of
    /// [`TET_EDGES`](super::TET_EDGES); otherwise empty.
    pub tet_edge_nodes: Vec<[u32; 6]>,
    /// Global ids of the tets.
    pub tet_ids: Vec<GlobalId>,
    /// The body of each tet.
    pub tet_bodies: Vec<BodyId>,
    /// The triangles on patches by local index; the right-hand normal points from the patch's
    /// inside to its outside. A triangle between two parts is in the arrays of both.
    pub triangles: Vec<[u32; 3]>,
    /// For second order, the nodes on the edges of each triangle, in the order of
    /// [`TRIANGLE_EDGES`](super::TRIANGLE_EDGES); otherwise empty.
    pub triangle_edge_nodes: Vec<[u32; 3]>,
    /// The patch of each triangle.
    pub triangle_patches: Vec<PatchId>,
    /// The bodies of this part's tets behind and in front of each triangle.
    pub triangle_bodies: Vec<[Option<BodyId>; 2]>,
}

impl Arrays {
    /// *Local.* Copies a part: about 32 bytes per vertex and 28 bytes per tet, 52 of second order.
    pub fn of(part: &dyn MeshStream) -> Self {
        let counts = part.counts();
        let mut arrays = Self {
            order: part.order(),
            points: Vec::with_capacity(counts.vertices as usize),
            vertex_ids: Vec::with_capacity(counts.vertices as usize),
            tets: Vec::with_capacity(counts.tets as usize),
            tet_ids: Vec::with_capacity(counts.tets as usize),
            tet_bodies: Vec::with_capacity(counts.tets as usize),
            ..Self::default()
        };
        for index in 0..part.vertex_blocks() {
            arrays.points.extend_from_slice(&part.vertex_points(index));
            arrays.vertex_ids.extend(part.vertex_block(index).ids());
        }
        let mut block = TetBlock::default();
        for index in 0..part.tet_blocks() {
            part.tet_block(index, &mut block);
            arrays.tets.extend_from_slice(&block.tets);
            arrays.tet_edge_nodes.extend_from_slice(&block.edge_nodes);
            arrays.tet_ids.extend(block.first_id..block.first_id + block.tets.len() as u64);
            arrays.tet_bodies.resize(arrays.tets.len(), block.body.expect("a tet block has a body"));
        }
        let mut block = BoundaryBlock::default();
        for index in 0..part.boundary_blocks() {
            part.boundary_block(index, &mut block);
            arrays.triangles.extend_from_slice(&block.triangles);
            arrays.triangle_edge_nodes.extend_from_slice(&block.edge_nodes);
            let count = arrays.triangles.len();
            arrays.triangle_patches.resize(count, block.patch.expect("a boundary block has a patch"));
            arrays.triangle_bodies.resize(count, block.bodies);
        }
        arrays
    }

    /// The corners of a tet.
    pub fn corners(&self, tet: usize) -> [[f64; 3]; 4] {
        self.tets[tet].map(|vertex| self.points[vertex as usize])
    }
}
