//! The dual graph: tets, adjacent if they share a face.

use super::weighted::Graph;
use crate::ground::mesh::topology::Faces;

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

/// The dual graph of the tets of `listed`, given the tets of each face.
pub fn dual(listed: &Faces, face_tets: &[[u32; 2]]) -> Dual {
    let mut dual = Dual { offsets: Vec::with_capacity(listed.tet_faces.len() + 1), neighbours: Vec::new() };
    dual.offsets.push(0);
    for (tet, faces) in (0..).zip(&listed.tet_faces) {
        let beside = faces.iter().map(|face| {
            let [first, second] = face_tets[face.index()];
            if first == tet { second } else { first }
        });
        dual.neighbours.extend(beside.filter(|&other| other != u32::MAX));
        dual.offsets.push(dual.neighbours.len() as u32);
    }
    dual
}
