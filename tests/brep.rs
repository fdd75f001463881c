//! Boundary representations of CAD programs.

use crate::folders::{own, shared};
use std::collections::HashMap;
use std::path::PathBuf;
use tetmill::comm::thread;
use tetmill::mesh::{Arrays, Order};
use tetmill::size::Preset;
use tetmill::{Geometry, InputSettings, Mesher, Method, OverlapTo};

/// A file of the repository.
fn file(name: &str) -> PathBuf {
    own("brep").with_extension("").join(name).with_extension("brep")
}

/// The volume of the tets of a mesh.
fn volume(geometry: &Geometry, preset: Preset, levels: u32) -> f64 {
    volume_of(&Mesher::new().preset(preset).levels(levels).generate(geometry).unwrap().arrays())
}

pub fn volume_of(mesh: &Arrays) -> f64 {
    let of = |tet: &[u32; 4]| {
        let [a, b, c, d] = tet.map(|v| tetmill::Point::from(mesh.points[v as usize]));
        (b - a).cross(&(c - a)).dot(&(d - a)) / 6.0
    };
    mesh.tets.iter().map(of).sum()
}

#[test]
fn volumes_converge_to_those_of_the_cad_program() {
    let text = std::fs::read(file("measures").with_extension("json")).unwrap();
    let measures: serde_json::Value = serde_json::from_slice(&text).unwrap();
    for (name, measured) in measures.as_object().unwrap() {
        let exact: f64 = measured["volumes"].as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).sum();
        let geometry = Geometry::from_file(file(name)).unwrap_or_else(|error| panic!("{name}: {error}"));
        let [coarse, fine] =
            [0, 2].map(|levels| (volume(&geometry, Preset::Fine, levels) - exact).abs() / exact);
        // Two levels divide the error of chords by 16. At `fine` no children are poor, so that both
        // have the same coarse mesh. Where the errors of outer and inner faces cancel, as for the
        // thick cylinder, what is left is of higher order.
        assert!(coarse < 0.1 && fine < (coarse / 12.0).max(1e-5), "{name}: {coarse:e} {fine:e}");
    }
}

#[test]
fn all_ranks_project_to_the_same_faces() {
    for name in ["fragments", "cone", "loft"] {
        let geometry = Geometry::from_file(file(name)).unwrap();
        let alone = Mesher::new().levels(2).generate(&geometry).unwrap().checksum;
        let together = thread::try_run(3, |comm| {
            Mesher::new().levels(2).generate_on(comm, Some(&geometry)).map(|mesh| mesh.checksum)
        });
        assert_eq!(together.unwrap(), vec![alone; 3], "{name}");
    }
}

#[test]
fn second_order_and_the_method_surface_work_on_exact_faces() {
    let geometry = Geometry::from_file(file("thick_cylinder")).unwrap();
    Mesher::new().order(Order::Second).levels(1).generate(&geometry).unwrap();
    let mesher = Mesher::new().method(Method::Surface).levels(1);
    thread::try_run(2, |comm| mesher.generate_on(comm, Some(&geometry)).map(drop)).unwrap();
}

#[test]
fn a_step_assembly_has_names_and_is_on_its_faces_in_the_wanted_unit() {
    let path = own("step").with_extension("").join("assembly.step");
    let settings = InputSettings { unit: "mm".parse().unwrap(), ..InputSettings::default() };
    let geometry = Geometry::read(&[path], &settings, &mut |note| panic!("{note}")).unwrap();
    let mesh = Mesher::new().levels(1).generate(&geometry).unwrap();
    let names: Vec<&str> = mesh.names.bodies.iter().map(|label| label.names[0].as_str()).collect();
    assert_eq!(names, ["plate", "bolt", "bolt", "bolt", "bolt"]);
    // Plate and bolts: the mesh is refined once, so chords are short.
    let exact = 8000.0 + 4.0 * std::f64::consts::PI * (4.0 * 7.0 + 16.0 * 3.0);
    let arrays = mesh.arrays();
    let volume = volume_of(&arrays);
    assert!((volume / exact - 1.0).abs() < 0.01, "{volume} instead of {exact}");
    // The first bolt stands on (-5, -5, 20): a cylinder of radius 2 above its head.
    let is_on_bolt = |p: &[f64; 3]| {
        let r = (p[0] + 5.0).hypot(p[1] + 5.0);
        (23.5..29.5).contains(&p[2]) && r < 3.0 && (r - 2.0).abs() < 1e-12
    };
    assert!(arrays.points.iter().filter(|p| is_on_bolt(p)).count() > 10);
}

