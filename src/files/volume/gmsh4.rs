//! The sections specific to Gmsh's MSH 4.1: entities, and nodes and elements in blocks.

use super::gmsh::{Ids, NO_NODES, Storage, known_type};
use super::gmsh_periodic;
use super::groups::Groups;
use super::raw::{Label, Raw, Shape};
use crate::Point;
use crate::files::input::{Bytes, Fault, Words};
use std::collections::{BTreeMap, BTreeSet};

/// State shared by the sections of a file.
#[derive(Default)]
pub(super) struct Parts {
    /// Ids of nodes, after their section.
    pub ids: Option<Ids>,
    /// Entities by dimension and tag.
    entities: BTreeMap<(i64, i64), Entity>,
    /// Tags of the volumes of ghosts: copies of tets of other parts, in the file of one part.
    ghosts: BTreeSet<i64>,
    /// Physical groups by dimension.
    pub groups: [Groups; 4],
}

/// A geometric entity.
#[derive(Clone, Default)]
struct Entity {
    /// Its physical groups.
    physical: Vec<i64>,
    /// The entity that it is a part of, by dimension and tag.
    parent: Option<(i64, i64)>,
}

/// A source of numbers, text or binary.
pub(super) enum Source<'a, 'w> {
    Text(&'w mut Words<'a>),
    Binary { words: &'w mut Words<'a>, bytes: Bytes<'a> },
}

impl Source<'_, '_> {
    /// Reads a number, of four bytes in binary.
    pub fn int(&mut self, what: &str) -> Result<i64, Fault> {
        match self {
            Self::Text(words) => words.int(what),
            Self::Binary { bytes, .. } => bytes.i32(what).map(i64::from),
        }
    }

    /// Reads a number, of eight bytes in binary.
    pub fn size(&mut self, what: &str) -> Result<u64, Fault> {
        match self {
            Self::Text(words) => {
                let number = words.int(what)?;
                u64::try_from(number).map_err(|_| words.fault(format!("{what} is negative")))
            }
            Self::Binary { bytes, .. } => bytes.u64(what),
        }
    }

    fn point(&mut self) -> Result<Point, Fault> {
        match self {
            Self::Text(words) => words.point("a coordinate"),
            Self::Binary { bytes, .. } => bytes.point_f64(),
        }
    }

    pub fn float(&mut self, what: &str) -> Result<f64, Fault> {
        match self {
            Self::Text(words) => words.float(what),
            Self::Binary { bytes, .. } => bytes.f64(what),
        }
    }

    /// Reads a count of items, each of at least this many numbers (text) or bytes (binary).
    pub fn count(&mut self, what: &str, numbers: usize, bytes_each: usize) -> Result<usize, Fault> {
        match self {
            Self::Text(words) => words.count(what, numbers),
            Self::Binary { bytes, .. } => {
                let count = bytes.u64(what)?;
                bytes.count(count, what, bytes_each)
            }
        }
    }

    pub fn fault(&self, message: impl Into<String>) -> Fault {
        match self {
            Self::Text(words) => words.fault(message),
            Self::Binary { bytes, .. } => bytes.fault(message),
        }
    }

    /// Continues with text after the binary data.
    fn finish(self) {
        if let Self::Binary { words, bytes } = self {
            words.go_to(bytes.offset());
        }
    }
}

/// Reads one section up to its end tag.
pub(super) fn section<'a>(
    name: &[u8],
    words: &mut Words<'a>,
    content: &'a [u8],
    storage: Storage,
    parts: &mut Parts,
    raw: &mut Raw,
) -> Result<(), Fault> {
    let mut source = match storage {
        Storage::Text => Source::Text(words),
        Storage::Binary { big_endian } => {
            let bytes = Bytes::new(content, words.offset(), big_endian);
            Source::Binary { words, bytes }
        }
    };
    match name {
        b"$Entities" => entities(&mut source, false, parts)?,
        b"$PartitionedEntities" => {
            source.size("the number of partitions")?;
            let ghosts = source.count("ghost entities", 2, 8)?;
            for _ in 0..ghosts {
                parts.ghosts.insert(source.int("the tag of a ghost entity")?);
                source.int("a partition")?;
            }
            entities(&mut source, true, parts)?;
        }
        b"$Periodic" => gmsh_periodic::version_4(&mut source, &parts.ids, raw)?,
        b"$Nodes" => parts.ids = Some(nodes(&mut source, raw)?),
        _ => elements(&mut source, parts, raw)?,
    }
    source.finish();
    Ok(())
}

