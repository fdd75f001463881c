//! The results of a run.

use super::coarse_mesh::CoarseReport;
use super::error::Error;
use super::part::{Evened, Part};
use super::target::Outcome;
use crate::ground::comm::Communicator;
use crate::ground::mesh::ghosts::{By, Ghosts};
use crate::ground::mesh::periodic::PeriodicMap;
use crate::ground::mesh::stream::MeshStream;
use crate::ground::mesh::{Arrays, GlobalId, Names, Order, Sharing};
use crate::ground::projector::Projector;
use crate::parallel::check::{Checksum, Extreme, PartReport, ShapeReport};
use crate::parallel::distribution::{BareMesh, DistMesh, number_shared};
use crate::parallel::interfaces;
use crate::parallel::partition::Metrics;
use crate::parallel::refine::{self, EdgeDisplacements, PeriodicCheck, RefinedMesh, parents};
use crate::parallel::skin::DeliveredSizes;
use crate::parallel::{halo, migrate};
use std::sync::Arc;

/// Statistics of the coarse mesh, on rank 0.
#[derive(Clone, Debug)]
pub struct CoarseResult {
    /// The edge displacements for refinement.
    pub displacements: EdgeDisplacements,
    /// Its statistics.
    pub report: CoarseReport,
    /// Whether the requested number of tets was reached, if one was requested.
    pub outcome: Option<Outcome>,
    /// Quality of the partition.
    pub partition: Metrics,
    /// The periodic entities of the mesh.
    pub periodic: PeriodicMap,
}

/// A checked mesh on each rank.
#[derive(Debug)]
pub struct Generated {
    /// This rank's part.
    pub part: Part,
    /// Subdivisions of each coarse edge.
    pub pieces: u32,
    /// The shapes of the tets of each refinement level, from the coarse mesh to the last; the same
    /// on all ranks.
    pub levels: Vec<Level>,
    /// Numbers and names of bodies and boundaries.
    pub names: Names,
    /// The check of the whole mesh, the same on all ranks.
    pub check: PartReport,
    /// Checksum of the mesh, independent of the number of ranks; the same on all ranks.
    pub checksum: Checksum,
    /// The check of periodic faces, if there are any; the same on all ranks.
    pub periodic: Option<PeriodicCheck>,
    /// Skins that the mesher could not fill, if parts were meshed inside skins; the same on all
    /// ranks.
    pub refused: Option<Refused>,
    /// The edge lengths relative to the size field, before interfaces are improved and parts are
    /// refined, if parts were meshed separately; the same on all ranks.
    pub delivered: Option<DeliveredSizes>,
    /// Result of the improvement across interfaces, if parts were meshed separately and had bad
    /// tets there; the same on all ranks.
    pub across: Option<interfaces::InterfaceReport>,
    /// Result of balancing separately meshed parts; the same on all ranks.
    pub evened: Option<Evened>,
    /// The edges of second order that are straight off the surface, the same on all ranks.
    pub straight: Vec<StraightEdge>,
    /// On rank 0 only.
    pub coarse: Option<CoarseResult>,
    /// How other levels are refined, if parts were refined.
    pub(super) refinement: Option<Refinement>,
}

/// Everything needed to refine other levels.
#[derive(Clone, Debug)]
pub(super) struct Refinement {
    pub projector: Projector,
    pub settings: refine::Settings,
}

/// The levels of a refinement on one rank, for multigrid.
///
/// All levels are refined from the same coarse part, so the parents of a vertex or tet are on its
/// own rank. All levels are snapped to the geometry: a coarser level is not a subset of the finest
/// one.
#[derive(Debug)]
pub struct Hierarchy {
    /// From the coarsest to the finest level; each splits coarse edges into twice as many
    /// subdivisions as the one before. The finest shares the memory of the mesh.
    pub levels: Vec<Arc<RefinedMesh>>,
    nested: bool,
}

impl Hierarchy {
    /// *Local.* The two parents of each vertex of a level (from 1) in the level before, by local
    /// index: the ends of the edge whose midpoint it is, or twice the same vertex. Linear
    /// interpolation is the mean of both.
    ///
    /// # Panics
    /// If this level or the one before does not exist.
    pub fn vertex_parents(&self, level: usize) -> Vec<[u32; 2]> {
        parents::of_vertices(&self.levels[level], &self.levels[level - 1]).expect("levels of one refinement")
    }

    /// *Local.* The tet of the level before that contains each tet of a level (from 1), by index
    /// within the part; `None` unless the mesh is [`nested`](crate::Mesher::nested).
    ///
    /// # Panics
    /// If this level or the one before does not exist.
    pub fn tet_parents(&self, level: usize) -> Option<Vec<u64>> {
        let (fine, coarse) = (&self.levels[level], &self.levels[level - 1]);
        self.nested.then(|| parents::of_tets(fine, coarse).expect("levels of one refinement"))
    }
}

