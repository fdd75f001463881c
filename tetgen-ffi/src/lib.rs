//! TetGen for comparison in tests, behind a worker process.
//!
//! TetGen 1.5 ends the process, or crashes, on some bad inputs (facets that intersect, for one). So the
//! program `tetgen-worker` of this crate calls it, and [`tetrahedralize`] starts one worker for each call and
//! talks to it through pipes. This library contains no TetGen and is not linked with it.
//!
//! ```text
//! test ──stdin──► tetgen-worker ──FFI──► libtet
//!      ◄─stdout──
//! ```
//! `cargo build -p tetgen-ffi` builds the worker, which is found beside the test programs. Where it is
//! absent, or was built without TetGen, [`available`] is false: tests then skip, and say so.
#![forbid(unsafe_code)]

pub mod wire;

use std::io::{Read, Write};
use std::path::PathBuf;
use std::process::{Command, ExitStatus, Stdio};
use std::sync::mpsc;
use std::time::Duration;

/// A worker that takes longer is stopped: TetGen may loop for ever on bad input.
const TIME_LIMIT: Duration = Duration::from_secs(300);

/// Name of the worker's program.
const WORKER: &str = if cfg!(windows) { "tetgen-worker.exe" } else { "tetgen-worker" };

/// A mesh as TetGen gives it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TetgenMesh {
    /// Coordinates of the vertices: those of the input first, in their order.
    pub points: Vec<[f64; 3]>,
    /// The tets by vertices, positively oriented as tetmill understands it.
    pub tets: Vec<[u32; 4]>,
    /// With the switch `A`, the region of each tet; else empty.
    pub regions: Vec<i32>,
}

/// Why there is no mesh.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// There is no worker, or it was built without TetGen.
    #[error("TetGen is not available: {0}")]
    NotAvailable(String),
    /// TetGen refused the input.
    #[error("TetGen refused the input with code {code}: {said}")]
    Refused {
        /// What it threw (1: memory, 3: facets intersect, ...).
        code: i32,
        /// What it said.
        said: String,
    },
    /// The worker died before it answered.
    #[error("TetGen crashed ({status}): {said}")]
    Crashed {
        /// How it ended.
        status: ExitStatus,
        /// What it said.
        said: String,
    },
    /// The worker was stopped.
    #[error("TetGen took longer than {} s", TIME_LIMIT.as_secs())]
    TimedOut,
    /// The worker could not be talked to.
    #[error("cannot talk to the worker: {0}")]
    Io(#[from] std::io::Error),
}

/// The worker's path: `TETGEN_WORKER`, else beside this program or in the folder above it.
fn worker() -> Result<PathBuf, Error> {
    if let Some(path) = std::env::var_os("TETGEN_WORKER") {
        return Ok(path.into());
    }
    let program = std::env::current_exe()?;
    let beside = program.ancestors().skip(1).take(2).map(|folder| folder.join(WORKER));
    beside.into_iter().find(|path| path.exists()).ok_or_else(|| {
        Error::NotAvailable(format!(
            "no {WORKER} beside {}: run `cargo build -p tetgen-ffi`",
            program.display()
        ))
    })
}

/// Whether there is a worker with TetGen in it.
pub fn available() -> bool {
    let asked = worker().and_then(|worker| Ok(Command::new(worker).arg("--available").output()?));
    asked.is_ok_and(|output| output.status.success())
}

/// Meshes points and triangular facets with TetGen's `switches` (such as `pYq1.4`; `Q` is added).
///
/// # Errors
/// TetGen's refusals and crashes, with what it said.
pub fn tetrahedralize(points: &[[f64; 3]], facets: &[[u32; 3]], switches: &str) -> Result<TetgenMesh, Error> {
    let mut child = Command::new(worker()?).stdin(Stdio::piped()).stdout(Stdio::piped()).spawn()?;
    let mut to_worker = child.stdin.take().expect("stdin is a pipe");
    let mut from_worker = child.stdout.take().expect("stdout is a pipe");
    let (sender, receiver) = mpsc::channel();
    std::thread::spawn(move || {
        let mut answer = Vec::new();
        // The other end may have given up: nobody is left to hear of a fault then.
        let _ = sender.send(from_worker.read_to_end(&mut answer).map(|_| answer));
    });
    // A worker without TetGen does not read its input: its answer says more than the broken pipe.
    let _ = to_worker.write_all(&wire::request(points, facets, switches));
    drop(to_worker);
    let Ok(answer) = receiver.recv_timeout(TIME_LIMIT) else {
        child.kill()?;
        child.wait()?;
        return Err(Error::TimedOut);
    };
    let answer = answer?;
    let status = child.wait()?;
    match wire::read_answer(&answer) {
        Some((_, Ok(mesh))) => Ok(mesh),
        Some((said, Err(wire::NO_TETGEN))) => Err(Error::NotAvailable(said)),
        Some((said, Err(code))) => Err(Error::Refused { code, said }),
        None => Err(Error::Crashed { status, said: String::from_utf8_lossy(&answer).into_owned() }),
    }
}
