//! The bodies on both sides of boundary triangles, which NETGEN files list.
//!
//! A part knows only the bodies of its own tets. For a triangle between two parts, the part that
//! leaves it out sends its body to a directory rank computed from the triangle's vertices, and the
//! part that writes it requests the body there.

use super::WriteError;
use super::joined::Whole;
use super::lines::TriangleLine;
use crate::ground::comm::Communicator;
use crate::ground::mesh::stream::MeshStream;
use csg::BodyId;

/// The bodies beside the triangles of a part.
pub(super) struct Domains {
    /// Bodies in other parts, by ascending index of the triangle among those that this part writes.
    elsewhere: Vec<(u64, BodyId)>,
}

impl Domains {
    /// The bodies behind and in front of a triangle.
    pub fn of(&self, line: &TriangleLine) -> [Option<BodyId>; 2] {
        let place = || self.elsewhere.binary_search_by_key(&line.index, |(triangle, _)| *triangle).ok();
        line.bodies.map(|here| here.or_else(|| Some(self.elsewhere[place()?].1)))
    }
}

/// **Collective.** Finds the bodies beside the triangles that this part writes.
pub(super) fn find(comm: &dyn Communicator, whole: &Whole) -> Result<Domains, WriteError> {
    if comm.size() == 1 {
        return Ok(Domains { elsewhere: Vec::new() });
    }
    let ranks = comm.size() as usize;
    let is_shared = shared(whole.part);
    let mut sent: Vec<Vec<[u64; 4]>> = vec![Vec::new(); ranks];
    let mut requests: Vec<Vec<[u64; 3]>> = vec![Vec::new(); ranks];
    let mut requested_by: Vec<Vec<u64>> = vec![Vec::new(); ranks];
    let mut index = 0;
    whole.by_patch.visit(whole.part, |block, first| {
        let [behind, in_front] = block.bodies;
        for (place, triangle) in (first..).zip(&block.triangles) {
            let mut key = triangle.map(|v| whole.numbering.vertex(v));
            key.sort_unstable();
            let directory = (key[0] % ranks as u64) as usize;
            if whole.left_out.contains(place) {
                let body = behind.or(in_front).expect("a triangle has a tet here");
                sent[directory].push([key[0], key[1], key[2], body.0.into()]);
                continue;
            }
            let is_alone = behind.is_none() || in_front.is_none();
            if is_alone && triangle.iter().all(|&v| is_shared[v as usize]) {
                requests[directory].push(key);
                requested_by[directory].push(index);
            }
            index += 1;
        }
        Ok(())
    })?;
    let mut sent = comm.all_to_all(sent)?.concat();
    sent.sort_unstable();
    // The body plus one; 0 if there is none.
    let reply = |key: &[u64; 3]| {
        let place = sent.binary_search_by_key(key, |&[a, b, c, _]| [a, b, c]);
        place.map_or(0, |place| sent[place][3] + 1)
    };
    let requests = comm.all_to_all(requests)?;
    let replies = comm.all_to_all(requests.iter().map(|keys| keys.iter().map(reply).collect()).collect())?;
    let found = requested_by.concat().into_iter().zip(replies.concat());
    let mut elsewhere: Vec<(u64, BodyId)> =
        found.filter_map(|(triangle, body)| Some((triangle, BodyId(body.checked_sub(1)? as u32)))).collect();
    elsewhere.sort_unstable_by_key(|(triangle, _)| *triangle);
    Ok(Domains { elsewhere })
}

/// Whether each vertex is shared with another part.
fn shared(part: &dyn MeshStream) -> Vec<bool> {
    let mut shared = vec![false; part.counts().vertices as usize];
    for block in (0..part.vertex_blocks()).map(|index| part.vertex_block(index)) {
        let range = block.local.start as usize..block.local.end as usize;
        shared[range].fill(!block.holders.is_empty());
    }
    shared
}
