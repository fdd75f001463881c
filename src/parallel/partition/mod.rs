//! Serial partitioning: assigns the tets of a coarse mesh to ranks.
//!
//! Parts should be of equal size, with few faces between them: on each such face lie many vertices
//! of the refined mesh that ranks must share. The coarse mesh is partitioned once; all its tets are
//! refined alike, so the balance is kept.
//!
//! | method | cut | needs |
//! |---|---|---|
//! | [`Method::Metis`] | small | feature `metis` |
//! | [`Method::Bisection`] | 1.3 to 1.8 times that; on a plain box no larger | nothing |
//!
//! METIS gets graphs with many vertices for each part in a contracted form (`multilevel`), which
//! takes a fifth of the time.
//!
//! Deterministic: the same mesh gives the same parts. Every part has a tet; parts need not be
//! connected.

mod contract;
pub mod dual;
#[cfg(feature = "metis")]
mod graph;
#[cfg(not(feature = "metis"))]
#[path = "graph_disabled.rs"]
mod graph;
pub mod metrics;
mod multilevel;
mod periodic;
mod rcb;
mod refine;
pub mod ties;
pub mod weighted;

pub use metrics::Metrics;
pub use periodic::periodic_ties;

use crate::ground::error::{ErrorKind, HasKind};
use crate::ground::kernel::buckets::{map_each, ranges};
use crate::ground::mesh::topology::MatchedFaces;
use crate::ground::mesh::{BoundaryTriangle, Mesh, Rank, sorted_face, topology};
use contract::WeightedDual;
use dual::Dual;
use std::ops::Range;
use ties::{Clusters, Ties};

/// A partitioning method.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// Multilevel recursive bisection of the dual graph by METIS (Karypis and Kumar 1998).
    Metis,
    /// Recursive bisection of the tet centroids across the longest side of their box (Berger and
    /// Bokhari 1987).
    Bisection,
}

impl std::fmt::Display for Method {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Metis => "METIS recursive bisection",
            Self::Bisection => "recursive coordinate bisection",
        })
    }
}

/// Parameters of [`partition`].
#[derive(Clone, Copy, Debug)]
pub struct Settings {
    /// The method; METIS if it is built in.
    pub method: Method,
    /// Seed of METIS' random choices, not negative.
    pub seed: i32,
}

impl Default for Settings {
    fn default() -> Self {
        let method = if cfg!(feature = "metis") { Method::Metis } else { Method::Bisection };
        Self { method, seed: 1 }
    }
}

/// Why a mesh cannot be partitioned.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum PartitionError {
    /// Zero parts were requested.
    #[error("the number of parts must be at least 1")]
    NoParts,
    /// There are fewer tets than parts.
    #[error("{parts} parts need at least as many tets, but the mesh has {tets}: ask for a finer coarse mesh")]
    MoreParts {
        /// The requested parts.
        parts: u32,
        /// The number of tets.
        tets: usize,
    },
    /// Too many tets for 32-bit positions.
    #[error("{tets} tets are more than {}, the most that can be partitioned", topology::MAX_TETS)]
    TooManyTets {
        /// The number of tets.
        tets: usize,
    },
    /// A face has more than two tets, so the mesh is not a manifold.
    #[error("face {vertices:?} belongs to more than two tets")]
    NotAMesh {
        /// The vertices of the face.
        vertices: [u32; 3],
    },
    /// METIS was requested in a build without it.
    #[error(
        "this program was built without METIS: rebuild with the feature `metis`, or choose coordinate bisection"
    )]
    NoMetis,
    /// METIS failed.
    #[error("METIS cannot partition {tets} tets into {parts} parts: {reason}")]
    Metis {
        /// The number of tets.
        tets: usize,
        /// The requested parts.
        parts: u32,
        /// The error of METIS.
        reason: String,
    },
    /// METIS ran out of memory.
    #[error("METIS ran out of memory for {tets} tets and {parts} parts: take fewer coarse tets")]
    MetisMemory {
        /// The number of tets.
        tets: usize,
        /// The requested parts.
        parts: u32,
    },
}

impl HasKind for PartitionError {
    fn kind(&self) -> ErrorKind {
        match self {
            Self::TooManyTets { .. } | Self::MetisMemory { .. } => ErrorKind::Resources,
            Self::NotAMesh { .. } => ErrorKind::NoMesh,
            Self::NoParts | Self::MoreParts { .. } | Self::NoMetis | Self::Metis { .. } => ErrorKind::Input,
        }
    }
}

/// Assigns each tet of `mesh` a part below `parts`. The two tets of an interface between bodies are
/// in the same part as far as balance allows.
///
/// # Errors
/// [`PartitionError`] if `parts` is 0 or above the number of tets, if a face has three tets, or if
/// METIS fails.
pub fn partition(
    mesh: &Mesh,
    parts: u32,
    settings: &Settings,
) -> Result<(Vec<Rank>, Metrics), PartitionError> {
    partition_tied(mesh, parts, &Ties::default(), settings)
}

/// [`partition`] that also puts tied tets into the same part. [`Metrics::lost_ties`] counts the
/// violated ties: some may be if there are about as many parts as tets.
///
/// # Errors
/// As [`partition`].
pub fn partition_tied(
    mesh: &Mesh,
    parts: u32,
    ties: &Ties,
    settings: &Settings,
) -> Result<(Vec<Rank>, Metrics), PartitionError> {
    partition_weighted(mesh, parts, ties, None, settings)
}

