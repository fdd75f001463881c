//! Meshes as streams: the interface of the checker, the statistics and the writers to a part.
//!
//! The tets of a refined part are computed block by block from its coarse mesh and never stored. A
//! stored part has the same interface. Blocks can be requested in any order and from several
//! threads.
//!
//! ```text
//! vertex block  = the fine vertices inside one coarse vertex, edge, face or tet: contiguous local
//!                 indices, contiguous global ids, one list of holders
//! tet block     = the children of one coarse tet: contiguous global ids, one body
//! boundary block= the children of one boundary triangle, with the fine tets beside them
//! ```
//! In a mesh of [second order](Order::Second) the vertices include the nodes on edges, and blocks
//! list these in addition to the corners of tets and triangles.

use super::ghosts::Ghosts;
use super::{GlobalId, Order, Rank};
use crate::ground::mesh::periodic::Link;
use crate::ground::progress::Work;
use csg::{BodyId, PatchId};
use std::borrow::Cow;
use std::ops::Range;

/// Counts of one part or of the whole mesh.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Vertices (copies counted, in a part), with the nodes on edges of a mesh of second order.
    pub vertices: u64,
    /// Tets.
    pub tets: u64,
    /// Triangles on patches (an interface triangle between two parts counts in both).
    pub boundary: u64,
}

/// Fine vertices inside one coarse entity.
#[derive(Clone, Debug)]
pub struct VertexBlock<'a> {
    /// Local indices.
    pub local: Range<u32>,
    /// Global id of the first; the others are consecutive.
    pub first_id: GlobalId,
    /// All ranks that share them, ascending; empty if only this rank has them.
    pub holders: &'a [Rank],
    /// Whether they are on the boundary (corner, curve or patch).
    pub on_boundary: bool,
}

/// The children of one coarse tet.
#[derive(Clone, Debug, Default)]
pub struct TetBlock {
    /// Corners by local index, positively oriented.
    pub tets: Vec<[u32; 4]>,
    /// For second order, the nodes on the edges of each tet by local index, in the order of
    /// [`TET_EDGES`](super::TET_EDGES); otherwise empty.
    pub edge_nodes: Vec<[u32; 6]>,
    /// Global id of the first; the others are consecutive.
    pub first_id: GlobalId,
    /// Index of the first in the part; the others are consecutive.
    pub first_local: u64,
    /// The body of all tets of the block.
    pub body: Option<BodyId>,
}

/// A tet block as a small mesh of its own, so that vertex data (coordinates, ids, hashes) is
/// gathered once for all tets at a vertex.
#[derive(Clone, Debug, Default)]
pub struct LocalBlock {
    /// Local indices of the vertices of the block.
    pub vertices: Vec<u32>,
    /// The tet block, but with vertices by their positions in `vertices`.
    pub tets: TetBlock,
}

/// The children of one boundary triangle.
#[derive(Clone, Debug, Default)]
pub struct BoundaryBlock {
    /// Corners by local index; right-hand normals from the patch's inside to its outside.
    pub triangles: Vec<[u32; 3]>,
    /// For second order, the nodes on the edges of each triangle by local index, in the order of
    /// [`TRIANGLE_EDGES`](super::TRIANGLE_EDGES); otherwise empty.
    pub edge_nodes: Vec<[u32; 3]>,
    /// For each triangle the fine tets of this part behind and in front of it, as indices in the
    /// part (`first_local` + position), or [`NO_TET`]. On each side either all triangles of a block
    /// have a tet or none, and these tets are in one tet block.
    pub parents: Vec<[u64; 2]>,
    /// The bodies of these tets; `None` on a side without tets.
    pub bodies: [Option<BodyId>; 2],
    /// The patch of all triangles of the block.
    pub patch: Option<PatchId>,
}

/// Marks a side without a fine tet in [`BoundaryBlock::parents`].
pub const NO_TET: u64 = u64::MAX;

/// Patches and vertices that are tagged as singular, with their factors.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct SingularTags {
    /// Patches.
    pub patches: Vec<(PatchId, i32)>,
    /// Vertices by local index.
    pub vertices: Vec<(u32, i32)>,
}

