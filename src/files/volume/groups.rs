//! Physical groups of a Gmsh file: an element may be in several, but bodies and boundaries here
//! have one number each.

use super::raw::{Label, Raw};
use std::collections::{BTreeMap, BTreeSet};

/// The physical groups of the elements of one dimension. During reading the number of a label is
/// the index of a set of groups, from 1; 0 is the empty set.
#[derive(Clone, Debug, Default)]
pub(super) struct Groups {
    /// Names by tag.
    pub names: BTreeMap<i64, String>,
    sets: Vec<Vec<i64>>,
    /// Indices of the sets, by their sorted tags.
    places: BTreeMap<Vec<i64>, i64>,
}

impl Groups {
    /// Returns the index of a set. Its tags keep the order in which the file lists them first.
    pub fn set(&mut self, tags: &[i64]) -> i64 {
        if tags.is_empty() {
            return 0;
        }
        let mut sorted = tags.to_vec();
        sorted.sort_unstable();
        sorted.dedup();
        *self.places.entry(sorted).or_insert_with(|| {
            let mut own: Vec<i64> = Vec::new();
            tags.iter().for_each(|tag| {
                if !own.contains(tag) {
                    own.push(*tag)
                }
            });
            self.sets.push(own);
            self.sets.len() as i64
        })
    }

    fn tags(&self, set: i64) -> &[i64] {
        usize::try_from(set - 1).map_or(&[], |place| &self.sets[place])
    }

    /// Merges the copies of an element that version 2 has, one for each of its groups. Returns
    /// which elements were removed, if there may be any.
    fn join_copies<const N: usize>(
        &mut self,
        elements: &mut Vec<[u32; N]>,
        labels: &mut Vec<Label>,
    ) -> Option<Vec<bool>> {
        let mut first_set: BTreeMap<i64, i64> = BTreeMap::new();
        let mut with_several: BTreeSet<i64> = BTreeSet::new();
        for label in labels.iter() {
            if *first_set.entry(label.entity).or_insert(label.number) != label.number {
                with_several.insert(label.entity);
            }
        }
        if with_several.is_empty() {
            return None;
        }
        let key = |k: usize| {
            let mut corners = elements[k];
            corners.sort_unstable();
            (labels[k].entity, corners)
        };
        let mut order: Vec<_> = (0..elements.len())
            .filter(|&k| with_several.contains(&labels[k].entity))
            .map(|k| (key(k), k))
            .collect();
        order.sort_unstable();
        let mut is_copy = vec![false; elements.len()];
        for copies in order.chunk_by(|a, b| a.0 == b.0).filter(|copies| copies.len() > 1) {
            let first = copies[0].1;
            let mut tags = self.tags(labels[first].number).to_vec();
            for &(_, k) in &copies[1..] {
                // An element that is listed twice in one group is not such a copy.
                let more = self.tags(labels[k].number);
                if more.iter().any(|tag| !tags.contains(tag)) {
                    tags.extend(more);
                    is_copy[k] = true;
                }
            }
            labels[first].number = self.set(&tags);
        }
        let mut kept = is_copy.iter().map(|is_copy| !is_copy);
        elements.retain(|_| kept.next() == Some(true));
        let mut kept = is_copy.iter().map(|is_copy| !is_copy);
        labels.retain(|_| kept.next() == Some(true));
        Some(is_copy)
    }

    /// Replaces set indices in labels by body or boundary numbers, and returns the names of each
    /// number.
    ///
    /// A set of one group has the number of its tag. A set of several groups has a tag that no
    /// other set has, else a number above all tags, so that different sets have different numbers.
    /// Elements in no group get 0; if no element is in a group, they get the numbers of their
    /// entities.
    fn number(
        &mut self,
        labels: &mut [Label],
        kind: &str,
        notes: &mut Vec<String>,
    ) -> BTreeMap<i64, Vec<String>> {
        let used: BTreeSet<i64> = labels.iter().map(|label| label.number).collect();
        let used: Vec<i64> = used.into_iter().filter(|set| *set != 0).collect();
        if used.is_empty() {
            labels.iter_mut().for_each(|label| label.number = label.entity);
            return BTreeMap::new();
        }
        self.name_shared(&used, kind, notes);
        let mut sets_with: BTreeMap<i64, usize> = BTreeMap::new();
        used.iter().flat_map(|set| self.tags(*set)).for_each(|tag| *sets_with.entry(*tag).or_default() += 1);
        let mut next =
            sets_with.keys().chain(self.names.keys()).copied().max().unwrap_or(0).saturating_add(1);
        let mut numbers: BTreeMap<i64, i64> = BTreeMap::new();
        let mut names = BTreeMap::new();
        for set in used {
            let tags = self.tags(set);
            let number = match tags {
                [tag] => *tag,
                tags => tags.iter().copied().find(|tag| sets_with[tag] == 1).unwrap_or_else(|| {
                    next = next.saturating_add(1);
                    next - 1
                }),
            };
            numbers.insert(set, number);
            let mut of_set: Vec<String> = Vec::new();
            for name in tags.iter().filter_map(|tag| self.names.get(tag)) {
                // Groups with the same name are one.
                if !of_set.contains(name) {
                    of_set.push(name.clone());
                }
            }
            names.insert(number, of_set);
        }
        labels
            .iter_mut()
            .filter(|label| label.number != 0)
            .for_each(|label| label.number = numbers[&label.number]);
        names
    }

    /// Names unnamed groups that share elements with others, because one number cannot hold two
    /// tags.
    fn name_shared(&mut self, used: &[i64], kind: &str, notes: &mut Vec<String>) {
        let shared: BTreeSet<i64> =
            used.iter().map(|set| self.tags(*set)).filter(|tags| tags.len() > 1).flatten().copied().collect();
        for tag in shared {
            if self.names.get(&tag).is_none_or(String::is_empty) {
                let name = format!("group_{tag}");
                notes.push(format!(
                    "the physical group {tag} of {kind} has no name and is not alone on all of them: it is `{name}` here"
                ));
                self.names.insert(tag, name);
            }
        }
    }
}

/// Finishes a file; `groups` are those of triangles and of tets.
pub(super) fn finish([of_triangles, of_tets]: [&mut Groups; 2], raw: &mut Raw) {
    of_triangles.join_copies(&mut raw.triangles, &mut raw.triangle_labels);
    if let Some(is_copy) = of_tets.join_copies(&mut raw.tets, &mut raw.tet_labels) {
        let mut kept = is_copy.iter().map(|is_copy| !is_copy);
        raw.tet_numbers.retain(|_| kept.next() == Some(true));
    }
    raw.patch_names = of_triangles.number(&mut raw.triangle_labels, "boundaries", &mut raw.notes);
    raw.body_names = of_tets.number(&mut raw.tet_labels, "bodies", &mut raw.notes);
}
