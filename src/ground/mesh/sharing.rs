//! Shared vertices of a part, and sums over their copies.

use super::GlobalId;
use super::ghosts::RankLists;
use super::stream::MeshStream;
use crate::ground::comm::{CommError, Communicator, Rank};
use bytemuck::Pod;

/// The vertices of a part that are shared with other ranks.
///
/// Every vertex has one **owner** among the ranks that share it, chosen by its global id, so that
/// all of them know the owner without a message. An unshared vertex is owned by its rank.
///
/// ```
/// # use tetmill::{Geometry, Mesher, comm::thread, mesh::Sharing};
/// # let ball = Geometry::from_text("algebraic3d solid ball = sphere(0, 0, 0; 1); tlo ball;")?;
/// // Each vertex of the whole mesh is owned once.
/// let owned = thread::run(3, |comm| {
///     let mesh = Mesher::new().generate_on(comm, Some(&ball)).unwrap();
///     let sharing = Sharing::of(mesh.stream());
///     (0..mesh.stream().counts().vertices as u32).filter(|&v| sharing.is_owned(v)).count() as u64
/// })?;
/// # let mesh = Mesher::new().generate(&ball)?;
/// # assert_eq!(owned.iter().sum::<u64>(), mesh.stream().totals().vertices);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Sharing {
    rank: Rank,
    /// The number of vertices of the part.
    count: usize,
    /// Local indices, ascending.
    vertices: Vec<u32>,
    /// All ranks that share each of them, this one included, ascending.
    holders: RankLists,
    owners: Vec<Rank>,
    neighbours: Vec<Neighbour>,
}

/// Another rank, and the vertices shared with it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Neighbour {
    /// The other rank.
    pub rank: Rank,
    /// Local indices of the common vertices, by ascending global id, so both ranks list them in the
    /// same order.
    pub vertices: Vec<u32>,
}

impl Sharing {
    /// *Local.* Lists the shared vertices of a part.
    pub fn of(part: &dyn MeshStream) -> Self {
        let rank = part.rank();
        let count = part.counts().vertices as usize;
        let mut sharing = Self { rank, count, ..Self::default() };
        let mut with: Vec<(Rank, GlobalId, u32)> = Vec::new();
        for index in 0..part.vertex_blocks() {
            let block = part.vertex_block(index);
            if block.holders.is_empty() {
                continue;
            }
            for (local, id) in block.local.clone().zip(block.ids()) {
                sharing.vertices.push(local);
                sharing.holders.push(block.holders.iter().copied());
                sharing.owners.push(block.owner(id, rank));
                let others = block.holders.iter().filter(|&&other| other != rank);
                with.extend(others.map(|&other| (other, id, local)));
            }
        }
        with.sort_unstable();
        for of_rank in with.chunk_by(|a, b| a.0 == b.0) {
            let vertices = of_rank.iter().map(|(_, _, local)| *local).collect();
            sharing.neighbours.push(Neighbour { rank: of_rank[0].0, vertices });
        }
        sharing
    }

    /// The shared vertices by local index, ascending.
    pub fn vertices(&self) -> &[u32] {
        &self.vertices
    }

    /// The ranks that share a vertex, ascending; only this one if it is not shared.
    pub fn holders(&self, vertex: u32) -> &[Rank] {
        match self.vertices.binary_search(&vertex) {
            Ok(place) => self.holders.get(place),
            Err(_) => std::slice::from_ref(&self.rank),
        }
    }

    /// The rank that owns a vertex.
    pub fn owner(&self, vertex: u32) -> Rank {
        self.vertices.binary_search(&vertex).map_or(self.rank, |place| self.owners[place])
    }

    /// Whether this rank owns a vertex.
    pub fn is_owned(&self, vertex: u32) -> bool {
        self.owner(vertex) == self.rank
    }

    /// The ranks that this one shares vertices with, ascending.
    pub fn neighbours(&self) -> &[Neighbour] {
        &self.neighbours
    }

    /// **Collective.** Sends the values of shared vertices to the other ranks that share them.
    /// Returns local index, sending rank and value, by ascending rank.
    ///
    /// # Errors
    /// [`CommError`] if another rank fails.
    ///
    /// # Panics
    /// If `values` does not have one value for each vertex of the part.
    pub fn exchange<T: Pod>(
        &self,
        comm: &dyn Communicator,
        values: &[T],
    ) -> Result<Vec<(u32, Rank, T)>, CommError> {
        assert_eq!(
            values.len(),
            self.count,
            "the values are {}, but the part of rank {} has {} vertices: pass one value for each, shared or not",
            values.len(),
            self.rank,
            self.count
        );
        let message = |neighbour: &Neighbour| {
            let values = neighbour.vertices.iter().map(|&vertex| values[vertex as usize]).collect();
            (neighbour.rank, values)
        };
        let received = comm.exchange::<T>(self.neighbours.iter().map(message).collect())?;
        let mut came = Vec::new();
        for (neighbour, (from, values)) in self.neighbours.iter().zip(received) {
            assert_eq!(neighbour.rank, from, "ranks that share vertices send messages to each other");
            came.extend(neighbour.vertices.iter().zip(values).map(|(&vertex, value)| (vertex, from, value)));
        }
        Ok(came)
    }

    /// **Collective.** Replaces the value of each shared vertex by the sum over its ranks, in rank
    /// order, so all of them get the same bits. This assembles the contributions of elements across
    /// ranks.
    ///
    /// # Errors
    /// [`CommError`] if another rank fails.
    ///
    /// # Panics
    /// If `values` does not have one value for each vertex of the part.
    pub fn sum(&self, comm: &dyn Communicator, values: &mut [f64]) -> Result<(), CommError> {
        let received = self.exchange(comm, values)?;
        add_received(self.rank, &self.vertices, received, values);
        Ok(())
    }

    /// **Collective.** Sets the flag of each shared vertex on all its ranks if it is set on any: a
    /// rank may have a boundary vertex without an adjacent boundary triangle.
    ///
    /// # Errors
    /// [`CommError`] if another rank fails.
    ///
    /// # Panics
    /// If `flags` does not have one flag for each vertex of the part.
    pub fn any(&self, comm: &dyn Communicator, flags: &mut [bool]) -> Result<(), CommError> {
        let bytes: Vec<u8> = flags.iter().map(|&flag| u8::from(flag)).collect();
        for (vertex, _, flag) in self.exchange(comm, &bytes)? {
            flags[vertex as usize] |= flag != 0;
        }
        Ok(())
    }
}

/// Replaces the values of the shared entities `ids` by their sums with the values received from
/// other ranks. The terms are added in rank order, so all ranks get the same bits.
pub(crate) fn add_received(rank: Rank, ids: &[u32], mut received: Vec<(u32, Rank, f64)>, values: &mut [f64]) {
    received.extend(ids.iter().map(|&id| (id, rank, values[id as usize])));
    received.sort_unstable_by_key(|&(id, rank, _)| (id, rank));
    for terms in received.chunk_by(|a, b| a.0 == b.0) {
        values[terms[0].0 as usize] = terms.iter().map(|(_, _, value)| value).sum();
    }
}