/// One rank's part of a mesh, as a stream of blocks. All functions are local.
pub trait MeshStream: Sync {
    /// This rank.
    fn rank(&self) -> Rank;
    /// The number of parts.
    fn ranks(&self) -> u32;
    /// The order of the elements.
    fn order(&self) -> Order {
        Order::First
    }
    /// Counts of this part.
    fn counts(&self) -> Counts;
    /// Counts of the whole mesh; shared vertices and triangles count once.
    fn totals(&self) -> Counts;
    /// Coordinates by local vertex index. A part that does not keep all coordinates has only those
    /// of its first vertices here, which include all on boundaries and interfaces;
    /// [`vertex_points`](Self::vertex_points) and [`block_points`](Self::block_points) return the
    /// others.
    fn points(&self) -> &[[f64; 3]];
    /// The number of vertex blocks; together they cover each local vertex once, in ascending order.
    fn vertex_blocks(&self) -> usize;
    /// One vertex block (may be empty).
    fn vertex_block(&self, index: usize) -> VertexBlock<'_>;
    /// The global id of the vertex with this local index.
    ///
    /// # Panics
    /// If there is no such vertex.
    fn vertex_id(&self, local: u32) -> GlobalId {
        let block = self.vertex_block(vertex_block_of(self, local));
        block.first_id + u64::from(local - block.local.start)
    }
    /// The number of tet blocks.
    fn tet_blocks(&self) -> usize;
    /// Fills `block` with one tet block, reusing its memory.
    fn tet_block(&self, index: usize, block: &mut TetBlock);
    /// Fills `block` with one tet block and its vertices, reusing its memory.
    fn local_block(&self, index: usize, block: &mut LocalBlock) {
        self.tet_block(index, &mut block.tets);
        block.vertices.clear();
        for tet in &mut block.tets.tets {
            let first = block.vertices.len() as u32;
            block.vertices.extend(*tet);
            *tet = [first, first + 1, first + 2, first + 3];
        }
        for nodes in &mut block.tets.edge_nodes {
            let first = block.vertices.len() as u32;
            block.vertices.extend(*nodes);
            *nodes = [0, 1, 2, 3, 4, 5].map(|k| first + k);
        }
    }
    /// Replaces `ids` by the global ids of the vertices of a block of this stream.
    fn block_ids(&self, block: &LocalBlock, ids: &mut Vec<GlobalId>) {
        ids.clear();
        ids.extend(block.vertices.iter().map(|&vertex| self.vertex_id(vertex)));
    }
    /// Replaces `points` by the coordinates of the vertices of a block of this stream; NaN for
    /// vertices that do not exist.
    fn block_points(&self, block: &LocalBlock, points: &mut Vec<[f64; 3]>) {
        let all = self.points();
        let point = |&vertex: &u32| all.get(vertex as usize).copied().unwrap_or([f64::NAN; 3]);
        points.clear();
        points.extend(block.vertices.iter().map(point));
    }
    /// The coordinates of the vertices of one vertex block.
    fn vertex_points(&self, index: usize) -> Cow<'_, [[f64; 3]]> {
        let local = self.vertex_block(index).local;
        Cow::Borrowed(&self.points()[local.start as usize..local.end as usize])
    }
    /// The number of boundary blocks.
    fn boundary_blocks(&self) -> usize;
    /// Fills `block` with one boundary block, reusing its memory.
    fn boundary_block(&self, index: usize, block: &mut BoundaryBlock);
    /// The patches that are periodic copies of others, the same on all ranks.
    fn links(&self) -> &[Link] {
        &[]
    }
    /// The vertices of this part on the periodic copy of the link at `index`, with the global ids
    /// of the vertices they are copies of; by local index, ascending within vertices, edges and
    /// faces of the coarse mesh.
    fn images(&self, _index: usize) -> Vec<(u32, GlobalId)> {
        Vec::new()
    }
    /// The singular patches (all) and vertices (of this part), for solvers.
    fn singular(&self) -> SingularTags {
        SingularTags::default()
    }
    /// All vertices of this part that are periodic copies, each once, with the global ids of their
    /// masters, which are not copies.
    fn masters(&self) -> Vec<(u32, GlobalId)> {
        Vec::new()
    }
    /// The ghosts, if the stream has any: their tets are the last tets of the stream, and their
    /// vertices, whose holders are other ranks only, the last vertices.
    fn ghosts(&self) -> Option<&Ghosts> {
        None
    }
    /// The work that reading the part belongs to: long-running readers test it for cancellation.
    fn work(&self) -> &Work<'_> {
        Work::unwatched()
    }
}

/// The index of the vertex block that contains a local index, by binary search.
///
/// # Panics
/// If there is no such vertex.
pub fn vertex_block_of<S: MeshStream + ?Sized>(stream: &S, local: u32) -> usize {
    let (mut low, mut high) = (0, stream.vertex_blocks());
    while low < high {
        let middle = low + (high - low) / 2;
        let range = stream.vertex_block(middle).local;
        if range.contains(&local) {
            return middle;
        }
        if range.end <= local {
            low = middle + 1;
        } else {
            high = middle;
        }
    }
    panic!("no vertex {local} in this part");
}

impl LocalBlock {
    /// The vertices of a tet by local index.
    pub fn tet(&self, index: usize) -> Option<[u32; 4]> {
        self.tets.tets.get(index).map(|tet| tet.map(|k| self.vertices[k as usize]))
    }
}

impl TetBlock {
    /// The nodes on the edges of a tet, if it is of second order.
    #[inline]
    pub fn edge_nodes_of(&self, tet: usize) -> &[u32] {
        self.edge_nodes.get(tet).map_or(&[], |nodes| nodes)
    }
}

impl BoundaryBlock {
    /// The nodes on the edges of a triangle, if it is of second order.
    #[inline]
    pub fn edge_nodes_of(&self, triangle: usize) -> &[u32] {
        self.edge_nodes.get(triangle).map_or(&[], |nodes| nodes)
    }
}

impl VertexBlock<'_> {
    /// The global ids of its vertices.
    pub fn ids(&self) -> Range<GlobalId> {
        self.first_id..self.first_id + u64::from(self.local.end - self.local.start)
    }

    /// The owner of the vertex with this global id: `holders[id mod holders]`. Every holder can
    /// compute it without a message, and the vertices of one block are spread evenly.
    pub fn owner(&self, id: GlobalId, rank: Rank) -> Rank {
        match self.holders.len() as u64 {
            0 => rank,
            count => self.holders[(id % count) as usize],
        }
    }
}