#[test]
fn faces_that_solids_of_a_step_file_repeat_are_interfaces() {
    // A pin of radius 0.4 in a plate of 2 × 2 × 1 with which it is flush.
    let geometry = Geometry::from_file(own("step").with_extension("").join("pin.step")).unwrap();
    let inspection = geometry.inspect().unwrap();
    assert_eq!((inspection.bodies.len(), inspection.patches.len()), (2, 9));
    assert!(
        (volume(&geometry, Preset::Moderate, 0) / 4.0 - 1.0).abs() < 1e-12,
        "chords of the common face cancel"
    );
    let mesh = Mesher::new().generate(&geometry).unwrap();
    assert_eq!(mesh.names.bodies.len(), 2);
}

/// The area of the faces between tets of different bodies.
fn interface(mesh: &Arrays) -> f64 {
    let mut sides: HashMap<[u32; 3], Vec<tetmill::mesh::BodyId>> = HashMap::new();
    for (tet, &body) in mesh.tets.iter().zip(&mesh.tet_bodies) {
        for skipped in 0..4 {
            let mut face: Vec<u32> = (0..4).filter(|k| *k != skipped).map(|k| tet[k]).collect();
            face.sort_unstable();
            sides.entry([face[0], face[1], face[2]]).or_default().push(body);
        }
    }
    let area = |face: &[u32; 3]| {
        let [a, b, c] = face.map(|v| tetmill::Point::from(mesh.points[v as usize]));
        0.5 * (b - a).cross(&(c - a)).norm()
    };
    let between = sides.iter().filter(|(_, bodies)| bodies.len() == 2 && bodies[0] != bodies[1]);
    between.map(|(face, _)| area(face)).sum()
}

#[test]
fn solids_that_touch_share_the_common_parts_of_their_faces() {
    let path = own("step").with_extension("").join("bolted.step");
    let mut notes = Vec::new();
    let settings = InputSettings { unit: "mm".parse().unwrap(), ..InputSettings::default() };
    let geometry = Geometry::read(&[path], &settings, &mut |note| notes.push(note.to_owned())).unwrap();
    assert!(notes.len() == 1 && notes[0].contains("8 common faces"), "{notes:?}");
    let mesher = Mesher::new().levels(1);
    let mesh = mesher.generate(&geometry).unwrap();
    let names: Vec<&str> = mesh.names.bodies.iter().map(|label| label.names[0].as_str()).collect();
    assert_eq!(names, ["lower plate", "upper plate", "bolt", "washer", "nut"]);
    // The volumes of the five solids and the area of their contacts by the CAD program.
    let arrays = mesh.arrays();
    let exact = 11_698.407 + 6_498.673 + 1_786.284 + 226.195 + 623.196;
    let (volume, area) = (volume_of(&arrays), interface(&arrays));
    assert!((volume / exact - 1.0).abs() < 1e-3, "{volume} instead of {exact}");
    assert!((area / 1844.642 - 1.0).abs() < 5e-3, "{area} instead of 1844.642");
    let together =
        thread::try_run(2, |comm| mesher.generate_on(comm, Some(&geometry)).map(|mesh| mesh.checksum));
    assert_eq!(together.unwrap(), vec![mesh.checksum; 2]);
}

