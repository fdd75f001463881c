//! Edge displacements: curved coarse edges that leave room for the children next to a curved
//! boundary.

use super::snap::Coordinates;
use crate::ground::mesh::GlobalId;

/// Displacements of the midpoints of coarse edges.
///
/// An edge with displacement d is the parabola 4t(1−t)·d off its chord, before projection. Only
/// edges inside bodies and on curved patches can be displaced.
///
/// Computed once ([`mend`](super::mend::mend()), [`mend_near`](super::mend::mend_near)) and sent to
/// all ranks. Keyed by global edge id, so all ranks that share an edge displace it alike. Few edges
/// need it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct EdgeDisplacements {
    /// Sorted by edge id.
    edges: Vec<(GlobalId, Coordinates)>,
}

impl EdgeDisplacements {
    /// The displacement of the midpoint of `edge`, `None` if the edge is straight.
    #[inline]
    pub fn get(&self, edge: GlobalId) -> Option<Coordinates> {
        self.edges.binary_search_by_key(&edge, |e| e.0).ok().map(|at| self.edges[at].1)
    }

    /// Sets, replaces or (`None`) removes the displacement of an edge.
    pub fn set(&mut self, edge: GlobalId, displacement: Option<Coordinates>) {
        match (self.edges.binary_search_by_key(&edge, |e| e.0), displacement) {
            (Ok(at), Some(displacement)) => self.edges[at].1 = displacement,
            (Err(at), Some(displacement)) => self.edges.insert(at, (edge, displacement)),
            (Ok(at), None) => drop(self.edges.remove(at)),
            (Err(_), None) => {}
        }
    }

    /// Whether all edges are straight.
    pub fn is_empty(&self) -> bool {
        self.edges.is_empty()
    }

    /// All displaced edges with their displacements, by ascending id, e.g. to send to other ranks.
    pub fn edges(&self) -> &[(GlobalId, Coordinates)] {
        &self.edges
    }
}

impl FromIterator<(GlobalId, Coordinates)> for EdgeDisplacements {
    fn from_iter<I: IntoIterator<Item = (GlobalId, Coordinates)>>(edges: I) -> Self {
        let mut displacements = Self::default();
        edges.into_iter().for_each(|(edge, displacement)| displacements.set(edge, Some(displacement)));
        displacements
    }
}
