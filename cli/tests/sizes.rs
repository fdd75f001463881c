//! Sizes and lengths that cannot be meshed, and the estimate before a long run.

use crate::common::{read_json, report_of, tetmill};
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::process::Output;

/// A cube as an OBJ or a `.geo`.
fn cube(dir: &Path, name: &str, edge: f64) -> PathBuf {
    let file = dir.join(name);
    let text = if name.ends_with(".geo") {
        format!("algebraic3d\nsolid c = orthobrick (0, 0, 0; {edge:e}, {edge:e}, {edge:e});\ntlo c;\n")
    } else {
        let mut text = String::new();
        for i in 0..8 {
            let [x, y, z] = [0, 1, 2].map(|axis| f64::from(i >> axis & 1) * edge);
            writeln!(text, "v {x:e} {y:e} {z:e}").unwrap();
        }
        text + "f 1 3 4 2\nf 5 6 8 7\nf 1 2 6 5\nf 3 7 8 4\nf 1 5 7 3\nf 2 4 8 6\n"
    };
    std::fs::write(&file, text).unwrap();
    file
}

fn mesh(geometry: &Path, options: &[&str]) -> Output {
    let mut command = tetmill();
    let out = geometry.with_extension("out.vtu");
    command.arg("mesh").arg(geometry).arg("-o").arg(out).args(options).output().unwrap()
}

fn assert_refused(output: &Output, status: i32, words: &str) {
    let text = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(status), "{text}");
    assert!(text.contains(words), "{text}");
}

#[test]
fn sizes_that_no_machine_can_mesh_are_refused_with_their_numbers() {
    let dir = tempfile::tempdir().unwrap();
    let sizes = dir.path().join("sizes.txt");
    std::fs::write(&sizes, "2\n0.5 0.5 0.5 0.1\n0.5 0.5 0.5 1e-200\n").unwrap();
    let line = dir.path().join("line.txt");
    std::fs::write(&line, "0\n1\n0 0 0 1 1 1 1e-6\n").unwrap();
    for name in ["cube.geo", "cube.obj"] {
        let unit = cube(dir.path(), name, 1.0);
        assert_refused(&mesh(&unit, &["--maxh", "1e-300"]), 2, "--maxh");
        assert_refused(&mesh(&unit, &["--maxh", "1e-9"]), 4, "4.2e27 tets or more");
        assert_refused(&mesh(&unit, &["--grading", "1e9"]), 2, "positive numbers up to 10");
        let [sizes, line] = [&sizes, &line].map(|file| file.to_str().unwrap());
        assert_refused(&mesh(&unit, &["--mesh-size-file", sizes]), 2, "sizes.txt:3: the size 1e-200");
        assert_refused(&mesh(&unit, &["--mesh-size-file", line]), 2, "line.txt:3: ");
    }
}

#[test]
fn sizes_from_a_file_that_exceed_the_memory_are_refused_before_meshing() {
    let dir = tempfile::tempdir().unwrap();
    let line = dir.path().join("line.txt");
    std::fs::write(&line, "0\n1\n0 0 0 1 1 1 3e-4\n").unwrap();
    for name in ["cube.geo", "cube.obj"] {
        let mut command = tetmill();
        command.arg("generate").arg(cube(dir.path(), name, 1.0)).arg("--mesh-size-file").arg(&line);
        let output = command.args(["-f", "none", "--memory", "1e8"]).output().unwrap();
        assert_refused(&output, 4, "the sizes make about 1.");
    }
}

#[test]
fn lengths_beyond_double_precision_are_refused() {
    let dir = tempfile::tempdir().unwrap();
    for (name, edge) in [("c.obj", 1e150), ("c.obj", 1e-150), ("c.geo", 1e-150), ("c.geo", 1e40)] {
        assert_refused(&mesh(&cube(dir.path(), name, edge), &[]), 2, "choose another unit of length");
    }
    for (name, edge) in [("c.obj", 1e-24), ("c.obj", 1e29), ("c.geo", 1e-24), ("c.geo", 1e29)] {
        let output = mesh(&cube(dir.path(), name, edge), &[]);
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    }
}