#[test]
fn solids_of_several_files_share_what_they_have_in_common() {
    let folder = own("step").with_extension("");
    // A plate with a hole, and the bolt in it, whose head lies on the plate.
    let paths = ["plate.step", "bolt.step"].map(|name| folder.join(name));
    let settings = InputSettings { unit: "mm".parse().unwrap(), ..InputSettings::default() };
    let read = |paths: &[PathBuf], settings: &InputSettings| {
        let mut notes = Vec::new();
        let geometry = Geometry::read(paths, settings, &mut |note| notes.push(note.to_owned()));
        (geometry, notes)
    };
    let (geometry, notes) = read(&paths, &settings);
    assert!(notes.len() == 1 && notes[0].contains("2 common faces"), "{notes:?}");
    let mesh = Mesher::new().levels(2).generate(&geometry.unwrap()).unwrap();
    let names: Vec<&str> = mesh.names.bodies.iter().map(|label| label.names[0].as_str()).collect();
    assert_eq!(names, ["plate", "bolt"]);
    let pi = std::f64::consts::PI;
    let bolt = pi * (25.0 * 11.0 + 81.0 * 4.0);
    let near = |found: f64, exact: f64| assert!((found / exact - 1.0).abs() < 3e-3, "{found}, not {exact}");
    let arrays = mesh.arrays();
    near(volume_of(&arrays), (40.0 * 30.0 - 25.0 * pi) * 6.0 + bolt);
    near(interface(&arrays), 2.0 * pi * 5.0 * 6.0 + pi * (81.0 - 25.0));

    // A file in centimetres after one in millimetres: all are in those.
    let dir = tempfile::tempdir().unwrap();
    let large = dir.path().join("large.step");
    let text = std::fs::read_to_string(&paths[1]).unwrap();
    assert_eq!(text.matches(".MILLI.,.METRE.").count(), 1);
    std::fs::write(&large, text.replace(".MILLI.,.METRE.", ".CENTI.,.METRE.")).unwrap();
    let chosen = InputSettings { solids: vec!["large".into()], ..InputSettings::default() };
    let (geometry, _) = read(&[paths[0].clone(), large], &chosen);
    near(volume(&geometry.unwrap(), Preset::Moderate, 2), 1000.0 * bolt);

    let with_brep = [paths[0].clone(), file("sphere")];
    let (geometry, notes) = read(&with_brep, &settings);
    assert_eq!(geometry.unwrap().inspect().unwrap().bodies.len(), 2);
    assert!(notes[0].contains("sphere.brep: a BREP file has no unit"), "{notes:?}");

    let (refused, _) = read(&[paths[0].clone(), own("lens")], &InputSettings::default());
    let error = refused.unwrap_err().to_string();
    assert!(error.contains("only if all of them are surfaces, or all CAD files"), "{error}");
}

#[test]
fn solids_that_overlap_are_refused_with_their_numbers() {
    let geometry = Geometry::from_file(own("step").with_extension("").join("overlapping.step")).unwrap();
    let error = Mesher::new().generate(&geometry).unwrap_err().to_string();
    let has = |text: &str| error.contains(text);
    assert!(has("the solids 1 (") && has("and 2 (") && has("--overlap-to smaller"), "{error}");
}

#[test]
fn a_solid_whose_faces_intersect_is_refused_with_their_numbers() {
    let geometry = Geometry::from_file(own("step").with_extension("").join("pierced.step")).unwrap();
    let error = Mesher::new().generate(&geometry).unwrap_err().to_string();
    assert!(error.contains("the faces 1 and ") && error.contains(", 0), at "), "{error}");
}

