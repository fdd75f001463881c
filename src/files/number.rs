//! Numbers of entities in files: from 1 without gaps, and contiguous per part. Elmer sizes its
//! tables by the range of ids in a part, and formats that number vertices by their order in the
//! file need the vertices of a part to be contiguous.

use crate::files::WriteError;
use crate::ground::comm::Communicator;
use crate::ground::mesh::ghosts::GhostTet;
use crate::ground::mesh::stream::{MeshStream, TetBlock, VertexBlock};
use crate::ground::mesh::{GlobalId, Order, Rank};
use std::ops::Range;

/// The numbers of one part's entities, from 1; ghosts have the numbers of their own part.
#[derive(Debug)]
pub(super) struct Numbering {
    /// By local vertex index: its place among the vertices that this part owns, which have
    /// consecutive numbers, or two ranges of them; or behind these, among `copies`. So a number
    /// that may have 64 bits takes 32, except on interfaces.
    places: Vec<u32>,
    /// The numbers of the vertices that this part owns, without those in `owned_last`.
    pub owned: Range<u64>,
    /// The numbers of the vertices that this part owns and that are numbered behind those of all
    /// parts.
    owned_last: Range<u64>,
    /// The numbers of the others, in local order.
    copies: Vec<u64>,
    /// The number of the part's first tet; the others follow in local order.
    pub first_tet: u64,
    /// Index of the first ghost tet, and the numbers of ghost tets.
    ghosts: (u64, Vec<u64>),
    /// Number of vertices of this part, or of its ghosts, that other parts have too.
    pub shared: u64,
}

impl Numbering {
    /// Whether this part owns the vertex with this local index.
    pub fn owns(&self, local: usize) -> bool {
        u64::from(self.places[local]) < length(&self.owned) + length(&self.owned_last)
    }

    /// Whether this part owns the vertex, and it is numbered behind those of all parts.
    pub fn owns_last(&self, local: usize) -> bool {
        self.owns(local) && u64::from(self.places[local]) >= length(&self.owned)
    }

