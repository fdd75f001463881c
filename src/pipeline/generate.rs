//! Methods 2 and 3 on all ranks: a coarse mesh, partitioned, distributed, refined or meshed anew inside its refined skins, checked.

use super::coarse::{CoarseMesh, CoarseReport, CoarseSettings};
use super::decompose::{self, CutSettings};
use super::mend;
use super::model::Model;
use super::part::{Evened, Part, even_out};
use super::room::{self, Disk};
use super::skins::{self, Refused};
use super::target::Outcome;
use super::wanted::{Wanted, mesh_as_wanted};
use crate::across;
use crate::check::{self, Checksum, PartReport, ShapeReport};
use crate::comm::Communicator;
use crate::dist::{self, BareMesh, DistMesh};
use crate::error::{Failure, Status, agree};
use crate::geometry::Projector;
use crate::improve::Effort;
use crate::kernel::tree;
use crate::mesh::stream::MeshStream;
use crate::mesh::{GlobalId, Mesh, Names, Rank};
use crate::migrate::BareStream;
use crate::partition::ties::Ties;
use crate::partition::{self, Metrics};
use crate::periodic::{self, PeriodicMap};
use crate::progress::Progress;
use crate::refine::{self, Bends, RefineError, RefinedMesh};
use crate::size::Source;

/// What becomes of the parts of a coarse mesh.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum Method {
    /// They are refined uniformly (the thesis' second method).
    #[default]
    Refine,
    /// Their skins are, and each is meshed inside (the third).
    Surface,
    /// The geometry itself is cut, and each piece is meshed (the first).
    Decompose(CutSettings),
}

/// What is to be made.
#[derive(Clone, Debug)]
pub struct GenerateSettings {
    /// What becomes of the coarse mesh.
    pub method: Method,
    /// How the coarse mesh is made.
    pub coarse: CoarseSettings,
    /// How many tets.
    pub wanted: Wanted,
    /// The memory to use for fine vertices on each machine, bytes; without it, what the machine has left.
    pub memory: Option<u64>,
    /// What is to be written, to refuse what does not fit before anything is refined.
    pub disk: Option<Disk>,
    /// Whether to refuse a partition that has periodic faces and their images in different parts.
    pub periodic_together: bool,
}

/// What rank 0 found out on the way.
#[derive(Clone, Debug)]
pub struct CoarseResult {
    /// The coarse mesh, and the part of each of its tets.
    pub mesh: Mesh,
    /// The edges that refinement bends.
    pub bends: Bends,
    /// The part of each tet.
    pub parts: Vec<Rank>,
    /// Its numbers.
    pub report: CoarseReport,
    /// How the wanted number came out, if one was wanted.
    pub outcome: Option<Outcome>,
    /// How good the partition is.
    pub partition: Metrics,
    /// What is periodic in the mesh.
    pub periodic: PeriodicMap,
}

/// A refined, checked mesh on each rank.
#[derive(Debug)]
pub struct Generated {
    /// This rank's part.
    pub part: Part,
    /// Pieces that each coarse edge was cut into.
    pub pieces: u32,
    /// The shapes of the tets of each level of refinement, from the coarse mesh to the last: the same on all ranks.
    pub levels: Vec<Level>,
    /// Numbers and names of bodies and boundaries.
    pub names: Names,
    /// The check of the whole mesh, the same on all ranks.
    pub check: PartReport,
    /// What identifies the mesh, whatever the ranks: the same on all.
    pub checksum: Checksum,
    /// What became of periodic faces, if there are any: the same on all.
    pub periodic: Option<periodic::Checked>,
    /// Skins that the mesher refused, if parts were meshed inside theirs: the same on all.
    pub refused: Option<Refused>,
    /// What was done for tets across interfaces, if parts were meshed each on its own and some were bad: the same on all ranks.
    pub across: Option<across::Report>,
    /// What was done to make parts even that were meshed each on its own: the same on all.
    pub evened: Option<Evened>,
    /// On rank 0 alone.
    pub coarse: Option<CoarseResult>,
}

/// The tets of one level of refinement.
#[derive(Clone, Debug, PartialEq)]
pub struct Level {
    /// Pieces of each coarse edge.
    pub pieces: u32,
    /// The number of tets.
    pub tets: u64,
    /// Their shapes.
    pub shape: ShapeReport,
}

