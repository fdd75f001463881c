//! Faces and edges of CAD files that are smaller than the elements.

use crate::brep::volume_of;
use crate::folders::own;
use tetmill::comm::thread;
use tetmill::mesh::Order;
use tetmill::{Generated, Geometry, InputSettings, Mesher};

fn geometry(name: &str, keep_small: bool) -> Geometry {
    let path = own("step").with_extension("").join(name).with_extension("step");
    let settings = InputSettings { keep_small, ..InputSettings::default() };
    Geometry::read(&[path], &settings, &mut |note| panic!("{note}")).unwrap()
}

/// The parts with their volumes, and the largest error of the volume: the width of the merged face
/// times the area of those beside it, and for the cylinder that of its chords.
const PARTS: [(&str, f64, f64); 5] = [
    ("sliver_plate", 0.2, 1e-12),
    ("split_edge", 1.0, 1e-12),
    ("tiny_chamfer", 1.0 - 0.5e-6, 1e-3),
    ("sliver_at_interface", 1.6993, 1e-3),
    ("cylinder_step", 0.785_005_464, 0.04),
];

/// Parts with rounded edges, one with a low step whose front continues in a wall at its end, and
/// one with a step around a corner. With their small faces they have up to two million tets.
const MANY: [(&str, f64, f64); 5] = [
    ("rounded_cube", 0.999_997_426, 5e-3),
    ("rounded_rims", 0.803_649_788, 0.01),
    ("low_step", 5.001, 1e-3),
    ("spur", 4.002, 3e-3),
    ("cornered_step", 1.981_831_853, 5e-3),
];

#[test]
fn merged_parts_have_few_good_tets_and_their_volume() {
    for (name, exact, error) in PARTS {
        let made = [false, true].map(|keep| Mesher::new().generate(&geometry(name, keep)).unwrap());
        let report = |mesh: &Generated| mesh.coarse.as_ref().unwrap().report.clone();
        let [merged, kept] = made.each_ref().map(report);
        assert!(merged.tets * 20 < kept.tets, "{name}: {} tets instead of {}", merged.tets, kept.tets);
        let [angle, before] = [&merged, &kept].map(|report| report.quality.smallest_dihedral);
        assert!(angle > 28.0 && angle > before, "{name}: {angle}° instead of {before}°");
        let volume = volume_of(&made[0].arrays());
        assert!((volume - exact).abs() <= error, "{name}: {volume} instead of {exact}");
        assert!(!merged.merged_small.edges.is_empty(), "{name}");
        assert!(kept.merged_small.faces.is_empty() && kept.merged_small.edges.is_empty(), "{name}");
    }
}

#[test]
fn parts_that_would_have_very_many_tets_have_few_good_ones_and_their_volume() {
    for (name, exact, error) in MANY {
        let made = Mesher::new().generate(&geometry(name, false)).unwrap();
        let report = &made.coarse.as_ref().unwrap().report;
        assert!(report.tets < 2000, "{name}: {} tets", report.tets);
        let angle = report.quality.smallest_dihedral;
        assert!(angle > 25.0, "{name}: {angle}°");
        let volume = volume_of(&made.arrays());
        assert!((volume - exact).abs() <= error, "{name}: {volume} instead of {exact}");
        assert_eq!(report.thin_regions.places, 0, "{name}: merged faces are no walls");
        assert_eq!(report.sharp_places.count, 0, "{name}: merged faces are not sharp");
        let of_facets = report.facets_volume.unwrap();
        assert!((of_facets / exact - 1.0).abs() < 0.01, "{name}: {of_facets} instead of {exact}");
    }
}

#[test]
fn refined_and_curved_vertices_of_merged_faces_are_on_the_faces_of_the_file() {
    // Each run checks that boundary vertices are on their patches.
    for (name, exact, error) in PARTS.into_iter().chain(MANY) {
        let geometry = geometry(name, false);
        let fine = Mesher::new().levels(3).generate(&geometry).unwrap();
        // Three levels divide the error of chords by 64, and that of merged faces by 8.
        let volume = volume_of(&fine.arrays());
        assert!((volume - exact).abs() <= (error / 8.0).max(1e-12), "{name}: {volume} instead of {exact}");
        Mesher::new().order(Order::Second).levels(1).generate(&geometry).unwrap();
    }
    // The upper face of the chamfered cube ends 10⁻³ before its edges: no vertex is outside.
    let arrays = Mesher::new().levels(3).generate(&geometry("tiny_chamfer", false)).unwrap().arrays();
    let beyond = |p: &[f64; 3]| p[0] + p[2] > 2.0 - 1e-3 + 1e-12;
    assert!(!arrays.points.iter().any(beyond), "vertices are cut off by the chamfer");
}

