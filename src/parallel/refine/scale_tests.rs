//! Meshes too large to generate: their ids, and the share of a thousand ranks. Also: streamed,
//! stored and recomputed meshes are written alike.

use super::fixtures::{Fixture, ball, cube, cylinder, whole};
use super::numbering::{Entity, Numbering};
use super::*;
use crate::files;
use crate::ground::comm::thread;
use crate::ground::kernel::random::Random;
use crate::ground::mesh::stream::MeshStream;
use crate::ground::mesh::{Label, Names, Order};
use crate::parallel::check::{check, check_part, checksum, checksum_of_all};
use crate::parallel::distribution::{self, distribute};
use crate::parallel::partition::{self, partition};
use std::collections::BTreeMap;
use std::path::Path;

/// The parts of a cube, partitioned by METIS if it is built in.
fn parts_of_cube(k: usize, ranks: u32) -> Vec<DistMesh> {
    let mesh = cube(k, false).mesh;
    let (rank_of, _) = partition(&mesh, ranks, &partition::Settings::default()).expect("enough tets");
    let parts = thread::run(ranks, |comm| {
        let mesh = (comm.rank() == 0).then(|| (mesh.clone(), rank_of.clone()));
        distribute(comm, mesh).expect("a classified mesh")
    });
    parts.expect("no rank fails")
}

#[test]
fn ids_of_a_trillion_tets_are_unique_and_in_range() {
    let parts = parts_of_cube(6, 128);
    let mut random = Random::new(5);
    let mut seen: BTreeMap<GlobalId, (usize, GlobalId, u32)> = BTreeMap::new();
    let mut repeated = 0;
    let mut tets = Vec::new();
    for part in &parts {
        let numbering = Numbering::new(part, lattice::MAX_PIECES, Order::First).expect("parts small enough");
        let totals = numbering.totals();
        assert!(totals.tets > 1_000_000_000_000, "{totals:?}");
        let mut sample = |local: u32| {
            let (entity, within) = numbering.locate(local);
            let ids = [&part.vertex_ids, &part.edge_ids, &part.face_ids, &part.tet_ids][entity.dimension];
            let coarse = ids[entity.id as usize];
            let id = numbering.first_id(entity.dimension, coarse) + u64::from(within);
            assert!(id < totals.vertices, "{id} of {totals:?}");
            // The same id is the same position in the same coarse entity on every part.
            let place = (entity.dimension, coarse, within);
            repeated += u64::from(seen.insert(id, place).is_some_and(|before| {
                assert_eq!(before, place);
                true
            }));
        };
        (0..2000).for_each(|_| sample((random.unit() * f64::from(numbering.vertices())) as u32));
        // The first and last vertex of each coarse entity, next to the neighbouring ranges.
        let counts = [part.points.len(), part.edges.len(), part.faces.len(), part.tets.len()];
        for (dimension, count) in counts.into_iter().enumerate() {
            for id in 0..count as u32 {
                let inside = numbering.inside(Entity { dimension, id });
                [inside.start, inside.end - 1].into_iter().for_each(&mut sample);
            }
        }
        let children = u64::from(numbering.lattice().children());
        tets.extend(part.tet_ids.iter().flat_map(|id| [id * children, id * children + children - 1]));
        assert!(tets.iter().all(|&id| id < totals.tets));
    }
    assert!(repeated > 5_000, "parts share what lies between them: {repeated}");
    let count = tets.len();
    tets.sort_unstable();
    tets.dedup();
    assert_eq!(tets.len(), count, "no tet is in two parts");
}

#[test]
fn a_thousand_ranks_make_the_mesh_that_one_makes() {
    let fixture = cube(6, false);
    let on = |ranks: u32| {
        let rank_of: Vec<Rank> = (0..fixture.mesh.tets.len() as u32).map(|t| t % ranks).collect();
        let made = thread::run(ranks, |comm| {
            let mesh = (comm.rank() == 0).then(|| (fixture.mesh.clone(), rank_of.clone()));
            let part = distribute(comm, mesh).expect("a classified mesh");
            let counted = predicted_counts(&part, 3, Order::First);
            let part = refine(part, &fixture.projector, 3, &Settings::default()).expect("refinable");
            assert_eq!((counted.tets, counted.held), (part.counts().tets, part.counts().vertices));
            let [owned] = comm.all_reduce_sum_u64([counted.owned]).expect("all ranks");
            assert_eq!(owned, part.totals().vertices, "each vertex has one owner");
            checksum_of_all(comm, &part).expect("all ranks")
        });
        made.expect("no rank fails")[0]
    };
    assert_eq!(on(1024), on(1));
}

