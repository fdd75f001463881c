//! A part and its ghosts as one stream, for the writers.

use crate::ground::mesh::ghosts::{GhostVertex, Ghosts};
use crate::ground::mesh::periodic::Link;
use crate::ground::mesh::stream::{
    BoundaryBlock, Counts, LocalBlock, MeshStream, SingularTags, TetBlock, VertexBlock,
};
use crate::ground::mesh::{GlobalId, Order, Rank};
use crate::ground::progress::Work;
use std::borrow::Cow;

/// Boundary triangles are those of the part and refer only to tets of the part. `counts` include
/// the ghosts.
#[derive(Clone, Copy)]
pub struct WithHalo<'a> {
    part: &'a dyn MeshStream,
    ghosts: &'a Ghosts,
}

impl<'a> WithHalo<'a> {
    /// *Local.* Combines a part with its ghosts; both must be of the same rank and mesh.
    pub fn new(part: &'a dyn MeshStream, ghosts: &'a Ghosts) -> Self {
        Self { part, ghosts }
    }

    fn ghost_vertex(&self, local: u32) -> Option<&GhostVertex> {
        local.checked_sub(self.ghosts.first_vertex).map(|ghost| &self.ghosts.vertices[ghost as usize])
    }
}

impl MeshStream for WithHalo<'_> {
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
        let counts = self.part.counts();
        Counts {
            vertices: counts.vertices + self.ghosts.vertices.len() as u64,
            tets: counts.tets + self.ghosts.tets.len() as u64,
            ..counts
        }
    }

    fn totals(&self) -> Counts {
        self.part.totals()
    }

    fn points(&self) -> &[[f64; 3]] {
        self.part.points()
    }

    fn vertex_blocks(&self) -> usize {
        self.part.vertex_blocks() + self.ghosts.vertices.len()
    }

    fn vertex_block(&self, index: usize) -> VertexBlock<'_> {
        let Some(ghost) = index.checked_sub(self.part.vertex_blocks()) else {
            return self.part.vertex_block(index);
        };
        let vertex = &self.ghosts.vertices[ghost];
        let local = self.ghosts.first_vertex + ghost as u32;
        VertexBlock {
            local: local..local + 1,
            first_id: vertex.id,
            holders: self.ghosts.holders.get(ghost),
            on_boundary: vertex.on_boundary,
        }
    }

    fn vertex_id(&self, local: u32) -> GlobalId {
        self.ghost_vertex(local).map_or_else(|| self.part.vertex_id(local), |vertex| vertex.id)
    }

    fn tet_blocks(&self) -> usize {
        self.part.tet_blocks() + self.ghosts.tets.len()
    }

    fn tet_block(&self, index: usize, block: &mut TetBlock) {
        let Some(ghost) = index.checked_sub(self.part.tet_blocks()) else {
            return self.part.tet_block(index, block);
        };
        let tet = &self.ghosts.tets[ghost];
        block.tets.clear();
        block.tets.push(tet.vertices);
        block.edge_nodes.clear();
        block.edge_nodes.extend(tet.edge_nodes);
        block.first_id = tet.id;
        block.first_local = self.ghosts.first_tet + ghost as u64;
        block.body = Some(tet.body);
    }

    fn local_block(&self, index: usize, block: &mut LocalBlock) {
        if index < self.part.tet_blocks() {
            return self.part.local_block(index, block);
        }
        self.tet_block(index, &mut block.tets);
        block.vertices.clear();
        block.vertices.extend(block.tets.tets[0]);
        block.tets.tets[0] = [0, 1, 2, 3];
        if let Some(nodes) = block.tets.edge_nodes.first_mut() {
            block.vertices.extend(*nodes);
            *nodes = [4, 5, 6, 7, 8, 9];
        }
    }

    fn block_ids(&self, block: &LocalBlock, ids: &mut Vec<GlobalId>) {
        if block.tets.first_local < self.ghosts.first_tet {
            return self.part.block_ids(block, ids);
        }
        ids.clear();
        ids.extend(block.vertices.iter().map(|&vertex| self.vertex_id(vertex)));
    }

    fn block_points(&self, block: &LocalBlock, points: &mut Vec<[f64; 3]>) {
        if block.tets.first_local < self.ghosts.first_tet {
            return self.part.block_points(block, points);
        }
        let point = |&vertex: &u32| match self.ghost_vertex(vertex) {
            Some(ghost) => ghost.point,
            // Shared vertices are always among those whose coordinates are kept.
            None => self.part.points()[vertex as usize],
        };
        points.clear();
        points.extend(block.vertices.iter().map(point));
    }

    fn vertex_points(&self, index: usize) -> Cow<'_, [[f64; 3]]> {
        match index.checked_sub(self.part.vertex_blocks()) {
            None => self.part.vertex_points(index),
            Some(ghost) => Cow::Borrowed(std::slice::from_ref(&self.ghosts.vertices[ghost].point)),
        }
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
        let ghosts = (self.ghosts.first_vertex..).zip(&self.ghosts.vertices);
        let images = ghosts.filter(|(_, vertex)| vertex.origin != vertex.id);
        let mut origins = self.part.masters();
        origins.extend(images.map(|(local, vertex)| (local, vertex.origin)));
        origins
    }

    fn ghosts(&self) -> Option<&Ghosts> {
        Some(self.ghosts)
    }

    fn work(&self) -> &Work<'_> {
        self.part.work()
    }
}
