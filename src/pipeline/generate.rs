//! The methods `refine` and `surface` on all ranks: a coarse mesh is partitioned, distributed,
//! refined or meshed inside its refined skins, and checked.

use super::broadcast;
use super::coarse_mesh::CoarseMesh;
use super::decompose;
use super::error::{Error, RequestError};
use super::lattice::{self, Lattice};
use super::mend;
use super::model::Model;
use super::options;
use super::part::{Part, even_out};
use super::periodic::{Linked, periodic_map};
use super::result::{CoarseResult, Generated, Level, Refinement, Refused};
use super::retries::{Budget, REFINEMENTS};
use super::room;
use super::settings::{CutSettings, GenerateSettings, Method, Wanted};
use super::skins;
use super::wanted::mesh_as_wanted;
use crate::Point;
use crate::ground::comm::{Communicator, Rank};
use crate::ground::mesh::topology::MatchedFaces;
use crate::ground::mesh::{Mesh, Names, Order};
use crate::ground::progress::{Progress, Stage};
use crate::ground::projector::Projector;
use crate::ground::size::Source;
use crate::mesher::improve::{self, Effort, Measure, Smoothness};
use crate::mesher::smoothness::smoothness;
use crate::parallel::distribution::{self, BareMesh, DistMesh, number_shared};
use crate::parallel::interfaces;
use crate::parallel::migrate::BareStream;
use crate::parallel::partition::ties::Ties;
use crate::parallel::partition::{self, PartitionError};
use crate::parallel::skin::{DeliveredSizes, Improvement};
use std::sync::Arc;

/// **Collective.** Generates the mesh of rank 0's model.
pub(super) fn generate_of(
    comm: &dyn Communicator,
    model: Option<&Model>,
    settings: &GenerateSettings,
    progress: &Progress,
) -> Result<Generated, Error> {
    if settings.coarse.order == Order::Second {
        match model {
            Some(Model::Given(_)) => progress.note(
                "the input is a mesh without its geometry: edges of second order are straight, also on its boundary",
            ),
            Some(Model::Facets(solid)) if solid.exact.is_none() => progress.note(
                "the surface of the input consists of plane triangles: boundary nodes of second order are on these",
            ),
            _ => {}
        }
    }
    if let Method::Decompose(cuts) = &settings.method {
        return decomposed(comm, model, cuts, settings, progress);
    }
    let announces = matches!(settings.wanted, Wanted::Sizes { .. });
    let (mut sources, budget) = (Vec::<Source>::new(), Budget::new(settings.memory, announces));
    for round in 0.. {
        let parts = coarse_parts(comm, model, settings, &sources, &budget, progress)?;
        if settings.method == Method::Surface {
            return fill(comm, parts, settings, progress);
        }
        match refined(comm, parts, settings, round < REFINEMENTS, progress)? {
            Refined::Sound(mut made) => {
                if let Some(coarse) = &mut made.coarse {
                    coarse.report.size_corrections += round as u64;
                }
                return Ok(*made);
            }
            Refined::Inverted(lowered) => sources.extend(lowered),
        }
    }
    unreachable!("the loop ends by itself")
}

/// A distributed coarse mesh, with rank 0's data about it.
struct Parts<'a> {
    model: Option<&'a Model>,
    coarse: Option<CoarseResult>,
    /// See [`Coarse::sizes`].
    sizes: Option<Vec<f64>>,
    dist: DistMesh,
    projector: Projector,
    names: Names,
    pieces: u32,
}

/// **Collective.** Makes a coarse mesh on rank 0, partitions and distributes it. `sources` are
/// added to the sizes.
fn coarse_parts<'a>(
    comm: &dyn Communicator,
    model: Option<&'a Model>,
    settings: &GenerateSettings,
    sources: &[Source],
    budget: &Budget,
    progress: &Progress,
) -> Result<Parts<'a>, Error> {
    let made = model.map(|model| coarse_mesh(comm.size(), model, settings, sources, budget, progress));
    let made = comm.agree(made.transpose())?;
    let pieces = broadcast::pieces(comm, made.as_ref().map(|made| made.pieces))?;
    let (names, projector) = broadcast::geometry(comm, model)?;
    let (coarse, sizes, given) = match made {
        Some(Coarse { mesh, parts, faces, result, sizes, .. }) => {
            (Some(result), sizes, Some((mesh, parts, faces)))
        }
        None => (None, None, None),
    };
    let dist = progress.stage(Stage::Distribute, |_| distribution::distribute_matched(comm, given))?;
    let fineness = (pieces << settings.refine, settings.coarse.order);
    let fits = room::refuse_oversized(comm.rank(), &dist, fineness, settings.disk.as_ref());
    comm.agree(fits.map_err(Error::from))?;
    let of_tet = settings.disk.as_ref().map_or(0, |disk| disk.memory_of_tet);
    room::refuse_crowded(comm, &dist, fineness, of_tet, settings.memory)?;
    Ok(Parts { model, coarse, sizes, dist, projector, names, pieces })
}

