//! Uniform refinement: each coarse tet becomes a lattice of n³ children, their boundary on the geometry.
//!
//! The fine mesh is not stored. A [`RefinedMesh`] keeps the coarse mesh and the **coordinates** of the fine
//! vertices (about 4 bytes a fine tet), from which it *streams* its tets, block by block ([`MeshStream`]). Fine
//! ids are arithmetic on coarse ids, so refinement needs no message and its result is the same, bit
//! by bit, for every number of ranks and threads.
//!
//! ```text
//!   lattice ── numbering ──► snap (coordinates) ──► diagonals, signs of all children ──► RefinedMesh
//! ```
//!
//! What [`refine()`] promises: no child is inverted or flat, by exact sign, and each boundary vertex is where
//! projection to its curve or patch put it. Where snapped children would invert it says so and where. The cure
//! belongs to the coarse mesh, before it is distributed: [`mend()`] bends edges there.
//!
//! [`MeshStream`]: crate::mesh::stream::MeshStream

pub mod bend;
pub mod blend;
pub mod census;
pub mod diagonal;
pub mod lattice;
pub mod mend;
pub mod numbering;
pub mod refined;
mod run;
pub mod snap;
pub mod stored;
mod tet;
pub mod trial;

pub use bend::Bends;
pub use census::{Census, census};
pub use mend::{Mended, mend};
pub use refined::RefinedMesh;
pub use stored::StoredMesh;
pub use trial::{Least, Trial, trial};

#[cfg(test)]
pub(crate) mod fixtures;
#[cfg(test)]
mod scale_tests;
#[cfg(test)]
mod tests;

use crate::check::Fault;
use crate::dist::DistMesh;
use crate::geometry::Projector;
use crate::mesh::{GlobalId, Rank};
use csg::ProjectionFailed;

/// How to refine.
#[derive(Clone, Debug)]
pub struct Settings {
    /// How many faults an error describes one by one.
    pub described: usize,
    /// Coarse edges to be bent, the same on all ranks.
    pub bends: Bends,
    /// Which coordinates are kept.
    pub keep: Keep,
}

/// Which coordinates a refined mesh keeps: they are nearly all of its memory.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Keep {
    /// All: 4 bytes a tet.
    #[default]
    All,
    /// Those in coarse vertices, edges and faces. Those inside a coarse tet, nearly all of a very large mesh, are computed anew, the same bits,
    /// whenever its children are asked for.
    Boundary,
}

impl Default for Settings {
    fn default() -> Self {
        Self { described: 8, bends: Bends::default(), keep: Keep::All }
    }
}

/// Why a part cannot be refined.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum RefineError {
    /// None, or beyond the finest lattice.
    #[error("an edge cannot be cut into {n} pieces: 1 to {} are possible", lattice::MAX_PIECES)]
    Pieces {
        /// The pieces asked for.
        n: u32,
    },
    /// Local vertex ids are 32-bit.
    #[error("rank {rank} would hold {needed} vertices, above the {} of one part: take more parts", u32::MAX)]
    TooManyVertices {
        /// The rank.
        rank: Rank,
        /// The fine vertices of its part.
        needed: u128,
    },
    /// Local tet ids are 32-bit where tets are stored.
    #[error(
        "rank {rank} would store {needed} tets, above the {} of one part: take more parts or stream",
        u32::MAX
    )]
    TooManyTets {
        /// The rank.
        rank: Rank,
        /// The fine tets of its part.
        needed: u64,
    },
    /// The arrays do not fit.
    #[error("rank {rank} has no memory for {bytes} bytes of the fine mesh")]
    OutOfMemory {
        /// The rank.
        rank: Rank,
        /// The bytes of the array that was refused.
        bytes: u64,
    },
    /// New boundary vertices that could not be put on the geometry.
    #[error("{count} coarse edges and faces could not be snapped to the geometry; {first}")]
    Projection {
        /// Coarse edges and faces with such a vertex.
        count: usize,
        /// The first such vertex.
        first: ProjectionFailed,
    },
    /// Children that are not positively oriented.
    #[error("{children} refined tets in {} coarse tets would be inverted or flat; {}", .coarse.len(),
            .faults.first().map_or_else(String::new, ToString::to_string))]
    Inverted {
        /// How many children.
        children: u64,
        /// The coarse tets they lie in, ascending.
        coarse: Vec<GlobalId>,
        /// The first of them, described.
        faults: Vec<Fault>,
    },
}

/// *Local.* Refines this rank's part: each edge is cut into `n` pieces (1 leaves the coarse mesh).
///
/// Work and memory grow with the fine vertices, n³/6 for each coarse tet. Errors concern this rank
/// alone: the caller agrees on them.
pub fn refine(
    mesh: DistMesh,
    projector: &Projector,
    n: u32,
    settings: &Settings,
) -> Result<RefinedMesh, RefineError> {
    let (refined, bad) = refine_unchecked(mesh, projector, n, settings)?;
    if bad.is_empty() { Ok(refined) } else { Err(tet::inverted(&bad, settings.described)) }
}

/// Refines, and hands out the mesh whatever its children are like, with the coarse tets that have bad ones.
fn refine_unchecked(
    mesh: DistMesh,
    projector: &Projector,
    n: u32,
    settings: &Settings,
) -> Result<(RefinedMesh, Vec<tet::BadTet>), RefineError> {
    let numbering = numbering::Numbering::new(&mesh, n)?;
    let points = snap::boundary_first(&mesh, projector, &numbering, settings)?;
    let (inside, bad) = tet::fill(&mesh, projector, &numbering, points, settings);
    Ok((RefinedMesh::new(mesh, numbering, inside), bad))
}

/// The least number of pieces to an edge with which `coarse` tets become at least `wanted`.
///
/// More than the finest lattice has if nothing less suffices: [`refine()`] then refuses it.
pub fn pieces_for(coarse: u64, wanted: u64) -> u32 {
    let enough = |n: &u32| u128::from(coarse) * u128::from(*n).pow(3) >= u128::from(wanted);
    (1..=lattice::MAX_PIECES).find(enough).unwrap_or(lattice::MAX_PIECES + 1)
}
