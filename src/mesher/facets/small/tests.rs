use super::{Kept, MergedSmall, Small, merge};
use crate::Point;
use crate::ground::mesh::Touching;
use crate::ground::progress::Work;
use crate::ground::size::{SizeField, UniformSize};
use crate::mesher::facets::FacetModel;
use brep::{Model, Settings, Tessellation, Unit};

fn read(name: &str) -> Model {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("geometries/step");
    let text = std::fs::read(folder.join(name).with_extension("step")).unwrap();
    Model::read_step(&text, Unit::OfFile).unwrap()
}

/// Merges what is small beside elements of this size.
fn merged_of(model: Model, size: f64) -> (Option<FacetModel>, MergedSmall) {
    merged_with(model, &|_| size)
}

/// Merges what is small beside elements of a size that depends on the model.
fn merged_with(model: Model, size: &dyn Fn(&FacetModel) -> f64) -> (Option<FacetModel>, MergedSmall) {
    merged_but(model, size, |_, _| Kept::default())
}

/// The same, but for what is kept.
fn merged_but(
    mut model: Model,
    size: &dyn Fn(&FacetModel) -> f64,
    kept: impl FnOnce(&Model, &Tessellation) -> Kept,
) -> (Option<FacetModel>, MergedSmall) {
    let tessellation = Tessellation::of(&mut model, &Settings::default()).unwrap();
    let kept = &kept(&model, &tessellation);
    let size = |model: &FacetModel| -> Box<dyn SizeField> { Box::new(UniformSize(size(model))) };
    let small = Small {
        factor: 20.0,
        still_factor: 5.0,
        largest: f64::INFINITY,
        tip_factors: [10.0, 4.0],
        kept,
        touching: &Touching::default(),
        size: &size,
        work: Work::unwatched(),
    };
    let (merged, report) = merge(&model, &tessellation, &small);
    (merged.map(|(facets, ..)| facets), report)
}

fn merged(name: &str, size: f64) -> (Option<FacetModel>, MergedSmall) {
    merged_of(read(name), size)
}

/// The numbers of patches, curves and corners.
fn counts(facets: &FacetModel) -> [usize; 3] {
    [facets.patches.len(), facets.curves.len(), facets.corners.len()]
}

#[test]
fn a_sliver_beside_a_coplanar_face_leaves_a_box() {
    let (facets, report) = merged("sliver_plate", 0.1);
    assert_eq!(counts(&facets.unwrap()), [6, 12, 8]);
    let [face] = &report.faces[..] else { panic!("{report:?}") };
    assert!((face.width - 1e-3).abs() < 1e-9, "{face:?}");
    // Both ends of the sliver.
    assert_eq!(report.edges.len(), 2);
}

#[test]
fn a_short_part_of_an_edge_is_joined_with_the_rest() {
    let (facets, report) = merged("split_edge", 0.1);
    assert_eq!(counts(&facets.unwrap()), [6, 12, 8]);
    let [edge] = &report.edges[..] else { panic!("{report:?}") };
    assert!((edge.length - 1e-3).abs() < 1e-9 && edge.curve.len() == 3, "{edge:?}");
    assert!(report.faces.is_empty());
}

#[test]
fn what_is_beside_a_place_without_a_mesh_is_kept() {
    // In the middle of the chamfer, and away from it.
    let (_, report) = merged("tiny_chamfer", 0.1);
    let face = report.faces[0].face - 1;
    let merged_beside = |away: f64| {
        let mut is_kept = false;
        let (_, report) = merged_but(read("tiny_chamfer"), &|_| 0.1, |_, tessellation| {
            let of_face = tessellation.triangles.iter().find(|t| t.patch as usize == face).unwrap();
            let [a, b, c] = of_face.vertices.map(|v| tessellation.points[v as usize].coords);
            let place = Point::from((a + b + c) / 3.0 + away * crate::Vector::new(1.0, 1.0, 1.0));
            let mut kept = Kept::default();
            is_kept = kept.add_beside(&report, tessellation, &[place]);
            assert_eq!(kept.faces.contains(&face), is_kept);
            kept
        });
        (is_kept, report.faces.len())
    };
    assert_eq!(merged_beside(1e-3), (true, 0));
    assert_eq!(merged_beside(10.0), (false, 1));
}

#[test]
fn a_chamfer_joins_one_of_its_neighbours() {
    let (facets, report) = merged("tiny_chamfer", 0.1);
    assert_eq!(counts(&facets.unwrap()), [6, 12, 8]);
    assert_eq!((report.faces.len(), report.edges.len()), (1, 2));
}

#[test]
fn rounded_edges_and_the_corners_between_them_join_six_faces() {
    let (facets, report) = merged("rounded_cube", 0.1);
    assert_eq!(counts(&facets.unwrap()), [6, 12, 8]);
    assert_eq!(report.faces.len(), 12 + 8);
}