#[test]
fn a_low_step_beside_a_curved_face_is_merged_at_all_sizes() {
    let geometry = geometry("step_beside_bend", false);
    for size in [1.0, 1.5, 2.0, 2.5, 3.0, 4.0] {
        let made = Mesher::new().max_size(size).generate(&geometry).unwrap();
        let angle = made.coarse.as_ref().unwrap().report.quality.smallest_dihedral;
        // Where both sides of an ear were on one curve, its short one stayed: 0.3° to 0.9°.
        assert!(angle > 20.0, "{angle}° at size {size}");
        // OpenCASCADE's volume, within that of chords.
        let volume = volume_of(&made.arrays());
        assert!((volume / 172.26 - 1.0).abs() < 0.02, "{volume} at size {size}");
    }
}

#[test]
fn a_face_is_narrow_if_it_is_so_beside_the_elements_at_each_place() {
    // The edge of a block is cut off by a cylinder of radius 100, at most 0.03 wide. A notch of
    // 0.02 at one end has small elements, where the cut is narrower still.
    let geometry = geometry("notched_lens", false);
    let made = Mesher::new().max_size(1.0).generate(&geometry).unwrap();
    let merged = &made.coarse.as_ref().unwrap().report.merged_small;
    let [face] = &merged.faces[..] else { panic!("{merged:?}") };
    assert!((face.width - 0.03).abs() < 1e-3, "{face:?}");
    // OpenCASCADE's volume; the elements beside the face are lower by up to its width.
    let volume = volume_of(&made.arrays());
    assert!((volume - 79.999_138_685).abs() < 5e-3, "{volume}");
}

#[test]
fn merging_does_not_depend_on_ranks() {
    let geometry = geometry("cylinder_step", false);
    let alone = Mesher::new().levels(2).generate(&geometry).unwrap().checksum;
    let together = thread::try_run(3, |comm| {
        Mesher::new().levels(2).generate_on(comm, Some(&geometry)).map(|mesh| mesh.checksum)
    });
    assert_eq!(together.unwrap(), vec![alone; 3]);
}

/// Blocks of 10 × 4 × 2 without what is outside a cylinder of radius 100 that touches an edge, or
/// beyond a plane that meets the edge at 1°, the last one with an edge that is bent, with
/// OpenCASCADE's volumes.
const TIPPED: [(&str, f64); 3] = [
    ("runout", 79.835_624_319_385_67),
    ("tapered_chamfer", 79.948_001_400_892_1),
    ("bent_chamfer", 80.400_370_833_333_92),
];

#[test]
fn tips_of_faces_are_merged_up_to_the_width_of_small_faces() {
    for (name, exact) in TIPPED {
        let made =
            [false, true].map(|keep| Mesher::new().max_size(1.0).generate(&geometry(name, keep)).unwrap());
        let [merged, kept] = made.each_ref().map(|mesh| mesh.coarse.as_ref().unwrap().report.clone());
        let [angle, before] = [&merged, &kept].map(|report| report.quality.smallest_dihedral);
        assert!(angle > 10.0 && angle > 4.0 * before, "{name}: {angle}° instead of {before}°");
        assert_eq!((merged.merged_small.tips.len(), kept.merged_small.tips.len()), (1, 0), "{name}");
        let volume = volume_of(&made[0].arrays());
        assert!((volume - exact).abs() < 0.08, "{name}: {volume} instead of {exact}");
    }
}

#[test]
fn tips_of_refined_meshes_are_narrow_beside_their_subdivisions() {
    for ((name, exact), before) in TIPPED.into_iter().zip([0.1, 2.5, 1.8]) {
        let fine = Mesher::new().max_size(1.0).levels(2).generate(&geometry(name, false)).unwrap();
        let tips = &fine.coarse.as_ref().unwrap().report.merged_small.tips;
        assert!(!tips.is_empty() && tips.iter().all(|tip| tip.width < 1.001 / 16.0), "{tips:?}");
        let angle = fine.levels.last().unwrap().shape.smallest_angle.value;
        assert!(angle > 3.0 * before, "{name}: {angle}°");
        let volume = volume_of(&fine.arrays());
        assert!((volume - exact).abs() < 0.01, "{name}: {volume} instead of {exact}");
    }
}

#[test]
fn tips_are_merged_in_meshes_of_second_order_too() {
    let mesher = Mesher::new().max_size(1.0).order(Order::Second);
    for keep in [false, true] {
        let made = mesher.generate(&geometry("runout", keep)).unwrap();
        let report = &made.coarse.as_ref().unwrap().report;
        assert_eq!(report.merged_small.tips.len(), if keep { 0 } else { 1 });
        assert_eq!(report.quality.smallest_dihedral > 10.0, !keep);
    }
}