#[test]
fn more_ranks_than_threads_are_possible_are_refused_as_an_option() {
    let dir = tempfile::tempdir().unwrap();
    let mut command = tetmill();
    command.arg("generate").arg(cube(dir.path(), "c.geo", 1.0)).args(["-f", "none", "-n", "100000"]);
    assert_refused(&command.output().unwrap(), 2, "at most 8192 are possible");
}

#[test]
fn iges_files_are_refused_with_what_to_do() {
    let dir = tempfile::tempdir().unwrap();
    let file = dir.path().join("part.IGES");
    std::fs::write(&file, "").unwrap();
    assert_refused(&mesh(&file, &[]), 2, "save the part as STEP");
}

#[test]
fn the_expected_number_of_tets_is_announced() {
    let dir = tempfile::tempdir().unwrap();
    for name in ["cube.geo", "cube.obj"] {
        let output = mesh(&cube(dir.path(), name, 1.0), &["--maxh", "0.035"]);
        let [note, summary] = [&output.stderr, &output.stdout].map(|text| String::from_utf8_lossy(text));
        let after = |text: &str, word: &str| {
            let rest = text.split_once(word).unwrap_or_else(|| panic!("no {word}: {text}")).1;
            rest.split(" tets").next().unwrap().replace(' ', "").parse::<f64>().unwrap()
        };
        let [expected, made] = [after(&note, "about"), after(&summary, "coarse")];
        assert!((0.5..2.0).contains(&(expected / made)), "{name}: {expected}, {made}");
    }
}

/// A pipe of radius 10 with walls of 1 and flanges of 3, as in heat exchangers.
fn flanged_pipe(dir: &Path) -> PathBuf {
    let file = dir.join("pipe.geo");
    let text = "algebraic3d\n\
        solid ends = plane (0, 0, 0; 0, 0, -1) and plane (0, 0, 40; 0, 0, 1);\n\
        solid between = plane (0, 0, 3; 0, 0, -1) and plane (0, 0, 37; 0, 0, 1);\n\
        solid pipe = cylinder (0, 0, 0; 0, 0, 1; 16) and ends and not cylinder (0, 0, 0; 0, 0, 1; 9)\n\
        and not (between and not cylinder (0, 0, 0; 0, 0, 1; 10));\ntlo pipe;\n";
    std::fs::write(&file, text).unwrap();
    file
}

#[test]
fn a_thin_wall_has_good_angles_at_all_presets_and_coarser_ones_take_fewer_tets() {
    let dir = tempfile::tempdir().unwrap();
    let pipe = flanged_pipe(dir.path());
    let [very_coarse, coarse, moderate] = ["very-coarse", "coarse", "moderate"].map(|preset| {
        let report = report_of(&pipe, &["--preset", preset]);
        let angle = report["mesh"]["smallest_dihedral"].as_f64().unwrap();
        assert!(angle > 15.0, "{preset}: {angle}°");
        report["mesh"]["tets"].as_u64().unwrap()
    });
    let counts = format!("{very_coarse}, {coarse}, {moderate}");
    assert!(very_coarse < moderate && coarse < moderate, "{counts}");
    // The wall limits the sizes of both, so that chance decides which has more.
    assert!(10 * very_coarse <= 11 * coarse, "{counts}");
}

#[test]
fn fewer_tets_than_a_thin_wall_allows_are_reported_once_with_the_number_made() {
    let dir = tempfile::tempdir().unwrap();
    let pipe = flanged_pipe(dir.path());
    let report = dir.path().join("report.json");
    let output = mesh(&pipe, &["--coarse", "50", "--report", report.to_str().unwrap()]);
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{stderr}");
    assert_eq!(stderr.matches("50 tets requested").count(), 1, "{stderr}");
    let report = read_json(&report);
    // Scaled sizes would let the walls nearly touch, with angles of 0.3°.
    let angle = report["mesh"]["smallest_dihedral"].as_f64().unwrap();
    assert!(report["wanted"] == "least" && angle > 1.0, "{} {angle}°", report["wanted"]);
}
