//! Migration: moves tets to other ranks and updates the holders of shared vertices.
//!
//! Each rank names a destination for each of its tets. The tets travel in one sparse exchange, with
//! the vertices that the receiver needs, the faces and edges on curves and patches, and the bodies.
//! The new holders of a vertex are found by **owner updates** (chapter 5 of the thesis "A parallel
//! mesh generator based on sequential NETGEN", after SCOREC's parallel mesh database): holders send
//! their changes to the owner, which alone has the whole list and sends it to the new holders.
//!
//! ```text
//!     old holders ── tets and vertices ──► receivers
//!     old holders ── "v: I drop it", "v: rank d gets it" ──► old owner of v
//!     new holders ◄── "v: its holders are ..." ───────────── old owner of v: deletes, then adds
//! ```
//!
//! This takes two exchanges, whatever the pattern; messages are proportional to what moves. The
//! result is in canonical order (by global id), so it depends neither on message order nor on the
//! previous distribution: moving tets and moving them back gives bitwise the same mesh.
//!
//! | data | how it moves |
//! |---|---|
//! | tets, bodies, boundary faces, edges on curves and patches | with the tets |
//! | interior edges and faces | not at all: they follow from the tets, their ids and holders from [`number_shared`] |
//! | names, periodic maps, singular tags | not at all: all ranks have them, by ids that migration keeps |
//!
//! Not here: the choice of destinations, see [`repartition`](crate::parallel::repartition).

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

use crate::ground::comm::{CommError, Communicator};
use crate::ground::error::{ErrorKind, HasKind};
use crate::ground::mesh::{GlobalId, Rank};
use crate::parallel::distribution::{BareMesh, DistMesh, NumberError, number_shared};

/// Why tets cannot be moved.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum MigrateError {
    /// The destinations are not one per tet.
    #[error("rank {rank} has {tets} tets, but {destinations} destinations")]
    Destinations {
        /// The rank.
        rank: Rank,
        /// The number of its tets.
        tets: usize,
        /// The number of destinations.
        destinations: usize,
    },
    /// The mesh is distributed over another number of ranks.
    #[error("the mesh is distributed over {expected} ranks, but there are {ranks}")]
    Ranks {
        /// The number of ranks of the mesh.
        expected: u32,
        /// The number of ranks of the communicator.
        ranks: u32,
    },
    /// A tet is assigned to a rank that does not exist.
    #[error("tet {tet} is assigned to rank {destination}, but there are {ranks} ranks")]
    NoSuchRank {
        /// The tet.
        tet: GlobalId,
        /// The rank it is assigned to.
        destination: Rank,
        /// The number of ranks.
        ranks: u32,
    },
    /// Local ids are 32-bit.
    #[error("rank {rank} would hold {needed} {what}, above the {} of one part: take more parts", u32::MAX)]
    TooMany {
        /// The rank.
        rank: Rank,
        /// "vertices" or "tets".
        what: &'static str,
        /// Their number.
        needed: u64,
    },
    /// Allocation of a message or of the new part failed.
    #[error("rank {rank} has no memory for {bytes} bytes of the tets that leave it or of its new part")]
    OutOfMemory {
        /// The rank.
        rank: Rank,
        /// The bytes of the array that could not be allocated.
        bytes: u64,
    },
    /// The edges and faces of the new parts cannot be numbered.
    #[error(transparent)]
    Number(#[from] NumberError),
    /// Another rank met an error, or the ranks cannot communicate.
    #[error(transparent)]
    Comm(#[from] CommError),
}

impl HasKind for MigrateError {
    fn kind(&self) -> ErrorKind {
        match self {
            Self::OutOfMemory { .. } | Self::TooMany { .. } => ErrorKind::Resources,
            Self::Destinations { .. } | Self::Ranks { .. } | Self::NoSuchRank { .. } => ErrorKind::Input,
            Self::Number(error) => error.kind(),
            Self::Comm(error) => error.kind(),
        }
    }

    fn is_elsewhere(&self) -> bool {
        matches!(self, Self::Comm(error) if error.is_elsewhere())
    }
}

/// Parameters of [`migrate_bare`].
#[derive(Clone, Copy, Debug)]
pub struct MoveSettings {
    /// The maximum bytes of one array of a message or of the new part; larger arrays are treated
    /// like failed allocations.
    pub array_limit: u64,
}

impl Default for MoveSettings {
    fn default() -> Self {
        Self { array_limit: u64::MAX }
    }
}

/// Amounts moved by this rank.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Moved {
    /// Tets sent to other ranks.
    pub tets: u64,
    /// Bytes sent to other ranks.
    pub bytes: u64,
}

/// **Collective.** Moves each tet of this part to its destination and numbers the edges and faces
/// of the new parts.
///
/// Parts may be empty before and after. Global ids and coordinates do not change (bitwise).
///
/// # Errors
/// [`MigrateError`] if the destinations do not fit, memory runs out or the mesh is not a manifold.
/// All ranks return an error; the others one that names the failed rank.
pub fn migrate(
    comm: &dyn Communicator,
    mesh: DistMesh,
    destination: &[Rank],
) -> Result<DistMesh, MigrateError> {
    let (moved, _) = migrate_bare(comm, mesh.into(), destination, &MoveSettings::default())?;
    Ok(number_shared(comm, moved)?)
}

/// **Collective.** [`migrate`] without edges and faces, which is many times faster; also returns
/// the amounts moved.
///
/// # Errors
/// As [`migrate`].
pub fn migrate_bare(
    comm: &dyn Communicator,
    mesh: BareMesh,
    destination: &[Rank],
    settings: &MoveSettings,
) -> Result<(BareMesh, Moved), MigrateError> {
    comm.agree(expect_ranks(&mesh, comm.size()).and_then(|()| expect_destinations(&mesh, destination)))?;
    let room = rebuild::Room { rank: mesh.rank, limit: settings.array_limit };
    let leaving = comm.agree(pack::pack(&mesh, destination, room))?;
    let mut moved = Moved { tets: leaving.tets(), bytes: 0 };

    let updates = owners::updates(&mesh, &leaving);
    let to_owners = owners::update_messages(&updates);
    let mut messages = leaving.messages;
    let tet_messages = messages.len();
    messages.extend(to_owners);
    moved.bytes += bytes_to_others(&messages, mesh.rank);
    // The first byte of a message is its kind: 0 for tets, 1 for owner updates.
    debug_assert!(messages.iter().enumerate().all(|(k, (_, l))| l[0] == u8::from(k >= tet_messages)));
    let (mut incoming, mut changes) = (Vec::new(), Vec::new());
    for (from, message) in comm.exchange_bytes(messages)? {
        match message.split_first() {
            Some((0, message)) => incoming.push(pack::unpack(message)),
            Some((1, message)) => owners::read_updates(message, &mut changes),
            _ => panic!("rank {} got a message of unknown kind from rank {from}", mesh.rank),
        }
    }

    let new_holders = owners::new_holders(&mesh, changes);
    let messages = owners::holder_messages(&new_holders);
    moved.bytes += bytes_to_others(&messages, mesh.rank);
    let received: Vec<owners::Holders> = comm
        .exchange_bytes(messages)?
        .iter()
        .flat_map(|(_, message)| owners::read_holders(message))
        .collect();

    let rebuilt = rebuild::rebuild(mesh, &leaving.kept, incoming, received, settings);
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

fn bytes_to_others(messages: &[(Rank, Vec<u8>)], rank: Rank) -> u64 {
    messages.iter().filter(|(to, _)| *to != rank).map(|(_, message)| message.len() as u64).sum()
}
