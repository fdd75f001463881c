//! What the parts say of nodes and elements together, without one rank that hears all.
//!
//! Each id has a **home**, a rank told from the id alone. Readers send it the ids in their parts, and of shared nodes also the place and the
//! holders that `.shared` lists. The home compares, and answers with ids without gaps and with the ranks that hold the node now:
//!
//! ```text
//!   reader of part k ── ids; of shared nodes: place, holders ──► home: equal? listed by all that have it? once?
//!   reader of part k ◄── first fault, new ids, ranks ─────────── home
//! ```
//! Ids go as differences: a byte or two each.

use super::super::faults::FaultKind;
use super::super::parse::ReadError;
use super::own::{OwnPart, OwnParts, reader};
use super::{LoadError, fault};
use crate::comm::Communicator;
use crate::comm::pack::{numbers, put_ascending, put_varint, take_ascending, take_varint};
use crate::mesh::{GlobalId, Rank};
use std::ops::Range;

/// Ids of the whole mesh, from 0 without gaps, in the order of the files' ids.
#[derive(Default)]
pub(super) struct SettledIds {
    /// By part of this rank and place in `.nodes`.
    pub nodes: Vec<Vec<GlobalId>>,
    /// By part and place in `.elements`.
    pub elements: Vec<Vec<GlobalId>>,
    /// The nodes that several ranks hold, ascending, and these ranks, ascending.
    pub holders: Vec<(GlobalId, Vec<Rank>)>,
    /// The numbers of nodes and elements of the whole mesh.
    pub totals: [u64; 2],
}

/// Homes have blocks of ids from 0 to `most`.
#[derive(Clone, Copy)]
struct Homes {
    ranks: u32,
    most: u64,
}

impl Homes {
    /// The home of an id.
    fn of(self, id: u32) -> Rank {
        (u128::from(id) * u128::from(self.ranks) / u128::from(self.most + 1)) as Rank
    }

    /// The part of a list that ascends by id that is at home at `rank`.
    fn at<T>(self, rank: Rank, list: &[T], id: impl Fn(&T) -> u32) -> Range<usize> {
        let start = list.partition_point(|entry| self.of(id(entry)) < rank);
        start..start + list[start..].partition_point(|entry| self.of(id(entry)) == rank)
    }
}

/// What a home finds wrong.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Complaint {
    /// A node that another part has too is not in `.shared`.
    NotShared,
    /// The listed holders are not those that have the node.
    WrongHolders,
    /// The first listed is another than in another part.
    OwnersDiffer,
    /// The coordinates are others than in another part.
    CopiesDiffer,
    /// An element is in another part too.
    ElementTwice,
    /// The first listed, or the only part with the node, has it in halo elements only.
    OwnerWatches,
}

impl Complaint {
    const ALL: [Self; 6] = [
        Self::NotShared,
        Self::WrongHolders,
        Self::OwnersDiffer,
        Self::CopiesDiffer,
        Self::ElementTwice,
        Self::OwnerWatches,
    ];
}

/// **Collective.** New ids and holders.
///
/// # Errors
/// The first thing that does not fit, on the rank that reads the file.
pub(super) fn settle_ids(comm: &dyn Communicator, own: &OwnParts) -> Result<SettledIds, LoadError> {
    let most = |ids: &mut dyn Iterator<Item = u32>| u64::from(ids.max().unwrap_or(0));
    let largest = [
        most(&mut own.files().flat_map(|files| &files.nodes).map(|node| node.id)),
        most(&mut own.files().flat_map(|files| &files.elements).map(|element| element.id)),
    ];
    let homes = comm.all_reduce_max_u64(largest)?.map(|most| Homes { ranks: comm.size(), most });

    let mut asked = Vec::new();
    for (part, of_part) in (0..).zip(&own.list) {
        let number = own.number(part);
        asked.extend((0..comm.size()).filter_map(|home| question(of_part, number, home, homes)));
    }
    let judged = Judged::new(&comm.exchange_bytes(asked)?, own.parts, comm.size());
    let counts = judged.counts;
    let before = comm.exclusive_scan(counts)?;
    let totals = comm.all_reduce_sum_u64(counts)?;
    let answers = comm.exchange_bytes(judged.answers(before))?;
    let heard = hear(own, homes, &answers, totals);
    Ok(comm.agree(heard)?)
}

