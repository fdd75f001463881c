//! Work, memory and messages of each of many ranks: the tables of the guide
//! (`docs/src/scaling.md`).
//!
//! `cargo bench --bench scaling [-- GEOMETRY COARSE N]`: a geometry file, the number of coarse
//! tets, the subdivisions of an edge.
//!
//! Messages are counted by a wrapped communicator of in-process ranks. Processor times are of parts
//! refined and checked one after the other on one thread each, as if each rank had its own core.
#![forbid(unsafe_code)]
#![allow(missing_docs)]

mod common;

use common::counting::Counting;
use common::living_cpu_seconds;
use std::time::Instant;
use tetmill::check;
use tetmill::comm::thread;
use tetmill::internals::refine::{PredictedCounts, predicted_counts};
use tetmill::internals::{Budget, Model, distribution, mesh_to_target, partition, refine};
use tetmill::mesh::{DistMesh, Mesh, Order};
use tetmill::progress::Work;
use tetmill::run::CoarseSettings;

const RANKS: [u32; 6] = [1, 4, 16, 64, 256, 1024];

fn main() {
    let pool = rayon::ThreadPoolBuilder::new().stack_size(thread::POOL_STACK);
    pool.build_global().expect("the first pool");
    let args: Vec<String> = std::env::args().skip(1).filter(|a| a != "--bench").collect();
    let default = concat!(env!("CARGO_MANIFEST_DIR"), "/geometries/crankshaft.geo").to_string();
    let geometry = args.first().unwrap_or(&default);
    let number = |k: usize, other: u32| args.get(k).map_or(other, |text| text.parse().expect("a number"));
    let (coarse, n) = (number(1, 100_000), number(2, 8));

    let text = std::fs::read(geometry).expect("a file");
    let parsed = tetmill::csg::language::parse_geometry_bytes(&text, geometry, &Default::default())
        .expect("a geometry");
    let model = Model::from_csg(parsed.geometry).expect("features");
    let start = Instant::now();
    let mesh = coarse_mesh(&model, coarse.into());
    let tets = mesh.tets.len();
    println!(
        "{geometry}: {tets} coarse tets in {:.2} s, {n} pieces an edge: {} tets",
        start.elapsed().as_secs_f64(),
        tets as u64 * u64::from(n).pow(3)
    );

    println!(
        "\n| ranks | partition s | cut faces | imbalance | distribute s | rank 0 sends MB | largest piece kB | refine s, mean and most | M tets/s a core | check s, mean and most | each sends B | each gets kB |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|---|---|");
    let counted: Vec<(u32, Vec<DistMesh>)> = RANKS
        .into_iter()
        .filter(|&ranks| tets >= ranks as usize)
        .map(|ranks| (ranks, row(&model, &mesh, ranks, n)))
        .collect();

    for wanted in [tets as u64 * u64::from(n).pow(3), 100_000_000_000, 1_000_000_000_000] {
        let n = refine::pieces_for(tets as u64, wanted);
        println!("\n{n} pieces an edge, {:.3e} tets:\n", tets as f64 * f64::from(n).powi(3));
        println!(
            "| ranks | tets of a rank, mean and most | GB of coordinates, most | GB of those on boundaries and interfaces | shared %, mean and most | owned share, most over mean | neighbours, mean and most |"
        );
        println!("|---|---|---|---|---|---|---|");
        counted.iter().for_each(|(ranks, parts)| predicted_row(*ranks, parts, n));
    }
}

fn coarse_mesh(model: &Model, tets: u64) -> Mesh {
    let mut settings = CoarseSettings::default();
    let fits = |made| made >= tets && made <= tets + tets / 2;
    let (made, _) = mesh_to_target(model, &mut settings, tets, &fits, &Budget::default(), Work::unwatched())
        .expect("a mesh");
    made.mesh
}

