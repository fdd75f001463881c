//! The method `surface` on all ranks: distributed coarse parts are meshed inside their refined
//! skins.

use super::error::Error;
use super::goal::Goal;
use super::model::Model;
use super::result::Refused;
use super::settings::Wanted;
use crate::ground::comm::Communicator;
use crate::ground::mesh::topology::MatchedFaces;
use crate::ground::mesh::{Mesh, Rank};
use crate::ground::progress::{Progress, Stage};
use crate::ground::projector::Projector;
use crate::ground::size::{Evaluation, SizeSettings};
use crate::parallel::distribution::{BareMesh, DistMesh};
use crate::parallel::partition::ties::Ties;
use crate::parallel::partition::{self, Metrics, PartitionError, metrics};
use crate::parallel::skin::{self, DeliveredSizes, Filled, Improvement, PartSizes};
use csg::PatchId;
use std::collections::HashSet;

/// **Collective.** Fills the skins of all parts. Coarse edges are split into `pieces`, and the
/// sizes inside are smaller than the coarse sizes by the same factor, or as the goal requires.
///
/// # Errors
/// The same on all ranks: skins that cannot be snapped or filled.
pub(super) fn mesh_skins(
    comm: &dyn Communicator,
    dist: &DistMesh,
    (projector, pieces): (&Projector, u32),
    (sizes, stay): (Option<&[f64]>, &HashSet<PatchId>),
    wanted: Wanted,
    how: Improvement,
    progress: &Progress,
) -> Result<(BareMesh, Refused, Option<DeliveredSizes>), Error> {
    let mut sizes = PartSizes::new(dist.points.clone(), dist.tets.clone(), skin::scatter(comm, dist, sizes)?);
    let expected: f64 = comm.all_gather_one(sizes.expected_tets())?.into_iter().sum();
    let mut goal = Goal::new(wanted, expected);
    let (skin, boundary, filled, delivered) = progress.stage(Stage::Fill, |_| {
        let skin = comm.agree(skin::skin(dist, projector, pieces).map_err(Error::from))?;
        let free = skin::FreeFaces::of(&skin.skin, projector, stay);
        let mut before = 1.0;
        loop {
            sizes.scale(goal.scale / before);
            before = goal.scale;
            let made = skin::remesh_and_fill(dist, projector, (&skin, free.as_ref()), &sizes, how);
            let (remeshed, filled) = comm.agree(made.map_err(Error::from))?;
            if goal.is_reached(comm, filled.tets.len())? {
                let of_lattice = skin.numbering.totals().boundary;
                let boundary =
                    skin::boundary(comm, [&skin.skin, remeshed.as_ref().unwrap_or(&skin.skin)], of_lattice)?;
                let skin = remeshed.unwrap_or(skin.skin);
                let delivered = skin::delivered(comm, &skin, &filled, &sizes)?;
                return Ok::<_, Error>((skin, boundary, filled, delivered));
            }
        }
    })?;
    let refused = Refused::gather(comm, &filled)?;
    let bare = progress.stage(Stage::Number, |_| skin::number(comm, skin, filled, boundary))?;
    Ok((bare, refused, delivered))
}

impl Refused {
    fn gather(comm: &dyn Communicator, filled: &Filled) -> Result<Self, Error> {
        let mine = filled.refused.as_ref().map(ToString::to_string).unwrap_or_default();
        let all = comm.all_gather_bytes(mine.as_bytes())?;
        let [kept] = comm.all_reduce_sum_u64([u64::from(filled.kept.is_some())])?;
        let refusals = (0..).zip(&all).filter(|(_, text)| !text.is_empty());
        let first =
            refusals.clone().next().map(|(rank, text)| (rank, String::from_utf8_lossy(text).into_owned()));
        Ok(Self { skins: refusals.count() as u64, first, kept })
    }
}

/// The number of partitions of a coarse mesh, each by what the parts of the one before will have.
const TRIES: usize = 3;

/// Partitions a coarse mesh whose edges will be split into `pieces`, such that the parts will have
/// about as many tets. That depends on the partition, because interfaces are as fine as the coarse
/// mesh, whatever the sizes, and so are boundaries that are not `remeshed`: so it is made again
/// with better weights.
pub(super) fn partition(
    mesh: &Mesh,
    (faces, pieces): (&MatchedFaces, u32),
    parts: u32,
    ties: &Ties,
    (sizes, wanted, remeshed): (&[f64], Wanted, bool),
) -> Result<(Vec<Rank>, Metrics), PartitionError> {
    let mut weights = skin::expected_tets(mesh, sizes);
    let scale = Goal::new(wanted, weights.iter().sum()).scale;
    let sizes: Vec<f64> = sizes.iter().map(|size| scale * size).collect();
    let settings = partition::Settings::default();
    let mut best: Option<(Vec<Rank>, Metrics)> = None;
    for _ in 0..if parts > 1 { TRIES } else { 1 } {
        let made = partition::partition_matched(mesh, faces, parts, ties, Some(&weights), &settings);
        let (part, mut metrics) = made?;
        weights = skin::expected_tets_by_part(mesh, &sizes, (faces, pieces), remeshed, &part);
        metrics.imbalance = metrics::imbalance(&part, parts, &weights);
        if best.as_ref().is_none_or(|(_, best)| metrics.imbalance < best.imbalance) {
            best = Some((part, metrics));
        }
    }
    Ok(best.expect("there is a first partition"))
}

/// The requested sizes at the vertices of the coarse mesh, on the rank that has it.
pub(super) fn wanted_sizes(model: &Model, coarse: &Mesh, size: &SizeSettings, pieces: u32) -> Vec<f64> {
    let field = model.size_field(size, Evaluation::Fine);
    skin::at_vertices(coarse, field.as_deref(), pieces)
}
