//! Boundary triangles between two parts, written once.
//!
//! A triangle on the interface of two bodies whose tets are in different parts is a boundary
//! triangle of both parts. A solver that sums over the parts would apply a load there twice. So the
//! part of the lower body number leaves the triangle out.
//!
//! Elmer's normal on an interface points out of the body with the higher number
//! (`CheckNormalDirection` in `fem/src/ElementDescription.F90`). If only one of the tets is known,
//! the normal points out of that tet. So the part of the higher body number writes the triangle,
//! and the normal is the same as if both tets were in one part.

use super::WriteError;
use crate::ground::comm::{CommError, Communicator};
use crate::ground::mesh::stream::{BoundaryBlock, Counts, MeshStream, NO_TET, vertex_block_of};
use crate::ground::mesh::{GlobalId, Names, Rank};

/// Boundary triangles that another part writes, by ascending index in this part.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct LeftOut(Vec<u64>);

impl LeftOut {
    /// Number of triangles left out.
    pub fn len(&self) -> u64 {
        self.0.len() as u64
    }

    /// Whether the triangle with this index in the part is left out.
    pub fn contains(&self, place: u64) -> bool {
        self.0.binary_search(&place).is_ok()
    }
}

/// Boundary triangles between this part and others.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Between {
    /// Those that the other part writes.
    pub left_out: LeftOut,
    /// Those that this part writes, by ascending index in it, with the number of the other part's
    /// tet.
    beside: Vec<[u64; 2]>,
}

impl Between {
    /// The number of the tet of another part at the triangle with this index in the part.
    pub fn tet_beside(&self, place: u64) -> Option<u64> {
        let found = self.beside.binary_search_by_key(&place, |triangle| triangle[0]);
        found.ok().map(|at| self.beside[at][1])
    }
}

/// The message to the directory rank of a triangle: its ascending global ids, the body number of
/// its tet, the side of that tet (0 behind, 1 in front), the triangle's index in the sender's part,
/// and the tet's number.
type Message = [u64; 7];

/// **Collective.** Finds the boundary triangles of this part that another part writes. The messages
/// have the size of the interfaces between bodies that are also cuts between parts.
///
/// # Errors
/// A body without a number, or a failed rank; on all ranks.
pub(crate) fn left_out(
    comm: &dyn Communicator,
    part: &dyn MeshStream,
    names: &Names,
) -> Result<LeftOut, WriteError> {
    Ok(between(comm, part, names, 0)?.left_out)
}

/// **Collective.** The number of triangles that lower ranks write, and the counts of the whole mesh
/// with each triangle once.
pub(crate) fn share_of_triangles(
    comm: &dyn Communicator,
    part: &dyn MeshStream,
    left_out: &LeftOut,
) -> Result<(u64, Counts), CommError> {
    let own = part.counts().boundary - left_out.len();
    let [before] = comm.exclusive_scan([own])?;
    let [boundary] = comm.all_reduce_sum_u64([own])?;
    Ok((before, Counts { boundary, ..part.totals() }))
}

/// **Collective.** Like [`left_out`], with the tets of other parts at the triangles that this part
/// writes; `first_tet` is the number of the part's first tet.
pub(crate) fn between(
    comm: &dyn Communicator,
    part: &dyn MeshStream,
    names: &Names,
    first_tet: u64,
) -> Result<Between, WriteError> {
    if part.ranks() == 1 {
        return Ok(Between::default());
    }
    let candidates = comm.agree(candidates(part, names, first_tet))?;
    let mut to_each: Vec<Vec<Message>> = vec![Vec::new(); comm.size() as usize];
    for message in candidates {
        to_each[(message[0] % u64::from(comm.size())) as usize].push(message);
    }
    let mut received: Vec<(Message, Rank)> = Vec::new();
    for (from, messages) in (0..).zip(comm.all_to_all(to_each)?) {
        received.extend(messages.into_iter().map(|message| (message, from)));
    }
    // The first copy writes: that of the higher body; for equal bodies (a sheet inside one) that
    // with the tet behind.
    received.sort_unstable_by_key(|([a, b, c, body, side, ..], from)| {
        ([*a, *b, *c], std::cmp::Reverse(*body), *side, *from)
    });
    // The triangle's index, and the number of the other tet for the part that writes.
    let mut replies: Vec<Vec<[u64; 2]>> = vec![Vec::new(); comm.size() as usize];
    for copies in received.chunk_by(|a, b| a.0[..3] == b.0[..3]) {
        for (k, ([.., place, _], from)) in copies.iter().enumerate() {
            let tet = if k == 0 { copies.get(1).map(|([.., tet], _)| *tet) } else { Some(NO_TET) };
            replies[*from as usize].extend(tet.map(|tet| [*place, tet]));
        }
    }
    let mut replies = comm.all_to_all(replies)?.concat();
    replies.sort_unstable();
    let (left_out, beside): (Vec<_>, Vec<_>) = replies.into_iter().partition(|[_, tet]| *tet == NO_TET);
    Ok(Between { left_out: LeftOut(left_out.into_iter().map(|[place, _]| place).collect()), beside })
}

/// The triangles that another part may have: one tet here, and all vertices shared with one other
/// rank.
fn candidates(part: &dyn MeshStream, names: &Names, first_tet: u64) -> Result<Vec<Message>, WriteError> {
    let mut candidates = Vec::new();
    let mut block = BoundaryBlock::default();
    let mut first = 0;
    for index in 0..part.boundary_blocks() {
        part.boundary_block(index, &mut block);
        for (place, (triangle, parents)) in (first..).zip(block.triangles.iter().zip(&block.parents)) {
            let side = match parents {
                [_, NO_TET] => 0,
                [NO_TET, _] => 1,
                _ => continue,
            };
            if let Some([a, b, c]) = ids_if_shared(part, triangle) {
                let body = super::body_number(block.bodies[side], names)?;
                candidates.push([a, b, c, body, side as u64, place, first_tet + parents[side]]);
            }
        }
        first += block.triangles.len() as u64;
    }
    Ok(candidates)
}

/// The ascending global ids of a triangle if another rank has all its vertices.
fn ids_if_shared(part: &dyn MeshStream, triangle: &[u32; 3]) -> Option<[GlobalId; 3]> {
    let mut ids = [0; 3];
    let mut common: Option<&[Rank]> = None;
    let mut blocks = [0; 3];
    for (k, &vertex) in triangle.iter().enumerate() {
        blocks[k] = vertex_block_of(part, vertex);
        let block = part.vertex_block(blocks[k]);
        if block.holders.is_empty() {
            return None;
        }
        ids[k] = block.first_id + u64::from(vertex - block.local.start);
        common = common.or(Some(block.holders));
    }
    let everywhere = |rank: &&Rank| {
        **rank != part.rank() && blocks.iter().all(|&block| part.vertex_block(block).holders.contains(rank))
    };
    common?.iter().find(everywhere)?;
    ids.sort_unstable();
    Some(ids)
}
