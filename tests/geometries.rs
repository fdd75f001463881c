//! Our own geometries: every rank count and level of the plan, judged by both checkers.

use crate::common::{judge, own, own_geometries, report_of, succeed, tetmill};
use std::f64::consts::PI;

/// All geometries at some rank count and level, so that the rank counts and levels together see them all.
fn all_at(ranks: u32, levels: u32) {
    for geometry in own_geometries() {
        let dir = tempfile::tempdir().unwrap();
        let out = dir.path().join("out");
        let numbers = ["-n".to_string(), ranks.to_string(), "--levels".into(), levels.to_string()];
        let mut command = tetmill();
        command.arg("generate").arg(&geometry).args(numbers).args(["--preset", "very-coarse", "-q", "-o"]);
        succeed(command.arg(&out));
        judge(&out, ranks);
    }
}

#[test]
fn one_rank_without_refinement() {
    all_at(1, 0);
}

#[test]
fn two_ranks_and_one_level() {
    all_at(2, 1);
}

#[test]
fn four_ranks_and_two_levels() {
    all_at(4, 2);
}

#[test]
fn sixteen_ranks_and_one_level() {
    all_at(16, 1);
}

/// A circular frustum's volume.
fn frustum(height: f64, r: f64, s: f64) -> f64 {
    PI * height / 3.0 * (r * r + r * s + s * s)
}

#[test]
fn volumes_converge_to_the_true_ones_with_the_second_order() {
    let cases = [
        ("dome", 2.0 / 3.0 * PI * (3.0 * 2.0 * 1.5 - 2.4 * 1.4 * 1.0)),
        ("ring_segment", 0.5 * PI * PI * 3.0 * (1.0 - 0.36)),
        ("nozzle", frustum(3.0, 2.0, 0.8) + PI * 0.64 + frustum(4.0, 0.8, 1.6)),
    ];
    for (name, exact) in cases {
        let error = |levels: &str| {
            let report = report_of(&own(name), &["--levels", levels, "--preset", "coarse"]);
            (report["mesh"]["volume"].as_f64().unwrap() - exact).abs()
        };
        let [once, twice] = [error("2"), error("3")];
        // Halving all edges divides what the chords cut off by four.
        assert!((3.5..4.5).contains(&(once / twice)), "{name}: {once}, then {twice}");
        assert!(twice < 2e-3 * exact, "{name}: {twice} of {exact}");
    }
}

/// Parts with tangent surfaces, tips and other degenerate places: the volume, and the numbers of corners,
/// curves and patches.
fn acceptance() -> Vec<(&'static str, f64, [u64; 3])> {
    let fillet = PI / 8.0 * (1.5 - 2.0 / (3.0 * PI)) * PI;
    let ice = 0.515_388_203;
    let cap = ice - 0.125;
    vec![
        ("rounded_block", 0.216 + 0.432 + 0.072 * PI + 0.032 / 3.0 * PI, [24, 48, 26]),
        ("boss_fillet", 36.0 + 2.625 * PI - fillet, [8, 15, 9]),
        ("rounded_rim", 3.667 * PI + 0.045 * (1.7 + 0.4 / PI) * PI * PI, [0, 3, 4]),
        ("capsule", 10.0 / 3.0 * PI, [0, 2, 3]),
        ("teardrop", PI - 0.6_f64.acos() + 0.48 + 64.0 / 75.0, [6, 9, 5]),
        ("bends", 0.09 * PI * (PI + 1.0) + 0.018 * PI, [0, 4, 5]),
        ("ice_cream", 7.0 / 6.0 * PI + PI * cap * cap * (ice - cap / 3.0), [0, 2, 3]),
        ("tips", 1.75 * PI, [7, 10, 11]),
        ("centre_hole", 16.0, [9, 13, 8]),
        ("linked_rings", 2.0 * PI * PI, [0, 0, 2]),
        ("equal_pipes", 12.0 * PI - 16.0 / 3.0, [2, 8, 6]),
        ("far_fillet", 6.0 - 0.09 * (1.0 - PI / 4.0), [10, 15, 7]),
    ]
}

#[test]
fn tangent_and_pointed_parts_have_their_features_and_volumes() {
    for (name, exact, entities) in acceptance() {
        let error = |levels: &str| {
            let report = report_of(&own(name), &["--levels", levels, "--preset", "coarse"]);
            let found =
                ["corners", "curves", "patches"].map(|kind| report["entities"][kind].as_u64().unwrap());
            assert_eq!(found, entities, "{name}");
            (report["mesh"]["volume"].as_f64().unwrap() - exact).abs()
        };
        let [once, twice] = [error("1"), error("2")];
        // Far from the origin coordinates have ten digits less.
        let rounding = 1e-9 * exact;
        assert!(twice <= 0.01 * exact, "{name}: {twice} of {exact}");
        assert!(twice <= 0.35 * once + rounding, "{name}: {once}, then {twice}");
    }
}
