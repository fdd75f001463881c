//! The program under `mpirun`.

#[cfg(feature = "mpi")]
mod with_mpi {
    use crate::common::{judge, own, python, read_json, report_of, succeed, tetmill};
    use std::process::Command;

    /// `mpirun -n RANKS tetmill`; without `mpirun` prints a message and returns `None`.
    fn mpirun(ranks: u32) -> Option<Command> {
        if Command::new("mpirun").arg("--version").output().is_err() {
            eprintln!("SKIPPED: there is no mpirun");
            return None;
        }
        let mut command = Command::new("mpirun");
        command.env("OMPI_ALLOW_RUN_AS_ROOT", "1").env("OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "1");
        command.env("OMPI_MCA_rmaps_base_oversubscribe", "1").env("RAYON_NUM_THREADS", "1");
        command.args(["-n", &ranks.to_string(), env!("CARGO_BIN_EXE_tetmill")]);
        Some(command)
    }

    #[test]
    fn mpi_ranks_write_a_partition_that_both_checkers_accept() {
        for (name, levels) in [("fibres", "1"), ("crankshaft", "1"), ("bearing", "0")] {
            let Some(mut command) = mpirun(4) else { return };
            let dir = tempfile::tempdir().unwrap();
            let out = dir.path().join("out");
            command.arg("generate").arg(own(name)).args([
                "--levels",
                levels,
                "--preset",
                "very-coarse",
                "-q",
                "-o",
            ]);
            succeed(command.arg(&out));
            judge(&out, 4);
        }
    }

    #[test]
    fn mpi_ranks_make_the_mesh_that_threads_make() {
        let arguments = ["--levels", "2", "--preset", "coarse"];
        let expected = report_of(&own("nozzle"), &arguments);
        for ranks in [1, 2, 3, 4, 7] {
            let Some(mut command) = mpirun(ranks) else { return };
            let dir = tempfile::tempdir().unwrap();
            let file = dir.path().join("report.json");
            command.arg("generate").arg(own("nozzle")).args(arguments).args(["-q", "-f", "none", "--report"]);
            succeed(command.arg(&file));
            let report = read_json(&file);
            assert_eq!(report["mesh"]["checksum"], expected["mesh"]["checksum"], "{ranks} ranks");
            assert_eq!(report["ranks"], ranks);
        }
    }

    #[test]
    fn parts_meshed_by_mpi_ranks_are_those_that_threads_mesh() {
        for method in ["surface", "decompose"] {
            let arguments = ["-m", method, "--preset", "coarse", "--pieces", "2", "--refine", "1"];
            for (ranks, parts) in [(4, 4), (2, 5)] {
                let Some(mut command) = mpirun(ranks) else { return };
                let dir = tempfile::tempdir().unwrap();
                let (out, file) = (dir.path().join("out"), dir.path().join("report.json"));
                command.arg("generate").arg(own("tee")).args(arguments).args(["--parts", &parts.to_string()]);
                succeed(command.arg("-q").arg("-o").arg(&out).arg("--report").arg(&file));
                judge(&out, parts);
                let report = read_json(&file);
                assert_eq!(report["processes"]["count"], ranks);
                let threads = report_of(&own("tee"), &[&arguments[..], &["-n", &parts.to_string()]].concat());
                assert_eq!(
                    report["mesh"]["checksum"], threads["mesh"]["checksum"],
                    "{method}, {parts} parts"
                );
            }
        }
    }

    #[test]
    fn bad_input_ends_all_ranks_with_its_status_and_one_message() {
        let Some(mut command) = mpirun(3) else { return };
        let output = command.args(["generate", "no/such/file.geo"]).output().unwrap();
        assert_eq!(output.status.code(), Some(2));
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert_eq!(stderr.matches("cannot read no/such/file.geo").count(), 1, "{stderr}");
    }

    #[test]
    fn partitions_are_repartitioned_by_mpi_ranks_as_by_threads() {
        let dir = tempfile::tempdir().unwrap();
        let [start, grown, back] = ["start", "grown", "back"].map(|name| dir.path().join(name));
        let mut command = tetmill();
        command.arg("generate").arg(own("tee")).args(["--preset", "very-coarse", "-n", "7", "-q", "-o"]);
        succeed(command.arg(&start));
        let Some(mut command) = mpirun(4) else { return };
        succeed(command.arg("repartition").arg(&start).args(["-q", "--check", "-o"]).arg(&grown));
        judge(&grown, 4);
        let same = dir.path().join("same");
        succeed(tetmill().arg("repartition").arg(&start).args(["-n", "4", "-q", "-o"]).arg(&same));
        for part in 1..=4 {
            for kind in ["header", "nodes", "elements", "boundary", "shared"] {
                let file = format!("partitioning.4/part.{part}.{kind}");
                let text = |folder: &std::path::Path| std::fs::read(folder.join(&file)).unwrap();
                assert!(text(&grown) == text(&same), "{file}");
            }
        }
        let Some(mut command) = mpirun(3) else { return };
        std::fs::write(start.join("partitioning.7/part.6.shared"), "1 2 6\n").unwrap();
        let output = command.arg("repartition").arg(&start).args(["-q", "-o"]).arg(&back).output().unwrap();
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{stderr}");
        assert_eq!(stderr.matches("part.6.shared:1").count(), 1, "{stderr}");
        assert!(!back.exists());
    }

    #[test]
    fn halos_of_mpi_ranks_are_those_of_threads() {
        let dir = tempfile::tempdir().unwrap();
        let [start, processes, threads] = ["start", "processes", "threads"].map(|name| dir.path().join(name));
        let Some(mut command) = mpirun(4) else { return };
        command.arg("generate").arg(own("tee")).args(["--preset", "very-coarse", "-q", "--check"]);
        succeed(command.args(["--halo", "vertices", "-o"]).arg(&start));
        succeed(tetmill().arg("check").arg(&start));
        let Some(mut command) = mpirun(4) else { return };
        let arguments = ["-q", "--check", "--halo", "faces", "-n", "5", "-o"];
        succeed(command.arg("repartition").arg(&start).args(arguments).arg(&processes));
        succeed(tetmill().arg("repartition").arg(&start).args(arguments).arg(&threads));
        for part in 1..=5 {
            for kind in ["header", "nodes", "elements", "boundary", "shared"] {
                let file = format!("partitioning.5/part.{part}.{kind}");
                let text = |folder: &std::path::Path| std::fs::read(folder.join(&file)).unwrap();
                assert!(text(&processes) == text(&threads), "{file}");
            }
        }
    }

    #[test]
    fn more_and_fewer_parts_than_mpi_ranks_are_those_that_as_many_ranks_make() {
        let arguments = ["--preset", "very-coarse", "--levels", "1", "-q"];
        for (ranks, parts) in [(2, "5"), (3, "2")] {
            let Some(mut command) = mpirun(ranks) else { return };
            let dir = tempfile::tempdir().unwrap();
            let [dealt, threads, moved] = ["dealt", "threads", "moved"].map(|name| dir.path().join(name));
            succeed(
                command
                    .arg("generate")
                    .arg(own("lens"))
                    .args(arguments)
                    .args(["--parts", parts, "-o"])
                    .arg(&dealt),
            );
            succeed(
                tetmill()
                    .arg("generate")
                    .arg(own("lens"))
                    .args(arguments)
                    .args(["-n", parts, "-o"])
                    .arg(&threads),
            );
            let file = format!("partitioning.{parts}/part.{parts}.elements");
            let text = |folder: &std::path::Path| std::fs::read(folder.join(&file)).unwrap();
            assert!(text(&dealt) == text(&threads), "{parts} parts on {ranks} ranks");
            judge(&dealt, parts.parse().unwrap());
            let Some(mut command) = mpirun(ranks) else { return };
            succeed(command.arg("repartition").arg(&dealt).args(["-n", "4", "-q", "-o"]).arg(&moved));
            judge(&moved, 4);
        }
        let Some(mut command) = mpirun(2) else { return };
        let output = command.args(["generate", "no/such/file.geo", "--parts", "5"]).output().unwrap();
        assert_eq!(output.status.code(), Some(2));
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert_eq!(stderr.matches("cannot read no/such/file.geo").count(), 1, "{stderr}");
    }

    #[test]
    fn serial_commands_run_once_and_all_ranks_end_with_their_status() {
        let dir = tempfile::tempdir().unwrap();
        let mesh = dir.path().join("tee.vtu");
        let part = own("tee");
        let run = |arguments: &[&std::ffi::OsStr]| Some(mpirun(3)?.args(arguments).output().unwrap());
        let Some(inspected) = run(&["inspect".as_ref(), part.as_ref()]) else { return };
        let alone = tetmill().arg("inspect").arg(&part).output().unwrap();
        assert_eq!(String::from_utf8_lossy(&inspected.stdout), String::from_utf8_lossy(&alone.stdout));
        let made = run(&["mesh".as_ref(), part.as_ref(), "-o".as_ref(), mesh.as_ref()]).unwrap();
        assert!(made.status.success(), "{}", String::from_utf8_lossy(&made.stderr));
        assert_eq!(String::from_utf8_lossy(&made.stdout).matches("checksum").count(), 1);
        assert!(mesh.exists());
        let missing = dir.path().join("missing.geo");
        for command in ["mesh", "inspect", "check", "quality"] {
            let mut arguments = vec![command.as_ref(), missing.as_ref()];
            if command == "mesh" {
                arguments.extend(["-o".as_ref(), mesh.as_os_str()]);
            }
            let refused = run(&arguments).unwrap();
            let stderr = String::from_utf8_lossy(&refused.stderr).into_owned();
            assert_eq!(refused.status.code(), Some(2), "{command}: {stderr}");
            assert_eq!(stderr.matches("tetmill: ").count(), 1, "{command}: {stderr}");
        }
    }

    /// Counts the tets of `NAME.h5`, `NAME.msh` and `NAME_1.msh`, … by programs other than ours.
    const COUNTS: &str = "
import gmsh
import h5py
import numpy as np
grid = h5py.File('dome.h5')['VTKHDF']
assert len(grid['Types']) == tets and (grid['Types'][:] == 24).all(), (len(grid['Types']), tets)
assert grid['Connectivity'].shape == (10 * tets,)
assert set(grid['CellData/PartitionId'][:]) == set(range(1, parts + 1))
gmsh.initialize()
gmsh.option.setNumber('General.Terminal', 0)
def curved(path):
    gmsh.clear()
    gmsh.open(path)
    kinds, tags, nodes = gmsh.model.mesh.getElements(3)
    assert list(kinds) == [11], kinds
    _, determinants, _ = gmsh.model.mesh.getJacobians(11, [0.25, 0.25, 0.25])
    assert len(determinants) == len(tags[0]) and (determinants > 0).all()
    return {tag: tuple(of) for tag, of in zip(tags[0], nodes[0].reshape(-1, 10))}
whole = curved('dome.msh')
assert len(whole) == tets
assert gmsh.model.getNumberOfPartitions() == (parts if parts > 1 else 0)
apart = [curved(f'dome_{part}.msh') for part in range(1, parts + 1)]
assert all(apart) and sum(map(len, apart)) == tets
assert {tag: of for part in apart for tag, of in part.items()} == whole
print('counted')
";

    #[test]
    fn mpi_ranks_write_the_curved_mesh_that_other_programs_count() {
        let arguments = ["--order", "2", "--levels", "1", "--preset", "coarse"];
        let expected = report_of(&own("dome"), &arguments);
        for ranks in [1, 3] {
            let Some(mut command) = mpirun(ranks) else { return };
            let dir = tempfile::tempdir().unwrap();
            let (out, file) = (dir.path().join("out"), dir.path().join("report.json"));
            command.arg("generate").arg(own("dome")).args(arguments).args([
                "-q",
                "-f",
                "hdf5,msh4,msh4-parts",
            ]);
            succeed(command.arg("-o").arg(&out).arg("--report").arg(&file));
            let report = read_json(&file);
            assert_eq!(report["mesh"]["checksum"], expected["mesh"]["checksum"], "{ranks} ranks");
            assert_eq!((&report["order"], &report["ranks"]), (&2.into(), &ranks.into()));
            // Our own reader counts too, where the modules are missing.
            let files: Vec<_> = (1..=ranks).map(|part| out.join(format!("dome_{part}.msh"))).collect();
            let output =
                succeed(tetmill().args(["quality", "--json"]).arg(out.join("dome.msh")).args(&files));
            let read: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
            let [whole, parts @ ..] = &read["meshes"].as_array().unwrap()[..] else { panic!("{read}") };
            let tets = |mesh: &serde_json::Value| mesh["tets"].as_u64().unwrap();
            assert_eq!((&whole["order"], &whole["not_valid"]), (&2.into(), &0.into()));
            assert_eq!(tets(whole), tets(&report["mesh"]));
            assert_eq!(parts.iter().map(tets).sum::<u64>(), tets(whole), "{ranks} ranks");
            let program = format!("tets, parts = {}, {ranks}\n{COUNTS}", tets(whole));
            python(&["h5py", "gmsh", "numpy"], &program, &out);
        }
    }

    #[test]
    fn a_number_of_ranks_that_contradicts_mpirun_is_refused() {
        let Some(mut command) = mpirun(2) else { return };
        let output =
            command.arg("generate").arg(own("lens")).args(["-n", "3", "-f", "none"]).output().unwrap();
        assert_eq!(output.status.code(), Some(2));
    }
}

#[cfg(not(feature = "mpi"))]
mod without_mpi {
    use crate::common::{own, tetmill};

    #[test]
    fn a_program_without_mpi_refuses_to_be_one_of_many_ranks() {
        let mut command = tetmill();
        command.arg("generate").arg(own("lens")).args(["-f", "none"]).env("OMPI_COMM_WORLD_SIZE", "4");
        let output = command.output().unwrap();
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{stderr}");
        assert!(stderr.contains("--features mpi"), "{stderr}");
    }
}
