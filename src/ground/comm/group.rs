//! A group of ranks that meets again and again, for programs that keep a mesh with its parts.

use super::{CommError, Communicator, Rank, grouped, thread};
use crate::ground::error::HasKind;
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::ops::Deref;

/// The ranks of a mesh: threads of this process, or ranks dealt out to the processes of another
/// communicator, such as an `MpiComm`.
///
/// A rank exists only while [`run`](Self::run) is running. Between the runs a process keeps what
/// its ranks have made.
#[derive(Debug)]
pub struct Group<P> {
    ranks: u32,
    /// The processes; `None` if all ranks are threads of this one.
    processes: Option<P>,
}

impl<'c, P: Deref<Target = dyn Communicator + 'c>> Group<P> {
    /// Ranks that are threads of this process: 1 to [`MOST_RANKS`](thread::MOST_RANKS).
    pub fn of_threads(ranks: u32) -> Self {
        Self { ranks, processes: None }
    }

    /// Ranks of several processes, which all give the same number; 0 stands for one rank each.
    pub fn of_processes(processes: P, ranks: u32) -> Self {
        Self { ranks: if ranks == 0 { processes.size() } else { ranks }, processes: Some(processes) }
    }

    /// *Local.* The number of ranks.
    pub fn ranks(&self) -> u32 {
        self.ranks
    }

    /// *Local.* The processes; `None` if all ranks are threads of this one.
    pub fn processes(&self) -> Option<&P> {
        self.processes.as_ref()
    }

    /// *Local.* Whether this process has rank 0: it gives the geometry.
    pub fn is_first(&self) -> bool {
        self.processes.as_deref().is_none_or(|processes| processes.rank() == 0)
    }

    /// **Collective** over the processes. Runs `body` on each rank; returns the results of this
    /// process's ranks, by rank. A process has no ranks if there are fewer ranks than processes.
    ///
    /// # Errors
    /// On all processes, if `body` fails on any rank.
    pub fn run<T, E>(&self, body: impl Fn(&dyn Communicator) -> Result<T, E> + Sync) -> Result<Vec<T>, E>
    where
        T: Send,
        E: HasKind + From<CommError> + Send,
    {
        let Some(processes) = self.processes.as_deref() else { return thread::try_run(self.ranks, body) };
        if processes.size() == self.ranks {
            return processes.agree(body(processes)).map(|result| vec![result]);
        }
        let results = grouped::run(processes, self.ranks, body).map_err(E::from);
        processes.agree(results.and_then(|results| results.into_iter().collect()))
    }

    /// **Collective** over the processes. Gives all of them what process 0 has; `mine` counts there
    /// only.
    ///
    /// # Panics
    /// If process 0 has nothing.
    pub fn share<T: Serialize + DeserializeOwned>(&self, mine: Option<T>) -> Result<T, CommError> {
        const ROOT: Rank = 0;
        let nothing = "process 0 has a rank";
        let Some(processes) = self.processes.as_deref() else { return Ok(mine.expect(nothing)) };
        let mut bytes = serde_json::to_vec(&mine).expect("plain data");
        processes.broadcast_bytes(ROOT, &mut bytes)?;
        let shared: Option<T> = serde_json::from_slice(&bytes).expect("as process 0 wrote it");
        Ok(shared.expect(nothing))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ground::error::ErrorKind;

    #[test]
    fn a_group_has_as_many_ranks_as_asked_for_whatever_the_processes() {
        for (processes, ranks) in [(1, 3), (3, 3), (3, 7), (3, 2), (3, 0)] {
            let results = thread::run(processes, |outer| {
                let group = Group::of_processes(outer, ranks);
                let sum = |comm: &dyn Communicator| comm.all_reduce_sum_u64([u64::from(comm.rank())]);
                let sums = group.run(sum).unwrap();
                let shared = group.share(sums.first().copied()).unwrap();
                (group.ranks(), group.is_first(), sums, shared)
            });
            let expected = if ranks == 0 { processes } else { ranks };
            let sum = [u64::from(expected * (expected - 1) / 2)];
            let mut made = 0;
            for (process, (ranks, is_first, sums, shared)) in results.unwrap().into_iter().enumerate() {
                assert_eq!((ranks, is_first, shared), (expected, process == 0, sum));
                assert!(sums.iter().all(|of_rank| *of_rank == sum));
                made += sums.len() as u32;
            }
            assert_eq!(made, expected);
        }
    }

    #[test]
    fn an_error_of_one_rank_is_an_error_of_all_processes() {
        for ranks in [2, 3, 7] {
            let results = thread::run(3, |outer| {
                let failing = |comm: &dyn Communicator| {
                    let refusal = CommError::NotStarted { ranks: 0, reason: "for the test".into() };
                    comm.agree(if comm.rank() == 1 { Err(refusal) } else { Ok(()) })
                };
                Group::of_processes(outer, ranks).run(failing).unwrap_err()
            });
            for error in results.unwrap() {
                assert_eq!(error.kind(), ErrorKind::Input);
                assert!(error.to_string().contains("for the test"), "{error}");
            }
        }
    }
}
