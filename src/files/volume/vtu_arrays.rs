//! The frame of a `.vtu` file, tag by tag, and the numbers of its arrays.
//!
//! The tags are parsed by hand, because a file with raw appended data is not well-formed XML.

use super::raw::NamesByNumber;
use crate::files::input::{Bytes, Fault, Words, shown};
use std::io::Read;

/// The section of an array.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Section {
    Points,
    Cells,
    PointData,
    CellData,
    FieldData,
}

/// Start of a comment with fields: MFEM's reader accepts fields nowhere else (see `io::vtu`).
const HIDDEN_FIELDS: &[u8] = b"<!-- <FieldData>";
/// Prefixes of the names of our fields: bodies, boundaries.
const NAMES: [&str; 2] = ["Body ", "Boundary "];

#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Format {
    Text,
    Base64,
    /// Offset after the underscore.
    Appended(usize),
}

/// A `DataArray`.
pub(super) struct Array<'a> {
    section: Section,
    name: String,
    kind: String,
    format: Format,
    /// The text between its tags.
    inline: &'a [u8],
    /// The properties of the file.
    frame: Frame<'a>,
}

/// Properties common to all arrays of a file.
#[derive(Clone, Copy, Default)]
struct Frame<'a> {
    content: &'a [u8],
    big_endian: bool,
    /// Whether lengths have eight bytes instead of four.
    long_lengths: bool,
    compressed: bool,
    /// Offset of the appended data after the underscore, and whether it is base64.
    appended: Option<(usize, bool)>,
}

/// All arrays of a file.
pub(super) struct Document<'a> {
    arrays: Vec<Array<'a>>,
    /// The names of the global-id arrays of points and cells, declared by their sections.
    global_ids: Vec<(Section, String)>,
}

/// A tag: name, attributes, and its range in the file.
pub(super) struct Tag<'a> {
    pub name: &'a str,
    attributes: &'a str,
    pub begin: usize,
    pub end: usize,
}

impl Tag<'_> {
    /// The value of an attribute with XML references resolved.
    pub fn text(&self, name: &str) -> Option<String> {
        self.attribute(name).map(unescaped)
    }

    pub fn attribute(&self, name: &str) -> Option<&str> {
        let mut rest = self.attributes;
        while let Some((before, after)) = rest.split_once('=') {
            let quote = after.trim_start().chars().next().filter(|c| *c == '"' || *c == '\'')?;
            let (value, behind) = after.trim_start()[1..].split_once(quote)?;
            if before.trim() == name {
                return Some(value);
            }
            rest = behind;
        }
        None
    }
}

/// Resolves XML references; invalid ones are kept as text.
fn unescaped(text: &str) -> String {
    let mut plain = String::with_capacity(text.len());
    let mut rest = text;
    while let Some((before, after)) = rest.split_once('&') {
        plain.push_str(before);
        let reference = after.split_once(';').and_then(|(name, behind)| Some((character(name)?, behind)));
        match reference {
            Some((c, behind)) => {
                plain.push(c);
                rest = behind;
            }
            None => {
                plain.push('&');
                rest = after;
            }
        }
    }
    plain + rest
}

/// The character of the reference `&name;`.
fn character(name: &str) -> Option<char> {
    let code = |digits: &str, radix| u32::from_str_radix(digits, radix).ok().and_then(char::from_u32);
    match name {
        "amp" => Some('&'),
        "lt" => Some('<'),
        "gt" => Some('>'),
        "quot" => Some('"'),
        "apos" => Some('\''),
        _ => match name.strip_prefix('#')? {
            digits if digits.starts_with(['x', 'X']) => code(&digits[1..], 16),
            digits => code(digits, 10),
        },
    }
}

/// Returns the next tag after an offset. Declarations and comments are skipped, except fields in a
/// comment.
pub(super) fn next_tag(content: &[u8], mut at: usize) -> Option<Tag<'_>> {
    loop {
        let begin = at + content[at..].iter().position(|&b| b == b'<')?;
        if content[begin..].starts_with(HIDDEN_FIELDS) {
            at = begin + 1;
            continue;
        }
        if content[begin..].starts_with(b"<!--") {
            at = begin + content[begin..].windows(3).position(|w| w == b"-->")? + 3;
            continue;
        }
        let end = begin + content[begin..].iter().position(|&b| b == b'>')? + 1;
        let text = std::str::from_utf8(&content[begin + 1..end - 1]).ok()?;
        if text.starts_with(['?', '!']) {
            at = end;
            continue;
        }
        let (name, attributes) = text.split_once(char::is_whitespace).unwrap_or((text, ""));
        return Some(Tag { name: name.trim_end_matches('/'), attributes, begin, end });
    }
}

