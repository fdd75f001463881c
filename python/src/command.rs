//! The command `tetmill`, and the threads of this process.

use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use std::ffi::OsString;
use std::sync::OnceLock;
use tetmill::comm::thread;

/// The process that started the threads.
static STARTED: OnceLock<u32> = OnceLock::new();

/// Runs the command line and returns its exit status.
#[pyfunction]
pub fn run_command(py: Python<'_>, arguments: Vec<OsString>) -> u8 {
    py.detach(|| tetmill_cli::status(arguments))
}

/// Starts the threads that all runs of this process share.
#[pyfunction]
pub fn set_threads(threads: usize) -> PyResult<()> {
    if STARTED.get().is_some() {
        return Err(PyRuntimeError::new_err(
            "the threads are running: call set_threads before anything is read or meshed",
        ));
    }
    start(threads)
}

/// Starts the threads, unless they are running: with stacks large enough for many parts.
///
/// # Errors
/// In a process that was forked after the threads were started: it has none, and would wait
/// forever.
pub fn ready() -> PyResult<()> {
    match STARTED.get() {
        None => start(0),
        Some(process) if *process == std::process::id() => Ok(()),
        Some(_) => Err(PyRuntimeError::new_err(
            "this process was forked after tetmill had started its threads, and has none: start it by \
             multiprocessing's method \"spawn\" or \"forkserver\"",
        )),
    }
}

fn start(threads: usize) -> PyResult<()> {
    STARTED.get_or_init(std::process::id);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).stack_size(thread::POOL_STACK);
    pool.build_global()
        .map_err(|error| PyRuntimeError::new_err(format!("cannot start {threads} threads: {error}")))
}