#[test]
fn parts_own_like_shares_of_what_they_hold() {
    for ranks in [16, 128, 1024] {
        let counted: Vec<PredictedCounts> =
            parts_of_cube(16, ranks).iter().map(|part| predicted_counts(part, 16, Order::First)).collect();
        let shares: Vec<f64> = counted.iter().map(PredictedCounts::owned_share).collect();
        let mean = shares.iter().sum::<f64>() / f64::from(ranks);
        let largest = shares.iter().copied().fold(0.0, f64::max);
        assert!(largest < 1.1 * mean, "{ranks} parts: {largest} beside {mean}");
        assert!(counted.iter().all(|c| !c.neighbours.is_empty() && c.neighbours.len() < 60));
    }
}

fn names(fixture: &Fixture) -> Names {
    let named = |k: u32| Label::new(k, format!("number {k}"));
    let bodies = fixture.mesh.bodies.iter().map(|b| b.0 + 1).max().unwrap_or(0);
    let patches = fixture.mesh.triangles.iter().map(|t| t.patch.0 + 1).max().unwrap_or(0);
    Names { bodies: (1..=bodies).map(named).collect(), patches: (1..=patches).map(named).collect() }
}

/// The files of a folder and its subfolders, by name.
fn files(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut found = BTreeMap::new();
    for entry in std::fs::read_dir(folder).expect("a folder").map(|entry| entry.expect("an entry").path()) {
        if entry.is_dir() {
            found.extend(files(&entry));
        } else {
            found.insert(entry.display().to_string(), std::fs::read(&entry).expect("a file"));
        }
    }
    let folder = folder.display().to_string();
    found.into_iter().map(|(name, bytes)| (name.replace(&folder, ""), bytes)).collect()
}

#[test]
fn streamed_stored_and_recomputed_meshes_are_written_alike() {
    for fixture in [cylinder(2), cube(2, true)] {
        let names = names(&fixture);
        let written = |make: &dyn Fn(DistMesh) -> Box<dyn MeshStream>| {
            let folder = tempfile::tempdir().expect("a folder");
            let parts = thread::run(2, |comm| {
                let rank_of = (0..fixture.mesh.tets.len() as u32).map(|t| t / 5 % 2).collect();
                let mesh = (comm.rank() == 0).then(|| (fixture.mesh.clone(), rank_of));
                distribute(comm, mesh).expect("a classified mesh")
            });
            let made: Vec<_> = parts.expect("no rank fails").into_iter().map(make).collect();
            thread::run(2, |comm| {
                let part = &*made[comm.rank() as usize];
                files::elmer::write(comm, part, &names, folder.path()).expect("written");
                files::vtu::write(comm, part, &names, &folder.path().join("mesh")).expect("written");
            })
            .expect("no rank fails");
            files(folder.path())
        };
        let how = |keep| Settings { keep, ..Settings::default() };
        let refined = |part, keep| refine(part, &fixture.projector, 6, &how(keep)).expect("refinable");
        let streamed = written(&|part| Box::new(refined(part, Keep::All)));
        assert!(streamed.len() > 12, "{:?}", streamed.keys());
        assert!(
            streamed == written(&|part| Box::new(refined(part, Keep::All).materialize().expect("few tets")))
        );
        assert!(streamed == written(&|part| Box::new(refined(part, Keep::Boundary))));
    }
}

#[test]
fn coordinates_that_are_computed_anew_are_the_same_bits() {
    for fixture in [ball(1.0), cylinder(2), cube(2, true)] {
        for n in [7, 8, 12] {
            let with = |keep| {
                let settings = Settings { keep, ..Settings::default() };
                refine(whole(&fixture.mesh), &fixture.projector, n, &settings).expect("refinable")
            };
            let (kept, anew) = (with(Keep::All), with(Keep::Boundary));
            assert!(kept.keeps_all() && !anew.keeps_all() && anew.bytes() < kept.bytes());
            assert_eq!(checksum(&anew), checksum(&kept));
            let report = |mesh: &RefinedMesh| {
                check_part(mesh, Some(&fixture.projector), &crate::parallel::check::Settings::default())
            };
            assert_eq!(report(&anew), report(&kept));
        }
    }
}

#[test]
fn a_check_of_all_ranks_takes_parts_that_recompute() {
    let fixture = ball(1.0);
    let reports = thread::run(3, |comm| {
        let rank_of = (0..fixture.mesh.tets.len() as u32).map(|t| t % 3).collect();
        let mesh = (comm.rank() == 0).then(|| (fixture.mesh.clone(), rank_of));
        let part = distribute(comm, mesh).expect("a classified mesh");
        let settings = Settings { keep: Keep::Boundary, ..Settings::default() };
        let part = refine(part, &fixture.projector, 8, &settings).expect("refinable");
        check(comm, &part, Some(&fixture.projector), &crate::parallel::check::Settings::default())
            .expect("all ranks")
    });
    let report = &reports.expect("no rank fails")[0];
    assert_eq!(report.faults, 0, "{:?}", report.described);
    let whole = distribution::from_serial(fixture.mesh.clone()).expect("a mesh");
    assert_eq!(
        report.vertices,
        Numbering::new(&whole, 8, Order::First).expect("few vertices").totals().vertices
    );
}
