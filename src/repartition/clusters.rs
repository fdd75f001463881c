//! METIS on a coarse graph of clusters: equal stretches of the Hilbert curve, joined where their tets share faces.
//!
//! The graph is as large as the parts, not as the mesh, so that rank 0 can hold it. Stretches of the curve are compact; what they
//! lack in smoothness is the price for a graph that needs no rounds of matching between ranks.

use super::metrics::across_faces;
use super::{MOST_CLUSTERS, RepartitionError};
use crate::comm::Communicator;
use crate::dist::DistMesh;
use crate::mesh::Rank;
use crate::partition::weighted::{self, Graph};

/// **Collective.** See [`repartition`](super::repartition).
pub(super) fn partition(
    comm: &dyn Communicator,
    mesh: &DistMesh,
    places: &[u64],
    parts: u32,
    per_part: u32,
) -> Result<Vec<Rank>, RepartitionError> {
    let tets = mesh.totals.tets;
    let clusters = u64::from(parts).saturating_mul(u64::from(per_part.max(1))).min(tets);
    let clusters = clusters.min(MOST_CLUSTERS.max(parts.into()));
    let cluster = |place: u64| (u128::from(place) * u128::from(clusters) / u128::from(tets)) as u32;
    let of_tet: Vec<u32> = places.iter().map(|&place| cluster(place)).collect();

    let mut pairs = Vec::new();
    across_faces(comm, mesh, &of_tet, |a, b| {
        if a != b {
            pairs.push([a.min(b), a.max(b)]);
        }
    })?;
    pairs.sort_unstable();
    let counted: Vec<[u32; 3]> =
        pairs.chunk_by(|a, b| a == b).map(|run| [run[0][0], run[0][1], run.len() as u32]).collect();
    drop(pairs);

    let gathered = comm.gather(0, &counted)?;
    let part_of_cluster = if comm.rank() == 0 {
        let sizes =
            (0..clusters).map(|c| first_place(c + 1, clusters, tets) - first_place(c, clusters, tets));
        let graph = Graph::new(sizes.map(|size| size as i32).collect(), gathered.concat());
        weighted::bisect(&graph, parts)
    } else {
        Ok(Vec::new())
    };
    let mut part_of_cluster = comm.agree(part_of_cluster)?;
    comm.broadcast(0, &mut part_of_cluster)?;
    Ok(of_tet.into_iter().map(|cluster| part_of_cluster[cluster as usize]).collect())
}

/// The least place of cluster `cluster`: of those with `place · clusters / tets ≥ cluster`.
fn first_place(cluster: u64, clusters: u64, tets: u64) -> u64 {
    (u128::from(cluster) * u128::from(tets)).div_ceil(u128::from(clusters)) as u64
}
