//! Failures of a command and their exit statuses.

use crate::cancel;
use tetmill::comm::{CommError, Communicator};
use tetmill::error::{
    CutError, Error, ErrorKind, HaloError, HasKind, InputError, PartitionError, RequestError, TooManyParts,
};
use tetmill::files::elmer::LoadError;
use tetmill::files::{ReadError, WriteError};

/// Kinds of failure, as exit statuses.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Status {
    /// A checked mesh has faults.
    Faults = 1,
    /// The input is bad, or requests something impossible.
    Input = 2,
    /// No valid mesh was found.
    NoValidMesh = 3,
    /// There is not enough memory or disk space.
    Resources = 4,
    /// A rank failed.
    Rank = 5,
    /// The user cancelled the command.
    Cancelled = cancel::STATUS,
}

impl Status {
    const ALL: [Self; 6] =
        [Self::Faults, Self::Input, Self::NoValidMesh, Self::Resources, Self::Rank, Self::Cancelled];
}

impl From<ErrorKind> for Status {
    fn from(kind: ErrorKind) -> Self {
        match kind {
            ErrorKind::Input => Self::Input,
            ErrorKind::NoMesh => Self::NoValidMesh,
            ErrorKind::Resources => Self::Resources,
            ErrorKind::Rank => Self::Rank,
            ErrorKind::Cancelled => Self::Cancelled,
        }
    }
}

/// A failure: the message for the user and the exit status.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{message}")]
pub struct Failure {
    /// Kind of the failure.
    pub status: Status,
    /// Message of one or more lines.
    pub message: String,
}

impl Failure {
    /// Creates a failure.
    pub fn new(status: Status, message: impl ToString) -> Self {
        Self { status, message: message.to_string() }
    }

    /// Creates a failure of kind [`Status::Input`].
    pub fn input(message: impl ToString) -> Self {
        Self::new(Status::Input, message)
    }
}

/// **Collective.** Returns `result` if no rank failed.
///
/// # Errors
/// The failure of the lowest failed rank, the same on all ranks; or a communication error.
pub fn agree<T>(comm: &dyn Communicator, result: Result<T, Failure>) -> Result<T, Failure> {
    let mine = result.as_ref().err().map(|failure| (failure.status as u8, failure.message.clone()));
    let Some((_, status, message)) = comm.first_failure(mine)? else {
        return result;
    };
    let status = Status::ALL.into_iter().find(|s| *s as u8 == status).unwrap_or(Status::Rank);
    Err(Failure { status, message })
}

/// Names the options that help against an error, to be appended to its message.
fn hint(error: &Error) -> Option<String> {
    let hint = match error {
        Error::Request(RequestError::Option { name, .. }) => match *name {
            "max_size" => "; the option is --maxh",
            "min_size" => "; the options are --minh and --maxh",
            "coarse_tets" => "; the option is --coarse",
            "planes" => "; they come from --planes-from",
            _ => return None,
        },
        Error::Request(
            RequestError::SplitPeriodic { .. } | RequestError::Parts(TooManyParts::Separated(_)),
        ) => ", or insist with --allow-split-periodic",
        Error::Request(RequestError::PeriodicRepartition(_)) => {
            ": make other parts of it with `tetmill generate`, which reads pairs, or insist with --allow-split-periodic"
        }
        Error::Cut(error) if matches!(**error, CutError::NewFace { .. }) => " (`--planes-from FILE`)",
        Error::Input(InputError::Inverted { .. }) => "; see them with `tetmill quality`",
        Error::Partition(PartitionError::MoreParts { parts, .. }) => {
            return Some(format!("; --coarse {parts} suffices"));
        }
        _ => return None,
    };
    Some(hint.into())
}

impl From<Error> for Failure {
    fn from(error: Error) -> Self {
        let message = match &error {
            // All ranks use the same message, so it can be printed once.
            Error::Comm(CommError::Elsewhere { kind: ErrorKind::Cancelled, .. }) | Error::Cancelled(_) => {
                "cancelled: unfinished files are removed, the files they would replace are unchanged".into()
            }
            Error::Comm(CommError::Elsewhere { message, .. }) => message.clone(),
            _ => format!("{error}{}", hint(&error).unwrap_or_default()),
        };
        Self { status: error.kind().into(), message }
    }
}

macro_rules! failures_of {
    ($($error:ty),*) => {$(
        impl From<$error> for Failure {
            fn from(error: $error) -> Self {
                Error::from(error).into()
            }
        }
    )*};
}

failures_of!(CommError, HaloError, LoadError, ReadError, WriteError);

#[cfg(test)]
mod tests {
    use super::*;
    use tetmill::comm::thread;

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
