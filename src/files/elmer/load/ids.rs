//! Checks nodes and elements across parts and renumbers them, without a rank that has all ids.
//!
//! Each id has a **directory rank** (rendezvous), computed from the id alone. Readers send it the
//! ids of their parts, and for shared nodes also the coordinates and the parts listed in `.shared`.
//! The directory rank compares them and returns contiguous ids and the ranks that hold the node
//! now:
//!
//! ```text
//!   reader of part k ── ids; of shared nodes: coordinates, parts ──► directory: equal? complete? unique?
//!   reader of part k ◄── first fault, new ids, ranks ─────────────── directory
//! ```
//! Ids are sent as differences, one or two bytes each.

use super::super::faults::FaultKind;
use super::own::{OwnPart, OwnParts, reader};
use super::{LoadError, fault};
use crate::files::input::ReadError;
use crate::ground::comm::Communicator;
use crate::ground::comm::pack::{numbers, put_ascending, put_varint, take_ascending, take_varint};
use crate::ground::mesh::{GlobalId, Rank};
use std::ops::Range;

/// Contiguous ids of the whole mesh from 0, in the order of the ids in the files.
#[derive(Default)]
pub(super) struct NewIds {
    /// By part of this rank and index in `.nodes`.
    pub nodes: Vec<Vec<GlobalId>>,
    /// By part and index in `.elements`.
    pub elements: Vec<Vec<GlobalId>>,
    /// Nodes that several ranks hold, ascending, with these ranks, ascending.
    pub holders: Vec<(GlobalId, Vec<Rank>)>,
    /// Numbers of nodes and elements of the whole mesh.
    pub totals: [u64; 2],
}

/// Distributes the ids from 0 to `most` over the ranks in blocks.
#[derive(Clone, Copy)]
struct Directories {
    ranks: u32,
    most: u64,
}

impl Directories {
    /// The directory rank of an id.
    fn of(self, id: u32) -> Rank {
        (u128::from(id) * u128::from(self.ranks) / u128::from(self.most + 1)) as Rank
    }

    /// The range of a list sorted by id whose directory rank is `rank`.
    fn at<T>(self, rank: Rank, list: &[T], id: impl Fn(&T) -> u32) -> Range<usize> {
        let start = list.partition_point(|entry| self.of(id(entry)) < rank);
        start..start + list[start..].partition_point(|entry| self.of(id(entry)) == rank)
    }
}

/// A fault found by a directory rank.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Complaint {
    /// A node of several parts is missing in `.shared`.
    NotShared,
    /// The listed parts are not those that have the node.
    WrongHolders,
    /// The owner (the first listed part) differs from that in another part.
    OwnersDiffer,
    /// The coordinates differ from those in another part.
    CopiesDiffer,
    /// The element is in another part too.
    ElementTwice,
    /// The owner, or the only part with the node, has it in halo elements only.
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

/// **Collective.** Renumbers nodes and elements, and finds the ranks that hold each node.
///
/// # Errors
/// The first fault, on the rank that reads the file.
pub(super) fn renumber(comm: &dyn Communicator, own: &OwnParts) -> Result<NewIds, LoadError> {
    let most = |ids: &mut dyn Iterator<Item = u32>| u64::from(ids.max().unwrap_or(0));
    let largest = [
        most(&mut own.files().flat_map(|files| &files.nodes).map(|node| node.id)),
        most(&mut own.files().flat_map(|files| &files.elements).map(|element| element.id)),
    ];
    let directories = comm.all_reduce_max_u64(largest)?.map(|most| Directories { ranks: comm.size(), most });

    let mut requests = Vec::new();
    for (part, of_part) in (0..).zip(&own.list) {
        let number = own.number(part);
        requests.extend(
            (0..comm.size()).filter_map(|directory| request(of_part, number, directory, directories)),
        );
    }
    let checked = Directory::new(&comm.exchange_bytes(requests)?, own.parts, comm.size());
    let counts = checked.counts;
    let before = comm.exclusive_scan(counts)?;
    let totals = comm.all_reduce_sum_u64(counts)?;
    let replies = comm.exchange_bytes(checked.replies(before))?;
    let received = read_replies(own, directories, &replies, totals);
    comm.agree(received.map_err(LoadError::from))
}

/// The message of a part to a directory rank: nodes, then elements.
fn request(
    part: &OwnPart,
    number: u32,
    directory: Rank,
    directories: [Directories; 2],
) -> Option<(Rank, Vec<u8>)> {
    let Slices { nodes, shared, elements } = Slices::of(part, directory, directories)?;
    let mut message = Vec::new();
    for count in [u64::from(number), nodes.len() as u64] {
        put_varint(&mut message, count);
    }
    let mut previous = 0;
    for (&(_, place), line) in nodes.iter().zip(shared) {
        let node = &part.files.nodes[place as usize];
        let watched = !part.nodes.contains(place as usize);
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
    Some((directory, message))
}

/// The nodes of a part (id and index) assigned to one directory rank, with their lines in
/// `.shared`, and its elements (indices).
struct Slices<'a> {
    nodes: &'a [(u32, u32)],
    shared: &'a [Option<u32>],
    elements: &'a [u32],
}