/// [`partition_tied`] with parts of equal weight, where `weights` are those of the tets, such as
/// the numbers of fine tets that they will become. Coordinate bisection ignores them.
///
/// # Errors
/// As [`partition`].
///
/// # Panics
/// If there is not one weight for each tet.
pub fn partition_weighted(
    mesh: &Mesh,
    parts: u32,
    ties: &Ties,
    weights: Option<&[f64]>,
    settings: &Settings,
) -> Result<(Vec<Rank>, Metrics), PartitionError> {
    partition_matched(mesh, &matched_faces(mesh)?, parts, ties, weights, settings)
}

/// Refuses numbers of parts and tets that cannot be.
fn refuse_impossible(mesh: &Mesh, parts: u32) -> Result<(), PartitionError> {
    let tets = mesh.tets.len();
    if parts == 0 {
        return Err(PartitionError::NoParts);
    }
    if tets < parts as usize {
        return Err(PartitionError::MoreParts { parts, tets });
    }
    Ok(())
}

/// The faces of a mesh.
///
/// # Errors
/// [`PartitionError::NotAMesh`] if a face has three tets, [`PartitionError::TooManyTets`].
pub fn matched_faces(mesh: &Mesh) -> Result<MatchedFaces, PartitionError> {
    let tets = mesh.tets.len();
    if tets > topology::MAX_TETS {
        return Err(PartitionError::TooManyTets { tets });
    }
    topology::matched_faces(mesh.points.len(), &mesh.tets)
        .map_err(|vertices| PartitionError::NotAMesh { vertices: vertices.map(|v| v.0) })
}

/// [`partition_weighted`] of a mesh with these [`matched_faces`].
///
/// # Errors
/// As [`partition`].
///
/// # Panics
/// As [`partition_weighted`].
pub fn partition_matched(
    mesh: &Mesh,
    faces: &MatchedFaces,
    parts: u32,
    ties: &Ties,
    weights: Option<&[f64]>,
    settings: &Settings,
) -> Result<(Vec<Rank>, Metrics), PartitionError> {
    refuse_impossible(mesh, parts)?;
    let interfaces = interfaces(mesh, faces);
    let (part, repaired) = match parts {
        1 => (vec![0; mesh.tets.len()], 0),
        _ => assign(mesh, faces, &interfaces, parts, ties, weights, settings)?,
    };
    let mut metrics = metrics::measure(&faces.tets, &part, parts, Some(settings.method), repaired);
    metrics.cut_interfaces =
        interfaces.iter().filter(|[a, b]| part[*a as usize] != part[*b as usize]).count();
    metrics.lost_ties = ties::lost(ties, &part);
    if let Some(weights) = weights {
        metrics.imbalance = metrics::imbalance(&part, parts, weights);
    }
    Ok((part, metrics))
}

/// Assigns each tet one of several parts. Also returns the number of parts that the method left
/// empty and that were given a tet.
fn assign(
    mesh: &Mesh,
    faces: &MatchedFaces,
    interfaces: &[[u32; 2]],
    parts: u32,
    ties: &Ties,
    weights: Option<&[f64]>,
    settings: &Settings,
) -> Result<(Vec<Rank>, usize), PartitionError> {
    let dual = dual::dual(faces);
    let clusters = Clusters::new(mesh.tets.len(), ties, interfaces, parts);
    let whole = weights.map(weighted::whole_weights);
    let mut part = match (settings.method, &clusters) {
        (Method::Metis, None) => by_graph(&dual, whole.as_deref(), parts, settings.seed)?,
        (Method::Metis, Some(clusters)) => {
            let of_cluster =
                multilevel::of_graph(&clusters.graph(&dual, whole.as_deref()), parts, settings.seed)?;
            clusters.of.iter().map(|&cluster| of_cluster[cluster as usize]).collect()
        }
        (Method::Bisection, _) => rcb::bisect(mesh, parts),
    };
    if let Some(clusters) = &clusters {
        clusters.gather(&mut part);
        ties::settle_around(&dual, clusters, ties, parts, &mut part);
    }
    let repaired = metrics::fill_empty_parts(&dual, &mut part, parts);
    Ok((part, repaired))
}

/// Partitions the dual graph by METIS, with weights of the tets if there are any.
fn by_graph(
    dual: &Dual,
    weights: Option<&[i32]>,
    parts: u32,
    seed: i32,
) -> Result<Vec<Rank>, PartitionError> {
    match (multilevel::is_large(dual.len(), parts), weights) {
        (true, None) => multilevel::partition(dual, parts, seed),
        (true, Some(weights)) => multilevel::partition(&WeightedDual { dual, weights }, parts, seed),
        (false, None) => graph::bisect(dual, parts, seed),
        (false, Some(weights)) => graph::bisect_weighted(&dual.weighted(weights), parts, seed),
    }
}

/// The two tets of each boundary triangle between bodies.
fn interfaces(mesh: &Mesh, faces: &MatchedFaces) -> Vec<[u32; 2]> {
    let sides = |triangle: &BoundaryTriangle| {
        let face = faces.listed.faces.binary_search(&sorted_face(triangle.vertices)).ok()?;
        Some(faces.tets[face]).filter(|tets| tets[1] != u32::MAX)
    };
    let of_range = |range: Range<usize>| mesh.triangles[range].iter().filter_map(sides).collect::<Vec<_>>();
    map_each(ranges(mesh.triangles.len()), of_range).concat()
}

/// Measures an existing partition.
///
/// # Errors
/// [`PartitionError::NotAMesh`] if a face has three tets.
pub fn assess(mesh: &Mesh, part: &[Rank], parts: u32) -> Result<Metrics, PartitionError> {
    Ok(metrics::measure(&matched_faces(mesh)?.tets, part, parts, None, 0))
}

#[cfg(test)]
mod tests;
