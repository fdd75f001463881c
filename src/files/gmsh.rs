//! What the writers of Gmsh's files have in common: physical groups of bodies or boundaries (one
//! for each name, and one for each unnamed number), numbers of shapes, and boxes.

use crate::ground::comm::{CommError, Communicator};
use crate::ground::mesh::stream::MeshStream;
use crate::ground::mesh::{Label, Order};
use std::collections::{BTreeMap, BTreeSet};

/// A name, or an unnamed number, with its tag in the file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Group {
    pub tag: u32,
    /// Empty for an unnamed number.
    pub name: String,
}

/// The groups of a list of labels.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct Groups {
    /// Sorted by tag.
    pub list: Vec<Group>,
    /// By label: the tags of its groups, that of the main name first.
    pub of: Vec<Vec<u32>>,
}

impl Groups {
    /// Assigns a tag to each name: the least number of its labels that is not taken. Main names
    /// come first. A name whose numbers are all taken gets a tag above the largest number.
    pub fn of(labels: &[Label]) -> Self {
        let mut taken: BTreeSet<u32> =
            labels.iter().filter(|label| label.names.is_empty()).map(|label| label.number).collect();
        let mut tags: BTreeMap<&str, u32> = BTreeMap::new();
        let main = labels.iter().filter_map(|label| Some((label.name()?, label.number)));
        let further = labels
            .iter()
            .flat_map(|label| label.names.iter().skip(1).map(|name| (name.as_str(), label.number)));
        let mut wanted: Vec<(&str, u32)> = main.collect();
        wanted.sort_by_key(|(_, number)| *number);
        for (name, number) in wanted.into_iter().chain(further) {
            if !tags.contains_key(name) && taken.insert(number) {
                tags.insert(name, number);
            }
        }
        let mut next = labels.iter().map(|label| label.number).max().unwrap_or(0) + 1;
        for name in labels.iter().flat_map(|label| &label.names) {
            tags.entry(name).or_insert_with(|| {
                next += 1;
                next - 1
            });
        }
        let of_label = |label: &Label| match label.names.as_slice() {
            [] => vec![label.number],
            names => names.iter().map(|name| tags[name.as_str()]).collect(),
        };
        let mut list: Vec<Group> =
            tags.iter().map(|(name, tag)| Group { tag: *tag, name: (*name).to_string() }).collect();
        let unnamed = labels.iter().filter(|label| label.names.is_empty());
        list.extend(unnamed.map(|label| Group { tag: label.number, name: String::new() }));
        list.sort_by_key(|group| group.tag);
        list.dedup();
        Self { of: labels.iter().map(of_label).collect(), list }
    }

    /// Whether each label is in at most one group.
    pub fn are_apart(&self) -> bool {
        self.of.iter().all(|tags| tags.len() <= 1)
    }
}

/// Gmsh's numbers of triangles and tets of an order.
pub(super) fn types(order: Order) -> [u32; 2] {
    match order {
        Order::First => [2, 4],
        Order::Second => [9, 11],
    }
}

/// A box: least coordinates, then largest ones.
pub(super) type Bounds = [f64; 6];

/// *Local.* The bounding box of a part.
pub(super) fn bounds(part: &dyn MeshStream) -> Bounds {
    let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    for index in 0..part.vertex_blocks() {
        for point in part.vertex_points(index).iter() {
            for axis in 0..3 {
                low[axis] = low[axis].min(point[axis]);
                high[axis] = high[axis].max(point[axis]);
            }
        }
    }
    [low[0], low[1], low[2], high[0], high[1], high[2]]
}

/// **Collective.** The bounding box of the boxes of all ranks.
pub(super) fn bounds_of_all(
    comm: &dyn Communicator,
    [a, b, c, d, e, f]: Bounds,
) -> Result<Bounds, CommError> {
    let ([a, b, c], [d, e, f]) = (comm.all_reduce_min_f64([a, b, c])?, comm.all_reduce_max_f64([d, e, f])?);
    Ok([a, b, c, d, e, f])
}

/// Gmsh's section of names, with the dimension and tag of each.
pub(super) fn physical_names(patches: &Groups, bodies: &Groups) -> String {
    let mut list = String::new();
    let mut count = 0;
    for (dimension, groups) in [(2, patches), (3, bodies)] {
        for group in groups.list.iter().filter(|group| !group.name.is_empty()) {
            let name = group.name.replace(['"', '\n', '\r'], "_");
            list += &format!("{dimension} {} \"{name}\"\n", group.tag);
            count += 1;
        }
    }
    format!("$PhysicalNames\n{count}\n{list}$EndPhysicalNames\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tags(labels: &[Label]) -> Vec<Vec<u32>> {
        Groups::of(labels).of
    }

    fn several(number: u32, names: &[&str]) -> Label {
        Label { number, names: names.iter().map(ToString::to_string).collect() }
    }

    #[test]
    fn a_name_is_one_group_whatever_the_numbers() {
        let labels = [4, 2, 3, 9].map(|number| Label::new(number, "skin"));
        let groups = Groups::of(&labels);
        assert_eq!(groups.list, [Group { tag: 2, name: "skin".into() }]);
        assert_eq!(groups.of, vec![vec![2]; 4]);
    }

    #[test]
    fn unnamed_numbers_keep_theirs_and_no_name_takes_them() {
        let labels = [Label::new(3, "skin"), Label::unnamed(3), Label::unnamed(8), Label::unnamed(8)];
        assert_eq!(tags(&labels), [[9], [3], [8], [8]]);
        assert_eq!(Groups::of(&labels).list.len(), 3);
    }

    #[test]
    fn groups_that_overlap_get_different_tags() {
        let labels =
            [several(1, &["all"]), several(2, &["all", "clamp"]), several(5, &["all", "clamp", "hot"])];
        assert_eq!(tags(&labels), [vec![1], vec![1, 2], vec![1, 2, 5]]);
        assert!(!Groups::of(&labels).are_apart() && Groups::of(&labels[..1]).are_apart());
        // One number with two names, and two labels of one number.
        assert_eq!(tags(&[several(1, &["a", "b"])]), [[1, 2]]);
        assert_eq!(tags(&[several(1, &["a"]), several(1, &["b"])]), [[1], [2]]);
    }
}
