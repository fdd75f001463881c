//! Partitioning of a mesh that is distributed already, without gathering it.
//!
//! ```text
//!     BareMesh ── Neighbours::find ──► neighbours ── repartition ──► destinations ── migrate_bare ──► BareMesh
//! ```
//!
//! | method | how | cut |
//! |---|---|---|
//! | [`Geometric::Curve`] | segments of equal weight of a Hilbert curve through the tet centroids | largest |
//! | [`Geometric::Bisection`] | recursive bisection across the longest side | smaller |
//! | [`Method::Smoothed`] | one of these, then fewer faces between parts by [`smooth`] | smaller still |
//! | [`Method::Clusters`] | METIS on a coarse graph of clusters of tets, gathered on rank 0 (feature `metis`), then [`smooth`] | smallest |
//!
//! In addition, [`diffuse()`] balances uneven parts with little migration, and
//! [`absorb_small_components`] moves small disconnected components of parts to the part around
//! them.
//!
//! All methods depend only on the mesh and the number of parts, not on the current distribution.
//! The number of parts may differ from the number of ranks, but only parts below the number of
//! ranks can be migrated to ([`migrate`](crate::parallel::migrate::migrate) rejects other
//! destinations).

pub mod bisection;
mod clusters;
pub mod components;
pub mod curve;
pub mod diffuse;
mod interfaces;
pub mod metrics;
mod neighbours;
pub(crate) mod periodic;
pub mod smooth;
#[cfg(test)]
mod tests;

pub use components::absorb_small_components;
pub use diffuse::diffuse;
pub use interfaces::join_interfaces;
pub use metrics::{Metrics, measure};
pub use neighbours::Neighbours;

use crate::ground::comm::{CommError, Communicator};
use crate::ground::error::{ErrorKind, HasKind};
use crate::ground::mesh::Rank;
use crate::parallel::distribution::BareMesh;
use crate::parallel::partition::PartitionError;

/// A geometric partition, balanced to one tet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Geometric {
    /// Segments of equal weight of a Hilbert curve.
    Curve,
    /// Recursive coordinate bisection (Berger and Bokhari 1987).
    Bisection,
}

/// A method of repartitioning.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// By tet centroids.
    Geometric(Geometric),
    /// A geometric partition with fewer faces between parts, and with interfaces between bodies
    /// inside one part each; balanced to two percent.
    Smoothed(Geometric),
    /// Multilevel bisection by METIS (Karypis and Kumar 1998) of a graph of clusters, each a
    /// segment of the Hilbert curve; smoothed likewise.
    Clusters {
        /// Clusters per part, at most 2²¹ in all. The graph on rank 0 has this many
        /// vertices per part.
        per_part: u32,
    },
}

impl Method {
    /// The graph method with the default number of clusters.
    pub fn graph() -> Self {
        Self::Clusters { per_part: 16_000 }
    }
}

impl Default for Method {
    fn default() -> Self {
        if cfg!(feature = "metis") { Self::graph() } else { Self::Smoothed(Geometric::Bisection) }
    }
}

impl std::fmt::Display for Geometric {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Curve => "segments of a Hilbert curve",
            Self::Bisection => "recursive coordinate bisection",
        })
    }
}

impl std::fmt::Display for Method {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Geometric(how) => how.fmt(f),
            Self::Smoothed(how) => write!(f, "{how}, smoothed"),
            Self::Clusters { .. } => f.write_str("METIS on clusters, smoothed"),
        }
    }
}

/// The maximum number of clusters on rank 0. Their graph then takes some 300 MB, and METIS some ten
/// seconds.
pub const MOST_CLUSTERS: u64 = 1 << 21;

