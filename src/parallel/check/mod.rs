//! Check of a mesh: faults with ids and positions, shape statistics, and a checksum.
//!
//! Everything works on streams ([`MeshStream`]), so a mesh need not be stored to be checked. A rank
//! checks its own part ([`check_part`], local); the reports of the parts merge into the report of
//! the mesh ([`check()`], collective). The [`Checksum`] proves that two runs made the same mesh,
//! whatever the numbers of ranks and threads, and that every face is matched.
//!
//! [`MeshStream`]: crate::ground::mesh::stream::MeshStream

pub mod angles;
pub mod boundary;
pub mod checksum;
mod curved;
pub mod part;
pub mod report;
pub mod shape;

pub use checksum::{Checksum, checksum, checksum_of_all};
pub use part::{Settings, check, check_and_sum, check_part, check_part_and_sum};
pub use report::{Extreme, OffSurface, PartReport, ShapeReport};

#[cfg(test)]
mod tests;

use crate::ground::mesh::GlobalId;
use report::lenient;

/// A fault of a mesh.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub enum Fault {
    /// A tet is inverted or flat.
    NotPositive {
        /// The global id of the tet.
        tet: GlobalId,
        /// Its centroid.
        #[serde(deserialize_with = "lenient::place")]
        place: [f64; 3],
    },
    /// A tet of second order whose Jacobian determinant is not proved positive.
    NotProved {
        /// The global id of the tet.
        tet: GlobalId,
        /// A lower bound of its scaled Jacobian: about the smallest determinant divided by the
        /// largest.
        #[serde(deserialize_with = "lenient::number")]
        scaled: f64,
        /// The centroid of its corners.
        #[serde(deserialize_with = "lenient::place")]
        place: [f64; 3],
    },
    /// A tet or boundary triangle refers to a vertex that its part does not have.
    NoSuchVertex {
        /// The part.
        rank: u32,
        /// The local index of the missing vertex.
        vertex: u32,
    },
    /// The vertex or tet blocks of a part leave a gap or overlap.
    Gap {
        /// The part.
        rank: u32,
        /// The local index of the vertex or tet at the gap or overlap.
        at: u64,
    },
    /// A boundary triangle is not a face of its parent tet, or has the wrong orientation.
    WrongParent {
        /// The global ids of its vertices.
        triangle: [GlobalId; 3],
        /// Its centroid.
        #[serde(deserialize_with = "lenient::place")]
        place: [f64; 3],
    },
    /// A vertex of a boundary triangle is not on the triangle's patch.
    OffSurface {
        /// The global id of the vertex.
        vertex: GlobalId,
        /// The patch, as an index.
        patch: u32,
        /// Its distance from the patch (length).
        #[serde(deserialize_with = "lenient::number")]
        distance: f64,
        /// Its position.
        #[serde(deserialize_with = "lenient::place")]
        place: [f64; 3],
    },
    /// The counts of all parts do not add up to the stated totals.
    Count {
        /// Vertices, tets and boundary triangles found.
        found: [u64; 3],
        /// Vertices, tets and boundary triangles stated.
        stated: [u64; 3],
    },
}

impl std::fmt::Display for Fault {
    fn fmt(&self, out: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::NotPositive { tet, place: [x, y, z] } => {
                write!(out, "tet {tet} at ({x}, {y}, {z}) is inverted or flat")
            }
            Self::NotProved { tet, scaled, place: [x, y, z] } => write!(
                out,
                "the ten-node tet {tet} at ({x}, {y}, {z}) is not proved valid: its scaled Jacobian is {scaled:.3} or more"
            ),
            Self::NoSuchVertex { rank, vertex } => {
                write!(out, "part {rank} names a vertex {vertex} it does not have")
            }
            Self::Gap { rank, at } => {
                write!(out, "part {rank} leaves a gap or an overlap at local index {at}")
            }
            Self::WrongParent { triangle: [p, q, r], place: [x, y, z] } => write!(
                out,
                "the boundary triangle of vertices {p}, {q}, {r} at ({x}, {y}, {z}) is no face of the tet it names"
            ),
            Self::OffSurface { vertex, patch, distance, place: [x, y, z] } => {
                write!(out, "vertex {vertex} at ({x}, {y}, {z}) is {distance:e} off patch {patch}")
            }
            Self::Count { found, stated } => write!(
                out,
                "the parts have {found:?} vertices, tets and boundary triangles, where {stated:?} are stated"
            ),
        }
    }
}