/// Distributes, refines and checks; prints times and messages.
fn row(model: &Model, mesh: &Mesh, ranks: u32, n: u32) -> Vec<DistMesh> {
    let start = Instant::now();
    let (rank_of, metrics) =
        partition::partition(mesh, ranks, &partition::Settings::default()).expect("a partition");
    let partition_seconds = start.elapsed().as_secs_f64();
    let projector = model.projector();

    let start = Instant::now();
    let sent = thread::run(ranks, |comm| {
        let counting = Counting::new(comm);
        let given = (comm.rank() == 0).then(|| (mesh.clone(), rank_of.clone()));
        let part = distribution::distribute(&counting, given).expect("a classified mesh");
        (part, counting.taken())
    });
    let distribute_seconds = start.elapsed().as_secs_f64();
    let (parts, sent): (Vec<DistMesh>, Vec<[u64; 3]>) = sent.expect("no rank fails").into_iter().unzip();

    let alone = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread");
    let (mut refining, mut checking) = (Vec::new(), Vec::new());
    for part in &parts {
        alone.install(|| {
            let start = living_cpu_seconds();
            let part =
                refine::refine(part.clone(), &projector, n, &refine::Settings::default()).expect("refinable");
            refining.push(living_cpu_seconds() - start);
            let start = living_cpu_seconds();
            let report = check::check_part(&part, Some(&projector), &check::Settings::default());
            let _ = check::checksum(&part);
            checking.push(living_cpu_seconds() - start);
            assert_eq!(report.faults, 0);
        });
    }
    // Messages of the check, with two subdivisions an edge; they do not grow with the subdivisions.
    let messages = thread::run(ranks, |comm| {
        let counting = Counting::new(comm);
        let part = parts[comm.rank() as usize].clone();
        let part = refine::refine(part, &projector, 2, &refine::Settings::default()).expect("refinable");
        check::check(&counting, &part, Some(&projector), &check::Settings::default()).expect("all ranks");
        check::checksum_of_all(&counting, &part).expect("all ranks");
        counting.taken()
    });
    let messages = messages.expect("no rank fails");

    let largest =
        |numbers: &[[u64; 3]], which: usize| numbers.iter().map(|m| m[which]).max().unwrap_or(0) as f64;
    let mean = |seconds: &[f64]| seconds.iter().sum::<f64>() / seconds.len() as f64;
    let most = |seconds: &[f64]| seconds.iter().copied().fold(0.0, f64::max);
    let tets = mesh.tets.len() as f64 * f64::from(n).powi(3);
    println!(
        "| {ranks} | {partition_seconds:.2} | {} | {:.3} | {distribute_seconds:.2} | {:.1} | {:.0} | {:.3} {:.3} | {:.0} | {:.3} {:.3} | {:.0} | {:.1} |",
        metrics.edge_cut,
        metrics.imbalance,
        largest(&sent, 1) / 1e6,
        largest(&sent, 2) / 1e3,
        mean(&refining),
        most(&refining),
        tets / refining.iter().sum::<f64>() / 1e6,
        mean(&checking),
        most(&checking),
        largest(&messages, 1),
        largest(&messages, 2) / 1e3,
    );
    parts
}

/// Size estimate of the parts with `n` subdivisions an edge, without refining them.
fn predicted_row(ranks: u32, parts: &[DistMesh], n: u32) {
    let all: Vec<PredictedCounts> =
        parts.iter().map(|part| predicted_counts(part, n, Order::First)).collect();
    let mean = |of: &dyn Fn(&PredictedCounts) -> f64| all.iter().map(of).sum::<f64>() / all.len() as f64;
    let most = |of: &dyn Fn(&PredictedCounts) -> f64| all.iter().map(of).fold(0.0, f64::max);
    let shared = |c: &PredictedCounts| 100.0 * c.shared as f64 / c.held as f64;
    let neighbours = |c: &PredictedCounts| c.neighbours.len() as f64;
    println!(
        "| {ranks} | {:.3e} {:.3e} | {:.2} | {:.3} | {:.2} {:.2} | {:.3} | {:.1} {:.0} |",
        mean(&|c| c.tets as f64),
        most(&|c| c.tets as f64),
        most(&|c| c.bytes[0] as f64) / 1e9,
        most(&|c| c.bytes[1] as f64) / 1e9,
        mean(&shared),
        most(&shared),
        most(&PredictedCounts::owned_share) / mean(&PredictedCounts::owned_share),
        mean(&neighbours),
        most(&neighbours),
    );
}