/// What the part of this number tells a home: nodes, then elements.
fn question(part: &OwnPart, number: u32, home: Rank, homes: [Homes; 2]) -> Option<(Rank, Vec<u8>)> {
    let Slices { nodes, shared, elements } = Slices::of(part, home, homes)?;
    let mut message = Vec::new();
    for count in [u64::from(number), nodes.len() as u64] {
        put_varint(&mut message, count);
    }
    let mut previous = 0;
    for (&(_, place), line) in nodes.iter().zip(shared) {
        let node = &part.files.nodes[place as usize];
        let watched = !part.nodes.holds(place as usize);
        let bits = u64::from(watched) << 1 | u64::from(line.is_some());
        put_varint(&mut message, u64::from(node.id - previous) << 2 | bits);
        previous = node.id;
        if let &Some(line) = line {
            message.extend_from_slice(bytemuck::cast_slice(node.point.coords.as_slice()));
            let parts = &part.files.shared[line as usize].parts;
            put_varint(&mut message, parts.len() as u64);
            parts.iter().for_each(|&part| put_varint(&mut message, part.into()));
        }
    }
    put_varint(&mut message, elements.len() as u64);
    put_ascending(&mut message, elements.iter().map(|&e| part.files.elements[e as usize].id.into()));
    Some((home, message))
}

/// The nodes of a part that are at home at a rank, by id and place, with their lines in `.shared`; and its elements, by place.
struct Slices<'a> {
    nodes: &'a [(u32, u32)],
    shared: &'a [Option<u32>],
    elements: &'a [u32],
}

impl<'a> Slices<'a> {
    /// None where there is nothing.
    fn of(part: &'a OwnPart, home: Rank, homes: [Homes; 2]) -> Option<Self> {
        let nodes = part.nodes.sorted();
        let here = homes[0].at(home, nodes, |(id, _)| *id);
        let elements = homes[1].at(home, &part.elements, |&e| part.files.elements[e as usize].id);
        Some(Self {
            nodes: &nodes[here.clone()],
            shared: &part.shared[here],
            elements: &part.elements[elements],
        })
        .filter(|slices| !slices.nodes.is_empty() || !slices.elements.is_empty())
    }
}

/// A node as one part tells it.
struct Copy {
    id: u64,
    /// Which letter.
    letter: usize,
    /// Whether halo elements alone have it there.
    watched: bool,
    /// Where it stands among what is told of shared nodes.
    said: Option<usize>,
}

/// What a part tells of a shared node.
struct Said {
    point: [u64; 3],
    /// From 1, the owner first.
    parts: Vec<u32>,
}

/// One letter: who sent it, of which part, and what it gets back.
struct Letter {
    from: Rank,
    /// From 1.
    part: u32,
    complaint: Option<(Complaint, u64, u32)>,
    /// New ids of nodes, and who holds those that several ranks have.
    nodes: Vec<(u64, Vec<Rank>)>,
    elements: Vec<u64>,
}

/// What a home has made of all questions.
struct Judged {
    letters: Vec<Letter>,
    /// Nodes and elements at home here.
    counts: [u64; 2],
}

