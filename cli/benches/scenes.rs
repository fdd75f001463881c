//! Random scenes: the number meshed, and the reasons for the others.
//!
//! ```sh
//! cargo bench -p tetmill-cli --bench scenes                      # 1000 of each style
//! cargo bench -p tetmill-cli --bench scenes -- general 200 250   # some seeds of one style; files are kept in target/scenes
//! ```

#[path = "../tests/limited.rs"]
mod limited;
#[path = "../tests/scenes/mod.rs"]
mod scenes;

use rayon::prelude::*;
use scenes::run::{Outcome, run};
use scenes::scene::Style;
use std::time::Instant;

fn main() {
    let words: Vec<String> = std::env::args().skip(1).filter(|w| w != "--bench").collect();
    let dir = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../target/scenes");
    std::fs::create_dir_all(&dir).expect("the folder can be made");
    let bound = |i: usize, other: u64| words.get(i).and_then(|w| w.parse().ok()).unwrap_or(other);
    let seeds = bound(1, 1)..=bound(2, 1000);
    for style in [Style::General, Style::Grid] {
        let name = format!("{style:?}").to_lowercase();
        if words.first().is_some_and(|word| *word != name) {
            continue;
        }
        let began = Instant::now();
        let all: Vec<u64> = seeds.clone().collect();
        let outcomes: Vec<(u64, Outcome)> =
            all.par_iter().map(|&seed| (seed, run(seed, style, &dir))).collect();
        report(&name, &outcomes, began.elapsed().as_secs_f64());
    }
}

fn report(style: &str, outcomes: &[(u64, Outcome)], seconds: f64) {
    let (mut meshed, mut tets, mut empty) = (0, 0, 0);
    let mut others: Vec<String> = Vec::new();
    for (seed, outcome) in outcomes {
        match outcome {
            Outcome::Meshed { tets: count } => (meshed, tets) = (meshed + 1, tets + count),
            Outcome::Empty => empty += 1,
            Outcome::Refused(reason) => others.push(format!("{seed:5} refused  {reason}")),
            Outcome::Failed(reason) => others.push(format!("{seed:5} FAILED   {reason}")),
        }
    }
    let count = outcomes.len();
    println!(
        "{style}: {count} scenes, {meshed} meshed ({tets} tets), {empty} empty, {} not meshed, {seconds:.0} s",
        others.len()
    );
    others.iter().for_each(|line| println!("{line}"));
}
