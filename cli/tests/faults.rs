//! Failed writes, failed allocations and `kill -9`: `benches/faults.py` injects one of each and
//! checks the status, the files, and a second run.

use std::path::Path;
use std::process::Command;

/// Runs the script; prints a message instead on systems that cannot.
fn inject(arguments: &[&str]) {
    if !cfg!(target_os = "linux") || Command::new("python3").arg("--version").output().is_err() {
        eprintln!("SKIPPED: needs Linux and python3");
        return;
    }
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("../benches/faults.py");
    let mut command = Command::new("python3");
    command.arg(script).arg(env!("CARGO_BIN_EXE_tetmill")).arg("--few").args(arguments);
    let output = crate::common::succeed(&mut command);
    let table = String::from_utf8_lossy(&output.stdout);
    assert!(table.contains("0 of 3 faults had another outcome"), "{table}");
}

#[test]
fn faults_of_a_program_with_threads_leave_nothing_half_written() {
    inject(&[]);
}

#[cfg(feature = "mpi")]
#[test]
fn a_fault_of_one_mpi_rank_ends_all_and_leaves_nothing_half_written() {
    if Command::new("mpirun").arg("--version").output().is_err() {
        eprintln!("SKIPPED: there is no mpirun");
        return;
    }
    inject(&["--no-threads", "--mpi", "2"]);
}
