//! A rank's part of the result, and the balance between parts.

use super::error::Error;
use crate::ground::comm::Communicator;
use crate::ground::mesh::Rank;
use crate::ground::mesh::periodic::Link;
use crate::ground::mesh::stream::MeshStream;
use crate::ground::progress::{Progress, Stage};
use crate::parallel::distribution::{BareMesh, owner};
use crate::parallel::migrate::{self, BareStream};
use crate::parallel::refine::RefinedMesh;
use crate::parallel::repartition::periodic::touching;
use crate::parallel::repartition::smooth::{self, smooth};
use crate::parallel::repartition::{self, Method, Neighbours, absorb_small_components, diffuse};
use std::sync::Arc;

/// A rank's part of the mesh.
#[derive(Debug)]
pub enum Part {
    /// A lattice in each coarse tet; its tets are computed on request.
    Refined(Arc<RefinedMesh>),
    /// Stored tets.
    Stored(Box<BareStream>),
}

impl Part {
    /// The part as a stream for the checker, the writers and other readers.
    pub fn stream(&self) -> &dyn MeshStream {
        match self {
            Self::Refined(part) => &**part,
            Self::Stored(part) => &**part,
        }
    }

    /// Whether all coordinates are stored, see [`Keep`](crate::parallel::refine::Keep).
    pub fn keeps_all(&self) -> bool {
        match self {
            Self::Refined(part) => part.keeps_all(),
            Self::Stored(_) => true,
        }
    }
}

/// Load balance of a mesh, the same on all ranks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Balance {
    /// Vertices in more than one part, each counted once.
    pub shared_vertices: u64,
    /// Number of tets in the largest part, relative to the mean.
    pub tets: f64,
    /// The largest fraction of its vertices that a part owns, relative to the mean.
    pub owned: f64,
    /// Number of connected components of all parts, if the parts are stored; `None` if they were
    /// refined from coarse parts.
    pub pieces: Option<u64>,
}

