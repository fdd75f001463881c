//! Periodic faces of parts that were filled separately. Their triangles are those of the refined
//! coarse mesh, so they are periodic; their pairs are found anew when all numbers are final.

use super::broadcast;
use super::error::Error;
use crate::ground::comm::Communicator;
use crate::ground::mesh::periodic::{Link, Pairs, PeriodicMap};
use crate::parallel::distribution::DistMesh;
use crate::parallel::repartition::periodic::gather_faces;

/// What all ranks know of periodic faces: the patches, and the distance within which points are
/// equal.
pub(super) struct Linked {
    links: Vec<Link>,
    distance: f64,
}

impl Linked {
    /// **Collective.** Broadcasts those of the coarse mesh, which rank 0 has.
    ///
    /// # Errors
    /// If a collective operation fails.
    pub fn broadcast(comm: &dyn Communicator, coarse: Option<&PeriodicMap>) -> Result<Self, Error> {
        let without_pairs = |map: &PeriodicMap| PeriodicMap {
            pairs: vec![Pairs::default(); map.links.len()],
            origins: Pairs::default(),
            ..map.clone()
        };
        let PeriodicMap { links, distance, .. } =
            broadcast::periodic(comm, coarse.map(without_pairs).as_ref())?;
        Ok(Self { links, distance })
    }

    /// The patches.
    pub fn links(&self) -> &[Link] {
        &self.links
    }

    /// **Collective.** The pairs of the periodic vertices, edges and faces.
    ///
    /// # Errors
    /// The same on all ranks: faces that are not periodic.
    pub fn pairs(&self, comm: &dyn Communicator, mesh: &DistMesh) -> Result<PeriodicMap, Error> {
        if self.links.is_empty() {
            return Ok(PeriodicMap::default());
        }
        let faces = gather_faces(comm, mesh, &self.links)?;
        let map = (comm.rank() == 0)
            .then(|| PeriodicMap::of_faces(&faces, self.links.clone(), self.distance))
            .transpose();
        broadcast::periodic(comm, comm.agree(map.map_err(Error::from))?.as_ref())
    }
}
