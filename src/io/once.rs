//! Boundary triangles between two parts, written once.
//!
//! A triangle on the interface of two bodies whose tets lie in different parts is a boundary triangle of both parts. A solver that adds up
//! what the parts say would apply a load there twice. So one of the two parts leaves the triangle out: that of the lower body number.
//!
//! Elmer's normal on an interface points out of the body of the higher number into the other (`CheckNormalDirection` in
//! `fem/src/ElementDescription.F90`). With only one tet at hand the normal points out of that tet. So the part of the higher body number
//! writes the triangle, and the normal is the same as where both tets are in one part.

use super::WriteError;
use crate::comm::Communicator;
use crate::mesh::stream::{BoundaryBlock, MeshStream, NO_TET, vertex_block_of};
use crate::mesh::{GlobalId, Names, Rank};

/// Boundary triangles that a part leaves out because another part writes them, by their places in the part, ascending.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct LeftOut(Vec<u64>);

impl LeftOut {
    /// How many.
    pub fn len(&self) -> u64 {
        self.0.len() as u64
    }

    /// Whether the triangle at this place, among all of the part, is left out.
    pub fn contains(&self, place: u64) -> bool {
        self.0.binary_search(&place).is_ok()
    }
}

/// What the directory rank of a triangle receives: its global ids ascending, the number of the body of its tet, on which side of it
/// that tet lies (0 behind, 1 in front), and its place in the part that sends it.
type Message = [u64; 6];

/// **Collective.** The boundary triangles of this part that another part writes. Messages are as large as the interfaces between bodies that
/// lie between parts.
///
/// # Errors
/// A body without a number; a rank that failed. On all ranks alike.
pub(crate) fn left_out(
    comm: &dyn Communicator,
    part: &dyn MeshStream,
    names: &Names,
) -> Result<LeftOut, WriteError> {
    if part.ranks() == 1 {
        return Ok(LeftOut::default());
    }
    let candidates = super::agree(comm, candidates(part, names))?;
    let mut to_each: Vec<Vec<Message>> = vec![Vec::new(); comm.size() as usize];
    for message in candidates {
        to_each[(message[0] % u64::from(comm.size())) as usize].push(message);
    }
    let mut received: Vec<(Message, Rank)> = Vec::new();
    for (from, messages) in (0..).zip(comm.all_to_all(to_each)?) {
        received.extend(messages.into_iter().map(|message| (message, from)));
    }
    // The first of two is the one that writes: the higher body; between equal bodies, as on a sheet inside of one, the tet behind.
    received.sort_unstable_by_key(|([a, b, c, body, side, _], from)| {
        ([*a, *b, *c], std::cmp::Reverse(*body), *side, *from)
    });
    let mut answers: Vec<Vec<u64>> = vec![Vec::new(); comm.size() as usize];
    for copies in received.chunk_by(|a, b| a.0[..3] == b.0[..3]) {
        for ([.., place], from) in &copies[1..] {
            answers[*from as usize].push(*place);
        }
    }
    let mut places = comm.all_to_all(answers)?.concat();
    places.sort_unstable();
    Ok(LeftOut(places))
}

/// The triangles that another part may have too: those with one tet here, and vertices that one other rank has.
fn candidates(part: &dyn MeshStream, names: &Names) -> Result<Vec<Message>, WriteError> {
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
                candidates.push([a, b, c, body, side as u64, place]);
            }
        }
        first += block.triangles.len() as u64;
    }
    Ok(candidates)
}

/// The global ids of a triangle, ascending, if another rank has all its vertices.
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
