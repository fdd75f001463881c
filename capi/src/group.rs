//! The ranks of a mesh, one for each part.

use crate::fault::Fault;
use serde::Serialize;
use serde::de::DeserializeOwned;
use tetmill::comm::{Communicator, Rank, grouped, thread};

/// The ranks of a mesh: threads of this process, or spread over the processes of an MPI job.
pub struct Group {
    ranks: u32,
    /// The processes; `None` if all ranks are threads of this one.
    processes: Option<Box<dyn Communicator>>,
}

impl Group {
    /// Ranks of this process.
    pub fn of_threads(ranks: u32) -> Result<Self, Fault> {
        if !(1..=thread::MOST_RANKS).contains(&ranks) {
            let most = thread::MOST_RANKS;
            return Err(Fault::usage(format!("`parts` cannot be {ranks}: possible are 1 to {most}")));
        }
        Ok(Self { ranks, processes: None })
    }

    /// Ranks of several processes; 0 ranks are one for each process.
    #[cfg(feature = "mpi")]
    pub fn of_processes(processes: Box<dyn Communicator>, ranks: u32) -> Self {
        Self { ranks: if ranks == 0 { processes.size() } else { ranks }, processes: Some(processes) }
    }

    /// **Collective** over the processes. Runs `body` on each rank; returns the results of this
    /// process's ranks, by rank.
    pub fn run<T: Send>(
        &self,
        body: impl Fn(&dyn Communicator) -> Result<T, Fault> + Sync,
    ) -> Result<Vec<T>, Fault> {
        let Some(processes) = &self.processes else { return thread::try_run(self.ranks, body) };
        if processes.size() == self.ranks {
            return Ok(vec![body(&**processes)?]);
        }
        let results = grouped::run(&**processes, self.ranks, body).map_err(Fault::from);
        // A process without ranks has no result, and gets the error of the others here.
        processes.agree(results.and_then(|results| results.into_iter().collect()))
    }

    /// **Collective** over the processes. What process 0 has, for all of them if some have no
    /// ranks, else what each has.
    pub fn share<T: Serialize + DeserializeOwned>(&self, mine: Option<T>) -> Result<T, Fault> {
        if let Some(processes) = self.processes.as_ref().filter(|processes| processes.size() > self.ranks) {
            let mut bytes = mine.map_or(Vec::new(), |mine| serde_json::to_vec(&mine).expect("plain data"));
            processes.broadcast_bytes(0, &mut bytes)?;
            return Ok(serde_json::from_slice(&bytes).expect("as process 0 wrote it"));
        }
        Ok(mine.expect("each process has ranks"))
    }

    /// Whether this process gives the geometry: all ranks of one process, or process 0.
    pub fn is_first(&self) -> bool {
        self.processes.as_ref().is_none_or(|processes| processes.rank() == 0)
    }
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
