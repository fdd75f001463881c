//! METIS on a coarse graph of clusters: equal segments of the Hilbert curve, adjacent if their tets
//! share faces.
//!
//! The size of the graph is proportional to the number of parts, not to the mesh, so rank 0 can
//! store it. Segments of the curve are compact but not smooth; in return, the graph needs no rounds
//! of matching between ranks.

use super::neighbours::Neighbours;
use super::{MOST_CLUSTERS, RepartitionError};
use crate::ground::comm::{CommError, Communicator};
use crate::ground::mesh::Rank;
use crate::parallel::partition::weighted::{self, Graph};

/// **Collective.** See [`repartition`](super::repartition). `tets` are those of the whole mesh, and
/// `places` the positions of the local ones on the curve.
pub(super) fn partition(
    comm: &dyn Communicator,
    tets: u64,
    neighbours: &Neighbours,
    places: &[u64],
    weights: Option<&[u32]>,
    parts: u32,
    per_part: u32,
) -> Result<Vec<Rank>, RepartitionError> {
    let clusters = u64::from(parts).saturating_mul(u64::from(per_part.max(1))).min(tets);
    let clusters = clusters.min(MOST_CLUSTERS.max(parts.into()));
    let cluster = |place: u64| (u128::from(place) * u128::from(clusters) / u128::from(tets)) as u32;
    let of_tet: Vec<u32> = places.iter().map(|&place| cluster(place)).collect();

    let mut pairs = Vec::new();
    neighbours.across_faces(comm, &of_tet, |a, b| {
        if a != b {
            pairs.push([a.min(b), a.max(b)]);
        }
    })?;
    pairs.sort_unstable();
    let counted: Vec<[u32; 3]> =
        pairs.chunk_by(|a, b| a == b).map(|run| [run[0][0], run[0][1], run.len() as u32]).collect();
    drop(pairs);

    let gathered = comm.gather(0, &counted)?;
    let heavy = match weights {
        Some(weights) => Some(gathered_weights(comm, &of_tet, weights, clusters)?),
        None => None,
    };
    let part_of_cluster = if comm.rank() == 0 {
        let size = |c: u64| (first_place(c + 1, clusters, tets) - first_place(c, clusters, tets)) as i32;
        let sizes = heavy.unwrap_or_else(|| (0..clusters).map(size).collect());
        let graph = Graph::new(sizes, gathered.concat());
        weighted::bisect(&graph, parts)
    } else {
        Ok(Vec::new())
    };
    let mut part_of_cluster = comm.agree(part_of_cluster.map_err(RepartitionError::from))?;
    comm.broadcast(0, &mut part_of_cluster)?;
    Ok(of_tet.into_iter().map(|cluster| part_of_cluster[cluster as usize]).collect())
}

/// **Collective.** The weights of clusters on rank 0, scaled so that METIS' 32-bit integers can
/// represent their sum.
fn gathered_weights(
    comm: &dyn Communicator,
    of_tet: &[u32],
    weights: &[u32],
    clusters: u64,
) -> Result<Vec<i32>, CommError> {
    let mut mine: Vec<[u64; 2]> = of_tet.iter().zip(weights).map(|(&c, &w)| [c.into(), w.into()]).collect();
    mine.sort_unstable();
    let sum = |run: &[[u64; 2]]| [run[0][0], run.iter().map(|[_, weight]| weight).sum()];
    let mine: Vec<[u64; 2]> = mine.chunk_by(|a, b| a[0] == b[0]).map(sum).collect();
    let gathered = comm.gather(0, &mine)?.concat();
    if comm.rank() != 0 {
        return Ok(Vec::new());
    }
    let mut sums = vec![0; clusters as usize];
    gathered.into_iter().for_each(|[cluster, weight]| sums[cluster as usize] += weight);
    let unit = sums.iter().sum::<u64>() / (i32::MAX / 2) as u64 + 1;
    Ok(sums.into_iter().map(|sum| sum.div_ceil(unit) as i32).collect())
}

/// The first position in cluster `cluster`, i.e. the smallest with `place · clusters / tets ≥
/// cluster`.
fn first_place(cluster: u64, clusters: u64, tets: u64) -> u64 {
    (u128::from(cluster) * u128::from(tets)).div_ceil(u128::from(clusters)) as u64
}
