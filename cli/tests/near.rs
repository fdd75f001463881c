//! A fixed selection of nearly coincident surfaces; `cargo bench --bench near_pairs` runs three
//! hundred.

use crate::common::{succeed, tetmill};
use crate::near_pairs::run::{Outcome, run};

/// So many tets more than without the gap are explained.
const MANY: u64 = 15_000;

#[test]
fn nearly_coincident_surfaces_are_meshed_merged_or_refused_with_the_reason() {
    let dir = tempfile::tempdir().unwrap();
    let mut meshed = 0;
    for seed in 1..=40 {
        match run(seed, dir.path()) {
            (_, _, Outcome::Meshed { tets, smallest, told }) => {
                assert!(smallest > 0.0 && (tets < MANY || told), "{seed}: {tets} tets, {smallest}°");
                meshed += 1;
            }
            (pair, _, Outcome::Refused { status, reason }) => {
                let known = ["apart at", "touch", "contains nothing"];
                assert!(
                    status == 2 && known.iter().any(|known| reason.contains(known)),
                    "{seed} {:?} {}: {status} {reason}",
                    pair.kind,
                    pair.gap
                );
            }
            (pair, _, Outcome::Failed(reason)) => panic!("{seed} {:?} {}: {reason}", pair.kind, pair.gap),
        }
    }
    assert!(meshed >= 28, "{meshed}");
}

/// A pin in a hole that is wider by `gap`.
fn pin(gap: f64) -> String {
    format!(
        "algebraic3d
solid block = orthobrick (0, 0, 0; 1, 1, 1);
solid housing = block and not cylinder (0.5, 0.5, -1; 0.5, 0.5, 2; {});
solid pin = cylinder (0.5, 0.5, -1; 0.5, 0.5, 2; 0.3) and plane (0, 0, 0; 0, 0, -1) and plane (0, 0, 1; 0, 0, 1);
tlo housing;
tlo pin;
",
        0.3 + gap
    )
}

#[test]
fn a_gap_that_is_too_small_is_refused_at_once_and_can_be_merged() {
    let dir = tempfile::tempdir().unwrap();
    let [file, out] = ["pin.geo", "pin.vtu"].map(|name| dir.path().join(name));
    std::fs::write(&file, pin(1e-6)).unwrap();
    let mesh = |more: &[&str]| {
        let mut command = tetmill();
        command.arg("mesh").arg(&file).args(["-t", "1", "-o"]).arg(&out).args(more);
        command
    };
    let refused = mesh(&[]).output().unwrap();
    let message = String::from_utf8_lossy(&refused.stderr).into_owned();
    assert_eq!(refused.status.code(), Some(2), "{message}");
    for part in ["`housing` (line 3)", "`pin` (line 4)", "only 1.000e-6 apart at (", "option `merge`, 1.1e-6"]
    {
        assert!(message.contains(part), "{part} in {message}");
    }
    assert!(!out.exists());
    let merged = String::from_utf8_lossy(&succeed(&mut mesh(&["--merge", "1.1e-6"])).stderr).into_owned();
    assert!(merged.contains("both are taken as one"), "{merged}");
}

#[test]
fn a_gap_is_told_once_however_often_the_mesh_is_made() {
    let dir = tempfile::tempdir().unwrap();
    let [file, out] = ["pin.geo", "pin.vtu"].map(|name| dir.path().join(name));
    std::fs::write(&file, pin(1e-3)).unwrap();
    let mut command = tetmill();
    command.arg("mesh").arg(&file).args(["-t", "1", "--coarse", "30000", "-o"]).arg(&out);
    let told = String::from_utf8_lossy(&succeed(&mut command).stderr).into_owned();
    assert_eq!(told.matches("this gap decides").count(), 1, "{told}");
}
