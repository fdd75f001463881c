//! `mesh.periodic`: pairs of nodes on periodic faces. Elmer itself has no such file, it finds partners anew by projection (`Periodic
//! BC`); this one spares other programs the search.
//!
//! ```text
//! # node, the node that it is the image of, identification; 1234 nodes in all
//! 87 3 1
//! ```

use super::number::Numbering;
use crate::comm::Communicator;
use crate::io::WriteError;
use crate::mesh::stream::MeshStream;

/// **Collective.** The text of the file, on rank 0, if faces are periodic.
///
/// Owners tell the rank that an id names the number of each boundary vertex; images ask there, once each; what they learn goes to rank 0.
pub(super) fn periodic_text(
    comm: &dyn Communicator,
    part: &dyn MeshStream,
    numbering: &Numbering,
) -> Result<Option<String>, WriteError> {
    if part.links().is_empty() {
        return Ok(None);
    }
    let (rank, ranks) = (part.rank(), u64::from(comm.size()));
    let mut told: Vec<Vec<[u64; 2]>> = vec![Vec::new(); comm.size() as usize];
    let mut is_owner = vec![false; part.points().len()];
    for index in 0..part.vertex_blocks() {
        let block = part.vertex_block(index);
        if !block.on_boundary {
            continue;
        }
        for (local, id) in
            block.local.clone().zip(block.ids()).filter(|(_, id)| block.owner(*id, rank) == rank)
        {
            is_owner[local as usize] = true;
            told[(id % ranks) as usize].push([id, numbering.vertices[local as usize].into()]);
        }
    }
    let mut asked: Vec<Vec<[u64; 3]>> = vec![Vec::new(); comm.size() as usize];
    for (index, link) in part.links().iter().enumerate() {
        for (local, of) in part.images(index).into_iter().filter(|(local, _)| is_owner[*local as usize]) {
            let number = numbering.vertices[local as usize];
            asked[(of % ranks) as usize].push([of, number.into(), link.identification.into()]);
        }
    }
    let mut told = comm.all_to_all(told)?.concat();
    told.sort_unstable();
    let mut pairs: Vec<[u64; 3]> = comm.all_to_all(asked)?.concat();
    for pair in &mut pairs {
        let [of, number, identification] = *pair;
        let place = told.binary_search_by_key(&of, |known| known[0]);
        let place =
            place.unwrap_or_else(|_| panic!("vertex {of}, of which {number} is an image, is on no boundary"));
        *pair = [number, told[place][1], identification];
    }
    let mut pairs = comm.gather(0, &pairs)?.concat();
    if rank != 0 {
        return Ok(None);
    }
    pairs.sort_unstable();
    pairs.dedup();
    let nodes = part.totals().vertices;
    let mut text =
        format!("# node, the node that it is the image of, identification; {nodes} nodes in all\n");
    for [image, of, identification] in pairs {
        text += &format!("{image} {of} {identification}\n");
    }
    Ok(Some(text))
}
