//! The command line: errors, and the output of successful runs.

use crate::common::{own, read_json, succeed, tetmill};
use std::path::Path;
use std::process::Output;

/// Runs `generate` on a text; returns the output and the standard error.
fn generate_text(text: &str, arguments: &[&str]) -> (Output, String) {
    let dir = tempfile::tempdir().unwrap();
    let geometry = dir.path().join("input.geo");
    std::fs::write(&geometry, text).unwrap();
    let out = dir.path().join("out");
    let output =
        tetmill().arg("generate").arg(&geometry).arg("-o").arg(&out).args(arguments).output().unwrap();
    let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
    if !output.status.success() {
        assert!(!out.exists(), "a failed run left {}", out.display());
    }
    (output, stderr)
}

#[track_caller]
fn refused(text: &str, place: &str, reason: &str) {
    let (output, stderr) = generate_text(text, &[]);
    assert_eq!(output.status.code(), Some(2), "{stderr}");
    assert!(stderr.contains(&format!("input.geo{place}")), "no place {place} in: {stderr}");
    assert!(stderr.contains(reason), "no `{reason}` in: {stderr}");
    assert!(!stderr.contains("panicked"), "{stderr}");
}

#[test]
fn broken_files_are_refused_with_their_place() {
    refused("", ":1:1", "algebraic3d");
    refused("solid a = sphere (0,0,0; 1);", ":1:1", "algebraic3d");
    refused("algebraic3d\nsolid a = sphere (0,0,0 1);\ntlo a;", ":2:", "");
    refused("algebraic3d\nsolid a = sphere (0,0,0; -1);\ntlo a;", ":2:", "radius");
    refused("algebraic3d\nsolid a = sphere (0,0,0; 1)\ntlo a;", ":2:28", "");
    refused("algebraic3d\nsolid a = sphere (0,0,0; 1);\ntlo b;", ":3:5", "`b`");
    refused("algebraic3d\nsolid a = spere (0,0,0; 1);\ntlo a;", ":2:", "spere");
    refused("algebraic3d\nsolid a = sphere (0,0,0; 1e);\ntlo a;", ":2:", "");
    refused("algebraic3d\nsolid a = sphere (0,0,0; 1) ? ;\ntlo a;", ":2:", "");
    refused("algebraic3d\nsolid a = plane (0,0,0; 0,0,0);\ntlo a;", ":2:", "normal");
    refused("algebraic3d\nsolid a = sphere (0,0,0; 1);\n", "", "tlo");
    refused("algebraic3d\nsolid a = revolution (0,0,0; 1,0,0; c);\ntlo a;", ":2:", "c");
}

#[test]
fn geometries_that_cannot_be_meshed_are_refused_with_their_place() {
    refused("algebraic3d\nsolid a = plane (0,0,0; 0,0,1);\ntlo a;", "", "a");
    let shell = "algebraic3d\nsolid a = sphere (0,0,0; 1) and not sphere (0,0,0.0005; 0.9995);\ntlo a;";
    refused(shell, "", "without an angle");
}

#[test]
fn a_missing_file_is_bad_input() {
    let output = tetmill().args(["generate", "no/such/file.geo"]).output().unwrap();
    assert_eq!(output.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&output.stderr).contains("no/such/file.geo"));
}

const BALL: &str = "algebraic3d\nsolid a = sphere (0,0,0; 1);\ntlo a;";

#[test]
fn more_parts_than_tets_are_refused_with_both_numbers() {
    let (output, stderr) = generate_text(BALL, &["--preset", "very-coarse", "-n", "3000"]);
    assert_eq!(output.status.code(), Some(2), "{stderr}");
    assert!(stderr.contains("3000 parts"), "{stderr}");
}

#[test]
fn a_least_size_above_the_largest_is_refused_with_the_options() {
    let (output, stderr) = generate_text(BALL, &["--minh", "2", "--maxh", "1", "-f", "none"]);
    assert_eq!(output.status.code(), Some(2), "{stderr}");
    assert!(stderr.contains("`min_size` cannot be 2: possible are 0 to max_size, which is 1"), "{stderr}");
    assert!(stderr.contains("--minh and --maxh"), "{stderr}");
}

#[test]
fn a_mesh_beyond_the_memory_is_refused_before_it_is_made() {
    // 163 tets with 512 subdivisions an edge: 89 GB of coordinates, of which 1 GB on boundaries and
    // interfaces of coarse tets.
    let arguments = ["--preset", "moderate", "--levels", "9", "-f", "none", "--memory", "1e8"];
    let (output, stderr) = generate_text(BALL, &arguments);
    assert_eq!(output.status.code(), Some(4), "{stderr}");
    assert!(stderr.contains("this machine has 100.0 MB left"), "{stderr}");
}

#[test]
fn more_tets_than_elmer_numbers_are_refused_before_they_are_made() {
    let (output, stderr) = generate_text(BALL, &["--preset", "moderate", "--levels", "9", "-f", "elmer"]);
    assert_eq!(output.status.code(), Some(4), "{stderr}");
    assert!(stderr.contains("2147483647"), "{stderr}");
}

