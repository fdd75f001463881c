//! `tetmill repartition`: changes the parts on disk but not the mesh.

use crate::common::{judge, own, read_json, succeed, tetmill};
use std::path::Path;
use std::process::Output;

/// Writes a geometry with several bodies in this number of parts.
fn generate(dir: &Path, parts: &str) {
    let mut command = tetmill();
    command.arg("generate").arg(own("tee")).args([
        "--preset",
        "very-coarse",
        "--levels",
        "0",
        "-q",
        "-n",
        parts,
    ]);
    succeed(command.arg("-o").arg(dir));
}

/// `tetmill repartition FROM -n PARTS -o TO ARGUMENTS`
fn repartition(from: &Path, parts: &str, to: &Path, arguments: &[&str]) -> Output {
    tetmill().arg("repartition").arg(from).args(["-n", parts, "-o"]).arg(to).args(arguments).output().unwrap()
}

/// The sorted lines of one kind of file of a partition, without ids, which differ between
/// partitions.
///
/// Of an element only the body remains, of a boundary element the number, of a node the
/// coordinates.
fn content(dir: &Path, parts: u32, kind: &str) -> Vec<String> {
    let mut lines: Vec<String> = (1..=parts)
        .flat_map(|part| {
            let file = dir.join(format!("partitioning.{parts}/part.{part}.{kind}"));
            let text = std::fs::read_to_string(file).unwrap();
            let kept = |line: &str| match kind {
                "nodes" => line.split_once(' ').unwrap().1.to_string(),
                _ => line.split(' ').nth(1).unwrap().to_string(),
            };
            text.lines().map(kept).collect::<Vec<_>>()
        })
        .collect();
    lines.sort();
    if kind == "nodes" {
        lines.dedup();
    }
    lines
}

#[test]
fn partitions_become_others_and_both_checkers_accept_them() {
    let dir = tempfile::tempdir().unwrap();
    let [start, grown, shrunk, report] = ["start", "grown", "shrunk", "r.json"].map(|n| dir.path().join(n));
    generate(&start, "3");
    let arguments = ["-q", "--check", "--report", report.to_str().unwrap()];
    assert!(repartition(&start, "8", &grown, &arguments).status.success());
    judge(&grown, 8);
    let summary = read_json(&report);
    assert_eq!([&summary["before"]["parts"], &summary["after"]["parts"]], [3, 8]);
    assert!(summary["after"]["imbalance"].as_f64().unwrap() < 1.05, "{summary}");
    assert!(summary["after"]["shared_vertices"].as_u64() > summary["before"]["shared_vertices"].as_u64());
    assert!(
        repartition(&grown, "2", &shrunk, &["-q", "--check", "-m", "curve", "-f", "elmer,vtu"])
            .status
            .success()
    );
    judge(&shrunk, 2);
    assert!(shrunk.join("grown.pvtu").exists());
    let before = content(&start, 3, "nodes");
    for (folder, parts) in [(&grown, 8), (&shrunk, 2)] {
        assert_eq!(content(folder, parts, "nodes"), before);
        assert_eq!(content(folder, parts, "elements"), content(&start, 3, "elements"));
        let names = |folder: &Path| std::fs::read_to_string(folder.join("mesh.names")).unwrap();
        assert_eq!(names(folder), names(&start));
    }
}