impl<'a> Document<'a> {
    /// Parses all tags up to the appended data.
    pub fn read(content: &'a [u8]) -> Result<Self, Fault> {
        let mut frame = Frame { content, ..Frame::default() };
        let mut arrays: Vec<Array> = Vec::new();
        let mut section = None;
        let mut global_ids = Vec::new();
        let (mut at, mut pieces, mut is_vtk) = (0, 0, false);
        while let Some(tag) = next_tag(content, at) {
            at = tag.end;
            match tag.name {
                "VTKFile" => {
                    frame = header(&tag, frame)?;
                    is_vtk = true;
                }
                "Piece" => {
                    pieces += 1;
                    if pieces > 1 {
                        return Err(Fault::text(tag.begin, "a file of several pieces is not read"));
                    }
                }
                "Points" => section = Some(Section::Points),
                "Cells" => section = Some(Section::Cells),
                "PointData" | "CellData" => {
                    let of = if tag.name == "CellData" { Section::CellData } else { Section::PointData };
                    global_ids.extend(tag.text("GlobalIds").map(|name| (of, name)));
                    section = Some(of);
                }
                "FieldData" => section = Some(Section::FieldData),
                "/Points" | "/Cells" | "/PointData" | "/CellData" | "/FieldData" => section = None,
                "DataArray" => {
                    let Some(section) = section else { continue };
                    let is_ours = |name: &str| NAMES.iter().any(|kind| name.starts_with(kind));
                    if section == Section::FieldData && !tag.attribute("Name").is_some_and(is_ours) {
                        continue;
                    }
                    let inline = &content[tag.end..];
                    let inline = &inline[..inline.iter().position(|&b| b == b'<').unwrap_or(inline.len())];
                    arrays.push(Array::of(&tag, section, inline, frame)?);
                }
                "AppendedData" => {
                    let base64 = tag.attribute("encoding") == Some("base64");
                    let mark = content[at..].iter().position(|&b| b == b'_');
                    let mark =
                        mark.ok_or_else(|| Fault::text(at, "the appended data does not begin with `_`"))?;
                    frame.appended = Some((at + mark + 1, base64));
                    break;
                }
                _ => {}
            }
        }
        if !is_vtk || pieces == 0 {
            return Err(Fault::file(
                "no piece of a VTK file of type UnstructuredGrid: cut off, or another format",
            ));
        }
        arrays.iter_mut().for_each(|array| array.frame.appended = frame.appended);
        Ok(Self { arrays, global_ids })
    }

    /// The global ids of points or cells: the array declared by the section, else the one with this
    /// name.
    pub fn ids(&self, section: Section, name: &str) -> Result<Vec<i64>, Fault> {
        let declared = self.global_ids.iter().find(|(of, _)| *of == section).map(|(_, name)| name.as_str());
        let array = declared.and_then(|name| self.array(section, Some(name)));
        let array = array.or_else(|| self.array(section, Some(name)));
        array.map_or(Ok(Vec::new()), Array::ints)
    }

    /// The names of bodies and boundaries in our fields.
    pub fn names(&self) -> Result<[NamesByNumber; 2], Fault> {
        let mut names = [NamesByNumber::new(), NamesByNumber::new()];
        for array in self.arrays.iter().filter(|array| array.section == Section::FieldData) {
            for (prefix, names) in NAMES.iter().zip(&mut names) {
                let Some(name) = array.name.strip_prefix(prefix) else { continue };
                for number in array.ints()? {
                    names.entry(number).or_default().push(name.to_string());
                }
            }
        }
        Ok(names)
    }

    /// The array with this name, or the first one of its section.
    pub fn array(&self, section: Section, name: Option<&str>) -> Option<&Array<'a>> {
        self.arrays.iter().find(|a| a.section == section && name.is_none_or(|name| a.name == name))
    }

    /// Like [`array`](Self::array), but an error if it is missing.
    pub fn required(&self, section: Section, name: Option<&str>) -> Result<&Array<'a>, Fault> {
        let missing =
            || Fault::file(format!("the file has no array {} in {section:?}", name.unwrap_or("at all")));
        self.array(section, name).ok_or_else(missing)
    }
}

