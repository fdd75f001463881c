//! Whether images are where the motion puts them.

use super::PeriodicMap;
use crate::Point;
use crate::comm::{CommError, Communicator};
use crate::mesh::GlobalId;
use crate::mesh::stream::MeshStream;
use crate::refine::RefinedMesh;

/// What became of the images of a mesh.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct Checked {
    /// Pairs, those of a vertex on several parts counted on each.
    pub pairs: u64,
    /// Images of vertices that no part has.
    pub lost: u64,
    /// The furthest that an image is from where the motion puts it (length).
    pub furthest: f64,
}

/// **Collective.** Compares each fine image with what it is the image of, wherever that is.
///
/// Both are sent to the rank that the global id names; messages grow with the periodic faces.
pub fn check(comm: &dyn Communicator, part: &RefinedMesh, map: &PeriodicMap) -> Result<Checked, CommError> {
    let ranks = u64::from(comm.size());
    let mut checked = Checked::default();
    for (index, link) in map.links.iter().enumerate() {
        let message = |id: GlobalId, point: [f64; 3]| {
            let [x, y, z] = point.map(f64::to_bits);
            [id, x, y, z]
        };
        let mut originals: Vec<Vec<[u64; 4]>> = vec![Vec::new(); comm.size() as usize];
        for local in map.pairs[index].fine_originals(part.coarse(), part.numbering()) {
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
    Ok(Checked { pairs, lost, furthest })
}
