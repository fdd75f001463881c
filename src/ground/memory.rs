//! Memory and time used by this process, and memory available on the machine.

use crate::ground::comm::{CommError, Communicator};
use bytemuck::Pod;
use std::cell::Cell;
use std::sync::atomic::{AtomicU64, Ordering};

thread_local! {
    /// Whether this thread handles failed allocations.
    static MAY_FAIL: Cell<bool> = const { Cell::new(false) };
}

/// Runs `allocate`, which handles failed allocations, as [`Vec::try_reserve`] does. Not nested.
///
/// A program's allocator can end the program on any other failed allocation, see
/// [`allocation_may_fail`].
pub(crate) fn try_to_allocate<T>(allocate: impl FnOnce() -> T) -> T {
    MAY_FAIL.set(true);
    let result = allocate();
    MAY_FAIL.set(false);
    result
}

/// Whether this thread handles a failed allocation: it returns an error.
///
/// For the global allocator of a program that ends itself if memory runs out, as the program
/// `tetmill` does, rather than to be aborted by Rust: it must not do so if this returns `true`.
/// Allocates nothing.
pub fn allocation_may_fail() -> bool {
    MAY_FAIL.get()
}

/// The largest peak before [`restart_peak`].
static EARLIER_PEAK: AtomicU64 = AtomicU64::new(0);

/// The peak resident set of this process in bytes; `None` if the system does not report it.
pub fn peak_bytes() -> Option<u64> {
    peak_since_restart().map(|peak| peak.max(EARLIER_PEAK.load(Ordering::Relaxed)))
}

/// Starts a new peak for [`peak_since_restart`] at the resident set of now, if the system can.
pub(crate) fn restart_peak() {
    /// What the system takes as a request to do so, see `proc_pid_clear_refs(5)`.
    const RESTART: &str = "5";
    let Some(peak) = peak_since_restart() else { return };
    EARLIER_PEAK.fetch_max(peak, Ordering::Relaxed);
    // Without this, the peaks of later stages are those since the start.
    let _ = std::fs::write("/proc/self/clear_refs", RESTART);
}

/// The peak resident set of this process in bytes since the last [`restart_peak`]; `None` if the
/// system does not report it.
pub(crate) fn peak_since_restart() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|line| line.starts_with("VmHWM:"))?;
    let kib: u64 = line.split_whitespace().nth(1)?.parse().ok()?;
    Some(kib * 1024)
}

/// Processor seconds of all threads of this process so far, including ended ones; `None` if the
/// system does not report them.
pub fn cpu_seconds() -> Option<f64> {
    /// Ticks of `/proc` in a second.
    const TICKS: f64 = 100.0;
    let stat = std::fs::read_to_string("/proc/self/stat").ok()?;
    // The program name, in brackets, may contain blanks; user and system time are the 12th and 13th
    // words after it.
    let words: Vec<&str> = stat.rsplit(')').next()?.split_whitespace().collect();
    let ticks = |k: usize| words.get(k)?.parse::<f64>().ok();
    Some((ticks(11)? + ticks(12)?) / TICKS)
}

/// The memory available to this process in bytes: that of the machine, or less if the process has a
/// limit (`ulimit -v`); `None` if the system does not report it.
pub fn available_bytes() -> Option<u64> {
    let on_machine = available_on_machine()?;
    Some(left_of_limit().map_or(on_machine, |left| left.min(on_machine)))
}

/// What is left of the limit on the address space of this process, if it has one.
fn left_of_limit() -> Option<u64> {
    let limits = std::fs::read_to_string("/proc/self/limits").ok()?;
    let line = limits.lines().find_map(|line| line.strip_prefix("Max address space"))?;
    let limit: u64 = line.split_whitespace().next()?.parse().ok()?;
    // Pages of 4 KiB, the only size on the usual machines.
    let pages = std::fs::read_to_string("/proc/self/statm").ok()?;
    let used = 4096 * pages.split_whitespace().next()?.parse::<u64>().ok()?;
    Some(limit.saturating_sub(used))
}

fn available_on_machine() -> Option<u64> {
    let text = std::fs::read_to_string("/proc/meminfo").ok()?;
    let line = text.lines().find(|line| line.starts_with("MemAvailable:"))?;
    let kib: u64 = line.split_whitespace().nth(1)?.parse().ok()?;
    Some(kib * 1024)
}

/// The host name, to identify ranks that share memory; empty if the system does not report it.
pub fn machine() -> String {
    std::fs::read_to_string("/proc/sys/kernel/hostname").unwrap_or_default()
}

/// **Collective.** The sums of the bytes of all ranks on this machine.
pub fn on_machine<const N: usize>(comm: &dyn Communicator, bytes: [u64; N]) -> Result<[u64; N], CommError>
where
    [u64; N]: Pod,
{
    let machine = machine();
    let machines = comm.all_gather_bytes(machine.as_bytes())?;
    let of_ranks = comm.all_gather_one(bytes)?;
    let here = machines.iter().zip(&of_ranks).filter(|(name, _)| **name == machine.as_bytes());
    let add = |sums: [u64; N], more: &[u64; N]| std::array::from_fn(|k| sums[k] + more[k]);
    Ok(here.map(|(_, bytes)| bytes).fold([0; N], add))
}

/// Formats bytes with a suitable unit.
pub fn sized(bytes: u64) -> String {
    let units = ["B", "kB", "MB", "GB", "TB"];
    let power = (bytes.max(1).ilog10() / 3).min(4);
    let value = bytes as f64 / 1000f64.powi(power as i32);
    let decimals = if power == 0 { 0 } else { 1 };
    format!("{value:.decimals$} {}", units[power as usize])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_are_shown_in_the_unit_that_suits() {
        assert_eq!(sized(999), "999 B");
        assert_eq!(sized(1_500_000), "1.5 MB");
    }

    #[test]
    fn processor_time_passes_with_work() {
        let Some(before) = cpu_seconds() else {
            eprintln!("skipped: this system has no /proc/self/stat");
            return;
        };
        let start = std::time::Instant::now();
        while cpu_seconds().unwrap() < before + 0.02 {
            assert!(start.elapsed().as_secs() < 60, "no processor time in a minute of work");
        }
    }

    #[test]
    fn the_peak_grows_with_what_is_touched() {
        let Some(before) = peak_bytes() else {
            eprintln!("skipped: this system has no /proc/self/status");
            return;
        };
        let block = std::hint::black_box(vec![1u8; 1 << 28]);
        let after = peak_bytes().unwrap();
        assert!(after >= before && after >= block.len() as u64, "{before} {after}");
    }
}
