//! How good and how fast partitions of distributed meshes are, method by method, beside METIS on all tets.
//!
//! `cargo bench --bench repartition -- DIR RANKS PARTS…`: an Elmer mesh, read on so many in-process ranks. Seconds are processor seconds of
//! all threads, so that a busy machine does not matter much.
#![forbid(unsafe_code)]
#![allow(missing_docs)]

mod common;

use common::cpu_seconds;
use std::path::PathBuf;
use tetmill::comm::thread;
use tetmill::io::elmer;
use tetmill::repartition::{self, Geometric, Method};

fn main() {
    // Cargo adds --bench.
    let args: Vec<String> = std::env::args().skip(1).filter(|arg| !arg.starts_with("--")).collect();
    let [dir, ranks, parts @ ..] = &args[..] else {
        println!("cargo bench --bench repartition -- DIR RANKS PARTS…");
        return;
    };
    let (dir, ranks) = (PathBuf::from(dir), ranks.parse().expect("a number of ranks"));
    let parts: Vec<u32> = parts.iter().map(|parts| parts.parse().expect("a number of parts")).collect();
    let whole = ("METIS on all tets", Method::Clusters { per_part: u32::MAX });
    let methods = [
        ("curve", Method::Geometric(Geometric::Curve)),
        ("bisection", Method::Geometric(Geometric::Bisection)),
        ("curve, smoothed", Method::Smoothed(Geometric::Curve)),
        ("bisection, smoothed", Method::Smoothed(Geometric::Bisection)),
        ("1000 clusters a part, smoothed", Method::Clusters { per_part: 1000 }),
        ("4000 clusters a part, smoothed", Method::Clusters { per_part: 4000 }),
        ("16000 clusters a part, smoothed (default)", Method::graph()),
    ];
    let mut table = String::new();
    for &parts in &parts {
        let mut whole_cut = 0;
        for (name, method) in [whole].into_iter().chain(methods) {
            let results = thread::run(ranks, |comm| {
                let loaded = elmer::load(comm, &dir).expect("a mesh");
                comm.barrier().expect("no rank fails");
                let start = cpu_seconds();
                let part = repartition::repartition(comm, &loaded.mesh, parts, method).expect("a partition");
                comm.barrier().expect("no rank fails");
                let seconds = cpu_seconds() - start;
                (repartition::measure(comm, &loaded.mesh, &part, parts).expect("no rank fails"), seconds)
            });
            let (metrics, seconds) = results.expect("no rank fails")[0];
            if whole_cut == 0 {
                whole_cut = metrics.edge_cut;
            }
            table += &format!(
                "| {parts} | {name} | {seconds:.2} | {} | {:.2} | {:.3} | {} | {:.1} | {} |\n",
                metrics.edge_cut,
                metrics.edge_cut as f64 / whole_cut as f64,
                metrics.imbalance,
                metrics.shared_vertices,
                metrics.mean_neighbours,
                metrics.most_neighbours
            );
        }
    }
    println!(
        "| parts | method | processor s | faces cut | to METIS | imbalance | vertices shared | neighbours | at most |"
    );
    println!("|---|---|---|---|---|---|---|---|---|\n{table}");
}
