//! A part that reports the progress of its readers.

use super::ghosts::Ghosts;
use super::periodic::Link;
use super::stream::{BoundaryBlock, Counts, LocalBlock, MeshStream, SingularTags, TetBlock, VertexBlock};
use super::{GlobalId, Order, Rank};
use crate::ground::progress::Work;
use std::borrow::Cow;

/// A part that counts each block of tets read as a unit of work. Readers go through all blocks.
pub struct Watched<'a> {
    part: &'a dyn MeshStream,
    work: &'a Work<'a>,
    /// The number of blocks of tets.
    blocks: usize,
}

impl<'a> Watched<'a> {
    /// *Local.* `work` is complete when all tets have been read `passes` times.
    pub fn new(part: &'a dyn MeshStream, work: &'a Work<'a>, passes: u64) -> Self {
        work.expect(part.counts().tets);
        let blocks = part.tet_blocks();
        work.step(0.0, 1.0, passes * blocks as u64);
        Self { part, work, blocks }
    }
}

impl MeshStream for Watched<'_> {
    fn rank(&self) -> Rank {
        self.part.rank()
    }

    fn ranks(&self) -> u32 {
        self.part.ranks()
    }

    fn order(&self) -> Order {
        self.part.order()
    }

    fn counts(&self) -> Counts {
        self.part.counts()
    }

    fn totals(&self) -> Counts {
        self.part.totals()
    }

    fn points(&self) -> &[[f64; 3]] {
        self.part.points()
    }

    fn vertex_blocks(&self) -> usize {
        self.part.vertex_blocks()
    }

    fn vertex_block(&self, index: usize) -> VertexBlock<'_> {
        self.part.vertex_block(index)
    }

    fn vertex_id(&self, local: u32) -> GlobalId {
        self.part.vertex_id(local)
    }

    fn tet_blocks(&self) -> usize {
        self.part.tet_blocks()
    }

    fn tet_block(&self, index: usize, block: &mut TetBlock) {
        self.work.add_one(index, self.blocks);
        self.part.tet_block(index, block);
    }

    fn local_block(&self, index: usize, block: &mut LocalBlock) {
        self.work.add_one(index, self.blocks);
        self.part.local_block(index, block);
    }

    fn block_ids(&self, block: &LocalBlock, ids: &mut Vec<GlobalId>) {
        self.part.block_ids(block, ids);
    }

    fn block_points(&self, block: &LocalBlock, points: &mut Vec<[f64; 3]>) {
        self.part.block_points(block, points);
    }

    fn vertex_points(&self, index: usize) -> Cow<'_, [[f64; 3]]> {
        self.part.vertex_points(index)
    }

    fn boundary_blocks(&self) -> usize {
        self.part.boundary_blocks()
    }

    fn boundary_block(&self, index: usize, block: &mut BoundaryBlock) {
        self.part.boundary_block(index, block);
    }

    fn links(&self) -> &[Link] {
        self.part.links()
    }

    fn images(&self, index: usize) -> Vec<(u32, GlobalId)> {
        self.part.images(index)
    }

    fn singular(&self) -> SingularTags {
        self.part.singular()
    }

    fn masters(&self) -> Vec<(u32, GlobalId)> {
        self.part.masters()
    }

    fn ghosts(&self) -> Option<&Ghosts> {
        self.part.ghosts()
    }

    fn work(&self) -> &Work<'_> {
        self.work
    }
}