impl Judged {
    fn new(asked: &[(Rank, Vec<u8>)], parts: u32, ranks: u32) -> Self {
        let (mut letters, mut copies, mut said) = (Vec::new(), Vec::new(), Vec::new());
        let mut elements: Vec<(u64, usize)> = Vec::new();
        for (letter, (from, message)) in asked.iter().enumerate() {
            let rest = &mut &message[..];
            let part = take_varint(rest) as u32 + 1;
            let mut id = 0;
            let count = take_varint(rest);
            copies.reserve(count as usize);
            let nodes = Vec::with_capacity(count as usize);
            for _ in 0..count {
                let code = take_varint(rest);
                id += code >> 2;
                let (watched, is_said) = (code & 2 == 2, code & 1 == 1);
                copies.push(Copy { id, letter, watched, said: is_said.then_some(said.len()) });
                if is_said {
                    said.push(Said::take(rest));
                }
            }
            let count = take_varint(rest) as usize;
            elements.extend(take_ascending(rest, count).map(|id| (id, letter)));
            let elements = Vec::with_capacity(count);
            letters.push(Letter { from: *from, part, complaint: None, nodes, elements });
        }
        // Stable, and letters come by ascending part: so do the copies of a node.
        copies.sort_by_key(|copy| copy.id);
        elements.sort();
        let mut judged = Self { letters, counts: [0; 2] };
        for copies in copies.chunk_by(|a, b| a.id == b.id) {
            judged.judge_node(copies, &said, parts, ranks);
        }
        for of_id in elements.chunk_by(|a, b| a.0 == b.0) {
            for pair in of_id.windows(2) {
                let before = judged.letters[pair[0].1].part;
                judged.complain(pair[1].1, Complaint::ElementTwice, pair[1].0, before);
            }
            of_id.iter().for_each(|(_, letter)| judged.letters[*letter].elements.push(judged.counts[1]));
            judged.counts[1] += 1;
        }
        judged
    }

    fn complain(&mut self, letter: usize, complaint: Complaint, id: u64, other: u32) {
        self.letters[letter].complaint.get_or_insert((complaint, id, other));
    }

    fn judge_node(&mut self, copies: &[Copy], said: &[Said], parts: u32, ranks: u32) {
        // Nearly all nodes.
        if let [Copy { letter, watched: false, said: None, .. }] = copies {
            self.letters[*letter].nodes.push((self.counts[0], Vec::new()));
            self.counts[0] += 1;
            return;
        }
        let part = |copy: &Copy| self.letters[copy.letter].part;
        let holders: Vec<u32> = copies.iter().map(part).collect();
        let held: Vec<u32> = copies.iter().filter(|copy| !copy.watched).map(part).collect();
        let first = copies[0].said.map(|k| &said[k]);
        for (copy, &part) in copies.iter().zip(&holders) {
            let other = holders.iter().copied().find(|&holder| holder != part).unwrap_or(part);
            let Some(own) = copy.said.map(|k| &said[k]) else {
                if copies.len() > 1 {
                    self.complain(copy.letter, Complaint::NotShared, copy.id, other);
                } else if copy.watched {
                    self.complain(copy.letter, Complaint::OwnerWatches, copy.id, part);
                }
                continue;
            };
            let mut listed = own.parts.clone();
            listed.sort_unstable();
            if listed != holders {
                self.complain(copy.letter, Complaint::WrongHolders, copy.id, other);
            }
            if !held.contains(&own.parts[0]) {
                self.complain(copy.letter, Complaint::OwnerWatches, copy.id, own.parts[0]);
            }
            let Some(first) = first else { continue };
            if own.parts[0] != first.parts[0] {
                self.complain(copy.letter, Complaint::OwnersDiffer, copy.id, holders[0]);
            }
            if own.point != first.point {
                self.complain(copy.letter, Complaint::CopiesDiffer, copy.id, holders[0]);
            }
        }
        let mut on: Vec<Rank> = held.iter().map(|part| reader(part - 1, parts, ranks)).collect();
        on.dedup();
        if on.len() == 1 {
            on.clear();
        }
        copies.iter().for_each(|copy| self.letters[copy.letter].nodes.push((self.counts[0], on.clone())));
        self.counts[0] += 1;
    }

    /// The answers, with how many nodes and elements there are before those of this home.
    fn answers(self, before: [u64; 2]) -> Vec<(Rank, Vec<u8>)> {
        let answer = |letter: Letter| {
            let mut message = Vec::new();
            let (code, id, other) = match letter.complaint {
                None => (0, 0, 0),
                Some((complaint, id, other)) => (1 + complaint as u64, id, other),
            };
            [code, id, other.into()].into_iter().for_each(|number| put_varint(&mut message, number));
            let mut previous = 0;
            for (place, holders) in letter.nodes {
                let id = before[0] + place;
                put_varint(&mut message, id - previous);
                previous = id;
                put_varint(&mut message, holders.len() as u64);
                put_ascending(&mut message, holders.into_iter().map(u64::from));
            }
            put_ascending(&mut message, letter.elements.into_iter().map(|place| before[1] + place));
            (letter.from, message)
        };
        self.letters.into_iter().map(answer).collect()
    }
}