    /// The number of the vertex with this local index.
    pub fn vertex(&self, local: u32) -> u64 {
        let place = u64::from(self.places[local as usize]);
        let Some(place) = place.checked_sub(length(&self.owned)) else { return self.owned.start + place };
        match place.checked_sub(length(&self.owned_last)) {
            None => self.owned_last.start + place,
            Some(copy) => self.copies[copy as usize],
        }
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

fn length(range: &Range<u64>) -> u64 {
    range.end - range.start
}

/// **Collective.** Numbers vertices and tets such that those owned by a part are contiguous: parts
/// in rank order, entities in local order.
///
/// Takes two gathers of counts and one message to each neighbour, 16 bytes for each copy of a
/// vertex.
pub(super) fn number(comm: &dyn Communicator, part: &dyn MeshStream) -> Result<Numbering, WriteError> {
    number_with(comm, part, |_| false)
}

/// **Collective.** Like [`number`], but the corners of tets come first, then the nodes on edges:
/// two contiguous ranges for each part.
pub(super) fn number_corners_first(
    comm: &dyn Communicator,
    part: &dyn MeshStream,
) -> Result<Numbering, WriteError> {
    if part.order() == Order::First {
        return number(comm, part);
    }
    let mut is_corner = vec![false; part.counts().vertices as usize];
    let mut block = TetBlock::default();
    for index in 0..part.tet_blocks() {
        part.tet_block(index, &mut block);
        block.tets.iter().flatten().for_each(|&corner| is_corner[corner as usize] = true);
    }
    number_with(comm, part, |local| !is_corner[local as usize])
}

/// **Collective.** Numbers the vertices that are `last` behind all others. It must be the same on
/// all ranks that have a vertex.
fn number_with(
    comm: &dyn Communicator,
    part: &dyn MeshStream,
    last: impl Fn(u32) -> bool,
) -> Result<Numbering, WriteError> {
    let rank = part.rank();
    let mut places = vec![0; part.counts().vertices as usize];
    let (mut shared, mut counts) = (0, [0_u32; 3]);
    let kind = |local, id, block: &VertexBlock| {
        if block.owner(id, rank) == rank { usize::from(last(local)) } else { 2 }
    };
    for_each_vertex(part, |local, id, block| {
        shared += u64::from(!block.holders.is_empty() || !watchers(part, local).is_empty());
        counts[kind(local, id, block)] += 1;
    });
    let [owned, owned_last, _] = counts;
    let mut next = [0, owned, owned + owned_last];
    for_each_vertex(part, |local, id, block| {
        let next = &mut next[kind(local, id, block)];
        places[local as usize] = *next;
        *next += 1;
    });

    let own_tets = part.ghosts().map_or(part.counts().tets, |ghosts| ghosts.first_tet);
    let counts = [owned, owned_last].map(u64::from);
    let [before, last_before] = comm.exclusive_scan(counts)?;
    let [all, _] = comm.all_reduce_sum_u64(counts)?;
    let [owned, owned_last] = [(before, counts[0]), (all + last_before, counts[1])]
        .map(|(before, count)| before + 1..before + 1 + count);
    let ghosts = (own_tets, Vec::new());
    let mut numbering =
        Numbering { places, owned, owned_last, copies: Vec::new(), first_tet: 1, ghosts, shared };
    numbering.copies = receive_numbers(comm, part, |local| numbering.vertex(local))?;
    let mut next = 1;
    let first_tets = comm.all_gather_one(own_tets)?.into_iter().map(|tets| {
        next += tets;
        next - tets
    });
    let first_tets: Vec<u64> = first_tets.collect();
    let of_ghost = |tet: &GhostTet| first_tets[tet.owner as usize] + tet.index;
    numbering.ghosts.1 =
        part.ghosts().map(|ghosts| ghosts.tets.iter().map(of_ghost).collect()).unwrap_or_default();
    numbering.first_tet = first_tets[rank as usize];
    Ok(numbering)
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

/// **Collective.** Owners send the numbers of shared vertices, `own_number` of their local indices,
/// to the ranks that have copies or ghosts of them. Returns the received ones in local order.
fn receive_numbers(
    comm: &dyn Communicator,
    part: &dyn MeshStream,
    own_number: impl Fn(u32) -> u64,
) -> Result<Vec<u64>, WriteError> {
    let rank = part.rank();
    let mut to_each: Vec<Vec<u64>> = vec![Vec::new(); part.ranks() as usize];
    // The ids of the copies, with their places in local order.
    let mut missing: Vec<(GlobalId, u32)> = Vec::new();
    for_each_vertex(part, |local, id, block| {
        if block.owner(id, rank) == rank {
            let others = block.holders.iter().filter(|&&holder| holder != rank);
            for &other in others.chain(watchers(part, local)) {
                to_each[other as usize].extend([id, own_number(local)]);
            }
        } else {
            missing.push((id, missing.len() as u32));
        }
    });
    missing.sort_unstable();

    let messages = (0..).zip(to_each).filter(|(_, numbers)| !numbers.is_empty()).collect();
    let mut copies = vec![0; missing.len()];
    let mut received = 0;
    for (from, numbers) in comm.exchange::<u64>(messages)? {
        for pair in numbers.chunks_exact(2) {
            let place = missing.binary_search_by_key(&pair[0], |(id, _)| *id).unwrap_or_else(|_| {
                panic!("rank {from} sends the number of vertex {}, which rank {rank} does not have", pair[0])
            });
            copies[missing[place].1 as usize] = pair[1];
            received += 1;
        }
    }
    assert_eq!(
        received,
        missing.len(),
        "rank {rank} has shared vertices whose numbers their owners do not send"
    );
    Ok(copies)
}