#[test]
fn what_solids_have_in_common_is_cut_out_of_all_but_one() {
    let path = own("step").with_extension("").join("press_fit.step");
    // The volumes of hub, shaft and screw by the CAD program, with each chosen to keep what it has.
    for (to, exact) in
        [(OverlapTo::Smaller, [9553.182, 8930.173, 94.248]), (OverlapTo::First, [9632.123, 8932.387, 13.051])]
    {
        let mut notes = Vec::new();
        let settings =
            InputSettings { unit: "mm".parse().unwrap(), overlap_to: Some(to), ..InputSettings::default() };
        let geometry = Geometry::read(&[&path], &settings, &mut |note| notes.push(note.to_owned())).unwrap();
        assert!(
            notes[0].contains("solids overlap: cut ") && notes[0].contains("shaft (solid 2)"),
            "{notes:?}"
        );
        let mesher = Mesher::new().levels(2);
        let mesh = mesher.generate(&geometry).unwrap();
        let arrays = mesh.arrays();
        for (body, exact) in exact.into_iter().enumerate() {
            let own = |k: &usize| arrays.tet_bodies[*k].index() == body;
            let volume: f64 = (0..arrays.tets.len())
                .filter(own)
                .map(|tet| {
                    let [a, b, c, d] = arrays.corners(tet).map(tetmill::Point::from);
                    (b - a).dot(&(c - a).cross(&(d - a))) / 6.0
                })
                .sum();
            assert!((volume / exact - 1.0).abs() < 4e-3, "{to:?}, body {body}: {volume} instead of {exact}");
        }
        let together =
            thread::try_run(2, |comm| mesher.generate_on(comm, Some(&geometry)).map(|mesh| mesh.checksum));
        assert_eq!(together.unwrap(), vec![mesh.checksum; 2]);
    }
}

#[test]
fn only_solids_of_cad_files_are_cut_out_of_each_other() {
    let settings = InputSettings { overlap_to: Some(OverlapTo::Smaller), ..InputSettings::default() };
    let path = own("bearing").with_extension("geo");
    let error = Geometry::read(&[path], &settings, &mut |_| {}).unwrap_err().to_string();
    assert!(error.contains("can be cut out of each other"), "{error}");
}

#[test]
fn chosen_solids_are_meshed_alone() {
    let path = |name: &str| own("step").with_extension("").join(name);
    let read = |name: &str, solids: &[&str]| {
        let solids = solids.iter().map(|&solid| solid.to_owned()).collect();
        let settings = InputSettings { solids, unit: "mm".parse().unwrap(), ..InputSettings::default() };
        Geometry::read(&[path(name)], &settings, &mut |note| panic!("{note}"))
    };
    // By name, all of it, and by number.
    let bolt = std::f64::consts::PI * (4.0 * 7.0 + 16.0 * 3.0);
    for (solids, bodies, exact) in
        [(&["bolt"][..], 4, 4.0 * bolt), (&["3"], 1, bolt), (&["plate", "2"], 2, 8000.0 + bolt)]
    {
        let geometry = read("assembly.step", solids).unwrap();
        assert_eq!(geometry.inspect().unwrap().bodies.len(), bodies);
        let found = volume(&geometry, Preset::Moderate, 1);
        assert!((found / exact - 1.0).abs() < 0.02, "{solids:?}: {found} instead of {exact}");
    }
    // A solid that touches another one, and one of two with a common face.
    let found = volume(&read("touching.step", &["1"]).unwrap(), Preset::Moderate, 0);
    assert!((found - 1.0).abs() < 1e-12, "a unit cube: {found}");
    let plate = read("pin.step", &["1"]).unwrap();
    assert_eq!(plate.inspect().unwrap().bodies.len(), 1);
    Mesher::new().generate(&plate).unwrap();
    let unknown = read("assembly.step", &["nut"]).unwrap_err().to_string();
    assert!(unknown.contains("no solid `nut`: the file has 5: bolt, plate"), "{unknown}");
    let settings = InputSettings { solids: vec!["1".into()], ..InputSettings::default() };
    let other = Geometry::read(&[own("bearing")], &settings, &mut |_| ()).unwrap_err().to_string();
    assert!(other.contains("only solids of CAD files"), "{other}");
}

#[test]
fn a_pin_with_little_play_in_its_hole_is_kept_apart_from_it() {
    // The radii are 1.64 and 1.65: triangles of the usual size would intersect.
    let path = own("step").with_extension("").join("loose_pin.step");
    let geometry = Geometry::from_file(path).unwrap();
    let mesh = Mesher::new().generate(&geometry).unwrap();
    let exact = 384.0 + std::f64::consts::PI * (4.0 * 1.64 * 1.64 - 6.0 * 1.65 * 1.65);
    let found = volume_of(&mesh.arrays());
    assert!((found / exact - 1.0).abs() < 1e-3, "{found} {exact}");
    let angle = mesh.coarse.as_ref().unwrap().report.quality.smallest_dihedral;
    assert!(angle > 18.0, "{angle}°");
}

