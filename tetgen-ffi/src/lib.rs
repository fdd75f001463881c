//! TetGen for comparison in tests, behind a worker process.
//!
//! TetGen 1.5 ends the process or crashes on some bad inputs, such as intersecting facets.
//! Therefore [`tetrahedralize`] starts one process `tetgen-worker` for each call and communicates
//! with it through pipes. This library is not linked with TetGen.
//!
//! ```text
//! test ──stdin──► tetgen-worker ──FFI──► libtet
//!      ◄─stdout──
//! ```
//! `cargo build -p tetgen-ffi` builds the worker, which is found beside the test programs. If it is
//! missing or was built without TetGen, [`available`] is false, and tests are skipped with a
//! message.
#![forbid(unsafe_code)]

pub mod wire;

use std::io::{Read, Write};
use std::path::PathBuf;
use std::process::{Command, ExitStatus, Stdio};
use std::sync::mpsc;
use std::time::Duration;

/// Time limit of a worker, because TetGen may loop forever on bad input.
const TIME_LIMIT: Duration = Duration::from_secs(300);

/// File name of the worker.
const WORKER: &str = if cfg!(windows) { "tetgen-worker.exe" } else { "tetgen-worker" };

/// A mesh made by TetGen.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TetgenMesh {
    /// Coordinates of the vertices, starting with those of the input in their order.
    pub points: Vec<[f64; 3]>,
    /// The vertices of the tets, with the orientation of tetmill.
    pub tets: Vec<[u32; 4]>,
    /// With the switch `A`, the region of each tet; else empty.
    pub regions: Vec<i32>,
}

/// Reasons for a missing mesh.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The worker is missing or was built without TetGen.
    #[error("TetGen is not available: {0}")]
    NotAvailable(String),
    /// TetGen rejected the input.
    #[error("TetGen rejected the input with code {code}: {printed}")]
    Refused {
        /// The code that it threw (1: memory, 3: facets intersect, ...).
        code: i32,
        /// Its output.
        printed: String,
    },
    /// The worker ended without an answer.
    #[error("TetGen crashed ({status}): {printed}")]
    Crashed {
        /// Its exit status.
        status: ExitStatus,
        /// Its output.
        printed: String,
    },
    /// The worker exceeded the time limit.
    #[error("TetGen took longer than {} s", TIME_LIMIT.as_secs())]
    TimedOut,
    /// The pipes to the worker failed.
    #[error("the pipes to the worker failed: {0}")]
    Io(#[from] std::io::Error),
}

/// Path of the worker: `TETGEN_WORKER`, or beside this program or in the folder above it.
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

/// Whether a worker with TetGen is available.
pub fn available() -> bool {
    let asked = worker().and_then(|worker| Ok(Command::new(worker).arg("--available").output()?));
    asked.is_ok_and(|output| output.status.success())
}

/// Meshes points and triangular facets with TetGen's `switches` (such as `pYq1.4`; `Q` is added).
///
/// # Errors
/// If TetGen rejects the input or crashes, with its output.
pub fn tetrahedralize(points: &[[f64; 3]], facets: &[[u32; 3]], switches: &str) -> Result<TetgenMesh, Error> {
    let mut child = Command::new(worker()?).stdin(Stdio::piped()).stdout(Stdio::piped()).spawn()?;
    let mut to_worker = child.stdin.take().expect("stdin is a pipe");
    let mut from_worker = child.stdout.take().expect("stdout is a pipe");
    let (sender, receiver) = mpsc::channel();
    std::thread::spawn(move || {
        let mut answer = Vec::new();
        // An error means that the other end has closed the pipe and needs no report.
        let _ = sender.send(from_worker.read_to_end(&mut answer).map(|_| answer));
    });
    // A worker without TetGen does not read its input; its answer is more useful than the broken
    // pipe.
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
        Some((printed, Err(wire::NO_TETGEN))) => Err(Error::NotAvailable(printed)),
        Some((printed, Err(code))) => Err(Error::Refused { code, printed }),
        None => Err(Error::Crashed { status, printed: String::from_utf8_lossy(&answer).into_owned() }),
    }
}