fn entities(source: &mut Source, partitioned: bool, parts: &mut Parts) -> Result<(), Fault> {
    let mut counts = [0; 4];
    for count in &mut counts {
        *count = source.size("the number of entities")?;
    }
    for (dimension, count) in (0..).zip(counts) {
        for _ in 0..count {
            let tag = source.int("the tag of an entity")?;
            let mut entity = Entity::default();
            if partitioned {
                entity.parent = Some((source.int("a dimension")?, source.int("the tag of an entity")?));
                for _ in 0..source.count("partitions", 1, 4)? {
                    source.int("a partition")?;
                }
            }
            source.point()?;
            if dimension > 0 {
                source.point()?;
            }
            for _ in 0..source.count("physical tags", 1, 4)? {
                // The sign is the orientation.
                entity.physical.push(source.int("a physical tag")?.saturating_abs());
            }
            if dimension > 0 {
                for _ in 0..source.count("bounding entities", 1, 4)? {
                    source.int("the tag of an entity")?;
                }
            }
            parts.entities.insert((dimension, tag), entity);
        }
    }
    Ok(())
}

fn nodes(source: &mut Source, raw: &mut Raw) -> Result<Ids, Fault> {
    let blocks = source.size("the number of blocks")?;
    for what in ["the number of nodes", "the least id", "the largest id"] {
        source.size(what)?;
    }
    let mut ids = Vec::new();
    for _ in 0..blocks {
        let dimension = source.int("a dimension")?;
        source.int("the tag of an entity")?;
        let parametric = source.int("0 or 1 for parameters")?;
        let count = source.count("nodes", 4, 32)?;
        for _ in 0..count {
            ids.push(source.size("the id of a node")?);
        }
        for _ in 0..count {
            raw.points.push(source.point()?);
            // Parameters on the entity: one for each of its dimensions.
            for _ in 0..if parametric == 1 { dimension.clamp(0, 3) } else { 0 } {
                source.float("a parameter")?;
            }
        }
    }
    Ids::new(&ids)
}

fn elements(source: &mut Source, parts: &mut Parts, raw: &mut Raw) -> Result<(), Fault> {
    let Parts { ids, entities, ghosts, groups } = parts;
    let ids = ids.as_ref().ok_or_else(|| source.fault(NO_NODES))?;
    let blocks = source.size("the number of blocks")?;
    for what in ["the number of elements", "the least id", "the largest id"] {
        source.size(what)?;
    }
    let mut nodes = Vec::new();
    let (mut between_parts, mut ghost_tets) = (0, 0);
    for _ in 0..blocks {
        let dimension = source.int("a dimension")?;
        let tag = source.int("the tag of an entity")?;
        let code = source.int("the type of elements")?;
        let (shape, size) = known_type(code).map_err(|message| source.fault(message))?;
        let count = source.count("elements", 1 + size, 8 * (1 + size))?;
        let is_ghost = dimension == 3 && ghosts.contains(&tag);
        let label = if is_ghost {
            ghost_tets += count;
            None
        } else {
            label(entities, &mut groups[shape.dimension()], dimension, tag)
        };
        for _ in 0..count {
            let number = source.size("the id of an element")?;
            nodes.clear();
            for _ in 0..size {
                let id = source.size("the id of a node")?;
                nodes.push(ids.place(id).ok_or_else(|| source.fault(format!("there is no node {id}")))?);
            }
            match (label, shape) {
                (Some(label), _) => {
                    raw.add(shape, &nodes, label).map_err(|message| source.fault(message))?;
                    if shape == Shape::Tet {
                        raw.tet_numbers.push(number);
                    }
                }
                (None, Shape::Triangle) => between_parts += 1,
                (None, _) => {}
            }
        }
    }
    if ghost_tets > 0 {
        raw.notes.push(format!("{ghost_tets} ghost elements of other partitions left out"));
    }
    if between_parts > 0 {
        raw.notes.push(format!("{between_parts} triangles between partitions left out"));
    }
    Ok(())
}

/// The label of the elements of an entity; `None` for elements that only separate partitions.
fn label(
    entities: &BTreeMap<(i64, i64), Entity>,
    groups: &mut Groups,
    dimension: i64,
    tag: i64,
) -> Option<Label> {
    let nothing = Entity::default();
    let entity = entities.get(&(dimension, tag)).unwrap_or(&nothing);
    let (whole_dimension, whole) = entity.parent.unwrap_or((dimension, tag));
    if whole_dimension > dimension {
        return None;
    }
    let own = if entity.physical.is_empty() { entities.get(&(dimension, whole)) } else { Some(entity) };
    Some(Label { entity: whole, number: groups.set(own.map_or(&[], |own| &own.physical)) })
}