/// The result of refining a coarse mesh.
enum Refined {
    /// A checked mesh.
    Sound(Box<Generated>),
    /// Tets would be inverted: sources for smaller sizes there.
    Inverted(Vec<Source>),
}

/// **Collective.** Refines the parts and checks the mesh. Inverted tets are an error unless sizes
/// `may_lower`.
fn refined(
    comm: &dyn Communicator,
    parts: Parts,
    settings: &GenerateSettings,
    may_lower: bool,
    progress: &Progress,
) -> Result<Refined, Error> {
    let Parts { model, mut coarse, dist, projector, names, pieces, .. } = parts;
    let plan = lattice::Plan {
        projector: &projector,
        pieces,
        displacements: broadcast::displacements(comm, coarse.as_ref().map(|made| &made.displacements))?,
        periodic: broadcast::periodic(comm, coarse.as_ref().map(|made| &made.periodic))?,
        singular: broadcast::singular(comm, model)?,
        may_invert: may_lower,
    };
    let Lattice { part, levels, check, checksum, periodic, straight, how } =
        match lattice::refined(comm, dist, plan, settings, progress)? {
            lattice::Refined::Sound(lattice) => *lattice,
            lattice::Refined::Inverted(bad) => {
                return Ok(Refined::Inverted(mend::lowered(bad.into_iter().map(|tet| tet.map(Point::from)))));
            }
        };
    if let Some(made) = &mut coarse {
        made.report.curved_edges = made.displacements.edges().len() as u64;
    }
    Ok(Refined::Sound(Box::new(Generated {
        part: Part::Refined(Arc::new(part)),
        pieces,
        levels,
        names,
        check,
        checksum,
        periodic,
        refused: None,
        delivered: None,
        across: None,
        evened: None,
        straight,
        coarse,
        refinement: Some(Refinement { projector, settings: how }),
    })))
}

/// **Collective.** Meshes the parts inside their refined skins.
fn fill(
    comm: &dyn Communicator,
    parts: Parts,
    settings: &GenerateSettings,
    progress: &Progress,
) -> Result<Generated, Error> {
    let Parts { model, coarse, sizes, dist, projector, names, pieces } = parts;
    let linked = Linked::broadcast(comm, coarse.as_ref().map(|made| &made.periodic))?;
    let (part, refused, delivered) = {
        let wanted = settings.before_refinement().wanted;
        let smoothness = smoothness_if_refined(settings, &projector);
        let how = Improvement { settings: &of_effort(settings), smoothness: smoothness.as_deref() };
        let sizes = (sizes.as_deref(), &linked.patches());
        skins::mesh_skins(comm, &dist, (&projector, pieces), sizes, wanted, how, progress)?
    };
    let whole = Whole { model, linked, names, projector, pieces, coarse, refused: Some(refused), delivered };
    stored(comm, part, whole, settings, progress)
}

/// How the tets of separately meshed parts are improved.
fn of_effort(settings: &GenerateSettings) -> improve::Settings {
    improve::Settings::of(settings.coarse.effort.unwrap_or(Effort::Standard), measure(settings))
}

/// Whether separately meshed parts will be refined or curved.
fn are_refined(settings: &GenerateSettings) -> bool {
    settings.refine > 0 || settings.coarse.order == Order::Second
}

/// The shape measure of the tets of separately meshed parts.
fn measure(settings: &GenerateSettings) -> Measure {
    if are_refined(settings) { Measure::Refined } else { Measure::MeanRatio }
}

/// The smoothness of the geometry, if separately meshed parts will be refined or curved.
fn smoothness_if_refined<'a>(
    settings: &GenerateSettings,
    projector: &'a Projector,
) -> Option<Box<dyn Smoothness + 'a>> {
    are_refined(settings).then(|| smoothness(projector)).flatten()
}

/// **Collective.** Meshes the pieces of the geometry.
fn decomposed(
    comm: &dyn Communicator,
    model: Option<&Model>,
    cuts: &CutSettings,
    settings: &GenerateSettings,
    progress: &Progress,
) -> Result<Generated, Error> {
    let (names, projector) = broadcast::geometry(comm, model)?;
    let decompose::Pieces { part, pieces, delivered, coarse } = {
        let smoothness = smoothness_if_refined(settings, &projector);
        let how = Improvement { settings: &of_effort(settings), smoothness: smoothness.as_deref() };
        decompose::mesh_pieces(comm, model, cuts, settings, how, progress)?
    };
    let linked = Linked::broadcast(comm, coarse.as_ref().map(|made| &made.periodic))?;
    let whole = Whole { model, linked, names, projector, pieces, coarse, refused: None, delivered };
    stored(comm, part, whole, settings, progress)
}

/// Data that accompanies separately meshed parts.
struct Whole<'a> {
    model: Option<&'a Model>,
    linked: Linked,
    names: Names,
    projector: Projector,
    pieces: u32,
    coarse: Option<CoarseResult>,
    refused: Option<Refused>,
    delivered: Option<DeliveredSizes>,
}

