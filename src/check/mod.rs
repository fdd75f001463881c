//! The verdict on a mesh: faults with ids and places, shape statistics, and a checksum.
//!
//! All of it works on streams ([`MeshStream`]), so that a mesh need never be stored to be checked. A rank
//! checks its own part ([`check_part`], local); the parts' reports merge into the report of the mesh
//! ([`check()`], collective). The [`Checksum`] proves that two runs made the same mesh, whatever the
//! numbers of ranks and threads, and that every face is matched.
//!
//! [`MeshStream`]: crate::mesh::stream::MeshStream

pub mod angles;
pub mod boundary;
pub mod checksum;
pub mod part;
pub mod report;
pub mod shape;

pub use checksum::{Checksum, checksum, checksum_of_all};
pub use part::{Settings, check, check_part};
pub use report::{Extreme, OffSurface, PartReport, ShapeReport};

#[cfg(test)]
mod tests;

use crate::mesh::GlobalId;
use report::lenient;

/// Something wrong with a mesh.
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
    /// A tet or boundary triangle names a vertex that its part does not have.
    NoSuchVertex {
        /// The part.
        rank: u32,
        /// The local index it names.
        vertex: u32,
    },
    /// The vertex blocks or the tet blocks of a part leave a gap or overlap.
    Gap {
        /// The part.
        rank: u32,
        /// The local index of the vertex or tet where they do.
        at: u64,
    },
    /// A boundary triangle is not a face of the tet that it names, or is turned the wrong way.
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
        /// How far off it is, a length.
        #[serde(deserialize_with = "lenient::number")]
        distance: f64,
        /// Where it is.
        #[serde(deserialize_with = "lenient::place")]
        place: [f64; 3],
    },
    /// All parts together do not have as many vertices, tets or boundary triangles as they say.
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
