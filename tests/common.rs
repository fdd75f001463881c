//! What the tests share: folders, the program, the independent checker.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// The program that was built with these tests.
pub fn tetmill() -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_tetmill"));
    // Tests run beside each other: two threads each are enough.
    command.env("RAYON_NUM_THREADS", "2");
    command
}

/// Our own geometries, by name.
pub fn own_geometries() -> Vec<PathBuf> {
    geometries_in(&Path::new(env!("CARGO_MANIFEST_DIR")).join("geometries"))
}

/// One of our own geometries.
pub fn own(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("geometries").join(name).with_extension("geo")
}

/// All `.geo` files of a folder, by name.
pub fn geometries_in(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).expect("the folder can be read");
    let mut files: Vec<PathBuf> = entries
        .map(|entry| entry.expect("the folder can be read").path())
        .filter(|path| path.extension().is_some_and(|e| e == "geo"))
        .collect();
    files.sort();
    files
}

/// The folder with NETGEN's tutorials and the independent checker, which is no part of the project: beside
/// it, or where `TETMILL_SHARED` says. Without it the test that asks is skipped, aloud.
pub fn shared(what: &str) -> Option<PathBuf> {
    let beside = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared");
    let folder = std::env::var_os("TETMILL_SHARED").map_or(beside, PathBuf::from);
    let wanted = folder.join(what);
    if wanted.exists() {
        return Some(wanted);
    }
    eprintln!("SKIPPED: there is no {}", wanted.display());
    None
}

/// Runs a command and expects success; says what it said otherwise.
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

/// Judges a written partition by the independent checker, where there is one, and by `tetmill check`.
pub fn judge(dir: &Path, parts: u32) {
    succeed(tetmill().arg("check").arg(dir));
    if let Some(checker) = shared("tools/check_partition.py") {
        succeed(
            Command::new("python3").arg(checker).arg(dir.join(format!("partitioning.{parts}"))).arg("--json"),
        );
    }
}

/// The report of a run of `generate` on in-process ranks that writes nothing else.
pub fn report_of(geometry: &Path, arguments: &[&str]) -> serde_json::Value {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let file = dir.path().join("report.json");
    let mut command = tetmill();
    command.arg("generate").arg(geometry).args(["-f", "none", "-q", "--report"]).arg(&file).args(arguments);
    succeed(&mut command);
    read_json(&file)
}

/// A JSON file.
pub fn read_json(file: &Path) -> serde_json::Value {
    serde_json::from_slice(&std::fs::read(file).expect("the report is there")).expect("JSON")
}

/// Made by a method on so many ranks, at `coarse`, and judged by both checkers: the report.
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
