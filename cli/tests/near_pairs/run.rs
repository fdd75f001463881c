//! Runs the program on one pair.

use super::pair::Pair;
use crate::limited;
use std::path::Path;
use std::time::Duration;

/// Result of a pair.
#[derive(Debug)]
pub enum Outcome {
    /// A mesh of the right volume.
    Meshed {
        tets: u64,
        smallest: f64,
        /// Whether a message says that the gap decides the number of tets, or is closed.
        told: bool,
    },
    /// Refused with status 2, or given up with status 3, with the reason.
    Refused { status: i32, reason: String },
    /// A crash, a hang, or a wrong mesh.
    Failed(String),
}

/// Time limit for each pair.
const PATIENCE: Duration = Duration::from_secs(60);

/// Largest error of the volume: chords of coarse meshes of a ball.
const VOLUME_ERROR: f64 = 0.15;

/// Meshes the pair of a seed in a folder and checks the volume.
pub fn run(seed: u64, dir: &Path) -> (Pair, f64, Outcome) {
    let pair = Pair::new(seed);
    let [geo, report, mesh, log] = ["geo", "json", "mesh", "log"].map(|e| dir.join(format!("{seed}.{e}")));
    std::fs::write(&geo, &pair.text).expect("the folder can be written to");
    let arguments = |command: &mut std::process::Command| {
        command.arg("mesh").arg(&geo).arg("-o").arg(&mesh).args(["-t", "1", "--report"]).arg(&report);
    };
    let ended = limited::run(arguments, &log, PATIENCE);
    let outcome = match ended.status {
        Some(0) => {
            let text = std::fs::read(&report).expect("the report was written");
            let report: serde_json::Value = serde_json::from_slice(&text).expect("the report is JSON");
            let number = |key: &str| report["mesh"][key].as_f64().expect("a number");
            let volume = number("volume");
            if (volume - pair.volume).abs() > VOLUME_ERROR * pair.volume.max(1.0) {
                Outcome::Failed(format!("volume {volume} instead of {}", pair.volume))
            } else {
                let told = ended.messages.contains("decides the number of tets")
                    || ended.messages.contains("both are taken as one");
                Outcome::Meshed { tets: number("tets") as u64, smallest: number("smallest_dihedral"), told }
            }
        }
        Some(status @ (2 | 3)) => Outcome::Refused { status, reason: ended.reason() },
        other => Outcome::Failed(format!("status {other:?}: {}", ended.reason())),
    };
    (pair, ended.seconds, outcome)
}
