//! Partition of a weighted graph, such as that of clusters of tets.

use super::{PartitionError, graph};
use crate::ground::mesh::Rank;
use rayon::prelude::*;

/// A weighted graph in compressed row storage.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Graph {
    /// The start of each vertex's neighbours; one more entry than vertices.
    pub offsets: Vec<i32>,
    /// The neighbours.
    pub neighbours: Vec<i32>,
    /// The weights of the edges to them.
    pub edge_weights: Vec<i32>,
    /// The weights of the vertices.
    pub weights: Vec<i32>,
}

impl Graph {
    /// A graph from vertex weights and edges `[a, b, weight]`; the weights of repeated edges add.
    pub fn new(weights: Vec<i32>, mut edges: Vec<[u32; 3]>) -> Self {
        edges = edges.into_iter().flat_map(|[a, b, weight]| [[a, b, weight], [b, a, weight]]).collect();
        edges.par_sort_unstable();
        let mut graph = Self { offsets: vec![0; weights.len() + 1], weights, ..Self::default() };
        for run in edges.chunk_by(|a, b| a[..2] == b[..2]) {
            graph.offsets[run[0][0] as usize + 1] += 1;
            graph.neighbours.push(run[0][1] as i32);
            graph.edge_weights.push(run.iter().map(|edge| edge[2] as i32).sum());
        }
        for vertex in 0..graph.weights.len() {
            graph.offsets[vertex + 1] += graph.offsets[vertex];
        }
        graph
    }
}

/// Positive weights as whole numbers in proportion, with a sum that METIS can add.
pub fn whole_weights(weights: &[f64]) -> Vec<i32> {
    /// Half of the largest number; each weight adds at most one by rounding up.
    const SUM: f64 = (1 << 30) as f64;
    let sum: f64 = weights.iter().sum();
    let scale = (SUM - weights.len() as f64) / sum;
    weights.iter().map(|weight| (weight * scale) as i32 + 1).collect()
}

/// Parts of about equal weight with a small weighted cut, by METIS' recursive bisection.
///
/// # Errors
/// [`PartitionError::NoMetis`] in a build without METIS, [`PartitionError::Metis`] if METIS fails.
pub fn bisect(graph: &Graph, parts: u32) -> Result<Vec<Rank>, PartitionError> {
    if parts == 1 {
        return Ok(vec![0; graph.weights.len()]);
    }
    graph::bisect_weighted(graph, parts, 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn edges_given_twice_add_and_each_is_in_both_rows() {
        let graph = Graph::new(vec![1, 2, 3], vec![[0, 1, 4], [1, 2, 1], [0, 1, 5]]);
        assert_eq!(graph.offsets, [0, 1, 3, 4]);
        assert_eq!(graph.neighbours, [1, 0, 2, 1]);
        assert_eq!(graph.edge_weights, [9, 9, 1, 1]);
    }

    #[test]
    fn whole_weights_are_positive_in_proportion_and_can_be_added() {
        let whole = whole_weights(&[1.0, 3.0, 1e-30]);
        assert_eq!(whole[2], 1);
        assert!((f64::from(whole[1]) / f64::from(whole[0]) - 3.0).abs() < 1e-6);
        assert!(whole.iter().map(|&w| i64::from(w)).sum::<i64>() <= 1 << 30);
    }

    #[cfg(feature = "metis")]
    #[test]
    fn the_lightest_edge_of_a_chain_is_cut() {
        let graph = Graph::new(vec![1; 4], vec![[0, 1, 9], [1, 2, 1], [2, 3, 9]]);
        let part = bisect(&graph, 2).unwrap();
        assert_eq!([part[0] == part[1], part[1] == part[2], part[2] == part[3]], [true, false, true]);
    }
}
