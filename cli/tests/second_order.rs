//! `--order 2`: ten-node tets that are proved valid, on all ranks, in all formats.

use crate::common::{own, read_json, report_of, succeed, tetmill};
use std::fs;
use std::path::Path;
use std::process::Command;

fn number(report: &serde_json::Value, key: &str) -> f64 {
    report["mesh"][key].as_f64().unwrap_or_else(|| panic!("no {key} in {}", report["mesh"]))
}

#[test]
fn own_geometries_are_valid_in_second_order_at_each_level() {
    for name in ["tee", "gear", "vase", "fibres", "unit_cell", "twisted_bar", "spindle", "dome"] {
        for levels in ["0", "1"] {
            let report = report_of(&own(name), &["--order", "2", "--levels", levels, "--preset", "coarse"]);
            let straight = report_of(&own(name), &["--levels", levels, "--preset", "coarse"]);
            let scaled = number(&report, "scaled_jacobian");
            assert!(scaled > 0.1, "{name} at level {levels}: {scaled}");
            assert_eq!(report["mesh"]["straight_edges"].as_array().unwrap().len(), 0);
            assert_eq!((&report["order"], &straight["order"]), (&2.into(), &1.into()));
            assert!(straight["mesh"]["scaled_jacobian"].is_null());
            let by_level = report["quality_by_level"].as_array().unwrap();
            assert_eq!(by_level.last().unwrap()["scaled_jacobian"].as_f64(), Some(scaled));
        }
    }
}

#[test]
fn the_mesh_is_the_same_on_any_number_of_ranks_and_in_little_memory() {
    let of = |more: &[&str]| {
        let arguments = [&["--order", "2", "--levels", "2", "--preset", "coarse"], more].concat();
        report_of(&own("boss_fillet"), &arguments)["mesh"]["checksum"].as_str().unwrap().to_owned()
    };
    let one = of(&[]);
    assert_eq!(of(&["-n", "5"]), one);
    assert_eq!(of(&["-t", "1"]), one);
    assert_eq!(of(&["--memory", "12e6"]), one);
}

#[test]
fn separately_meshed_parts_are_curved_too() {
    let refined = number(&report_of(&own("nozzle"), &["--order", "2", "--levels", "1"]), "volume");
    for method in ["surface", "decompose"] {
        let report = report_of(&own("nozzle"), &["--order", "2", "--levels", "1", "-m", method, "-n", "4"]);
        assert!(number(&report, "scaled_jacobian") > 0.1, "{method}");
        assert!((number(&report, "volume") / refined - 1.0).abs() < 1e-4, "{method}");
    }
}

/// The rows of `quality --json` by file.
fn quality(files: &[&Path]) -> serde_json::Value {
    let output = succeed(tetmill().args(["quality", "--json"]).args(files));
    serde_json::from_slice(&output.stdout).expect("JSON")
}

#[test]
fn every_format_is_written_and_those_that_are_read_have_the_same_curved_tets() {
    for (ranks, vtu) in [("1", "dome.vtu"), ("4", "dome.pvtu")] {
        let dir = tempfile::tempdir().unwrap();
        let (out, report) = (dir.path().join("out"), dir.path().join("report.json"));
        let mut command = tetmill();
        command.arg("generate").arg(own("dome")).args(["--order", "2", "-q", "-n", ranks, "-o"]).arg(&out);
        command.args(["-f", "elmer,vtu,msh,medit,vol,inp,mfem,geomview", "--check", "--report"]).arg(&report);
        succeed(&mut command);
        let report = read_json(&report);
        succeed(tetmill().arg("check").arg(&out));
        let files = ["dome.msh", "dome.mesh", "dome.vol", vtu, ""].map(|name| out.join(name));
        let read = quality(&files.each_ref().map(|file| file.as_path()));
        for mesh in read["meshes"].as_array().unwrap() {
            assert_eq!((&mesh["order"], &mesh["not_valid"]), (&2.into(), &0.into()), "{}", mesh["mesh"]);
            let volume = mesh["volume"].as_f64().unwrap();
            assert!((volume / number(&report, "volume") - 1.0).abs() < 1e-12, "{}", mesh["mesh"]);
        }
    }
}

#[test]
fn ghosts_have_their_nodes() {
    let dir = tempfile::tempdir().unwrap();
    let mut command = tetmill();
    command.arg("generate").arg(own("dome")).args(["--order", "2", "-n", "3", "--halo", "vertices", "-q"]);
    succeed(command.args(["-f", "elmer,vtu", "-o"]).arg(dir.path()));
    succeed(tetmill().arg("check").arg(dir.path()));
    let elements = fs::read_to_string(dir.path().join("partitioning.3/part.1.elements")).unwrap();
    let halo = elements.lines().find(|line| line.contains('/')).expect("a halo element");
    assert_eq!(halo.split(' ').count(), 3 + 10, "{halo}");
}