/// **Collective.** Improves separately meshed parts across their interfaces, balances them, refines
/// them if that is requested, and checks them.
fn stored(
    comm: &dyn Communicator,
    part: BareMesh,
    whole: Whole,
    settings: &GenerateSettings,
    progress: &Progress,
) -> Result<Generated, Error> {
    let Whole { model, linked, names, projector, pieces, coarse, refused, delivered } = whole;
    let (part, across) = progress.stage(Stage::Interfaces, |_| {
        let smoothness = smoothness_if_refined(settings, &projector);
        let across = interfaces::Settings::of(measure(settings));
        interfaces::improve_across(comm, part, linked.links(), &across, smoothness.as_deref())
    })?;
    let (part, evened) = even_out(comm, part, linked.links(), progress)?;
    let singular = broadcast::singular(comm, model)?;
    let made = |part, pieces, levels, (check, checksum), periodic, straight, refinement| Generated {
        part,
        pieces,
        levels,
        names,
        check,
        checksum,
        periodic,
        refused,
        delivered,
        across,
        evened,
        straight,
        coarse,
        refinement,
    };
    // Periodic pairs belong to edges and faces, which only a lattice has, if of one subdivision.
    if settings.refine == 0 && settings.coarse.order == Order::First && linked.links().is_empty() {
        let part = Part::Stored(Box::new(BareStream::new(part)));
        let (check, checksum) = progress
            .stage(Stage::Check, |work| lattice::verdict(comm, part.stream(), &projector, &[], work))?;
        let levels = Level::of(pieces, &check).into_iter().collect();
        return Ok(made(part, pieces, levels, (check, checksum), None, Vec::new(), None));
    }
    let how = (1 << settings.refine, settings.coarse.order);
    let (dist, periodic, displacements) = progress.stage(Stage::Levels, |work| {
        let dist = number_shared(comm, part)?;
        let periodic = linked.pairs(comm, &dist)?;
        let displacements = mend::displaced(comm, &dist, &projector, how, work)?;
        Ok::<_, Error>((dist, periodic, displacements))
    })?;
    let plan = lattice::Plan {
        projector: &projector,
        pieces: 1 << settings.refine,
        displacements,
        periodic,
        singular,
        may_invert: false,
    };
    let lattice::Refined::Sound(lattice) = lattice::refined(comm, dist, plan, settings, progress)? else {
        unreachable!("inverted tets are an error")
    };
    let Lattice { part, levels, check, checksum, periodic, straight, how } = *lattice;
    let levels = levels.into_iter().map(|level| Level { pieces: pieces * level.pieces, ..level }).collect();
    let refinement = Refinement { projector, settings: how };
    let part = Part::Refined(Arc::new(part));
    Ok(made(part, pieces << settings.refine, levels, (check, checksum), periodic, straight, Some(refinement)))
}

/// A partitioned coarse mesh.
struct Coarse {
    /// Subdivisions of each edge.
    pieces: u32,
    mesh: Mesh,
    /// The part of each tet.
    parts: Vec<Rank>,
    result: CoarseResult,
    /// For the method `surface`, the wanted sizes at the vertices.
    sizes: Option<Vec<f64>>,
    /// The faces of the mesh, which both partition and distribution need.
    faces: MatchedFaces,
}

/// Makes and partitions the coarse mesh.
fn coarse_mesh(
    parts: u32,
    model: &Model,
    settings: &GenerateSettings,
    sources: &[Source],
    budget: &Budget,
    progress: &Progress,
) -> Result<Coarse, Error> {
    options::refuse_unresolved(model, &settings.coarse.size)?;
    room::refuse_too_fine(model, &settings.coarse.size, settings.memory)?;
    let (pieces, made, outcome) = progress.stage(Stage::Mesh, |work| {
        mesh_as_wanted(parts, model, &settings.coarse, settings.before_refinement(), sources, budget, work)
    })?;
    let map = periodic_map(model, &made.mesh)?;
    let sizes = (settings.method == Method::Surface)
        .then(|| skins::wanted_sizes(model, &made.mesh, &settings.coarse.size, pieces));
    let (faces, (assigned, metrics)) = progress.stage(Stage::Partition, |_| {
        let mesh = &made.mesh;
        let faces = partition::matched_faces(mesh)?;
        let ties = if parts > 1 { partition::periodic_ties(mesh, &faces, &map) } else { Ties::default() };
        let part = match &sizes {
            Some(sizes) => {
                let wanted = settings.before_refinement().wanted;
                let remeshed = model.has_surfaces();
                skins::partition(mesh, (&faces, pieces), parts, &ties, (sizes, wanted, remeshed))?
            }
            None => partition::partition_matched(mesh, &faces, parts, &ties, None, &Default::default())?,
        };
        Ok::<_, PartitionError>((faces, part))
    })?;
    if settings.periodic_together && metrics.lost_ties > 0 {
        return Err(
            RequestError::SplitPeriodic { lost: metrics.lost_ties, tets: made.mesh.tets.len() }.into()
        );
    }
    let CoarseMesh { mesh, displacements, report } = made;
    let result = CoarseResult { displacements, report, outcome, partition: metrics, periodic: map };
    Ok(Coarse { pieces, mesh, parts: assigned, result, sizes, faces })
}
