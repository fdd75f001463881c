//! Runs the program on one scene.

use super::judge::{Mesh, probe, sure_body};
use super::scene::{Scene, Style};
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

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
    let mut command = Command::new(env!("CARGO_BIN_EXE_tetmill"));
    command.arg("mesh").arg(&geo).arg("-o").arg(&mesh).args(["-q", "-t", "1"]);
    command.arg("--report").arg(&report);
    command.stdout(Stdio::null()).stderr(std::fs::File::create(&log).expect("the folder can be written to"));
    let mut child = command.spawn().expect("the program starts");
    let began = Instant::now();
    let status = loop {
        match child.try_wait().expect("the program can be waited for") {
            Some(status) => break status,
            None if began.elapsed() > PATIENCE => {
                child.kill().expect("the program can be stopped");
                child.wait().expect("the program can be waited for");
                return Outcome::Failed(format!("no end after {PATIENCE:?}"));
            }
            None => std::thread::sleep(Duration::from_millis(3)),
        }
    };
    let stderr = std::fs::read_to_string(&log).expect("the log was written");
    let reason = stderr.lines().next().unwrap_or_default().to_owned();
    match status.code() {
        Some(0) => {
            let made = Mesh::read(&mesh, &report);
            made.fault(&scene).map_or(Outcome::Meshed { tets: made.tets.len() }, Outcome::Failed)
        }
        Some(2) if stderr.contains("contains nothing") && is_empty(&scene) => Outcome::Empty,
        Some(2) => Outcome::Refused(reason),
        other => Outcome::Failed(format!("status {other:?}: {reason}")),
    }
}

/// Whether no probe is clearly inside the first body.
fn is_empty(scene: &Scene) -> bool {
    (1..=20_000).all(|i| sure_body(scene, probe(i)) != Some(1))
}
