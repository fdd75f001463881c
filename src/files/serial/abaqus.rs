//! Abaqus and CalculiX: `.inp` with nodes, elements, and sets by number and by name.
//!
//! ```text
//! *NODE, NSET=NALL
//! *ELEMENT, TYPE=C3D10, ELSET=BODY_1    a block for each run of tets of a body
//! *NSET, NSET=BOUNDARY_2                the nodes of each boundary number
//! *ELSET, ELSET=BOUNDARY_2_S3           the tets whose face S3 is on it
//! *SURFACE, NAME=BOUNDARY_2             these faces together
//! *NSET, NSET=CLAMPED                   the same for each name
//! ```
//! A set may be defined in several blocks, which add up: so every rank writes its own.

use super::listed;
use crate::files::WriteError;
use crate::files::joined::{Section, Whole};
use crate::files::node_order::{VTK, arranged};
use crate::files::runs::Runs;
use crate::ground::comm::Communicator;
use crate::ground::mesh::stream::{MeshStream, NO_TET, TetBlock};
use crate::ground::mesh::{Label, Names, Order, numbers_by_name};
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;

/// Abaqus' number of the face opposite each corner.
const FACE: [u8; 4] = [3, 4, 2, 1];

/// The longest real number that CalculiX reads, in characters; the rest is cut off or refused.
const LONGEST_REAL: usize = 20;

/// The longest name of a set.
const LONGEST: usize = 80;

/// Numbers in a line of a set.
const PER_LINE: usize = 16;

/// **Collective.** The sections of the file.
pub(super) fn sections<'a>(
    comm: &dyn Communicator,
    whole: &'a Whole<'a>,
) -> Result<Vec<Section<'a>>, WriteError> {
    let bodies = Runs::of_bodies(whole.part);
    let faces = comm.agree(Faces::of(whole))?;
    let kinds = faces.kinds(comm)?;
    let kind = match whole.order() {
        Order::First => "C3D4",
        Order::Second => "C3D10",
    };
    let of_bodies = present_by_name(&whole.names.bodies, &body_numbers(comm, whole, &bodies)?);
    let of_boundaries = present_by_name(&whole.names.patches, &kinds.keys().copied().collect());
    let end = by_name("ELSET", "BODY", &of_bodies)
        + &surfaces(&kinds)
        + &by_name("NSET", "BOUNDARY", &of_boundaries)
        + &surfaces_by_name(&of_boundaries, &kinds);
    Ok(vec![
        Section::Text("*NODE, NSET=NALL\n".into()),
        Section::Vertices(Box::new(|line, number, point| {
            line.int(number);
            point.iter().for_each(|&x| _ = line.bytes(b", ").float_within(x, LONGEST_REAL));
        })),
        Section::Tets(Box::new(move |line, tet| {
            let run = bodies.find(tet.index);
            if run.first == tet.index {
                let title = format!("*ELEMENT, TYPE={kind}, ELSET=BODY_{}\n", tet.number);
                line.bytes(title.as_bytes());
            }
            line.int(whole.tet(tet));
            let nodes = tet.vertices.iter().copied().chain(arranged(tet.edge_nodes, &VTK));
            nodes.for_each(|v| _ = line.bytes(b", ").int(whole.numbering.vertex(v)));
        })),
        Section::Own(faces.text().into_bytes()),
        Section::Text(end),
    ])
}

/// **Collective.** The numbers of bodies that have tets, on any rank.
fn body_numbers(comm: &dyn Communicator, whole: &Whole, bodies: &Runs) -> Result<BTreeSet<u64>, WriteError> {
    let number = |of: u32| whole.names.bodies.get(of as usize).map(|label| u64::from(label.number));
    let mine: BTreeSet<u64> = bodies.0.iter().filter_map(|run| number(run.of)).collect();
    let mine: Vec<u64> = mine.into_iter().collect();
    Ok(comm.all_gather(&mine)?.concat().into_iter().collect())
}

/// The boundary of a part: by boundary number, its nodes, and by number and face, its tets.
#[derive(Default)]
struct Faces {
    nodes: BTreeMap<u64, BTreeSet<u64>>,
    tets: BTreeMap<(u64, u8), Vec<u64>>,
}

impl Faces {
    /// Reads the boundary, and the tets beside it.
    fn of(whole: &Whole) -> Result<Self, WriteError> {
        let part = whole.part;
        let mut faces = Self::default();
        let mut beside: Vec<(u64, [u32; 3], u64)> = Vec::new();
        let number_of = |v: u32| whole.numbering.vertex(v);
        whole.by_patch.visit(part, |block, first| {
            let number = crate::files::patch_number(block.patch, whole.names)?;
            let nodes = faces.nodes.entry(number).or_default();
            for (within, (triangle, parents)) in block.triangles.iter().zip(&block.parents).enumerate() {
                if whole.left_out.contains(first + within as u64) {
                    continue;
                }
                nodes.extend(triangle.iter().chain(block.edge_nodes_of(within)).map(|&v| number_of(v)));
                let parent = if parents[0] == NO_TET { parents[1] } else { parents[0] };
                beside.push((parent, *triangle, number));
            }
            Ok(())
        })?;
        faces.nodes.retain(|_, nodes| !nodes.is_empty());
        beside.sort_unstable();
        faces.find_tets(part, &beside, |tet| whole.numbering.tet(tet));
        Ok(faces)
    }

