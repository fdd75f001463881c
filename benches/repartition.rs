//! Quality and speed of the partition methods for distributed meshes, compared with METIS on all
//! tets.
//!
//! `cargo bench --bench repartition -- DIR RANKS PARTS…` reads an Elmer mesh on RANKS in-process
//! ranks. Times are processor seconds of all threads, so that other load hardly matters. METIS on
//! all tets partitions the dual graph of the whole mesh on one rank.
#![forbid(unsafe_code)]
#![allow(missing_docs)]

mod common;

use common::cpu_seconds;
use std::path::{Path, PathBuf};
use tetmill::comm::Rank;
use tetmill::comm::{Communicator, thread};
use tetmill::files::elmer;
use tetmill::internals::partition::weighted;
use tetmill::internals::partition::weighted::Graph;
use tetmill::internals::topology::matched_faces;
use tetmill::mesh::BareMesh;
use tetmill::repartition;
use tetmill::repartition::{Geometric, Method, Metrics, Neighbours};

/// METIS' recursive bisection of the dual graph of a mesh on one rank.
fn metis(mesh: &BareMesh, parts: u32) -> Vec<Rank> {
    let sides = matched_faces(mesh.points.len(), &mesh.tets).expect("a mesh").tets;
    let inner = sides.into_iter().filter(|[_, second]| *second != u32::MAX);
    let graph = Graph::new(vec![1; mesh.tets.len()], inner.map(|[a, b]| [a, b, 1]).collect());
    weighted::bisect(&graph, parts).expect("METIS is there")
}

/// Reads a mesh and partitions it; returns the metrics and the processor seconds.
fn measured(
    dir: &Path,
    ranks: u32,
    parts: u32,
    partition: impl Fn(&dyn Communicator, &BareMesh, &Neighbours) -> Vec<Rank> + Sync,
) -> (Metrics, f64) {
    let results = thread::run(ranks, |comm| {
        let mesh = BareMesh::from(elmer::load(comm, dir).expect("a mesh").mesh);
        comm.barrier().expect("no rank fails");
        let start = cpu_seconds();
        let neighbours = Neighbours::find(comm, &mesh).expect("a mesh");
        let part = partition(comm, &mesh, &neighbours);
        comm.barrier().expect("no rank fails");
        let seconds = cpu_seconds() - start;
        (repartition::measure(comm, &mesh, &neighbours, &part, parts).expect("no rank fails"), seconds)
    });
    results.expect("no rank fails")[0]
}

fn main() {
    // Cargo adds --bench.
    let args: Vec<String> = std::env::args().skip(1).filter(|arg| !arg.starts_with("--")).collect();
    let [dir, ranks, parts @ ..] = &args[..] else {
        println!("cargo bench --bench repartition -- DIR RANKS PARTS…");
        return;
    };
    let (dir, ranks) = (PathBuf::from(dir), ranks.parse().expect("a number of ranks"));
    let parts: Vec<u32> = parts.iter().map(|parts| parts.parse().expect("a number of parts")).collect();
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
        let whole = measured(&dir, 1, parts, |_, mesh, _| metis(mesh, parts));
        let whole_cut = whole.0.edge_cut as f64;
        let by = |method: Method| {
            measured(&dir, ranks, parts, |comm, mesh, neighbours| {
                repartition::repartition(comm, mesh, neighbours, parts, method).expect("a partition")
            })
        };
        let ours = methods.map(|(name, method)| (name, by(method)));
        for (name, (metrics, seconds)) in [("METIS on all tets", whole)].into_iter().chain(ours) {
            table += &format!(
                "| {parts} | {name} | {seconds:.2} | {} | {:.2} | {:.3} | {} | {:.1} | {} |\n",
                metrics.edge_cut,
                metrics.edge_cut as f64 / whole_cut,
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
