//! The worker: reads one request from stdin, runs TetGen, writes one answer to stdout.

use std::io::{Read, Write};
use std::process::ExitCode;
use tetgen_ffi::wire;

#[cfg(tetgen)]
mod ffi;
#[cfg(not(tetgen))]
mod ffi {
    //! Replacement for a build without TetGen.

    use tetgen_ffi::{TetgenMesh, wire};

    /// Whether TetGen is built in.
    pub const AVAILABLE: bool = false;

    /// Returns the status of a worker without TetGen.
    pub fn run(_switches: Vec<u8>, _coordinates: &[f64], _vertices: &[i32]) -> Result<TetgenMesh, i32> {
        println!("the worker was built without tetgen.h (Debian: libtet1.5-dev)");
        Err(wire::NO_TETGEN)
    }
}

fn main() -> ExitCode {
    if std::env::args().nth(1).as_deref() == Some("--available") {
        return if ffi::AVAILABLE { ExitCode::SUCCESS } else { ExitCode::FAILURE };
    }
    let mut request = Vec::new();
    if let Err(error) = std::io::stdin().read_to_end(&mut request) {
        eprintln!("cannot read the request: {error}");
        return ExitCode::FAILURE;
    }
    let Some((switches, coordinates, vertices)) = wire::read_request(&request) else {
        eprintln!("{} bytes are no request", request.len());
        return ExitCode::FAILURE;
    };
    let result = ffi::run(switches, &coordinates, &vertices);
    match std::io::stdout().write_all(&wire::answer(&result)) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("cannot write the answer: {error}");
            ExitCode::FAILURE
        }
    }
}
