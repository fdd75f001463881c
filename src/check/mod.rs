//! The verdict on a mesh: faults with ids and places, shape statistics, and a checksum.

use crate::mesh::GlobalId;

/// Something wrong with a mesh.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub enum Fault {
    /// A tet is inverted or flat.
    NotPositive {
        /// The global id of the tet.
        tet: GlobalId,
        /// Its centroid.
        place: [f64; 3],
    },
}

impl std::fmt::Display for Fault {
    fn fmt(&self, out: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::NotPositive { tet, place: [x, y, z] } => {
                write!(out, "tet {tet} at ({x}, {y}, {z}) is inverted or flat")
            }
        }
    }
}
