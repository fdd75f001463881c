//! A fixed few of the random scenes; `cargo bench --bench scenes` runs a thousand.

use crate::scenes::run::{Outcome, run};
use crate::scenes::scene::Style;

#[test]
fn random_scenes_in_general_position_are_meshed_as_their_text_means() {
    let dir = tempfile::tempdir().unwrap();
    for seed in 1..=40 {
        match run(seed, Style::General, dir.path()) {
            Outcome::Meshed { tets } => assert!(tets > 0, "scene {seed}"),
            Outcome::Empty => {}
            Outcome::Refused(reason) | Outcome::Failed(reason) => panic!("scene {seed}: {reason}"),
        }
    }
}

/// A plane touches a torus at its throat there, and the edge of an octahedron runs along a branch of what they have in common.
const THROAT: u64 = 982;
/// Surfaces touch there, and beside it a plane leaves a curve with the fourth power of the distance.
const SLOW: u64 = 468;

#[test]
fn random_scenes_on_a_grid_are_meshed_as_their_text_means_or_refused() {
    let dir = tempfile::tempdir().unwrap();
    let mut meshed = 0;
    for seed in (10..=25).chain([SLOW, THROAT]) {
        match run(seed, Style::Grid, dir.path()) {
            Outcome::Refused(reason) if seed == THROAT => panic!("{reason}"),
            Outcome::Meshed { .. } | Outcome::Empty => meshed += 1,
            // Surfaces that touch in a point or along a line are frequent there, and refused.
            Outcome::Refused(reason) => assert!(reason.contains("touch"), "scene {seed}: {reason}"),
            other => panic!("scene {seed}: {other:?}"),
        }
    }
    assert!(meshed >= 10, "{meshed}");
}
