//! A [`MeshStream`] of an element-only part, for the checker and the writers.

use crate::ground::mesh::stream::{
    BoundaryBlock, Counts, LocalBlock, MeshStream, NO_TET, TetBlock, VertexBlock,
};
use crate::ground::mesh::{
    Class, EDGE_BETWEEN, GlobalId, Order, Rank, TET_FACES, TRIANGLE_EDGES, TetId, VertexId,
};
use crate::parallel::distribution::BareMesh;
use csg::PatchId;
use std::ops::Range;

/// The maximum number of tets in a block; the vertices of this many fit the first-level cache.
const TETS_IN_BLOCK: usize = 512;

/// A boundary triangle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Triangle {
    vertices: [VertexId; 3],
    /// The nodes on its edges, if it is of second order.
    edge_nodes: Option<[VertexId; 3]>,
    patch: PatchId,
    /// The tets behind and in front of it.
    parents: [Option<TetId>; 2],
}

/// A [`BareMesh`] as a [`MeshStream`].
#[derive(Clone, Debug)]
pub struct BareStream {
    mesh: BareMesh,
    /// The starts of blocks of vertices: runs of consecutive ids, all shared or boundary alike.
    vertex_starts: Vec<u32>,
    /// The starts of blocks of tets: runs of consecutive ids in one body.
    tet_starts: Vec<u32>,
    triangles: Vec<Triangle>,
}

/// The starts of the runs in `0..count`, and `count`; `joined(i)` returns whether i continues the
/// run of i − 1.
fn runs(count: usize, longest: usize, joined: impl Fn(usize) -> bool) -> Vec<u32> {
    let mut starts = Vec::new();
    for i in 0..count {
        let goes_on = starts.last().is_some_and(|&start| i - (start as usize) < longest && joined(i));
        if !goes_on {
            starts.push(i as u32);
        }
    }
    starts.push(count as u32);
    starts
}

impl BareStream {
    /// *Local.* Finds the blocks.
    pub fn new(mesh: BareMesh) -> Self {
        let vertex_starts = {
            let mut shared = vec![false; mesh.points.len()];
            mesh.shared.ids.iter().for_each(|&v| shared[v as usize] = true);
            runs(mesh.points.len(), usize::MAX, |v| {
                let on_boundary = |v: usize| !matches!(mesh.vertex_classes[v], Class::Body(_));
                mesh.vertex_ids[v] == mesh.vertex_ids[v - 1] + 1
                    && !shared[v]
                    && !shared[v - 1]
                    && on_boundary(v) == on_boundary(v - 1)
            })
        };
        let tet_starts = runs(mesh.tets.len(), TETS_IN_BLOCK, |t| {
            mesh.tet_ids[t] == mesh.tet_ids[t - 1] + 1 && mesh.tet_bodies[t] == mesh.tet_bodies[t - 1]
        });
        let triangles = triangles(&mesh);
        Self { mesh, vertex_starts, tet_starts, triangles }
    }

    /// The mesh.
    pub fn mesh(&self) -> &BareMesh {
        &self.mesh
    }

    /// Returns the mesh.
    pub fn into_mesh(self) -> BareMesh {
        self.mesh
    }
}

/// The boundary triangles, from the sides of tets, by ascending vertices.
fn triangles(mesh: &BareMesh) -> Vec<Triangle> {
    let mut sides: Vec<([VertexId; 3], bool, Triangle)> = Vec::with_capacity(mesh.sides.len());
    for side in &mesh.sides {
        let outward = TET_FACES[usize::from(side.face)].map(|k| mesh.tets[side.tet.index()][k]);
        let mut key = outward;
        key.sort_unstable();
        let [a, b, c] = outward;
        let (vertices, parents) =
            if side.behind { (outward, [Some(side.tet), None]) } else { ([a, c, b], [None, Some(side.tet)]) };
        let edge_nodes = mesh.edge_nodes.get(side.tet.index()).map(|nodes| {
            let tet = mesh.tets[side.tet.index()];
            let place =
                |v: VertexId| tet.iter().position(|corner| *corner == v).expect("a corner of the tet");
            TRIANGLE_EDGES.map(|[p, q]| nodes[EDGE_BETWEEN[place(vertices[p])][place(vertices[q])]])
        });
        sides.push((key, side.behind, Triangle { vertices, edge_nodes, patch: side.patch, parents }));
    }
    sides.sort_unstable_by_key(|(key, behind, _)| (*key, !behind));
    let join = |sides: &[([VertexId; 3], bool, Triangle)]| {
        let mut triangle = sides[0].2;
        sides[1..].iter().for_each(|other| triangle.parents[1] = other.2.parents[1]);
        triangle
    };
    sides.chunk_by(|a, b| a.0 == b.0).map(join).collect()
}

