//! `mesh.names`: numbers of bodies and boundaries by name.
//!
//! ```text
//! ! ----- names for bodies -----
//! $ steel = 1 2
//! ! ----- names for boundaries -----
//! $ wall = 3 4 ... 258
//! ! wall_2 continues wall
//! $ wall_2 = 259 260
//! ```
//! The limits are those of Elmer's reader, `ReadTargetNames` in `fem/src/MeshUtils.F90`: 1024
//! characters a line and 256 numbers a name. It drops the rest, and a second line of the same name,
//! without a message. So long lists are split over several names.

use crate::ground::mesh::{Label, Names};
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

/// The longest line that Elmer reads, in characters.
const MAX_CHARACTERS: usize = 1024;
/// The most numbers that Elmer reads of a name.
const MAX_NUMBERS: usize = 256;
/// The longest name: Elmer keeps 128 characters, and the suffixes that distinguish names need a
/// few.
const MAX_NAME: usize = 112;

/// Names by number: of bodies, then of boundaries.
pub(crate) type NamesByNumber = [BTreeMap<i64, Vec<String>>; 2];

/// Reads the names of the mesh in `folder` from `mesh.names` there or in the parent folder; none if
/// neither exists.
pub(crate) fn names_of(folder: &Path) -> NamesByNumber {
    let places = [Some(folder), folder.parent()].into_iter().flatten();
    let text = places.filter_map(|place| fs::read_to_string(place.join("mesh.names")).ok()).next();
    names_in(&text.unwrap_or_default())
}

/// Parses lines `$ name = number …`; the comment above them says whether they name bodies or
/// boundaries.
fn names_in(text: &str) -> NamesByNumber {
    let mut names = NamesByNumber::default();
    let mut kind = 0;
    let mut continued: BTreeMap<&str, &str> = BTreeMap::new();
    for line in text.lines() {
        if let Some(comment) = line.trim().strip_prefix('!') {
            match comment.split_once(CONTINUES) {
                Some((name, first)) => _ = continued.insert(name.trim(), first.trim()),
                None => kind = usize::from(comment.contains("boundaries")),
            }
        }
        let entry = line.trim().strip_prefix('$').and_then(|entry| entry.split_once('='));
        let Some((name, numbers)) = entry else { continue };
        let name = name.trim();
        let name = continued.get(name).copied().unwrap_or(name).to_string();
        for number in numbers.split_whitespace().filter_map(|number| number.parse().ok()) {
            let of_number: &mut Vec<String> = names[kind].entry(number).or_default();
            if !of_number.contains(&name) {
                of_number.push(name.clone());
            }
        }
    }
    names
}

/// In a comment: this name continues the list of another one.
const CONTINUES: &str = " continues ";

/// Returns the text of `mesh.names`: each name once, with all its numbers. Unnamed bodies and
/// boundaries are omitted.
///
/// Elmer ignores the case of names, ends them at `=`, and keeps bodies and boundaries in one list.
/// So a boundary with the name of a body gets the suffix `_boundary`.
pub(super) fn names_text(names: &Names) -> String {
    let bodies = by_name(&names.bodies);
    let mut boundaries = by_name(&names.patches);
    for (name, _) in &mut boundaries {
        while bodies.iter().any(|(body, _)| body.eq_ignore_ascii_case(name)) {
            name.push_str("_boundary");
        }
    }
    let mut taken: Vec<String> =
        bodies.iter().chain(&boundaries).map(|(name, _)| name.to_ascii_lowercase()).collect();
    let mut text = String::new();
    for (title, list) in [("bodies", bodies), ("boundaries", boundaries)] {
        text += &format!("! ----- names for {title} -----\n");
        for (name, numbers) in list {
            for (index, line) in lines_of(&numbers).into_iter().enumerate() {
                if index == 0 {
                    text += &format!("$ {name} = {line}\n");
                    continue;
                }
                let names = (index + 1..).map(|k| format!("{name}_{k}"));
                let next = names.into_iter().find(|next| !taken.contains(&next.to_ascii_lowercase()));
                let next = next.expect("an unused name in an endless list");
                text += &format!("! {next}{CONTINUES}{name}\n$ {next} = {line}\n");
                taken.push(next.to_ascii_lowercase());
            }
        }
    }
    text
}

