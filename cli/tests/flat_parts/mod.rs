//! STL files of flat and needle-like parts: the project's geometries, stretched, rotated, scaled
//! and rounded as STL writers round.

use crate::limited;
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Duration;
use tetmill::internals::Random;

/// How a part was made, for messages.
#[derive(Clone, Debug)]
#[allow(dead_code, reason = "printed only")]
pub struct Part {
    pub geometry: String,
    /// The factor along one axis.
    pub stretch: f64,
    /// The factor along all axes.
    pub scale: f64,
    /// Significant digits of the coordinates.
    pub digits: usize,
    /// Whether the triangles are kept.
    pub keep: bool,
}

/// Result of a part.
#[derive(Debug)]
pub enum Outcome {
    Meshed {
        tets: u64,
        smallest: f64,
    },
    /// Refused with status 2, with the first line of the reason.
    Refused(String),
    Failed(String),
}

/// Time limit for each run of the program.
const PATIENCE: Duration = Duration::from_secs(60);

type Triangle = [[f64; 3]; 3];

/// Makes the part of a seed in a folder and meshes it. The volume of a single
/// body must be that of the triangles if they are kept.
pub fn run(seed: u64, geometries: &[PathBuf], dir: &Path) -> (Part, f64, Outcome) {
    let mut random = Random::new(seed);
    let geometry = &geometries[(random.unit() * geometries.len() as f64) as usize];
    let part = Part {
        geometry: geometry.file_stem().unwrap_or_default().to_string_lossy().into(),
        stretch: 10_f64.powf(4.0 * random.unit() - 3.0),
        scale: 10_f64.powf(12.0 * random.unit() - 6.0),
        digits: 4 + (random.unit() * 4.0) as usize,
        keep: seed.is_multiple_of(2),
    };
    let [off, stl, report, mesh] = ["off", "stl", "json", "mesh"].map(|e| dir.join(format!("{seed}.{e}")));
    let log = dir.join(format!("{seed}.log"));
    let surface = |command: &mut Command| {
        command.arg("mesh").arg(geometry).arg("-o").arg(&off).args([
            "-q",
            "-t",
            "1",
            "--preset",
            "very-coarse",
        ]);
    };
    let ended = limited::run(surface, &log, PATIENCE);
    if ended.status != Some(0) {
        let reason = format!("the geometry: {:?} {}", ended.status, ended.reason());
        return (part, 0.0, Outcome::Failed(reason));
    }
    let mut triangles = read_off(&std::fs::read_to_string(&off).expect("the surface was written"));
    transform(&mut triangles, &part, &mut random);
    let text = to_stl(&triangles, part.digits);
    std::fs::write(&stl, &text).expect("the folder can be written to");

    let arguments = |command: &mut Command| {
        command.arg("mesh").arg(&stl).arg("-o").arg(&mesh).args(["-q", "-t", "1", "--report"]).arg(&report);
        command.args(part.keep.then_some("--keep-surface"));
    };
    let ended = limited::run(arguments, &log, PATIENCE);
    let outcome = match ended.status {
        Some(0) => {
            let text = std::fs::read(&report).expect("the report was written");
            let report: serde_json::Value = serde_json::from_slice(&text).expect("the report is JSON");
            let number = |key: &str| report["mesh"][key].as_f64().expect("a number");
            let (volume, wanted) = (number("volume"), volume(&read_stl(&text_of(&stl))));
            if part.keep && report["entities"]["bodies"] == 1 && (volume - wanted).abs() > 1e-6 * wanted {
                Outcome::Failed(format!("volume {volume} instead of {wanted}"))
            } else {
                Outcome::Meshed { tets: number("tets") as u64, smallest: number("smallest_dihedral") }
            }
        }
        Some(2) => Outcome::Refused(ended.reason()),
        other => Outcome::Failed(format!("status {other:?}: {}", ended.reason())),
    };
    (part, ended.seconds, outcome)
}

fn text_of(path: &Path) -> String {
    std::fs::read_to_string(path).expect("the file was written")
}

/// Reads triangles of an OFF file as the program writes it, with a colour behind each.
fn read_off(text: &str) -> Vec<Triangle> {
    let mut lines = text.lines().skip(1);
    let mut numbers = || -> Vec<f64> {
        let line = lines.next().expect("a complete file");
        line.split_whitespace().map(|word| word.parse().expect("a number")).collect()
    };
    let counts = numbers();
    let points: Vec<[f64; 3]> = (0..counts[0] as usize)
        .map(|_| {
            let point = numbers();
            [point[0], point[1], point[2]]
        })
        .collect();
    let mut triangle = |_| {
        let face = numbers();
        [1, 2, 3].map(|k| points[face[k] as usize])
    };
    (0..counts[1] as usize).map(&mut triangle).collect()
}

/// Stretches along one axis, rotates by a random orthonormal frame, and scales.
fn transform(triangles: &mut [Triangle], part: &Part, random: &mut Random) {
    let axis = (random.unit() * 3.0) as usize;
    // Uniform unit quaternions (Shoemake 1992).
    let [u, v, w] = [(); 3].map(|()| random.unit());
    let [v, w] = [v, w].map(|x| x * std::f64::consts::TAU);
    let (p, q) = ((1.0 - u).sqrt(), u.sqrt());
    let [x, y, z, r] = [p * v.sin(), p * v.cos(), q * w.sin(), q * w.cos()];
    let rows = [
        [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - z * r), 2.0 * (x * z + y * r)],
        [2.0 * (x * y + z * r), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - x * r)],
        [2.0 * (x * z - y * r), 2.0 * (y * z + x * r), 1.0 - 2.0 * (x * x + y * y)],
    ];
    for point in triangles.iter_mut().flatten() {
        point[axis] *= part.stretch;
        *point = rows.map(|row| part.scale * (0..3).map(|k| row[k] * point[k]).sum::<f64>());
    }
}

fn to_stl(triangles: &[Triangle], digits: usize) -> String {
    let mut text = String::from("solid part\n");
    for triangle in triangles {
        text += "facet normal 0 0 0\nouter loop\n";
        for [x, y, z] in triangle {
            let after = digits - 1;
            writeln!(text, "vertex {x:.after$e} {y:.after$e} {z:.after$e}").expect("text can be written");
        }
        text += "endloop\nendfacet\n";
    }
    text + "endsolid part\n"
}

fn read_stl(text: &str) -> Vec<Triangle> {
    let number = |word: &str| word.parse::<f64>().expect("a number");
    let points: Vec<[f64; 3]> = text
        .lines()
        .filter_map(|line| line.strip_prefix("vertex "))
        .map(|line| {
            let mut words = line.split(' ').map(number);
            [(); 3].map(|()| words.next().expect("three numbers"))
        })
        .collect();
    points.chunks_exact(3).map(|c| [c[0], c[1], c[2]]).collect()
}

/// The volume inside closed triangles.
fn volume(triangles: &[Triangle]) -> f64 {
    let origin = triangles[0][0];
    let spanned = |t: &Triangle| {
        let [a, b, c] = t.map(|p| [0, 1, 2].map(|k| p[k] - origin[k]));
        (a[0] * (b[1] * c[2] - b[2] * c[1])
            + a[1] * (b[2] * c[0] - b[0] * c[2])
            + a[2] * (b[0] * c[1] - b[1] * c[0]))
            / 6.0
    };
    triangles.iter().map(spanned).sum::<f64>().abs()
}
