//! Volume meshing and improvement: seconds, angles and memory.
//!
//! The surfaces are PLY files in `$TETMILL_SHARED/surfaces`, or `../shared/surfaces` beside the
//! repository; without them the benchmark is skipped with a message. Each case runs in its own
//! process, which gives its peak memory.
//!
//! ```sh
//! cargo bench --bench volume                        # all cases
//! cargo bench --bench volume -- cube 1M             # only rows that contain one of the words
//! cargo bench --bench volume -- one cube_100k size=1.3 threads=2 target=0.7 passes=3
//! ```

mod common;

use common::cpu_seconds;
use csg::{BodyId, PatchId};
use std::path::PathBuf;
use std::process::Command;
use std::time::Instant;
use tetmill::Point;
use tetmill::internals::improve::{Effort, Measure, improve};
use tetmill::internals::volume::{ClosedSurface, VolumeMesh};
use tetmill::internals::{UniformSize, improve, volume};
use tetmill::mesh::{BoundaryTriangle, Class, Mesh, QualitySummary, VertexId};

/// One run: a surface, its size in units of the mean edge, and the settings of the improvement.
struct Case {
    surface: String,
    size: f64,
    threads: usize,
    /// Settings of the improvement; `None` for no improvement.
    settings: Option<improve::Settings>,
}

fn main() {
    let words: Vec<String> = std::env::args().skip(1).filter(|w| w != "--bench").collect();
    let Some(folder) = surfaces() else {
        println!("skipped: no surfaces in $TETMILL_SHARED or ../shared");
        return;
    };
    if words.first().is_some_and(|w| w == "one") {
        let case = Case::parse(&words[1..]);
        println!("{}", case.run(&folder));
        return;
    }
    println!("{}", header());
    for line in all_cases() {
        if words.is_empty() || words.iter().any(|w| line.contains(w.as_str())) {
            run_apart(&line);
        }
    }
}

/// The cases, each as the arguments of its run.
fn all_cases() -> Vec<String> {
    let mut cases = Vec::new();
    let mut add = |case: String| cases.push(case);
    for surface in ["cube_100k", "shaft_100k", "torus_100k", "cube_1M", "shaft_1M", "torus_1M"] {
        // The first size gives about as many tets as other programs make.
        for case in ["size=1.3 threads=1", "size=1.3 threads=2", "size=1 threads=1"] {
            add(format!("{surface} {case}"));
        }
    }
    for surface in ["cube_100k", "shaft_100k", "torus_100k", "cube_1M", "shaft_1M", "torus_1M"] {
        for budget in BUDGETS {
            add(format!("{surface} size=1.3 threads=1 {budget}"));
        }
    }
    for size in ["2", "1.3", "0.8", "0.6", "0.5"] {
        add(format!("cube_1M size={size} threads=1"));
    }
    cases
}

/// From no improvement to much: the trade-off of angles and seconds.
const BUDGETS: [&str; 8] = [
    "none",
    "target=0.4 passes=1",
    "target=0.5 passes=1",
    "target=0.6 passes=1",
    "target=0.65 passes=1",
    "target=0.72 passes=3",
    "target=0.78 passes=8",
    "target=0.8 passes=8",
];

fn header() -> String {
    format!(
        "{:<10} {:>5} {:>7}  {:<22} {:>9} {:>8} {:>9} {:>7} {:>7} {:>9} {:>9}  {:>7} {:>5} {:>6} {:>6} {:>7} {:>6}",
        "surface",
        "size",
        "threads",
        "budget",
        "tets",
        "volume s",
        "improve s",
        "s",
        "cpu s",
        "tets/s",
        "/cpu s",
        "min dih",
        "p1",
        "median",
        "ratio",
        "peak MB",
        "B/tet"
    )
}

/// Runs a case in its own process, which prints its row.
fn run_apart(line: &str) {
    let program = std::env::current_exe().expect("this program has a path");
    let threads = line.split(' ').find_map(|w| w.strip_prefix("threads=")).unwrap_or("1");
    let mut command = Command::new(program);
    command.arg("one").args(line.split(' ')).env("RAYON_NUM_THREADS", threads);
    match command.status() {
        Ok(status) if status.success() => {}
        Ok(status) => println!("{line}: {status}"),
        Err(error) => println!("{line}: {error}"),
    }
}

impl Case {
    fn parse(words: &[String]) -> Self {
        let defaults = improve::Settings::of(Effort::Standard, Measure::MeanRatio);
        let mut case = Self { surface: words[0].clone(), size: 1.0, threads: 1, settings: Some(defaults) };
        for word in &words[1..] {
            let (key, value) = word.split_once('=').unwrap_or((word, ""));
            let number = || value.parse::<f64>().unwrap_or_else(|_| panic!("{word}: not a number"));
            match (key, &mut case.settings) {
                ("size", _) => case.size = number(),
                ("threads", _) => case.threads = number() as usize,
                ("none", settings) => *settings = None,
                ("target", Some(s)) => s.target = number(),
                ("change", Some(s)) => s.change_below = number(),
                ("passes", Some(s)) => s.passes = number() as u32,
                ("refined", Some(s)) => *s = improve::Settings::of(Effort::Standard, Measure::Refined),
                ("block", Some(s)) => s.block = number() as usize,
                _ => panic!(
                    "{word}: size=, threads=, none, refined, target=, change=, passes= and block= are known"
                ),
            }
        }
        case
    }

