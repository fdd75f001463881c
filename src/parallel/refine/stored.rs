//! A refined part with stored tets, for consumers that read them repeatedly.

use super::{RefineError, RefinedMesh};
use crate::ground::mesh::periodic::Link;
use crate::ground::mesh::stream::{
    BoundaryBlock, Counts, LocalBlock, MeshStream, SingularTags, TetBlock, VertexBlock,
};
use crate::ground::mesh::{GlobalId, Order, Rank};
use rayon::prelude::*;
use std::borrow::Cow;

/// A [`RefinedMesh`] and its tets: 16 bytes per tet in addition to 4 to 5 for the coordinates.
#[derive(Clone)]
pub struct StoredMesh {
    refined: RefinedMesh,
    tets: Box<[[u32; 4]]>,
}

impl RefinedMesh {
    /// *Local.* Stores the tets of this part.
    ///
    /// # Errors
    /// [`RefineError::TooManyTets`] if local tet ids exceed `u32`, [`RefineError::OutOfMemory`].
    pub fn materialize(self) -> Result<StoredMesh, RefineError> {
        let (rank, needed) = (self.rank(), self.tets());
        let count = u32::try_from(needed).map_err(|_| RefineError::TooManyTets { rank, needed })? as usize;
        let mut tets: Box<[[u32; 4]]> = bytemuck::allocation::try_zeroed_slice_box(count)
            .map_err(|()| RefineError::OutOfMemory { rank, bytes: 16 * needed })?;
        let children = self.pieces().pow(3) as usize;
        let fill = |block: &mut TetBlock, (index, out): (usize, &mut [[u32; 4]])| {
            self.tet_block(index, block);
            out.copy_from_slice(&block.tets);
        };
        tets.par_chunks_mut(children).enumerate().for_each_init(TetBlock::default, fill);
        Ok(StoredMesh { refined: self, tets })
    }
}

impl StoredMesh {
    /// The tets by local vertex index, positively oriented; [`MeshStream::tet_block`] has their
    /// global ids.
    pub fn tets(&self) -> &[[u32; 4]] {
        &self.tets
    }

    /// The refined mesh without its stored tets.
    pub fn refined(&self) -> &RefinedMesh {
        &self.refined
    }
}

impl MeshStream for StoredMesh {
    fn rank(&self) -> Rank {
        self.refined.rank()
    }
    fn ranks(&self) -> u32 {
        self.refined.ranks()
    }
    fn order(&self) -> Order {
        self.refined.order()
    }
    fn counts(&self) -> Counts {
        self.refined.counts()
    }
    fn totals(&self) -> Counts {
        self.refined.totals()
    }
    fn points(&self) -> &[[f64; 3]] {
        self.refined.points()
    }
    fn vertex_blocks(&self) -> usize {
        self.refined.vertex_blocks()
    }
    fn vertex_block(&self, index: usize) -> VertexBlock<'_> {
        self.refined.vertex_block(index)
    }
    fn vertex_id(&self, local: u32) -> GlobalId {
        self.refined.vertex_id(local)
    }
    fn tet_blocks(&self) -> usize {
        self.refined.tet_blocks()
    }
    fn tet_block(&self, index: usize, block: &mut TetBlock) {
        let children = self.refined.pieces().pow(3) as usize;
        let coarse = self.refined.coarse();
        block.tets.clear();
        block.tets.extend_from_slice(&self.tets[index * children..][..children]);
        block.first_local = (index * children) as u64;
        block.first_id = coarse.tet_ids[index] * children as u64;
        block.body = Some(coarse.tet_bodies[index]);
    }
    fn local_block(&self, index: usize, block: &mut LocalBlock) {
        self.refined.local_block(index, block);
    }
    fn block_ids(&self, block: &LocalBlock, ids: &mut Vec<GlobalId>) {
        self.refined.block_ids(block, ids);
    }
    fn block_points(&self, block: &LocalBlock, points: &mut Vec<[f64; 3]>) {
        self.refined.block_points(block, points);
    }
    fn vertex_points(&self, index: usize) -> Cow<'_, [[f64; 3]]> {
        self.refined.vertex_points(index)
    }
    fn boundary_blocks(&self) -> usize {
        self.refined.boundary_blocks()
    }
    fn boundary_block(&self, index: usize, block: &mut BoundaryBlock) {
        self.refined.boundary_block(index, block);
    }
    fn links(&self) -> &[Link] {
        self.refined.links()
    }
    fn images(&self, index: usize) -> Vec<(u32, GlobalId)> {
        self.refined.images(index)
    }
    fn singular(&self) -> SingularTags {
        self.refined.singular()
    }
    fn masters(&self) -> Vec<(u32, GlobalId)> {
        self.refined.masters()
    }
}
