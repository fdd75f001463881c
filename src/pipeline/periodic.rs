//! Periodic faces of parts that were filled separately. Their triangles are those of the refined
//! coarse mesh, or of pieces that are periodic together; their pairs are found anew when all
//! numbers are final.

use super::broadcast;
use super::error::Error;
use super::model::Model;
use crate::ground::comm::Communicator;
use crate::ground::kernel::tree;
use crate::ground::mesh::Mesh;
use crate::ground::mesh::periodic::{self, Link, Pairs, PeriodicMap};
use crate::parallel::distribution::DistMesh;
use crate::parallel::repartition::periodic::gather_faces;
use csg::PatchId;
use std::collections::HashSet;

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

    /// The patches that are periodic copies or have some.
    pub fn patches(&self) -> HashSet<PatchId> {
        self.links.iter().flat_map(|link| [link.of, link.image]).collect()
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

/// The periodic entities of a coarse mesh.
pub(super) fn periodic_map(model: &Model, mesh: &Mesh) -> Result<PeriodicMap, Error> {
    let map = match model {
        Model::Csg(model) => PeriodicMap::of(mesh, periodic::links(&model.features), &model.features.bounds),
        Model::Given(given) => PeriodicMap::of(mesh, given.links.clone(), &tree::bounds(&mesh.points)),
        Model::Facets(_) => Ok(PeriodicMap::default()),
    };
    map.map_err(Error::from)
}
