//! Medit's `.meshb`, versions 1 to 4, in the layout of libMeshb.
//!
//! ```text
//! 1 (order of bytes)  version  then blocks: keyword  position of the next  count  data
//!                     positions: 4 bytes, from version 3 on 8       counts and integers: 4 bytes, in version 4 8
//!                     coordinates: 4 bytes in version 1, else 8     last keyword 54, position 0
//! ```

use super::medit::{block, unread};
use super::raw::{Label, Raw, Shape};
use crate::files::input::{Bytes, Fault};
use crate::files::node_order::VTK;

const DIMENSION: i32 = 3;
const VERTICES: i32 = 4;
const END: i32 = 54;
/// Node orders of second-order elements, in which corners may not come first.
const ORDERINGS: [(i32, &str); 3] =
    [(127, "EdgesP2Ordering"), (129, "TrianglesP2Ordering"), (133, "TetrahedraP2Ordering")];

/// The blocks of elements by keyword code.
fn elements(code: i32) -> Option<(Shape, usize)> {
    block(match code {
        5 => "Edges",
        6 => "Triangles",
        7 => "Quadrilaterals",
        8 => "Tetrahedra",
        9 => "Prisms",
        10 => "Hexahedra",
        24 => "TrianglesP2",
        25 => "EdgesP2",
        27 => "QuadrilateralsQ2",
        30 => "TetrahedraP2",
        33 => "HexahedraQ2",
        49 => "Pyramids",
        _ => return None,
    })
}

struct Reader<'a> {
    bytes: Bytes<'a>,
    version: i32,
}

impl Reader<'_> {
    fn position(&mut self) -> Result<u64, Fault> {
        const WHAT: &str = "the position of the next block";
        if self.version >= 3 { self.bytes.u64(WHAT) } else { self.bytes.u32(WHAT).map(u64::from) }
    }

    fn int_size(&self) -> usize {
        if self.version == 4 { 8 } else { 4 }
    }

    fn int(&mut self, what: &str) -> Result<i64, Fault> {
        if self.version == 4 { self.bytes.i64(what) } else { self.bytes.i32(what).map(i64::from) }
    }

    fn count(&mut self, what: &str, bytes_each: usize) -> Result<usize, Fault> {
        let count = self.int("a count")?;
        self.bytes.count(u64::try_from(count).unwrap_or(u64::MAX), what, bytes_each)
    }

    fn vertex(&mut self) -> Result<u32, Fault> {
        let number = self.int("the number of a vertex")?;
        let index = number.checked_sub(1).and_then(|index| u32::try_from(index).ok());
        index.ok_or_else(|| self.bytes.fault(format!("there is no vertex {number}")))
    }
}

pub(super) fn parse(content: &[u8]) -> Result<Raw, Fault> {
    let mut bytes = Bytes::new(content, 0, false);
    match bytes.i32("the number 1")? {
        1 => {}
        other if other.swap_bytes() == 1 => bytes.set_big_endian(true),
        _ => return Err(Fault::byte(0, "expected the number 1: not a binary Medit mesh")),
    }
    let version = bytes.i32("the version")?;
    if !(1..=4).contains(&version) {
        return Err(bytes.fault(format!("the version {version} is not known; 1 to 4 are")));
    }
    let mut reader = Reader { bytes, version };
    let mut raw = Raw { edge_order: Some(&VTK), ..Raw::default() };
    loop {
        let keyword = reader.bytes.i32("a keyword")?;
        if keyword == END {
            break;
        }
        if let Some((_, name)) = ORDERINGS.iter().find(|(code, _)| *code == keyword) {
            return Err(reader.bytes.fault(unread(name)));
        }
        let at = reader.bytes.offset();
        let next = reader.position()?;
        match (keyword, elements(keyword)) {
            (DIMENSION, _) => {
                let dimension = reader.bytes.i32("the dimension")?;
                if dimension != 3 {
                    return Err(reader.bytes.fault(format!("a mesh of dimension {dimension}; 3 is needed")));
                }
            }
            (VERTICES, _) => vertices(&mut reader, &mut raw)?,
            (_, Some((shape, corners))) => block_of(&mut reader, shape, corners, &mut raw)?,
            _ => {}
        }
        if next == 0 {
            break;
        }
        if next <= at as u64 || next > content.len() as u64 {
            return Err(Fault::byte(at, format!("invalid position of the next block: byte {next}")));
        }
        reader.bytes.go_to(next as usize);
    }
    if raw.points.is_empty() {
        return Err(Fault::file("the file has no vertices"));
    }
    Ok(raw)
}

fn vertices(reader: &mut Reader, raw: &mut Raw) -> Result<(), Fault> {
    let single = reader.version == 1;
    let size = 3 * if single { 4 } else { 8 } + reader.int_size();
    let count = reader.count("vertices", size)?;
    raw.points = Vec::with_capacity(count);
    for _ in 0..count {
        let point = if single { reader.bytes.point_f32()? } else { reader.bytes.point_f64()? };
        raw.points.push(point);
        reader.int("a reference")?;
    }
    Ok(())
}

fn block_of(reader: &mut Reader, shape: Shape, corners: usize, raw: &mut Raw) -> Result<(), Fault> {
    let count = reader.count("elements", (corners + 1) * reader.int_size())?;
    let mut nodes = Vec::new();
    for _ in 0..count {
        nodes.clear();
        for _ in 0..corners {
            nodes.push(reader.vertex()?);
        }
        let label = Label::number(reader.int("a reference")?);
        raw.add(shape, &nodes, label).map_err(|message| reader.bytes.fault(message))?;
    }
    Ok(())
}
