//! The numbers that text files bear: from 1 without a gap, and compact per part, since Elmer sizes its tables by the range of ids in a part,
//! and formats that number vertices by their order in the file need all of a part behind each other.

use crate::comm::Communicator;
use crate::io::WriteError;
use crate::mesh::ghosts::GhostTet;
use crate::mesh::stream::{MeshStream, VertexBlock};
use crate::mesh::{GlobalId, Rank};
use std::ops::Range;

/// The numbers of one part's entities, all from 1; of its ghosts those that they have in their own part.
#[derive(Debug)]
pub(super) struct Numbering {
    /// By local vertex index.
    pub vertices: Vec<u32>,
    /// The numbers of the vertices that this part owns.
    owned: Range<u64>,
    /// The number of the part's first tet; the others follow in local order.
    first_tet: u64,
    /// Where ghost tets begin, and their numbers.
    ghosts: (u64, Vec<u64>),
    /// How many vertices of this part, or of its ghosts, others have too.
    pub shared: u64,
}

impl Numbering {
    /// Whether this part owns the vertex with this local index.
    pub fn owns(&self, local: usize) -> bool {
        self.owned.contains(&self.vertices[local].into())
    }

    /// The number of a tet by its index within the part.
    pub fn tet(&self, index: u64) -> u64 {
        let (first_ghost, numbers) = &self.ghosts;
        match index.checked_sub(*first_ghost) {
            None => self.first_tet + index,
            Some(ghost) => numbers[ghost as usize],
        }
    }
}

/// **Collective.** Numbers the vertices so that those that a part owns are neighbours, and the tets so that those
/// of a part are neighbours; parts in the order of their ranks, entities in local order.
///
/// Two gathers of counts and one message to each neighbour: 16 bytes for each copy of a vertex.
/// Callers have made sure that the totals fit 32 bits.
pub(super) fn number(comm: &dyn Communicator, part: &dyn MeshStream) -> Result<Numbering, WriteError> {
    let rank = part.rank();
    let mut vertices = vec![0; part.counts().vertices as usize];
    let mut owned = 0;
    let mut shared = 0;
    for_each_vertex(part, |local, id, block| {
        shared += u64::from(!block.holders.is_empty() || !watchers(part, local).is_empty());
        if block.owner(id, rank) == rank {
            owned += 1;
            vertices[local as usize] = owned;
        }
    });

    let own_tets = part.ghosts().map_or(part.counts().tets, |ghosts| ghosts.first_tet);
    let [vertices_before] = comm.exclusive_scan([u64::from(owned)])?;
    for number in vertices.iter_mut().filter(|number| **number > 0) {
        *number += vertices_before as u32;
    }
    learn_from_owners(comm, part, &mut vertices)?;
    let mut next = 1;
    let first_tets = comm.all_gather_one(own_tets)?.into_iter().map(|tets| {
        next += tets;
        next - tets
    });
    let first_tets: Vec<u64> = first_tets.collect();
    let of_ghost = |tet: &GhostTet| first_tets[tet.owner as usize] + tet.index;
    let numbers = part.ghosts().map(|ghosts| ghosts.tets.iter().map(of_ghost).collect()).unwrap_or_default();
    let owned = vertices_before + 1..vertices_before + 1 + u64::from(owned);
    Ok(Numbering {
        vertices,
        owned,
        first_tet: first_tets[rank as usize],
        ghosts: (own_tets, numbers),
        shared,
    })
}

/// The ranks that have a vertex in ghost tets only.
pub(super) fn watchers(part: &dyn MeshStream, local: u32) -> &[Rank] {
    part.ghosts().map_or(&[], |ghosts| ghosts.watchers_of(local))
}

/// Calls `f(local index, global id, its block)` for each vertex in local order.
fn for_each_vertex(part: &dyn MeshStream, mut f: impl FnMut(u32, GlobalId, &VertexBlock)) {
    for index in 0..part.vertex_blocks() {
        let block = part.vertex_block(index);
        for (local, id) in block.local.clone().zip(block.first_id..) {
            f(local, id, &block);
        }
    }
}

/// **Collective.** Owners tell the other holders, and those who have a vertex in their ghosts, the numbers of shared vertices.
fn learn_from_owners(
    comm: &dyn Communicator,
    part: &dyn MeshStream,
    vertices: &mut [u32],
) -> Result<(), WriteError> {
    let rank = part.rank();
    let mut to_each: Vec<Vec<u64>> = vec![Vec::new(); part.ranks() as usize];
    let mut to_learn: Vec<(GlobalId, u32)> = Vec::new();
    for_each_vertex(part, |local, id, block| {
        if block.owner(id, rank) == rank {
            let others = block.holders.iter().filter(|&&holder| holder != rank);
            for &other in others.chain(watchers(part, local)) {
                to_each[other as usize].extend([id, u64::from(vertices[local as usize])]);
            }
        } else {
            to_learn.push((id, local));
        }
    });
    to_learn.sort_unstable();

    let messages = (0..).zip(to_each).filter(|(_, numbers)| !numbers.is_empty()).collect();
    let mut learnt = 0;
    for (from, numbers) in comm.exchange::<u64>(messages)? {
        for pair in numbers.chunks_exact(2) {
            let place = to_learn.binary_search_by_key(&pair[0], |(id, _)| *id).unwrap_or_else(|_| {
                panic!("rank {from} takes rank {rank} for a holder of vertex {}", pair[0])
            });
            vertices[to_learn[place].1 as usize] = pair[1] as u32;
            learnt += 1;
        }
    }
    assert_eq!(learnt, to_learn.len(), "rank {rank} holds shared vertices that their owners do not send");
    Ok(())
}
