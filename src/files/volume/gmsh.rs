//! Gmsh's MSH, versions 2.x and 4.1, text and binary.
//!
//! ```text
//! $MeshFormat      version  0 text or 1 binary  size of a size_t      (binary: then the number 1)
//! $PhysicalNames   dimension  tag  "name"
//! $Nodes           2.x: id x y z              4.1: blocks, see `gmsh4`
//! $Elements        2.x: id type tags… nodes…
//! $Periodic       see `gmsh_periodic`
//! ```
//! Physical tags are groups of bodies and boundaries (see `groups`), elementary tags their
//! entities. Other sections are skipped.

use super::groups::Groups;
use super::raw::{Label, Raw, Shape};
use super::{gmsh_periodic, gmsh4, groups};
use crate::files::input::{Bytes, Fault, Words, shown};
use crate::files::node_order::GMSH;

/// Storage of numbers.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Storage {
    Text,
    Binary { big_endian: bool },
}

/// The ids of nodes, which may have gaps.
pub(super) struct Ids {
    first: u64,
    count: usize,
    /// Sorted ids with their indices; empty if the ids are contiguous.
    sorted: Vec<(u64, u32)>,
}

impl Ids {
    pub fn new(ids: &[u64]) -> Result<Self, Fault> {
        let first = ids.first().copied().unwrap_or(1);
        let mut found = Self { first, count: ids.len(), sorted: Vec::new() };
        if ids.iter().enumerate().all(|(k, &id)| id.checked_sub(first) == Some(k as u64)) {
            return Ok(found);
        }
        found.sorted = ids.iter().copied().zip(0..).collect();
        found.sorted.sort_unstable();
        match found.sorted.windows(2).find(|pair| pair[0].0 == pair[1].0) {
            Some(pair) => Err(Fault::file(format!("the node {} is there twice", pair[0].0))),
            None => Ok(found),
        }
    }

    pub fn place(&self, id: u64) -> Option<u32> {
        if self.sorted.is_empty() {
            return id.checked_sub(self.first).filter(|&k| k < self.count as u64).map(|k| k as u32);
        }
        let place = self.sorted.binary_search_by_key(&id, |(id, _)| *id).ok()?;
        Some(self.sorted[place].1)
    }
}

/// The shape and number of nodes of an element type.
pub(super) fn element_type(code: i64) -> Option<(Shape, usize)> {
    Some(match code {
        15 => (Shape::Point, 1),
        1 => (Shape::Edge, 2),
        8 => (Shape::Edge, 3),
        26 => (Shape::Edge, 4),
        27 => (Shape::Edge, 5),
        28 => (Shape::Edge, 6),
        2 => (Shape::Triangle, 3),
        9 => (Shape::Triangle, 6),
        20 => (Shape::Triangle, 9),
        21 => (Shape::Triangle, 10),
        4 => (Shape::Tet, 4),
        11 => (Shape::Tet, 10),
        29 => (Shape::Tet, 20),
        30 => (Shape::Tet, 35),
        31 => (Shape::Tet, 56),
        3 => (Shape::Other("quadrangle"), 4),
        10 => (Shape::Other("quadrangle"), 9),
        16 => (Shape::Other("quadrangle"), 8),
        5 => (Shape::Other("hexahedron"), 8),
        12 => (Shape::Other("hexahedron"), 27),
        17 => (Shape::Other("hexahedron"), 20),
        6 => (Shape::Other("prism"), 6),
        13 => (Shape::Other("prism"), 18),
        18 => (Shape::Other("prism"), 15),
        7 => (Shape::Other("pyramid"), 5),
        14 => (Shape::Other("pyramid"), 14),
        19 => (Shape::Other("pyramid"), 13),
        _ => return None,
    })
}

/// Like [`element_type`], with a message for unknown types.
pub(super) fn known_type(code: i64) -> Result<(Shape, usize), String> {
    element_type(code).ok_or_else(|| format!("the element type {code} is not known"))
}

