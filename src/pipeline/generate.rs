//! The methods `refine` and `surface` on all ranks: a coarse mesh is partitioned, distributed,
//! refined or meshed inside its refined skins, and checked.

use super::broadcast;
use super::coarse_mesh::CoarseMesh;
use super::decompose;
use super::error::{Error, InvalidMesh, RequestError};
use super::geometry::Geometry;
use super::mend;
use super::model::Model;
use super::options;
use super::part::{Part, even_out};
use super::result::{CoarseResult, Generated, Level, Refinement, Refused, StraightEdge};
use super::retries::{Budget, REFINEMENTS};
use super::room::{self};
use super::settings::{CutSettings, GenerateSettings, Method, Wanted};
use super::skins;
use super::verify::verify;
use super::wanted::mesh_as_wanted;
use crate::Point;
use crate::ground::comm::Communicator;
use crate::ground::kernel::tree;
use crate::ground::mesh::periodic::{self, PeriodicMap};
use crate::ground::mesh::stream::MeshStream;
use crate::ground::mesh::{Class, GlobalId, Mesh, Names, Order};
use crate::ground::progress::{Progress, Stage, Work};
use crate::ground::projector::Projector;
use crate::ground::size::Source;
use crate::mesher::improve::Effort;
use crate::parallel::check::{self, Checksum, PartReport};
use crate::parallel::distribution::{self, BareMesh, DistMesh, number_shared};
use crate::parallel::interfaces;
use crate::parallel::migrate::BareStream;
use crate::parallel::partition::ties::Ties;
use crate::parallel::partition::{self};
use crate::parallel::refine::{self, PeriodicCheck, RefineError, RefinedMesh};
use std::sync::Arc;

