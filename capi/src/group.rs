//! The ranks of a mesh, one for each part.

use crate::fault::Fault;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use tetmill::comm::{self, Communicator, Rank, thread};

/// The ranks of a mesh: threads of this process, or spread over the processes of an MPI job.
pub type Group = comm::Group<Box<dyn Communicator>>;

/// Ranks that are threads of this process.
pub fn of_threads(ranks: u32) -> Result<Group, Fault> {
    if !(1..=thread::MOST_RANKS).contains(&ranks) {
        let most = thread::MOST_RANKS;
        return Err(Fault::usage(format!("`parts` cannot be {ranks}: possible are 1 to {most}")));
    }
    Ok(Group::of_threads(ranks))
}

/// **Collective** over the processes. Runs `body` on each rank; returns the results of this
/// process's ranks, by rank. A panic ends the whole job if there are other processes: they would
/// wait without end.
pub fn on_ranks<T: Send>(
    group: &Group,
    body: impl Fn(&dyn Communicator) -> Result<T, Fault> + Sync,
) -> Result<Vec<T>, Fault> {
    catch_unwind(AssertUnwindSafe(|| group.run(body))).unwrap_or_else(|panic| {
        if group.processes().is_some() {
            end_job();
        }
        resume_unwind(panic)
    })
}

#[cfg(feature = "mpi")]
fn end_job() {
    /// The exit status of a job in which a rank failed.
    const RANK_FAILED: i32 = 5;
    comm::mpi::end_job(RANK_FAILED);
}

#[cfg(not(feature = "mpi"))]
fn end_job() {
    unreachable!("there are no other processes without MPI");
}

/// The part of a rank among those of this process.
pub fn own<T>(parts: &[T], rank: Rank, rank_of: impl Fn(&T) -> Rank) -> &T {
    &parts[(rank - rank_of(&parts[0])) as usize]
}

/// Starts the threads of this process as ranks need them, unless the program has started them.
pub fn start_threads() {
    // The only error is that they run already.
    let _ = rayon::ThreadPoolBuilder::new().stack_size(thread::POOL_STACK).build_global();
}
