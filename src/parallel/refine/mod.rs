//! Uniform refinement: each coarse tet becomes a lattice of n³ children, with the boundary on the
//! geometry.
//!
//! The fine mesh is not stored. A [`RefinedMesh`] keeps the coarse mesh and the **coordinates** of
//! the fine vertices (about 4 bytes per fine tet), from which it *streams* its tets, block by block
//! ([`MeshStream`]). Fine ids are computed from coarse ids, so refinement needs no messages and the
//! result is bitwise the same for every number of ranks and threads.
//!
//! ```text
//!     lattice ── numbering ──► snap (coordinates) ──► diagonals, signs of all children ──► RefinedMesh
//! ```
//!
//! [`refine()`] guarantees that no child is inverted or flat (exact sign) and that each boundary
//! vertex is at its projection to its curve or patch. If projected children would invert, it
//! returns an error that locates them. Repair belongs to the coarse mesh, before distribution:
//! [`mend()`] displaces edges there.
//!
//! [`MeshStream`]: crate::ground::mesh::stream::MeshStream

pub mod blend;
mod curved;
mod cut;
pub mod diagonal;
pub mod displacements;
pub mod lattice;
pub mod mend;
pub mod numbering;
pub mod parents;
pub mod periodic;
mod periodic_check;
pub mod predicted;
pub mod refined;
mod rows;
mod run;
pub mod snap;
pub mod stored;
mod straight;
pub mod subset;
mod tet;
pub mod trial;

pub use displacements::EdgeDisplacements;
pub use mend::{Mended, mend, mend_near};
pub use periodic_check::{PeriodicCheck, check_periodic};
pub use predicted::{PredictedCounts, predicted_counts};
pub use refined::RefinedMesh;
pub use stored::StoredMesh;
pub use straight::refine_straightening;
pub use trial::{Least, Trial, trial};

#[cfg(test)]
pub(crate) mod fixtures;
#[cfg(test)]
mod order_tests;
#[cfg(test)]
mod scale_tests;
#[cfg(test)]
mod tests;

use crate::Point;
use crate::ground::error::{ErrorKind, HasKind};
use crate::ground::mesh::{GlobalId, Order, Rank};
use crate::ground::progress::{Cancelled, Work};
use crate::ground::projector::Projector;
use crate::parallel::check::Fault;
use crate::parallel::distribution::DistMesh;
use csg::ProjectionFailed;

/// Parameters of [`refine()`].
#[derive(Clone, Debug)]
pub struct Settings {
    /// The maximum number of faults that an error describes one by one.
    pub described: usize,
    /// Displacements of coarse edges, the same on all ranks.
    pub displacements: EdgeDisplacements,
    /// Which coordinates to store.
    pub keep: Keep,
    /// Whether all octahedra of a coarse tet are cut along the same diagonal, the best of the
    /// coarse tet, so that successive levels are nested ([`parents::of_tets`]). Otherwise each
    /// octahedron is cut along its own best diagonal.
    pub nested: bool,
    /// The order of the elements.
    pub order: Order,
    /// Nodes on edges that are not snapped, so that their edges are straight: global ids,
    /// ascending.
    pub straight: Vec<GlobalId>,
}

/// Which coordinates a refined mesh stores; they are nearly all of its memory.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Keep {
    /// All: 4 bytes per tet.
    #[default]
    All,
    /// Those on coarse vertices, edges and faces. Coordinates inside coarse tets, nearly all of a
    /// very large mesh, are recomputed (bitwise the same) each time they are needed.
    Boundary,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            described: 8,
            displacements: EdgeDisplacements::default(),
            keep: Keep::All,
            nested: false,
            order: Order::First,
            straight: Vec::new(),
        }
    }
}

/// Why a part cannot be refined.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum RefineError {
    /// Zero subdivisions per edge, or more than the finest lattice has.
    #[error("an edge cannot be cut into {n} pieces: 1 to {most} are possible")]
    Pieces {
        /// The requested subdivisions per edge.
        n: u32,
        /// The most that are possible with elements of this order.
        most: u32,
    },
    /// Local vertex ids are 32-bit.
    #[error("rank {rank} would hold {needed} vertices, above the {} of one part: take more parts", u32::MAX)]
    TooManyVertices {
        /// The rank.
        rank: Rank,
        /// The number of fine vertices of its part.
        needed: u128,
    },
    /// Local tet ids are 32-bit in stored meshes.
    #[error(
        "rank {rank} would store {needed} tets, above the {} of one part: take more parts or stream",
        u32::MAX
    )]
    TooManyTets {
        /// The rank.
        rank: Rank,
        /// The number of fine tets of its part.
        needed: u64,
    },
    /// Allocation of an array failed.
    #[error("rank {rank} has no memory for {bytes} bytes of the fine mesh")]
    OutOfMemory {
        /// The rank.
        rank: Rank,
        /// The bytes of the array that could not be allocated.
        bytes: u64,
    },
    /// Projection of new boundary vertices onto the geometry failed.
    #[error("{count} coarse edges and faces could not be snapped to the geometry; {first}")]
    Projection {
        /// The number of coarse edges and faces with such a vertex.
        count: usize,
        /// The first such vertex.
        first: ProjectionFailed,
    },
    /// The observer cancelled the run.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
    /// Children that are not positively oriented.
    #[error("{children} refined tets in {} coarse tets would be inverted or flat; {}", .coarse.len(),
            .faults.first().map_or_else(String::new, ToString::to_string))]
    Inverted {
        /// The number of such children.
        children: u64,
        /// The coarse tets that contain them, ascending.
        coarse: Vec<GlobalId>,
        /// The corners of these tets.
        corners: Vec<[Point; 4]>,
        /// Descriptions of the first of them.
        faults: Vec<Fault>,
    },
}

