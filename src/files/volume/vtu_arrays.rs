//! The arrays of a `.vtu` file, and their numbers.

use super::raw::NamesByNumber;
use super::vtu_tags::{Tag, Tags, check_place, check_type};
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

/// The message for files without any piece.
const OTHER_FORMAT: &str = "no piece of a VTK file of type UnstructuredGrid: another format?";
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
    /// The offset of its tag.
    at: usize,
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
    appended: Option<Appended<'a>>,
}

/// The data of all arrays that are not between their tags.
#[derive(Clone, Copy)]
struct Appended<'a> {
    /// What follows the underscore, up to the closing tag.
    data: &'a [u8],
    base64: bool,
}

impl<'a> Appended<'a> {
    /// Finds the data; also returns the offset of the closing tag.
    ///
    /// Raw data may contain anything, so that tag is the last one of its kind.
    fn of(tag: &Tag, content: &'a [u8]) -> Result<(Self, usize), Fault> {
        const END: &[u8] = b"</AppendedData";
        let rest = &content[tag.end..];
        let length = rest.windows(END.len()).rposition(|window| window == END).ok_or_else(|| {
            Fault::text(content.len(), "the file ends before `</AppendedData>`: it is cut off")
        })?;
        let blanks = rest.len() - rest.trim_ascii_start().len();
        let data = rest[..length].get(blanks..).and_then(|data| data.strip_prefix(b"_"));
        let data = data.ok_or_else(|| tag.fault("the appended data does not begin with `_`"))?;
        Ok((Self { data, base64: tag.attribute("encoding") == Some("base64") }, tag.end + length))
    }
}

/// All arrays of a file.
pub(super) struct Document<'a> {
    arrays: Vec<Array<'a>>,
    /// The names of the global-id arrays of points and cells, declared by their sections.
    global_ids: Vec<(Section, String)>,
    /// What the piece announces.
    pub counts: Counts,
}

/// The numbers of points and cells that a piece announces.
#[derive(Clone, Copy, Default)]
pub(super) struct Counts {
    pub points: u64,
    pub cells: u64,
}

impl<'a> Document<'a> {
    /// Parses all tags.
    ///
    /// # Errors
    /// Elements that are not closed, or not in their places; anything but a file with one piece.
    pub fn read(content: &'a [u8]) -> Result<Self, Fault> {
        let mut tags = Tags::new(content);
        let mut frame = Frame { content, ..Frame::default() };
        let mut document = Self { arrays: Vec::new(), global_ids: Vec::new(), counts: Counts::default() };
        let mut pieces = 0;
        while let Some(tag) = tags.next()? {
            check_place(&tag)?;
            match tag.name {
                "VTKFile" => frame = header(&tag, frame)?,
                _ if tag.parent.is_empty() => return Err(tag.fault(OTHER_FORMAT)),
                "Piece" => {
                    pieces += 1;
                    if pieces > 1 {
                        return Err(tag.fault("a file of several pieces is not read"));
                    }
                    document.counts =
                        Counts { points: tag.count("NumberOfPoints")?, cells: tag.count("NumberOfCells")? };
                }
                "PointData" | "CellData" => {
                    let of = if tag.name == "CellData" { Section::CellData } else { Section::PointData };
                    document.global_ids.extend(tag.text("GlobalIds").map(|name| (of, name)));
                }
                "DataArray" => document.arrays.extend(Array::of(&tag, frame)?),
                "AppendedData" => {
                    let (appended, end) = Appended::of(&tag, content)?;
                    frame.appended = Some(appended);
                    tags.go_to(end);
                }
                _ => {}
            }
        }
        if pieces == 0 {
            return Err(Fault::file(OTHER_FORMAT));
        }
        document.arrays.iter_mut().for_each(|array| array.frame.appended = frame.appended);
        Ok(document)
    }