/// **Collective.** Measures the balance of the parts.
///
/// # Errors
/// If a collective operation fails.
pub fn balance(comm: &dyn Communicator, part: &Part) -> Result<Balance, Error> {
    let pieces = match part {
        Part::Refined(_) => None,
        Part::Stored(part) => Some(repartition::components::pieces(comm, part.mesh())?),
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

/// Separately meshed parts are balanced if the largest exceeds the mean by more than this factor.
const UNEVEN: f64 = 1.05;

/// The result of balancing parts, the same on all ranks.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Evened {
    /// Number of tets in the largest part, relative to the mean, before.
    pub imbalance: f64,
    /// Number of tets moved to other ranks.
    pub moved: u64,
}

/// Maximum number of diffusion steps to neighbours before repartitioning from scratch: each step
/// moves tets only one part further.
const MOST_MOVES: usize = 4;

/// Cuts are ragged by a tet or two only. Twice the steps and four times the rounds would share a
/// sixth fewer vertices, in three times the time.
const SMOOTHING: smooth::Settings =
    smooth::Settings { steps: 4, rounds: 2, single_moves: 4, imbalance: UNEVEN };

/// Maximum number of moves of disconnected components: one may have gone to a place that another
/// has just left.
const MOST_JOINS: usize = 3;

/// **Collective.** Balances uneven parts by moving tets to neighbours, and if that is not enough,
/// by repartitioning from scratch.
///
/// Also smooths the cuts between parts, which are ragged where tets beside them were improved, and
/// moves small disconnected components to the parts around them. Tets that touch the periodic
/// patches of `links` stay.
///
/// # Errors
/// The same on all ranks: an invalid mesh, or not enough memory.
pub(super) fn even_out(
    comm: &dyn Communicator,
    mut part: BareMesh,
    links: &[Link],
    progress: &Progress,
) -> Result<(BareMesh, Option<Evened>), Error> {
    let uneven = |part: &BareMesh| Ok::<_, Error>(imbalance(&comm.all_gather_one(part.tets.len() as f64)?));
    if comm.size() == 1 || part.totals.tets < u64::from(comm.size()) {
        return Ok((part, None));
    }
    progress.stage(Stage::EvenOut, |_| {
        let before = uneven(&part)?;
        let (mut moved, mut imbalance) = (0, before);
        for step in 0..=MOST_MOVES {
            let from_scratch = step == MOST_MOVES && links.is_empty();
            let to = even_ranks(comm, &part, imbalance, from_scratch)?;
            part = migrate_counted(comm, part, links, to, &mut moved)?;
            part = join(comm, part, links, &mut moved)?;
            imbalance = uneven(&part)?;
            if imbalance <= UNEVEN {
                break;
            }
        }
        part = join_interfaces(comm, part, links, &mut moved)?;
        Ok((part, (moved > 0).then_some(Evened { imbalance: before, moved })))
    })
}

/// **Collective.** A rank for each tet, so that parts are more even and the cuts between them
/// smooth.
fn even_ranks(
    comm: &dyn Communicator,
    part: &BareMesh,
    imbalance: f64,
    from_scratch: bool,
) -> Result<Vec<Rank>, Error> {
    let neighbours = Neighbours::find(comm, part)?;
    let mut to = match from_scratch {
        _ if imbalance <= UNEVEN => vec![part.rank; part.tets.len()],
        true => repartition::repartition(comm, part, &neighbours, comm.size(), Method::default())?,
        false => diffuse(comm, &neighbours)?,
    };
    smooth(comm, &neighbours, &part.tet_ids, None, &mut to, comm.size(), &SMOOTHING)?;
    Ok(to)
}

/// **Collective.** Moves tets to other ranks, except at periodic faces, and counts them.
fn migrate_counted(
    comm: &dyn Communicator,
    part: BareMesh,
    links: &[Link],
    mut to: Vec<Rank>,
    moved: &mut u64,
) -> Result<BareMesh, Error> {
    for (to, fixed) in to.iter_mut().zip(touching(comm, &part, links)?) {
        if fixed {
            *to = part.rank;
        }
    }
    let (part, mine) = migrate::migrate_bare(comm, part, &to, &migrate::MoveSettings::default())?;
    *moved += comm.all_reduce_sum_u64([mine.tets])?[0];
    Ok(part)
}

/// **Collective.** Moves small disconnected components to the parts around them.
fn join(
    comm: &dyn Communicator,
    mut part: BareMesh,
    links: &[Link],
    moved: &mut u64,
) -> Result<BareMesh, Error> {
    for _ in 0..MOST_JOINS {
        let to = absorb_small_components(&part);
        if comm.all_reduce_sum_u64([u64::from(to.iter().any(|rank| *rank != part.rank))])? == [0] {
            break;
        }
        part = migrate_counted(comm, part, links, to, moved)?;
    }
    Ok(part)
}

/// **Collective.** Brings the tets on both sides of interfaces between bodies into one part, if
/// parts stay balanced.
fn join_interfaces(
    comm: &dyn Communicator,
    part: BareMesh,
    links: &[Link],
    moved: &mut u64,
) -> Result<BareMesh, Error> {
    let last = part.tet_bodies.iter().map(|body| u64::from(body.0)).max().unwrap_or(0);
    // Bodies count from 0: there is only one.
    if comm.all_reduce_max_u64([last])? == [0] {
        return Ok(part);
    }
    let mut to = vec![part.rank; part.tets.len()];
    let neighbours = Neighbours::find(comm, &part)?;
    repartition::join_interfaces(comm, &part, &neighbours, &mut to, comm.size(), UNEVEN)?;
    drop(neighbours);
    migrate_counted(comm, part, links, to, moved)
}

/// The maximum divided by the mean.
fn imbalance(all: &[f64]) -> f64 {
    let mean = all.iter().sum::<f64>() / all.len() as f64;
    all.iter().copied().fold(0.0, f64::max) / mean
}
