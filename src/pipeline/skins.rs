//! Method 3 on all ranks: distributed coarse parts, meshed inside their refined skins.

use super::generate::{CoarseResult, GenerateSettings};
use super::model::Model;
use crate::comm::Communicator;
use crate::dist::{BareMesh, DistMesh};
use crate::error::{Failure, agree};
use crate::geometry::Projector;
use crate::improve::{self, Effort};
use crate::progress::Progress;
use crate::refine;
use crate::skin::{self, Filled, PartSizes};

/// Fills the skins of all parts; coarse edges are cut into `pieces`, and tets inside are as much smaller than the coarse sizes.
///
/// # Errors
/// The same on all ranks: skins that cannot be snapped, or be filled in any way.
pub(super) fn mesh_skins(
    comm: &dyn Communicator,
    dist: &DistMesh,
    projector: &Projector,
    pieces: u32,
    sizes: Option<&[f64]>,
    effort: Effort,
    progress: &Progress,
) -> Result<(BareMesh, Refused), Failure> {
    let sizes = PartSizes::new(dist.points.clone(), dist.tets.clone(), skin::scatter(comm, dist, sizes)?);
    let made = progress.stage("fill", || {
        let skin = skin::skin(dist, projector, pieces)?;
        let filled = skin::fill_or_refine(dist, projector, &skin, &sizes, &improve::Settings::of(effort))?;
        Ok((skin, filled))
    });
    let (skin, filled) = agree(comm, made.map_err(|error: refine::RefineError| Failure::from(error)))?;
    let refused = Refused::gather(comm, &filled)?;
    let boundary = skin.numbering.totals().boundary;
    let bare = progress.stage("number", || skin::number(comm, skin.skin, filled, boundary))?;
    Ok((bare, refused))
}

/// Refuses geometries with periodic faces, on the rank that has one.
pub(super) fn refuse_periodic(model: Option<&Model>) -> Result<(), Failure> {
    match model {
        Some(Model::Csg(model)) if !model.features.identified.is_empty() => Err(Failure::input(
            "`identify periodic` is kept by the method `refine` only: leave out `-m`, or the identification",
        )),
        _ => Ok(()),
    }
}

/// Skins that the mesher refused, which the lattice filled instead.
#[derive(Clone, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct Refused {
    /// How many of all skins.
    pub skins: u64,
    /// What it said of the first of them, and on which rank.
    pub first: Option<(u32, String)>,
}

impl Refused {
    fn gather(comm: &dyn Communicator, filled: &Filled) -> Result<Self, Failure> {
        let mine = filled.refused.as_deref().unwrap_or_default();
        let all = comm.all_gather_bytes(mine.as_bytes())?;
        let said = (0..).zip(&all).filter(|(_, text)| !text.is_empty());
        let first =
            said.clone().next().map(|(rank, text)| (rank, String::from_utf8_lossy(text).into_owned()));
        Ok(Self { skins: said.count() as u64, first })
    }
}

/// The sizes wanted at the vertices of the coarse mesh, on the rank that has it.
pub(super) fn wanted_sizes(
    model: &Model,
    coarse: &CoarseResult,
    settings: &GenerateSettings,
    pieces: u32,
) -> Vec<f64> {
    let field = model.size_field(&settings.coarse.size);
    skin::at_vertices(&coarse.mesh, field.as_deref(), pieces)
}
