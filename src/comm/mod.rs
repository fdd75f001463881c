//! Ranks that exchange messages: one small trait, two backends.
//!
//! A **rank** is one of several programs, or threads of one program, that do the same work on
//! different parts of a mesh. They meet in **collective** operations: every rank calls them, in the
//! same order.
//!
//! ```
//! use tetmill::comm::{Communicator, thread};
//!
//! let sums = thread::run(3, |comm: &dyn Communicator| {
//!     let mine = u64::from(comm.rank()) + 1;
//!     comm.all_reduce_sum_u64([mine]).unwrap()[0]
//! });
//! assert_eq!(sums.unwrap(), [6, 6, 6]);
//! ```
//!
//! | backend | ranks are | when one fails |
//! |---|---|---|
//! | [`thread`] | threads of this process | the others get [`CommError::RankFailed`] |
//! | [`mpi`] (feature `mpi`) | processes that `mpirun` started | the job ends with a message |
//! | [`grouped`] | threads of the ranks of another communicator, as many as wanted | what that one does |
//!
//! Messages are slices of plain numbers; how the bytes of several slices share one message: [`pack`].
//! Both backends pass one suite, [`conformance`].
//!
//! Not here: point-to-point messages outside a collective operation, subgroups of ranks, and
//! calls from several threads of one rank (a communicator is not `Sync`: no parallel closure can hold one).

pub mod agree;
#[doc(hidden)]
pub mod conformance;
pub mod grouped;
pub mod launch;
#[cfg(feature = "mpi")]
pub mod mpi;
#[cfg(not(feature = "mpi"))]
#[path = "mpi_disabled.rs"]
pub mod mpi;
pub mod pack;
pub mod thread;
pub mod typed;

pub use agree::Agreed;

use crate::mesh::Rank;

/// A fault that makes a collective operation impossible.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum CommError {
    /// Another rank panicked or left.
    #[error("rank {0} failed")]
    RankFailed(Rank),
    /// There were to be no ranks, or the system gives no thread for one.
    #[error("cannot start {ranks} ranks: {reason}")]
    NotStarted {
        /// How many were asked for.
        ranks: u32,
        /// What the system says.
        reason: String,
    },
}

/// A group of ranks. Object-safe: messages are bytes; see [`typed`] for slices of plain numbers.
///
/// All functions but `rank` and `size` are **Collective**: every rank calls them, in the same order.
/// A rank that panics makes them return (or panic with) [`CommError::RankFailed`] elsewhere, never hang.
pub trait Communicator {
    /// *Local.* This rank.
    fn rank(&self) -> Rank;
    /// *Local.* The number of ranks.
    fn size(&self) -> u32;
    /// **Collective.** Returns when all have called it.
    fn barrier(&self) -> Result<(), CommError>;
    /// **Collective.** Each rank gets what `root` had in `bytes`.
    fn broadcast_bytes(&self, root: Rank, bytes: &mut Vec<u8>) -> Result<(), CommError>;
    /// **Collective.** `root` gets what each rank sent, by rank; the others get an empty list.
    fn gather_bytes(&self, root: Rank, bytes: &[u8]) -> Result<Vec<Vec<u8>>, CommError>;
    /// **Collective.** Each rank gets what each rank sent, by rank.
    fn all_gather_bytes(&self, bytes: &[u8]) -> Result<Vec<Vec<u8>>, CommError>;
    /// **Collective.** The same for messages of one length on all ranks, end to end: cheap where they are
    /// short. Sums and scans are built on it, so that they add in the order of ranks, always alike.
    fn all_gather_equal_bytes(&self, bytes: &[u8]) -> Result<Vec<u8>, CommError>;
    /// **Collective.** `root` gives one message per rank; each rank gets its own.
    ///
    /// # Panics
    /// If `root` gives none, or not one for each rank.
    fn scatter_bytes(&self, root: Rank, messages: Option<Vec<Vec<u8>>>) -> Result<Vec<u8>, CommError>;
    /// **Collective.** Sparse exchange: sends messages to some ranks (itself allowed), gets those sent to
    /// this one by ascending sender, several of one sender in the order in which it gave them.
    /// Cost grows with the messages, not with the ranks squared.
    ///
    /// # Panics
    /// If a message is for a rank that does not exist.
    fn exchange_bytes(&self, messages: Vec<(Rank, Vec<u8>)>) -> Result<Vec<(Rank, Vec<u8>)>, CommError>;
}