    /// The global ids of points or cells: the array declared by the section, else the one with this
    /// name.
    pub fn ids(&self, section: Section, name: &str) -> Result<Vec<i64>, Fault> {
        let declared = self.global_ids.iter().find(|(of, _)| *of == section).map(|(_, name)| name.as_str());
        let array = declared.and_then(|name| self.array(section, Some(name)));
        let Some(array) = array.or_else(|| self.array(section, Some(name))) else { return Ok(Vec::new()) };
        let (ids, Counts { points, cells }) = (array.ints()?, self.counts);
        let (count, what) = if section == Section::CellData { (cells, "cells") } else { (points, "points") };
        array.check_count(ids.len(), count, &format!("{count} {what}"))?;
        Ok(ids)
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
    /// The array of this tag; `None` if it is not read.
    fn of(tag: &Tag, frame: Frame<'a>) -> Result<Option<Self>, Fault> {
        let section = match tag.parent {
            "Points" => Section::Points,
            "Cells" => Section::Cells,
            "PointData" => Section::PointData,
            "CellData" => Section::CellData,
            "FieldData" => Section::FieldData,
            _ => return Ok(None),
        };
        let is_ours = |name: &str| NAMES.iter().any(|kind| name.starts_with(kind));
        if section == Section::FieldData && !tag.attribute("Name").is_some_and(is_ours) {
            return Ok(None);
        }
        let format = match tag.attribute("format") {
            Some("ascii") => Format::Text,
            Some("binary") => Format::Base64,
            Some("appended") => {
                let offset = tag.attribute("offset").and_then(|offset| offset.parse().ok());
                Format::Appended(offset.ok_or_else(|| tag.fault("the array has no offset"))?)
            }
            other => {
                let message = format!("the format `{}` of an array is not known", other.unwrap_or(""));
                return Err(tag.fault(message));
            }
        };
        let inline = &frame.content[tag.end..];
        let inline = &inline[..inline.iter().position(|&b| b == b'<').unwrap_or(inline.len())];
        let name = tag.text("Name").unwrap_or_default();
        let kind = tag.attribute("type").unwrap_or_default().to_string();
        Ok(Some(Self { at: tag.begin, section, name, kind, format, inline, frame }))
    }

    /// A fault at the array.
    pub fn wrong(&self, message: impl std::fmt::Display) -> Fault {
        let name = if self.name.is_empty() { format!("{:?}", self.section) } else { self.name.clone() };
        Fault::text(self.at, format!("the array `{name}`: {message}"))
    }

    /// Refuses other counts of numbers than expected.
    pub fn check_count(&self, found: usize, expected: u64, what: &str) -> Result<(), Fault> {
        if found as u64 == expected {
            return Ok(());
        }
        Err(self.wrong(format!("it has {found} numbers, and {what} need {expected}")))
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
            "Float32" => self.numbers(bytes, 4, |b| b.f32("a number").map(f64::from)),
            "Float64" => self.numbers(bytes, 8, |b| b.f64("a number")),
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
            "Int8" => self.numbers(bytes, 1, |b| b.i8(WHAT).map(i64::from)),
            "UInt8" => self.numbers(bytes, 1, |b| b.u8(WHAT).map(i64::from)),
            "Int16" => self.numbers(bytes, 2, |b| b.i16(WHAT).map(i64::from)),
            "UInt16" => self.numbers(bytes, 2, |b| b.u16(WHAT).map(i64::from)),
            "Int32" => self.numbers(bytes, 4, |b| b.i32(WHAT).map(i64::from)),
            "UInt32" => self.numbers(bytes, 4, |b| b.u32(WHAT).map(i64::from)),
            "Int64" => self.numbers(bytes, 8, |b| b.i64(WHAT)),
            "UInt64" => self.numbers(bytes, 8, |b| b.u64(WHAT).map(|n| n as i64)),
            other => Err(self.wrong(format!("its type is `{other}`, and whole numbers are needed"))),
        }
    }

    /// Parses bytes as numbers of this size.
    fn numbers<T>(
        &self,
        mut bytes: Bytes,
        size: usize,
        next: impl Fn(&mut Bytes) -> Result<T, Fault>,
    ) -> Result<Vec<T>, Fault> {
        let length = bytes.left();
        if !length.is_multiple_of(size) {
            return Err(self.wrong(format!("its {length} bytes are no numbers of {size} bytes each")));
        }
        (0..length / size).map(|_| next(&mut bytes)).collect()
    }

    /// Returns its bytes, uncompressed and without the preceding length.
    fn data(&self) -> Result<Vec<u8>, Fault> {
        let decoded;
        let stored: &[u8] = match (self.format, self.frame.appended) {
            (Format::Appended(offset), Some(Appended { data, base64 })) => {
                let beyond = || self.wrong("its offset is beyond the end of the appended data");
                let rest = data.get(offset..).ok_or_else(beyond)?;
                if base64 {
                    decoded = self.decode(rest)?;
                    &decoded
                } else {
                    rest
                }
            }
            (Format::Appended(_), None) => return Err(self.wrong("the file has no appended data")),
            _ => {
                decoded = self.decode(self.inline)?;
                &decoded
            }
        };
        let mut bytes = Bytes::new(stored, 0, self.frame.big_endian);
        let data = if self.frame.compressed { self.inflated(&mut bytes) } else { self.plain(&mut bytes) };
        let data = data.map_err(|_| self.wrong("its data is cut off or not what its header says"))?;
        if self.format == Format::Base64 && bytes.left() > 0 {
            return Err(self.wrong(format!("its data is {} bytes longer than its header says", bytes.left())));
        }
        Ok(data)
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
        let partial = self.length(bytes)?;
        let blocks = bytes.count(blocks, "blocks", if self.frame.long_lengths { 8 } else { 4 })?;
        let mut lengths = Vec::with_capacity(blocks);
        for _ in 0..blocks {
            lengths.push(self.length(bytes)?);
        }
        let mut data = Vec::new();
        for (k, length) in lengths.into_iter().enumerate() {
            let size = if k + 1 == blocks && partial > 0 { partial } else { size };
            let length = bytes.count(length, "bytes", 1)?;
            let block = bytes.take(length, "a block")?;
            let before = data.len() as u64;
            // One byte more than allowed reveals a block that is too long.
            let inflated =
                flate2::read::ZlibDecoder::new(block).take(size.saturating_add(1)).read_to_end(&mut data);
            if inflated.is_err() || data.len() as u64 - before != size {
                return Err(bytes.fault("a block that cannot be inflated to its size"));
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
                _ => return Err(self.wrong(format!("`{}` is not base64", shown(&[b])))),
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
