//! The ranks that a command runs on, and the threads of a rank.

use crate::failure::{Failure, Status, agree};
use crate::report::counted;
use tetmill::comm::{Communicator, grouped, mpi, thread};

/// Runs a command on one rank for each part.
///
/// There are `parts` parts, by default as many as ranks. Under `mpirun` the ranks are processes; if
/// the number of parts differs, some processes run several parts or none.
pub fn on_ranks(
    ranks: Option<u32>,
    parts: Option<u32>,
    command: impl Fn(&dyn Communicator) -> Result<(), Failure> + Sync,
) -> Result<(), Failure> {
    if mpi::launched() {
        let done = mpi::run(|comm| {
            let done = match (ranks, parts) {
                (Some(ranks), _) if ranks != comm.size() => Err(Failure::input(format!(
                    "-n {ranks} differs from the {} started by mpirun: leave out -n",
                    counted(comm.size().into(), "rank", "ranks")
                ))),
                (_, Some(parts)) if parts != comm.size() => {
                    let ran = grouped::run(comm, parts, &command).map_err(Failure::from);
                    agree(comm, ran.and_then(|results| results.into_iter().collect()))
                }
                _ => command(comm),
            };
            done.map_err(|failure| print_once(comm, failure))
        });
        return done.map_err(Failure::input)?;
    }
    let ranks = parts.or(ranks).unwrap_or(1);
    if ranks > thread::MOST_RANKS {
        return Err(Failure::input(format!(
            "{ranks} ranks in one process: at most {} are possible, more with mpirun",
            thread::MOST_RANKS
        )));
    }
    let results = thread::run(ranks, command)?;
    results.into_iter().collect()
}

/// Runs a serial command: under `mpirun` on rank 0 alone, whose status all ranks return.
pub fn on_one_rank(command: impl Fn() -> Result<(), Failure>) -> Result<(), Failure> {
    if !mpi::launched() {
        return command();
    }
    let done = mpi::run(|comm| {
        let done = if comm.rank() == 0 { command() } else { Ok(()) };
        agree(comm, done).map_err(|failure| print_once(comm, failure))
    });
    done.map_err(Failure::input)?
}

/// **Collective.** Prints a failure common to all ranks on rank 0, and returns it without its
/// message.
///
/// The barrier keeps the other ranks alive until it is printed: the launcher kills all processes
/// when one ends with an error.
fn print_once(comm: &dyn Communicator, failure: Failure) -> Failure {
    if comm.rank() == 0 {
        eprintln!("tetmill: {failure}");
    }
    match comm.barrier() {
        Ok(()) => Failure::new(failure.status, ""),
        Err(error) => error.into(),
    }
}

/// Sets the number of threads of this process; by default one for each core.
pub fn set_threads(threads: Option<u32>) -> Result<(), Failure> {
    let threads = threads.unwrap_or(0) as usize;
    rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .stack_size(thread::POOL_STACK)
        .build_global()
        .map_err(|error| {
            let threads = counted(threads as u64, "thread", "threads");
            Failure::new(Status::Resources, format!("cannot start {threads}: {error}"))
        })
}