#[test]
fn a_mesh_with_little_memory_is_the_same() {
    let checksum = |memory: &str| {
        let report = crate::common::report_of(
            &own("dome"),
            &["--levels", "4", "--preset", "very-coarse", "--memory", memory],
        );
        report["mesh"]["checksum"].as_str().unwrap().to_string()
    };
    assert_eq!(checksum("6e6"), checksum("1e10"));
}

#[test]
fn a_wanted_number_in_all_is_reached_within_three_tenths_more() {
    for (name, wanted) in [("nozzle", 6_000), ("bracket", 50_000), ("dome", 170_000), ("dome", 1_500_000)] {
        let report = crate::common::report_of(&own(name), &["-e", &wanted.to_string(), "-n", "2"]);
        let tets = report["mesh"]["tets"].as_u64().unwrap();
        assert!((wanted..=wanted + 3 * wanted / 10).contains(&tets), "{name}: {wanted} wanted, {tets} made");
        assert_eq!(report["wanted"], "reached");
    }
}

#[test]
fn the_quality_of_a_level_is_that_of_a_mesh_with_as_many_levels() {
    let at = |pieces: &str| crate::common::report_of(&own("nozzle"), &["--pieces", pieces]);
    let (six, twelve) = (at("6"), at("12"));
    assert_eq!(six["coarse"]["tets"], twelve["coarse"]["tets"]);
    let levels = twelve["quality_by_level"].as_array().unwrap();
    let pieces: Vec<u64> = levels.iter().map(|level| level["pieces"].as_u64().unwrap()).collect();
    assert_eq!(pieces, [1, 3, 6, 12]);
    assert_eq!(levels[2], six["quality_by_level"][2]);
    assert_eq!(levels[3]["smallest_dihedral"], twelve["mesh"]["smallest_dihedral"]);
}

#[test]
fn only_meshes_that_are_refined_or_curved_are_prepared_for_it() {
    let repaired = |options: &[&str]| {
        crate::common::report_of(&own("crankshaft"), options)["coarse"]["illegal_repaired"].as_u64().unwrap()
    };
    assert_eq!(repaired(&["--levels", "0"]), 0);
    assert!(repaired(&["--levels", "1"]) > 0 && repaired(&["--levels", "0", "--order", "2"]) > 0);
}

#[test]
fn four_levels_keep_six_tenths_of_the_smallest_angle() {
    for name in ["dome", "capsule", "lens", "ice_cream"] {
        let report = crate::common::report_of(&own(name), &["--preset", "coarse", "--levels", "4"]);
        let angle = |level: usize| report["quality_by_level"][level]["smallest_dihedral"].as_f64().unwrap();
        assert!(angle(4) >= 0.6 * angle(0), "{name}: {}° of {}°", angle(4), angle(0));
    }
}

#[test]
fn a_wanted_number_of_tets_is_reached_within_half_more() {
    for (name, wanted) in [("nozzle", 4000), ("bracket", 8000), ("dome", 3000)] {
        let report = crate::common::report_of(&own(name), &["--coarse", &wanted.to_string()]);
        let tets = report["coarse"]["tets"].as_u64().unwrap();
        assert!((wanted..=wanted + wanted / 2).contains(&tets), "{name}: {wanted} wanted, {tets} made");
    }
}

#[test]
fn too_few_tets_for_a_geometry_are_reported() {
    let output =
        succeed(tetmill().arg("generate").arg(own("bracket")).args(["--coarse", "10", "-f", "none"]));
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(stderr.contains("the least"), "{stderr}");
}

#[test]
fn every_format_is_written_and_the_report_counts_it() {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("lens");
    let report = dir.path().join("lens.json");
    let picture = dir.path().join("lens.png");
    let mut command = tetmill();
    command.arg("generate").arg(own("lens")).args(["-n", "2", "-f", "elmer,vtu,geomview", "--check", "-o"]);
    command.arg(&out).arg("--report").arg(&report).arg("--picture").arg(&picture);
    let output = succeed(&mut command);
    assert!(String::from_utf8_lossy(&output.stdout).contains("every tet positive"));
    for file in ["partitioning.2/part.1.nodes", "partitioning.2/part.2.shared", "mesh.names", "lens.pvtu"] {
        assert!(out.join(file).is_file(), "no {file}");
    }
    assert!(std::fs::read(&picture).unwrap().starts_with(b"\x89PNG"));
    let report = read_json(&report);
    assert!(report["bytes"].as_u64().unwrap() > 10_000, "{report}");
    assert_eq!(report["partition"]["parts"], 2);
}

#[test]
fn one_part_is_also_a_plain_elmer_mesh() {
    let dir = tempfile::tempdir().unwrap();
    succeed(tetmill().arg("generate").arg(own("lens")).arg("-q").arg("-o").arg(dir.path().join("lens")));
    for file in ["mesh.header", "mesh.nodes", "mesh.elements", "mesh.boundary", "mesh.names"] {
        assert!(dir.path().join("lens").join(file).is_file(), "no {file}");
    }
}

