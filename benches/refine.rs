//! Refinement, streamed check, checksum and storage: tets per second and peak memory.
//!
//! `cargo bench --bench refine [-- CASE COARSE N]`: CASE is `cube`, `ball` or `cylinder`, COARSE
//! the subdivisions of an edge in a first refinement that makes the coarse mesh. Threads are set by
//! `RAYON_NUM_THREADS`. Rates are by processor time.
//!
//! The memory bandwidth is measured first by the triad a = b + s·c of STREAM (McCalpin 1995), with
//! all threads on arrays far larger than the caches. The last column is the share of it that a
//! stage uses by wall time. Only necessary traffic counts: coordinates written or read once, and
//! tets written once if they are stored.
#![forbid(unsafe_code)]
#![allow(missing_docs)]

use std::time::Instant;
use tetmill::internals::refine;
use tetmill::mesh::{MeshStream, TetBlock};
use tetmill::{Point, check, memory};

/// The imports of the fixtures, which are the library's own.
mod ground {
    pub mod mesh {
        pub use tetmill::mesh::*;
        pub mod stream {
            pub use tetmill::mesh::{BoundaryBlock, MeshStream, TetBlock};
        }
    }
    pub mod projector {
        pub use tetmill::internals::Projector;
    }
}
mod parallel {
    pub mod distribution {
        pub use tetmill::internals::distribution::{DistMesh, from_serial};
    }
    pub mod refine {
        pub use tetmill::mesh::RefinedMesh;
    }
}

#[path = "../src/parallel/refine/fixtures.rs"]
#[allow(dead_code)]
mod fixtures;

mod common;

use common::living_cpu_seconds;
use fixtures::Fixture;
use rayon::prelude::*;

/// Above this number stored tets, of 16 bytes each, are not measured.
const MOST_STORED: u64 = 200_000_000;

fn main() {
    let args: Vec<String> = std::env::args().skip(1).filter(|a| a != "--bench").collect();
    println!("{} threads, version {}", rayon::current_num_threads(), env!("CARGO_PKG_VERSION"));
    let bandwidth = triad();
    println!("memory bandwidth by the triad: {:.1} GB/s", bandwidth / 1e9);
    println!(
        "| case | coarse tets | n | tets | stage | wall s | cpu s | M tets/cpu s | peak MB | bytes/tet | % of bandwidth |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|---|");
    match &args[..] {
        [case, coarse, n] => {
            run(case, coarse.parse().expect("a number"), n.parse().expect("a number"), bandwidth);
        }
        _ => [("cube", 4, 16), ("ball", 4, 16), ("cylinder", 2, 16)]
            .iter()
            .for_each(|&(c, k, n)| run(c, k, n, bandwidth)),
    }
}

/// Best rate of the triad, bytes per second.
fn triad() -> f64 {
    const LENGTH: usize = 1 << 25;
    const REPEATS: usize = 7;
    let (b, c) = (vec![1.0_f64; LENGTH], vec![2.0_f64; LENGTH]);
    let mut a = vec![0.0_f64; LENGTH];
    let mut best = f64::INFINITY;
    for _ in 0..REPEATS {
        let start = Instant::now();
        a.par_chunks_mut(1 << 16)
            .zip(b.par_chunks(1 << 16))
            .zip(c.par_chunks(1 << 16))
            .for_each(|((a, b), c)| a.iter_mut().zip(b).zip(c).for_each(|((a, b), c)| *a = b + 3.0 * c));
        best = best.min(start.elapsed().as_secs_f64());
    }
    assert!(std::hint::black_box(&a).iter().all(|x| *x == 7.0));
    (3 * LENGTH * size_of::<f64>()) as f64 / best
}

fn fixture(case: &str, coarse: u32) -> Fixture {
    let base = match case {
        "cube" => return fixtures::cube(coarse as usize * 2, false),
        "ball" => fixtures::ball(1.0),
        _ => fixtures::cylinder(4),
    };
    let settings = refine::Settings::default();
    let first = refine::refine(fixtures::whole(&base.mesh), &base.projector, coarse, &settings);
    Fixture { mesh: fixtures::as_mesh(&first.expect("refinable")), projector: base.projector }
}

