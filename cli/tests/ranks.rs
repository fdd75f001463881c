//! The mesh does not depend on the numbers of ranks and threads.

use crate::common::{own, report_of};

fn checksum(geometry: &str, ranks: u32, threads: u32) -> String {
    let numbers = [ranks.to_string(), threads.to_string()];
    let arguments = ["--levels", "2", "--preset", "coarse", "-n", &numbers[0], "-t", &numbers[1]];
    let report = report_of(&own(geometry), &arguments);
    report["mesh"]["checksum"].as_str().unwrap().to_string()
}

fn one_mesh_for_all(geometry: &str) {
    let expected = checksum(geometry, 1, 1);
    for ranks in [1, 2, 3, 4, 7, 16] {
        for threads in [1, 2] {
            assert_eq!(checksum(geometry, ranks, threads), expected, "{ranks} ranks, {threads} threads");
        }
    }
}

#[test]
fn the_nozzle_is_the_same_for_all_ranks_and_threads() {
    one_mesh_for_all("nozzle");
}

#[test]
fn bodies_with_interfaces_are_the_same_for_all_ranks_and_threads() {
    one_mesh_for_all("fibres");
}

#[test]
fn another_mesh_has_another_checksum() {
    assert_ne!(checksum("nozzle", 1, 1), checksum("lens", 1, 1));
}

#[test]
fn three_hundred_ranks_do_not_fill_the_stacks_of_the_threads_they_share() {
    let report = report_of(&own("dome"), &["-n", "300", "--coarse", "4000", "--pieces", "2"]);
    assert_eq!(report["ranks"], 300);
    assert!(report["mesh"]["tets"].as_u64().unwrap() > 32_000);
}
