//! Migration of tets: tables 6.2 and 6.3 of the thesis, a tenth of each rank's tets to 10 and to 20
//! random ranks.
//!
//! `cargo bench --bench migrate [-- CELLS PIECES RANKS]`: a cube with CELLS cells an edge of six
//! coarse tets each, PIECES subdivisions of each edge, and in-process ranks.
//!
//! Times are processor seconds of all threads, so that other load hardly matters. The peak memory
//! of the process is reset before each move (Linux).
#![forbid(unsafe_code)]
#![allow(missing_docs)]

mod common;

use common::cpu_seconds;
use csg::{BodyId, PatchId};
use std::sync::Mutex;
use tetmill::Point;
use tetmill::comm::Rank;
use tetmill::comm::thread;
use tetmill::internals::{Projector, distribution, migrate, partition, refine};
use tetmill::memory::peak_bytes;
use tetmill::mesh::{BareMesh, BoundaryTriangle, Class, Mesh, TET_FACES, VertexId};
use tetmill::repartition::Moved;

/// A grid of Kuhn cubes whose boundary is one patch.
fn cube(cells: usize) -> Mesh {
    let side = cells + 1;
    let at = |p: [usize; 3]| VertexId::new((p[2] * side + p[1]) * side + p[0]);
    let place = |v: usize| [v % side, v / side % side, v / (side * side)];
    let mut mesh = Mesh::default();
    for v in 0..side.pow(3) {
        let [x, y, z] = place(v);
        mesh.points.push(Point::new(x as f64, y as f64, z as f64) / cells as f64);
        let inside = place(v).iter().all(|&x| x > 0 && x < cells);
        mesh.classes.push(if inside { Class::Body(BodyId(0)) } else { Class::Patch(PatchId(0)) });
    }
    for cell in (0..cells.pow(3)).map(|c| [c % cells, c / cells % cells, c / (cells * cells)]) {
        for (order, odd) in [[0, 1, 2], [1, 2, 0], [2, 0, 1], [0, 2, 1], [2, 1, 0], [1, 0, 2]]
            .into_iter()
            .zip([false, false, false, true, true, true])
        {
            let mut corner = cell;
            let mut tet = [at(cell); 4];
            for (v, axis) in tet[1..].iter_mut().zip(order) {
                corner[axis] += 1;
                *v = at(corner);
            }
            if odd {
                tet.swap(2, 3);
            }
            mesh.tets.push(tet);
        }
    }
    mesh.bodies = vec![BodyId(0); mesh.tets.len()];
    for vertices in mesh.tets.iter().flat_map(|tet| TET_FACES.map(|face| face.map(|k| tet[k]))) {
        let on_side = |axis: usize, x: usize| vertices.iter().all(|v| place(v.index())[axis] == x);
        if (0..3).any(|axis| on_side(axis, 0) || on_side(axis, cells)) {
            mesh.triangles.push(BoundaryTriangle { vertices, patch: PatchId(0) });
        }
    }
    mesh
}

/// Pseudo-random numbers (Steele, Lea, Flood 2014, SplitMix64).
struct Random(u64);

impl Random {
    fn below(&mut self, bound: usize) -> usize {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ z >> 30).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ z >> 27).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((u128::from(z ^ z >> 31) * bound as u128) >> 64) as usize
    }
}

/// A tenth of the tets in clumps of consecutive ones, each to a random other rank.
fn clumps(part: &BareMesh, clumps: usize) -> Vec<Rank> {
    let mut random = Random(u64::from(part.rank));
    let mut to = vec![part.rank; part.tets.len()];
    let stretch = part.tets.len() / clumps;
    for clump in 0..clumps {
        let start = clump * stretch + random.below(stretch - stretch / 10);
        let rank = other_rank(part, &mut random);
        to[start..start + stretch / 10].fill(rank);
    }
    to
}

/// A tenth of the tets, one by one.
fn scattered(part: &BareMesh) -> Vec<Rank> {
    let mut random = Random(u64::from(part.rank));
    let pick = |_| if random.below(10) == 0 { other_rank(part, &mut random) } else { part.rank };
    (0..part.tets.len()).map(pick).collect()
}

fn other_rank(part: &BareMesh, random: &mut Random) -> Rank {
    let other = random.below(part.ranks as usize - 1) as Rank;
    other + Rank::from(other >= part.rank)
}

