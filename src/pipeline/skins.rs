//! The method `surface` on all ranks: distributed coarse parts are meshed inside their refined
//! skins.

use super::error::Error;
use super::goal::Goal;
use super::model::Model;
use super::result::Refused;
use super::settings::Wanted;
use crate::ground::comm::Communicator;
use crate::ground::mesh::Mesh;
use crate::ground::progress::{Progress, Stage};
use crate::ground::projector::Projector;
use crate::ground::size::{Evaluation, SizeSettings};
use crate::parallel::distribution::{BareMesh, DistMesh};
use crate::parallel::skin::{self, DeliveredSizes, Filled, Improvement, PartSizes};

/// **Collective.** Fills the skins of all parts. Coarse edges are split into `pieces`, and the
/// sizes inside are smaller than the coarse sizes by the same factor, or as the goal requires.
///
/// # Errors
/// The same on all ranks: skins that cannot be snapped or filled.
pub(super) fn mesh_skins(
    comm: &dyn Communicator,
    dist: &DistMesh,
    (projector, pieces): (&Projector, u32),
    sizes: Option<&[f64]>,
    wanted: Wanted,
    how: Improvement,
    progress: &Progress,
) -> Result<(BareMesh, Refused, Option<DeliveredSizes>), Error> {
    let mut sizes = PartSizes::new(dist.points.clone(), dist.tets.clone(), skin::scatter(comm, dist, sizes)?);
    let expected: f64 = comm.all_gather_one(sizes.expected_tets())?.into_iter().sum();
    let mut goal = Goal::new(wanted, expected);
    let (skin, filled, delivered) = progress.stage(Stage::Fill, |_| {
        let skin = comm.agree(skin::skin(dist, projector, pieces).map_err(Error::from))?;
        let mut before = 1.0;
        loop {
            sizes.scale(goal.scale / before);
            before = goal.scale;
            let filled = skin::fill_or_refine(dist, projector, &skin, &sizes, how);
            let filled = comm.agree(filled.map_err(Error::from))?;
            if goal.is_reached(comm, filled.tets.len())? {
                let delivered = skin::delivered(comm, &skin.skin, &filled, &sizes)?;
                return Ok::<_, Error>((skin, filled, delivered));
            }
        }
    })?;
    let refused = Refused::gather(comm, &filled)?;
    let boundary = skin.numbering.totals().boundary;
    let bare = progress.stage(Stage::Number, |_| skin::number(comm, skin.skin, filled, boundary))?;
    Ok((bare, refused, delivered))
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
pub(super) fn wanted_sizes(model: &Model, coarse: &Mesh, size: &SizeSettings, pieces: u32) -> Vec<f64> {
    let field = model.size_field(size, Evaluation::Fine);
    skin::at_vertices(coarse, field.as_deref(), pieces)
}
