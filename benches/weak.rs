//! Weak scaling of whole runs of the methods `surface` and `decompose`: time of the stages, and
//! messages of rank 0 and of the others, with the same number of tets for each rank.
//!
//! `cargo bench --bench weak [-- GEOMETRY METHOD TETS MOST]`: a geometry file, `surface` or
//! `decompose`, coarse tets of a rank, the largest number of ranks. Ranks are threads that share
//! the cores of this machine, so times are those of a core for a rank.
#![forbid(unsafe_code)]
#![allow(missing_docs)]

mod common;

use common::counting::Counting;
use std::time::Instant;
use tetmill::comm::thread;
use tetmill::progress::{Progress, Silent, StageTime};
use tetmill::run::{CutSettings, GenerateSettings, Wanted, generate};
use tetmill::{Geometry, Method};

/// Subdivisions of each coarse edge.
const PIECES: u32 = 3;

fn main() {
    let pool = rayon::ThreadPoolBuilder::new().stack_size(thread::POOL_STACK);
    pool.build_global().expect("the first pool");
    let args: Vec<String> = std::env::args().skip(1).filter(|a| a != "--bench").collect();
    let default = concat!(env!("CARGO_MANIFEST_DIR"), "/geometries/crankshaft.geo");
    let geometry = args.first().map_or(default, String::as_str);
    let method = match args.get(1).map_or("surface", String::as_str) {
        "surface" => Method::Surface,
        "decompose" => Method::Decompose(CutSettings::default()),
        other => panic!("{other} is neither surface nor decompose"),
    };
    let number = |k: usize, other: u32| args.get(k).map_or(other, |text| text.parse().expect("a number"));
    let (tets, most) = (number(2, 160), number(3, 1024));
    let text = std::fs::read_to_string(geometry).expect("a file");
    let geometry = Geometry::from_text(&text).expect("a geometry");

    println!(
        "| ranks | tets | ms of a core for a rank: | rank 0 sends kB | receives kB | another sends kB, mean and most | receives kB, mean and most |"
    );
    println!("|---|---|---|---|---|---|---|");
    for ranks in std::iter::successors(Some(1), |&ranks| (ranks < most).then_some(4 * ranks)) {
        row(&geometry, &method, u64::from(tets), ranks);
    }
}

/// Runs once and prints times and messages.
fn row(geometry: &Geometry, method: &Method, tets: u64, ranks: u32) {
    let wanted = Wanted::Coarse { tets: tets * u64::from(ranks), pieces: PIECES };
    let settings = GenerateSettings { method: method.clone(), wanted, ..GenerateSettings::default() };
    let start = Instant::now();
    let results = thread::run(ranks, |comm| {
        let counting = Counting::new(comm);
        let progress = Progress::new(&Silent);
        let made = generate(&counting, (comm.rank() == 0).then_some(geometry), &settings, &progress);
        (made.expect("a mesh").check.tets, progress.times(), counting.taken())
    });
    let results = results.expect("no rank fails");
    let (tets, times, first) = &results[0];
    let of_rank = |time: &StageTime| {
        let cores = if time.name == "mesh" { 1.0 } else { rayon::current_num_threads() as f64 };
        format!("{} {:.0}", time.name, 1e3 * time.seconds * cores / f64::from(ranks))
    };
    let stages: Vec<String> = times.iter().map(of_rank).collect();
    let others = |which: usize| {
        let bytes: Vec<f64> = results[1..].iter().map(|(.., taken)| taken[which] as f64 / 1e3).collect();
        let mean = bytes.iter().sum::<f64>() / (bytes.len() as f64).max(1.0);
        format!("{mean:.0} {:.0}", bytes.iter().copied().fold(0.0, f64::max))
    };
    println!(
        "| {ranks} | {tets} | {} (all {:.1} s) | {:.0} | {:.0} | {} | {} |",
        stages.join(", "),
        start.elapsed().as_secs_f64(),
        first[1] as f64 / 1e3,
        first[2] as f64 / 1e3,
        others(1),
        others(2),
    );
}
