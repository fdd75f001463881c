//! Who holds what, and who owns it.

use super::{DistMesh, Shared};
use crate::comm::{CommError, Communicator};
use crate::mesh::{EdgeId, FaceId, GlobalId, Rank, VertexId};
use bytemuck::Pod;
use std::collections::BTreeMap;

/// The **owner** of an entity, chosen from its holders: `holders[id_sum mod holders.len()]` (the rule
/// of the thesis "A parallel mesh generator based on sequential NETGEN", chapter 5).
///
/// `id_sum` is the global id of a vertex; of a new vertex inside an edge or face the sum of the global ids of the
/// coarse vertices there, or the new vertex's own. All holders know it, so that ownership costs no
/// message, and owners are spread evenly over the ranks.
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

    /// The holders of the entity with this local id, ascending; `None` where only this rank holds it.
    pub fn holders_of(&self, id: u32) -> Option<&[Rank]> {
        self.ids.binary_search(&id).ok().map(|index| self.holders_at(index))
    }

    /// All shared entities: local id and holders, by ascending id.
    pub fn iter(&self) -> impl Iterator<Item = (u32, &[Rank])> {
        self.ids.iter().enumerate().map(|(index, &id)| (id, self.holders_at(index)))
    }

    /// **Collective.** Tells the other holders of each entity what `say` says of it by its local id. What they say comes back as local
    /// id, holder, word; by ascending holder.
    ///
    /// Ids ascend on all ranks alike, so that words go without them.
    ///
    /// # Errors
    /// If another rank fails.
    ///
    /// # Panics
    /// If the ranks do not share what they say they share.
    pub fn exchange<T: Pod>(
        &self,
        comm: &dyn Communicator,
        say: impl Fn(u32) -> T,
    ) -> Result<Vec<(u32, Rank, T)>, CommError> {
        let rank = comm.rank();
        let mut with: BTreeMap<Rank, Vec<u32>> = BTreeMap::new();
        for (id, holders) in self.iter() {
            for &other in holders.iter().filter(|&&holder| holder != rank) {
                with.entry(other).or_default().push(id);
            }
        }
        let words = with.iter().map(|(other, ids)| (*other, ids.iter().map(|&id| say(id)).collect()));
        let mut heard = Vec::with_capacity(self.holders.len() - self.ids.len());
        for (from, words) in comm.exchange::<T>(words.collect())? {
            let ids = with.get(&from).map_or(&[][..], |ids| ids);
            assert_eq!(ids.len(), words.len(), "entities that ranks {rank} and {from} share");
            heard.extend(ids.iter().zip(words).map(|(&id, word)| (id, from, word)));
        }
        Ok(heard)
    }

    /// Appends an entity: local ids ascend.
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
    /// The ranks that hold a vertex, ascending: this one alone if it is not shared.
    pub fn vertex_holders(&self, vertex: VertexId) -> &[Rank] {
        self.shared_vertices.holders_of(vertex.0).unwrap_or(std::slice::from_ref(&self.rank))
    }

    /// The ranks that hold an edge, ascending: this one alone if it is not shared.
    pub fn edge_holders(&self, edge: EdgeId) -> &[Rank] {
        self.shared_edges.holders_of(edge.0).unwrap_or(std::slice::from_ref(&self.rank))
    }

    /// The ranks that hold a face, ascending: this one alone if it is not shared.
    pub fn face_holders(&self, face: FaceId) -> &[Rank] {
        self.shared_faces.holders_of(face.0).unwrap_or(std::slice::from_ref(&self.rank))
    }

    /// The owner of a vertex of the mesh, by its own global id.
    pub fn vertex_owner(&self, vertex: VertexId) -> Rank {
        owner(self.vertex_holders(vertex), self.vertex_ids[vertex.index()])
    }

    /// All other ranks that share a vertex with this one, ascending.
    pub fn neighbours(&self) -> Vec<Rank> {
        let mut ranks = self.shared_vertices.holders.clone();
        ranks.sort_unstable();
        ranks.dedup();
        ranks.retain(|&rank| rank != self.rank);
        ranks
    }

    /// How many of the entities with these global ids, shared as said, this rank owns.
    pub(super) fn owned(&self, ids: &[GlobalId], shared: &Shared) -> u64 {
        let lost =
            shared.iter().filter(|(id, holders)| owner(holders, ids[*id as usize]) != self.rank).count();
        (ids.len() - lost) as u64
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
