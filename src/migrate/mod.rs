//! Migration: tets move to other ranks, and all ranks agree on who holds what afterwards.
//!
//! Each rank says where each of its tets is to be. The tets travel in one sparse exchange, with the vertices that the receiver needs,
//! the faces and edges that lie on something, and the bodies. Who holds a vertex afterwards is settled by **owner updates** (chapter 5 of the
//! thesis "A parallel mesh generator based on sequential NETGEN", after SCOREC's parallel mesh database): holders tell the owner what changes, and the
//! owner, which alone knows the whole list, tells the new holders.
//!
//! ```text
//!   old holders ── tets and vertices ──► receivers
//!   old holders ── "v: I drop it", "v: rank d gets it" ──► old owner of v
//!   new holders ◄── "v: its holders are ..." ───────────── old owner of v: deletes, then adds
//! ```
//!
//! Two exchanges, whatever the pattern; messages grow with what moves. The result has a canonical order (by global id), so it depends
//! neither on the order of messages nor on where tets were before: there and back gives the same mesh, bit by bit.
//!
//! | what | how it moves |
//! |---|---|
//! | tets, bodies, boundary faces, edges on curves and patches | with the tets |
//! | edges and faces inside | not: they follow from the tets, their ids and holders by [`settle`] |
//! | names, periodic maps, singular tags | not: all ranks have them, by ids that migration keeps |
//!
//! Not here: where tets should go, which is [`repartition`](crate::repartition)'s question.

mod fine;
mod owners;
mod pack;
mod rebuild;
mod stream;

#[cfg(test)]
mod example_tests;
#[cfg(test)]
mod tests;

pub use fine::bare;
pub use stream::BareStream;

use crate::comm::{Agreed, CommError, Communicator};
use crate::dist::{BareMesh, DistMesh, SettleError, settle};
use crate::mesh::{GlobalId, Rank};

/// Why tets cannot be moved.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum MigrateError {
    /// Not one destination for each tet.
    #[error("{tets} tets on rank {rank}, but destinations for {destinations}")]
    Destinations {
        /// The rank.
        rank: Rank,
        /// Its tets.
        tets: usize,
        /// The destinations given.
        destinations: usize,
    },
    /// The mesh belongs to another group of ranks.
    #[error("the mesh is one of {expected} ranks, and there are {ranks}")]
    Ranks {
        /// The ranks of the mesh.
        expected: u32,
        /// Those there are.
        ranks: u32,
    },
    /// A tet is meant for a rank that does not exist.
    #[error("tet {tet} is meant for rank {destination} of {ranks}")]
    NoSuchRank {
        /// The tet.
        tet: GlobalId,
        /// Where it is meant to go.
        destination: Rank,
        /// The number of ranks.
        ranks: u32,
    },
    /// Local ids are 32-bit.
    #[error("rank {rank} would hold {needed} {what}, above the {} of one part: take more parts", u32::MAX)]
    TooMany {
        /// The rank.
        rank: Rank,
        /// Vertices or tets.
        what: &'static str,
        /// How many.
        needed: u64,
    },
    /// What is to be sent, or the new part, does not fit.
    #[error("rank {rank} has no memory for {bytes} bytes of the tets that leave it or of its new part")]
    OutOfMemory {
        /// The rank.
        rank: Rank,
        /// The bytes of the array that was refused.
        bytes: u64,
    },
    /// Edges and faces cannot be settled.
    #[error(transparent)]
    Settle(#[from] SettleError),
    /// Another rank met an error.
    #[error("rank {rank}: {message}")]
    Elsewhere {
        /// Which.
        rank: Rank,
        /// What it says.
        message: String,
    },
    /// The ranks cannot talk.
    #[error(transparent)]
    Comm(#[from] CommError),
}

impl From<Agreed<Self>> for MigrateError {
    fn from(agreed: Agreed<Self>) -> Self {
        agreed.into_error(|rank, message| Self::Elsewhere { rank, message })
    }
}

/// Choices for [`migrate_bare`].
#[derive(Clone, Copy, Debug)]
pub struct Settings {
    /// The most bytes that one array of a rank's new part, or of what leaves it, may take; beyond, it is refused as if memory were short.
    pub array_limit: u64,
}

impl Default for Settings {
    fn default() -> Self {
        Self { array_limit: u64::MAX }
    }
}

/// What moved, on this rank.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Moved {
    /// Tets that left for other ranks.
    pub tets: u64,
    /// Bytes sent to other ranks.
    pub bytes: u64,
}

