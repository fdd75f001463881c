//! Refinement of distributed parts on all ranks, with a check of each level.

use super::error::{Error, InvalidMesh};
use super::result::{Level, StraightEdge};
use super::room;
use super::settings::GenerateSettings;
use super::verify::verify;
use crate::Point;
use crate::ground::comm::Communicator;
use crate::ground::mesh::periodic::PeriodicMap;
use crate::ground::mesh::stream::MeshStream;
use crate::ground::mesh::{Class, GlobalId, Order};
use crate::ground::progress::{Progress, Stage, Work};
use crate::ground::projector::Projector;
use crate::parallel::check::{self, Checksum, PartReport};
use crate::parallel::distribution::DistMesh;
use crate::parallel::refine::{self, EdgeDisplacements, PeriodicCheck, RefineError, RefinedMesh};

/// How parts are refined; the same on all ranks.
pub(super) struct Plan<'a> {
    pub projector: &'a Projector,
    /// Subdivisions of each edge.
    pub pieces: u32,
    pub displacements: EdgeDisplacements,
    /// The periodic entities of the parts.
    pub periodic: PeriodicMap,
    /// The singular entities that files name.
    pub singular: csg::Singular,
    /// Whether inverted tets are returned; otherwise they are an error.
    pub may_invert: bool,
}

/// A refined and checked part.
pub(super) struct Lattice {
    pub part: RefinedMesh,
    /// All levels, the last included.
    pub levels: Vec<Level>,
    pub check: PartReport,
    pub checksum: Checksum,
    pub periodic: Option<PeriodicCheck>,
    pub straight: Vec<StraightEdge>,
    /// The settings with which other levels are refined.
    pub how: refine::Settings,
}

/// The coordinates of the corners of a tet.
pub(super) type Corners = [[f64; 3]; 4];

/// The result of refining.
pub(super) enum Refined {
    /// A checked mesh.
    Sound(Box<Lattice>),
    /// The corners of the tets of the given parts whose children would be inverted, of all ranks.
    Inverted(Vec<Corners>),
}

/// **Collective.** Refines the parts and checks the mesh.
///
/// # Errors
/// The same on all ranks: not enough memory, inverted tets unless the plan allows them, a faulty
/// mesh.
pub(super) fn refined(
    comm: &dyn Communicator,
    dist: DistMesh,
    plan: Plan,
    settings: &GenerateSettings,
    progress: &Progress,
) -> Result<Refined, Error> {
    let Plan { projector, pieces, displacements, periodic: map, singular, may_invert } = plan;
    let order = settings.coarse.order;
    let keep = room::vertices_to_keep(comm, &dist, (pieces, order), settings.memory, progress)?;
    let nested = settings.nested;
    let how = refine::Settings { displacements, nested, order, ..refine::Settings::default() };
    let survey = progress
        .stage(Stage::Levels, |work| survey(comm, &dist, projector, pieces, (&how, settings.memory), work))?;
    let mut levels = match survey {
        Surveyed::Sound(levels) => levels,
        Surveyed::Inverted(bad, _) if may_invert => return Ok(Refined::Inverted(bad)),
        Surveyed::Inverted(_, error) => return Err(error),
    };
    let how = refine::Settings { keep, ..how };
    // The stage lasts until all ranks are done.
    let straightens = order == Order::Second && settings.allow_off_surface && !may_invert;
    let ((refined, straight), bad) = progress.stage(Stage::Refine, |work| {
        let refined = refine_part(comm, dist, (projector, pieces), &how, straightens, work)?;
        inverted_anywhere(comm, &refined.0).map(|bad| (refined, bad))
    })?;
    if !bad.is_empty() && may_invert {
        return Ok(Refined::Inverted(bad));
    }
    let part = comm.agree(refined.map_err(Error::from))?;
    let how = refine::Settings { straight, ..how };
    let straight = straight_edges(comm, &part, projector, &how.straight)?;
    let part = part.with_periodic(map.clone()).with_singular(singular);
    let (check, checksum) =
        progress.stage(Stage::Check, |work| verdict(comm, &part, projector, &how.straight, work))?;
    let periodic = periodic_verdict(comm, &part, &map, projector)?;
    levels.extend(Level::of(pieces, &check));
    Ok(Refined::Sound(Box::new(Lattice { part, levels, check, checksum, periodic, straight, how })))
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

/// The result of refining to the levels before the last.
enum Surveyed {
    /// All children are positive.
    Sound(Vec<Level>),
    /// Coarse tets with these corners have inverted children.
    Inverted(Vec<Corners>, Error),
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

/// **Collective.** Gathers the corners of the coarse tets with inverted children on any rank.
fn inverted_anywhere(
    comm: &dyn Communicator,
    refined: &Result<RefinedMesh, RefineError>,
) -> Result<Vec<Corners>, Error> {
    let mine: Vec<Corners> = match refined {
        Err(RefineError::Inverted { corners, .. }) => corners.iter().map(|tet| tet.map(Into::into)).collect(),
        _ => Vec::new(),
    };
    Ok(comm.all_gather(&mine)?.concat())
}

/// **Collective.** Checks all tets, boundary vertices and faces between tets.
pub(super) fn verdict(
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