#[test]
fn a_step_around_a_corner_is_divided_and_joins_the_faces_of_one_side() {
    // Its front has two faces along each side.
    let unmerged = counts(&unmerged("cornered_step"));
    let (facets, report) = merged("cornered_step", 0.1);
    assert_eq!(counts(&facets.unwrap()), [unmerged[0] - 1, unmerged[1] - 4, unmerged[2] - 3]);
    let into: Vec<usize> = report.faces.iter().map(|merged| merged.into).collect();
    assert!(report.faces.iter().all(|merged| merged.face == 5), "both pieces are of face 5: {report:?}");
    assert_eq!(into, [6, 2]);
    assert!(report.edges.iter().all(|edge| edge.edge <= 24), "cuts are no edges of the file: {report:?}");
    // It is not small there.
    assert!(merged("cornered_step", 0.01).1.faces.is_empty());
    let mut model = read("cornered_step");
    model.patch_names = vec![None; model.patches.len()];
    model.patch_names[4] = Some("front".to_owned());
    assert!(merged_of(model, 0.1).1.faces.is_empty(), "names of the file are never lost");
}

#[test]
fn a_spur_of_a_wide_face_is_cut_off_and_joins_a_face_beside_it() {
    let (facets, report) = merged("spur", 0.1);
    let [tip] = &report.tips[..] else { panic!("{report:?}") };
    assert!((tip.width - 1e-3).abs() < 1e-9 && report.faces.is_empty(), "{report:?}");
    // Its corners at the end and at the cut are no corners of the mesh.
    let [patches, _, corners] = counts(&facets.unwrap());
    assert_eq!((patches, corners), (9, 13));
    // With elements of its size it is kept.
    assert!(merged("spur", 4e-3).1.tips.is_empty());
}

#[test]
fn a_face_that_hardly_turns_joins_a_smooth_neighbour_at_the_size_of_tips() {
    // A strip 0.03 wide between two planes.
    let strips = |size: f64| merged("soft_bend", size).1.faces.len();
    assert_eq!([0.1, 0.15, 0.7].map(strips), [0, 1, 1]);
    // One 0.001 wide beside a coplanar face.
    let slivers = |size: f64| merged("sliver_plate", size).1.faces.len();
    assert_eq!([0.0039, 0.0041].map(slivers), [0, 1]);
}

#[test]
fn what_is_not_small_beside_the_elements_is_kept() {
    for (size, is_merged) in [(0.029, true), (0.027, false)] {
        let (facets, report) = merged("tiny_chamfer", size);
        assert_eq!(facets.is_some(), is_merged);
        assert_eq!(report == MergedSmall::default(), !is_merged, "{report:?}");
    }
}

#[test]
fn a_sliver_beside_an_interface_joins_the_face_of_its_own_body() {
    let (facets, report) = merged("sliver_at_interface", 0.1);
    let facets = facets.unwrap();
    // Two boxes with a common face: one of 12 faces is left out, and 3 of the 23 edges.
    assert_eq!((facets.patches.len(), report.faces.len()), (11, 1));
    let both = facets.patches.iter().filter(|p| p.inside.is_some() && p.outside.is_some());
    assert_eq!(both.count(), 1, "the interface is one patch of its own");
    // Each segment of the interface's curves is at three patches, as before.
    let interface = facets.patches.iter().position(|p| p.outside.is_some()).unwrap();
    let own = facets.triangles.iter().filter(|t| t.patch.index() == interface);
    let area: f64 = own
        .map(|t| {
            let [a, b, c] = t.vertices.map(|v| facets.points[v.index()]);
            0.5 * (b - a).cross(&(c - a)).norm()
        })
        .sum();
    assert!((area - 0.999).abs() < 1e-9, "{area}");
}

#[test]
fn the_faces_around_a_thin_sheet_are_kept() {
    let (facets, report) = merged("thin_sheet", 10.0);
    assert!(facets.is_none() && report == MergedSmall::default(), "{report:?}");
}

#[test]
fn a_short_edge_between_corners_of_three_curves_is_kept() {
    let (facets, report) = merged("short_ridge", 10.0);
    assert!(facets.is_none() && report == MergedSmall::default(), "{report:?}");
}

#[test]
fn names_of_the_file_are_never_lost() {
    let (_, plain) = merged("sliver_plate", 0.1);
    let (sliver, main) = (plain.faces[0].face - 1, plain.faces[0].into - 1);
    let named = |names: [Option<&str>; 2]| {
        let mut model = read("sliver_plate");
        model.patch_names = vec![None; model.patches.len()];
        [sliver, main].into_iter().zip(names).for_each(|(face, name)| {
            model.patch_names[face] = name.map(str::to_owned);
        });
        merged_of(model, 0.1).1
    };
    // Another neighbour, at an angle, has the name.
    for names in [[Some("inlet"), None], [Some("inlet"), Some("wall")]] {
        let report = named(names);
        assert!(report.faces.is_empty(), "{report:?}");
        assert_eq!(report.named.len(), 1);
        assert_eq!((report.named[0].face, report.named[0].name.as_str()), (sliver + 1, "inlet"));
    }
    for names in [[None, Some("wall")], [Some("wall"), Some("wall")]] {
        let report = named(names);
        assert_eq!((report.faces[0].into, report.named.len()), (main + 1, 0), "{report:?}");
    }
}