/// Why a distributed mesh cannot be repartitioned.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum RepartitionError {
    /// The serial partitioner failed, or the number of parts is 0 or above the number of tets.
    #[error(transparent)]
    Partition(#[from] PartitionError),
    /// Another rank met an error, or the ranks cannot communicate.
    #[error(transparent)]
    Comm(#[from] CommError),
}

impl HasKind for RepartitionError {
    fn kind(&self) -> ErrorKind {
        match self {
            Self::Partition(error) => error.kind(),
            Self::Comm(error) => error.kind(),
        }
    }

    fn is_elsewhere(&self) -> bool {
        matches!(self, Self::Comm(error) if error.is_elsewhere())
    }
}

/// **Collective.** A part (below `parts`) for each tet of this rank's part.
///
/// # Errors
/// [`RepartitionError::Partition`] if `parts` is 0 or above the number of tets, or if METIS fails.
/// All ranks return an error.
pub fn repartition(
    comm: &dyn Communicator,
    mesh: &BareMesh,
    neighbours: &Neighbours,
    parts: u32,
    method: Method,
) -> Result<Vec<Rank>, RepartitionError> {
    by_method(comm, mesh, neighbours, None, parts, method)
}

/// **Collective.** [`repartition`] for tets of unequal weight.
///
/// The weights of the parts differ by the heaviest tets (geometric methods), and by one percent
/// more (smoothed and graph methods). If weights are very unequal, a part may have no tet.
///
/// # Errors
/// [`RepartitionError::Partition`] if `parts` is 0 or above the number of tets. All ranks return an
/// error.
///
/// # Panics
/// If `weights` does not have one entry per tet.
pub fn repartition_weighted(
    comm: &dyn Communicator,
    mesh: &BareMesh,
    neighbours: &Neighbours,
    weights: &[u32],
    parts: u32,
    method: Method,
) -> Result<Vec<Rank>, RepartitionError> {
    assert_eq!(weights.len(), mesh.tets.len(), "rank {}: expected one weight per tet", mesh.rank);
    by_method(comm, mesh, neighbours, Some(weights), parts, method)
}

/// **Collective.** Parts of equal weight; without weights, of equal tet count.
fn by_method(
    comm: &dyn Communicator,
    mesh: &BareMesh,
    neighbours: &Neighbours,
    weights: Option<&[u32]>,
    parts: u32,
    method: Method,
) -> Result<Vec<Rank>, RepartitionError> {
    refuse_too_many(mesh, parts)?;
    let mut part = match method {
        Method::Geometric(how) | Method::Smoothed(how) => by_place(comm, mesh, weights, parts, how)?,
        Method::Clusters { per_part } => {
            let places = curve::places(comm, centers(mesh), &mesh.tet_ids, |_| 1)?;
            clusters::partition(comm, mesh.totals.tets, neighbours, &places, weights, parts, per_part)?
        }
    };
    if parts > 1 && !matches!(method, Method::Geometric(_)) {
        let settings = smooth::Settings::default();
        smooth::smooth(comm, neighbours, &mesh.tet_ids, weights, &mut part, parts, &settings)?;
        if weights.is_none() {
            join_interfaces(comm, mesh, neighbours, &mut part, parts, JOINED)?;
        }
    }
    Ok(part)
}

/// Parts may exceed the mean size by this factor in order to contain interfaces between bodies.
const JOINED: f64 = 1.02;

fn refuse_too_many(mesh: &BareMesh, parts: u32) -> Result<(), PartitionError> {
    let tets = mesh.totals.tets as usize;
    match parts {
        0 => Err(PartitionError::NoParts),
        _ if tets < parts as usize => Err(PartitionError::MoreParts { parts, tets }),
        _ => Ok(()),
    }
}

/// The centroids of the tets, times four.
fn centers(mesh: &BareMesh) -> impl Iterator<Item = [f64; 3]> + Clone + '_ {
    mesh.tets.iter().map(|tet| curve::center(tet.map(|v| &mesh.points[v.index()])))
}

/// **Collective.** Geometric parts of equal weight; without weights, of equal tet count.
fn by_place(
    comm: &dyn Communicator,
    mesh: &BareMesh,
    weights: Option<&[u32]>,
    parts: u32,
    method: Geometric,
) -> Result<Vec<Rank>, CommError> {
    let weight = |tet: usize| weights.map_or(1, |weights| u64::from(weights[tet]));
    match method {
        Geometric::Curve => {
            let before = curve::places(comm, centers(mesh), &mesh.tet_ids, weight)?;
            let [total] = comm.all_reduce_sum_u64([(0..mesh.tets.len()).map(weight).sum()])?;
            let middle = |(tet, before): (usize, u64)| 2 * before + weight(tet);
            let middles = before.into_iter().enumerate().map(middle);
            Ok(curve::stretches(middles, 2 * total, parts))
        }
        Geometric::Bisection => {
            let centers: Vec<[f64; 3]> = centers(mesh).collect();
            let weights: Vec<u64> = (0..mesh.tets.len()).map(weight).collect();
            bisection::bisect(comm, &centers, &mesh.tet_ids, &weights, parts)
        }
    }
}
