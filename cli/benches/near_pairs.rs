//! Pairs of surfaces with a very small gap: the number meshed, and the reasons for the others.
//!
//! ```sh
//! cargo bench -p tetmill-cli --bench near_pairs             # 300 pairs
//! cargo bench -p tetmill-cli --bench near_pairs -- 7 7      # some seeds; files are kept in target/near_pairs
//! ```

#[path = "../tests/limited.rs"]
mod limited;
#[path = "../tests/near_pairs/mod.rs"]
mod near_pairs;

use near_pairs::run::{Outcome, run};

fn main() {
    let words: Vec<u64> = std::env::args().skip(1).filter_map(|word| word.parse().ok()).collect();
    let dir = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../target/near_pairs");
    std::fs::create_dir_all(&dir).expect("the folder can be made");
    let [from, to] = [(0, 1), (1, 300)].map(|(i, other)| words.get(i).copied().unwrap_or(other));
    let (mut meshed, mut refused, mut given_up, mut failed, mut slowest) = (0, 0, 0, 0, 0.0_f64);
    for seed in from..=to {
        let (pair, seconds, outcome) = run(seed, &dir);
        slowest = slowest.max(seconds);
        let result = match outcome {
            Outcome::Meshed { tets, smallest, told } => {
                meshed += 1;
                format!("meshed  {tets:8} tets {smallest:8.4}°{}", if told { " told" } else { "" })
            }
            Outcome::Refused { status, reason } => {
                *(if status == 2 { &mut refused } else { &mut given_up }) += 1;
                format!("status {status} {reason}")
            }
            Outcome::Failed(reason) => {
                failed += 1;
                format!("FAILED  {reason}")
            }
        };
        let kind = format!("{:?}", pair.kind);
        println!("{seed:4} {kind:14} {:9.1e} {seconds:6.2} s {result}", pair.gap);
    }
    println!(
        "{meshed} meshed, {refused} refused, {given_up} given up, {failed} failed, slowest {slowest:.1} s"
    );
}