    fn run(&self, folder: &std::path::Path) -> String {
        let (points, triangles) = read_ply(&folder.join(format!("{}.ply", self.surface)));
        let size = UniformSize(self.size * mean_edge(&points, &triangles));
        let regions = vec![[Some(BodyId(0)), None]; triangles.len()];
        let started = Instant::now();
        let surface = ClosedSurface::new(points, triangles.clone(), regions).expect("a closed surface");
        let (filled, _) = volume::mesh(&surface, &size, &volume::Settings::default()).expect("a mesh");
        let meshed = started.elapsed().as_secs_f64();
        let mut mesh = classified(filled, &triangles);
        drop(triangles);
        let improving = Instant::now();
        if let Some(settings) = &self.settings {
            let report = improve(&mut mesh, &size, settings);
            if std::env::var_os("TETMILL_BENCH_COUNTS").is_some() {
                eprintln!("{report:?}");
            }
        }
        let improved = improving.elapsed().as_secs_f64();
        let (cpu, peak) = (cpu_seconds(), peak_megabytes());
        let quality = QualitySummary::of(&mesh);
        let tets = quality.tets as f64;
        let budget = match &self.settings {
            None => "none".into(),
            Some(s) => format!("target {} passes {}", s.target, s.passes),
        };
        format!(
            "{:<10} {:>5} {:>7}  {:<22} {:>9} {:>8.2} {:>9.2} {:>7.2} {:>7.2} {:>9.0} {:>9.0}  {:>7.2} {:>5.1} {:>6.1} {:>6.3} {:>7.0} {:>6.0}",
            self.surface,
            self.size,
            self.threads,
            budget,
            quality.tets,
            meshed,
            improved,
            meshed + improved,
            cpu,
            tets / (meshed + improved),
            tets / cpu.max(f64::MIN_POSITIVE),
            quality.smallest_dihedral,
            quality.first_percentile,
            quality.median,
            quality.average_mean_ratio,
            peak,
            peak * 1e6 / tets,
        )
    }
}

/// One body whose surface is one patch.
fn classified(filled: VolumeMesh, triangles: &[[u32; 3]]) -> Mesh {
    let mut mesh = Mesh {
        classes: vec![Class::Body(BodyId(0)); filled.points.len()],
        points: filled.points,
        tets: filled.tets.into_iter().map(|t| t.map(VertexId)).collect(),
        bodies: filled.bodies,
        ..Mesh::default()
    };
    for triangle in triangles {
        let vertices = triangle.map(VertexId);
        vertices.iter().for_each(|v| mesh.classes[v.index()] = Class::Patch(PatchId(0)));
        mesh.triangles.push(BoundaryTriangle { vertices, patch: PatchId(0) });
    }
    mesh
}

fn surfaces() -> Option<PathBuf> {
    let root = PathBuf::from(env!("CARGO_MANIFEST_DIR"));
    let shared = std::env::var_os("TETMILL_SHARED").map_or_else(|| root.join("../shared"), PathBuf::from);
    let folder = shared.join("surfaces");
    folder.join("cube_100k.ply").exists().then_some(folder)
}

fn mean_edge(points: &[Point], triangles: &[[u32; 3]]) -> f64 {
    let edge = |t: &[u32; 3], k: usize| points[t[k] as usize] - points[t[(k + 1) % 3] as usize];
    let sum: f64 = triangles.iter().flat_map(|t| [0, 1, 2].map(|k| edge(t, k).norm())).sum();
    sum / (3 * triangles.len()) as f64
}

/// Reads a binary little-endian PLY file with f64 coordinates and triangles of 32-bit indices.
fn read_ply(path: &std::path::Path) -> (Vec<Point>, Vec<[u32; 3]>) {
    const END: &[u8] = b"end_header\n";
    let bytes = std::fs::read(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    let body = bytes.windows(END.len()).position(|w| w == END).expect("a PLY header") + END.len();
    let header = String::from_utf8_lossy(&bytes[..body]).into_owned();
    let count = |element: &str| {
        let line = header.lines().find_map(|l| l.strip_prefix(element)).expect("vertices and faces");
        line.trim().parse::<usize>().expect("a count")
    };
    let (vertices, faces) = bytes[body..].split_at(24 * count("element vertex"));
    let number = |b: &[u8], at: usize| f64::from_le_bytes(b[at..at + 8].try_into().expect("8 bytes"));
    let index = |b: &[u8], at: usize| u32::from_le_bytes(b[at..at + 4].try_into().expect("4 bytes"));
    let point = |b: &[u8]| Point::new(number(b, 0), number(b, 8), number(b, 16));
    let faces = faces.chunks_exact(13).take(count("element face"));
    (
        vertices.chunks_exact(24).map(point).collect(),
        faces.map(|b| [index(b, 1), index(b, 5), index(b, 9)]).collect(),
    )
}

/// Peak memory of this process so far; 0 if the system does not report it.
fn peak_megabytes() -> f64 {
    tetmill::memory::peak_bytes().unwrap_or(0) as f64 / 1e6
}
