//! Holders and owners of shared entities.

use super::{DistMesh, Shared};
use crate::ground::comm::{CommError, Communicator};
use crate::ground::mesh::{EdgeId, FaceId, GlobalId, Rank, VertexId, add_received};
use bytemuck::Pod;
use std::collections::BTreeMap;

/// The **owner** of an entity, chosen from its holders: `holders[id_sum mod holders.len()]` (the
/// rule of the thesis "A parallel mesh generator based on sequential NETGEN", chapter 5).
///
/// `id_sum` is the global id of a vertex; for a new vertex inside an edge or face, the sum of the
/// global ids of the coarse vertices there, or the new vertex's own id. All holders know it, so
/// ownership costs no message, and ownership is spread evenly over the ranks.
///
/// # Panics
/// If there are no holders.
pub fn owner(holders: &[Rank], id_sum: u64) -> Rank {
    holders[(id_sum % holders.len() as u64) as usize]
}

impl Shared {
    /// The number of shared entities.
    pub fn len(&self) -> usize {
        self.ids.len()
    }

    /// Whether nothing is shared.
    pub fn is_empty(&self) -> bool {
        self.ids.is_empty()
    }

    /// The holders of the shared entity at `index` in the list.
    pub fn holders_at(&self, index: usize) -> &[Rank] {
        &self.holders[self.offsets[index] as usize..self.offsets[index + 1] as usize]
    }

    /// The holders of the entity with this local id, ascending; `None` if only this rank has it.
    pub fn holders_of(&self, id: u32) -> Option<&[Rank]> {
        self.ids.binary_search(&id).ok().map(|index| self.holders_at(index))
    }

    /// All shared entities, by ascending local id, with their holders.
    pub fn iter(&self) -> impl Iterator<Item = (u32, &[Rank])> {
        self.ids.iter().enumerate().map(|(index, &id)| (id, self.holders_at(index)))
    }

    /// **Collective.** Exchanges one value per shared entity between its holders. `value` maps a
    /// local id to the value to send; returns local id, sending rank and received value, by
    /// ascending rank.
    ///
    /// Shared entities have the same order on all ranks, so the messages contain no ids.
    ///
    /// # Errors
    /// [`CommError`] if another rank fails.
    ///
    /// # Panics
    /// If the tables of shared entities of two ranks do not match.
    pub fn exchange<T: Pod>(
        &self,
        comm: &dyn Communicator,
        value: impl Fn(u32) -> T,
    ) -> Result<Vec<(u32, Rank, T)>, CommError> {
        let rank = comm.rank();
        let mut with: BTreeMap<Rank, Vec<u32>> = BTreeMap::new();
        for (id, holders) in self.iter() {
            for &other in holders.iter().filter(|&&holder| holder != rank) {
                with.entry(other).or_default().push(id);
            }
        }
        let values = with.iter().map(|(other, ids)| (*other, ids.iter().map(|&id| value(id)).collect()));
        let mut received = Vec::with_capacity(self.holders.len() - self.ids.len());
        for (from, values) in comm.exchange::<T>(values.collect())? {
            let ids = with.get(&from).map_or(&[][..], |ids| ids);
            assert_eq!(
                ids.len(),
                values.len(),
                "ranks {rank} and {from} disagree on the number of entities they share"
            );
            received.extend(ids.iter().zip(values).map(|(&id, value)| (id, from, value)));
        }
        Ok(received)
    }

    /// **Collective.** Replaces the value of each shared entity by the sum over its holders, in
    /// rank order, so all of them get the same bits. `values` has one value for each entity of the
    /// kind (vertex, edge or face) of the part, by local id.
    ///
    /// # Errors
    /// [`CommError`] if another rank fails.
    ///
    /// # Panics
    /// If `values` has no value for a shared entity.
    pub fn sum(&self, comm: &dyn Communicator, values: &mut [f64]) -> Result<(), CommError> {
        self.assert_covered_by(values.len());
        let received = self.exchange(comm, |id| values[id as usize])?;
        add_received(comm.rank(), &self.ids, received, values);
        Ok(())
    }

    /// **Collective.** Sets the flag of each shared entity on all its holders if it is set on any.
    /// `flags` has one flag for each entity of the kind of the part, by local id.
    ///
    /// # Errors
    /// [`CommError`] if another rank fails.
    ///
    /// # Panics
    /// If `flags` has no flag for a shared entity.
    pub fn any(&self, comm: &dyn Communicator, flags: &mut [bool]) -> Result<(), CommError> {
        self.assert_covered_by(flags.len());
        for (id, _, flag) in self.exchange(comm, |id| u8::from(flags[id as usize]))? {
            flags[id as usize] |= flag != 0;
        }
        Ok(())
    }