#[test]
fn tips_of_faces_are_cut_off_where_they_are_as_wide_as_small_faces() {
    // A cylinder of radius 100 touches an edge; a plane at 1° meets an edge.
    // At one end the corner moves along the edge; two tips at one corner leave two corners, and one
    // edge between them.
    for (name, sizes, ends, expected) in
        [("runout", [0.2, 0.1], 2, [8, 18, 12]), ("tapered_chamfer", [1.0, 0.2], 1, [7, 15, 10])]
    {
        let more = ends - 1;
        let [patches, curves, corners] = counts(&unmerged(name));
        assert_eq!([patches, curves + more, corners + more], expected);
        for size in sizes {
            let (facets, report) = merged(name, size);
            let facets = facets.unwrap();
            assert_eq!(counts(&facets), expected, "{name}");
            assert_eq!(report.tips.len(), ends, "{report:?}");
            assert!(report.faces.is_empty() && report.edges.is_empty(), "{report:?}");
            for tip in &report.tips {
                assert!((tip.width - size / 10.0).abs() < 1e-3 * size, "{tip:?}");
                let [x, y, z] = tip.point;
                assert!((x - 2.0).abs() < 1e-6 && y.abs() < 1e-6 && (z - 2.0).abs() < 1e-6, "{tip:?}");
                assert!(tip.face != tip.into && tip.into <= facets.patches.len());
            }
            let patches: std::collections::BTreeSet<u32> =
                facets.triangles.iter().map(|t| t.patch.0).collect();
            assert_eq!(patches.len(), facets.patches.len());
        }
    }
}

#[test]
fn a_tip_goes_on_around_a_corner_of_its_side() {
    // A chamfer at 1° along an edge that turns by 0.6° after 3, where it is 0.05 wide.
    let (facets, report) = merged("bent_chamfer", 1.0);
    assert_eq!(counts(&facets.unwrap()), [8, 18, 12]);
    let [tip] = &report.tips[..] else { panic!("{report:?}") };
    assert!((tip.width - 0.1).abs() < 1e-3, "{tip:?}");
}

#[test]
fn tips_are_cut_again_where_sizes_without_them_are_larger() {
    let curves = unmerged("runout").curves.len();
    let size = |model: &FacetModel| if model.curves.len() > curves { 0.15 } else { 0.1 };
    let (_, report) = merged_with(read("runout"), &size);
    assert_eq!(report.tips.len(), 2, "{report:?}");
    assert!(report.tips.iter().all(|tip| (tip.width - 0.015).abs() < 1e-4), "{report:?}");
}

/// Facets of a part with all its faces.
fn unmerged(name: &str) -> FacetModel {
    let mut model = read(name);
    let tessellation = Tessellation::of(&mut model, &Settings::default()).unwrap();
    crate::mesher::facets::of_brep(&model, &tessellation).0
}

#[test]
fn tips_wider_than_small_faces_within_an_element_are_kept() {
    // The cylinder is 0.02 away from the edge after 2.
    let (facets, report) = merged("runout", 9.0);
    assert!(report.tips.is_empty(), "{report:?}");
    assert!(facets.is_some(), "the faces are narrow as a whole");
    let (_, report) = merged("pin", 0.1);
    assert!(report.tips.is_empty(), "{report:?}");
}

#[test]
fn a_fillet_that_runs_out_to_a_point_has_a_blunt_end() {
    // Its radius grows from 0 to 0.4 over 10, slowly at first. Sizes by curvature vanish with it.
    let size = |model: &FacetModel| if model.blunt.is_empty() { 1e-6 } else { 1.0 };
    let (facets, report) = merged_with(read("vanishing_fillet"), &size);
    let facets = facets.unwrap();
    let [end] = &facets.blunt[..] else { panic!("{:?}", facets.blunt) };
    // There it is 0.05 wide, a twentieth of the elements (by OpenCASCADE).
    assert!(end.corner.coords.norm() < 1e-6 && (end.length - 1.375).abs() < 0.005, "{end:?}");
    let [tip] = &report.tips[..] else { panic!("{report:?}") };
    assert!((tip.width - 0.1).abs() < 1e-3, "{tip:?}");
    // Where radii do not vanish, sizes by curvature are those that are wanted.
    assert!(merged("runout", 0.1).0.unwrap().blunt.is_empty());
}

#[test]
fn a_tip_may_be_most_of_its_face() {
    // The chamfer is 0.279 wide at its end, and 0.186 in its middle.
    let (_, report) = merged("tapered_chamfer", 2.3);
    let [tip] = &report.tips[..] else { panic!("{report:?}") };
    assert!((tip.width - 0.23).abs() < 1e-3, "{tip:?}");
}
