//! How good a partition of a distributed mesh is.

use crate::comm::{CommError, Communicator};
use crate::dist::{DistMesh, Shared};
use crate::mesh::Rank;
use crate::mesh::topology::face_tets;

/// How good a partition is, the same on all ranks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Metrics {
    /// The number of parts.
    pub parts: u32,
    /// Tets in the smallest part.
    pub smallest: u64,
    /// Tets in the largest part.
    pub largest: u64,
    /// Tets in the largest part over the mean: 1 is perfect.
    pub imbalance: f64,
    /// Faces between parts.
    pub edge_cut: u64,
    /// Tets that are to go to another rank than holds them.
    pub moving: u64,
}

/// **Collective.** Measures the partition that gives each tet of this rank's part the part in `part`.
///
/// # Errors
/// If another rank fails.
///
/// # Panics
/// If there is not one part, below `parts`, for each tet.
pub fn measure(
    comm: &dyn Communicator,
    mesh: &DistMesh,
    part: &[Rank],
    parts: u32,
) -> Result<Metrics, CommError> {
    assert_eq!(part.len(), mesh.tets.len(), "rank {}: one part for each tet", mesh.rank);
    let mut sizes = vec![0u64; parts as usize];
    part.iter().for_each(|&p| sizes[p as usize] += 1);
    let all = comm.all_gather(&sizes)?;
    let sizes: Vec<u64> = (0..parts as usize).map(|p| all.iter().map(|sizes| sizes[p]).sum()).collect();
    let mut cut = 0;
    across_faces(comm, mesh, part, |a, b| cut += u64::from(a != b))?;
    let moving = part.iter().filter(|&&p| p != mesh.rank).count() as u64;
    let [edge_cut, moving] = comm.all_reduce_sum_u64([cut, moving])?;
    let largest = sizes.iter().copied().max().unwrap_or(0);
    Ok(Metrics {
        parts,
        smallest: sizes.iter().copied().min().unwrap_or(0),
        largest,
        imbalance: largest as f64 * f64::from(parts) / mesh.totals.tets.max(1) as f64,
        edge_cut,
        moving,
    })
}

/// **Collective.** Calls `visit` with what `of_tet` says of the two tets at each face between two; a face between ranks is visited on the lower one.
pub(super) fn across_faces(
    comm: &dyn Communicator,
    mesh: &DistMesh,
    of_tet: &[u32],
    mut visit: impl FnMut(u32, u32),
) -> Result<(), CommError> {
    let sides = face_tets(mesh.faces.len(), &mesh.tet_faces)
        .unwrap_or_else(|face| panic!("face {face:?} on rank {} has three tets", mesh.rank));
    for [first, second] in &sides {
        if *second != u32::MAX {
            visit(of_tet[*first as usize], of_tet[*second as usize]);
        }
    }
    // Faces ascend by global id on both ranks: what both say of their tets stands in the same order.
    let letters =
        by_other_holder(&mesh.shared_faces, mesh.rank, |face| of_tet[sides[face as usize][0] as usize]);
    let mine = letters.clone();
    for (from, theirs) in comm.exchange(letters)? {
        let (_, mine) = mine.iter().find(|(to, _)| *to == from).expect("both hold the faces between them");
        assert_eq!(mine.len(), theirs.len(), "ranks {} and {from} share faces", mesh.rank);
        if mesh.rank < from {
            mine.iter().zip(&theirs).for_each(|(&a, &b)| visit(a, b));
        }
    }
    Ok(())
}

/// What is said of each shared entity, for its other holders, by ascending rank.
fn by_other_holder(shared: &Shared, rank: Rank, say: impl Fn(u32) -> u32) -> Vec<(Rank, Vec<u32>)> {
    let mut letters = std::collections::BTreeMap::<Rank, Vec<u32>>::new();
    for (id, holders) in shared.iter() {
        for &other in holders.iter().filter(|&&holder| holder != rank) {
            letters.entry(other).or_default().push(say(id));
        }
    }
    letters.into_iter().collect()
}