impl HasKind for RefineError {
    fn kind(&self) -> ErrorKind {
        match self {
            Self::Pieces { .. } => ErrorKind::Input,
            Self::Cancelled(_) => ErrorKind::Cancelled,
            Self::Projection { .. } | Self::Inverted { .. } => ErrorKind::NoMesh,
            Self::TooManyVertices { .. } | Self::TooManyTets { .. } | Self::OutOfMemory { .. } => {
                ErrorKind::Resources
            }
        }
    }
}

/// *Local.* Refines this rank's part: each edge is split into `n` (1 keeps the coarse mesh).
///
/// Work and memory are proportional to the fine vertices, about n³/6 per coarse tet.
///
/// # Errors
/// [`RefineError`] of this rank alone: the caller agrees on errors between ranks.
pub fn refine(
    mesh: DistMesh,
    projector: &Projector,
    n: u32,
    settings: &Settings,
) -> Result<RefinedMesh, RefineError> {
    refine_watched(mesh, projector, n, settings, Work::unwatched())
}

/// [`refine()`] that reports progress and can be cancelled.
pub fn refine_watched(
    mesh: DistMesh,
    projector: &Projector,
    n: u32,
    settings: &Settings,
    work: &Work,
) -> Result<RefinedMesh, RefineError> {
    let (refined, bad) = refine_reporting(mesh, projector, n, settings, work)?;
    if bad.is_empty() { Ok(refined) } else { Err(tet::inverted(&bad, settings.described)) }
}

/// *Local.* [`refine()`] for pictures: bad children are part of the mesh.
///
/// # Errors
/// As [`refine()`], except [`RefineError::Inverted`].
pub fn refine_as_is(
    mesh: DistMesh,
    projector: &Projector,
    n: u32,
    settings: &Settings,
) -> Result<RefinedMesh, RefineError> {
    Ok(refine_unchecked(mesh, projector, n, settings)?.0)
}

/// Refines without rejecting bad children; also returns the coarse tets that have some.
fn refine_unchecked(
    mesh: DistMesh,
    projector: &Projector,
    n: u32,
    settings: &Settings,
) -> Result<(RefinedMesh, Vec<tet::BadTet>), RefineError> {
    refine_reporting(mesh, projector, n, settings, Work::unwatched())
}

fn refine_reporting(
    mesh: DistMesh,
    projector: &Projector,
    n: u32,
    settings: &Settings,
    work: &Work,
) -> Result<(RefinedMesh, Vec<tet::BadTet>), RefineError> {
    let numbering = numbering::Numbering::new(&mesh, n, settings.order)?;
    let mut points = snap::boundary_first(&mesh, projector, &numbering, settings)?;
    straight::straighten(&mesh, &numbering, &settings.straight, &mut points);
    work.expect(mesh.tets.len() as u64 * u64::from(n).pow(3));
    work.step(0.0, 1.0, mesh.tets.len() as u64);
    let (inside, bad) = tet::fill(&mesh, projector, &numbering, points, settings, work)?;
    work.proceed()?;
    Ok((RefinedMesh::new(mesh, numbering, inside), bad))
}

/// Passes on a number of subdivisions per edge that a mesh of this order can have.
///
/// # Errors
/// [`RefineError::Pieces`] unless it is 1 to [`MAX_PIECES`](lattice::MAX_PIECES), or half of that
/// for second order.
pub fn possible_pieces(n: u32, order: Order) -> Result<u32, RefineError> {
    let most = lattice::MAX_PIECES / order.degree();
    if (1..=most).contains(&n) { Ok(n) } else { Err(RefineError::Pieces { n, most }) }
}

/// The smallest number of subdivisions per edge with which `coarse` tets become at least `wanted`.
///
/// Returns `MAX_PIECES + 1`, which [`possible_pieces`] rejects, if no lattice suffices.
pub fn pieces_for(coarse: u64, wanted: u64) -> u32 {
    let enough = |n: &u32| u128::from(coarse) * u128::from(*n).pow(3) >= u128::from(wanted);
    (1..=lattice::MAX_PIECES).find(enough).unwrap_or(lattice::MAX_PIECES + 1)
}