fn run(case: &str, coarse: u32, n: u32, bandwidth: f64) {
    forget_peak();
    let fixture = fixture(case, coarse);
    let dist = fixtures::whole(&fixture.mesh);
    let coarse_tets = dist.tets.len();
    let tets = coarse_tets as u64 * u64::from(n).pow(3);
    let row = |stage: &str, start: Start, bytes: u64| {
        let (wall, cpu) = (start.wall.elapsed().as_secs_f64(), living_cpu_seconds() - start.cpu);
        let peak = peak_bytes();
        println!(
            "| {case} | {coarse_tets} | {n} | {tets} | {stage} | {wall:.2} | {cpu:.2} | {:.1} | {:.0} | {:.1} | {:.0} |",
            tets as f64 / cpu / 1e6,
            peak as f64 / 1e6,
            peak as f64 / tets as f64,
            100.0 * bytes as f64 / wall / bandwidth
        );
    };
    let start = Start::now();
    let refined =
        refine::refine(dist, &fixture.projector, n, &refine::Settings::default()).expect("refinable");
    let points = size_of_val(refined.points()) as u64;
    row("coordinates, diagonals, exact signs", start, refined.bytes());

    let start = Start::now();
    let volume = volume(&refined);
    row("connectivity streamed, volume summed", start, points);

    let start = Start::now();
    let settings = check::Settings { shapes: false, ..check::Settings::default() };
    let report = check::check_part(&refined, Some(&fixture.projector), &settings);
    assert!(report.faults == 0 && (report.volume / volume - 1.0).abs() < 1e-12, "{:?}", report.described);
    row("check without shapes", start, points);

    let start = Start::now();
    let report = check::check_part(&refined, Some(&fixture.projector), &check::Settings::default());
    row("check with shapes", start, points);

    let start = Start::now();
    let sum = check::checksum(&refined);
    assert_eq!(sum.open, 0);
    row("checksum", start, points);

    let start = Start::now();
    if tets <= MOST_STORED && refined.materialize().is_ok() {
        row("tets stored", start, 16 * tets);
    }
    let shape = report.shape.expect("tets");
    println!(
        "{case}: checksum {sum}, volume {}, mean ratio worst {:.3} mean {:.3}, dihedral {:.1} (p1 {:.1}) to {:.1}",
        report.volume,
        shape.worst_ratio.value,
        shape.sum_of_ratios / report.tets as f64,
        shape.smallest_angle.value,
        shape.smallest_angle_percentile(0.01),
        shape.largest_angle.value
    );
}

/// The simplest consumer: the cost of a solver's loop over elements.
fn volume(mesh: &dyn MeshStream) -> f64 {
    let points = mesh.points();
    let of_block = |block: &mut TetBlock, index| {
        mesh.tet_block(index, block);
        let six_fold: f64 = block.tets.iter().map(|tet| volume6(tet.map(|v| points[v as usize]))).sum();
        six_fold / 6.0
    };
    (0..mesh.tet_blocks()).into_par_iter().map_init(TetBlock::default, of_block).sum()
}

fn volume6(corners: [[f64; 3]; 4]) -> f64 {
    let [p, q, r, s] = corners.map(Point::from);
    (q - p).cross(&(r - p)).dot(&(s - p))
}

/// Wall and processor time at the start of a stage. On a shared machine only the latter is
/// meaningful.
struct Start {
    wall: Instant,
    cpu: f64,
}

impl Start {
    fn now() -> Self {
        Self { wall: Instant::now(), cpu: living_cpu_seconds() }
    }
}

/// Resets the peak memory if the system supports it, or else it includes the triad and previous
/// cases.
fn forget_peak() {
    let _ = std::fs::write("/proc/self/clear_refs", "5");
}

/// Peak resident memory of the process; 0 if the system does not report it.
fn peak_bytes() -> u64 {
    memory::peak_bytes().unwrap_or(0)
}