/// **Collective.** Moves each tet of this part to its destination, and settles the edges and faces of the new parts.
///
/// Parts may begin and end empty. Global ids do not change, nor do coordinates, by a bit.
///
/// # Errors
/// The same rank's on all ranks: destinations that do not fit, memory, a mesh that is none.
pub fn migrate(
    comm: &dyn Communicator,
    mesh: DistMesh,
    destination: &[Rank],
) -> Result<DistMesh, MigrateError> {
    let (moved, _) = migrate_bare(comm, mesh.into(), destination, &Settings::default())?;
    Ok(settle(comm, moved)?)
}

/// **Collective.** Moves each tet of this part to its destination: [`migrate`] without edges and faces, many times faster.
///
/// # Errors
/// As [`migrate`].
pub fn migrate_bare(
    comm: &dyn Communicator,
    mesh: BareMesh,
    destination: &[Rank],
    settings: &Settings,
) -> Result<(BareMesh, Moved), MigrateError> {
    comm.agree(expect_ranks(&mesh, comm.size()).and_then(|()| expect_destinations(&mesh, destination)))?;
    let room = rebuild::Room { rank: mesh.rank, limit: settings.array_limit };
    let leaving = comm.agree(pack::pack(&mesh, destination, room))?;
    let mut moved = Moved { tets: leaving.tets(), bytes: 0 };

    let updates = owners::updates(&mesh, &leaving);
    let to_owners = owners::letters(&updates);
    let mut letters = leaving.letters;
    let loads = letters.len();
    letters.extend(to_owners);
    moved.bytes += bytes_to_others(&letters, mesh.rank);
    // A load begins with a 0, a letter to an owner with a 1: see below.
    debug_assert!(letters.iter().enumerate().all(|(k, (_, l))| l[0] == u8::from(k >= loads)));
    let (mut arrived, mut instructions) = (Vec::new(), Vec::new());
    for (from, letter) in comm.exchange_bytes(letters)? {
        match letter.split_first() {
            Some((0, load)) => arrived.push(pack::unpack(load)),
            Some((1, told)) => owners::read(told, &mut instructions),
            _ => panic!("rank {} got a letter of no kind from rank {from}", mesh.rank),
        }
    }

    let news = owners::news(&mesh, instructions);
    let letters = owners::news_letters(&news);
    moved.bytes += bytes_to_others(&letters, mesh.rank);
    let heard: Vec<owners::Holders> =
        comm.exchange_bytes(letters)?.iter().flat_map(|(_, letter)| owners::read_news(letter)).collect();

    let rebuilt = rebuild::rebuild(mesh, &leaving.kept, arrived, heard, settings);
    Ok((comm.agree(rebuilt)?, moved))
}

fn expect_ranks(mesh: &BareMesh, ranks: u32) -> Result<(), MigrateError> {
    let expected = mesh.ranks;
    if expected == ranks { Ok(()) } else { Err(MigrateError::Ranks { expected, ranks }) }
}

fn expect_destinations(mesh: &BareMesh, destination: &[Rank]) -> Result<(), MigrateError> {
    let (rank, tets, destinations) = (mesh.rank, mesh.tets.len(), destination.len());
    if tets != destinations {
        return Err(MigrateError::Destinations { rank, tets, destinations });
    }
    match destination.iter().position(|&to| to >= mesh.ranks) {
        None => Ok(()),
        Some(tet) => Err(MigrateError::NoSuchRank {
            tet: mesh.tet_ids[tet],
            destination: destination[tet],
            ranks: mesh.ranks,
        }),
    }
}

fn bytes_to_others(letters: &[(Rank, Vec<u8>)], rank: Rank) -> u64 {
    letters.iter().filter(|(to, _)| *to != rank).map(|(_, letter)| letter.len() as u64).sum()
}
