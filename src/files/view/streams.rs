//! Meshes from files as the streams of their parts, with the nodes on edges of second order.

use crate::files::plain::PlainPart;
use crate::files::volume::VolumeMesh;
use crate::ground::mesh::stream::{BoundaryBlock, Counts, MeshStream, TetBlock, VertexBlock};
use crate::ground::mesh::{GlobalId, Order, Rank, TET_EDGES};
use std::collections::BTreeMap;

/// *Local.* The parts of a mesh that was read from a file, all on this rank.
pub fn streams(read: &VolumeMesh) -> Vec<Box<dyn MeshStream>> {
    let mesh = &read.mesh;
    let one = vec![0; mesh.tets.len()];
    let tet_to_part = if read.parts.is_empty() { &one } else { &read.parts };
    let parts = tet_to_part.iter().max().map_or(1, |last| last + 1);
    let plain = (0..parts).map(|part| PlainPart::part(mesh, tet_to_part, parts, part));
    if read.edge_points.is_empty() {
        return plain.map(|part| Box::new(part) as Box<dyn MeshStream>).collect();
    }
    let nodes = Nodes::of(read);
    plain.map(|part| Box::new(nodes.added_to(part)) as Box<dyn MeshStream>).collect()
}

/// The nodes on the edges of all tets, one for each edge.
struct Nodes {
    points: Vec<[f64; 3]>,
    of_tets: Vec<[u32; 6]>,
    /// Global id of the first: nodes come after the vertices.
    first_id: GlobalId,
}

impl Nodes {
    fn of(read: &VolumeMesh) -> Self {
        let mut node_of_edge = BTreeMap::new();
        let mut points = Vec::new();
        let of_tet = |(tet, places): (&[crate::ground::mesh::VertexId; 4], &[[f64; 3]; 6])| {
            [0, 1, 2, 3, 4, 5].map(|edge| {
                let [a, b] = TET_EDGES[edge].map(|corner| tet[corner]);
                *node_of_edge.entry([a.min(b), a.max(b)]).or_insert_with(|| {
                    points.push(places[edge]);
                    points.len() as u32 - 1
                })
            })
        };
        let of_tets = read.mesh.tets.iter().zip(&read.edge_points).map(of_tet).collect();
        Self { points, of_tets, first_id: read.mesh.points.len() as u64 }
    }

    /// A part with its nodes, which follow its vertices.
    fn added_to(&self, part: PlainPart) -> CurvedPart {
        let mut block = TetBlock::default();
        let mut tets = Vec::new();
        for index in 0..part.tet_blocks() {
            part.tet_block(index, &mut block);
            tets.extend((0..block.tets.len()).map(|k| self.of_tets[block.first_id as usize + k]));
        }
        let mut used: Vec<u32> = tets.iter().flatten().copied().collect();
        used.sort_unstable();
        used.dedup();
        let first = part.points().len() as u32;
        let local = |node: u32| first + used.binary_search(&node).expect("a node of a tet") as u32;
        let mut points = part.points().to_vec();
        points.extend(used.iter().map(|&node| self.points[node as usize]));
        let nodes = tets.into_iter().map(|nodes| nodes.map(local)).collect();
        let ids = used.iter().map(|&node| self.first_id + u64::from(node)).collect();
        CurvedPart { part, points, nodes, ids }
    }
}

/// A part of second order.
struct CurvedPart {
    part: PlainPart,
    /// Coordinates of vertices and nodes.
    points: Vec<[f64; 3]>,
    /// The nodes of each tet by local index.
    nodes: Vec<[u32; 6]>,
    /// The global ids of the nodes.
    ids: Vec<GlobalId>,
}

impl CurvedPart {
    /// The position of a local index among the nodes.
    fn node(&self, local: u32) -> Option<usize> {
        (local as usize).checked_sub(self.part.points().len())
    }
}

impl MeshStream for CurvedPart {
    fn rank(&self) -> Rank {
        self.part.rank()
    }

    fn ranks(&self) -> u32 {
        self.part.ranks()
    }

    fn order(&self) -> Order {
        Order::Second
    }

    fn counts(&self) -> Counts {
        Counts { vertices: self.points.len() as u64, ..self.part.counts() }
    }

    fn totals(&self) -> Counts {
        self.part.totals()
    }

    fn points(&self) -> &[[f64; 3]] {
        &self.points
    }

    fn vertex_blocks(&self) -> usize {
        self.part.vertex_blocks() + self.ids.len()
    }

    fn vertex_block(&self, index: usize) -> VertexBlock<'_> {
        let Some(node) = index.checked_sub(self.part.vertex_blocks()) else {
            return self.part.vertex_block(index);
        };
        // Tets are classified by their corners.
        let local = (self.part.points().len() + node) as u32;
        VertexBlock { local: local..local + 1, first_id: self.ids[node], holders: &[], on_boundary: false }
    }

    fn vertex_id(&self, local: u32) -> GlobalId {
        self.node(local).map_or_else(|| self.part.vertex_id(local), |node| self.ids[node])
    }

    fn tet_blocks(&self) -> usize {
        self.part.tet_blocks()
    }

    fn tet_block(&self, index: usize, block: &mut TetBlock) {
        self.part.tet_block(index, block);
        let first = block.first_local as usize;
        block.edge_nodes.clear();
        block.edge_nodes.extend_from_slice(&self.nodes[first..first + block.tets.len()]);
    }

    fn boundary_blocks(&self) -> usize {
        self.part.boundary_blocks()
    }

    fn boundary_block(&self, index: usize, block: &mut BoundaryBlock) {
        self.part.boundary_block(index, block);
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Fill, part};
    use super::*;
    use crate::files::testing::{cube, slabs};

    #[test]
    fn parts_have_their_tets_and_nodes() {
        let mesh = cube(2);
        // Every node is above the middle of its edge.
        let above =
            |[a, b]: [[f64; 3]; 2]| [0, 1, 2].map(|k| 0.5 * (a[k] + b[k]) + if k == 2 { 0.1 } else { 0.0 });
        let point = |v: crate::ground::mesh::VertexId| -> [f64; 3] { mesh.points[v.index()].coords.into() };
        let edge_points: Vec<[[f64; 3]; 6]> =
            mesh.tets.iter().map(|tet| TET_EDGES.map(|ends| above(ends.map(|k| point(tet[k]))))).collect();
        let read =
            VolumeMesh { parts: slabs(&mesh, 3), edge_points, mesh: mesh.clone(), ..VolumeMesh::default() };
        let parts: Vec<_> = streams(&read).iter().map(|stream| part(&**stream, Fill::Full)).collect();
        assert_eq!(parts.iter().map(|part| part.tets.len()).collect::<Vec<_>>(), [16; 3]);
        for part in &parts {
            let point = |v: u32| part.points[v as usize];
            for (tet, nodes) in part.tets.iter().zip(&part.nodes) {
                assert_eq!(nodes.map(point), TET_EDGES.map(|ends| above(ends.map(|k| point(tet[k])))));
            }
            let mut ids = part.ids.clone();
            ids.sort_unstable();
            ids.dedup();
            assert_eq!(ids.len(), part.points.len(), "one node for each edge");
        }
    }
}
