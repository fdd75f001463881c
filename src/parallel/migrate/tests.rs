use super::*;
use crate::ground::comm::thread;
use crate::ground::mesh::Mesh;
use crate::ground::mesh::fixtures::{lattice_box, lattice_cube};
use crate::ground::mesh::stream::MeshStream;
use crate::parallel::check::{Checksum, checksum_of_all};
use crate::parallel::distribution::{distribute, from_serial};
use crate::parallel::refine::{self, fixtures};
use proptest::collection::vec;
use proptest::prelude::*;
use proptest::test_runner::RngSeed;

/// The destination of each tet, by global id.
type Plan = Vec<Rank>;

fn given(comm: &dyn Communicator, mesh: &Mesh, part: &[Rank]) -> Option<(Mesh, Vec<Rank>)> {
    (comm.rank() == 0).then(|| (mesh.clone(), part.to_vec()))
}

fn to(tet_ids: &[GlobalId], plan: &Plan) -> Vec<Rank> {
    tet_ids.iter().map(|&id| plan[id as usize]).collect()
}

/// Moves from one partition to the other and back. After each move the parts must equal those that
/// rank 0 would distribute.
fn there_and_back(mesh: &Mesh, before: &Plan, after: &Plan, ranks: u32) {
    thread::run(ranks, |comm| {
        let start = distribute(comm, given(comm, mesh, before)).unwrap();
        let expected = distribute(comm, given(comm, mesh, after)).unwrap();
        let there = migrate(comm, start.clone(), &to(&start.tet_ids, after)).unwrap();
        there.check(comm).unwrap();
        assert!(there == expected, "rank {}: {} tets", comm.rank(), there.tets.len());
        let back = migrate(comm, there.clone(), &to(&there.tet_ids, before)).unwrap();
        assert!(back == start, "rank {} changed", comm.rank());
        let sum = |mesh: DistMesh| checksum_of_all(comm, &BareStream::new(mesh.into())).unwrap();
        let sums = [sum(start), sum(there)];
        assert_eq!(sums[0], sums[1]);
        assert_eq!(sums[0].open, 0, "unmatched faces");
    })
    .unwrap();
}

#[test]
fn all_to_one_one_to_all_rotations_and_no_move_at_all_keep_the_mesh() {
    let mesh = lattice_box([4, 2, 2], |[x, _, _]| u32::from(x >= 2));
    let tets = mesh.tets.len() as u32;
    for ranks in [1, 2, 3, 4, 7, 16] {
        let slabs: Plan = (0..tets).map(|tet| tet * ranks / tets).collect();
        let rotated: Plan = slabs.iter().map(|rank| (rank + 1) % ranks).collect();
        let scattered: Plan = (0..tets).map(|tet| tet * 7 % ranks).collect();
        for after in [&slabs, &rotated, &scattered, &vec![ranks - 1; tets as usize]] {
            there_and_back(&mesh, &slabs, after, ranks);
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig {
        cases: 40, rng_seed: RngSeed::Fixed(11), failure_persistence: None, ..ProptestConfig::default()
    })]

    #[test]
    fn any_pattern_of_movement_gives_the_parts_that_rank_0_would_have_handed_out(
        cells in [1..4usize, 1..4usize, 1..4usize],
        ranks in 1..17u32,
        bodies in 1..4usize,
        used in 1..17u32,
        numbers in vec((any::<u32>(), any::<u32>()), 6 * 27),
    ) {
        let mesh = lattice_box(cells, |[x, y, _]| ((x + 2 * y) % bodies) as u32);
        // Few of the ranks before or after, or all: some start or end without tets.
        let few = used.min(ranks);
        let (before, after): (Plan, Plan) =
            numbers.iter().take(mesh.tets.len()).map(|(a, b)| (a % few, ranks - 1 - b % ranks)).unzip();
        there_and_back(&mesh, &before, &after, ranks);
    }
}

/// Refines, moves, refines, moves: the checksums after the last and the first refinement.
fn refined_twice(fixture: &fixtures::Fixture, ranks: u32, plans: [fn(u64, u32) -> Rank; 3]) -> [Checksum; 2] {
    let sums = thread::run(ranks, |comm| {
        let part = (0..fixture.mesh.tets.len() as u64).map(|id| plans[0](id, ranks)).collect::<Vec<_>>();
        let mut coarse = distribute(comm, given(comm, &fixture.mesh, &part)).unwrap();
        let mut sums = [Checksum::default(); 2];
        let check_settings = crate::parallel::check::Settings::default();
        for (sum, plan) in sums.iter_mut().zip(&plans[1..]) {
            let refined =
                refine::refine(coarse, &fixture.projector, 2, &refine::Settings::default()).unwrap();
            let fine = bare(&refined).unwrap();
            let to: Vec<Rank> = fine.tet_ids.iter().map(|&id| plan(id, ranks)).collect();
            let (moved, _) = migrate_bare(comm, fine, &to, &MoveSettings::default()).unwrap();
            let stream = BareStream::new(moved);
            *sum = checksum_of_all(comm, &stream).unwrap();
            assert_eq!(*sum, checksum_of_all(comm, &refined).unwrap());
            let report =
                crate::parallel::check::check(comm, &stream, Some(&fixture.projector), &check_settings)
                    .unwrap();
            assert_eq!(report.faults, 0, "{:?}", report.described);
            coarse = number_shared(comm, stream.into_mesh()).unwrap();
            coarse.check(comm).unwrap();
        }
        sums
    })
    .unwrap();
    assert!(sums.iter().all(|sum| *sum == sums[0]));
    sums[0]
}

