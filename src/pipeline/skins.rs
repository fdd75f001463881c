//! The method `surface` on all ranks: distributed coarse parts are meshed inside their refined
//! skins.

use super::error::{Error, RequestError};
use super::model::Model;
use super::result::{CoarseResult, Refused};
use super::settings::GenerateSettings;
use crate::ground::comm::Communicator;
use crate::ground::progress::{Progress, Stage};
use crate::ground::projector::Projector;
use crate::mesher::improve::{self, Effort};
use crate::parallel::distribution::{BareMesh, DistMesh};
use crate::parallel::refine;
use crate::parallel::skin::{self, Filled, PartSizes};

/// **Collective.** Fills the skins of all parts. Coarse edges are split into `pieces`, and the
/// sizes inside are smaller than the coarse sizes by the same factor.
///
/// # Errors
/// The same on all ranks: skins that cannot be snapped or filled.
pub(super) fn mesh_skins(
    comm: &dyn Communicator,
    dist: &DistMesh,
    projector: &Projector,
    pieces: u32,
    sizes: Option<&[f64]>,
    effort: Effort,
    progress: &Progress,
) -> Result<(BareMesh, Refused), Error> {
    let sizes = PartSizes::new(dist.points.clone(), dist.tets.clone(), skin::scatter(comm, dist, sizes)?);
    let made = progress.stage(Stage::Fill, |_| {
        let skin = skin::skin(dist, projector, pieces)?;
        let filled = skin::fill_or_refine(dist, projector, &skin, &sizes, &improve::Settings::of(effort))?;
        Ok((skin, filled))
    });
    let (skin, filled) = comm.agree(made.map_err(|error: refine::RefineError| Error::from(error)))?;
    let refused = Refused::gather(comm, &filled)?;
    let boundary = skin.numbering.totals().boundary;
    let bare = progress.stage(Stage::Number, |_| skin::number(comm, skin.skin, filled, boundary))?;
    Ok((bare, refused))
}

/// Refuses geometries with periodic faces, on the rank that has the geometry.
pub(super) fn refuse_periodic(model: Option<&Model>) -> Result<(), RequestError> {
    match model {
        Some(Model::Csg(model)) if !model.features.identified.is_empty() => Err(RequestError::PeriodicMethod),
        _ => Ok(()),
    }
}

impl Refused {
    fn gather(comm: &dyn Communicator, filled: &Filled) -> Result<Self, Error> {
        let mine = filled.refused.as_ref().map(ToString::to_string).unwrap_or_default();
        let all = comm.all_gather_bytes(mine.as_bytes())?;
        let refusals = (0..).zip(&all).filter(|(_, text)| !text.is_empty());
        let first =
            refusals.clone().next().map(|(rank, text)| (rank, String::from_utf8_lossy(text).into_owned()));
        Ok(Self { skins: refusals.count() as u64, first })
    }
}

/// The requested sizes at the vertices of the coarse mesh, on the rank that has it.
pub(super) fn wanted_sizes(
    model: &Model,
    coarse: &CoarseResult,
    settings: &GenerateSettings,
    pieces: u32,
) -> Vec<f64> {
    let field = model.size_field(&settings.coarse.size);
    skin::at_vertices(&coarse.mesh, field.as_deref(), pieces)
}
