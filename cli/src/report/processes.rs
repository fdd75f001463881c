//! Time and memory of the processes of a run: rank 0, mean and maximum.

use serde::Serialize;
use std::fmt;
use std::hash::{DefaultHasher, Hash, Hasher};
use tetmill::comm::{CommError, Communicator};
use tetmill::memory;
use tetmill::memory::sized;

/// Summary of one number of each process.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Spread {
    /// Value of the process with rank 0.
    pub first: f64,
    /// Mean.
    pub mean: f64,
    /// Maximum.
    pub most: f64,
}

impl Spread {
    fn of(numbers: &[u64], unit: f64) -> Self {
        let mean = numbers.iter().sum::<u64>() as f64 / numbers.len() as f64;
        let most = numbers.iter().copied().max().unwrap_or(0);
        Self { first: numbers[0] as f64 * unit, mean: mean * unit, most: most as f64 * unit }
    }
}

/// Time and memory of the processes that the ranks run in.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Processes {
    /// Number of processes: one for all in-process ranks.
    pub count: u64,
    /// Processor seconds of all threads.
    pub cpu_seconds: Spread,
    /// Peak resident memory, bytes.
    pub peak_memory: Spread,
}

impl Processes {
    /// Peak resident memory of all processes together, bytes; `None` if the system does not report
    /// it.
    pub fn memory(&self) -> Option<u64> {
        let sum = (self.peak_memory.mean * self.count as f64).round() as u64;
        (sum > 0).then_some(sum)
    }
}

/// Hash of a name, the same in all processes.
fn hash_of(name: &str) -> u64 {
    let mut hasher = DefaultHasher::new();
    name.hash(&mut hasher);
    hasher.finish()
}

/// **Collective.** Time and memory of all processes so far, each counted once; the same on all
/// ranks.
///
/// Values that the system does not report are zero.
///
/// # Errors
/// If another rank fails.
pub fn processes(comm: &dyn Communicator) -> Result<Processes, CommError> {
    /// Seconds are sent as integers in this unit.
    const TICK: f64 = 1e-3;
    let machine = hash_of(&memory::machine());
    let ticks = (memory::cpu_seconds().unwrap_or(0.0) / TICK).round() as u64;
    let mine = [machine, u64::from(std::process::id()), ticks, memory::peak_bytes().unwrap_or(0)];
    let all = comm.all_gather_one(mine)?;
    let mut seen = std::collections::BTreeSet::new();
    let each: Vec<[u64; 4]> =
        all.into_iter().filter(|[machine, process, ..]| seen.insert([*machine, *process])).collect();
    let column = |k: usize| each.iter().map(|of| of[k]).collect::<Vec<u64>>();
    Ok(Processes {
        count: each.len() as u64,
        cpu_seconds: Spread::of(&column(2), TICK),
        peak_memory: Spread::of(&column(3), 1.0),
    })
}

impl fmt::Display for Processes {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(bytes) = self.memory() {
            writeln!(f, "memory     {} at the peak", sized(bytes))?;
        }
        if self.count > 1 {
            let (cpu, memory) = (self.cpu_seconds, self.peak_memory);
            let [first, mean, most] =
                [memory.first, memory.mean, memory.most].map(|bytes| sized(bytes as u64));
            writeln!(
                f,
                "processes  {}: rank 0 {:.1} processor s and {first}, in the mean {:.1} s and {mean}, at most {:.1} s and {most}",
                self.count, cpu.first, cpu.mean, cpu.most
            )?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use tetmill::comm::thread;

    #[test]
    fn ranks_of_one_process_count_once() {
        let taken = thread::run(3, |comm| processes(comm).unwrap()).unwrap();
        // Processor time is not compared: it differs between ranks.
        assert!(taken.iter().all(|of| of.count == 1));
        assert_eq!(taken[0].memory().is_some(), memory::peak_bytes().is_some());
    }

    #[test]
    fn a_spread_has_rank_0_the_mean_and_the_maximum() {
        let spread = Spread::of(&[4000, 1000, 1000], 1e-3);
        assert_eq!(spread, Spread { first: 4.0, mean: 2.0, most: 4.0 });
    }
}
