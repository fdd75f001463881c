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
//! | [`mpi`] (feature `mpi`) | processes that `mpirun` started | the job ends with a message, as [`mpi`] says |
//! | [`grouped`] | threads of the ranks of another communicator, as many as wanted | as in that one |
//!
//! Messages are slices of plain numbers; [`pack`] puts several slices into one message. Both
//! backends pass one suite, [`conformance`].
//!
//! Not here: point-to-point messages outside a collective operation, subgroups of ranks, and calls
//! from several threads of one rank (a communicator is not `Sync`).

pub mod agree;
#[doc(hidden)]
pub mod conformance;
pub mod fold;
pub mod group;
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

pub use fold::Fold;

/// A rank of the communicator; also the index of the part on that rank.
pub type Rank = u32;

use crate::ground::error::{ErrorKind, HasKind};
use std::time::Duration;

/// How long a rank sleeps between two tests while it rests.
const REST: Duration = Duration::from_millis(5);

/// Why this rank cannot continue although it had no error of its own.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum CommError {
    /// Another rank panicked or returned early.
    #[error("rank {0} failed")]
    RankFailed(Rank),
    /// Zero ranks were requested, or the system cannot start a thread.
    #[error("cannot start {ranks} ranks: {reason}")]
    NotStarted {
        /// The requested number of ranks.
        ranks: u32,
        /// The reason, or the system's message.
        reason: String,
    },
    /// Another rank had an error, and all ranks agreed to stop.
    #[error("rank {rank}: {message}")]
    Elsewhere {
        /// The lowest rank that had an error, the same on all ranks.
        rank: Rank,
        /// The kind of its error.
        kind: ErrorKind,
        /// The text of its error.
        message: String,
    },
}

impl HasKind for CommError {
    fn kind(&self) -> ErrorKind {
        match self {
            Self::Elsewhere { kind, .. } => *kind,
            Self::NotStarted { ranks: 0, .. } => ErrorKind::Input,
            Self::NotStarted { .. } => ErrorKind::Resources,
            Self::RankFailed(_) => ErrorKind::Rank,
        }
    }

    fn is_elsewhere(&self) -> bool {
        matches!(self, Self::RankFailed(_) | Self::Elsewhere { .. })
    }
}

/// A group of ranks. Object-safe: messages are bytes; the methods on `dyn Communicator` take slices
/// of plain numbers.
///
/// The methods on `dyn Communicator`, such as `all_reduce_sum_f64`, can be called on a
/// [`ThreadComm`](thread::ThreadComm) and an `MpiComm` too, which dereference to it. For another
/// type, or in a function that is generic over communicators, write `let comm: &dyn Communicator =
/// &comm;` first.
///
/// All functions except `rank` and `size` are **Collective**: every rank calls them, in the same
/// order. If a rank panics, they return (or panic with) [`CommError::RankFailed`] elsewhere and
/// never hang; for processes see the [`mpi`] backend.
pub trait Communicator {
    /// *Local.* This rank.
    fn rank(&self) -> Rank;
    /// *Local.* The number of ranks.
    fn size(&self) -> u32;
    /// **Collective.** Returns when all have called it.
    fn barrier(&self) -> Result<(), CommError>;
    /// **Collective.** Replaces `bytes` on each rank by those of `root`.
    fn broadcast_bytes(&self, root: Rank, bytes: &mut Vec<u8>) -> Result<(), CommError>;
    /// **Collective.** `root` receives the message of each rank, by rank; the others get an empty
    /// list.
    fn gather_bytes(&self, root: Rank, bytes: &[u8]) -> Result<Vec<Vec<u8>>, CommError>;
    /// **Collective.** Each rank receives the message of each rank, by rank.
    fn all_gather_bytes(&self, bytes: &[u8]) -> Result<Vec<Vec<u8>>, CommError>;
    /// **Collective.** The same for messages of equal length on all ranks, concatenated; cheap for
    /// short messages. Sums of floating-point numbers are built on it, so that they always add in
    /// rank order.
    fn all_gather_equal_bytes(&self, bytes: &[u8]) -> Result<Vec<u8>, CommError>;
    /// **Collective.** `root` passes one message per rank; each rank receives its own.
    ///
    /// # Panics
    /// If `root` passes no messages, or not one per rank.
    fn scatter_bytes(&self, root: Rank, messages: Option<Vec<Vec<u8>>>) -> Result<Vec<u8>, CommError>;
    /// **Collective.** Sparse exchange: sends messages to some ranks (itself allowed), and receives
    /// those sent to this rank by ascending sender, several of one sender in sending order. The
    /// cost is proportional to the messages, not to the square of the ranks.
    ///
    /// # Panics
    /// If a message is for a rank that does not exist.
    fn exchange_bytes(&self, messages: Vec<(Rank, Vec<u8>)>) -> Result<Vec<(Rank, Vec<u8>)>, CommError>;
    /// **Collective.** Replaces each number by the combination of those of the ranks, entry by
    /// entry; there are equally many on all ranks.
    ///
    /// Backends should override it: the default receives the numbers of all ranks.
    fn fold(&self, fold: Fold, numbers: &mut [u64]) -> Result<(), CommError> {
        fold::by_all_gather(self, fold, numbers)
    }
    /// **Collective.** Waits until `is_over` returns true on rank 0, where it is called every few
    /// milliseconds; it is not called on other ranks. All ranks sleep meanwhile, while in other
    /// operations they may wait busily: for programs that wait for a person.
    fn rest(&self, is_over: &mut dyn FnMut() -> bool) -> Result<(), CommError> {
        sleep_until(self.rank(), is_over);
        self.barrier()
    }
}

/// *Local.* Sleeps on rank 0 until `is_over` returns true.
fn sleep_until(rank: Rank, is_over: &mut dyn FnMut() -> bool) {
    while rank == 0 && !is_over() {
        std::thread::sleep(REST);
    }
}
