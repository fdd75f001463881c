//! The corners of a part of second order, as a stream of first order: for formats that list the
//! nodes on edges apart from the vertices.

use crate::ground::mesh::stream::{BoundaryBlock, Counts, MeshStream, TetBlock, VertexBlock};
use crate::ground::mesh::{GlobalId, Rank};
use crate::ground::progress::Work;
use std::borrow::Cow;

/// A vertex that is no corner.
const NONE: u32 = u32::MAX;

/// The tets and triangles of a part with their corners alone, numbered without gaps in the order of
/// the part. Ids and ranks are those of the part; [`totals`](MeshStream::totals) count all nodes.
pub(super) struct Corners<'a> {
    part: &'a dyn MeshStream,
    /// The local index of each corner in the part, ascending.
    locals: Vec<u32>,
    /// The corner at each local index of the part, or [`NONE`].
    corner_of: Vec<u32>,
    /// The index of the vertex block of each corner in the part.
    blocks: Vec<u32>,
    /// The coordinates of the corners whose coordinates are kept.
    points: Vec<[f64; 3]>,
}

impl<'a> Corners<'a> {
    /// *Local.* Reads all tets of the part once.
    pub fn of(part: &'a dyn MeshStream) -> Self {
        let mut corner_of = vec![NONE; part.counts().vertices as usize];
        let mut block = TetBlock::default();
        for index in 0..part.tet_blocks() {
            part.tet_block(index, &mut block);
            block.tets.iter().flatten().for_each(|&v| corner_of[v as usize] = 0);
        }
        let (mut locals, mut blocks) = (Vec::new(), Vec::new());
        for index in 0..part.vertex_blocks() {
            for local in part.vertex_block(index).local {
                if corner_of[local as usize] != NONE {
                    corner_of[local as usize] = locals.len() as u32;
                    locals.push(local);
                    blocks.push(index as u32);
                }
            }
        }
        let kept = part.points();
        let points = locals.iter().map_while(|&v| kept.get(v as usize).copied()).collect();
        Self { part, locals, corner_of, blocks, points }
    }
}

impl MeshStream for Corners<'_> {
    fn rank(&self) -> Rank {
        self.part.rank()
    }

    fn ranks(&self) -> u32 {
        self.part.ranks()
    }

    fn counts(&self) -> Counts {
        Counts { vertices: self.locals.len() as u64, ..self.part.counts() }
    }

    fn totals(&self) -> Counts {
        self.part.totals()
    }

    fn points(&self) -> &[[f64; 3]] {
        &self.points
    }

    fn vertex_blocks(&self) -> usize {
        self.locals.len()
    }

    fn vertex_block(&self, index: usize) -> VertexBlock<'_> {
        let of_part = self.part.vertex_block(self.blocks[index] as usize);
        let within = self.locals[index] - of_part.local.start;
        let local = index as u32..index as u32 + 1;
        VertexBlock { local, first_id: of_part.first_id + u64::from(within), ..of_part }
    }

    fn vertex_id(&self, local: u32) -> GlobalId {
        self.part.vertex_id(self.locals[local as usize])
    }

    fn tet_blocks(&self) -> usize {
        self.part.tet_blocks()
    }

    fn tet_block(&self, index: usize, block: &mut TetBlock) {
        self.part.tet_block(index, block);
        block.edge_nodes.clear();
        block.tets.iter_mut().flatten().for_each(|v| *v = self.corner_of[*v as usize]);
    }

    fn vertex_points(&self, index: usize) -> Cow<'_, [[f64; 3]]> {
        match self.points.get(index) {
            Some(point) => Cow::Borrowed(std::slice::from_ref(point)),
            None => {
                let block = self.blocks[index] as usize;
                let within = self.locals[index] - self.part.vertex_block(block).local.start;
                Cow::Owned(vec![self.part.vertex_points(block)[within as usize]])
            }
        }
    }

    fn boundary_blocks(&self) -> usize {
        self.part.boundary_blocks()
    }

    fn boundary_block(&self, index: usize, block: &mut BoundaryBlock) {
        self.part.boundary_block(index, block);
        block.edge_nodes.clear();
        block.triangles.iter_mut().flatten().for_each(|v| *v = self.corner_of[*v as usize]);
    }

    fn work(&self) -> &Work<'_> {
        self.part.work()
    }
}
