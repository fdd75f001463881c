//! Which rank should get which tet of a mesh that is distributed already, without bringing it together.
//!
//! ```text
//!   DistMesh ── repartition ──► destinations ── migrate ──► DistMesh, balanced
//! ```
//!
//! | method | how | cut |
//! |---|---|---|
//! | [`Geometric::Curve`] | stretches of a Hilbert curve through the centres of the tets, of equal weight | largest |
//! | [`Geometric::Bisection`] | recursive bisection across the longest side | smaller |
//! | [`Method::Smoothed`] | one of these, and fewer faces by [`smooth`] | smaller still |
//! | [`Method::Clusters`] | METIS on a coarse graph of clusters of tets, gathered on rank 0 (feature `metis`), and fewer faces by [`smooth`] | smallest |
//!
//! And [`diffuse()`] makes parts even that are not, by little movement; [`islands()`] brings small pieces of parts to those around them.
//!
//! All methods depend on the mesh and the number of parts alone, not on who holds what before. Parts are more, fewer or as many as ranks: a
//! part beyond the ranks needs ranks to hold it ([`migrate`](crate::migrate::migrate) refuses such destinations).

pub mod bisection;
mod clusters;
pub mod curve;
pub mod diffuse;
mod interfaces;
pub mod islands;
pub mod metrics;
pub mod smooth;
#[cfg(test)]
mod tests;

pub use diffuse::diffuse;
pub use interfaces::join_interfaces;
pub use islands::islands;
pub use metrics::{Metrics, measure};

use crate::comm::{Agreed, CommError, Communicator};
use crate::dist::DistMesh;
use crate::mesh::Rank;
use crate::mesh::topology::face_tets;
use crate::partition::PartitionError;

/// How to partition by where tets are: balanced to one tet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Geometric {
    /// Equal stretches of a Hilbert curve.
    Curve,
    /// Recursive coordinate bisection (Berger and Bokhari 1987).
    Bisection,
}

/// How to partition anew.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// By where tets are.
    Geometric(Geometric),
    /// The same with fewer faces between parts and interfaces in one part each, balanced to two percent.
    Smoothed(Geometric),
    /// Multilevel bisection by METIS (Karypis and Kumar 1998) of a graph of clusters, each a stretch of that curve; smoothed likewise.
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
        if cfg!(feature = "metis") { Self::graph() } else { Self::Smoothed(Geometric::Bisection) }
    }
}

impl std::fmt::Display for Geometric {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Curve => "stretches of a Hilbert curve",
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
    by_method(comm, mesh, None, parts, method)
}

/// **Collective.** The same for tets of unequal weight: a part below `parts` for each, so that the parts' weights are equal to within the heaviest
/// tets (by place) or one percent beside these (smoothed, by a graph). Where weights are very unequal a part may have no tet.
///
/// # Errors
/// More parts than tets, or none. The same rank's on all ranks.
///
/// # Panics
/// If there is not one weight for each tet.
pub fn repartition_weighted(
    comm: &dyn Communicator,
    mesh: &DistMesh,
    weights: &[u32],
    parts: u32,
    method: Method,
) -> Result<Vec<Rank>, RepartitionError> {
    assert_eq!(weights.len(), mesh.tets.len(), "rank {}: one weight for each tet", mesh.rank);
    by_method(comm, mesh, Some(weights), parts, method)
}

/// **Collective.** Parts of equal weight; without weights, of equal number.
fn by_method(
    comm: &dyn Communicator,
    mesh: &DistMesh,
    weights: Option<&[u32]>,
    parts: u32,
    method: Method,
) -> Result<Vec<Rank>, RepartitionError> {
    refuse_too_many(mesh, parts)?;
    let mut part = match method {
        Method::Geometric(how) | Method::Smoothed(how) => by_place(comm, mesh, weights, parts, how)?,
        Method::Clusters { per_part } => {
            let places = curve::places(comm, centers(mesh), &mesh.tet_ids, |_| 1)?;
            clusters::partition(comm, mesh, &places, weights, parts, per_part)?
        }
    };
    if parts > 1 && !matches!(method, Method::Geometric(_)) {
        smooth::smooth(comm, mesh, weights, &mut part, parts, &smooth::Settings::default())?;
        if weights.is_none() {
            join_interfaces(comm, mesh, &mut part, parts, JOINED)?;
        }
    }
    Ok(part)
}

/// Parts may be larger than the mean by this factor for the sake of interfaces between bodies that lie in one part each.
const JOINED: f64 = 1.02;

/// The tets at each face.
fn tets_at_faces(mesh: &DistMesh) -> Vec<[u32; 2]> {
    face_tets(mesh.faces.len(), &mesh.tet_faces)
        .unwrap_or_else(|face| panic!("face {face:?} on rank {} has three tets", mesh.rank))
}

fn refuse_too_many(mesh: &DistMesh, parts: u32) -> Result<(), PartitionError> {
    let tets = mesh.totals.tets as usize;
    match parts {
        0 => Err(PartitionError::NoParts),
        _ if tets < parts as usize => Err(PartitionError::MoreParts { parts, tets }),
        _ => Ok(()),
    }
}

/// The centres of tets, times four.
fn centers(mesh: &DistMesh) -> impl Iterator<Item = [f64; 3]> + Clone + '_ {
    mesh.tets.iter().map(|tet| curve::center(tet.map(|v| &mesh.points[v.index()].coords)))
}

/// **Collective.** Parts by where tets are, of equal weight; without weights, of equal number.
fn by_place(
    comm: &dyn Communicator,
    mesh: &DistMesh,
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
