//! `generate -m decompose` and `tetmill decompose`: geometries cut by planes.

use crate::common::{OWN_IN_PARTS, judged_report, own, report_of, succeed, tetmill};

/// Number of tets, smallest dihedral angle and volume of a mesh that passes both checkers.
fn made(name: &str, ranks: u32, more: &[&str]) -> [f64; 3] {
    let report = judged_report("decompose", name, ranks, more);
    ["tets", "smallest_dihedral", "volume"].map(|key| report["mesh"][key].as_f64().unwrap())
}

#[test]
fn own_geometries_are_cut_and_their_pieces_meshed() {
    for (name, ranks) in OWN_IN_PARTS.into_iter().zip([2, 3, 4, 8].into_iter().cycle()) {
        let [tets, angle, volume] = made(name, ranks, &["--pieces", "2"]);
        assert!(tets > 0.0 && angle > 0.5, "{name} on {ranks} ranks: {angle}°");
        let refined = report_of(&own(name), &["--preset", "coarse", "--pieces", "2"]);
        let expected = refined["mesh"]["volume"].as_f64().unwrap();
        assert!((volume / expected - 1.0).abs() < 0.03, "{name}: {volume}, refined {expected}");
    }
}

#[test]
fn a_cut_geometry_is_a_geometry_that_meshes_to_the_same_volume() {
    let dir = tempfile::tempdir().unwrap();
    let cut = dir.path().join("cut.geo");
    let mut command = tetmill();
    command.arg("decompose").arg(own("layers")).args(["-q", "-n", "3", "-o"]).arg(&cut);
    succeed(&mut command);
    let [whole, pieces] = [own("layers"), cut].map(|file| report_of(&file, &["--preset", "coarse"]));
    let volume = |report: &serde_json::Value| report["mesh"]["volume"].as_f64().unwrap();
    assert!((volume(&whole) / volume(&pieces) - 1.0).abs() < 1e-12);
    assert!(pieces["entities"]["bodies"].as_u64().unwrap() > whole["entities"]["bodies"].as_u64().unwrap());
}

#[test]
fn planes_come_from_a_file_or_its_faults_are_located() {
    let dir = tempfile::tempdir().unwrap();
    let file = dir.path().join("planes.txt");
    let run = |text: &str| {
        std::fs::write(&file, text).unwrap();
        let mut command = tetmill();
        command.arg("generate").arg(own("layers")).args([
            "-m",
            "decompose",
            "-n",
            "2",
            "-f",
            "none",
            "--planes-from",
        ]);
        let output = command.arg(&file).output().unwrap();
        (output.status.code(), String::from_utf8_lossy(&output.stderr).into_owned())
    };
    for (text, expected) in [
        ("# none\n\n", "there is no plane"),
        ("0 0 0 1 0 0\n0 0 zero 1 0 0", "planes.txt:2: these are not six numbers"),
        ("0 0 0 0 0 0", "planes.txt:1: the normal has no direction"),
        ("1e6 0 0 1 0 0", "1 pieces, for 2 parts"),
    ] {
        let (status, stderr) = run(text);
        assert_eq!(status, Some(2), "{text}: {stderr}");
        assert!(stderr.contains(expected), "{text}: {stderr}");
    }
}

#[test]
fn triangles_are_not_cut() {
    let dir = tempfile::tempdir().unwrap();
    let surface = dir.path().join("surface.off");
    let tet = "OFF\n4 4 0\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 1 2 3\n3 0 3 2\n";
    std::fs::write(&surface, tet).unwrap();
    let output =
        tetmill().arg("generate").arg(&surface).args(["-m", "decompose", "-f", "none"]).output().unwrap();
    assert_eq!(output.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&output.stderr).contains("only geometries (.geo) can be cut"));
}
