//! Settings of a run.

use super::coarse::CoarseSettings;
use crate::mesher::facets;
use crate::parallel::decompose::{self, CutPlane};
use std::path::PathBuf;

/// How surfaces are read.
#[derive(Clone, Debug, Default)]
pub struct InputSettings {
    /// How patches, curves and corners of facets are distinguished.
    pub facets: facets::Settings,
    /// Whether the triangles of surfaces are kept; else the surface is remeshed by the size field.
    pub keep_surface: bool,
    /// Whether edges and faces of CAD files that are small beside the elements bound the elements;
    /// else they are merged into their neighbours.
    pub keep_small: bool,
    /// Surfaces of a `.geo` file that are of one kind and at most this far apart (length) are taken
    /// as one; by default 10⁻⁸ of the size of the geometry.
    pub merge: Option<f64>,
    /// The unit of lengths for STEP files, which have one of their own.
    pub unit: brep::Unit,
    /// The solids of a CAD file that are meshed, each by its name or number; all if there are none.
    pub solids: Vec<String>,
    /// Which of two solids of a CAD file that overlap keeps the common part; if it is `None`, they
    /// are refused.
    pub overlap_to: Option<brep::OverlapTo>,
}

/// How a geometry is cut.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CutSettings {
    /// How planes are chosen, unless the user sets them.
    pub plan: decompose::PlanSettings,
    /// The user's planes; each cuts all pieces that it meets.
    pub planes: Vec<CutPlane>,
}

/// How the parts are meshed.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum Method {
    /// Parts of a coarse mesh are refined uniformly.
    #[default]
    Refine,
    /// The surfaces of coarse parts are refined, and each part is meshed inside its surface by the
    /// sizes.
    Surface,
    /// The geometry is cut into pieces, and each piece is meshed.
    Decompose(CutSettings),
}

/// All settings of a run.
#[derive(Clone, Debug, Default)]
pub struct GenerateSettings {
    /// How the parts are meshed.
    pub method: Method,
    /// How the coarse mesh is made.
    pub coarse: CoarseSettings,
    /// The requested number of tets.
    pub wanted: Wanted,
    /// The number of times that the tets of separately meshed parts are refined; 0 with the method
    /// `refine`, which has `wanted`.
    pub refine: u32,
    /// The memory for the fine mesh on each machine, in bytes; by default its free memory.
    pub memory: Option<u64>,
    /// The planned output, so that a mesh that does not fit is refused before refinement.
    pub disk: Option<Disk>,
    /// Whether all octahedra of a coarse tet are split along one diagonal, so that the refinement
    /// levels are nested. Costs quality near curved boundaries.
    pub nested: bool,
    /// Whether edges of second order may be straight off the surface where the tets beside them
    /// would not be valid otherwise, as the last resort.
    pub allow_off_surface: bool,
    /// Whether to refuse a partition with periodic faces and their copies in different parts.
    pub periodic_together: bool,
}

impl GenerateSettings {
    /// What is requested of the mesh before its parts are refined.
    pub(super) fn before_refinement(&self) -> Request {
        let wanted = match self.wanted {
            Wanted::Elements(count) => Wanted::Elements(count.div_ceil(8_u64.pow(self.refine))),
            wanted => wanted,
        };
        Request { wanted, refined: 1 << self.refine }
    }
}

/// What is requested of a coarse mesh.
#[derive(Clone, Copy, Debug)]
pub(super) struct Request {
    /// The number of tets that is made of it, before a later refinement.
    pub wanted: Wanted,
    /// Subdivisions of each edge by that refinement.
    pub refined: u32,
}

/// The requested number of tets.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wanted {
    /// As the sizes yield, with refinement.
    Sizes {
        /// Subdivisions of each coarse edge.
        pieces: u32,
    },
    /// A coarse mesh with this many tets, with refinement.
    Coarse {
        /// Tets of the coarse mesh.
        tets: u64,
        /// Subdivisions of each coarse edge.
        pieces: u32,
    },
    /// This many to 1.3 times as many in total; the subdivisions are chosen.
    Elements(u64),
}

/// The planned output. The sizes are estimates, because the writers check exactly.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Disk {
    /// The folder.
    pub folder: PathBuf,
    /// Bytes for each vertex, tet and boundary triangle.
    pub bytes: [u64; 3],
    /// The largest number of vertices or tets that all formats support.
    pub most: Option<u64>,
    /// Bytes of memory for each tet that writers take besides the mesh.
    pub memory_of_tet: u64,
}

impl Default for Wanted {
    fn default() -> Self {
        Self::Sizes { pieces: 1 }
    }
}