#[test]
fn a_coarse_mesh_goes_to_one_file() {
    let dir = tempfile::tempdir().unwrap();
    for (ending, start) in
        [("vtu", "<"), ("msh", "$MeshFormat"), ("mesh", "MeshVersionFormatted"), ("vol", "mesh3d")]
    {
        let file = dir.path().join("lens").with_extension(ending);
        succeed(tetmill().arg("mesh").arg(own("lens")).args(["--preset", "coarse", "-q", "-o"]).arg(&file));
        assert!(std::fs::read(&file).unwrap().starts_with(start.as_bytes()), "{ending}");
    }
    let output = tetmill().arg("mesh").arg(own("lens")).args(["-o", "lens.xyz"]).output().unwrap();
    assert_eq!(output.status.code(), Some(2));
}

#[test]
fn check_finds_a_broken_file_and_says_so_by_its_status() {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("lens");
    succeed(tetmill().arg("generate").arg(own("lens")).args(["-n", "2", "-q", "-o"]).arg(&out));
    succeed(tetmill().arg("check").arg(&out));
    swap_two_nodes_of_an_element(&out.join("partitioning.2/part.1.elements"));
    let output = tetmill().arg("check").arg(&out).output().unwrap();
    assert_eq!(output.status.code(), Some(1), "{}", String::from_utf8_lossy(&output.stdout));
    let output = tetmill().arg("check").arg(dir.path().join("nowhere")).output().unwrap();
    assert_eq!(output.status.code(), Some(2));
}

fn swap_two_nodes_of_an_element(file: &Path) {
    let text = std::fs::read_to_string(file).unwrap();
    let (first, rest) = text.split_once('\n').unwrap();
    let mut words: Vec<&str> = first.split_whitespace().collect();
    let last = words.len() - 1;
    words.swap(last, last - 1);
    std::fs::write(file, format!("{}\n{rest}", words.join(" "))).unwrap();
}

#[test]
fn inspect_names_what_a_geometry_consists_of() {
    let output = succeed(tetmill().arg("inspect").arg(own("fibres")));
    let text = String::from_utf8_lossy(&output.stdout);
    for word in ["4 bodies", "carbon", "epoxy", "cylinder of fibre1", "8 corners"] {
        assert!(text.contains(word), "no `{word}` in\n{text}");
    }
    let output = succeed(tetmill().arg("inspect").arg(own("fibres")).arg("--json"));
    let json: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(json["bodies"].as_array().unwrap().len(), 4);
}

#[test]
fn a_mesh_size_file_makes_the_mesh_finer_there_and_is_refused_with_its_line() {
    let dir = tempfile::tempdir().unwrap();
    let (sizes, report) = (dir.path().join("sizes.txt"), dir.path().join("report.json"));
    let tets = |text: &str| {
        std::fs::write(&sizes, text).unwrap();
        let mut command = tetmill();
        command.arg("generate").arg(own("sheared_cell")).args(["-f", "none", "-q", "--preset", "coarse"]);
        command.arg("--mesh-size-file").arg(&sizes).arg("--report").arg(&report);
        succeed(&mut command);
        read_json(&report)["coarse"]["tets"].as_u64().unwrap()
    };
    assert!(tets("0\n1\n0.2 0 0  0.2 0 0.8  0.02\n") > 2 * tets("0\n"));
    std::fs::write(&sizes, "1\n0 0 0 -1\n").unwrap();
    let output = tetmill()
        .arg("mesh")
        .arg(own("sheared_cell"))
        .arg("-o")
        .arg(dir.path().join("m.vtu"))
        .arg("--mesh-size-file")
        .arg(&sizes)
        .output()
        .unwrap();
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{stderr}");
    assert!(stderr.contains("sizes.txt:2: the size -1 is not positive"), "{stderr}");
}

#[test]
fn inspect_shows_what_is_periodic_cut_out_and_singular() {
    let text =
        |name: &str| String::from_utf8(succeed(tetmill().arg("inspect").arg(own(name))).stdout).unwrap();
    assert!(text("rotor_sector").contains("1  1 to 2, turned, then moved by (0, 0, 0)"));
    let plate = text("heated_plate");
    for line in ["11  heater", "cut out by round", "curve 7, factor 2", "patch 11, factor 1"] {
        assert!(plate.contains(line), "{line} in {plate}");
    }
}

#[test]
fn a_reader_that_stops_reading_is_no_error() {
    let mut command = tetmill();
    command.arg("inspect").arg(own("gear")).stdout(std::process::Stdio::piped());
    let mut child = command.stderr(std::process::Stdio::piped()).spawn().unwrap();
    drop(child.stdout.take());
    let output = child.wait_with_output().unwrap();
    let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success() && stderr.is_empty(), "{stderr}");
}