impl Said {
    fn take(message: &mut &[u8]) -> Self {
        let (point, rest) = message.split_at(size_of::<[u64; 3]>());
        *message = rest;
        let point = numbers::<u64>(point);
        let count = take_varint(message);
        let parts = (0..count).map(|_| take_varint(message) as u32).collect();
        Self { point: [point[0], point[1], point[2]], parts }
    }
}

/// Reads the answers, in the order of the questions: homes ascend, and parts with each.
fn hear(
    own: &OwnParts,
    homes: [Homes; 2],
    answers: &[(Rank, Vec<u8>)],
    totals: [u64; 2],
) -> Result<SettledIds, ReadError> {
    let mut settled = SettledIds {
        nodes: own.files().map(|files| vec![0; files.nodes.len()]).collect(),
        elements: own.files().map(|files| vec![0; files.elements.len()]).collect(),
        holders: Vec::new(),
        totals,
    };
    let mut answers = answers.iter().peekable();
    let mut faults: Vec<(u32, ReadError)> = Vec::new();
    for home in 0..homes[0].ranks {
        for (number, part) in (0..).zip(&own.list) {
            let Some(Slices { nodes, elements, .. }) = Slices::of(part, home, homes) else { continue };
            let (from, message) = answers.next().expect("each question is answered");
            assert_eq!(*from, home, "the answer of a home");
            let rest = &mut &message[..];
            let [code, id, other] = [(); 3].map(|()| take_varint(rest));
            if code > 0 {
                faults.push((number, located(part, Complaint::ALL[code as usize - 1], id as u32, other)));
            }
            let mut node = 0;
            for &(_, place) in nodes {
                node += take_varint(rest);
                settled.nodes[number as usize][place as usize] = node;
                let count = take_varint(rest) as usize;
                let holders: Vec<Rank> = take_ascending(rest, count).map(|rank| rank as Rank).collect();
                if part.nodes.holds(place as usize) && count > 0 {
                    settled.holders.push((node, holders));
                }
            }
            for (&place, id) in elements.iter().zip(take_ascending(rest, elements.len())) {
                settled.elements[number as usize][place as usize] = id;
            }
        }
    }
    settled.holders.sort_unstable();
    settled.holders.dedup();
    // The first part's first, whatever homes there are.
    faults.sort_by_key(|(part, _)| *part);
    faults.into_iter().next().map_or(Ok(settled), |(_, fault)| Err(fault))
}

/// A complaint with its file and line.
fn located(part: &OwnPart, complaint: Complaint, id: u32, other: u64) -> ReadError {
    let files = &part.files;
    let node = || files.nodes.iter().position(|node| node.id == id).unwrap_or(0);
    let line = || files.shared.iter().position(|line| line.id == id).unwrap_or(0);
    let listed = || files.shared.get(line()).map(|line| &line.parts[..]).unwrap_or_default();
    let (kind, file, place, what) = match complaint {
        Complaint::NotShared => {
            let what = format!("node {id} is in part {other} too");
            (FaultKind::NotShared, "nodes", node(), what)
        }
        Complaint::WrongHolders => {
            let what = format!("node {id} is said to be in {:?}, which others do not hold or say", listed());
            (FaultKind::WrongHolders, "shared", line(), what)
        }
        Complaint::OwnersDiffer => {
            let what = format!("node {id} has another owner in part {other}");
            (FaultKind::OwnersDiffer, "shared", line(), what)
        }
        Complaint::CopiesDiffer => {
            let what = format!("node {id} is elsewhere in part {other}");
            (FaultKind::CopiesDiffer, "nodes", node(), what)
        }
        Complaint::ElementTwice => {
            let place = files.elements.iter().position(|element| element.id == id).unwrap_or(0);
            let line = files.elements.line(place);
            let what = format!("element {id} is in part {other} too");
            (FaultKind::ElementTwice, "elements", line - 1, what)
        }
        Complaint::OwnerWatches => {
            let what = format!("node {id}, part {other}");
            (FaultKind::OwnerWatches, "nodes", node(), what)
        }
    };
    fault(kind, files.file(file), place + 1, what)
}
