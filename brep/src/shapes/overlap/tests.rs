//! Solids that overlap, made by hand.

use crate::shapes::tests::{Solids, X, Y, Z, measured, square};
use crate::{Model, OverlapTo, Settings, Tessellation, Unit, Vector};
use std::f64::consts::PI;

fn cut(solids: Solids, to: OverlapTo) -> (Model, Vec<f64>, f64) {
    let mut model = solids.model();
    model.cut_overlaps(to).unwrap_or_else(|error| panic!("{error}"));
    measured(model)
}

fn assert_near(found: &[f64], exact: &[f64]) {
    let is_near = |(a, b): (&f64, &f64)| (a - b).abs() <= 2e-3 * exact.iter().copied().fold(0.0, f64::max);
    assert!(found.len() == exact.len() && found.iter().zip(exact).all(is_near), "{found:?}, not {exact:?}");
}

#[test]
fn the_common_part_belongs_to_the_chosen_solid() {
    for (to, exact) in
        [(OverlapTo::First, [8.0, 7.0]), (OverlapTo::Last, [7.0, 8.0]), (OverlapTo::Smaller, [8.0, 7.0])]
    {
        let mut solids = Solids::default();
        solids.block([0.0; 3], [2.0; 3]);
        solids.block([1.0; 3], [3.0; 3]);
        let (model, volumes, area) = cut(solids, to);
        assert_near(&volumes, &exact);
        assert_near(&[area], &[3.0]);
        assert!(model.notes[0].starts_with("solids overlap: cut solid"), "{:?}", model.notes);
        // Three faces are divided: 12 and 3.
        assert_eq!(model.patches.len(), 15);
    }
}

#[test]
fn a_pin_is_cut_out_of_a_block_that_it_passes_through() {
    let mut solids = Solids::default();
    solids.block([-2.0, -2.0, 0.0], [2.0, 2.0, 1.0]);
    solids.pin(X * 0.3, 0.5, [-1.0, 2.0], 0.7);
    let (model, volumes, area) = cut(solids, OverlapTo::Smaller);
    assert_near(&volumes, &[16.0 - PI / 4.0, 3.0 * PI / 4.0]);
    assert_near(&[area], &[PI]);
    // The pin's wall is divided in three, and no vertex remains where planes of the block meet it.
    let walls = model.patches.iter().filter(|patch| patch.surface.kind() == "cylinder");
    assert_eq!(walls.count(), 3);
    let ends = model.curves.iter().filter(|curve| curve.ends[0] == curve.ends[1]);
    assert_eq!(ends.count(), 4, "the ends of the pin and of the hole are circles");
}

#[test]
fn a_pin_thicker_than_its_hole_keeps_a_ring() {
    let mut solids = Solids::default();
    solids.prism(&square(Vector::zeros(), 10.0, 0.0), [0.0, 2.0], &[(Vector::zeros(), 5.0)]);
    solids.pin(Vector::zeros(), 5.01, [0.0, 2.0], 1.1);
    let (_, volumes, area) = cut(solids, OverlapTo::Last);
    let pin = PI * 5.01 * 5.01 * 2.0;
    assert_near(&volumes, &[800.0 - pin, pin]);
    assert_near(&[area], &[2.0 * PI * 5.01 * 2.0]);
}

#[test]
fn faces_that_lie_in_each_other_are_those_of_the_solid_that_keeps_the_part() {
    // Three faces of each are in the same planes, with the solids on the same side.
    let mut solids = Solids::default();
    solids.block([0.0; 3], [2.0; 3]);
    solids.block([1.0, 0.0, 0.0], [3.0, 2.0, 3.0]);
    let (_, volumes, area) = cut(solids, OverlapTo::First);
    assert_near(&volumes, &[8.0, 8.0]);
    assert_near(&[area], &[4.0 + 2.0]);
}

