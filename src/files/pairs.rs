//! Pairs of periodic vertices by their numbers in a file.

use super::WriteError;
use super::number::Numbering;
use crate::ground::comm::Communicator;
use crate::ground::mesh::periodic::Link;
use crate::ground::mesh::stream::MeshStream;

/// **Collective.** Returns on rank 0 the file number of each periodic copy, that of its master, and
/// the key of its link, ascending and unique. Empty on other ranks.
///
/// Owners send the number of each boundary vertex to a directory rank computed from its id; owners
/// of copies request it there, and the pairs go to rank 0.
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
    let mut numbers: Vec<Vec<[u64; 2]>> = vec![Vec::new(); comm.size() as usize];
    for block in (0..part.vertex_blocks()).map(|index| part.vertex_block(index)) {
        if !block.on_boundary {
            continue;
        }
        for (local, id) in block.local.clone().zip(block.ids()) {
            if numbering.owns(local as usize) {
                numbers[(id % ranks) as usize].push([id, numbering.vertex(local)]);
            }
        }
    }
    let mut requests: Vec<Vec<[u64; 3]>> = vec![Vec::new(); comm.size() as usize];
    for (index, link) in part.links().iter().enumerate() {
        for (local, of) in part.images(index) {
            if numbering.owns(local as usize) {
                let number = numbering.vertex(local);
                requests[(of % ranks) as usize].push([of, number, key(index, link)]);
            }
        }
    }
    let mut numbers = comm.all_to_all(numbers)?.concat();
    numbers.sort_unstable();
    let mut pairs: Vec<[u64; 3]> = comm.all_to_all(requests)?.concat();
    for pair in &mut pairs {
        let [of, number, key] = *pair;
        let place = numbers.binary_search_by_key(&of, |known| known[0]);
        let place =
            place.unwrap_or_else(|_| panic!("vertex {of}, the master of {number}, is on no boundary"));
        *pair = [number, numbers[place][1], key];
    }
    let mut pairs = comm.gather(0, &pairs)?.concat();
    pairs.sort_unstable();
    pairs.dedup();
    Ok(pairs)
}
