//! NETGEN's `.vol`.
//!
//! NETGEN keeps names in a list by number, as long as the number of names in the file. Older
//! versions write out of bounds for larger numbers; newer ones ignore those names and call all
//! boundaries `default`. So each number from 1 to the largest gets a name here.

use super::{coordinates, listed};
use crate::files::WriteError;
use crate::files::domains;
use crate::files::joined::{Section, Whole};
use crate::files::node_order::{NETGEN, NETGEN_TRIANGLE, arranged};
use crate::ground::comm::Communicator;
use crate::ground::mesh::{Label, Names};
use std::collections::{BTreeMap, BTreeSet};

/// NETGEN's name for a body or boundary without a name.
const UNNAMED: &str = "default";

/// Numbers up to this one are kept despite gaps. NGSolve takes 0.02 s for this many regions, and 3
/// s for a million.
const LARGEST_KEPT: u32 = 10_000;

/// **Collective.** The sections of the file. NETGEN's tets are negatively oriented, so two vertices
/// are swapped. There are no edge segments.
pub(super) fn sections<'a>(
    comm: &dyn Communicator,
    whole: &'a Whole<'a>,
) -> Result<Vec<Section<'a>>, WriteError> {
    let counts = whole.totals;
    let [bodies, patches] = [&whole.names.bodies, &whole.names.patches].map(|list| Numbered::of(list));
    let domains = domains::find(comm, whole)?;
    let mut end = identifications(whole) + &singularities(whole);
    for (title, list) in [("materials", &bodies), ("bcnames", &patches)] {
        end += &format!("{title}\n{}\n", list.names.len());
        for (number, name) in (1..).zip(&list.names) {
            end += &format!("{number} {name}\n");
        }
    }
    let (of_bodies, of_domains) = (bodies.of.clone(), bodies.of);
    Ok(vec![
        Section::Text(format!("mesh3d\ndimension\n3\ngeomtype\n0\nsurfaceelements\n{}\n", counts.boundary)),
        Section::Triangles(Box::new(move |line, triangle| {
            let number = patches.of[triangle.patch.index()];
            line.int(u64::from(triangle.patch.0) + 1).blank().int(number.into());
            for body in domains.of(triangle) {
                let domain = body.and_then(|body| of_domains.get(body.index())).copied().unwrap_or(0);
                line.blank().int(domain.into());
            }
            line.blank().int(whole.order().triangle_nodes() as u64);
            let edges = arranged(triangle.edge_nodes, &NETGEN_TRIANGLE);
            whole.ids(line, triangle.vertices.iter().copied().chain(edges));
        })),
        Section::Text(format!("volumeelements\n{}\n", counts.tets)),
        Section::Tets(Box::new(move |line, tet| {
            let [a, b, c, d] = *tet.vertices;
            line.int(of_bodies[tet.body.index()].into()).blank().int(whole.order().tet_nodes() as u64);
            whole.ids(line, [b, a, c, d].into_iter().chain(arranged(tet.edge_nodes, &NETGEN)));
        })),
        Section::Text(format!("edgesegmentsgi2\n0\npoints\n{}\n", counts.vertices)),
        // NETGEN counts the vertices up to the largest number of a corner.
        Section::Vertices(Box::new(|line, _, point| coordinates(line, point))),
        Section::LastVertices(Box::new(|line, _, point| coordinates(line, point))),
        Section::Text(end + "endmesh\n"),
    ])
}

/// Names and numbers that the file cannot hold, one sentence each.
pub(super) fn losses(names: &Names) -> Vec<String> {
    let mut losses = Vec::new();
    for (kind, labels) in [("bodies", &names.bodies), ("boundaries", &names.patches)] {
        let mut report = |of: BTreeSet<(u32, String)>, what: &str| {
            if !of.is_empty() {
                losses.push(format!("{what}: of {kind}, {}", listed(of.into_iter().map(|(_, text)| text))));
            }
        };
        let further = labels.iter().filter(|label| label.names.len() > 1).map(|label| {
            let names: Vec<String> = label.names.iter().map(|name| format!("`{name}`")).collect();
            (label.number, format!("{} is {} without {}", label.number, names[0], names[1..].join(", ")))
        });
        report(further.collect(), "NETGEN has one name for a number");
        let changed = labels.iter().filter_map(|label| Some((label.number, label.name()?)));
        let changed = changed.filter(|(_, name)| word(name) != **name);
        report(
            changed.map(|(_, name)| (0, format!("`{name}` is `{}`", word(name)))).collect(),
            "NETGEN reads words",
        );
        let moved =
            labels.iter().zip(Numbered::of(labels).of).filter(|(label, number)| label.number != *number);
        let moved = moved.map(|(label, number)| {
            let name = label.name().map_or(String::new(), |name| format!(" (`{name}`)"));
            (label.number, format!("{}{name} is {number}", label.number))
        });
        report(moved.collect(), "NETGEN counts from 1, and has one name for a number");
    }
    losses
}

/// A name as one word, because older readers stop at a blank.
fn word(name: &str) -> String {
    name.split_whitespace().collect::<Vec<_>>().join("_")
}

/// The numbers of bodies or boundaries in the file.
#[derive(Debug, PartialEq, Eq)]
struct Numbered {
    /// By label.
    of: Vec<u32>,
    /// The names of the numbers 1 to the largest.
    names: Vec<String>,
}