    /// Finds which face of its tet each triangle is; `beside` are sorted by tet.
    fn find_tets(
        &mut self,
        part: &dyn MeshStream,
        beside: &[(u64, [u32; 3], u64)],
        number: impl Fn(u64) -> u64,
    ) {
        let mut block = TetBlock::default();
        let mut rest = beside;
        for index in 0..part.tet_blocks() {
            let Some(&(next, ..)) = rest.first() else { break };
            part.tet_block(index, &mut block);
            let end = block.first_local + block.tets.len() as u64;
            if next >= end {
                continue;
            }
            let (here, after) = rest.split_at(rest.partition_point(|(tet, ..)| *tet < end));
            for (tet, triangle, boundary) in here {
                let corners = block.tets[(tet - block.first_local) as usize];
                let opposite = corners.iter().position(|corner| !triangle.contains(corner));
                let face = FACE[opposite.expect("a tet has a corner off its face")];
                self.tets.entry((*boundary, face)).or_default().push(number(*tet));
            }
            rest = after;
        }
    }

    /// **Collective.** The faces that tets have on each boundary number, on any rank.
    fn kinds(&self, comm: &dyn Communicator) -> Result<BTreeMap<u64, BTreeSet<u8>>, WriteError> {
        let mine: Vec<[u64; 2]> = self.tets.keys().map(|&(number, face)| [number, face.into()]).collect();
        let mut kinds: BTreeMap<u64, BTreeSet<u8>> = BTreeMap::new();
        for [number, face] in comm.all_gather(&mine)?.concat() {
            kinds.entry(number).or_default().insert(face as u8);
        }
        Ok(kinds)
    }

    fn text(&self) -> String {
        let mut text = String::new();
        for (boundary, nodes) in &self.nodes {
            let nodes: Vec<u64> = nodes.iter().copied().collect();
            put_set(&mut text, &format!("*NSET, NSET=BOUNDARY_{boundary}"), &nodes);
        }
        for ((boundary, face), tets) in &self.tets {
            put_set(&mut text, &format!("*ELSET, ELSET=BOUNDARY_{boundary}_S{face}"), tets);
        }
        text
    }
}

/// Appends a set of numbers.
fn put_set(text: &mut String, title: &str, numbers: &[u64]) {
    *text += title;
    for line in numbers.chunks(PER_LINE) {
        let numbers: Vec<String> = line.iter().map(u64::to_string).collect();
        write!(text, "\n{}", numbers.join(", ")).expect("memory can be written to");
    }
    text.push('\n');
}

/// The surface of each boundary number.
fn surfaces(kinds: &BTreeMap<u64, BTreeSet<u8>>) -> String {
    let one = |(number, faces): (&u64, &BTreeSet<u8>)| {
        format!("*SURFACE, NAME=BOUNDARY_{number}, TYPE=ELEMENT\n") + &faces_of(*number, faces)
    };
    kinds.iter().map(one).collect()
}

fn faces_of(number: u64, faces: &BTreeSet<u8>) -> String {
    faces.iter().map(|face| format!("BOUNDARY_{number}_S{face}, S{face}\n")).collect()
}

/// The numbers of each name of bodies or boundaries that have elements: a set of none is an error.
fn present_by_name(labels: &[Label], present: &BTreeSet<u64>) -> BTreeMap<String, BTreeSet<u64>> {
    let mut by_word: BTreeMap<String, BTreeSet<u64>> = BTreeMap::new();
    for (name, numbers) in numbers_by_name(labels) {
        let numbers = numbers.into_iter().map(u64::from).filter(|number| present.contains(number));
        by_word.entry(word(name)).or_default().extend(numbers);
    }
    by_word.retain(|_, numbers| !numbers.is_empty());
    by_word
}

/// A set for each name, of the sets of its numbers.
fn by_name(kind: &str, of: &str, names: &BTreeMap<String, BTreeSet<u64>>) -> String {
    let mut text = String::new();
    for (name, numbers) in names {
        write!(text, "*{kind}, {kind}={name}").expect("memory can be written to");
        numbers.iter().for_each(|number| text += &format!("\n{of}_{number}"));
        text.push('\n');
    }
    text
}

/// A surface for each name of boundaries.
fn surfaces_by_name(names: &BTreeMap<String, BTreeSet<u64>>, kinds: &BTreeMap<u64, BTreeSet<u8>>) -> String {
    let mut text = String::new();
    for (name, numbers) in names {
        writeln!(text, "*SURFACE, NAME={name}, TYPE=ELEMENT").expect("memory can be written to");
        for number in numbers {
            text += &kinds.get(number).map(|faces| faces_of(*number, faces)).unwrap_or_default();
        }
    }
    text
}