/// Rounds in which the coarse mesh is made finer because refined tets turned out inverted only now.
const MOST_ROUNDS: usize = 4;

/// **Collective.** Makes the mesh; only rank 0 needs the `model` and shows `progress`.
///
/// # Errors
/// The same on all ranks: no coarse mesh, more parts than tets, too many vertices on a rank, inverted
/// tets that no finer coarse mesh mends, a faulty mesh.
pub fn generate(
    comm: &dyn Communicator,
    model: Option<&Model>,
    settings: &GenerateSettings,
    progress: &Progress,
) -> Result<Generated, Failure> {
    if let Method::Decompose(cuts) = &settings.method {
        return decomposed(comm, model, cuts, settings, progress);
    }
    let mut sources: Vec<Source> = Vec::new();
    for round in 0.. {
        let made = model.map(|model| coarse_mesh(comm.size(), model, settings, &sources, progress));
        let mut coarse = agree(comm, made.transpose())?;
        let pieces = broadcast_pieces(comm, coarse.as_ref().map(|(pieces, _)| *pieces))?;
        let (names, projector) = broadcast_geometry(comm, model)?;
        let given = coarse.as_ref().map(|(_, made)| (made.mesh.clone(), made.parts.clone()));
        let dist = progress.stage("distribute", || dist::distribute(comm, given))?;
        agree(comm, room::refuse_without_disk(comm.rank(), &dist, pieces, settings.disk.as_ref()))?;
        if settings.method == Method::Surface {
            let coarse = coarse.take().map(|(_, made)| made);
            return fill(comm, Parts { model, coarse, dist, projector, names, pieces }, settings, progress);
        }
        let keep = room::what_fits(comm, &dist, pieces, settings.memory, progress)?;
        let bends = broadcast_bends(comm, coarse.as_ref().map(|(_, made)| &made.bends))?;
        let how = refine::Settings { bends, ..refine::Settings::default() };
        let survey = progress.stage("levels", || survey(comm, &dist, &projector, pieces, &how))?;
        let mut levels = match survey {
            Surveyed::Sound(levels) => levels,
            Surveyed::Inverted(bad, _) if round < MOST_ROUNDS => {
                lower(&mut sources, coarse.as_ref(), &bad);
                continue;
            }
            Surveyed::Inverted(_, error) => return Err(error),
        };
        let how = refine::Settings { keep, ..how };
        // Until the last rank is done.
        let (refined, bad) = progress.stage("refine", || {
            let refined = refine::refine(dist, &projector, pieces, &how);
            inverted_anywhere(comm, &refined).map(|bad| (refined, bad))
        })?;
        if !bad.is_empty() && round < MOST_ROUNDS {
            lower(&mut sources, coarse.as_ref(), &bad);
            continue;
        }
        let part = agree(comm, refined.map_err(Failure::from))?;
        let map = broadcast_periodic(comm, coarse.as_ref().map(|(_, made)| &made.periodic))?;
        let part = part.with_periodic(map.clone()).with_singular(broadcast_singular(comm, model)?);
        let (check, checksum) = progress.stage("check", || verdict(comm, &part, &projector))?;
        let periodic = periodic_verdict(comm, &part, &map, &projector)?;
        levels.extend(check.shape.clone().map(|shape| Level { pieces, tets: check.tets, shape }));
        let coarse = coarse.take().map(|(_, mut made)| {
            made.report.size_corrections += round as u64;
            made.report.bent_edges = made.bends.edges().len() as u64;
            made
        });
        let part = Part::Refined(Box::new(part));
        let (refused, across, evened) = (None, None, None);
        return Ok(Generated {
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
            coarse,
        });
    }
    unreachable!("the loop ends by itself")
}

/// A coarse mesh on all ranks, and what rank 0 knows of it.
struct Parts<'a> {
    model: Option<&'a Model>,
    coarse: Option<CoarseResult>,
    dist: DistMesh,
    projector: Projector,
    names: Names,
    pieces: u32,
}

