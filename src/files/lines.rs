//! Writes the entities of a part as lines of text; shared by all text formats.

use super::chunks::{items, split, write_chunks};
use super::once::LeftOut;
use super::output::Output;
use super::text::Line;
use super::{WriteError, body_number, patch_number};
use crate::ground::mesh::Names;
use crate::ground::mesh::stream::{BoundaryBlock, MeshStream, TetBlock};
use csg::{BodyId, PatchId};

/// Lines that one thread formats at a time: about 100 KiB of text.
const PER_CHUNK: u64 = 4096;
/// Bytes of text to buffer before a write.
pub const FLUSH_AT: usize = 1 << 20;

/// A vertex.
pub struct VertexLine<'a> {
    /// Its local index.
    pub index: usize,
    /// Its coordinates.
    pub point: &'a [f64; 3],
}

/// A tet.
pub struct TetLine<'a> {
    /// Its index within the part.
    pub index: u64,
    /// Its body.
    pub body: BodyId,
    /// Number of the body.
    pub number: u64,
    /// Local indices of its corners.
    pub vertices: &'a [u32; 4],
    /// Local indices of the nodes on its edges, in the order of
    /// [`TET_EDGES`](crate::ground::mesh::TET_EDGES); empty for first order.
    pub edge_nodes: &'a [u32],
}

/// A boundary triangle.
pub struct TriangleLine<'a> {
    /// Its index among the triangles that the part writes.
    pub index: u64,
    /// The bodies of the part's tets behind it and in front of it.
    pub bodies: [Option<BodyId>; 2],
    /// Its patch.
    pub patch: PatchId,
    /// The boundary number of the patch.
    pub number: u64,
    /// Local indices of its corners.
    pub vertices: &'a [u32; 3],
    /// Local indices of the nodes on its edges, in the order of
    /// [`TRIANGLE_EDGES`](crate::ground::mesh::TRIANGLE_EDGES); empty for first order.
    pub edge_nodes: &'a [u32],
    /// The tets of the part behind it and in front of it.
    pub parents: &'a [u64; 2],
}

/// Writes a line for each vertex whose local index `keep` accepts.
pub fn vertices(
    part: &dyn MeshStream,
    file: &mut Output,
    keep: impl Fn(usize) -> bool + Sync,
    format: impl Fn(&mut Line, VertexLine) + Sync,
) -> Result<(), WriteError> {
    let blocks = part.vertex_blocks();
    let (chunks, per_chunk) = split(blocks, part.counts().vertices, PER_CHUNK);
    write_chunks([file], chunks, part.work(), |chunk, [text]| {
        let mut line = Line::default();
        for block in items(chunk, per_chunk, blocks) {
            let first = part.vertex_block(block).local.start as usize;
            for (index, point) in (first..).zip(part.vertex_points(block).iter()).filter(|v| keep(v.0)) {
                format(&mut line, VertexLine { index, point });
                line.end(text);
            }
        }
        Ok(())
    })
}

/// Writes a line for each tet.
pub fn tets(
    part: &dyn MeshStream,
    names: &Names,
    file: &mut Output,
    format: impl Fn(&mut Line, TetLine) + Sync,
) -> Result<(), WriteError> {
    let (chunks, per_chunk) = split(part.tet_blocks(), part.counts().tets, PER_CHUNK);
    write_chunks([file], chunks, part.work(), |chunk, [text]| {
        let mut line = Line::default();
        let mut block = TetBlock::default();
        for index in items(chunk, per_chunk, part.tet_blocks()) {
            part.tet_block(index, &mut block);
            let body = block.body.expect("a tet block has a body");
            let number = body_number(block.body, names)?;
            for (place, (index, vertices)) in (block.first_local..).zip(&block.tets).enumerate() {
                let edge_nodes = block.edge_nodes_of(place);
                format(&mut line, TetLine { index, body, number, vertices, edge_nodes });
                line.end(text);
            }
        }
        Ok(())
    })
}

/// The boundary blocks of a part sorted by patch, each with the index of its first triangle.
/// Readers expect the triangles of a patch to be contiguous.
#[derive(Clone, Debug)]
pub(crate) struct ByPatch(Vec<(u32, u64)>);

impl ByPatch {
    /// Sorts the boundary blocks of a part.
    pub fn of(part: &dyn MeshStream) -> Self {
        let mut block = BoundaryBlock::default();
        let mut first = 0;
        let mut order: Vec<(Option<PatchId>, u32, u64)> = Vec::with_capacity(part.boundary_blocks());
        for index in 0..part.boundary_blocks() {
            part.boundary_block(index, &mut block);
            order.push((block.patch, index as u32, first));
            first += block.triangles.len() as u64;
        }
        order.sort_unstable();
        Self(order.into_iter().map(|(_, index, first)| (index, first)).collect())
    }

    /// Calls `visit` for each block, with the index of its first triangle.
    pub fn visit(
        &self,
        part: &dyn MeshStream,
        mut visit: impl FnMut(&BoundaryBlock, u64) -> Result<(), WriteError>,
    ) -> Result<(), WriteError> {
        let mut block = BoundaryBlock::default();
        self.0.iter().try_for_each(|&(index, first)| {
            part.boundary_block(index as usize, &mut block);
            visit(&block, first)
        })
    }
}

/// Writes a line for each boundary triangle that no other part writes. One thread suffices:
/// triangles are few compared to tets, and they are numbered on the way.
pub(crate) fn triangles(
    part: &dyn MeshStream,
    names: &Names,
    order: &ByPatch,
    left_out: &LeftOut,
    file: &mut Output,
    mut format: impl FnMut(&mut Line, TriangleLine),
) -> Result<(), WriteError> {
    let mut line = Line::default();
    let mut text = Vec::new();
    let mut index = 0;
    order.visit(part, |block, first| {
        let patch = block.patch.expect("a boundary block has a patch");
        let number = patch_number(block.patch, names)?;
        for (within, (vertices, parents)) in block.triangles.iter().zip(&block.parents).enumerate() {
            if !left_out.contains(first + within as u64) {
                let (bodies, edge_nodes) = (block.bodies, block.edge_nodes_of(within));
                let triangle = TriangleLine { index, bodies, patch, number, vertices, edge_nodes, parents };
                format(&mut line, triangle);
                line.end(&mut text);
                index += 1;
            }
        }
        file.flush_past(FLUSH_AT, &mut text)
    })?;
    file.flush_past(0, &mut text)
}
