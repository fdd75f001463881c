//! `generate -m surface`: parts meshed inside their refined surfaces.

use crate::common::{OWN_IN_PARTS, judged_report, own, report_of, tetmill};
use std::path::Path;

/// Smallest dihedral angle, that of the coarse mesh, and volume of a mesh that passes both
/// checkers.
fn made(name: &str, ranks: u32, pieces: u32) -> [f64; 3] {
    let report = judged_report("surface", name, ranks, &["--pieces", &pieces.to_string()]);
    for key in ["skins", "kept"] {
        assert_eq!(report["skins"][key], 0, "{name}: {}", report["skins"]);
    }
    let [angle, volume] = ["smallest_dihedral", "volume"].map(|key| report["mesh"][key].as_f64().unwrap());
    [angle, report["coarse"]["quality"]["smallest_dihedral"].as_f64().unwrap(), volume]
}

#[test]
fn parts_of_own_geometries_are_meshed_inside_their_skins() {
    for (name, ranks) in OWN_IN_PARTS.into_iter().zip([2, 3, 4, 8, 16, 32].into_iter().cycle()) {
        let [angle, coarse, volume] = made(name, ranks, 2);
        assert!(angle > f64::min(20.0, 0.9 * coarse), "{name} on {ranks} ranks: {angle}°, coarse {coarse}°");
        assert_as_accurate(&own(name), volume);
    }
}

/// Remeshed boundaries are as accurate as those of the refined coarse mesh, exact if these are.
fn assert_as_accurate(geometry: &Path, volume: f64) {
    let refined = |pieces: &str| {
        let report = report_of(geometry, &["--preset", "coarse", "--pieces", pieces]);
        report["mesh"]["volume"].as_f64().unwrap()
    };
    let [coarse, fine] = ["2", "6"].map(refined);
    let most = 2.0 * (coarse - fine).abs() + 1e-12 * fine;
    assert!((volume - fine).abs() < most, "{geometry:?}: {volume}, refined {coarse} and {fine}");
}

#[test]
fn many_pieces_on_few_and_on_many_ranks_fill_the_same_volume() {
    let [few, many] = [1, 24].map(|ranks| made("nozzle", ranks, 5)[2]);
    assert!((few / many - 1.0).abs() < 1e-4, "{few} {many}");
}

#[test]
fn triangles_of_others_are_meshed_in_parts() {
    let Some(file) = crate::common::shared("netgen-tutorials/part1.stl") else { return };
    let filled = report_of(&file, &["--preset", "coarse", "--pieces", "2", "-m", "surface", "-n", "4"]);
    assert_eq!((&filled["skins"]["skins"], &filled["skins"]["kept"]), (&0.into(), &0.into()));
    assert_as_accurate(&file, filled["mesh"]["volume"].as_f64().unwrap());
    assert!(filled["mesh"]["smallest_dihedral"].as_f64().unwrap() > 20.0);
}

#[test]
fn parts_that_were_filled_are_refined_onto_the_geometry() {
    for (method, ranks) in [("surface", 3), ("decompose", 4)] {
        let report = judged_report(method, "pipe_bend", ranks, &["--pieces", "2", "--refine", "2"]);
        let levels = report["quality_by_level"].as_array().unwrap();
        let tets: Vec<u64> = levels.iter().map(|level| level["tets"].as_u64().unwrap()).collect();
        assert_eq!(tets, [tets[0], 8 * tets[0], 64 * tets[0]], "{method}");
        assert_eq!(report["mesh"]["tets"], tets[2]);
        // A bend with an elbow of a quarter torus; flat triangles would lose volume by the square.
        let level = |k: &str| report_of(&own("pipe_bend"), &["--preset", "coarse", "--levels", k]);
        let [coarse, fine] = ["1", "3"].map(|k| level(k)["mesh"]["volume"].as_f64().unwrap());
        let volume = report["mesh"]["volume"].as_f64().unwrap();
        assert!((volume - fine).abs() < 0.1 * (fine - coarse).abs(), "{method}: {coarse} {fine} {volume}");
        let sizes = |key: &str| report["delivered"][key].as_f64().unwrap();
        assert!((0.7..1.3).contains(&sizes("mean")), "{method}: {}", report["delivered"]);
        assert!(sizes("low") < sizes("mean") && sizes("mean") < sizes("high"));
    }
}

#[test]
fn a_requested_number_counts_the_tets_after_all_refinement() {
    for (method, more) in [("surface", "0"), ("surface", "1"), ("decompose", "0"), ("decompose", "2")] {
        let arguments = ["-m", method, "-e", "200000", "-n", "4", "--refine", more];
        let tets = report_of(&own("tee"), &arguments)["mesh"]["tets"].as_u64().unwrap();
        assert!((200_000..=260_000).contains(&tets), "{method}, {more}: {tets}");
    }
}

#[test]
fn the_method_refine_has_levels_instead() {
    let output = tetmill().arg("generate").arg(own("tee")).args(["--refine", "1"]).output().unwrap();
    assert_eq!(output.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&output.stderr).contains("`refine` cannot be 1"));
}

#[test]
fn periodic_faces_are_kept_by_surface_and_decompose() {
    for method in ["surface", "decompose"] {
        let report = report_of(&own("unit_cell"), &["-m", method, "-n", "2", "--refine", "1"]);
        assert_eq!(report["periodic"]["lost"], 0);
        assert!(report["periodic"]["pairs"].as_u64().unwrap() > 100, "{}", report["periodic"]);
    }
    // In three directions every plane separates faces from their copies, which Elmer cannot use.
    let dir = tempfile::tempdir().unwrap();
    let refused = |more: &[&str]| {
        let mut command = tetmill();
        command.arg("generate").arg(own("unit_cell")).args([
            "-m",
            "decompose",
            "-n",
            "2",
            "-f",
            "elmer",
            "-o",
        ]);
        let output = command.arg(dir.path().join("cell")).args(more).output().unwrap();
        (output.status.code(), String::from_utf8_lossy(&output.stderr).into_owned())
    };
    let (status, said) = refused(&[]);
    assert_eq!(status, Some(2), "{said}");
    assert!(said.contains("which Elmer needs") && said.contains("--allow-split-periodic"), "{said}");
    assert_eq!(refused(&["--allow-split-periodic"]).0, Some(0));
}
