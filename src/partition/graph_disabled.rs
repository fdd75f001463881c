//! The twin of the graph partitioner in a build without METIS: it can only refuse.

use super::PartitionError;
use super::dual::Dual;
use super::weighted::Graph;
use crate::mesh::Rank;

/// Refuses: this build has no METIS.
pub fn bisect(_dual: &Dual, _parts: u32, _seed: i32) -> Result<Vec<Rank>, PartitionError> {
    Err(PartitionError::NoMetis)
}

/// Refuses: this build has no METIS.
pub fn bisect_weighted(_graph: &Graph, _parts: u32, _seed: i32) -> Result<Vec<Rank>, PartitionError> {
    Err(PartitionError::NoMetis)
}
