//! Shared by the tests: the program, the independent checker, folders.

#[path = "../../tests/folders.rs"]
mod folders;

pub use folders::{geometries_in, own, own_geometries, shared};

use std::path::Path;
use std::process::{Command, Output};

/// Own geometries that tests mesh in parts.
pub const OWN_IN_PARTS: [&str; 10] =
    ["nozzle", "fibres", "tee", "boss_fillet", "ice_cream", "gear", "probe_tank", "layers", "vase", "dome"];

/// The program built with these tests.
pub fn tetmill() -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_tetmill"));
    // Two threads, because tests run in parallel.
    command.env("RAYON_NUM_THREADS", "2");
    command
}

/// Runs a command; panics with its output if it fails.
pub fn succeed(command: &mut Command) -> Output {
    let output = command.output().expect("the program starts");
    assert!(
        output.status.success(),
        "{command:?} ended with {}\n{}{}",
        output.status,
        String::from_utf8_lossy(&output.stdout),
        String::from_utf8_lossy(&output.stderr)
    );
    output
}

/// Runs a Python program in a folder; prints a message and returns false if a module is missing.
pub fn python(modules: &[&str], program: &str, folder: &Path) -> bool {
    for module in modules {
        let found = Command::new("python3").args(["-c", &format!("import {module}")]).output();
        if !found.is_ok_and(|output| output.status.success()) {
            eprintln!("SKIPPED: there is no Python module {module}");
            return false;
        }
    }
    succeed(Command::new("python3").args(["-c", program]).current_dir(folder));
    true
}

/// Checks a written partition by the independent checker, if it is installed, and by `tetmill
/// check`.
pub fn judge(dir: &Path, parts: u32) {
    succeed(tetmill().arg("check").arg(dir));
    if let Some(checker) = shared("tools/check_partition.py") {
        succeed(
            Command::new("python3").arg(checker).arg(dir.join(format!("partitioning.{parts}"))).arg("--json"),
        );
    }
}

/// The report of `generate` with in-process ranks and `-f none`.
pub fn report_of(geometry: &Path, arguments: &[&str]) -> serde_json::Value {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let file = dir.path().join("report.json");
    let mut command = tetmill();
    command.arg("generate").arg(geometry).args(["-f", "none", "-q", "--report"]).arg(&file).args(arguments);
    succeed(&mut command);
    read_json(&file)
}

/// Reads a JSON file.
pub fn read_json(file: &Path) -> serde_json::Value {
    serde_json::from_slice(&std::fs::read(file).expect("the report is there")).expect("JSON")
}

/// The report of a mesh made at `coarse` by a method, which passes both checkers.
pub fn judged_report(method: &str, name: &str, ranks: u32, more: &[&str]) -> serde_json::Value {
    let dir = tempfile::tempdir().unwrap();
    let (out, report) = (dir.path().join("out"), dir.path().join("report.json"));
    let mut command = tetmill();
    command.arg("generate").arg(own(name)).args(["-m", method, "-q", "--preset", "coarse"]);
    command.args(["-n", &ranks.to_string(), "-o"]).arg(&out).arg("--report").arg(&report).args(more);
    succeed(&mut command);
    judge(&out, ranks);
    read_json(&report)
}