#[test]
fn parts_of_second_order_are_repartitioned_unchanged() {
    let dir = tempfile::tempdir().unwrap();
    let [from, to, report] = ["from", "to", "report.json"].map(|name| dir.path().join(name));
    let mut command = tetmill();
    succeed(
        command.arg("generate").arg(own("dome")).args(["--order", "2", "-n", "3", "-q", "-o"]).arg(&from),
    );
    let mut command = tetmill();
    command
        .arg("repartition")
        .arg(&from)
        .args(["-n", "5", "-q", "--halo", "faces", "--check", "-o"])
        .arg(&to);
    succeed(command.arg("--report").arg(&report));
    succeed(tetmill().arg("check").arg(&to));
    let read = quality(&[&from, &to]);
    let [before, after] = [&read["meshes"][0], &read["meshes"][1]];
    for key in ["tets", "vertices", "order", "not_valid"] {
        assert_eq!(before[key], after[key], "{key}");
    }
    for key in ["volume", "scaled_jacobian"] {
        let [before, after] = [before, after].map(|mesh| mesh[key].as_f64().unwrap());
        assert!((before / after - 1.0).abs() < 1e-12, "{key}: {before} {after}");
    }
}

#[test]
fn other_orders_are_refused_and_straight_edges_of_meshes_are_told() {
    let output = tetmill().arg("generate").arg(own("dome")).args(["--order", "3"]).output().unwrap();
    assert_eq!(output.status.code(), Some(2));
    let dir = tempfile::tempdir().unwrap();
    let mesh = dir.path().join("m.vtu");
    succeed(tetmill().arg("mesh").arg(own("dome")).args(["-q", "-o"]).arg(&mesh));
    let output = succeed(tetmill().arg("generate").arg(&mesh).args(["--order", "2", "-f", "none"]));
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(said.contains("edges of second order are straight"), "{said}");
}

/// A round bar, clamped at one end, loaded by a rigid plate at the other: the deflection of
/// Timoshenko's beam.
const BAR: &str = "algebraic3d
solid rod = cylinder (0, 0, 0; 10, 0, 0; 1);
solid left = plane (0, 0, 0; -1, 0, 0) -bcname=clamped;
solid right = plane (20, 0, 0; 1, 0, 0) -bcname=loaded;
solid bar = rod and left and right;
tlo bar -material=steel;
";

const JOB: &str = "*INCLUDE, INPUT=bar.inp
*MATERIAL, NAME=M
*ELASTIC
210000, 0.3
*SOLID SECTION, ELSET=STEEL, MATERIAL=M
*BOUNDARY
CLAMPED, 1, 3
*NODE, NSET=PLATE
9000001, 20, 0, 0
9000002, 20, 0, 0
*RIGID BODY, NSET=LOADED, REF NODE=9000001, ROT NODE=9000002
*STEP
*STATIC
*CLOAD
9000001, 3, 1000
*NODE PRINT, NSET=PLATE
U
*END STEP
";

#[test]
fn calculix_bends_a_bar_of_ten_node_tets_as_theory_says() {
    if Command::new("ccx").arg("-v").output().is_err() {
        eprintln!("skipped: CalculiX (ccx) is not installed");
        return;
    }
    let deflection = |order: &str, ranks: &str| -> f64 {
        let dir = tempfile::tempdir().unwrap();
        let geometry = dir.path().join("bar.geo");
        fs::write(&geometry, BAR).unwrap();
        fs::write(dir.path().join("job.inp"), JOB).unwrap();
        let mut command = tetmill();
        command.arg("generate").arg(&geometry).args(["--maxh", "1", "--order", order, "-n", ranks, "-q"]);
        succeed(command.args(["-f", "inp", "-o"]).arg(dir.path()));
        succeed(Command::new("ccx").arg("job").current_dir(dir.path()));
        let results = fs::read_to_string(dir.path().join("job.dat")).unwrap();
        let row = results.lines().find(|line| line.trim_start().starts_with("9000001")).expect("a result");
        row.split_whitespace().nth(3).unwrap().parse().unwrap()
    };
    let (length, elasticity, shear) = (20.0_f64, 210_000.0, 210_000.0 / 2.6);
    let (area, inertia) = (std::f64::consts::PI, std::f64::consts::PI / 4.0);
    // The shear coefficient of a circle: Cowper 1966.
    let theory = 1000.0 * length.powi(3) / (3.0 * elasticity * inertia)
        + 1000.0 * length / ((6.0 * 1.3 / (7.0 + 6.0 * 0.3)) * shear * area);
    for ranks in ["1", "4"] {
        let ratio = deflection("2", ranks) / theory;
        assert!((ratio - 1.0).abs() < 0.01, "{ratio}");
    }
    assert!(deflection("1", "1") / theory < 0.9, "four-node tets are too stiff");
}
