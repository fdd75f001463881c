//! The numbers that Elmer's files bear: compact per part, since Elmer sizes its tables by the range of ids in a part.

use crate::comm::Communicator;
use crate::io::WriteError;
use crate::mesh::GlobalId;
use crate::mesh::stream::{MeshStream, VertexBlock};

/// The numbers of one part's entities, all from 1.
#[derive(Debug)]
pub(super) struct Numbering {
    /// By local vertex index.
    pub vertices: Vec<u32>,
    /// The number of the part's first tet; the others follow in local order.
    pub first_tet: u64,
    /// How many vertices of this part others hold too.
    pub shared: u64,
}

/// **Collective.** Numbers the vertices so that those that a part owns are neighbours, and the tets so that those
/// of a part are neighbours; parts in the order of their ranks, entities in local order.
///
/// One gather of counts and one message to each neighbour: 16 bytes for each copy of a vertex.
/// Callers have made sure that the totals fit 32 bits.
pub(super) fn number(comm: &dyn Communicator, part: &dyn MeshStream) -> Result<Numbering, WriteError> {
    let rank = part.rank();
    let mut vertices = vec![0; part.counts().vertices as usize];
    let mut owned = 0;
    let mut shared = 0;
    for_each_vertex(part, |local, id, block| {
        shared += u64::from(!block.holders.is_empty());
        if block.owner(id, rank) == rank {
            owned += 1;
            vertices[local as usize] = owned;
        }
    });

    let [vertices_before, tets_before] = comm.exclusive_scan([u64::from(owned), part.counts().tets])?;
    for number in vertices.iter_mut().filter(|number| **number > 0) {
        *number += vertices_before as u32;
    }
    learn_from_owners(comm, part, &mut vertices)?;
    Ok(Numbering { vertices, first_tet: 1 + tets_before, shared })
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

/// **Collective.** Owners tell the other holders the numbers of shared vertices.
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
            for &holder in block.holders.iter().filter(|&&holder| holder != rank) {
                to_each[holder as usize].extend([id, u64::from(vertices[local as usize])]);
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
