//! The twin of the MPI backend in a build without the feature `mpi`: running always fails.

use super::Communicator;
use super::launch::{Launch, LaunchError, this_process};

/// *Local.* Whether a launcher (`mpirun`, `srun`, ...) started this process as one of several
/// ranks.
pub fn launched() -> bool {
    this_process() != Launch::Alone
}

/// Fails: this build has no MPI.
///
/// # Errors
/// Always `LaunchError::NotBuilt`, which explains how to build with MPI.
pub fn run<R>(_body: impl FnOnce(&dyn Communicator) -> R) -> Result<R, LaunchError> {
    let ranks = match this_process() {
        Launch::Alone => Some(1),
        Launch::Ranks(ranks) => ranks,
    };
    Err(LaunchError::NotBuilt { ranks })
}

/// *Local.* Returns: there is no job.
pub fn end_job(_status: i32) {}