impl Numbered {
    /// Keeps the numbers, unless the largest exceeds [`LARGEST_KEPT`] and most numbers below it are
    /// unused: then they are renumbered in order. If labels of one number have different names, all
    /// names but the first get numbers above the largest.
    fn of(labels: &[Label]) -> Self {
        let mut kinds: Vec<(u32, String)> =
            labels.iter().map(|label| (label.number, label.name().map_or(UNNAMED.into(), word))).collect();
        let of_label = kinds.clone();
        // The sort is stable: labels of one number keep their order.
        kinds.sort_by_key(|(number, _)| *number);
        let mut seen = BTreeSet::new();
        kinds.retain(|kind| seen.insert(kind.clone()));
        let largest = kinds.last().map_or(0, |(number, _)| *number);
        let count_anew = largest > LARGEST_KEPT && u64::from(largest) > 2 * kinds.len() as u64;
        let mut next = if count_anew { 1 } else { largest + 1 };
        let mut last = None;
        let mut numbers: BTreeMap<&(u32, String), u32> = BTreeMap::new();
        for kind in &kinds {
            let repeated = last.replace(kind.0) == Some(kind.0);
            let number = if count_anew || repeated { next } else { kind.0 };
            next += u32::from(count_anew || repeated);
            numbers.insert(kind, number);
        }
        let mut names = vec![UNNAMED.to_string(); numbers.values().copied().max().unwrap_or(0) as usize];
        for ((_, name), number) in &numbers {
            if let Some(place) = number.checked_sub(1) {
                names[place as usize].clone_from(name);
            }
        }
        Self { of: of_label.iter().map(|kind| numbers[kind]).collect(), names }
    }
}

/// NETGEN's pairs of vertices with their identification numbers, all periodic; empty without pairs.
fn identifications(whole: &Whole) -> String {
    /// NETGEN's code of periodic identifications.
    const PERIODIC: &str = " 2";
    let links = whole.part.links();
    let Some(count) = links.iter().map(|link| link.identification).max() else { return String::new() };
    let pair = |&[image, of, link]: &[u64; 3]| (links[link as usize].identification, of, image);
    let mut pairs: Vec<(u32, u64, u64)> = whole.pairs.iter().map(pair).collect();
    pairs.sort_unstable();
    pairs.dedup();
    let mut text = format!("identifications\n{}\n", pairs.len());
    for (number, of, image) in pairs {
        text += &format!("{of} {image} {number}\n");
    }
    text + &format!("identificationtypes\n{count}\n{}\n", PERIODIC.repeat(count as usize).trim_start())
}

/// NETGEN's factors of singular points and faces (on both sides). The file has no segments, so
/// edges have none.
fn singularities(whole: &Whole) -> String {
    let faces = whole.part.singular().patches;
    let faces: Vec<_> = faces.iter().map(|(patch, factor)| (u64::from(patch.0) + 1, *factor)).collect();
    let mut text = String::new();
    for (title, list) in [
        ("singular_points", &whole.singular_vertices),
        ("singular_face_inside", &faces),
        ("singular_face_outside", &faces),
    ] {
        if !list.is_empty() {
            text += &format!("{title}\n{}\n", list.len());
        }
        for (number, factor) in list {
            text += &format!("{number} {factor}\n");
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    fn numbered(labels: &[Label]) -> (Vec<u32>, Vec<String>) {
        let Numbered { of, names } = Numbered::of(labels);
        (of, names)
    }

    #[test]
    fn every_number_up_to_the_largest_has_a_name() {
        let labels =
            [Label::new(5, "skin"), Label::unnamed(2), Label::new(3, "a lid"), Label::new(5, "skin")];
        let names = ["default", "default", "a_lid", "default", "skin"].map(String::from).to_vec();
        assert_eq!(numbered(&labels), (vec![5, 2, 3, 5], names));
        assert_eq!(
            losses(&Names { patches: labels.to_vec(), ..Names::default() }),
            ["NETGEN reads words: of boundaries, `a lid` is `a_lid`"]
        );
    }

    #[test]
    fn large_sparse_numbers_are_counted_anew_and_large_dense_ones_stay() {
        let sparse = [Label::new(1_000_000, "skin"), Label::unnamed(7), Label::new(2_000_000_000, "lid")];
        let (of, names) = numbered(&sparse);
        assert_eq!((of, names), (vec![2, 1, 3], ["default", "skin", "lid"].map(String::from).to_vec()));
        let reported = losses(&Names { patches: sparse.to_vec(), ..Names::default() });
        assert_eq!(
            reported,
            [
                "NETGEN counts from 1, and has one name for a number: of boundaries, 7 is 1, 1000000 (`skin`) is 2, 2000000000 (`lid`) is 3"
            ]
        );
        let dense: Vec<Label> = (1..=20_000).map(Label::unnamed).collect();
        assert_eq!(numbered(&dense).0[19_999], 20_000);
        assert!(losses(&Names { patches: dense, ..Names::default() }).is_empty());
    }

    #[test]
    fn one_number_with_two_names_becomes_two() {
        let labels = [Label::new(1, "a"), Label::new(1, "b"), Label::unnamed(1), Label::new(2, "c")];
        assert_eq!(numbered(&labels).0, [1, 3, 4, 2]);
        assert_eq!(losses(&Names { bodies: labels.to_vec(), ..Names::default() }).len(), 1);
    }
}
