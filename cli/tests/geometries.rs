//! The geometries of this repository with several numbers of ranks and levels, checked by both
//! checkers.

use crate::common::{judge, own, own_geometries, report_of, succeed, tetmill};
use std::f64::consts::PI;

/// Meshes every other geometry with these ranks and levels. The tests together mesh each geometry
/// twice.
fn half_at(first: usize, ranks: u32, levels: u32) {
    for geometry in own_geometries().into_iter().skip(first).step_by(2) {
        let dir = tempfile::tempdir().unwrap();
        let out = dir.path().join("out");
        let numbers = ["-n".to_string(), ranks.to_string(), "--levels".into(), levels.to_string()];
        let mut command = tetmill();
        command.arg("generate").arg(&geometry).args(numbers).args(["--preset", "very-coarse", "-q"]);
        if geometry.ends_with("house.geo") {
            // Its coarsest mesh has nine tets.
            command.args(["--coarse", "16"]);
        }
        if geometry.ends_with("unit_cell.geo") {
            // Nearly all tets of its coarsest mesh touch periodic faces; they cannot be in 16 parts
            // as Elmer needs them.
            command.args(["--coarse", "1500"]);
        }
        succeed(command.arg("-o").arg(&out));
        judge(&out, ranks);
    }
}

/// The volume of a circular frustum.
fn frustum(height: f64, r: f64, s: f64) -> f64 {
    PI * height / 3.0 * (r * r + r * s + s * s)
}

#[test]
fn one_rank_without_refinement() {
    half_at(0, 1, 0);
}

#[test]
fn two_ranks_and_one_level() {
    half_at(1, 2, 1);
}

#[test]
fn four_ranks_and_two_levels() {
    half_at(0, 4, 2);
}

#[test]
fn sixteen_ranks_and_one_level() {
    half_at(1, 16, 1);
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
            let report = report_of(&own(name), &["--levels", levels, "--preset", "fine"]);
            (report["mesh"]["volume"].as_f64().unwrap() - exact).abs()
        };
        // At `fine` both runs have the same coarse mesh: no children are poor. The volume error of
        // chords is of second order.
        let [once, twice] = [error("2"), error("3")];
        assert!((3.8..4.2).contains(&(once / twice)), "{name}: {once}, then {twice}");
        assert!(twice < 2e-3 * exact, "{name}: {twice} of {exact}");
    }
}