#[test]
fn of_three_solids_each_place_belongs_to_one() {
    let mut solids = Solids::default();
    solids.block([-3.0, -0.5, -0.5], [3.0, 0.5, 0.5]);
    solids.block([-0.5, -3.0, -0.5], [0.5, 3.0, 0.5]);
    solids.block([-0.5, -0.5, -3.0], [0.5, 0.5, 3.0]);
    let (_, volumes, area) = cut(solids, OverlapTo::First);
    assert_near(&volumes, &[6.0, 5.0, 5.0]);
    assert_near(&[area], &[4.0]);
}

#[test]
fn a_face_may_divide_another_one_along_its_seam() {
    let mut solids = Solids::default();
    solids.block([0.0; 3], [2.0; 3]);
    solids.pin_with_seam(X, 0.5, [0.5, 1.5], 0.0);
    let (_, volumes, area) = cut(solids, OverlapTo::First);
    assert_near(&volumes, &[8.0, PI / 8.0]);
    // The pin's section and half of its wall, floor and roof.
    assert_near(&[area], &[1.0]);
}

#[test]
fn a_plane_may_pass_through_the_poles_of_a_ball() {
    let mut solids = Solids::default();
    solids.block([0.0; 3], [2.0; 3]);
    solids.ball(Y + Z, 0.7);
    let (_, volumes, area) = cut(solids, OverlapTo::Smaller);
    let ball = 4.0 / 3.0 * PI * 0.7_f64.powi(3);
    assert_near(&volumes, &[8.0 - 0.5 * ball, ball]);
    assert_near(&[area], &[2.0 * PI * 0.7 * 0.7]);
}

#[test]
fn a_solid_inside_another_one_is_a_void_of_that_or_nothing() {
    let nested = || {
        let mut solids = Solids::default();
        solids.block([0.0; 3], [2.0; 3]);
        solids.block([0.5; 3], [1.0; 3]);
        solids
    };
    let (_, volumes, area) = cut(nested(), OverlapTo::Smaller);
    assert_near(&volumes, &[8.0 - 0.125, 0.125]);
    assert_near(&[area], &[1.5]);
    let error = nested().model().cut_overlaps(OverlapTo::First).unwrap_err().to_string();
    assert!(error.contains("solid 2: nothing is left of it: it lies inside of solid 1"), "{error}");
}

#[test]
fn solids_that_only_touch_are_not_changed() {
    let mut solids = Solids::default();
    solids.block([0.0; 3], [2.0; 3]);
    solids.block([2.0, 0.5, 0.5], [3.0, 1.0, 1.0]);
    let mut model = solids.model();
    let before = model.clone();
    model.cut_overlaps(OverlapTo::First).unwrap();
    assert_eq!(model, before);
}

#[test]
fn faces_cross_beyond_an_edge_on_the_same_line() {
    // The upper edge of the low step and the curve in which the block cuts the high one.
    let mut solids = Solids::default();
    solids.block([-5.0, 0.0, -0.75], [5.0, 6.0, 0.75]);
    let step = [[-8.0, -3.0], [8.0, -3.0], [8.0, 1.0], [-2.0, 1.0], [-2.0, 0.0], [-8.0, 0.0]];
    solids.prism(&step.map(|[x, y]| X * x + Y * y), [-3.0, -0.25], &[]);
    let (_, volumes, area) = cut(solids, OverlapTo::First);
    assert_near(&volumes, &[90.0, 159.5 - 3.5]);
    // The low step below the block, and its bed in the high one: floor, end and side.
    assert_near(&[area], &[0.5 * 3.0 + 0.5 * 7.0 + 0.5 + 7.0]);
}

#[test]
fn faces_of_a_solid_may_be_tangent_to_each_other_where_another_one_meets_them() {
    // A cable against a block with a saddle as wide as the block: it tapers to nothing there.
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../geometries/step/saddle.step");
    let mut model = Model::read_step(&std::fs::read(path).unwrap(), Unit::OfFile).unwrap();
    model.cut_overlaps(OverlapTo::Smaller).unwrap();
    let (_, volumes, area) = measured(model);
    assert_near(&volumes, &[48.0 - 4.5 * PI, 45.0 * PI]);
    assert_near(&[area], &[3.0 * PI]);
}