/// **Collective.** Makes the mesh; only rank 0 needs the geometry and reports `progress`.
///
/// The settings must be the same on all ranks, except the sources, the size function and `disk`,
/// which rank 0 alone uses, and `memory`.
///
/// # Errors
/// The same on all ranks: impossible or different settings, no geometry on rank 0, no coarse mesh,
/// more parts than tets, too many vertices on a rank, inverted tets that no finer coarse mesh
/// avoids, a faulty mesh.
pub fn generate(
    comm: &dyn Communicator,
    geometry: Option<&Geometry>,
    settings: &GenerateSettings,
    progress: &Progress,
) -> Result<Generated, Error> {
    options::refuse_different(comm, geometry.is_some(), settings)?;
    comm.agree(options::refuse_impossible(settings))?;
    let model = geometry.filter(|_| comm.rank() == 0).map(|geometry| &geometry.model);
    if settings.coarse.order == Order::Second {
        match model {
            Some(Model::Given(_)) => progress.note(
                "the input is a mesh without its geometry: edges of second order are straight, also on its boundary",
            ),
            Some(Model::Facets(_)) => progress.note(
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
    let (pieces, coarse) = comm.agree(made.transpose())?.unzip();
    let pieces = broadcast::pieces(comm, pieces)?;
    let (names, projector) = broadcast::geometry(comm, model)?;
    let given = coarse.as_ref().map(|made| (made.mesh.clone(), made.parts.clone()));
    let dist = progress.stage(Stage::Distribute, |_| distribution::distribute(comm, given))?;
    let fits =
        room::refuse_oversized(comm.rank(), &dist, (pieces, settings.coarse.order), settings.disk.as_ref());
    comm.agree(fits.map_err(Error::from))?;
    let of_tet = settings.disk.as_ref().map_or(0, |disk| disk.memory_of_tet);
    let fineness = (pieces, settings.coarse.order);
    room::refuse_crowded(comm, &dist, fineness, of_tet, settings.memory)?;
    Ok(Parts { model, coarse, dist, projector, names, pieces })
}

/// The result of refining a coarse mesh.
enum Refined {
    /// A checked mesh.
    Sound(Box<Generated>),
    /// Tets would be inverted: rank 0's sources for smaller sizes there.
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
    let Parts { model, mut coarse, dist, projector, names, pieces } = parts;
    let lowered = |coarse: Option<CoarseResult>, bad: &[GlobalId]| {
        Refined::Inverted(coarse.map_or_else(Vec::new, |made| mend::lowered(&made.mesh, bad)))
    };
    let order = settings.coarse.order;
    let keep = room::vertices_to_keep(comm, &dist, (pieces, order), settings.memory, progress)?;
    let displacements = broadcast::displacements(comm, coarse.as_ref().map(|made| &made.displacements))?;
    let nested = settings.nested;
    let how = refine::Settings { displacements, nested, order, ..refine::Settings::default() };
    let survey = progress.stage(Stage::Levels, |work| {
        survey(comm, &dist, &projector, pieces, (&how, settings.memory), work)
    })?;
    let mut levels = match survey {
        Surveyed::Sound(levels) => levels,
        Surveyed::Inverted(bad, _) if may_lower => return Ok(lowered(coarse, &bad)),
        Surveyed::Inverted(_, error) => return Err(error),
    };
    let how = refine::Settings { keep, ..how };
    // The stage lasts until all ranks are done.
    let straightens = order == Order::Second && settings.allow_off_surface && !may_lower;
    let ((refined, straight), bad) = progress.stage(Stage::Refine, |work| {
        let refined = refine_part(comm, dist, (&projector, pieces), &how, straightens, work)?;
        inverted_anywhere(comm, &refined.0).map(|bad| (refined, bad))
    })?;
    if !bad.is_empty() && may_lower {
        return Ok(lowered(coarse, &bad));
    }
    let part = comm.agree(refined.map_err(Error::from))?;
    let how = refine::Settings { straight, ..how };
    let straight = straight_edges(comm, &part, &projector, &how.straight)?;
    let map = broadcast::periodic(comm, coarse.as_ref().map(|made| &made.periodic))?;
    let part = part.with_periodic(map.clone()).with_singular(broadcast::singular(comm, model)?);
    let (check, checksum) =
        progress.stage(Stage::Check, |work| verdict(comm, &part, &projector, &how.straight, work))?;
    let periodic = periodic_verdict(comm, &part, &map, &projector)?;
    levels.extend(Level::of(pieces, &check));
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
    let Parts { model, coarse, dist, projector, names, pieces } = parts;
    comm.agree(skins::refuse_periodic(model).map_err(Error::from))?;
    if matches!(model, Some(Model::Given(given)) if !given.links.is_empty()) {
        progress.note("the method `surface` keeps no periodic faces: those of the mesh are like others");
    }
    let sizes = model
        .zip(coarse.as_ref())
        .map(|(model, coarse)| skins::wanted_sizes(model, coarse, settings, pieces));
    let effort = settings.coarse.effort.unwrap_or(Effort::Standard);
    let (part, refused) =
        skins::mesh_skins(comm, &dist, &projector, pieces, sizes.as_deref(), effort, progress)?;
    // The boundary is that of the method `refine`, without lines where cuts meet it.
    let across = interfaces::Settings { merge_angle: None, ..interfaces::Settings::default() };
    let whole = Whole { names, projector, pieces, coarse, refused: Some(refused) };
    stored(comm, part, whole, &across, settings, progress)
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
    let (part, pieces, coarse) = decompose::mesh_pieces(comm, model, cuts, settings, progress)?;
    let whole = Whole { names, projector, pieces, coarse, refused: None };
    stored(comm, part, whole, &interfaces::Settings::default(), settings, progress)
}

/// Data that accompanies separately meshed parts.
struct Whole {
    names: Names,
    projector: Projector,
    pieces: u32,
    coarse: Option<CoarseResult>,
    refused: Option<Refused>,
}

/// **Collective.** Improves separately meshed parts across their interfaces, balances them, and
/// checks them.
fn stored(
    comm: &dyn Communicator,
    part: BareMesh,
    whole: Whole,
    across: &interfaces::Settings,
    settings: &GenerateSettings,
    progress: &Progress,
) -> Result<Generated, Error> {
    let Whole { names, projector, pieces, coarse, refused } = whole;
    let (part, across) =
        progress.stage(Stage::Interfaces, |_| interfaces::improve_across(comm, part, across))?;
    let (part, evened) = even_out(comm, part, progress)?;
    let (part, straight) = match settings.coarse.order {
        Order::First => (Part::Stored(Box::new(BareStream::new(part))), Vec::new()),
        Order::Second => second_order(comm, part, &projector, settings.allow_off_surface, progress)?,
    };
    let off: Vec<GlobalId> = straight.iter().map(|edge| edge.node).collect();
    let (check, checksum) =
        progress.stage(Stage::Check, |work| verdict(comm, part.stream(), &projector, &off, work))?;
    let levels = Level::of(pieces, &check).into_iter().collect();
    let periodic = None;
    Ok(Generated {
        part,
        pieces,
        levels,
        names,
        check,
        checksum,
        periodic,
        refused,
        across,
        evened,
        straight,
        coarse,
        refinement: None,
    })
}

/// **Collective** if edges may stay straight (`straightens`). Refines a part; also returns the
/// nodes of the edges that stay straight.
fn refine_part(
    comm: &dyn Communicator,
    part: DistMesh,
    (projector, pieces): (&Projector, u32),
    how: &refine::Settings,
    straightens: bool,
    work: &Work,
) -> Result<(Result<RefinedMesh, RefineError>, Vec<GlobalId>), Error> {
    if straightens {
        return Ok(refine::refine_straightening(comm, &part, projector, pieces, how, work)?);
    }
    Ok((refine::refine_watched(part, projector, pieces, how, work), Vec::new()))
}

/// **Collective.** Adds the nodes on the edges of separately meshed parts, on the geometry.
fn second_order(
    comm: &dyn Communicator,
    part: BareMesh,
    projector: &Projector,
    allow_off_surface: bool,
    progress: &Progress,
) -> Result<(Part, Vec<StraightEdge>), Error> {
    progress.stage(Stage::Refine, |work| {
        let mesh = number_shared(comm, part)?;
        let how = refine::Settings { order: Order::Second, ..refine::Settings::default() };
        let (refined, straight) = refine_part(comm, mesh, (projector, 1), &how, allow_off_surface, work)?;
        let part = comm.agree(refined.map_err(Error::from))?;
        let straight = straight_edges(comm, &part, projector, &straight)?;
        Ok((Part::Refined(Arc::new(part)), straight))
    })
}

/// The result of refining to the levels before the last.
enum Surveyed {
    /// All children are positive.
    Sound(Vec<Level>),
    /// These coarse tets have inverted children.
    Inverted(Vec<GlobalId>, Error),
}

/// **Collective.** Refines to each level before the last, and measures all tets. This takes a
/// seventh of the work for the last level, and finds most inverted tets early.
fn survey(
    comm: &dyn Communicator,
    dist: &DistMesh,
    projector: &Projector,
    pieces: u32,
    (how, memory): (&refine::Settings, Option<u64>),
    work: &Work,
) -> Result<Surveyed, Error> {
    let odd = pieces >> pieces.trailing_zeros();
    let doubled = (0..pieces.trailing_zeros()).map(|k| odd << k);
    let mut levels = Vec::new();
    let pieces: Vec<u32> = (odd > 1).then_some(1).into_iter().chain(doubled).collect();
    let tets = |n: u32| u64::from(n).pow(3);
    work.step(0.0, 1.0, pieces.iter().map(|&n| tets(n)).sum());
    for n in pieces {
        comm.agree(work.proceed().map_err(Error::from))?;
        // Level by level, because all vertices of a lower level may fit.
        let (keep, _) = room::keep_of_level(comm, dist, (n, how.order), memory)?;
        let mut how = refine::Settings { keep, ..how.clone() };
        let mut refined = refine::refine(dist.clone(), projector, n, &how);
        let mut bad = inverted_anywhere(comm, &refined)?;
        if !bad.is_empty() && how.order == Order::Second {
            // Only the last level must be valid in second order: finer tets are less curved.
            how.order = Order::First;
            refined = refine::refine(dist.clone(), projector, n, &how);
            bad = inverted_anywhere(comm, &refined)?;
        }
        let part = match comm.agree(refined.map_err(Error::from)) {
            Err(error) if !bad.is_empty() => return Ok(Surveyed::Inverted(bad, error)),
            other => other?,
        };
        let check = check::check(comm, &part, None, &check::Settings::default())?;
        levels.extend(Level::of(n, &check));
        work.add(tets(n));
    }
    Ok(Surveyed::Sound(levels))
}

/// Makes and partitions the coarse mesh; also returns the subdivisions of its edges.
fn coarse_mesh(
    parts: u32,
    model: &Model,
    settings: &GenerateSettings,
    sources: &[Source],
    budget: &Budget,
    progress: &Progress,
) -> Result<(u32, CoarseResult), Error> {
    options::refuse_unresolved(model, &settings.coarse.size)?;
    room::refuse_too_fine(model, &settings.coarse.size, settings.memory)?;
    let (pieces, made, outcome) = progress.stage(Stage::Mesh, |work| {
        mesh_as_wanted(parts, model, &settings.coarse, settings.wanted, sources, budget, work)
    })?;
    let map = periodic_map(model, &made.mesh)?;
    let (assigned, metrics) = progress.stage(Stage::Partition, |_| {
        let ties = if parts > 1 { partition::periodic_ties(&made.mesh, &map) } else { Ties::default() };
        partition::partition_tied(&made.mesh, parts, &ties, &partition::Settings::default())
    })?;
    if settings.periodic_together && metrics.lost_ties > 0 {
        return Err(
            RequestError::SplitPeriodic { lost: metrics.lost_ties, tets: made.mesh.tets.len() }.into()
        );
    }
    let CoarseMesh { mesh, displacements, report } = made;
    Ok((
        pieces,
        CoarseResult {
            mesh,
            displacements,
            parts: assigned,
            report,
            outcome,
            partition: metrics,
            periodic: map,
        },
    ))
}

/// The periodic entities of a coarse mesh.
fn periodic_map(model: &Model, mesh: &Mesh) -> Result<PeriodicMap, Error> {
    let map = match model {
        Model::Csg(model) => PeriodicMap::of(mesh, periodic::links(&model.features), &model.features.bounds),
        Model::Given(given) => PeriodicMap::of(mesh, given.links.clone(), &tree::bounds(&mesh.points)),
        Model::Facets(_) => Ok(PeriodicMap::default()),
    };
    map.map_err(Error::from)
}

/// **Collective.** Checks that all periodic copies are where the motions put them.
fn periodic_verdict(
    comm: &dyn Communicator,
    part: &RefinedMesh,
    map: &PeriodicMap,
    projector: &Projector,
) -> Result<Option<PeriodicCheck>, Error> {
    if map.links.is_empty() {
        return Ok(None);
    }
    /// Tolerance factor: each point of a pair may be off its surface, and the motion rounds.
    const ROOM: f64 = 4.0;
    let checked = refine::check_periodic(comm, part, map)?;
    // Without geometry points are not projected: they may be as far off as those of the coarse
    // mesh.
    let tolerance = if matches!(projector, Projector::Flat) { map.distance } else { projector.tolerance() };
    if checked.lost > 0 || checked.furthest > ROOM * tolerance {
        return Err(InvalidMesh::Periodic { lost: checked.lost, furthest: checked.furthest }.into());
    }
    Ok(Some(checked))
}

/// **Collective.** Gathers the coarse tets with inverted children on any rank.
fn inverted_anywhere(
    comm: &dyn Communicator,
    refined: &Result<RefinedMesh, RefineError>,
) -> Result<Vec<GlobalId>, Error> {
    let mine: &[GlobalId] = match refined {
        Err(RefineError::Inverted { coarse, .. }) => coarse,
        _ => &[],
    };
    Ok(comm.all_gather(mine)?.concat())
}

/// **Collective.** Checks all tets, boundary vertices and faces between tets.
fn verdict(
    comm: &dyn Communicator,
    part: &dyn MeshStream,
    projector: &Projector,
    off_surface: &[GlobalId],
    work: &Work,
) -> Result<(PartReport, Checksum), Error> {
    let (report, checksum) = verify(comm, part, Some(projector), off_surface, work)?;
    if checksum.open != 0 {
        return Err(InvalidMesh::OpenFaces.into());
    }
    Ok((report, checksum))
}

/// **Collective.** Where the nodes with these global ids are, and how far off the geometry.
fn straight_edges(
    comm: &dyn Communicator,
    part: &RefinedMesh,
    projector: &Projector,
    nodes: &[GlobalId],
) -> Result<Vec<StraightEdge>, Error> {
    let mut ids = Vec::new();
    let mut places = Vec::new();
    for &node in nodes {
        let Some((entity, within)) = part.numbering().find(part.coarse(), node) else { continue };
        let place = part.points()[(part.numbering().inside(entity).start + within) as usize];
        let point = Point::from(place);
        let snapped = match entity.class(part.coarse()) {
            Class::Curve(curve) => projector.project_curve(curve, &point),
            Class::Patch(patch) => projector.project_patch(patch, &point),
            _ => Ok(point),
        };
        ids.push(node);
        places.push([
            place[0],
            place[1],
            place[2],
            snapped.map_or(f64::NAN, |snapped| (snapped - point).norm()),
        ]);
    }
    let places = comm.all_gather(&places)?.concat();
    let found = comm.all_gather(&ids)?.concat().into_iter().zip(places);
    let edge =
        |(node, [x, y, z, distance]): (GlobalId, [f64; 4])| StraightEdge { node, place: [x, y, z], distance };
    let mut edges: Vec<StraightEdge> = found.map(edge).collect();
    edges.sort_unstable_by_key(|edge| edge.node);
    edges.dedup_by_key(|edge| edge.node);
    Ok(edges)
}
