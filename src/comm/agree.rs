//! An error on one rank becomes an error on all, before anyone leaves.

use super::{CommError, Communicator};
use crate::mesh::Rank;
use std::fmt::Display;

/// Why the ranks stop together.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Agreed<E> {
    /// A rank met an error.
    #[error("rank {rank}: {message}")]
    Failed {
        /// The lowest rank that met one, the same on all ranks.
        rank: Rank,
        /// What it says, the same on all ranks.
        message: String,
        /// The error of this rank, if it met one too.
        own: Option<E>,
    },
    /// The ranks could not even talk.
    #[error(transparent)]
    Comm(#[from] CommError),
}

impl<E> Agreed<E> {
    /// This rank's own error if it met one, else what `elsewhere` makes of the other rank and its message.
    pub fn into_error<F: From<E> + From<CommError>>(self, elsewhere: impl FnOnce(Rank, String) -> F) -> F {
        match self {
            Self::Failed { own: Some(error), .. } => error.into(),
            Self::Failed { rank, message, own: None } => elsewhere(rank, message),
            Self::Comm(error) => error.into(),
        }
    }
}

impl dyn Communicator + '_ {
    /// **Collective.** Gives back `result` if it is good on every rank. Else each rank gets the message
    /// of the lowest rank where it is not, and none goes on to wait for one that left.
    pub fn agree<T, E: Display>(&self, result: Result<T, E>) -> Result<T, Agreed<E>> {
        let failed = self.all_gather_equal_bytes(&[u8::from(result.is_err())])?;
        let Some(lowest) = failed.iter().position(|&failed| failed != 0) else {
            return Ok(result.unwrap_or_else(|error| unreachable!("no rank failed, yet: {error}")));
        };
        let rank = Rank::try_from(lowest).expect("ranks are u32");
        let own = result.err();
        let mut message = match &own {
            Some(error) if rank == self.rank() => error.to_string().into_bytes(),
            _ => Vec::new(),
        };
        self.broadcast_bytes(rank, &mut message)?;
        Err(Agreed::Failed { rank, message: String::from_utf8_lossy(&message).into_owned(), own })
    }
}
