//! A rank's part of what was made, as it is kept.

use crate::comm::Communicator;
use crate::dist::{BareMesh, owner, settle};
use crate::error::{Failure, Status};
use crate::mesh::Rank;
use crate::mesh::stream::MeshStream;
use crate::migrate::{self, BareStream};
use crate::progress::Progress;
use crate::refine::RefinedMesh;
use crate::repartition::smooth::{self, smooth};
use crate::repartition::{self, Method, diffuse, islands};

/// The part of the mesh that a rank has.
#[derive(Debug)]
pub enum Part {
    /// A lattice in each coarse tet: tets are computed as they are asked for.
    Refined(Box<RefinedMesh>),
    /// Tets that were meshed, and are kept.
    Stored(Box<BareStream>),
}

impl Part {
    /// For the checker, the writers and all else that reads a mesh.
    pub fn stream(&self) -> &dyn MeshStream {
        match self {
            Self::Refined(part) => &**part,
            Self::Stored(part) => &**part,
        }
    }

    /// Whether all coordinates are kept, see [`Keep`](crate::refine::Keep).
    pub fn keeps_all(&self) -> bool {
        match self {
            Self::Refined(part) => part.keeps_all(),
            Self::Stored(_) => true,
        }
    }
}

/// How evenly a mesh lies on the ranks: the same on all.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Balance {
    /// Vertices in more than one part, each counted once.
    pub shared_vertices: u64,
    /// Tets of the largest part over the mean.
    pub tets: f64,
    /// The largest share of its vertices that a part owns, over the mean.
    pub owned: f64,
    /// Connected pieces of all parts, if tets were meshed on the ranks: else those of the coarse parts.
    pub pieces: Option<u64>,
}

/// **Collective.** Counts what the parts have.
///
/// # Errors
/// What the ranks cannot say.
pub fn balance(comm: &dyn Communicator, part: &Part) -> Result<Balance, Failure> {
    let pieces = match part {
        Part::Refined(_) => None,
        Part::Stored(part) => Some(repartition::islands::pieces(comm, part.mesh())?),
    };
    let part = part.stream();
    let counts = part.counts();
    let (mut held_by_others, mut mine) = (0, 0);
    for index in 0..part.vertex_blocks() {
        let block = part.vertex_block(index);
        if !block.holders.is_empty() {
            let ids = block.ids();
            held_by_others += ids.end - ids.start;
            mine += ids.filter(|&id| owner(block.holders, id) == part.rank()).count() as u64;
        }
    }
    let share = (counts.vertices - held_by_others + mine) as f64 / counts.vertices.max(1) as f64;
    Ok(Balance {
        shared_vertices: comm.all_reduce_sum_u64([mine])?[0],
        tets: imbalance(&comm.all_gather_one(counts.tets as f64)?),
        owned: imbalance(&comm.all_gather_one(share)?),
        pieces,
    })
}

/// Parts that were meshed each on its own are made even where the largest is larger than the mean by more than this factor.
const UNEVEN: f64 = 1.05;

/// What was done to make parts even: the same on all ranks.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Evened {
    /// Tets of the largest part over the mean, before.
    pub imbalance: f64,
    /// Tets that went to other ranks.
    pub moved: u64,
}

/// Moves to neighbours at most, before tets are dealt out from nothing: what has to go far goes a part further each time.
const MOST_MOVES: usize = 4;

/// Cuts are ragged by a tet or two only: twice the steps and four times the rounds share a sixth fewer vertices, in three times the time.
const SMOOTHING: smooth::Settings =
    smooth::Settings { steps: 4, rounds: 2, single_moves: 4, imbalance: UNEVEN };

/// Moves of islands at most: one may have gone where another has just left.
const MOST_JOINS: usize = 3;

/// **Collective.** Moves tets where the parts are too uneven, to neighbours, and if that is not enough, by a partition from nothing; smooths the cuts between
/// parts, which are ragged where tets beside them were improved, and brings small pieces of parts to those around them.
///
/// # Errors
/// The same on all ranks: no mesh, memory.
pub(super) fn even_out(
    comm: &dyn Communicator,
    mut part: BareMesh,
    progress: &Progress,
) -> Result<(BareMesh, Option<Evened>), Failure> {
    let uneven = |part: &BareMesh| Ok::<_, Failure>(imbalance(&comm.all_gather_one(part.tets.len() as f64)?));
    if comm.size() == 1 || part.totals.tets < u64::from(comm.size()) {
        return Ok((part, None));
    }
    progress.stage("even out", || {
        let before = uneven(&part)?;
        let (mut moved, mut imbalance) = (0, before);
        for step in 0..=MOST_MOVES {
            let mesh = settle(comm, part).map_err(|error| Failure::new(Status::NoValidMesh, error))?;
            let mut to = match step {
                _ if imbalance <= UNEVEN => vec![mesh.rank; mesh.tets.len()],
                MOST_MOVES => repartition::repartition(comm, &mesh, comm.size(), Method::default())?,
                _ => diffuse(comm, &mesh)?,
            };
            smooth(comm, &mesh, None, &mut to, comm.size(), &SMOOTHING)?;
            part = join(comm, go(comm, mesh.into(), &to, &mut moved)?, &mut moved)?;
            imbalance = uneven(&part)?;
            if imbalance <= UNEVEN {
                break;
            }
        }
        part = join_interfaces(comm, part, &mut moved)?;
        Ok((part, (moved > 0).then_some(Evened { imbalance: before, moved })))
    })
}

/// **Collective.** Moves tets, and counts them.
fn go(comm: &dyn Communicator, part: BareMesh, to: &[Rank], moved: &mut u64) -> Result<BareMesh, Failure> {
    let (part, mine) = migrate::migrate_bare(comm, part, to, &migrate::Settings::default())?;
    *moved += comm.all_reduce_sum_u64([mine.tets])?[0];
    Ok(part)
}

/// **Collective.** Moves small pieces of parts to those around them.
fn join(comm: &dyn Communicator, mut part: BareMesh, moved: &mut u64) -> Result<BareMesh, Failure> {
    for _ in 0..MOST_JOINS {
        let to = islands(&part);
        if comm.all_reduce_sum_u64([u64::from(to.iter().any(|rank| *rank != part.rank))])? == [0] {
            break;
        }
        part = go(comm, part, &to, moved)?;
    }
    Ok(part)
}

/// **Collective.** Brings the tets on both sides of interfaces between bodies together, if parts stay even.
fn join_interfaces(comm: &dyn Communicator, part: BareMesh, moved: &mut u64) -> Result<BareMesh, Failure> {
    let last = part.tet_bodies.iter().map(|body| u64::from(body.0)).max().unwrap_or(0);
    // Bodies are counted from 0: this is the only one.
    if comm.all_reduce_max_u64([last])? == [0] {
        return Ok(part);
    }
    let mesh = settle(comm, part).map_err(|error| Failure::new(Status::NoValidMesh, error))?;
    let mut to = vec![mesh.rank; mesh.tets.len()];
    repartition::join_interfaces(comm, &mesh, &mut to, comm.size(), UNEVEN)?;
    go(comm, mesh.into(), &to, moved)
}

/// The largest over the mean.
fn imbalance(all: &[f64]) -> f64 {
    let mean = all.iter().sum::<f64>() / all.len() as f64;
    all.iter().copied().fold(0.0, f64::max) / mean
}
