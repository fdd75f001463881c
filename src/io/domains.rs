//! The bodies on both sides of boundary triangles, for the format that names them (NETGEN's).
//!
//! A part knows the bodies of its own tets. Beyond a triangle between two parts there is a tet of the other part: the one that leaves the triangle
//! out sends its body to the rank that the triangle's vertices name, and the one that writes it asks there.

use super::WriteError;
use super::joined::Whole;
use super::lines::TriangleLine;
use crate::comm::Communicator;
use crate::mesh::stream::MeshStream;
use csg::BodyId;

/// Bodies beside triangles.
pub(super) struct Domains {
    /// Bodies that are in other parts, by the index of the triangle among those that this part writes, ascending.
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
    let mut told: Vec<Vec<[u64; 4]>> = vec![Vec::new(); ranks];
    let mut asked: Vec<Vec<[u64; 3]>> = vec![Vec::new(); ranks];
    let mut askers: Vec<Vec<u64>> = vec![Vec::new(); ranks];
    let mut index = 0;
    whole.by_patch.visit(whole.part, |block, first| {
        let [behind, in_front] = block.bodies;
        for (place, triangle) in (first..).zip(&block.triangles) {
            let mut key = triangle.map(|v| u64::from(whole.numbering.vertices[v as usize]));
            key.sort_unstable();
            let directory = (key[0] % ranks as u64) as usize;
            if whole.left_out.contains(place) {
                let body = behind.or(in_front).expect("a triangle has a tet here");
                told[directory].push([key[0], key[1], key[2], body.0.into()]);
                continue;
            }
            let is_alone = behind.is_none() || in_front.is_none();
            if is_alone && triangle.iter().all(|&v| is_shared[v as usize]) {
                asked[directory].push(key);
                askers[directory].push(index);
            }
            index += 1;
        }
        Ok(())
    })?;
    let mut told = comm.all_to_all(told)?.concat();
    told.sort_unstable();
    // One more than the body, 0 for none.
    let answer = |key: &[u64; 3]| {
        let place = told.binary_search_by_key(key, |&[a, b, c, _]| [a, b, c]);
        place.map_or(0, |place| told[place][3] + 1)
    };
    let asked = comm.all_to_all(asked)?;
    let answers = comm.all_to_all(asked.iter().map(|keys| keys.iter().map(answer).collect()).collect())?;
    let found = askers.concat().into_iter().zip(answers.concat());
    let mut elsewhere: Vec<(u64, BodyId)> =
        found.filter_map(|(triangle, body)| Some((triangle, BodyId(body.checked_sub(1)? as u32)))).collect();
    elsewhere.sort_unstable_by_key(|(triangle, _)| *triangle);
    Ok(Domains { elsewhere })
}

/// For each vertex whether another part has it too.
fn shared(part: &dyn MeshStream) -> Vec<bool> {
    let mut shared = vec![false; part.counts().vertices as usize];
    for block in (0..part.vertex_blocks()).map(|index| part.vertex_block(index)) {
        let range = block.local.start as usize..block.local.end as usize;
        shared[range].fill(!block.holders.is_empty());
    }
    shared
}
