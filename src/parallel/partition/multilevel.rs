//! Partition of large graphs: METIS on a graph of clusters, then moves of single vertices at the
//! cuts.
//!
//! METIS contracts a graph by pairs of vertices, on one thread, once for each bisection. Here it
//! gets a graph that is contracted already, by clusters in blocks on all threads, and small enough
//! to take a fraction of a second. On the way back the partition is refined on each of the larger
//! graphs.

use super::contract::{Adjacency, cluster, contract};
use super::refine::refine;
use super::weighted::Graph;
use super::{PartitionError, graph};
use crate::ground::mesh::Rank;

/// The number of vertices that METIS gets for each part, at least.
const EACH: usize = 300;

/// The number of vertices that METIS gets, at least.
const LEAST: usize = 60_000;

/// Graphs are contracted if they have this many times as many vertices as METIS gets.
const LARGE: usize = 4;

/// A cluster is no heavier than this fraction of a part.
const HEAVIEST: f64 = 0.01;

/// The largest part may be heavier than the mean by this fraction.
const IMBALANCE: f64 = 0.002;

/// Whether a graph is so large that [`partition`] is used.
pub(super) fn is_large(vertices: usize, parts: u32) -> bool {
    vertices > LARGE * EACH.saturating_mul(parts as usize).max(LEAST)
}

/// Parts of about equal weight with few edges between them.
///
/// # Errors
/// Those of METIS.
pub(super) fn partition(graph: &impl Adjacency, parts: u32, seed: i32) -> Result<Vec<Rank>, PartitionError> {
    let total: i64 = (0..graph.len() as u32).map(|vertex| graph.weight(vertex)).sum();
    let mean = total as f64 / f64::from(parts);
    let clusters = cluster(graph, (HEAVIEST * mean) as i64);
    let coarse = contract(graph, &clusters.of, clusters.count);
    // Further contraction ends where it hardly helps.
    let of_cluster = if 2 * clusters.count < graph.len() {
        of_graph(&coarse, parts, seed)?
    } else {
        graph::bisect_weighted(&coarse, parts, seed)?
    };
    let mut part: Vec<Rank> = clusters.of.iter().map(|&cluster| of_cluster[cluster as usize]).collect();
    drop((coarse, clusters));
    refine(graph, &mut part, parts, ((1.0 + IMBALANCE) * mean).ceil() as i64);
    Ok(part)
}

/// Parts of a weighted graph of any size, as by [`partition`].
///
/// # Errors
/// Those of METIS.
pub(super) fn of_graph(graph: &Graph, parts: u32, seed: i32) -> Result<Vec<Rank>, PartitionError> {
    if is_large(graph.len(), parts) {
        partition(graph, parts, seed)
    } else {
        graph::bisect_weighted(graph, parts, seed)
    }
}

#[cfg(all(test, feature = "metis"))]
mod tests {
    use super::super::contract::WeightedDual;
    use super::super::{dual, matched_faces};
    use super::*;
    use crate::ground::mesh::fixtures::lattice_cube;

    #[test]
    fn large_graphs_are_cut_as_well_as_by_metis_alone() {
        let mesh = lattice_cube(36);
        let dual = dual::dual(&matched_faces(&mesh).unwrap());
        assert!(is_large(dual.len(), 7));
        let cut = |part: &[Rank]| {
            let across = |tet: usize| dual.of(tet).iter().filter(|&&o| part[o as usize] != part[tet]).count();
            (0..dual.len()).map(across).sum::<usize>() / 2
        };
        let alone = cut(&graph::bisect(&dual, 7, 1).unwrap());
        let part = partition(&dual, 7, 1).unwrap();
        assert!(cut(&part) < alone + alone / 10, "{} faces, METIS {alone}", cut(&part));
        let tets_of = |p: Rank| part.iter().filter(|&&q| q == p).count() as f64;
        let mean = dual.len() as f64 / 7.0;
        assert!((0..7).all(|p| tets_of(p) <= (1.0 + IMBALANCE) * mean + 1.0));
        // Twice as heavy at one end: parts there have fewer tets.
        let weights: Vec<i32> = (0..dual.len()).map(|tet| 1 + i32::from(2 * tet > dual.len())).collect();
        let part = partition(&WeightedDual { dual: &dual, weights: &weights }, 7, 1).unwrap();
        let mut sums = [0; 7];
        part.iter().zip(&weights).for_each(|(&p, &weight)| sums[p as usize] += weight);
        let mean = f64::from(sums.iter().sum::<i32>()) / 7.0;
        assert!(sums.iter().all(|&sum| f64::from(sum) <= (1.0 + IMBALANCE) * mean + 2.0), "{sums:?}");
        assert!(cut(&part) < 2 * alone);
    }
}
