//! Sends view parts to rank 0.

use super::ViewPart;
use crate::ground::comm::pack::{put, take};
use crate::ground::comm::{CommError, Communicator};

/// **Collective.** The parts of all ranks on rank 0, by rank; the others get an empty list. A rank
/// can have several parts, or none.
///
/// # Errors
/// If the ranks cannot communicate.
pub fn gather(comm: &dyn Communicator, parts: Vec<ViewPart>) -> Result<Vec<ViewPart>, CommError> {
    if comm.size() == 1 {
        return Ok(parts);
    }
    let mut message = Vec::new();
    parts.iter().for_each(|part| put_part(&mut message, part));
    let mut all = Vec::new();
    for message in comm.gather_bytes(0, &message)? {
        let rest = &mut &message[..];
        while !rest.is_empty() {
            all.push(take_part(rest));
        }
    }
    Ok(all)
}

fn put_part(message: &mut Vec<u8>, part: &ViewPart) {
    let ViewPart { points, ids, tets, nodes, tet_ids, bodies, neighbours, patches, owners, quality } = part;
    put(message, points);
    put(message, ids);
    put(message, tets);
    put(message, nodes);
    put(message, tet_ids);
    put(message, bodies);
    put(message, neighbours);
    put(message, patches);
    put(message, owners);
    put(message, quality);
}

fn take_part(rest: &mut &[u8]) -> ViewPart {
    ViewPart {
        points: take(rest),
        ids: take(rest),
        tets: take(rest),
        nodes: take(rest),
        tet_ids: take(rest),
        bodies: take(rest),
        neighbours: take(rest),
        patches: take(rest),
        owners: take(rest),
        quality: take(rest),
    }
}