/// Refuses a VTK file of another type.
pub(super) fn check_type(tag: &Tag, wanted: &str) -> Result<(), Fault> {
    match tag.attribute("type").filter(|kind| *kind != wanted) {
        Some(kind) => Err(Fault::text(tag.begin, format!("a VTK file of type {kind}; {wanted} is needed"))),
        None => Ok(()),
    }
}

fn header<'a>(tag: &Tag, frame: Frame<'a>) -> Result<Frame<'a>, Fault> {
    check_type(tag, "UnstructuredGrid")?;
    let compressed = match tag.attribute("compressor") {
        None | Some("") => false,
        Some("vtkZLibDataCompressor") => true,
        Some(other) => {
            return Err(Fault::text(
                tag.begin,
                format!("compression by {other} is not read; zlib or none is"),
            ));
        }
    };
    let big_endian = tag.attribute("byte_order") == Some("BigEndian");
    let long_lengths = tag.attribute("header_type") == Some("UInt64");
    Ok(Frame { big_endian, long_lengths, compressed, ..frame })
}

impl<'a> Array<'a> {
    fn of(tag: &Tag, section: Section, inline: &'a [u8], frame: Frame<'a>) -> Result<Self, Fault> {
        let wrong = |message: String| Fault::text(tag.begin, message);
        let format = match tag.attribute("format") {
            Some("ascii") => Format::Text,
            Some("binary") => Format::Base64,
            Some("appended") => {
                let offset = tag.attribute("offset").and_then(|offset| offset.parse().ok());
                Format::Appended(offset.ok_or_else(|| wrong("the array has no offset".into()))?)
            }
            other => {
                return Err(wrong(format!("the format `{}` of an array is not known", other.unwrap_or(""))));
            }
        };
        let name = tag.text("Name").unwrap_or_default();
        let kind = tag.attribute("type").unwrap_or_default().to_string();
        Ok(Self { section, name, kind, format, inline, frame })
    }

    fn wrong(&self, message: &str) -> Fault {
        Fault::file(format!("the array `{}`: {message}", self.name))
    }

    /// Returns its numbers as floats.
    pub fn floats(&self) -> Result<Vec<f64>, Fault> {
        if self.format == Format::Text {
            let mut words = Words::new(self.inline);
            let mut numbers = Vec::new();
            while words.peek().is_some() {
                numbers.push(
                    words
                        .float("a number")
                        .map_err(|_| self.wrong("not all its words are finite numbers"))?,
                );
            }
            return Ok(numbers);
        }
        let data = self.data()?;
        let bytes = Bytes::new(&data, 0, self.frame.big_endian);
        match self.kind.as_str() {
            "Float32" => numbers(bytes, 4, |b| b.f32("a number").map(f64::from)),
            "Float64" => numbers(bytes, 8, |b| b.f64("a number")),
            _ => Ok(self.ints()?.into_iter().map(|n| n as f64).collect()),
        }
    }

    /// Returns its numbers as integers.
    pub fn ints(&self) -> Result<Vec<i64>, Fault> {
        if self.format == Format::Text {
            let mut words = Words::new(self.inline);
            let mut numbers = Vec::new();
            while words.peek().is_some() {
                numbers.push(
                    words.int("a number").map_err(|_| self.wrong("not all its words are whole numbers"))?,
                );
            }
            return Ok(numbers);
        }
        let data = self.data()?;
        let bytes = Bytes::new(&data, 0, self.frame.big_endian);
        const WHAT: &str = "a number";
        match self.kind.as_str() {
            "Int8" => numbers(bytes, 1, |b| b.i8(WHAT).map(i64::from)),
            "UInt8" => numbers(bytes, 1, |b| b.u8(WHAT).map(i64::from)),
            "Int16" => numbers(bytes, 2, |b| b.i16(WHAT).map(i64::from)),
            "UInt16" => numbers(bytes, 2, |b| b.u16(WHAT).map(i64::from)),
            "Int32" => numbers(bytes, 4, |b| b.i32(WHAT).map(i64::from)),
            "UInt32" => numbers(bytes, 4, |b| b.u32(WHAT).map(i64::from)),
            "Int64" => numbers(bytes, 8, |b| b.i64(WHAT)),
            "UInt64" => numbers(bytes, 8, |b| b.u64(WHAT).map(|n| n as i64)),
            other => Err(self.wrong(&format!("its type is `{other}`, and whole numbers are needed"))),
        }
    }

