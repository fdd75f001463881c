//! Coarse edges that are to be bent, so that refinement has room beside curved boundaries.

use super::snap::Coordinates;
use crate::mesh::GlobalId;

/// Displacements of the middles of coarse edges: an edge with displacement d is the parabola 4t(1−t)·d off its straight line,
/// before it is snapped. Edges inside bodies and on curved patches can be bent.
///
/// Found once, on the whole coarse mesh ([`mend`](super::mend::mend())), and given to all ranks: an edge is known by its
/// global id, so all holders bend it alike. Few edges need it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Bends {
    /// Ascending by edge.
    edges: Vec<(GlobalId, Coordinates)>,
}

impl Bends {
    /// The displacement of the middle of an edge, if it is bent.
    #[inline]
    pub fn get(&self, edge: GlobalId) -> Option<Coordinates> {
        self.edges.binary_search_by_key(&edge, |e| e.0).ok().map(|at| self.edges[at].1)
    }

    /// Bends an edge, bends it otherwise, or straightens it.
    pub fn set(&mut self, edge: GlobalId, displacement: Option<Coordinates>) {
        match (self.edges.binary_search_by_key(&edge, |e| e.0), displacement) {
            (Ok(at), Some(displacement)) => self.edges[at].1 = displacement,
            (Err(at), Some(displacement)) => self.edges.insert(at, (edge, displacement)),
            (Ok(at), None) => drop(self.edges.remove(at)),
            (Err(_), None) => {}
        }
    }

    /// Whether no edge is bent.
    pub fn is_empty(&self) -> bool {
        self.edges.is_empty()
    }

    /// All bent edges with their displacements, ascending: to be sent to other ranks.
    pub fn edges(&self) -> &[(GlobalId, Coordinates)] {
        &self.edges
    }
}

impl FromIterator<(GlobalId, Coordinates)> for Bends {
    fn from_iter<I: IntoIterator<Item = (GlobalId, Coordinates)>>(edges: I) -> Self {
        let mut bends = Self::default();
        edges.into_iter().for_each(|(edge, displacement)| bends.set(edge, Some(displacement)));
        bends
    }
}
