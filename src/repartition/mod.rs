//! Which rank should get which tet of a mesh that is distributed already, without bringing it together.
//!
//! ```text
//!   DistMesh ── repartition ──► destinations ── migrate ──► DistMesh, balanced
//! ```
//!
//! | method | how | cut |
//! |---|---|---|
//! | [`Method::Curve`] | stretches of a Hilbert curve through the centres of the tets, of equal weight | largest |
//! | [`Method::SmoothedCurve`] | the same, and fewer faces by [`smooth`] | smaller |
//! | [`Method::Clusters`] | METIS on a coarse graph of clusters of tets, gathered on rank 0 (feature `metis`), and fewer faces by [`smooth`] | smallest |
//!
//! And [`diffuse()`] makes parts even that are not, by little movement.
//!
//! All methods depend on the mesh and the number of parts alone, not on who holds what before. Parts are more, fewer or as many as ranks: a
//! part beyond the ranks needs ranks to hold it ([`migrate`](crate::migrate::migrate) refuses such destinations).

mod clusters;
pub mod curve;
pub mod diffuse;
pub mod metrics;
pub mod smooth;
#[cfg(test)]
mod tests;

pub use diffuse::diffuse;
pub use metrics::{Metrics, measure};

use crate::comm::{Agreed, CommError, Communicator};
use crate::dist::DistMesh;
use crate::mesh::Rank;
use crate::partition::PartitionError;

/// How to partition anew.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// Equal stretches of a Hilbert curve, balanced to one tet.
    Curve,
    /// The same with fewer faces between parts, balanced to one percent.
    SmoothedCurve,
    /// Multilevel bisection by METIS (Karypis and Kumar 1998) of a graph of clusters, each a stretch of that curve.
    Clusters {
        /// Clusters for each part, [`MOST_CLUSTERS`] in all: the graph on rank 0 is as large as the parts times this.
        per_part: u32,
    },
}

impl Method {
    /// By a graph, as fine as it pays.
    pub fn graph() -> Self {
        Self::Clusters { per_part: 16_000 }
    }
}

impl Default for Method {
    fn default() -> Self {
        if cfg!(feature = "metis") { Self::graph() } else { Self::Curve }
    }
}

impl std::fmt::Display for Method {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Curve => f.write_str("stretches of a Hilbert curve"),
            Self::SmoothedCurve => f.write_str("stretches of a Hilbert curve, smoothed"),
            Self::Clusters { .. } => f.write_str("METIS on clusters, smoothed"),
        }
    }
}

/// The most clusters on rank 0: their graph then takes some 300 MB, and METIS some ten seconds.
pub const MOST_CLUSTERS: u64 = 1 << 21;

/// Why a distributed mesh cannot be partitioned anew.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum RepartitionError {
    /// What the serial partitioner says, or no parts, or more parts than tets.
    #[error(transparent)]
    Partition(#[from] PartitionError),
    /// Another rank met an error.
    #[error("rank {rank}: {message}")]
    Elsewhere {
        /// Which.
        rank: Rank,
        /// What it says.
        message: String,
    },
    /// The ranks cannot talk.
    #[error(transparent)]
    Comm(#[from] CommError),
}

impl From<Agreed<PartitionError>> for RepartitionError {
    fn from(agreed: Agreed<PartitionError>) -> Self {
        agreed.into_error(|rank, message| Self::Elsewhere { rank, message })
    }
}

/// **Collective.** A part below `parts` for each tet of this rank's part.
///
/// # Errors
/// More parts than tets, or none; what METIS says. The same rank's on all ranks.
pub fn repartition(
    comm: &dyn Communicator,
    mesh: &DistMesh,
    parts: u32,
    method: Method,
) -> Result<Vec<Rank>, RepartitionError> {
    let tets = mesh.totals.tets as usize;
    if parts == 0 {
        return Err(PartitionError::NoParts.into());
    }
    if tets < parts as usize {
        return Err(PartitionError::MoreParts { parts, tets }.into());
    }
    let centers = mesh.tets.iter().map(|tet| curve::center(tet.map(|v| &mesh.points[v.index()].coords)));
    let places = curve::places(comm, centers, &mesh.tet_ids)?;
    let mut part = match method {
        Method::Curve => return Ok(curve::stretches(&places, mesh.totals.tets, parts)),
        Method::SmoothedCurve => curve::stretches(&places, mesh.totals.tets, parts),
        Method::Clusters { per_part } => clusters::partition(comm, mesh, &places, parts, per_part)?,
    };
    if parts > 1 {
        smooth::smooth(comm, mesh, &mut part, parts, &smooth::Settings::default())?;
    }
    Ok(part)
}