/// A name as Abaqus takes it: capitals, digits and underscores, a letter first.
fn word(name: &str) -> String {
    let plain = |c: char| if c.is_ascii_alphanumeric() { c.to_ascii_uppercase() } else { '_' };
    let mut word: String = name.chars().map(plain).collect();
    if !word.starts_with(|c: char| c.is_ascii_alphabetic()) {
        word.insert(0, 'N');
    }
    word.truncate(LONGEST);
    word
}

/// Names that the file has in another spelling, one sentence each.
pub(super) fn losses(names: &Names) -> Vec<String> {
    let changed = |labels: &[Label]| -> BTreeSet<String> {
        let names = labels.iter().flat_map(|label| &label.names);
        let other = names.filter(|name| !word(name).eq_ignore_ascii_case(name));
        other.map(|name| format!("`{name}` is `{}`", word(name))).collect()
    };
    let mut losses = Vec::new();
    for (kind, labels) in [("bodies", &names.bodies), ("boundaries", &names.patches)] {
        let changed = changed(labels);
        if !changed.is_empty() {
            losses.push(format!(
                "Abaqus' names have letters, digits and underscores: of {kind}, {}",
                listed(changed.into_iter())
            ));
        }
    }
    losses
}

#[cfg(test)]
mod tests {
    use super::super::{Format, write};
    use super::*;
    use crate::files::plain::PlainPart;
    use crate::files::testing::{names, two_tets};
    use crate::files::text::Line;

    #[test]
    fn two_tets_are_written_to_the_letter() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("m.inp");
        write(&PlainPart::whole(&two_tets()), &names(), &path).unwrap();
        let expected = "*NODE, NSET=NALL\n1, 0, 0, 0\n2, 1, 0, 0\n3, 0, 1, 0\n4, 0, 0, 1\n5, 1, 1, 1\n\
            *ELEMENT, TYPE=C3D4, ELSET=BODY_1\n1, 1, 2, 3, 4\n2, 2, 3, 4, 5\n\
            *NSET, NSET=BOUNDARY_1\n1, 2, 3, 4\n*NSET, NSET=BOUNDARY_2\n2, 3, 4, 5\n\
            *ELSET, ELSET=BOUNDARY_1_S1\n1\n*ELSET, ELSET=BOUNDARY_1_S2\n1\n*ELSET, ELSET=BOUNDARY_1_S4\n1\n\
            *ELSET, ELSET=BOUNDARY_2_S2\n2\n*ELSET, ELSET=BOUNDARY_2_S3\n2\n*ELSET, ELSET=BOUNDARY_2_S4\n2\n\
            *ELSET, ELSET=LOWER\nBODY_1\n\
            *SURFACE, NAME=BOUNDARY_1, TYPE=ELEMENT\nBOUNDARY_1_S1, S1\nBOUNDARY_1_S2, S2\nBOUNDARY_1_S4, S4\n\
            *SURFACE, NAME=BOUNDARY_2, TYPE=ELEMENT\nBOUNDARY_2_S2, S2\nBOUNDARY_2_S3, S3\nBOUNDARY_2_S4, S4\n\
            *NSET, NSET=LID\nBOUNDARY_2\n*NSET, NSET=SKIN\nBOUNDARY_1\n\
            *SURFACE, NAME=LID, TYPE=ELEMENT\nBOUNDARY_2_S2, S2\nBOUNDARY_2_S3, S3\nBOUNDARY_2_S4, S4\n\
            *SURFACE, NAME=SKIN, TYPE=ELEMENT\nBOUNDARY_1_S1, S1\nBOUNDARY_1_S2, S2\nBOUNDARY_1_S4, S4\n";
        assert_eq!(std::fs::read_to_string(&path).unwrap(), expected);
        assert_eq!(losses(&names()), Vec::<String>::new());
        assert_eq!(Format::of(&path).unwrap(), Format::Abaqus);
    }

    fn real(number: f64) -> String {
        let (mut line, mut text) = (Line::default(), Vec::new());
        line.float_within(number, LONGEST_REAL).end(&mut text);
        String::from_utf8(text).unwrap().trim_end().to_owned()
    }

    #[test]
    fn reals_have_at_most_twenty_characters() {
        assert_eq!(real(0.1), "0.1");
        assert_eq!(real(-8.414228370574178e-6), "-8.41422837057418e-6");
        assert_eq!(real(-0.0012345678901234567), "-1.23456789012346e-3");
        for number in [-1.2345678901234567e-300, 1.0 / 3.0, -2.0 / 3.0e7, 1.2345678901234567e15] {
            let text = real(number);
            assert!(text.len() <= 20, "{text}");
            assert!((text.parse::<f64>().unwrap() / number - 1.0).abs() < 1e-11, "{text}");
        }
    }

    #[test]
    fn names_are_made_words_that_begin_with_a_letter() {
        assert_eq!(["hot side", "2nd", "a-b"].map(word), ["HOT_SIDE", "N2ND", "A_B"]);
        let names = Names { bodies: vec![Label::new(1, "hot side")], patches: vec![Label::new(1, "Skin")] };
        assert_eq!(
            losses(&names),
            ["Abaqus' names have letters, digits and underscores: of bodies, `hot side` is `HOT_SIDE`"]
        );
    }
}
