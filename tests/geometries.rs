//! Our own geometries: every rank count and level of the plan, judged by both checkers.

use crate::common::{judge, own_geometries, succeed, tetmill};

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
