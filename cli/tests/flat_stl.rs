//! A fixed selection of flat and needle-like STL parts; `cargo bench --bench flat_parts` runs two
//! hundred.

use crate::common::own_geometries;
use crate::flat_parts::{Outcome, run};

#[test]
fn flat_and_needle_like_parts_are_meshed_or_refused_by_name() {
    let (dir, geometries) = (tempfile::tempdir().unwrap(), own_geometries());
    let mut meshed = 0;
    for seed in (20..=24).chain(26..=32).chain(34..=38).chain([62]) {
        match run(seed, &geometries, dir.path()) {
            (_, _, Outcome::Meshed { tets, smallest }) => {
                assert!(tets > 0 && smallest >= 0.0, "part {seed}");
                meshed += 1;
            }
            // Rounding to few digits makes facets of thin walls intersect or touch.
            (part, _, Outcome::Refused(reason)) => {
                assert!(
                    ["intersect", "touch", "there are no triangles"]
                        .iter()
                        .any(|known| reason.contains(known)),
                    "{seed} {part:?}: {reason}"
                );
            }
            (part, _, Outcome::Failed(reason)) => panic!("part {seed} {part:?}: {reason}"),
        }
    }
    assert!(meshed >= 14, "{meshed}");
}
