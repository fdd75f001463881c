//! Why a command ends without result, and the exit status that says so.

use crate::comm::{CommError, Communicator};
use crate::dist::DistError;
use crate::io::WriteError;
use crate::mesh::Rank;
use crate::partition::PartitionError;
use crate::pipeline::coarse::CoarseError;
use crate::pipeline::mend::MendError;
use crate::refine::RefineError;

/// The kinds of failure, as exit statuses.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Status {
    /// A checked mesh has faults.
    Faults = 1,
    /// The input is bad, or asks for what cannot be done.
    Input = 2,
    /// No valid mesh was reached.
    NoValidMesh = 3,
    /// Memory or disk do not suffice.
    Resources = 4,
    /// A rank failed.
    Rank = 5,
}

impl Status {
    const ALL: [Self; 5] = [Self::Faults, Self::Input, Self::NoValidMesh, Self::Resources, Self::Rank];
}

/// A failure: what is told to the user, and the exit status.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{message}")]
pub struct Failure {
    /// Its kind.
    pub status: Status,
    /// What is told, one line or several.
    pub message: String,
}

impl Failure {
    /// A failure of a kind.
    pub fn new(status: Status, message: impl ToString) -> Self {
        Self { status, message: message.to_string() }
    }

    /// The input cannot be used.
    pub fn input(message: impl ToString) -> Self {
        Self::new(Status::Input, message)
    }
}

/// **Collective.** `result` if it is good on every rank; else the failure of the lowest rank that has one,
/// the same on all.
///
/// # Errors
/// That failure, or that a rank is gone.
pub fn agree<T>(comm: &dyn Communicator, result: Result<T, Failure>) -> Result<T, Failure> {
    let mine = result.as_ref().err().map_or(0, |failure| failure.status as u8);
    let all = comm.all_gather_one(mine)?;
    let Some(rank) = all.iter().position(|&status| status != 0) else {
        return result;
    };
    let mut message = match &result {
        Err(failure) if rank == comm.rank() as usize => failure.message.clone().into_bytes(),
        _ => Vec::new(),
    };
    comm.broadcast_bytes(rank as Rank, &mut message)?;
    let status = Status::ALL.into_iter().find(|s| *s as u8 == all[rank]).unwrap_or(Status::Rank);
    Err(Failure { status, message: String::from_utf8_lossy(&message).into_owned() })
}

impl From<CommError> for Failure {
    fn from(error: CommError) -> Self {
        Self::new(Status::Rank, error)
    }
}

impl From<csg::language::Diagnostics> for Failure {
    fn from(error: csg::language::Diagnostics) -> Self {
        Self::input(error)
    }
}

impl From<csg::FeatureError> for Failure {
    fn from(error: csg::FeatureError) -> Self {
        Self::input(error)
    }
}

impl From<CoarseError> for Failure {
    fn from(error: CoarseError) -> Self {
        let status = match error {
            CoarseError::FacetsMeet { .. } => Status::Input,
            _ => Status::NoValidMesh,
        };
        Self::new(status, error)
    }
}

impl From<MendError> for Failure {
    fn from(error: MendError) -> Self {
        match error {
            MendError::Coarse(error) => error.into(),
            MendError::Refine(error) => error.into(),
            MendError::Dist(error) => error.into(),
        }
    }
}

impl From<PartitionError> for Failure {
    fn from(error: PartitionError) -> Self {
        match error {
            PartitionError::MoreParts { parts, .. } => {
                Self::input(format!("{error}; --coarse {parts} suffices"))
            }
            error => Self::input(error),
        }
    }
}

impl From<DistError> for Failure {
    fn from(error: DistError) -> Self {
        Self::new(Status::Rank, error)
    }
}

impl From<RefineError> for Failure {
    fn from(error: RefineError) -> Self {
        let status = match &error {
            RefineError::Pieces { .. } => Status::Input,
            RefineError::Projection { .. } | RefineError::Inverted { .. } => Status::NoValidMesh,
            _ => Status::Resources,
        };
        Self::new(status, error)
    }
}

impl From<WriteError> for Failure {
    fn from(error: WriteError) -> Self {
        let status = match &error {
            WriteError::Io { .. } | WriteError::NoSpace { .. } => Status::Resources,
            WriteError::Comm(_) | WriteError::OtherRank { .. } => Status::Rank,
            _ => Status::Input,
        };
        Self::new(status, error)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::comm::thread;

    #[test]
    fn all_ranks_leave_with_the_failure_of_one() {
        let results = thread::run(3, |comm| {
            let mine = if comm.rank() == 1 { Err(Failure::input("line 3")) } else { Ok(comm.rank()) };
            agree(comm, mine)
        });
        for result in results.unwrap() {
            assert_eq!(result, Err(Failure::input("line 3")));
        }
    }

    #[test]
    fn without_a_failure_each_keeps_its_own() {
        let results = thread::run(2, |comm| agree(comm, Ok(comm.rank()))).unwrap();
        assert_eq!(results, [Ok(0), Ok(1)]);
    }
}
