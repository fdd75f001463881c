//! Flat and needle-like STL parts: the number meshed, and the reasons for the others.
//!
//! ```sh
//! cargo bench -p tetmill-cli --bench flat_parts               # 200 parts
//! cargo bench -p tetmill-cli --bench flat_parts -- 7 7        # some seeds; files are kept in target/flat_parts
//! ```

#[path = "../tests/flat_parts/mod.rs"]
mod flat_parts;
#[path = "../../tests/folders.rs"]
#[allow(dead_code)]
mod folders;
#[path = "../tests/limited.rs"]
mod limited;

use flat_parts::{Outcome, run};

fn main() {
    let words: Vec<u64> = std::env::args().skip(1).filter_map(|word| word.parse().ok()).collect();
    let dir = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../target/flat_parts");
    std::fs::create_dir_all(&dir).expect("the folder can be made");
    let [from, to] = [(0, 1), (1, 200)].map(|(i, other)| words.get(i).copied().unwrap_or(other));
    let geometries = folders::own_geometries();
    let (mut meshed, mut refused, mut failed, mut slowest) = ([0; 2], [0; 2], [0; 2], [0.0_f64; 2]);
    for seed in from..=to {
        let (part, seconds, outcome) = run(seed, &geometries, &dir);
        let keep = usize::from(part.keep);
        slowest[keep] = slowest[keep].max(seconds);
        match outcome {
            Outcome::Meshed { tets, smallest } => {
                meshed[keep] += 1;
                println!("{seed:4} meshed  {seconds:6.2} s {tets:8} tets {smallest:8.4}° {part:?}");
            }
            Outcome::Refused(reason) => {
                refused[keep] += 1;
                println!("{seed:4} refused {seconds:6.2} s {reason} {part:?}");
            }
            Outcome::Failed(reason) => {
                failed[keep] += 1;
                println!("{seed:4} FAILED  {seconds:6.2} s {reason} {part:?}");
            }
        }
    }
    for (k, mode) in ["remeshed", "kept"].into_iter().enumerate() {
        let (m, r, f, s) = (meshed[k], refused[k], failed[k], slowest[k]);
        println!("{mode}: {m} meshed, {r} refused, {f} failed, slowest {s:.1} s");
    }
}
