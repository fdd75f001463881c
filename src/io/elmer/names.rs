//! `mesh.names`: numbers of bodies and boundaries by name.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

/// Names by number: those of bodies, and those of boundaries.
pub(crate) type NamesByNumber = [BTreeMap<i64, String>; 2];

/// The names of the mesh in `folder`: from `mesh.names` there, or in the folder above a partition; none where neither is.
pub(crate) fn names_of(folder: &Path) -> NamesByNumber {
    let places = [Some(folder), folder.parent()].into_iter().flatten();
    let text = places.filter_map(|place| fs::read_to_string(place.join("mesh.names")).ok()).next();
    names_in(&text.unwrap_or_default())
}

/// Lines `$ name = number …`, below a comment that says of what.
fn names_in(text: &str) -> NamesByNumber {
    let mut names = NamesByNumber::default();
    let mut kind = 0;
    for line in text.lines() {
        if let Some(comment) = line.trim().strip_prefix('!') {
            kind = usize::from(comment.contains("boundaries"));
        }
        let entry = line.trim().strip_prefix('$').and_then(|entry| entry.split_once('='));
        let Some((name, numbers)) = entry else { continue };
        for number in numbers.split_whitespace().filter_map(|number| number.parse().ok()) {
            names[kind].insert(number, name.trim().to_string());
        }
    }
    names
}
