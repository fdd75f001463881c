//! Functions shared by the benchmarks.
#![allow(dead_code)]

pub mod counting;

/// Processor seconds of this process so far, including ended threads; 0 if the system does not
/// report it.
pub fn cpu_seconds() -> f64 {
    tetmill::memory::cpu_seconds().unwrap_or(0.0)
}

/// Processor seconds of the living threads, in nanosecond resolution.
pub fn living_cpu_seconds() -> f64 {
    let tasks = std::fs::read_dir("/proc/self/task").into_iter().flatten().flatten();
    let nanoseconds = tasks.filter_map(|task| {
        let text = std::fs::read_to_string(task.path().join("schedstat")).ok()?;
        text.split_whitespace().next()?.parse::<f64>().ok()
    });
    nanoseconds.sum::<f64>() / 1e9
}
