//! Method 2 on all ranks: a coarse mesh, partitioned, distributed, refined, checked.

use super::coarse::{CoarseMesh, CoarseReport, CoarseSettings};
use super::mend;
use super::model::Model;
use super::target::Outcome;
use super::wanted::{Wanted, mesh_as_wanted};
use crate::check::{self, Checksum, PartReport};
use crate::comm::Communicator;
use crate::dist::{self, DistMesh};
use crate::error::{Failure, Status, agree};
use crate::geometry::Projector;
use crate::memory;
use crate::mesh::{GlobalId, Mesh, Names, Rank};
use crate::partition::{self, Metrics};
use crate::periodic::{self, PeriodicMap};
use crate::progress::Progress;
use crate::refine::{self, RefineError, RefinedMesh};
use crate::size::Source;

/// What is to be made.
#[derive(Clone, Debug)]
pub struct GenerateSettings {
    /// How the coarse mesh is made.
    pub coarse: CoarseSettings,
    /// How many tets.
    pub wanted: Wanted,
}

/// What rank 0 found out on the way.
#[derive(Clone, Debug)]
pub struct CoarseResult {
    /// The coarse mesh, and the part of each of its tets.
    pub mesh: Mesh,
    /// The part of each tet.
    pub parts: Vec<Rank>,
    /// Its numbers.
    pub report: CoarseReport,
    /// How the wanted number came out, if one was wanted.
    pub outcome: Option<Outcome>,
    /// How good the partition is.
    pub partition: Metrics,
}

/// A refined, checked mesh on each rank.
#[derive(Debug)]
pub struct Generated {
    /// This rank's part.
    pub part: RefinedMesh,
    /// Pieces that each coarse edge was cut into.
    pub pieces: u32,
    /// Numbers and names of bodies and boundaries.
    pub names: Names,
    /// The check of the whole mesh, the same on all ranks.
    pub check: PartReport,
    /// What identifies the mesh, whatever the ranks: the same on all.
    pub checksum: Checksum,
    /// What became of periodic faces, if there are any: the same on all.
    pub periodic: Option<periodic::Checked>,
    /// On rank 0 alone.
    pub coarse: Option<CoarseResult>,
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
    let mut sources: Vec<Source> = Vec::new();
    for round in 0.. {
        let made = model.map(|model| coarse_mesh(comm.size(), model, settings, &sources, progress));
        let mut coarse = agree(comm, made.transpose())?;
        let pieces = broadcast_pieces(comm, coarse.as_ref().map(|(pieces, _)| *pieces))?;
        let (names, projector) = broadcast_geometry(comm, model)?;
        let given = coarse.as_ref().map(|(_, made)| (made.mesh.clone(), made.parts.clone()));
        let dist = progress.stage("distribute", || dist::distribute(comm, given))?;
        refuse_without_memory(comm, &dist, pieces)?;
        let refined = progress
            .stage("refine", || refine::refine(dist, &projector, pieces, &refine::Settings::default()));
        let bad = inverted_anywhere(comm, &refined)?;
        if !bad.is_empty() && round < MOST_ROUNDS {
            if let Some((_, made)) = &coarse {
                sources.extend(mend::lowered(&made.mesh, &bad));
            }
            continue;
        }
        let part = agree(comm, refined.map_err(Failure::from))?;
        let map = periodic_map(comm, model, coarse.as_ref().map(|(_, made)| &made.mesh))?;
        let singular = match model {
            Some(Model::Csg(model)) => model.features.singular(&model.geometry),
            _ => csg::Singular::default(),
        };
        let part = part.with_periodic(map.clone()).with_singular(singular);
        let (check, checksum) = progress.stage("check", || verdict(comm, &part, &projector))?;
        let periodic = periodic_verdict(comm, &part, &map, &projector)?;
        let coarse = coarse.take().map(|(_, made)| made);
        return Ok(Generated { part, pieces, names, check, checksum, periodic, coarse });
    }
    unreachable!("the loop ends by itself")
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
    let (assigned, metrics) = progress
        .stage("partition", || partition::partition(&made.mesh, parts, &partition::Settings::default()))?;
    let CoarseMesh { mesh, report } = made;
    Ok((pieces, CoarseResult { mesh, parts: assigned, report, outcome, partition: metrics }))
}

/// **Collective.** What is periodic in the coarse mesh that rank 0 has.
fn periodic_map(
    comm: &dyn Communicator,
    model: Option<&Model>,
    coarse: Option<&Mesh>,
) -> Result<PeriodicMap, Failure> {
    let map = match (model, coarse) {
        (Some(Model::Csg(model)), Some(mesh)) => {
            PeriodicMap::of(mesh, &model.features).map_err(|error| Failure::new(Status::NoValidMesh, error))
        }
        _ => Ok(PeriodicMap::default()),
    };
    let mut numbers = agree(comm, map)?.encode();
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
    if checked.lost > 0 || checked.furthest > ROOM * projector.tolerance() {
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

/// **Collective.** The names and the surfaces that rank 0 has read.
fn broadcast_geometry(comm: &dyn Communicator, model: Option<&Model>) -> Result<(Names, Projector), Failure> {
    let mut bytes = model.map(|m| m.projector().encode()).unwrap_or_default();
    comm.broadcast_bytes(0, &mut bytes)?;
    let names = model.map(Model::names).unwrap_or_default();
    let mut text = serde_json::to_vec(&(&names.bodies, &names.patches)).expect("plain data");
    comm.broadcast_bytes(0, &mut text)?;
    let (bodies, patches) = serde_json::from_slice(&text).expect("what rank 0 wrote");
    let projector = Projector::decode(&bytes).expect("what rank 0 encoded");
    Ok((Names { bodies, patches }, projector))
}

/// Bytes of a fine vertex: three coordinates.
const VERTEX_BYTES: f64 = 24.0;

/// **Collective.** Refuses what the memory of a machine cannot hold, before anything is refined.
fn refuse_without_memory(comm: &dyn Communicator, part: &DistMesh, pieces: u32) -> Result<(), Failure> {
    let n = f64::from(pieces);
    let on_edge = n - 1.0;
    let on_face = on_edge * (n - 2.0) / 2.0;
    let in_tet = on_face * (n - 3.0) / 3.0;
    let count = |items: usize| items as f64;
    let vertices = count(part.points.len())
        + count(part.edges.len()) * on_edge
        + count(part.faces.len()) * on_face
        + count(part.tets.len()) * in_tet;
    let machine = memory::machine();
    let machines = comm.all_gather_bytes(machine.as_bytes())?;
    let needs = comm.all_gather_one(VERTEX_BYTES * vertices)?;
    let here = machines.iter().zip(&needs).filter(|(name, _)| **name == machine.as_bytes());
    let needed: f64 = here.map(|(_, need)| need).sum();
    let refused = match memory::available_bytes() {
        Some(available) if needed > available as f64 => Err(Failure::new(
            Status::Resources,
            format!(
                "the fine vertices take {:.1} GB and this machine has {:.1} GB left: take fewer levels or tets, \
                 or more machines",
                needed / 1e9,
                available as f64 / 1e9
            ),
        )),
        _ => Ok(()),
    };
    agree(comm, refused)
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
    part: &RefinedMesh,
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