/// **Collective.** Meshes the parts inside their refined skins.
fn fill(
    comm: &dyn Communicator,
    parts: Parts,
    settings: &GenerateSettings,
    progress: &Progress,
) -> Result<Generated, Failure> {
    let Parts { model, coarse, dist, projector, names, pieces } = parts;
    agree(comm, skins::refuse_periodic(model))?;
    if matches!(model, Some(Model::Given(given)) if !given.links.is_empty()) {
        progress
            .note("note: the method `surface` keeps no periodic faces: those of the mesh are like others");
    }
    let sizes = model
        .zip(coarse.as_ref())
        .map(|(model, coarse)| skins::wanted_sizes(model, coarse, settings, pieces));
    let effort = settings.coarse.effort.unwrap_or(Effort::Standard);
    let (part, refused) =
        skins::mesh_skins(comm, &dist, &projector, pieces, sizes.as_deref(), effort, progress)?;
    // The boundary is that of the method `refine`, with no lines of cuts.
    let across = across::Settings { merge_angle: None, ..across::Settings::default() };
    let whole = Whole { names, projector, pieces, coarse, refused: Some(refused) };
    stored(comm, part, whole, &across, progress)
}

/// **Collective.** Meshes the pieces that the geometry is cut into.
fn decomposed(
    comm: &dyn Communicator,
    model: Option<&Model>,
    cuts: &CutSettings,
    settings: &GenerateSettings,
    progress: &Progress,
) -> Result<Generated, Failure> {
    let (names, projector) = broadcast_geometry(comm, model)?;
    let (part, pieces, coarse) = decompose::mesh_pieces(comm, model, cuts, settings, progress)?;
    let whole = Whole { names, projector, pieces, coarse, refused: None };
    stored(comm, part, whole, &across::Settings::default(), progress)
}

/// What goes with parts that were meshed each on its own.
struct Whole {
    names: Names,
    projector: Projector,
    pieces: u32,
    coarse: Option<CoarseResult>,
    refused: Option<Refused>,
}

/// **Collective.** Improves parts that were meshed each on its own across their interfaces, makes them even, and checks them.
fn stored(
    comm: &dyn Communicator,
    part: BareMesh,
    whole: Whole,
    across: &across::Settings,
    progress: &Progress,
) -> Result<Generated, Failure> {
    let Whole { names, projector, pieces, coarse, refused } = whole;
    let (part, across) = progress.stage("interfaces", || across::improve_across(comm, part, across))?;
    let (part, evened) = even_out(comm, part, progress)?;
    let part = BareStream::new(part);
    let (check, checksum) = progress.stage("check", || verdict(comm, &part, &projector))?;
    let level = check.shape.clone().map(|shape| Level { pieces, tets: check.tets, shape });
    let (levels, part) = (level.into_iter().collect(), Part::Stored(Box::new(part)));
    let periodic = None;
    Ok(Generated { part, pieces, levels, names, check, checksum, periodic, refused, across, evened, coarse })
}

/// Asks for smaller sizes around coarse tets with inverted children, on the rank that has them.
fn lower(sources: &mut Vec<Source>, coarse: Option<&(u32, CoarseResult)>, bad: &[GlobalId]) {
    if let Some((_, made)) = coarse {
        sources.extend(mend::lowered(&made.mesh, bad));
    }
}

/// What the levels before the last are like.
enum Surveyed {
    /// All children are positive.
    Sound(Vec<Level>),
    /// These coarse tets have inverted children.
    Inverted(Vec<GlobalId>, Failure),
}

/// **Collective.** Refines to each level before the last in turn, from none on, and measures all tets: a seventh of the work on the last,
/// and what would be inverted there mostly is so earlier.
fn survey(
    comm: &dyn Communicator,
    dist: &DistMesh,
    projector: &Projector,
    pieces: u32,
    how: &refine::Settings,
) -> Result<Surveyed, Failure> {
    let odd = pieces >> pieces.trailing_zeros();
    let doubled = (0..pieces.trailing_zeros()).map(|k| odd << k);
    let mut levels = Vec::new();
    for n in (odd > 1).then_some(1).into_iter().chain(doubled) {
        let refined = refine::refine(dist.clone(), projector, n, how);
        let bad = inverted_anywhere(comm, &refined)?;
        let part = match agree(comm, refined.map_err(Failure::from)) {
            Err(error) if !bad.is_empty() => return Ok(Surveyed::Inverted(bad, error)),
            other => other?,
        };
        let check = check::check(comm, &part, None, &check::Settings::default())?;
        levels.extend(check.shape.map(|shape| Level { pieces: n, tets: check.tets, shape }));
    }
    Ok(Surveyed::Sound(levels))
}

