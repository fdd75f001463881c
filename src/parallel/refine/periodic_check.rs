//! Check of the distance between periodic copies and their masters.

use super::RefinedMesh;
use super::periodic::fine_originals;
use crate::Point;
use crate::ground::comm::{CommError, Communicator};
use crate::ground::mesh::GlobalId;
use crate::ground::mesh::periodic::PeriodicMap;
use crate::ground::mesh::stream::MeshStream;

/// The check of the periodic faces of a mesh.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct PeriodicCheck {
    /// The number of pairs; a vertex on several parts counts once per part.
    pub pairs: u64,
    /// The number of copies whose master no part has.
    pub lost: u64,
    /// The largest distance between a copy and the mapped position of its master (length).
    pub furthest: f64,
}

/// **Collective.** Compares each fine periodic copy with its master, on whichever rank that is.
///
/// Both are sent to the directory rank of the master's global id; message sizes are proportional to
/// the periodic faces.
///
/// # Errors
/// [`CommError`] if another rank fails.
pub fn check_periodic(
    comm: &dyn Communicator,
    part: &RefinedMesh,
    map: &PeriodicMap,
) -> Result<PeriodicCheck, CommError> {
    let ranks = u64::from(comm.size());
    let mut checked = PeriodicCheck::default();
    for (index, link) in map.links.iter().enumerate() {
        let message = |id: GlobalId, point: [f64; 3]| {
            let [x, y, z] = point.map(f64::to_bits);
            [id, x, y, z]
        };
        let mut originals: Vec<Vec<[u64; 4]>> = vec![Vec::new(); comm.size() as usize];
        for local in fine_originals(&map.pairs[index], part.coarse(), part.numbering()) {
            let id = part.vertex_id(local);
            originals[(id % ranks) as usize].push(message(id, part.points()[local as usize]));
        }
        let mut images: Vec<Vec<[u64; 4]>> = vec![Vec::new(); comm.size() as usize];
        for (local, id) in part.images(index) {
            images[(id % ranks) as usize].push(message(id, part.points()[local as usize]));
        }
        let mut originals = comm.all_to_all(originals)?.concat();
        originals.sort_unstable();
        let images = comm.all_to_all(images)?.concat();
        let place = |&[_, x, y, z]: &[u64; 4]| Point::from([x, y, z].map(f64::from_bits));
        for image in &images {
            checked.pairs += 1;
            match originals.binary_search_by_key(&image[0], |original| original[0]) {
                Ok(at) => {
                    let off = (link.motion * place(&originals[at]) - place(image)).norm();
                    checked.furthest = checked.furthest.max(off);
                }
                Err(_) => checked.lost += 1,
            }
        }
    }
    let [pairs, lost] = comm.all_reduce_sum_u64([checked.pairs, checked.lost])?;
    let [furthest] = comm.all_reduce_max_f64([checked.furthest])?;
    Ok(PeriodicCheck { pairs, lost, furthest })
}
