//! Report of the halo of a partitioned mesh.

use super::counted;
use serde::Serialize;
use std::fmt;
use tetmill::comm::{CommError, Communicator};
use tetmill::mesh::{By, Ghosts};

/// Counts of the ghosts of all parts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct HaloReport {
    /// `faces` or `vertices`: what a ghost shares with the tets of the part.
    pub by: &'static str,
    /// Ghost tets, summed over the parts.
    pub tets: u64,
    /// Vertices that a part has only in ghost tets, summed over the parts.
    pub vertices: u64,
}

impl HaloReport {
    /// **Collective.** Counts the ghosts of all ranks.
    ///
    /// # Errors
    /// If another rank fails.
    pub fn new(comm: &dyn Communicator, by: By, ghosts: &Ghosts) -> Result<Self, CommError> {
        let [tets, vertices] =
            comm.all_reduce_sum_u64([ghosts.tets.len() as u64, ghosts.vertices.len() as u64])?;
        let by = match by {
            By::Faces => "faces",
            By::Vertices => "vertices",
        };
        Ok(Self { by, tets, vertices })
    }
}

impl fmt::Display for HaloReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let tets = counted(self.tets, "ghost tet", "ghost tets");
        let vertices = counted(self.vertices, "ghost vertex", "ghost vertices");
        writeln!(f, "halo       by {}: {tets}, {vertices}", self.by)
    }
}