    /// Asserts that an array has an entry for each shared entity.
    fn assert_covered_by(&self, entries: usize) {
        let needed = self.ids.last().map_or(0, |&last| last as usize + 1);
        assert!(
            entries >= needed,
            "the array has {entries} entries, but the entity with local id {} is shared: pass one entry for \
             each vertex, edge or face of the part, shared or not",
            needed.max(1) - 1
        );
    }

    /// Appends an entity; local ids must ascend.
    pub fn push(&mut self, id: u32, holders: impl IntoIterator<Item = Rank>) {
        if self.offsets.is_empty() {
            self.offsets.push(0);
        }
        self.ids.push(id);
        self.holders.extend(holders);
        self.offsets.push(u32::try_from(self.holders.len()).expect("more than 2^32 holders on one rank"));
    }
}

/// All functions are *local*.
impl DistMesh {
    /// The ranks that share a vertex, ascending: only this one if it is not shared.
    pub fn vertex_holders(&self, vertex: VertexId) -> &[Rank] {
        self.shared_vertices.holders_of(vertex.0).unwrap_or(std::slice::from_ref(&self.rank))
    }

    /// The ranks that share an edge, ascending: only this one if it is not shared.
    pub fn edge_holders(&self, edge: EdgeId) -> &[Rank] {
        self.shared_edges.holders_of(edge.0).unwrap_or(std::slice::from_ref(&self.rank))
    }

    /// The ranks that share a face, ascending: only this one if it is not shared.
    pub fn face_holders(&self, face: FaceId) -> &[Rank] {
        self.shared_faces.holders_of(face.0).unwrap_or(std::slice::from_ref(&self.rank))
    }

    /// The rank that owns a vertex, chosen by its global id.
    pub fn vertex_owner(&self, vertex: VertexId) -> Rank {
        owner(self.vertex_holders(vertex), self.vertex_ids[vertex.index()])
    }

    /// The rank that owns an edge, chosen by its global id.
    pub fn edge_owner(&self, edge: EdgeId) -> Rank {
        owner(self.edge_holders(edge), self.edge_ids[edge.index()])
    }

    /// The rank that owns a face, chosen by its global id.
    pub fn face_owner(&self, face: FaceId) -> Rank {
        owner(self.face_holders(face), self.face_ids[face.index()])
    }

    /// Whether this rank owns a vertex.
    pub fn owns_vertex(&self, vertex: VertexId) -> bool {
        self.vertex_owner(vertex) == self.rank
    }

    /// Whether this rank owns an edge.
    pub fn owns_edge(&self, edge: EdgeId) -> bool {
        self.edge_owner(edge) == self.rank
    }

    /// Whether this rank owns a face.
    pub fn owns_face(&self, face: FaceId) -> bool {
        self.face_owner(face) == self.rank
    }

    /// The other ranks that share a vertex with this one, ascending.
    pub fn neighbours(&self) -> Vec<Rank> {
        let mut ranks = self.shared_vertices.holders.clone();
        ranks.sort_unstable();
        ranks.dedup();
        ranks.retain(|&rank| rank != self.rank);
        ranks
    }

    /// The number of the entities with these global ids that this rank owns.
    pub(super) fn owned(&self, ids: &[GlobalId], shared: &Shared) -> u64 {
        let owned_elsewhere =
            shared.iter().filter(|(id, holders)| owner(holders, ids[*id as usize]) != self.rank).count();
        (ids.len() - owned_elsewhere) as u64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn owners_go_round_the_holders() {
        let holders = [2, 5, 9];
        assert_eq!((0..4).map(|sum| owner(&holders, sum)).collect::<Vec<_>>(), [2, 5, 9, 2]);
    }

    #[test]
    fn holders_are_found_by_local_id() {
        let mut shared = Shared::default();
        assert_eq!(shared.holders_of(0), None);
        shared.push(3, [0, 1]);
        shared.push(7, [0, 2, 4]);
        assert_eq!(shared.holders_of(3), Some(&[0, 1][..]));
        assert_eq!(shared.holders_of(5), None);
        assert_eq!(shared.iter().collect::<Vec<_>>(), [(3, &[0, 1][..]), (7, &[0, 2, 4][..])]);
    }
}