    /// Returns its bytes, uncompressed and without the preceding length.
    fn data(&self) -> Result<Vec<u8>, Fault> {
        let decoded;
        let stored: &[u8] = match (self.format, self.frame.appended) {
            (Format::Appended(offset), Some((begin, base64))) => {
                let content = self.frame.content;
                let at = begin.checked_add(offset).filter(|&at| at <= content.len());
                let rest =
                    &content[at.ok_or_else(|| self.wrong("its offset is beyond the end of the file"))?..];
                if base64 {
                    decoded =
                        self.decode(&rest[..rest.iter().position(|&b| b == b'<').unwrap_or(rest.len())])?;
                    &decoded
                } else {
                    rest
                }
            }
            (Format::Appended(_), None) => {
                return Err(self.wrong("the file has no appended data: it is cut off"));
            }
            _ => {
                decoded = self.decode(self.inline)?;
                &decoded
            }
        };
        let mut bytes = Bytes::new(stored, 0, self.frame.big_endian);
        let data = if self.frame.compressed { self.inflated(&mut bytes) } else { self.plain(&mut bytes) };
        data.map_err(|_| self.wrong("its data is cut off or not what its header says"))
    }

    fn length(&self, bytes: &mut Bytes) -> Result<u64, Fault> {
        if self.frame.long_lengths { bytes.u64("a length") } else { bytes.u32("a length").map(u64::from) }
    }

    fn plain(&self, bytes: &mut Bytes) -> Result<Vec<u8>, Fault> {
        let length = self.length(bytes)?;
        let length = bytes.count(length, "bytes", 1)?;
        Ok(bytes.take(length, "an array")?.to_vec())
    }

    /// Decompresses: block count, block size, size of a partial last block, compressed sizes,
    /// blocks.
    fn inflated(&self, bytes: &mut Bytes) -> Result<Vec<u8>, Fault> {
        let blocks = self.length(bytes)?;
        let size = self.length(bytes)?;
        let _last = self.length(bytes)?;
        let blocks = bytes.count(blocks, "blocks", if self.frame.long_lengths { 8 } else { 4 })?;
        let mut lengths = Vec::with_capacity(blocks);
        for _ in 0..blocks {
            lengths.push(self.length(bytes)?);
        }
        let mut data = Vec::new();
        for length in lengths {
            let length = bytes.count(length, "bytes", 1)?;
            let block = bytes.take(length, "a block")?;
            let before = data.len() as u64;
            // One byte more than allowed reveals a block that is too long.
            let inflated =
                flate2::read::ZlibDecoder::new(block).take(size.saturating_add(1)).read_to_end(&mut data);
            if inflated.is_err() || data.len() as u64 - before > size {
                return Err(bytes.fault("a block that cannot be inflated"));
            }
        }
        Ok(data)
    }

    /// Decodes base64 in consecutive pieces, each with optional padding.
    fn decode(&self, text: &[u8]) -> Result<Vec<u8>, Fault> {
        let mut bytes = Vec::with_capacity(text.len() / 4 * 3);
        let (mut bits, mut count) = (0_u32, 0);
        for &b in text.iter().filter(|b| !b.is_ascii_whitespace()) {
            let value = match b {
                b'A'..=b'Z' => b - b'A',
                b'a'..=b'z' => b - b'a' + 26,
                b'0'..=b'9' => b - b'0' + 52,
                b'+' => 62,
                b'/' => 63,
                b'=' => {
                    // The rest of a piece: 2 characters are one byte, 3 are two.
                    match count {
                        2 => bytes.push((bits >> 4) as u8),
                        3 => bytes.extend([(bits >> 10) as u8, (bits >> 2) as u8]),
                        _ => {}
                    }
                    (bits, count) = (0, 0);
                    continue;
                }
                _ => return Err(self.wrong(&format!("`{}` is not base64", shown(&[b])))),
            };
            bits = bits << 6 | u32::from(value);
            count += 1;
            if count == 4 {
                bytes.extend([(bits >> 16) as u8, (bits >> 8) as u8, bits as u8]);
                (bits, count) = (0, 0);
            }
        }
        Ok(bytes)
    }
}

fn numbers<T>(
    mut bytes: Bytes,
    size: usize,
    next: impl Fn(&mut Bytes) -> Result<T, Fault>,
) -> Result<Vec<T>, Fault> {
    (0..bytes.left() / size).map(|_| next(&mut bytes)).collect()
}