/// The coarse mesh, partitioned, and the pieces of its edges.
fn coarse_mesh(
    parts: u32,
    model: &Model,
    settings: &GenerateSettings,
    sources: &[Source],
    progress: &Progress,
) -> Result<(u32, CoarseResult), Failure> {
    let (pieces, made, outcome) = progress
        .stage("mesh", || mesh_as_wanted(parts, model, &settings.coarse, settings.wanted, sources))?;
    let map = periodic_map(model, &made.mesh)?;
    let (assigned, metrics) = progress.stage("partition", || {
        let ties = if parts > 1 { periodic::ties(&made.mesh, &map) } else { Ties::default() };
        partition::partition_tied(&made.mesh, parts, &ties, &partition::Settings::default())
    })?;
    if settings.periodic_together && metrics.lost_ties > 0 {
        return Err(Failure::input(format!(
            "{} of the {} coarse tets beside periodic faces cannot be in one part with those at their images, which Elmer needs: use \
             fewer parts or a finer coarse mesh, or insist with --allow-split-periodic",
            metrics.lost_ties,
            made.mesh.tets.len()
        )));
    }
    let CoarseMesh { mesh, bends, report } = made;
    Ok((
        pieces,
        CoarseResult { mesh, bends, parts: assigned, report, outcome, partition: metrics, periodic: map },
    ))
}

/// What is periodic in a coarse mesh.
fn periodic_map(model: &Model, mesh: &Mesh) -> Result<PeriodicMap, Failure> {
    let map = match model {
        Model::Csg(model) => PeriodicMap::of(mesh, periodic::links(&model.features), &model.features.bounds),
        Model::Given(given) => PeriodicMap::of(mesh, given.links.clone(), &tree::bounds(&mesh.points)),
        Model::Facets(_) => Ok(PeriodicMap::default()),
    };
    map.map_err(|error| Failure::new(Status::NoValidMesh, error))
}

/// **Collective.** What is periodic in the coarse mesh, which rank 0 knows.
fn broadcast_periodic(comm: &dyn Communicator, map: Option<&PeriodicMap>) -> Result<PeriodicMap, Failure> {
    let mut numbers = map.map(PeriodicMap::encode).unwrap_or_default();
    comm.broadcast(0, &mut numbers)?;
    Ok(PeriodicMap::decode(&numbers))
}

/// **Collective.** Checks that all images are where they belong.
fn periodic_verdict(
    comm: &dyn Communicator,
    part: &RefinedMesh,
    map: &PeriodicMap,
    projector: &Projector,
) -> Result<Option<periodic::Checked>, Failure> {
    if map.links.is_empty() {
        return Ok(None);
    }
    /// Both points of a pair may be as far off as one from its surface, and moving one rounds.
    const ROOM: f64 = 4.0;
    let checked = periodic::check(comm, part, map)?;
    // Points of a mesh without geometry are not projected: they are as far off as the coarse ones may be.
    let tolerance = if matches!(projector, Projector::Flat) { map.distance } else { projector.tolerance() };
    if checked.lost > 0 || checked.furthest > ROOM * tolerance {
        let message = format!(
            "{} vertices of periodic faces have no partner, others are {:e} off; nothing was written",
            checked.lost, checked.furthest
        );
        return Err(Failure::new(Status::NoValidMesh, message));
    }
    Ok(Some(checked))
}

/// **Collective.** The pieces that rank 0 chose.
fn broadcast_pieces(comm: &dyn Communicator, pieces: Option<u32>) -> Result<u32, Failure> {
    let mut pieces = vec![pieces.unwrap_or(1)];
    comm.broadcast(0, &mut pieces)?;
    Ok(pieces[0])
}

