//! Surfaces and meshes of other programs as input.

use crate::common::{judge, own, read_json, report_of, shared, succeed, tetmill};
use std::fmt::Write;
use std::path::Path;

/// A box as an STL of 12 triangles.
fn stl_box(name: &str, [low, high]: [[f64; 3]; 2]) -> String {
    let corner = |i: usize| [0, 1, 2].map(|axis| if i >> axis & 1 == 1 { high[axis] } else { low[axis] });
    let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let mut text = format!("solid {name}\n");
    for [a, b, c, d] in quads {
        for triangle in [[a, b, c], [a, c, d]] {
            text += "facet normal 0 0 0\nouter loop\n";
            for v in triangle {
                let [x, y, z] = corner(v);
                writeln!(text, "vertex {x} {y} {z}").unwrap();
            }
            text += "endloop\nendfacet\n";
        }
    }
    text + &format!("endsolid {name}\n")
}

fn write_box(dir: &Path, name: &str, corners: [[f64; 3]; 2]) -> std::path::PathBuf {
    let file = dir.join(name).with_extension("stl");
    std::fs::write(&file, stl_box(name, corners)).unwrap();
    file
}

#[test]
fn a_surface_is_meshed_refined_and_partitioned() {
    let dir = tempfile::tempdir().unwrap();
    let file = write_box(dir.path(), "brick", [[0., 0., 0.], [3., 1., 2.]]);
    let out = dir.path().join("out");
    let report = dir.path().join("report.json");
    let mut command = tetmill();
    command
        .arg("generate")
        .arg(&file)
        .arg("-o")
        .arg(&out)
        .args(["-n", "3", "--levels", "1", "--maxh", "0.5"]);
    succeed(command.arg("-q").arg("--report").arg(&report));
    judge(&out, 3);
    let report = read_json(&report);
    assert_eq!(
        report["entities"],
        serde_json::json!({"bodies": 1, "corners": 8, "curves": 12, "patches": 6})
    );
    assert!((report["mesh"]["volume"].as_f64().unwrap() - 6.0).abs() < 1e-12);
}

#[test]
fn two_files_that_share_a_face_become_two_bodies_with_an_interface() {
    let dir = tempfile::tempdir().unwrap();
    let left = write_box(dir.path(), "left", [[0., 0., 0.], [1., 1., 1.]]);
    let right = write_box(dir.path(), "right", [[1., 0., 0.], [2., 1., 1.]]);
    let out = dir.path().join("out");
    let mut command = tetmill();
    succeed(command.arg("generate").args([&left, &right]).arg("-o").arg(&out).args(["-n", "2", "-q"]));
    judge(&out, 2);
    let names = std::fs::read_to_string(out.join("mesh.names")).unwrap();
    assert!(names.contains("left") && names.contains("right"), "{names}");
    // Five faces of each body and the common one.
    let looked = succeed(tetmill().arg("inspect").args([&left, &right]).arg("--json"));
    let seen: serde_json::Value = serde_json::from_slice(&looked.stdout).unwrap();
    assert_eq!(seen["patches"].as_array().unwrap().len(), 11);
    assert!(seen["patches"].as_array().unwrap().iter().any(|p| p["bodies"] == serde_json::json!([1, 2])));
}

#[test]
fn kept_triangles_are_the_boundary_of_the_mesh() {
    let dir = tempfile::tempdir().unwrap();
    let file = write_box(dir.path(), "brick", [[0., 0., 0.], [1., 1., 1.]]);
    let kept = report_of(&file, &["--keep-surface", "--maxh", "0.1"]);
    assert_eq!(kept["mesh"]["boundary"], 12);
    let remeshed = report_of(&file, &["--maxh", "0.1"]);
    assert!(remeshed["mesh"]["boundary"].as_u64().unwrap() > 600);
}

#[test]
fn a_written_mesh_is_taken_as_it_is_partitioned_and_refined() {
    let dir = tempfile::tempdir().unwrap();
    let reference = report_of(&own("layers"), &[]);
    for ending in ["msh", "vol", "mesh", "vtu"] {
        let file = dir.path().join(format!("layers.{ending}"));
        succeed(tetmill().arg("mesh").arg(own("layers")).arg("-q").arg("-o").arg(&file));
        let out = dir.path().join(ending);
        let report = dir.path().join("report.json");
        let mut command = tetmill();
        command.arg("generate").arg(&file).arg("-o").arg(&out).args(["-n", "4", "--levels", "1", "-q"]);
        succeed(command.arg("--report").arg(&report));
        judge(&out, 4);
        let report = read_json(&report);
        assert_eq!(report["mesh"]["tets"], 8 * reference["mesh"]["tets"].as_u64().unwrap(), "{ending}");
        assert_eq!(report["entities"]["bodies"], reference["entities"]["bodies"], "{ending}");
        let volume = |report: &serde_json::Value| report["mesh"]["volume"].as_f64().unwrap();
        assert!((volume(&report) / volume(&reference) - 1.0).abs() < 1e-12, "{ending}");
    }
}

