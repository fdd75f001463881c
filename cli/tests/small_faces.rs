//! Faces and edges of CAD files that are smaller than the elements, through the command.

use crate::common::{own, read_json, succeed, tetmill};

#[test]
fn merged_faces_are_in_the_report_and_on_the_terminal() {
    let part = own("step").with_extension("").join("tiny_chamfer.step");
    let run = |more: &[&str]| {
        let dir = tempfile::tempdir().unwrap();
        let file = dir.path().join("report.json");
        let mut command = tetmill();
        command.arg("generate").arg(&part).args(["-f", "none", "--report"]).arg(&file).args(more);
        let output = succeed(&mut command);
        let small = read_json(&file)["coarse"]["merged_small"].clone();
        (String::from_utf8_lossy(&output.stderr).into_owned(), small)
    };
    let (stderr, small) = run(&[]);
    let face = &small["faces"][0];
    assert!((face["width"].as_f64().unwrap() - 2e-6_f64.sqrt()).abs() < 1e-8, "{small}");
    let expected = format!("face {} (1.4e-3 wide) into face {}", face["face"], face["into"]);
    assert!(stderr.contains(&expected) && stderr.contains("--keep-small"), "{stderr}");
    assert_eq!((small["faces"].as_array().unwrap().len(), small["edges"].as_array().unwrap().len()), (1, 2));
    let (stderr, small) = run(&["--keep-small"]);
    assert!(!stderr.contains("merged") && small["faces"].as_array().unwrap().is_empty(), "{stderr}");
}