#[test]
fn refine_migrate_refine_migrate_is_refining_twice_on_one_rank() {
    let alone: [fn(u64, u32) -> Rank; 3] = [|_, _| 0; 3];
    let moving: [fn(u64, u32) -> Rank; 3] = [
        |id, ranks| (id % u64::from(ranks)) as Rank,
        |id, ranks| (id / 5 % u64::from(ranks)) as Rank,
        |id, ranks| (id * 7 / 3 % u64::from(ranks)) as Rank,
    ];
    for fixture in [fixtures::cube(4, true), fixtures::ball(1.0), fixtures::cylinder(2)] {
        let expected = refined_twice(&fixture, 1, alone);
        assert_eq!(expected[1].open, 0);
        for ranks in [2, 3, 5] {
            assert_eq!(refined_twice(&fixture, ranks, moving), expected, "{ranks} ranks");
        }
    }
}

#[test]
fn a_stream_of_a_bare_mesh_is_that_of_its_coarse_mesh() {
    let mesh = lattice_box([2, 2, 2], |[x, _, _]| x as u32);
    let part = from_serial(mesh).unwrap();
    let stream = BareStream::new(part.clone().into());
    let identity =
        refine::refine(part, &crate::ground::projector::Projector::Flat, 1, &refine::Settings::default())
            .unwrap();
    assert_eq!(stream.counts(), identity.counts());
    assert_eq!(crate::parallel::check::checksum(&stream), crate::parallel::check::checksum(&identity));
    // One block for each run of ids in one body, not one per tet.
    assert!(stream.tet_blocks() < stream.counts().tets as usize / 2);
}

#[test]
fn destinations_that_do_not_fit_are_refused_on_all_ranks_with_their_place() {
    let mesh = lattice_cube(1);
    let errors = thread::run(3, |comm| {
        let part = distribute(comm, given(comm, &mesh, &[0, 0, 1, 1, 2, 2])).unwrap();
        let few = migrate(comm, part.clone(), if comm.rank() == 1 { &[0] } else { &[0, 0] }).unwrap_err();
        let far = migrate(comm, part, &[if comm.rank() == 2 { 7 } else { 0 }; 2]).unwrap_err();
        [few, far]
    })
    .unwrap();
    let few = MigrateError::Destinations { rank: 1, tets: 2, destinations: 1 };
    let far = MigrateError::NoSuchRank { tet: 4, destination: 7, ranks: 3 };
    assert_eq!(
        errors[0][0],
        MigrateError::Comm(CommError::Elsewhere { rank: 1, kind: few.kind(), message: few.to_string() })
    );
    assert_eq!(errors[1][0], few);
    assert_eq!(errors[2][1], far);
    assert_eq!(
        errors[0][1],
        MigrateError::Comm(CommError::Elsewhere { rank: 2, kind: far.kind(), message: far.to_string() })
    );
}

#[test]
fn a_rank_without_memory_for_its_new_part_stops_all_with_one_message() {
    let mesh = lattice_cube(2);
    let errors = thread::run(2, |comm| {
        let part = distribute(comm, given(comm, &mesh, &[0; 48])).unwrap();
        // The bytes that rank 1 receives and rank 0 sends.
        let to = vec![1; part.tets.len()];
        [1, 0].map(|poor| {
            let settings = MoveSettings { array_limit: if comm.rank() == poor { 300 } else { u64::MAX } };
            migrate_bare(comm, part.clone().into(), &to, &settings).unwrap_err()
        })
    })
    .unwrap();
    for (case, [poor, other]) in [[1, 0], [0, 1]].into_iter().enumerate() {
        let [own, others] = [&errors[poor][case], &errors[other][case]];
        let MigrateError::OutOfMemory { rank, bytes } = *own else { panic!("{own}") };
        assert!(bytes > 300 && rank == poor as Rank);
        assert_eq!(
            *others,
            MigrateError::Comm(CommError::Elsewhere { rank, kind: own.kind(), message: own.to_string() })
        );
    }
}

#[test]
fn a_mesh_of_other_ranks_is_refused() {
    let mesh = from_serial(lattice_cube(1)).unwrap();
    let errors = thread::run(2, |comm| {
        let part = BareMesh { rank: comm.rank(), ..mesh.clone().into() };
        migrate_bare(comm, part, &[0; 6], &MoveSettings::default()).unwrap_err()
    });
    assert!(errors.unwrap().iter().all(|error| *error == MigrateError::Ranks { expected: 1, ranks: 2 }));
}
