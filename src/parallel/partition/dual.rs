//! The dual graph: tets, adjacent if they share a face.

use super::weighted::Graph;
use crate::ground::kernel::buckets::{concat, map_each, ranges};
use crate::ground::mesh::topology::MatchedFaces;

/// The neighbours of each tet, in compressed row storage.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Dual {
    /// The start of each tet's neighbours; one more entry than tets.
    pub offsets: Vec<u32>,
    /// The neighbours across the faces of each tet, in the order of its faces.
    pub neighbours: Vec<u32>,
}

impl Dual {
    /// The number of tets.
    pub fn len(&self) -> usize {
        self.offsets.len().saturating_sub(1)
    }

    /// Whether there are no tets.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The graph with weights of the tets.
    pub fn weighted(&self, weights: &[i32]) -> Graph {
        Graph {
            offsets: bytemuck::cast_slice(&self.offsets).to_vec(),
            neighbours: bytemuck::cast_slice(&self.neighbours).to_vec(),
            edge_weights: vec![1; self.neighbours.len()],
            weights: weights.to_vec(),
        }
    }

    /// The neighbours of `tet`: at most four.
    pub fn of(&self, tet: usize) -> &[u32] {
        &self.neighbours[self.offsets[tet] as usize..self.offsets[tet + 1] as usize]
    }
}

/// The dual graph of tets, given their faces.
pub fn dual(faces: &MatchedFaces) -> Dual {
    let tet_faces = &faces.listed.tet_faces;
    let beside = |tet: usize| {
        let others = tet_faces[tet].map(|face| {
            let [first, second] = faces.tets[face.index()];
            if first as usize == tet { second } else { first }
        });
        others.into_iter().filter(|&other| other != u32::MAX)
    };
    let lists = map_each(ranges(tet_faces.len()), |range| {
        let mut ends = Vec::with_capacity(range.len());
        // Nearly all tets have four neighbours.
        let mut neighbours = Vec::with_capacity(4 * range.len());
        for tet in range {
            neighbours.extend(beside(tet));
            ends.push(neighbours.len() as u32);
        }
        (ends, neighbours)
    });
    let mut offsets = Vec::with_capacity(tet_faces.len() + 1);
    offsets.push(0);
    for (ends, _) in &lists {
        let start = offsets[offsets.len() - 1];
        offsets.extend(ends.iter().map(|end| start + end));
    }
    Dual { offsets, neighbours: concat(lists.into_iter().map(|(_, neighbours)| neighbours).collect()) }
}