#[test]
fn what_cannot_be_read_or_parted_is_refused_and_nothing_is_written() {
    let dir = tempfile::tempdir().unwrap();
    let [start, out] = ["start", "out"].map(|name| dir.path().join(name));
    generate(&start, "3");
    let refused = |parts: &str, expected: &str| {
        let output = repartition(&start, parts, &out, &["-q"]);
        let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(2), "{stderr}");
        assert_eq!(stderr.matches(expected).count(), 1, "{stderr}");
        assert!(!stderr.contains("panicked") && !out.exists(), "{stderr}");
    };
    refused("100000", "100 000 parts");
    let file = |kind: &str| start.join(format!("partitioning.3/part.3.{kind}"));
    let text = std::fs::read_to_string(file("elements")).unwrap();
    std::fs::write(file("elements"), text.replacen(" 504 ", " 508 ", 1)).unwrap();
    refused("4", "part.3.elements:1: ");
    std::fs::write(file("elements"), text).unwrap();
    std::fs::remove_file(file("nodes")).unwrap();
    refused("2", "part.3.nodes");
    std::fs::remove_file(file("header")).unwrap();
    refused("2", "part.3.header");
    std::fs::remove_dir_all(&start).unwrap();
    refused("2", "start");
    let output = tetmill().arg("repartition").arg(&start).arg("-o").arg(&out).output().unwrap();
    assert_eq!(output.status.code(), Some(2));
}

/// The number of tets that `tetmill quality` reports.
fn tets(mesh: &Path) -> u64 {
    let output = succeed(tetmill().arg("quality").arg(mesh).arg("--json"));
    let told: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    told["meshes"][0]["tets"].as_u64().unwrap()
}

#[test]
fn halos_are_written_and_checked_and_left_out_when_they_are_read() {
    let dir = tempfile::tempdir().unwrap();
    let [plain, start, moved, back, report] =
        ["plain", "start", "moved", "back", "r.json"].map(|name| dir.path().join(name));
    let arguments = ["--preset", "very-coarse", "--levels", "1", "-q", "-n", "3", "-o"];
    let generate = |to: &Path, more: &[&str]| {
        succeed(tetmill().arg("generate").arg(own("lens")).args(arguments).arg(to).args(more));
    };
    generate(&plain, &[]);
    generate(&start, &["--halo", "vertices", "--check", "-f", "elmer,vtu"]);
    succeed(tetmill().arg("check").arg(&start));
    assert_eq!(tets(&start), tets(&plain));
    let pieces: u64 = (1..=3).map(|part| tets(&start.join(format!("lens.parts/part.{part}.vtu")))).sum();
    assert_eq!(pieces, tets(&plain), "ghosts of pieces are no tets of theirs");
    let list = std::fs::read_to_string(start.join("lens.pvtu")).unwrap();
    assert!(list.contains("GhostLevel=\"1\"") && list.matches("vtkGhostType").count() == 2, "{list}");

    let report = ["--report", report.to_str().unwrap(), "-q", "--check", "--halo", "faces"];
    assert!(repartition(&start, "5", &moved, &report).status.success());
    let summary = read_json(Path::new(report[1]));
    assert_eq!(summary["halo"]["by"], "faces");
    // By faces, each cut face makes two ghosts, fewer if a tet has several cut faces.
    let (ghosts, cut) =
        (summary["halo"]["tets"].as_u64().unwrap(), summary["after"]["edge_cut"].as_u64().unwrap());
    assert!(ghosts > cut && ghosts <= 2 * cut, "{ghosts} ghosts at {cut} faces");
    assert!(summary["notes"][0].as_str().unwrap().ends_with("halo elements left out"), "{summary}");
    assert!(repartition(&moved, "2", &back, &["-q"]).status.success());
    judge(&back, 2);
    assert_eq!(content(&back, 2, "nodes"), content(&plain, 3, "nodes"));
    assert_eq!(content(&back, 2, "elements"), content(&plain, 3, "elements"));
}

#[test]
fn a_format_without_halo_refuses_one_by_name_before_any_work() {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("out");
    for command in ["generate", "repartition"] {
        let mut run = tetmill();
        run.args([command, "no/such/input", "-n", "2", "--halo", "faces", "-f", "elmer,geomview", "-o"]);
        let output = run.arg(&out).output().unwrap();
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{stderr}");
        assert!(stderr.contains("geomview has no halo elements"), "{stderr}");
        assert!(!out.exists());
    }
}
