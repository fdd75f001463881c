//! Runs the program on one scene.

use super::judge::{Mesh, probe, sure_body};
use super::scene::{Scene, Style};
use crate::limited;
use std::path::Path;
use std::process::Command;
use std::time::Duration;

/// Result of a scene.
#[derive(Debug)]
pub enum Outcome {
    /// A mesh that agrees with the scene.
    Meshed { tets: usize },
    /// Refused as empty, and no probe is inside.
    Empty,
    /// Refused, with the first line of the reason.
    Refused(String),
    /// A crash, a hang, a missing mesh without a message, or a wrong mesh.
    Failed(String),
}

/// Time limit: ten times more than any scene takes.
const PATIENCE: Duration = Duration::from_secs(120);

/// Meshes the scene of a seed in a folder and checks the mesh.
pub fn run(seed: u64, style: Style, dir: &Path) -> Outcome {
    let scene = Scene::new(seed, style);
    let [geo, mesh, log, report] =
        ["geo", "mesh", "log", "json"].map(|e| dir.join(format!("{style:?}-{seed}.{e}")));
    std::fs::write(&geo, &scene.text).expect("the folder can be written to");
    let arguments = |command: &mut Command| {
        command.arg("mesh").arg(&geo).arg("-o").arg(&mesh).args(["-q", "-t", "1"]);
        command.arg("--report").arg(&report);
    };
    let ended = limited::run(arguments, &log, PATIENCE);
    let reason = ended.reason();
    match ended.status {
        Some(0) => {
            let made = Mesh::read(&mesh, &report);
            made.fault(&scene).map_or(Outcome::Meshed { tets: made.tets.len() }, Outcome::Failed)
        }
        Some(2) if ended.messages.contains("contains nothing") && is_empty(&scene) => Outcome::Empty,
        Some(2) => Outcome::Refused(reason),
        Some(other) => Outcome::Failed(format!("status {other}: {reason}")),
        None => Outcome::Failed(format!("a crash, or no end in {:.0} s: {reason}", ended.seconds)),
    }
}

/// Whether no probe is clearly inside the first body.
fn is_empty(scene: &Scene) -> bool {
    (1..=20_000).all(|i| sure_body(scene, probe(i)) != Some(1))
}
