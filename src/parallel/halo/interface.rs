//! The shared vertices of a part, found by local index and by global id.

use crate::ground::mesh::stream::{MeshStream, VertexBlock};
use crate::ground::mesh::{GlobalId, Rank};

/// The shared vertices of a part.
pub(super) struct Interface<'a> {
    pub part: &'a dyn MeshStream,
    rank: Rank,
    /// By local index.
    is_shared: Vec<bool>,
    /// The blocks with holders, by local index.
    blocks: Vec<VertexBlock<'a>>,
    /// First ids of the blocks with their indices, ascending.
    by_id: Vec<(GlobalId, usize)>,
}

impl<'a> Interface<'a> {
    pub fn new(part: &'a dyn MeshStream) -> Self {
        let mut is_shared = vec![false; part.counts().vertices as usize];
        let blocks = (0..part.vertex_blocks()).map(|index| part.vertex_block(index));
        let blocks: Vec<VertexBlock> =
            blocks.filter(|block| !block.holders.is_empty() && !block.local.is_empty()).collect();
        for block in &blocks {
            is_shared[block.local.start as usize..block.local.end as usize].fill(true);
        }
        let mut by_id: Vec<_> = blocks.iter().map(|block| block.first_id).zip(0..).collect();
        by_id.sort_unstable();
        Self { part, rank: part.rank(), is_shared, blocks, by_id }
    }

    pub fn is_shared(&self, vertex: u32) -> bool {
        self.is_shared[vertex as usize]
    }

    /// The ranks that share a vertex, ascending: only this one if it is not shared.
    pub fn holders(&self, vertex: u32) -> &[Rank] {
        if !self.is_shared(vertex) {
            return std::slice::from_ref(&self.rank);
        }
        let after = self.blocks.partition_point(|block| block.local.start <= vertex);
        self.blocks[after - 1].holders
    }

    /// The shared vertex with this global id, if there is one.
    pub fn find(&self, id: GlobalId) -> Option<u32> {
        let after = self.by_id.partition_point(|(first, _)| *first <= id);
        let block = &self.blocks[self.by_id[after.checked_sub(1)?].1];
        block.ids().contains(&id).then(|| block.local.start + (id - block.first_id) as u32)
    }
}
