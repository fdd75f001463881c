//! A fixed selection of the random scenes; `cargo bench --bench scenes` runs a thousand.

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

/// A plane is tangent to a torus at its throat there, and an edge of an octahedron follows a branch
/// of their intersection.
const THROAT: u64 = 982;
/// Contacts that are meshed: beside a contact a plane leaves a curve with the fourth power of the
/// distance; a spike between a torus and a rod; the tip of a cone on the edge of a box.
const CONTACTS: [u64; 4] = [THROAT, 468, 1556, 1863];

#[test]
fn random_scenes_on_a_grid_are_meshed_as_their_text_means_or_refused() {
    let dir = tempfile::tempdir().unwrap();
    let mut meshed = 0;
    for seed in (10..=25).chain(CONTACTS) {
        match run(seed, Style::Grid, dir.path()) {
            Outcome::Refused(reason) if CONTACTS.contains(&seed) => panic!("scene {seed}: {reason}"),
            Outcome::Meshed { .. } | Outcome::Empty => meshed += 1,
            // Surfaces that touch at a point or along a line are common on the grid, and refused.
            Outcome::Refused(reason) => assert!(reason.contains("touch"), "scene {seed}: {reason}"),
            other => panic!("scene {seed}: {other:?}"),
        }
    }
    assert!(meshed >= 10, "{meshed}");
}