impl Generated {
    /// This rank's part as a stream for the checker, the writers and other readers.
    pub fn stream(&self) -> &dyn MeshStream {
        self.part.stream()
    }

    /// *Local.* A copy of this rank's part as flat arrays.
    pub fn arrays(&self) -> Arrays {
        Arrays::of(self.stream())
    }

    /// *Local.* The vertices shared with other ranks, and their owners.
    pub fn sharing(&self) -> Sharing {
        Sharing::of(self.stream())
    }

    /// **Collective.** The tets of other parts adjacent to this one, with their vertices.
    ///
    /// # Errors
    /// If a part and its ghosts have more vertices than local ids.
    pub fn ghosts(&self, comm: &dyn Communicator, by: By) -> Result<Ghosts, Error> {
        Ok(halo::halo(comm, self.stream(), by)?)
    }

    /// **Collective.** This rank's part with all edges and faces of its tets, their global ids,
    /// classification and sharing ranks: for elements with unknowns there. Takes about 150 bytes a
    /// tet.
    ///
    /// The global ids of edges and faces are 0 to their number in the whole mesh, without gaps.
    /// Local numbers of vertices and tets are those of [`arrays`](Self::arrays).
    ///
    /// # Errors
    /// If there are more tets than local ids, or not enough memory.
    pub fn with_edges_and_faces(&self, comm: &dyn Communicator) -> Result<DistMesh, Error> {
        Ok(number_shared(comm, self.stored(comm)?)?)
    }

    /// **Collective.** A copy of this rank's part as stored tets, to be repartitioned and moved.
    /// Takes about 40 bytes a tet.
    ///
    /// # Errors
    /// If there are more tets than local ids, or not enough memory.
    pub fn stored(&self, comm: &dyn Communicator) -> Result<BareMesh, Error> {
        match &self.part {
            Part::Refined(part) => Ok(comm.agree(migrate::bare(part))?),
            Part::Stored(part) => Ok(part.mesh().clone()),
        }
    }

    /// *Local.* This rank's part of all refinement levels, the last being the mesh itself: coarse
    /// edges are split into m, 2m, 4m, … subdivisions, m odd. `None` if the parts were meshed
    /// separately, or the elements are of second order.
    ///
    /// # Errors
    /// If there is not enough memory.
    pub fn hierarchy(&self) -> Result<Option<Hierarchy>, Error> {
        let (Part::Refined(finest), Some(Refinement { projector, settings })) =
            (&self.part, &self.refinement)
        else {
            return Ok(None);
        };
        if finest.order() == Order::Second {
            return Ok(None);
        }
        let n = finest.pieces();
        let mut levels = Vec::new();
        for k in (1..=n.trailing_zeros()).rev() {
            let level = refine::refine(finest.coarse().clone(), projector, n >> k, settings)?;
            levels.push(Arc::new(level));
        }
        levels.push(Arc::clone(finest));
        Ok(Some(Hierarchy { levels, nested: settings.nested }))
    }
}

/// The tets of one refinement level.
#[derive(Clone, Debug, PartialEq)]
pub struct Level {
    /// Subdivisions of each coarse edge.
    pub pieces: u32,
    /// The number of tets.
    pub tets: u64,
    /// Their shapes; for second order those of the tets with straight edges.
    pub shape: ShapeReport,
    /// The smallest scaled Jacobian; `None` for first order, or if a lower level is not valid in
    /// second order.
    pub scaled_jacobian: Option<Extreme>,
}

impl Level {
    /// The level that a check measured; `None` if it has no shapes.
    pub(super) fn of(pieces: u32, check: &PartReport) -> Option<Self> {
        let shape = check.shape.clone()?;
        Some(Self { pieces, tets: check.tets, shape, scaled_jacobian: check.scaled_jacobian })
    }
}

/// An edge of second order on the boundary that is straight, because the tets beside it would not
/// be valid if its node were on the surface.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct StraightEdge {
    /// The global id of its node.
    pub node: GlobalId,
    /// The node's place.
    pub place: [f64; 3],
    /// The node's distance from the surface or curve (length).
    pub distance: f64,
}

/// Skins that the mesher could not fill, so that the lattice filled them, or not remesh.
#[derive(Clone, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct Refused {
    /// Number of these skins.
    pub skins: u64,
    /// The rank and the error of the first of them.
    pub first: Option<(u32, String)>,
    /// Number of skins whose triangles on patches stayed those of the lattice, because they could
    /// not be remeshed.
    pub kept: u64,
}
