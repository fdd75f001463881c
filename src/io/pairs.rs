//! Pairs of periodic vertices by the numbers that a file has for them.

use super::WriteError;
use super::number::Numbering;
use crate::comm::Communicator;
use crate::mesh::stream::MeshStream;
use crate::periodic::Link;

/// **Collective.** On rank 0: the number of each image, that of the vertex that it is an image of, and the key of its link, ascending and each
/// once. Nothing on other ranks.
///
/// Owners send the number of each boundary vertex to the rank that its id names; owners of images ask there; what they learn goes to rank 0.
pub(super) fn pairs(
    comm: &dyn Communicator,
    part: &dyn MeshStream,
    numbering: &Numbering,
    key: impl Fn(usize, &Link) -> u64,
) -> Result<Vec<[u64; 3]>, WriteError> {
    if part.links().is_empty() {
        return Ok(Vec::new());
    }
    let ranks = u64::from(comm.size());
    let mut told: Vec<Vec<[u64; 2]>> = vec![Vec::new(); comm.size() as usize];
    for block in (0..part.vertex_blocks()).map(|index| part.vertex_block(index)) {
        if !block.on_boundary {
            continue;
        }
        for (local, id) in block.local.clone().zip(block.ids()) {
            if numbering.owns(local as usize) {
                told[(id % ranks) as usize].push([id, numbering.vertices[local as usize].into()]);
            }
        }
    }
    let mut asked: Vec<Vec<[u64; 3]>> = vec![Vec::new(); comm.size() as usize];
    for (index, link) in part.links().iter().enumerate() {
        for (local, of) in part.images(index) {
            if numbering.owns(local as usize) {
                let number = numbering.vertices[local as usize];
                asked[(of % ranks) as usize].push([of, number.into(), key(index, link)]);
            }
        }
    }
    let mut told = comm.all_to_all(told)?.concat();
    told.sort_unstable();
    let mut pairs: Vec<[u64; 3]> = comm.all_to_all(asked)?.concat();
    for pair in &mut pairs {
        let [of, number, key] = *pair;
        let place = told.binary_search_by_key(&of, |known| known[0]);
        let place =
            place.unwrap_or_else(|_| panic!("vertex {of}, of which {number} is an image, is on no boundary"));
        *pair = [number, told[place][1], key];
    }
    let mut pairs = comm.gather(0, &pairs)?.concat();
    pairs.sort_unstable();
    pairs.dedup();
    Ok(pairs)
}