pub(super) fn parse(content: &[u8]) -> Result<Raw, Fault> {
    let mut words = Words::new(content);
    let (version, storage) = header(&mut words, content)?;
    let mut raw = Raw { edge_order: Some(&GMSH), ..Raw::default() };
    let mut file = gmsh4::Parts::default();
    while let Some(section) = words.next() {
        words.rest_of_line();
        match (section, version, storage) {
            (b"$PhysicalNames", ..) => physical_names(&mut words, &mut file.groups)?,
            (b"$Nodes", Version::Two, Storage::Text) => file.ids = Some(nodes_text(&mut words, &mut raw)?),
            (b"$Nodes", Version::Two, Storage::Binary { big_endian }) => {
                file.ids = Some(nodes_binary(&mut words, content, big_endian, &mut raw)?);
            }
            (b"$Elements", Version::Two, Storage::Text) => elements_text(&mut words, &mut file, &mut raw)?,
            (b"$Elements", Version::Two, Storage::Binary { big_endian }) => {
                elements_binary(&mut words, content, big_endian, &mut file, &mut raw)?;
            }
            (b"$Periodic", Version::Two, _) => gmsh_periodic::version_2(&mut words, &file.ids, &mut raw)?,
            (
                b"$Entities" | b"$PartitionedEntities" | b"$Nodes" | b"$Elements" | b"$Periodic",
                Version::Four,
                _,
            ) => {
                gmsh4::section(section, &mut words, content, storage, &mut file, &mut raw)?;
            }
            (name, ..) if name.starts_with(b"$") => {
                skip_to_end(&mut words, name)?;
                continue;
            }
            (word, ..) => {
                return Err(
                    words.fault(format!("expected the beginning of a section, found `{}`", shown(word)))
                );
            }
        }
        words.expect(&format!("$End{}", String::from_utf8_lossy(&section[1..])))?;
    }
    if file.ids.is_none() {
        return Err(Fault::file("the file has no section $Nodes"));
    }
    let [_, _, of_triangles, of_tets] = &mut file.groups;
    groups::finish([of_triangles, of_tets], &mut raw);
    Ok(raw)
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Version {
    Two,
    Four,
}

fn header(words: &mut Words, content: &[u8]) -> Result<(Version, Storage), Fault> {
    let first = words.word("$MeshFormat")?;
    if first == b"$NOD" {
        return Err(words.fault("MSH of version 1 is not read; save it as version 4.1 or 2.2"));
    }
    if first != b"$MeshFormat" {
        return Err(words.fault(format!("expected `$MeshFormat`, found `{}`", shown(first))));
    }
    // NETGEN writes `2.000000`.
    let version = words.word("the version")?;
    let version = match crate::files::input::float(version) {
        Some(4.1) => Version::Four,
        Some(number) if (2.0..3.0).contains(&number) => Version::Two,
        _ => {
            let message =
                format!("MSH of version {} is not read; save it as version 4.1 or 2.2", shown(version));
            return Err(words.fault(message));
        }
    };
    let storage = match words.int("0 for text or 1 for binary")? {
        0 => Storage::Text,
        1 => Storage::Binary { big_endian: false },
        other => return Err(words.fault(format!("expected 0 for text or 1 for binary, found {other}"))),
    };
    if words.int("the size of a size_t")? != 8 {
        return Err(words.fault("numbers of other than 8 bytes are not read"));
    }
    words.rest_of_line();
    let storage = if storage == Storage::Text {
        storage
    } else {
        let mut bytes = Bytes::new(content, words.offset(), false);
        let one = bytes.i32("the number 1")?;
        words.go_to(bytes.offset());
        match one {
            1 => Storage::Binary { big_endian: false },
            _ if one.swap_bytes() == 1 => Storage::Binary { big_endian: true },
            _ => return Err(words.fault("expected the number 1 that marks the byte order")),
        }
    };
    words.expect("$EndMeshFormat")?;
    Ok((version, storage))
}

fn physical_names(words: &mut Words, groups: &mut [Groups; 4]) -> Result<(), Fault> {
    let count = words.count("physical names", 3)?;
    for _ in 0..count {
        let dimension = words.int("a dimension")?;
        let tag = words.int("a physical tag")?;
        let name = String::from_utf8_lossy(words.rest_of_line()).into_owned();
        let name = name.trim_matches('"').to_string();
        if let Some(groups) = usize::try_from(dimension).ok().and_then(|dimension| groups.get_mut(dimension))
        {
            groups.names.insert(tag, name);
        }
    }
    Ok(())
}

/// Skips a section.
fn skip_to_end(words: &mut Words, section: &[u8]) -> Result<(), Fault> {
    let end = [b"$End", &section[1..]].concat();
    let rest = words.rest();
    match rest.windows(end.len()).position(|window| window == end) {
        Some(place) => words.go_to(words.offset() + place + end.len()),
        None => {
            return Err(
                words.fault(format!("the section {} has no end: the file is cut off", shown(section)))
            );
        }
    }
    Ok(())
}

fn nodes_text(words: &mut Words, raw: &mut Raw) -> Result<Ids, Fault> {
    let count = words.count("nodes", 4)?;
    let mut ids = Vec::with_capacity(count);
    raw.points.reserve(count);
    for _ in 0..count {
        ids.push(id(words)?);
        raw.points.push(words.point("a coordinate")?);
    }
    Ids::new(&ids)
}

/// Parses the id of a node.
pub(super) fn id(words: &mut Words) -> Result<u64, Fault> {
    let id = words.int("the id of a node")?;
    u64::try_from(id).map_err(|_| words.fault("the id of a node is negative"))
}

fn nodes_binary(words: &mut Words, content: &[u8], big_endian: bool, raw: &mut Raw) -> Result<Ids, Fault> {
    let count = words.count("nodes", 1)?;
    words.rest_of_line();
    let mut bytes = Bytes::new(content, words.offset(), big_endian);
    let count = bytes.count(count as u64, "nodes", 28)?;
    let mut ids = Vec::with_capacity(count);
    raw.points.reserve(count);
    for _ in 0..count {
        let id = bytes.i32("the id of a node")?;
        ids.push(u64::try_from(id).map_err(|_| bytes.fault("the id of a node is negative"))?);
        raw.points.push(bytes.point_f64()?);
    }
    words.go_to(bytes.offset());
    Ids::new(&ids)
}

pub(super) const NO_NODES: &str = "elements come before nodes";

/// The label of an element of version 2, from its first two tags.
fn label(shape: Shape, [physical, entity]: [i64; 2], groups: &mut [Groups; 4]) -> Label {
    // The sign is the orientation; 0 means no group.
    let physical = physical.saturating_abs();
    let tags: &[i64] = if physical == 0 { &[] } else { &[physical] };
    Label { entity, number: groups[shape.dimension()].set(tags) }
}

fn elements_text(words: &mut Words, file: &mut gmsh4::Parts, raw: &mut Raw) -> Result<(), Fault> {
    let ids = file.ids.as_ref().ok_or_else(|| words.fault(NO_NODES))?;
    let count = words.count("elements", 4)?;
    let mut nodes = Vec::new();
    for _ in 0..count {
        let number = words.int("the id of an element")?;
        let code = words.int("the type of an element")?;
        let (shape, size) = known_type(code).map_err(|message| words.fault(message))?;
        let tags = words.count("tags", 1)?;
        let mut first_tags = [0; 2];
        for k in 0..tags {
            let tag = words.int("a tag")?;
            if let Some(place) = first_tags.get_mut(k) {
                *place = tag;
            }
        }
        let label = label(shape, first_tags, &mut file.groups);
        nodes.clear();
        for _ in 0..size {
            let id = id(words)?;
            nodes.push(ids.place(id).ok_or_else(|| words.fault(format!("there is no node {id}")))?);
        }
        raw.add(shape, &nodes, label).map_err(|message| words.fault(message))?;
        if shape == Shape::Tet {
            raw.tet_numbers.push(number.unsigned_abs());
        }
    }
    Ok(())
}

fn elements_binary(
    words: &mut Words,
    content: &[u8],
    big_endian: bool,
    file: &mut gmsh4::Parts,
    raw: &mut Raw,
) -> Result<(), Fault> {
    let ids = file.ids.as_ref().ok_or_else(|| words.fault(NO_NODES))?;
    let total = words.count("elements", 1)?;
    words.rest_of_line();
    let mut bytes = Bytes::new(content, words.offset(), big_endian);
    let mut nodes = Vec::new();
    let mut done = 0;
    while done < total {
        let code = bytes.i32("the type of elements")?;
        let (shape, size) = known_type(code.into()).map_err(|message| bytes.fault(message))?;
        let count = bytes.i32("the number of elements")?;
        let tags = bytes.i32("the number of tags")?;
        let [count, tags] = [count, tags].map(|n| u64::try_from(n).unwrap_or(u64::MAX));
        let tags = bytes.count(tags, "tags", 4)?;
        let count = bytes.count(count, "elements", 4 * (1 + tags + size))?;
        if count == 0 {
            return Err(bytes.fault("a block of no elements"));
        }
        for _ in 0..count {
            let number = bytes.i32("the id of an element")?;
            let mut first_tags = [0; 2];
            for k in 0..tags {
                let tag = bytes.i32("a tag")?;
                if let Some(place) = first_tags.get_mut(k) {
                    *place = tag.into();
                }
            }
            let label = label(shape, first_tags, &mut file.groups);
            nodes.clear();
            for _ in 0..size {
                let id = bytes.i32("the id of a node")?;
                let place = u64::try_from(id).ok().and_then(|id| ids.place(id));
                nodes.push(place.ok_or_else(|| bytes.fault(format!("there is no node {id}")))?);
            }
            raw.add(shape, &nodes, label).map_err(|message| bytes.fault(message))?;
            if shape == Shape::Tet {
                raw.tet_numbers.push(number.unsigned_abs().into());
            }
        }
        done += count;
    }
    words.go_to(bytes.offset());
    Ok(())
}
