//! The communicator's conformance suite under `mpirun`: this test program starts itself as the ranks.
//!
//! Skipped, aloud, in a build without the feature `mpi` and where there is no `mpirun`.

use csg::{BodyId, PatchId};
use std::process::{Command, Output};
use tetmill::Point;
use tetmill::check::checksum_of_all;
use tetmill::comm::Communicator;
use tetmill::dist::DistMesh;
use tetmill::mesh::{BoundaryTriangle, Class, Mesh, VertexId};
use tetmill::migrate::BareStream;

/// Which of the bodies below a rank is to run.
const BODY: &str = "TETMILL_TEST_BODY";

/// Bytes in a chunk: so few that the suite's messages need many.
const SMALL_CHUNK: usize = 1000;

/// Runs `body` of [`as_a_rank`] on `ranks` processes, or tells why it cannot.
fn mpirun(ranks: u32, body: &str) -> Option<Output> {
    if !cfg!(feature = "mpi") {
        eprintln!("skipped: built without the feature `mpi`");
        return None;
    }
    let program = std::env::current_exe().expect("a test program knows its path");
    // The name that the harness gives to the test: the path of this module within its program.
    let module = module_path!().split_once("::").map(|(_, path)| format!("{path}::")).unwrap_or_default();
    let result = Command::new("mpirun")
        .args(["-n", &ranks.to_string()])
        .arg(program)
        .args([&format!("{module}as_a_rank"), "--exact", "--ignored", "--nocapture", "--test-threads=1"])
        .env(BODY, body)
        // Open MPI refuses to run as root and on fewer cores than ranks unless told otherwise.
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
    tetmill::comm::mpi::run_with_chunks(SMALL_CHUNK, |comm| run_body(&body, comm)).unwrap();
    #[cfg(not(feature = "mpi"))]
    tetmill::comm::mpi::run(|comm| run_body(&body, comm)).unwrap();
}

fn run_body(body: &str, comm: &dyn Communicator) {
    assert!(tetmill::comm::mpi::launched() || comm.size() == 1);
    match body {
        "conformance" => {
            tetmill::comm::conformance::conformance(comm);
            let ranks = comm.all_gather_one(comm.rank()).unwrap();
            if comm.rank() == 0 {
                println!("{} ranks with chunks of {SMALL_CHUNK} bytes conform", ranks.len());
            }
        }
        "distribute" => {
            let given = (comm.rank() == 0).then(|| (fan(40), (0..40).map(|tet| tet % comm.size()).collect()));
            let part = tetmill::dist::distribute(comm, given).unwrap();
            part.check(comm).unwrap();
            println!("rank {} has {} of {} tets", comm.rank(), part.tets.len(), part.totals.tets);
        }
        "migrate" => {
            let ranks = comm.size();
            let given = (comm.rank() == 0).then(|| (fan(40), (0..40).map(|tet| tet % ranks).collect()));
            let start = tetmill::dist::distribute(comm, given).unwrap();
            let sum = |mesh: &DistMesh| checksum_of_all(comm, &BareStream::new(mesh.clone().into())).unwrap();
            // In stretches, all on the last rank, and back.
            let plans: [fn(u64, u32) -> u32; 3] =
                [|tet, ranks| tet as u32 * ranks / 40, |_, ranks| ranks - 1, |tet, ranks| tet as u32 % ranks];
            let mut mesh = start.clone();
            for plan in plans {
                let to: Vec<u32> = mesh.tet_ids.iter().map(|&tet| plan(tet, ranks)).collect();
                mesh = tetmill::migrate::migrate(comm, mesh, &to).unwrap();
                mesh.check(comm).unwrap();
                assert_eq!(sum(&mesh), sum(&start));
            }
            assert!(mesh == start);
            println!("rank {} has its tets back", comm.rank());
        }
        "panic" => {
            assert_ne!(comm.rank(), 1, "this rank fails on purpose");
            comm.barrier().unwrap();
            println!("the barrier was passed");
        }
        other => panic!("there is no body {other}"),
    }
}

/// Tets around one edge, half a turn, all on one patch.
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

#[test]
fn a_rank_that_panics_ends_the_job_with_its_message() {
    let Some(output) = mpirun(3, "panic") else { return };
    let text = text(&output);
    assert!(!output.status.success(), "{text}");
    assert!(text.contains("this rank fails on purpose"), "{text}");
    assert!(text.contains("rank 1 panicked: the job ends"), "{text}");
    assert!(!text.contains("the barrier was passed"), "{text}");
}