impl<'a> Slices<'a> {
    /// `None` if both are empty.
    fn of(part: &'a OwnPart, directory: Rank, directories: [Directories; 2]) -> Option<Self> {
        let nodes = part.nodes.sorted();
        let here = directories[0].at(directory, nodes, |(id, _)| *id);
        let elements = directories[1].at(directory, &part.elements, |&e| part.files.elements[e as usize].id);
        Some(Self {
            nodes: &nodes[here.clone()],
            shared: &part.shared[here],
            elements: &part.elements[elements],
        })
        .filter(|slices| !slices.nodes.is_empty() || !slices.elements.is_empty())
    }
}

/// A node as one part lists it.
struct Copy {
    id: u64,
    /// Index of the message.
    message_index: usize,
    /// Whether only halo elements have the node in that part.
    watched: bool,
    /// Index into the list of `.shared` entries.
    listing: Option<usize>,
}

/// A part's entry for a shared node.
struct Listing {
    point: [u64; 3],
    /// From 1, the owner first.
    parts: Vec<u32>,
}

/// One message: sender, part, and the reply.
struct Message {
    from: Rank,
    /// From 1.
    part: u32,
    complaint: Option<(Complaint, u64, u32)>,
    /// New ids of nodes, and the ranks of nodes that several ranks hold.
    nodes: Vec<(u64, Vec<Rank>)>,
    elements: Vec<u64>,
}

/// The state of a directory rank after all messages.
struct Directory {
    messages: Vec<Message>,
    /// Number of nodes and elements assigned to this rank.
    counts: [u64; 2],
}

impl Directory {
    fn new(requests: &[(Rank, Vec<u8>)], parts: u32, ranks: u32) -> Self {
        let (mut messages, mut copies, mut listings) = (Vec::new(), Vec::new(), Vec::new());
        let mut elements: Vec<(u64, usize)> = Vec::new();
        for (message_index, (from, message)) in requests.iter().enumerate() {
            let rest = &mut &message[..];
            let part = take_varint(rest) as u32 + 1;
            let mut id = 0;
            let count = take_varint(rest);
            copies.reserve(count as usize);
            let nodes = Vec::with_capacity(count as usize);
            for _ in 0..count {
                let code = take_varint(rest);
                id += code >> 2;
                let (watched, is_listed) = (code & 2 == 2, code & 1 == 1);
                copies.push(Copy {
                    id,
                    message_index,
                    watched,
                    listing: is_listed.then_some(listings.len()),
                });
                if is_listed {
                    listings.push(Listing::take(rest));
                }
            }
            let count = take_varint(rest) as usize;
            elements.extend(take_ascending(rest, count).map(|id| (id, message_index)));
            let elements = Vec::with_capacity(count);
            messages.push(Message { from: *from, part, complaint: None, nodes, elements });
        }
        // The sort is stable and messages ascend by part, so the copies of a node do too.
        copies.sort_by_key(|copy| copy.id);
        elements.sort();
        let mut checked = Self { messages, counts: [0; 2] };
        for copies in copies.chunk_by(|a, b| a.id == b.id) {
            checked.check_node(copies, &listings, parts, ranks);
        }
        for of_id in elements.chunk_by(|a, b| a.0 == b.0) {
            for pair in of_id.windows(2) {
                let before = checked.messages[pair[0].1].part;
                checked.complain(pair[1].1, Complaint::ElementTwice, pair[1].0, before);
            }
            of_id.iter().for_each(|(_, message_index)| {
                checked.messages[*message_index].elements.push(checked.counts[1])
            });
            checked.counts[1] += 1;
        }
        checked
    }

    fn complain(&mut self, message_index: usize, complaint: Complaint, id: u64, other: u32) {
        self.messages[message_index].complaint.get_or_insert((complaint, id, other));
    }

