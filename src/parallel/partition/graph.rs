//! Partition of the dual graph by METIS (feature `metis`), the only file that names it.

use super::PartitionError;
use super::dual::Dual;
use super::weighted::Graph;
use crate::ground::mesh::Rank;
use metis::option::Seed;
use std::sync::{Mutex, PoisonError};

/// METIS has global state (e.g. its random numbers), so calls are serialised.
static ONE_CALL: Mutex<()> = Mutex::new(());

/// Partitions by multilevel recursive bisection. Some parts may be empty if there are nearly as
/// many parts as tets.
///
/// Not k-way: in METIS 5.2.1, which the crate builds, its cut is 5 to 10 % worse than that of
/// bisection, while in 5.1.0 it was better.
pub fn bisect(dual: &Dual, parts: u32, seed: i32) -> Result<Vec<Rank>, PartitionError> {
    let (offsets, neighbours) = (bytemuck::cast_slice(&dual.offsets), bytemuck::cast_slice(&dual.neighbours));
    run(offsets, neighbours, None, parts, seed)
}

/// Partitions a weighted graph. Some parts may be empty if there are nearly as many parts as
/// vertices.
pub fn bisect_weighted(graph: &Graph, parts: u32, seed: i32) -> Result<Vec<Rank>, PartitionError> {
    let weights = Some([&graph.weights[..], &graph.edge_weights]);
    run(&graph.offsets, &graph.neighbours, weights, parts, seed)
}

/// Recursive bisection; the weights are those of vertices and edges.
fn run(
    offsets: &[i32],
    neighbours: &[i32],
    weights: Option<[&[i32]; 2]>,
    parts: u32,
    seed: i32,
) -> Result<Vec<Rank>, PartitionError> {
    let tets = offsets.len() - 1;
    let failed = |reason: String| PartitionError::Metis { tets, parts, reason };
    let refused = |error: &dyn std::fmt::Display| failed(error.to_string());
    let nparts = i32::try_from(parts).map_err(|_| failed("too many parts".into()))?;
    if i32::try_from(neighbours.len()).is_err() {
        return Err(failed("the graph has more than 2^31 entries".into()));
    }
    let mut part = vec![0; tets];
    let _one_call = ONE_CALL.lock().unwrap_or_else(PoisonError::into_inner);
    let mut graph = metis::Graph::new(1, nparts, offsets, neighbours).map_err(|error| refused(&error))?;
    if let Some([vertices, edges]) = weights {
        graph = graph.set_vwgt(vertices).set_adjwgt(edges);
    }
    graph.set_option(Seed(seed)).part_recursive(&mut part).map_err(|error| match error {
        metis::Error::Memory => PartitionError::MetisMemory { tets, parts },
        error => refused(&error),
    })?;
    Ok(part.into_iter().map(|p| Rank::try_from(p).expect("METIS numbers parts from 0")).collect())
}
