//! The conformance suite of the communicator under `mpirun`: this test program starts itself as the
//! ranks.
//!
//! Skipped with a message without the feature `mpi` or without `mpirun`.

use csg::{BodyId, PatchId};
use std::process::{Command, Output};
use tetmill::check::checksum_of_all;
use tetmill::comm::Communicator;
use tetmill::mesh::{BareStream, BoundaryTriangle, Class, DistMesh, Mesh, VertexId};
use tetmill::{Geometry, Mesher, Point};

/// Environment variable that selects the body a rank runs.
const BODY: &str = "TETMILL_TEST_BODY";

/// Bytes of a chunk, few enough that the messages of the suite need many chunks.
const SMALL_CHUNK: usize = 1000;

/// Runs `body` of [`as_a_rank`] on `ranks` processes, or prints why it cannot.
fn mpirun(ranks: u32, body: &str) -> Option<Output> {
    if !cfg!(feature = "mpi") {
        eprintln!("skipped: built without the feature `mpi`");
        return None;
    }
    let program = std::env::current_exe().expect("a test program knows its path");
    // The name of the test in the harness: the path of this module within its program.
    let module = module_path!().split_once("::").map(|(_, path)| format!("{path}::")).unwrap_or_default();
    let result = Command::new("mpirun")
        .args(["-n", &ranks.to_string()])
        .arg(program)
        .args([&format!("{module}as_a_rank"), "--exact", "--ignored", "--nocapture", "--test-threads=1"])
        .env(BODY, body)
        // By default Open MPI refuses to run as root or with more ranks than cores.
        .envs([("OMPI_ALLOW_RUN_AS_ROOT", "1"), ("OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "1")])
        .env("OMPI_MCA_rmaps_base_oversubscribe", "1")
        .output();
    match result {
        Ok(output) => Some(output),
        Err(error) => {
            eprintln!("skipped: cannot start mpirun: {error}");
            None
        }
    }
}

fn text(output: &Output) -> String {
    format!("{}{}", String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr))
}

#[test]
#[ignore = "a rank of the other tests, started by mpirun"]
fn as_a_rank() {
    let Ok(body) = std::env::var(BODY) else {
        eprintln!("skipped: only the other tests of this file start it");
        return;
    };
    #[cfg(feature = "mpi")]
    match body.as_str() {
        "own" => return on_a_communicator_of_its_own(),
        "own panic" => return panics_with_mpi_of_its_own(),
        "own without threads" => return without_threads(),
        _ => {}
    }
    #[cfg(feature = "mpi")]
    tetmill::comm::mpi::run_with_chunks(SMALL_CHUNK, |comm| run_body(&body, comm)).unwrap();
    #[cfg(not(feature = "mpi"))]
    tetmill::comm::mpi::run(|comm| run_body(&body, comm)).unwrap();
}

fn run_body(body: &str, comm: &dyn Communicator) {
    assert!(tetmill::comm::mpi::launched() || comm.size() == 1);
    match body {
        "conformance" => {
            tetmill::internals::conformance::conformance(comm);
            let ranks = comm.all_gather_one(comm.rank()).unwrap();
            if comm.rank() == 0 {
                println!("{} ranks with chunks of {SMALL_CHUNK} bytes conform", ranks.len());
            }
        }
        "distribute" => {
            let given = (comm.rank() == 0).then(|| (fan(40), (0..40).map(|tet| tet % comm.size()).collect()));
            let part = tetmill::internals::distribution::distribute(comm, given).unwrap();
            part.check(comm).unwrap();
            println!("rank {} has {} of {} tets", comm.rank(), part.tets.len(), part.totals.tets);
        }
        "migrate" => {
            let ranks = comm.size();
            let given = (comm.rank() == 0).then(|| (fan(40), (0..40).map(|tet| tet % ranks).collect()));
            let start = tetmill::internals::distribution::distribute(comm, given).unwrap();
            let sum = |mesh: &DistMesh| checksum_of_all(comm, &BareStream::new(mesh.clone().into())).unwrap();
            // In consecutive blocks, all on the last rank, and back.
            let plans: [fn(u64, u32) -> u32; 3] =
                [|tet, ranks| tet as u32 * ranks / 40, |_, ranks| ranks - 1, |tet, ranks| tet as u32 % ranks];
            let mut mesh = start.clone();
            for plan in plans {
                let to: Vec<u32> = mesh.tet_ids.iter().map(|&tet| plan(tet, ranks)).collect();
                mesh = tetmill::repartition::migrate(comm, mesh, &to).unwrap();
                mesh.check(comm).unwrap();
                assert_eq!(sum(&mesh), sum(&start));
            }
            assert!(mesh == start);
            println!("rank {} has its tets back", comm.rank());
        }
        "no geometry" => {
            let refused = Mesher::new().generate_on(comm, None).expect_err("there is no geometry");
            println!("rank {}: {refused}", comm.rank());
        }
        "panic" => {
            assert_ne!(comm.rank(), 1, "this rank fails on purpose");
            comm.barrier().unwrap();
            println!("the barrier was passed");
        }
        other => panic!("there is no body {other}"),
    }
}

/// The program initialises MPI itself, and lends its communicator.
#[cfg(feature = "mpi")]
fn on_a_communicator_of_its_own() {
    use tetmill::comm::mpi::{duplicate_of, rsmpi};
    let (universe, _) =
        rsmpi::initialize_with_threading(rsmpi::Threading::Funneled).expect("MPI can be initialised");
    let comm = duplicate_of(&universe.world()).expect("MPI allows threads");
    let ball = Geometry::from_text("algebraic3d solid b = sphere (0, 0, 0; 1); tlo b;").expect("a geometry");
    let mesh = Mesher::new().levels(1).generate_on(&comm, Some(&ball)).expect("a mesh");
    // Methods for numbers are found on the type itself.
    assert_eq!(comm.all_reduce_sum_u64([1]).expect("ranks").as_slice(), [u64::from(comm.size())]);
    println!("rank {} of a program has {}", comm.rank(), mesh.checksum);
    // MPI is finalised first.
    drop(universe);
    drop(comm);
    println!("the communicator is dropped");
}

/// The program initialises MPI itself, and one rank panics, in a thread that is not the first.
#[cfg(feature = "mpi")]
fn panics_with_mpi_of_its_own() {
    use tetmill::comm::mpi::{abort_on_panic, duplicate_of, rsmpi};
    abort_on_panic();
    let (universe, _) =
        rsmpi::initialize_with_threading(rsmpi::Threading::Funneled).expect("MPI can be initialised");
    let comm = duplicate_of(&universe.world()).expect("MPI allows threads");
    let thread = std::thread::spawn({
        let rank = comm.rank();
        move || assert_ne!(rank, 1, "this rank fails on purpose")
    });
    thread.join().expect("no panic");
    comm.barrier().expect("ranks");
    println!("the barrier was passed");
}

/// The program initialises MPI without threads.
#[cfg(feature = "mpi")]
fn without_threads() {
    use tetmill::comm::mpi::{duplicate_of, rsmpi};
    let universe = rsmpi::initialize().expect("MPI can be initialised");
    let granted = rsmpi::environment::threading_support();
    let refused = duplicate_of(&universe.world()).err();
    assert_eq!(refused.is_some(), granted < rsmpi::Threading::Funneled, "{granted:?}");
    println!("{granted:?}: {}", refused.map_or("taken".into(), |error| error.to_string()));
}

/// Tets around one edge, half a turn, with one patch.
fn fan(tets: u32) -> Mesh {
    let rim = (0..=tets).map(|i| std::f64::consts::PI * f64::from(i) / f64::from(tets));
    let rim = rim.map(|angle| Point::new(angle.cos(), angle.sin(), 0.0));
    let mut mesh = Mesh {
        points: [Point::origin(), Point::new(0.0, 0.0, 1.0)].into_iter().chain(rim).collect(),
        tets: (0..tets).map(|i| [0, i + 2, i + 3, 1].map(VertexId)).collect(),
        bodies: vec![BodyId(0); tets as usize],
        ..Mesh::default()
    };
    let ends = [[0, 2, 1], [0, 1, tets + 2]];
    let caps = (2..tets + 2).flat_map(|a| [[0, a + 1, a], [1, a, a + 1]]);
    let triangle =
        |vertices: [u32; 3]| BoundaryTriangle { vertices: vertices.map(VertexId), patch: PatchId(0) };
    mesh.triangles = ends.into_iter().chain(caps).map(triangle).collect();
    mesh.classes = vec![Class::Patch(PatchId(0)); mesh.points.len()];
    mesh
}

#[test]
fn processes_get_their_parts_and_agree_on_them() {
    let Some(output) = mpirun(4, "distribute") else { return };
    let text = text(&output);
    assert!(output.status.success(), "{text}");
    for rank in 0..4 {
        assert!(text.contains(&format!("rank {rank} has 10 of 40 tets")), "{text}");
    }
}

#[test]
fn processes_move_their_tets_and_get_them_back() {
    let Some(output) = mpirun(4, "migrate") else { return };
    let text = text(&output);
    assert!(output.status.success(), "{text}");
    for rank in 0..4 {
        assert!(text.contains(&format!("rank {rank} has its tets back")), "{text}");
    }
}

#[test]
fn processes_conform() {
    for ranks in [1, 2, 4] {
        let Some(output) = mpirun(ranks, "conformance") else { return };
        let text = text(&output);
        assert!(output.status.success(), "{text}");
        assert!(text.contains(&format!("{ranks} ranks with chunks")), "{text}");
    }
}

/// A body in which rank 1 panics ends with its message, and no rank passes the barrier.
fn assert_a_panic_ends_the_job(body: &str) {
    let Some(output) = mpirun(3, body) else { return };
    let text = text(&output);
    assert!(!output.status.success(), "{text}");
    assert!(text.contains("this rank fails on purpose"), "{text}");
    assert!(text.contains("rank 1 panicked: the job ends"), "{text}");
    assert!(!text.contains("the barrier was passed"), "{text}");
}

#[test]
fn a_rank_that_panics_ends_the_job_with_its_message() {
    assert_a_panic_ends_the_job("panic");
}

#[test]
fn a_program_with_mpi_of_its_own_gets_the_same_mesh() {
    let Some(output) = mpirun(3, "own") else { return };
    let text = text(&output);
    assert!(output.status.success(), "{text}");
    let ball = Geometry::from_text("algebraic3d solid b = sphere (0, 0, 0; 1); tlo b;").expect("a geometry");
    let alone = Mesher::new().levels(1).generate(&ball).expect("a mesh");
    for rank in 0..3 {
        assert!(text.contains(&format!("rank {rank} of a program has {}", alone.checksum)), "{text}");
    }
    assert_eq!(text.matches("the communicator is dropped").count(), 3, "{text}");
}

#[test]
fn a_panic_in_a_program_with_mpi_of_its_own_ends_the_job() {
    assert_a_panic_ends_the_job("own panic");
}

#[test]
fn mpi_without_threads_is_refused() {
    let Some(output) = mpirun(2, "own without threads") else { return };
    let text = text(&output);
    assert!(output.status.success(), "{text}");
    assert!(text.contains("MPI_THREAD_FUNNELED") || text.contains(": taken"), "{text}");
}

#[test]
fn a_program_without_geometry_on_rank_0_ends_on_all_ranks() {
    let Some(output) = mpirun(3, "no geometry") else { return };
    let text = text(&output);
    assert!(output.status.success(), "{text}");
    for rank in 0..3 {
        assert!(text.contains(&format!("rank {rank}: rank 0 has no geometry")), "{text}");
    }
}
