//! Ranks that exchange messages: one small trait, two backends.

use crate::mesh::Rank;

/// A fault that makes a collective operation impossible.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum CommError {
    /// Another rank panicked or left.
    #[error("rank {0} failed")]
    RankFailed(Rank),
}

/// A group of ranks. Object-safe: messages are bytes; see `typed` for slices of plain numbers.
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
    /// **Collective.** `root` gives one message per rank; each rank gets its own.
    fn scatter_bytes(&self, root: Rank, messages: Option<Vec<Vec<u8>>>) -> Result<Vec<u8>, CommError>;
    /// **Collective.** Sparse exchange: sends messages to some ranks (itself allowed), gets those sent to
    /// this one by ascending sender. Cost grows with the messages, not with the ranks squared.
    fn exchange_bytes(&self, messages: Vec<(Rank, Vec<u8>)>) -> Result<Vec<(Rank, Vec<u8>)>, CommError>;
}