#[test]
fn faces_with_the_same_edges_may_have_their_solids_on_the_same_side() {
    let solids = || {
        let mut solids = Solids::default();
        solids.block([0.0; 3], [2.0; 3]);
        solids.block([0.0; 3], [2.0, 2.0, 3.0]);
        solids
    };
    let error = Tessellation::of(&mut solids().model(), &Settings::default()).unwrap_err().to_string();
    assert!(error.contains("solid 2: it overlaps solid 1, or lies inside of it"), "{error}");
    let (_, volumes, area) = cut(solids(), OverlapTo::First);
    assert_near(&volumes, &[8.0, 4.0]);
    assert_near(&[area], &[4.0]);
}

#[test]
fn a_solid_that_repeats_another_one_is_left_out() {
    let mut solids = Solids::default();
    solids.block([0.0; 3], [2.0; 3]);
    solids.block([3.0; 3], [4.0; 3]);
    solids.block([0.0; 3], [2.0; 3]);
    solids.block([3.0; 3], [4.0; 3]);
    solids.block([5.0; 3], [7.0, 6.0, 6.0]);
    solids.block([3.0; 3], [4.0; 3]);
    let (model, volumes, area) = cut(solids, OverlapTo::First);
    assert_near(&volumes, &[8.0, 1.0, 2.0]);
    assert_eq!((model.bodies, area), (3, 0.0));
    let repeats = |body: usize, other: usize| format!("solid {body} repeats solid {other}: left out");
    assert_eq!(model.notes, [repeats(3, 1), repeats(4, 2), repeats(6, 2)]);
}

#[test]
fn edges_are_cut_off_that_stand_out_by_less_than_the_accuracy_that_the_file_states() {
    let mut solids = Solids::default();
    solids.block([0.0; 3], [2.0; 3]);
    // A bevelled post whose side is 2e-4 in front of that of the block.
    let post = [[1.0, 1.0], [2.0002, 1.0], [2.0002, 1.5], [1.5, 2.0002], [1.0, 2.0002]];
    solids.prism(&post.map(|[x, y]| X * x + Y * y), [-1.0, 1.0], &[]);
    solids.set_accuracy(0.01);
    let (_, volumes, area) = cut(solids, OverlapTo::First);
    assert_near(&volumes, &[8.0, 0.875]);
    // The section of the post, and what is left of it in front of two sides of the block.
    assert_near(&[area], &[0.875 + 0.5 + 0.5]);
}

#[test]
fn walls_that_cross_at_a_very_small_angle_are_cut() {
    // At an angle of 6e-4.
    let mut solids = Solids::default();
    solids.pin(Vector::zeros(), 0.5, [0.0, 2.0], 0.2);
    solids.pin(X * 3e-4, 0.5, [1.0, 3.0], 1.2);
    let (model, volumes, area) = cut(solids, OverlapTo::First);
    assert_near(&volumes, &[0.5 * PI, 0.25 * PI]);
    assert_near(&[area], &[0.25 * PI + 0.5 * PI]);
    assert!(model.notes[0].starts_with("solids overlap: cut solid 1 out of solid 2"), "{:?}", model.notes);
}

#[test]
fn common_parts_thinner_than_the_error_of_triangles_are_cut() {
    // The block reaches 1e-4 into the pin.
    let mut solids = Solids::default();
    solids.pin(Vector::zeros(), 5.0, [0.0, 2.0], 0.2);
    solids.block([4.9999, -1.0, 0.5], [6.0, 1.0, 1.5]);
    let (model, volumes, area) = cut(solids, OverlapTo::First);
    assert_near(&volumes, &[50.0 * PI, 2.0]);
    assert!(model.notes[0].starts_with("solids overlap: cut solid 1 out of solid 2"), "{:?}", model.notes);
    // A strip between two lines, as wide as the chord at that depth.
    assert!((area - 2.0 * f64::sqrt(2.0 * 5.0 * 1e-4)).abs() < 1e-4, "{area}");
}
