//! `tetmill quality`: comparison of meshes.

use crate::common::{own, succeed, tetmill};
use std::path::Path;

/// Two tets with a common face in Medit format, with the last vertex at a given point.
fn two_tets(folder: &Path, name: &str, last: &str) -> std::path::PathBuf {
    let path = folder.join(name);
    let text = format!(
        "MeshVersionFormatted 2\nDimension 3\nVertices 5\n0 0 0 0\n1 0 0 0\n0 1 0 0\n0 0 1 0\n{last} 0\n\
         Tetrahedra 2\n1 2 3 4 1\n2 3 4 5 1\nEnd\n"
    );
    std::fs::write(&path, text).unwrap();
    path
}

#[test]
fn one_mesh_in_several_formats_has_one_quality() {
    let dir = tempfile::tempdir().unwrap();
    let mut files = Vec::new();
    for ending in ["vtu", "msh", "mesh", "vol"] {
        let file = dir.path().join(format!("m.{ending}"));
        let mut mesh = tetmill();
        mesh.arg("mesh").arg(own("lens")).args(["--preset", "very-coarse", "-q", "-o"]).arg(&file);
        succeed(&mut mesh);
        files.push(file);
    }
    let picture = dir.path().join("histograms.svg");
    let output = succeed(tetmill().arg("quality").args(&files).arg("--json").arg("--picture").arg(&picture));
    let json: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let meshes = json["meshes"].as_array().unwrap();
    assert_eq!(meshes.len(), 4);
    for mesh in meshes {
        assert_eq!(mesh["inverted"], 0);
        for key in ["tets", "vertices", "boundary", "smallest_dihedral_histogram", "badness_histogram"] {
            assert_eq!(mesh[key], meshes[0][key], "{key} of {}", mesh["mesh"]);
        }
        let close = |key: &str| {
            let [a, b] = [mesh, &meshes[0]].map(|m| m[key].as_f64().unwrap());
            assert!((a - b).abs() < 1e-9 * a.abs(), "{key}: {a} {b}");
        };
        ["volume", "smallest_dihedral", "median_dihedral", "mean_mean_ratio", "mean_badness"]
            .into_iter()
            .for_each(close);
    }
    let svg = std::fs::read_to_string(&picture).unwrap();
    assert!(svg.starts_with("<svg") && svg.contains("m.vol"));
    let text = String::from_utf8(succeed(tetmill().arg("quality").args(&files)).stdout).unwrap();
    assert!(text.contains("m.vtu") && text.contains("turned round"), "{text}");
}

#[test]
fn inverted_tets_are_a_fault_with_status_1() {
    let dir = tempfile::tempdir().unwrap();
    let good = two_tets(dir.path(), "good.mesh", "1 1 1");
    let folded = two_tets(dir.path(), "folded.mesh", "0.1 0.1 0.1");
    let output = tetmill().arg("quality").args([&good, &folded]).output().unwrap();
    let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(1), "{stderr}");
    assert!(stderr.contains("1 inverted tet in") && stderr.contains("folded.mesh"), "{stderr}");
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    let inverted = text.lines().find(|line| line.starts_with("inverted tets")).unwrap();
    assert_eq!(inverted.split_whitespace().collect::<Vec<_>>(), ["inverted", "tets", "0", "1"]);
}

#[test]
fn an_unreadable_mesh_has_status_2_and_the_others_are_shown() {
    let dir = tempfile::tempdir().unwrap();
    let good = two_tets(dir.path(), "good.mesh", "1 1 1");
    let output = tetmill().arg("quality").arg(&good).arg("no/such.vtu").output().unwrap();
    assert_eq!(output.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&output.stderr).contains("no/such.vtu"));
    assert!(String::from_utf8_lossy(&output.stdout).contains("good.mesh"));
    let output = tetmill().arg("quality").arg(&good).args(["--picture", "x.bmp"]).output().unwrap();
    assert_eq!(output.status.code(), Some(2));
}