#[test]
fn sizes_for_a_mesh_and_mixed_inputs_are_refused() {
    let dir = tempfile::tempdir().unwrap();
    let mesh = dir.path().join("layers.mesh");
    succeed(tetmill().arg("mesh").arg(own("layers")).arg("-q").arg("-o").arg(&mesh));
    let brick = write_box(dir.path(), "brick", [[0., 0., 0.], [1., 1., 1.]]);
    let refused = |arguments: &[&std::ffi::OsStr], reason: &str| {
        let output = tetmill().arg("generate").args(arguments).output().unwrap();
        let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(2), "{stderr}");
        assert!(stderr.contains(reason), "no `{reason}` in {stderr}");
    };
    refused(&[mesh.as_os_str(), "--maxh".as_ref(), "0.1".as_ref()], "--maxh");
    refused(&[mesh.as_os_str(), brick.as_os_str()], "surfaces");
    let iges = dir.path().join("part.igs");
    std::fs::write(&iges, "").unwrap();
    refused(&[iges.as_os_str()], "save the part as STEP");
    let step = dir.path().join("part.step");
    std::fs::write(&step, "ISO-10303-21;").unwrap();
    refused(&[step.as_os_str()], "part.step: line 1: the file ends without");
    let open = dir.path().join("open.stl");
    let text = std::fs::read_to_string(&brick).unwrap();
    let facets: Vec<&str> = text.split_inclusive("endfacet\n").collect();
    std::fs::write(&open, facets[1..].concat().replacen("facet", "solid open\nfacet", 1)).unwrap();
    refused(&[open.as_os_str()], "not closed");
}

#[test]
fn missing_files_are_reported_as_missing() {
    let dir = tempfile::tempdir().unwrap();
    std::fs::copy(own("lens"), dir.path().join("part.geo")).unwrap();
    for name in ["m.ele", "m.poly"] {
        std::fs::write(dir.path().join(name), "0 3 0 0\n").unwrap();
    }
    let cases = [
        ("generate gone.stl", "gone.stl"),
        ("generate gone.xyz", "gone.xyz"),
        ("generate gone", "gone"),
        ("mesh gone.geo -o o.vtu", "gone.geo"),
        ("mesh gone.xyz -o o.xyz", "gone.xyz"),
        ("mesh m.ele -o o.vtu", "m.node"),
        ("mesh m.poly -o o.vtu", "m.node"),
        ("inspect gone.msh", "gone.msh"),
        ("decompose gone.geo -n 2 -o o.geo", "gone.geo"),
        ("quality gone.vtu", "gone.vtu"),
        ("quality gone.xyz", "gone.xyz"),
        ("quality gone", "gone"),
        ("check gone", "gone"),
        ("repartition gone -n 2 -o o", "gone"),
        ("generate part.geo --mesh-size-file gone.txt", "gone.txt"),
        ("generate part.geo -m decompose --planes-from gone.txt", "gone.txt"),
    ];
    for (arguments, missing) in cases {
        let output = tetmill().current_dir(dir.path()).args(arguments.split(' ')).output().unwrap();
        let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(2), "{arguments}: {stderr}");
        assert!(
            stderr.contains(&format!("cannot read {missing}: it does not exist")),
            "{arguments}: {stderr}"
        );
    }
}

#[test]
fn surfaces_that_touch_without_the_same_triangles_are_refused_with_the_place() {
    let dir = tempfile::tempdir().unwrap();
    let large = write_box(dir.path(), "large", [[0., 0., 0.], [1., 1., 1.]]);
    let small = write_box(dir.path(), "small", [[1., 0.25, 0.25], [2., 0.75, 0.75]]);
    let output = tetmill().arg("generate").args([&large, &small]).output().unwrap();
    let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(2), "{stderr}");
    assert!(
        stderr.contains("touch without being the same") && stderr.contains("the first at (1, "),
        "{stderr}"
    );
    let names = [&large, &small].map(|file| file.display().to_string());
    assert!(stderr.contains(&format!("triangles of {} and {} intersect", names[0], names[1])), "{stderr}");
}

#[test]
fn a_thin_plate_gets_tets_as_small_as_it_is_thin() {
    let dir = tempfile::tempdir().unwrap();
    let plate = write_box(dir.path(), "plate", [[0., 0., 0.], [4., 4., 0.2]]);
    let as_it_is = report_of(&plate, &["--closeness", "0"]);
    let resolved = report_of(&plate, &["--closeness", "1.5"]);
    assert_eq!(as_it_is["coarse"]["thin_regions"]["places"], 0);
    assert!((resolved["coarse"]["thin_regions"]["thinnest"].as_f64().unwrap() - 0.2).abs() < 1e-12);
    let height = resolved["coarse"]["thin_regions"]["thinnest_at"][2].as_f64().unwrap();
    assert!([0.0, 0.2].iter().any(|face| (height - face).abs() < 1e-12), "{height}");
    let first_percentile = |r: &serde_json::Value| r["mesh"]["first_percentile_dihedral"].as_f64().unwrap();
    assert!(first_percentile(&resolved) > 25.0 && first_percentile(&resolved) > first_percentile(&as_it_is));
}