/// Splits numbers into lines short enough for Elmer, also behind the longest name.
fn lines_of(numbers: &[u32]) -> Vec<String> {
    let room = MAX_CHARACTERS - "$  = ".len() - (MAX_NAME + "_boundary_99999".len());
    let mut lines: Vec<String> = Vec::new();
    let mut count = 0;
    for number in numbers.iter().map(u32::to_string) {
        match lines.last_mut().filter(|line| count < MAX_NUMBERS && line.len() + 1 + number.len() <= room) {
            Some(line) => {
                line.push(' ');
                line.push_str(&number);
                count += 1;
            }
            None => {
                lines.push(number);
                count = 1;
            }
        }
    }
    lines
}

/// Groups the numbers by name, in order of first appearance, with Elmer's reserved characters
/// replaced; numbers ascend.
fn by_name(list: &[Label]) -> Vec<(String, Vec<u32>)> {
    let mut named: Vec<(String, Vec<u32>)> = Vec::new();
    let mut place: BTreeMap<String, usize> = BTreeMap::new();
    for label in list {
        for name in label.names.iter().map(|name| readable(name)).filter(|name| !name.is_empty()) {
            let at = *place.entry(name.to_ascii_lowercase()).or_insert_with(|| {
                named.push((name, Vec::new()));
                named.len() - 1
            });
            let numbers = &mut named[at].1;
            if let Err(place) = numbers.binary_search(&label.number) {
                numbers.insert(place, label.number);
            }
        }
    }
    named
}

/// Replaces the characters that end a name in Elmer, and truncates to [`MAX_NAME`] bytes.
fn readable(name: &str) -> String {
    let one = |c: char| if c.is_control() || "=$!".contains(c) { '_' } else { c };
    let mut name: String = name.trim().chars().map(one).collect();
    while name.len() > MAX_NAME {
        name.pop();
    }
    name
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_lists_are_split_into_names_that_elmer_reads_whole_and_come_back_as_one() {
        let patches = (0..700).map(|k| Label::new(1_000_000 + k, "wall")).chain([Label::new(7, "wall_2")]);
        let names =
            Names { bodies: vec![Label::new(1, "wall"), Label::unnamed(2)], patches: patches.collect() };
        let text = names_text(&names);
        for line in text.lines() {
            assert!(line.len() <= MAX_CHARACTERS, "{} characters", line.len());
            let numbers = line.split_once('=').map_or(0, |(_, numbers)| numbers.split_whitespace().count());
            assert!(numbers <= MAX_NUMBERS, "{numbers} numbers");
        }
        let [bodies, boundaries] = names_in(&text);
        assert_eq!(bodies, [(1, vec!["wall".to_string()])].into());
        assert_eq!(boundaries.len(), 701);
        assert!((0..700).all(|k| boundaries[&(1_000_000 + k)] == ["wall_boundary"]));
        assert_eq!(boundaries[&7], ["wall_2"]);
        let words: Vec<&str> =
            text.lines().filter_map(|l| l.strip_prefix("$ ")?.split(" =").next()).collect();
        let mut unique = words.clone();
        unique.sort_unstable();
        unique.dedup();
        assert_eq!(unique.len(), words.len(), "{words:?}");
    }

    #[test]
    fn numbers_with_several_names_keep_all_and_unnamed_ones_get_none() {
        let several = Label { number: 3, names: vec!["all".into(), "clamp".into()] };
        let names = Names { bodies: vec![], patches: vec![several, Label::unnamed(4), Label::new(5, "all")] };
        let text = names_text(&names);
        assert!(text.ends_with("boundaries -----\n$ all = 3 5\n$ clamp = 3\n"), "{text}");
        let [_, boundaries] = names_in(&text);
        assert_eq!(boundaries[&3], ["all", "clamp"]);
        assert!(!boundaries.contains_key(&4));
    }
}
