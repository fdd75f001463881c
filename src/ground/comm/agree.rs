//! Agreement on errors: an error on one rank becomes an error on all, before any rank returns.

use super::{CommError, Communicator, Rank};
use crate::ground::error::{ErrorKind, HasKind};

impl dyn Communicator + '_ {
    /// **Collective.** Returns the rank, code and message of the lowest rank that fails, the same
    /// on all ranks; `None` if no rank does. Codes are not 0.
    ///
    /// # Errors
    /// If the ranks cannot communicate.
    pub fn first_failure(&self, mine: Option<(u8, String)>) -> Result<Option<(Rank, u8, String)>, CommError> {
        let (code, message) = mine.unwrap_or_default();
        // The lowest rank that fails has the largest number.
        let ranks_after = u64::from(self.size() - self.rank());
        let mine = if code == 0 { 0 } else { ranks_after << u8::BITS | u64::from(code) };
        let [largest] = self.all_reduce_max_u64([mine])?;
        if largest == 0 {
            return Ok(None);
        }
        let rank = self.size() - (largest >> u8::BITS) as Rank;
        let mut message = message.into_bytes();
        self.broadcast_bytes(rank, &mut message)?;
        Ok(Some((rank, largest as u8, String::from_utf8_lossy(&message).into_owned())))
    }

    /// **Collective.** Returns `result` if no rank has an error, so that no rank waits for one that
    /// returned.
    ///
    /// # Errors
    /// On a rank with an error, that error; on the others [`CommError::Elsewhere`] with the error
    /// of the lowest rank that has one.
    pub fn agree<T, E: HasKind + From<CommError>>(&self, result: Result<T, E>) -> Result<T, E> {
        let mine = result.as_ref().err().map(|error| (error.kind() as u8, error.to_string()));
        match self.first_failure(mine)? {
            None => result,
            Some((rank, kind, message)) => {
                let kind = ErrorKind::of_number(kind);
                result.and(Err(CommError::Elsewhere { rank, kind, message }.into()))
            }
        }
    }
}