#[test]
fn the_stl_files_of_others_are_meshed() {
    for name in ["part1.stl", "hinge.stl"] {
        let Some(file) = shared(&format!("netgen-tutorials/{name}")) else { return };
        let report = report_of(&file, &["--levels", "1"]);
        assert!(report["mesh"]["smallest_dihedral"].as_f64().unwrap() > 10.0, "{name}: {report}");
    }
}

/// A `.poly` file of a cube inside a cube, with these holes and regions. The orientation of facets
/// varies.
fn nested_cubes(holes: &str, regions: &str) -> String {
    let mut text = String::from("16 3 0 0\n");
    for (cube, half) in [2.0, 1.0].into_iter().enumerate() {
        for i in 0..8 {
            let [x, y, z] = [0, 1, 2].map(|axis| if i >> axis & 1 == 1 { half } else { -half });
            writeln!(text, "{} {x} {y} {z}", 8 * cube + i + 1).unwrap();
        }
    }
    text += "12 0\n";
    for cube in 0..2 {
        for quad in [[0, 1, 3, 2], [4, 5, 7, 6], [0, 1, 5, 4], [2, 3, 7, 6], [0, 2, 6, 4], [1, 3, 7, 5]] {
            let [a, b, c, d] = quad.map(|v| 8 * cube + v + 1);
            writeln!(text, "1\n4 {a} {b} {c} {d}").unwrap();
        }
    }
    text + holes + regions
}

#[test]
fn holes_and_regions_of_a_poly_file_say_what_is_solid() {
    let dir = tempfile::tempdir().unwrap();
    let file = dir.path().join("nested.poly");
    let volumes = |holes: &str, regions: &str| {
        std::fs::write(&file, nested_cubes(holes, regions)).unwrap();
        let report = report_of(&file, &[]);
        let list = report["mesh"]["body_volumes"].as_array().unwrap().clone();
        list.iter().map(|v| v.as_f64().unwrap().round()).collect::<Vec<_>>()
    };
    assert_eq!(volumes("0\n", "0\n"), [56., 8.]);
    assert_eq!(volumes("1\n1 0 0 0\n", "0\n"), [56.]);
    std::fs::write(&file, nested_cubes("0\n", "2\n1 1.5 0 0 7\n2 0 0 0 3\n")).unwrap();
    let looked = succeed(tetmill().arg("inspect").arg(&file).arg("--json"));
    let seen: serde_json::Value = serde_json::from_slice(&looked.stdout).unwrap();
    let numbers: Vec<_> = seen["bodies"].as_array().unwrap().iter().map(|b| b["number"].clone()).collect();
    assert_eq!(numbers, [7, 3]);
}

#[test]
fn loose_edges_of_a_poly_file_become_edges_of_the_mesh() {
    // A cube, an edge from its corner at the origin to an inner point, and one from there to
    // another.
    let dir = tempfile::tempdir().unwrap();
    let file = dir.path().join("edges.poly");
    let sides = ["0 1 3 2", "4 6 7 5", "0 4 5 1", "2 3 7 6", "0 2 6 4", "1 5 7 3"];
    let mut text = "10 3\n".to_owned();
    for i in 0..8 {
        text += &format!("{i} {} {} {}\n", i >> 2, i >> 1 & 1, i & 1);
    }
    text += "8 0.4 0.5 0.45\n9 0.7 0.2 0.6\n8 0\n";
    sides.iter().for_each(|side| text += &format!("1\n4 {side}\n"));
    text += "1\n2 0 8\n1\n2 8 9\n0\n0\n";
    std::fs::write(&file, text).unwrap();
    let out = dir.path().join("edges.mesh");
    let mut command = tetmill();
    succeed(command.arg("mesh").arg(&file).args(["--keep-surface", "--maxh", "0.2", "-q", "-o"]).arg(&out));
    let written = std::fs::read_to_string(&out).unwrap();
    let mut words = written.split_ascii_whitespace();
    let mut section = |name: &str, width: usize| -> Vec<Vec<f64>> {
        words.by_ref().find(|word| *word == name).unwrap();
        let count: usize = words.next().unwrap().parse().unwrap();
        let mut row = || (0..width).map(|_| words.next().unwrap().parse().unwrap()).collect();
        (0..count).map(|_| row()).collect()
    };
    let vertices = section("Vertices", 4);
    let tets = section("Tetrahedra", 5);
    let at = |place: [f64; 3]| 1.0 + vertices.iter().position(|row| row[..3] == place).unwrap() as f64;
    let ends = [[0.0; 3], [0.4, 0.5, 0.45], [0.7, 0.2, 0.6]].map(at);
    for edge in ends.windows(2) {
        assert!(tets.iter().any(|tet| edge.iter().all(|v| tet[..4].contains(v))), "{edge:?}");
    }
}