    fn check_node(&mut self, copies: &[Copy], listings: &[Listing], parts: u32, ranks: u32) {
        // Most nodes are in one part only.
        if let [Copy { message_index, watched: false, listing: None, .. }] = copies {
            self.messages[*message_index].nodes.push((self.counts[0], Vec::new()));
            self.counts[0] += 1;
            return;
        }
        let part = |copy: &Copy| self.messages[copy.message_index].part;
        let holders: Vec<u32> = copies.iter().map(part).collect();
        let held: Vec<u32> = copies.iter().filter(|copy| !copy.watched).map(part).collect();
        let first = copies[0].listing.map(|k| &listings[k]);
        for (copy, &part) in copies.iter().zip(&holders) {
            let other = holders.iter().copied().find(|&holder| holder != part).unwrap_or(part);
            let Some(own) = copy.listing.map(|k| &listings[k]) else {
                if copies.len() > 1 {
                    self.complain(copy.message_index, Complaint::NotShared, copy.id, other);
                } else if copy.watched {
                    self.complain(copy.message_index, Complaint::OwnerWatches, copy.id, part);
                }
                continue;
            };
            let mut listed = own.parts.clone();
            listed.sort_unstable();
            if listed != holders {
                self.complain(copy.message_index, Complaint::WrongHolders, copy.id, other);
            }
            if !held.contains(&own.parts[0]) {
                self.complain(copy.message_index, Complaint::OwnerWatches, copy.id, own.parts[0]);
            }
            let Some(first) = first else { continue };
            if own.parts[0] != first.parts[0] {
                self.complain(copy.message_index, Complaint::OwnersDiffer, copy.id, holders[0]);
            }
            if own.point != first.point {
                self.complain(copy.message_index, Complaint::CopiesDiffer, copy.id, holders[0]);
            }
        }
        let mut on: Vec<Rank> = held.iter().map(|part| reader(part - 1, parts, ranks)).collect();
        on.dedup();
        if on.len() == 1 {
            on.clear();
        }
        copies
            .iter()
            .for_each(|copy| self.messages[copy.message_index].nodes.push((self.counts[0], on.clone())));
        self.counts[0] += 1;
    }

    /// The replies; `before` counts the nodes and elements of lower directory ranks.
    fn replies(self, before: [u64; 2]) -> Vec<(Rank, Vec<u8>)> {
        let reply = |sent: Message| {
            let mut message = Vec::new();
            let (code, id, other) = match sent.complaint {
                None => (0, 0, 0),
                Some((complaint, id, other)) => (1 + complaint as u64, id, other),
            };
            [code, id, other.into()].into_iter().for_each(|number| put_varint(&mut message, number));
            let mut previous = 0;
            for (place, holders) in sent.nodes {
                let id = before[0] + place;
                put_varint(&mut message, id - previous);
                previous = id;
                put_varint(&mut message, holders.len() as u64);
                put_ascending(&mut message, holders.into_iter().map(u64::from));
            }
            put_ascending(&mut message, sent.elements.into_iter().map(|place| before[1] + place));
            (sent.from, message)
        };
        self.messages.into_iter().map(reply).collect()
    }
}

impl Listing {
    fn take(message: &mut &[u8]) -> Self {
        let (point, rest) = message.split_at(size_of::<[u64; 3]>());
        *message = rest;
        let point = numbers::<u64>(point);
        let count = take_varint(message);
        let parts = (0..count).map(|_| take_varint(message) as u32).collect();
        Self { point: [point[0], point[1], point[2]], parts }
    }
}

/// Reads the replies, which come in the order of the requests: by directory rank, then by part.
fn read_replies(
    own: &OwnParts,
    directories: [Directories; 2],
    replies: &[(Rank, Vec<u8>)],
    totals: [u64; 2],
) -> Result<NewIds, ReadError> {
    let mut new_ids = NewIds {
        nodes: own.files().map(|files| vec![0; files.nodes.len()]).collect(),
        elements: own.files().map(|files| vec![0; files.elements.len()]).collect(),
        holders: Vec::new(),
        totals,
    };
    let mut replies = replies.iter().peekable();
    let mut faults: Vec<(u32, ReadError)> = Vec::new();
    for directory in 0..directories[0].ranks {
        for (number, part) in (0..).zip(&own.list) {
            let Some(Slices { nodes, elements, .. }) = Slices::of(part, directory, directories) else {
                continue;
            };
            let (from, message) = replies.next().expect("each request is answered");
            assert_eq!(*from, directory, "the reply of a directory");
            let rest = &mut &message[..];
            let [code, id, other] = [(); 3].map(|()| take_varint(rest));
            if code > 0 {
                faults.push((number, located(part, Complaint::ALL[code as usize - 1], id as u32, other)));
            }
            let mut node = 0;
            for &(_, place) in nodes {
                node += take_varint(rest);
                new_ids.nodes[number as usize][place as usize] = node;
                let count = take_varint(rest) as usize;
                let holders: Vec<Rank> = take_ascending(rest, count).map(|rank| rank as Rank).collect();
                if part.nodes.contains(place as usize) && count > 0 {
                    new_ids.holders.push((node, holders));
                }
            }
            for (&place, id) in elements.iter().zip(take_ascending(rest, elements.len())) {
                new_ids.elements[number as usize][place as usize] = id;
            }
        }
    }
    new_ids.holders.sort_unstable();
    new_ids.holders.dedup();
    // Report the fault of the first part, whatever the number of ranks.
    faults.sort_by_key(|(part, _)| *part);
    faults.into_iter().next().map_or(Ok(new_ids), |(_, fault)| Err(fault))
}

/// Turns a complaint into an error with file and line.
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
            let what = format!("node {id} is listed in parts {:?}, but other parts have it", listed());
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