/// **Collective.** The bent edges that rank 0 knows.
fn broadcast_bends(comm: &dyn Communicator, bends: Option<&Bends>) -> Result<Bends, Failure> {
    let (mut ids, mut middles): (Vec<GlobalId>, Vec<[f64; 3]>) =
        bends.map(|bends| bends.edges().iter().copied().unzip()).unwrap_or_default();
    comm.broadcast(0, &mut ids)?;
    comm.broadcast(0, &mut middles)?;
    Ok(ids.into_iter().zip(middles).collect())
}

/// **Collective.** What rank 0's geometry tags as singular.
fn broadcast_singular(comm: &dyn Communicator, model: Option<&Model>) -> Result<csg::Singular, Failure> {
    let csg::Singular { mut patches, mut curves, mut corners } = match model {
        Some(Model::Csg(model)) => model.features.singular(&model.geometry),
        _ => csg::Singular::default(),
    };
    broadcast_factors(comm, &mut patches, |id| id.0, csg::PatchId)?;
    broadcast_factors(comm, &mut curves, |id| id.0, csg::CurveId)?;
    broadcast_factors(comm, &mut corners, |id| id.0, csg::CornerId)?;
    Ok(csg::Singular { patches, curves, corners })
}

/// **Collective.** Replaces the factors of entities by those of rank 0.
fn broadcast_factors<Id>(
    comm: &dyn Communicator,
    factors: &mut Vec<(Id, i32)>,
    number: impl Fn(&Id) -> u32,
    id: impl Fn(u32) -> Id,
) -> Result<(), Failure> {
    let mut numbers: Vec<[i64; 2]> =
        factors.iter().map(|(id, factor)| [number(id).into(), (*factor).into()]).collect();
    comm.broadcast(0, &mut numbers)?;
    *factors = numbers.iter().map(|&[number, factor]| (id(number as u32), factor as i32)).collect();
    Ok(())
}

/// **Collective.** The names and the surfaces that rank 0 has read.
fn broadcast_geometry(comm: &dyn Communicator, model: Option<&Model>) -> Result<(Names, Projector), Failure> {
    let mut bytes = model.map(|m| m.projector().encode()).unwrap_or_default();
    comm.broadcast_bytes(0, &mut bytes)?;
    let names = model.map(Model::names).unwrap_or_default();
    let mut text = serde_json::to_vec(&names).expect("plain data");
    comm.broadcast_bytes(0, &mut text)?;
    let names = serde_json::from_slice(&text).expect("what rank 0 wrote");
    let projector = Projector::decode(&bytes).expect("what rank 0 encoded");
    Ok((names, projector))
}

/// **Collective.** The coarse tets with inverted children on any rank.
fn inverted_anywhere(
    comm: &dyn Communicator,
    refined: &Result<RefinedMesh, RefineError>,
) -> Result<Vec<GlobalId>, Failure> {
    let mine: &[GlobalId] = match refined {
        Err(RefineError::Inverted { coarse, .. }) => coarse,
        _ => &[],
    };
    Ok(comm.all_gather(mine)?.concat())
}

/// **Collective.** Checks every child, every boundary vertex and every face between tets.
fn verdict(
    comm: &dyn Communicator,
    part: &dyn MeshStream,
    projector: &Projector,
) -> Result<(PartReport, Checksum), Failure> {
    let report = check::check(comm, part, Some(projector), &check::Settings::default())?;
    let checksum = check::checksum_of_all(comm, part)?;
    if report.faults > 0 {
        let faults: Vec<String> = report.described.iter().map(ToString::to_string).collect();
        let message =
            format!("the mesh has {} faults, nothing was written:\n  {}", report.faults, faults.join("\n  "));
        return Err(Failure::new(Status::NoValidMesh, message));
    }
    if checksum.open != 0 {
        return Err(Failure::new(Status::NoValidMesh, "faces of the mesh do not match; nothing was written"));
    }
    Ok((report, checksum))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::comm::thread;

    #[test]
    fn edges_that_rank_0_bends_are_bent_alike_on_all_ranks() {
        let bends: Bends = [(7, [0.5, 0.0, -1.25]), (1 << 40, [0.1, 0.2, 0.3])].into_iter().collect();
        let heard =
            thread::run(3, |comm| broadcast_bends(comm, (comm.rank() == 0).then_some(&bends)).unwrap());
        assert_eq!(heard.unwrap(), vec![bends; 3]);
    }
}