fn range(starts: &[u32], index: usize) -> Range<u32> {
    starts[index]..starts[index + 1]
}

impl MeshStream for BareStream {
    fn rank(&self) -> Rank {
        self.mesh.rank
    }

    fn ranks(&self) -> u32 {
        self.mesh.ranks
    }

    fn order(&self) -> Order {
        if self.mesh.edge_nodes.is_empty() { Order::First } else { Order::Second }
    }

    fn counts(&self) -> Counts {
        Counts {
            vertices: self.mesh.points.len() as u64,
            tets: self.mesh.tets.len() as u64,
            boundary: self.triangles.len() as u64,
        }
    }

    fn totals(&self) -> Counts {
        self.mesh.totals
    }

    fn points(&self) -> &[[f64; 3]] {
        &self.mesh.points
    }

    fn vertex_blocks(&self) -> usize {
        self.vertex_starts.len() - 1
    }

    fn vertex_block(&self, index: usize) -> VertexBlock<'_> {
        let local = range(&self.vertex_starts, index);
        let first = local.start as usize;
        VertexBlock {
            first_id: self.mesh.vertex_ids[first],
            holders: self.mesh.shared.holders_of(local.start).unwrap_or_default(),
            on_boundary: !matches!(self.mesh.vertex_classes[first], Class::Body(_)),
            local,
        }
    }

    fn vertex_id(&self, local: u32) -> GlobalId {
        self.mesh.vertex_ids[local as usize]
    }

    fn tet_blocks(&self) -> usize {
        self.tet_starts.len() - 1
    }

    fn tet_block(&self, index: usize, block: &mut TetBlock) {
        let local = range(&self.tet_starts, index);
        let (first, end) = (local.start as usize, local.end as usize);
        block.tets.clear();
        block.tets.extend(self.mesh.tets[first..end].iter().map(|tet| tet.map(|v| v.0)));
        block.edge_nodes.clear();
        let edge_nodes = self.mesh.edge_nodes.get(first..end).unwrap_or_default();
        block.edge_nodes.extend(edge_nodes.iter().map(|nodes| nodes.map(|v| v.0)));
        block.first_id = self.mesh.tet_ids[first];
        block.first_local = u64::from(local.start);
        block.body = Some(self.mesh.tet_bodies[first]);
    }

    fn block_ids(&self, block: &LocalBlock, ids: &mut Vec<GlobalId>) {
        ids.clear();
        ids.extend(block.vertices.iter().map(|&v| self.mesh.vertex_ids[v as usize]));
    }

    fn boundary_blocks(&self) -> usize {
        self.triangles.len()
    }

    fn boundary_block(&self, index: usize, block: &mut BoundaryBlock) {
        let triangle = self.triangles[index];
        block.triangles.clear();
        block.triangles.push(triangle.vertices.map(|v| v.0));
        block.edge_nodes.clear();
        block.edge_nodes.extend(triangle.edge_nodes.map(|nodes| nodes.map(|v| v.0)));
        block.parents.clear();
        block.parents.push(triangle.parents.map(|tet| tet.map_or(NO_TET, |tet| u64::from(tet.0))));
        block.bodies = triangle.parents.map(|tet| Some(self.mesh.tet_bodies[tet?.index()]));
        block.patch = Some(triangle.patch);
    }
}