#[test]
fn a_fillet_that_runs_out_to_a_point_gets_few_and_good_elements() {
    // Its radius grows from 0 to 0.4 over an edge of a cube of 10.
    let path = own("step").with_extension("").join("vanishing_fillet.step");
    let mesh = Mesher::new().generate(&Geometry::from_file(path).unwrap()).unwrap();
    let found = volume_of(&mesh.arrays());
    assert!((found / 999.878 - 1.0).abs() < 1e-4, "{found}");
    let angle = mesh.coarse.as_ref().unwrap().report.quality.smallest_dihedral;
    assert!(angle > 10.0, "{angle}°");
    assert!(mesh.arrays().tets.len() < 10_000, "{} tets", mesh.arrays().tets.len());
}

#[test]
fn step_and_brep_of_one_part_have_the_volumes_of_the_cad_program() {
    let Some(folder) = shared("step") else { return };
    let text = std::fs::read(folder.join("volumes.json")).unwrap();
    let parts: serde_json::Value = serde_json::from_slice(&text).unwrap();
    for (name, part) in parts.as_object().unwrap() {
        // The blade has ten times as many tets as the others together.
        for ending in ["step", "brep"].into_iter().filter(|_| name != "blade") {
            let path = folder.join(name).with_extension(ending);
            let geometry = Geometry::from_file(&path).unwrap_or_else(|error| panic!("{error}"));
            let inspection = geometry.inspect().unwrap();
            assert_eq!(Some(inspection.patches.len() as u64), part["faces"].as_u64(), "{}", path.display());
            let exact: f64 = part["volumes"].as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).sum();
            let found = volume(&geometry, Preset::Moderate, 0);
            assert!((found / exact - 1.0).abs() < 0.05, "{}: {found} {exact}", path.display());
        }
    }
}

#[test]
fn faces_and_solids_have_numbers_and_kinds() {
    let geometry = Geometry::from_file(file("box_with_hole")).unwrap();
    let inspection = geometry.inspect().unwrap();
    let kinds: Vec<&str> = inspection.patches.iter().map(|patch| patch.surface).collect();
    assert_eq!(kinds.iter().filter(|kind| **kind == "plane").count(), 6);
    assert_eq!(kinds.iter().filter(|kind| **kind == "cylinder").count(), 1);
    assert!(inspection.patches.iter().map(|patch| patch.boundary).eq(1..=7));
    // The circles of the hole are closed: their corners and the seam come from the parameters.
    assert_eq!((inspection.corners.len(), inspection.curves.len()), (8, 14));
}

#[test]
fn what_cannot_be_read_or_cut_is_refused_with_the_reason() {
    let geometry = Geometry::from_file(file("cone")).unwrap();
    let cut = Mesher::new().method(Method::Decompose(Default::default()));
    let refused = thread::try_run(2, |comm| cut.generate_on(comm, Some(&geometry)).map(drop)).unwrap_err();
    assert!(refused.to_string().contains("cut"), "{refused}");
    let folder = tempfile::tempdir().unwrap();
    let iges = folder.path().join("part.igs");
    std::fs::write(&iges, "").unwrap();
    let error = Geometry::from_file(&iges).unwrap_err().to_string();
    assert!(error.contains("IGES") && error.contains("STEP"), "{error}");
    let step = folder.path().join("part.step");
    std::fs::write(&step, "ISO-10303-21;\nHEADER;").unwrap();
    let error = Geometry::from_file(&step).unwrap_err().to_string();
    assert!(error.contains("part.step: line 2: ") && error.contains("incomplete"), "{error}");
    let damaged = folder.path().join("part.brep");
    let text = std::fs::read_to_string(file("cone")).unwrap();
    std::fs::write(&damaged, text.replace("TShapes", "TShape")).unwrap();
    let error = Geometry::from_file(&damaged).unwrap_err().to_string();
    assert!(error.contains("part.brep: line ") && error.contains("`TShapes` is expected"), "{error}");
}