fn main() {
    let args: Vec<usize> = std::env::args().skip(1).filter_map(|arg| arg.parse().ok()).collect();
    let number = |k: usize, other: usize| args.get(k).copied().unwrap_or(other);
    let (cells, pieces, ranks) = (number(0, 20), number(1, 6) as u32, number(2, 16) as u32);
    let mesh = cube(cells);
    let settings = partition::Settings { method: partition::Method::Bisection, ..Default::default() };
    let (part, _) = partition::partition(&mesh, ranks, &settings).expect("a partition");
    let parts = thread::run(ranks, |comm| {
        let given = (comm.rank() == 0).then(|| (mesh.clone(), part.clone()));
        let coarse = distribution::distribute(comm, given).expect("a classified mesh");
        let refined = refine::refine(coarse, &Projector::Flat, pieces, &refine::Settings::default());
        migrate::bare(&refined.expect("refinable")).expect("memory")
    });
    let parts: Vec<Mutex<Option<BareMesh>>> =
        parts.expect("no rank fails").into_iter().map(|part| Mutex::new(Some(part))).collect();
    let all = mesh.tets.len() as u64 * u64::from(pieces).pow(3);
    println!("{all} tets on {ranks} ranks\n");
    println!(
        "| a tenth of the tets moves | moved | wall s | processor s | M tets moved/s a core | bytes sent a tet | mesh MB | peak beyond it MB |"
    );
    println!("|---|---|---|---|---|---|---|---|");
    type Choice = fn(&BareMesh) -> Vec<Rank>;
    let patterns: [(&str, Choice); 4] = [
        ("10 clumps a rank to random ranks", |part| clumps(part, 10)),
        ("20 clumps a rank to random ranks", |part| clumps(part, 20)),
        ("one by one to random ranks", scattered),
        ("nothing (all stay)", |part| vec![part.rank; part.tets.len()]),
    ];
    for (name, choose) in patterns {
        let bytes: u64 =
            parts.iter().map(|part| part.lock().unwrap().as_ref().map_or(0, BareMesh::bytes)).sum();
        let destinations: Vec<Vec<Rank>> =
            parts.iter().map(|part| choose(part.lock().unwrap().as_ref().expect("a part"))).collect();
        // Not every kernel supports this; the column is then too large.
        let _ = std::fs::write("/proc/self/clear_refs", "5");
        let resident = peak_bytes().unwrap_or(0);
        let (start, wall) = (cpu_seconds(), std::time::Instant::now());
        let moved = thread::run(ranks, |comm| {
            let slot = &parts[comm.rank() as usize];
            let mesh = slot.lock().unwrap().take().expect("a part");
            let to = &destinations[comm.rank() as usize];
            let (mesh, moved) =
                migrate::migrate_bare(comm, mesh, to, &migrate::MoveSettings::default()).expect("memory");
            *slot.lock().unwrap() = Some(mesh);
            moved
        });
        let (seconds, wall) = (cpu_seconds() - start, wall.elapsed().as_secs_f64());
        let peak = peak_bytes().unwrap_or(0).saturating_sub(resident);
        let moved: Vec<Moved> = moved.expect("no rank fails");
        let tets: u64 = moved.iter().map(|m| m.tets).sum();
        let sent: u64 = moved.iter().map(|m| m.bytes).sum();
        println!(
            "| {name} | {tets} | {wall:.2} | {seconds:.2} | {:.2} | {:.1} | {:.0} | {:.0} |",
            tets as f64 / seconds / 1e6,
            sent as f64 / tets as f64,
            bytes as f64 / 1e6,
            peak as f64 / 1e6
        );
    }
    let (start, wall) = (cpu_seconds(), std::time::Instant::now());
    let settled = thread::run(ranks, |comm| {
        let mesh = parts[comm.rank() as usize].lock().unwrap().take().expect("a part");
        let settled = distribution::number_shared(comm, mesh).expect("a mesh");
        settled.edges.len() as u64
    });
    let edges: u64 = settled.expect("no rank fails").iter().sum();
    let (seconds, wall) = (cpu_seconds() - start, wall.elapsed().as_secs_f64());
    println!(
        "\nedges and faces settled: {edges} edges in {wall:.2} s, {seconds:.2} processor s, {:.2} M tets/s a core",
        all as f64 / seconds / 1e6
    );
}
