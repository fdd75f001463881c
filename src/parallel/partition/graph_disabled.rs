//! The twin of the graph partitioner in a build without METIS: all functions fail.

use super::PartitionError;
use super::dual::Dual;
use super::weighted::Graph;
use crate::ground::mesh::Rank;

/// Fails: this build has no METIS.
pub fn bisect(_dual: &Dual, _parts: u32, _seed: i32) -> Result<Vec<Rank>, PartitionError> {
    Err(PartitionError::NoMetis)
}

/// Fails: this build has no METIS.
pub fn bisect_weighted(_graph: &Graph, _parts: u32, _seed: i32) -> Result<Vec<Rank>, PartitionError> {
    Err(PartitionError::NoMetis)
}
