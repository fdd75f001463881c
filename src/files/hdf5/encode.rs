//! The bytes of HDF5's metadata, by the published "HDF5 File Format Specification", version 3.0:
//! superblock of version 2 and object headers of version 2, which the HDF5 library reads since 1.8.
//!
//! Sections of the specification are in brackets.

use super::checksum::checksum;
use super::tree::{Kind, Value};

/// The address of something that does not exist.
const UNDEFINED: u64 = u64::MAX;

/// The superblock [II.A]: lengths and addresses of 8 bytes, the end of the file, and the header of
/// the root group.
pub(super) fn superblock(end: u64, root: u64) -> Vec<u8> {
    let mut bytes = b"\x89HDF\r\n\x1a\n".to_vec();
    let (version, offset_size, length_size, flags) = (2, 8, 8, 0);
    bytes.extend([version, offset_size, length_size, flags]);
    let (base, extension) = (0_u64, UNDEFINED);
    [base, extension, end, root].iter().for_each(|address| bytes.extend(address.to_le_bytes()));
    close(bytes)
}

/// Appends the checksum.
fn close(mut bytes: Vec<u8>) -> Vec<u8> {
    let sum = checksum(&bytes);
    bytes.extend(sum.to_le_bytes());
    bytes
}

/// An object header under construction [IV.A.1.b]: a list of messages.
#[derive(Default)]
pub(super) struct Header {
    messages: Vec<u8>,
}

/// The types of messages [IV.A.2].
enum Message {
    Dataspace = 0x01,
    LinkInfo = 0x02,
    Datatype = 0x03,
    FillValue = 0x05,
    Link = 0x06,
    Layout = 0x08,
    GroupInfo = 0x0a,
    Attribute = 0x0c,
    ReferenceCount = 0x16,
}

impl Header {
    fn push(&mut self, message: Message, body: &[u8]) {
        let length = u16::try_from(body.len()).expect("messages have less than 64 KiB");
        self.messages.push(message as u8);
        self.messages.extend(length.to_le_bytes());
        // Flags: nothing is constant or shared.
        self.messages.push(0);
        self.messages.extend(body);
    }

    /// Adds the messages of a dataset whose values are contiguous from `data` on.
    pub fn dataset(&mut self, kind: Kind, shape: &[u64], data: u64) {
        self.push(Message::Dataspace, &simple(shape));
        self.push(Message::Datatype, &datatype(kind));
        // Version 3 [IV.A.2.f]: allocated early, values not filled in, fill value zero.
        self.push(Message::FillValue, &[3, 0x05]);
        let bytes = kind.bytes() * shape.iter().product::<u64>();
        // Version 3 [IV.A.2.i], contiguous.
        let mut layout = vec![3, 1];
        layout.extend(if bytes == 0 { UNDEFINED } else { data }.to_le_bytes());
        layout.extend(bytes.to_le_bytes());
        self.push(Message::Layout, &layout);
    }

    /// Adds the messages of a group with these members: names and addresses of headers.
    pub fn group<'a>(&mut self, members: impl Iterator<Item = (&'a str, u64)>) {
        // Links are messages of this header [IV.A.2.c]: no heap, no tree.
        let mut info = vec![0, 0];
        [UNDEFINED; 2].iter().for_each(|address| info.extend(address.to_le_bytes()));
        self.push(Message::LinkInfo, &info);
        self.push(Message::GroupInfo, &[0, 0]);
        for (name, address) in members {
            // Version 1 [IV.A.2.g], UTF-8, length of the name in 2 bytes.
            let mut link = vec![1, 0x11, 1];
            link.extend(
                u16::try_from(name.len()).expect("names of groups and datasets are short").to_le_bytes(),
            );
            link.extend(name.as_bytes());
            link.extend(address.to_le_bytes());
            self.push(Message::Link, &link);
        }
    }

    /// Adds an attribute.
    pub fn attribute(&mut self, name: &str, value: &Value) {
        let integers = |values: &[i64]| values.iter().flat_map(|value| value.to_ne_bytes()).collect();
        let (kind, space, data): (_, _, Vec<u8>) = match value {
            Value::Integer(value) => (Kind::I64, scalar(), integers(&[*value])),
            Value::Integers(values) => (Kind::I64, simple(&[values.len() as u64]), integers(values)),
            Value::Text(text) => (Kind::Text(text.len() as u32), scalar(), text.as_bytes().to_vec()),
        };
        let kind = match value {
            // VTK compares the text with that of an ASCII string.
            Value::Text(_) => ascii(datatype(kind)),
            _ => datatype(kind),
        };
        // Version 3 [IV.A.2.m]: lengths of name, type and space; the name is ASCII.
        let mut body = vec![3, 0];
        for length in [name.len() + 1, kind.len(), space.len()] {
            body.extend((length as u16).to_le_bytes());
        }
        body.push(0);
        body.extend(name.as_bytes());
        body.push(0);
        body.extend(kind);
        body.extend(space);
        body.extend(data);
        self.push(Message::Attribute, &body);
    }

    /// Adds the number of names of the object, if it has several.
    pub fn names(&mut self, count: u32) {
        let mut body = vec![0];
        body.extend(count.to_le_bytes());
        self.push(Message::ReferenceCount, &body);
    }

    /// The bytes of the header.
    pub fn finish(self) -> Vec<u8> {
        // Version 2; the length has 4 bytes.
        let mut bytes = b"OHDR\x02\x02".to_vec();
        bytes.extend((self.messages.len() as u32).to_le_bytes());
        bytes.extend(self.messages);
        close(bytes)
    }
}

/// The space of a single value [IV.A.2.b].
fn scalar() -> Vec<u8> {
    vec![2, 0, 0, 0]
}

/// The space of an array.
fn simple(shape: &[u64]) -> Vec<u8> {
    let mut bytes = vec![2, shape.len() as u8, 0, 1];
    shape.iter().for_each(|length| bytes.extend(length.to_le_bytes()));
    bytes
}

/// The type of values [IV.A.2.d].
fn datatype(kind: Kind) -> Vec<u8> {
    const SIGNED: u8 = 0x08;
    const FIXED_POINT: u8 = 0;
    const FLOATING_POINT: u8 = 1;
    const STRING: u8 = 3;
    let order = u8::from(cfg!(target_endian = "big"));
    let start = |class: u8, flags: [u8; 3]| {
        let version = 1;
        let mut bytes = vec![version << 4 | class, flags[0], flags[1], flags[2]];
        bytes.extend((kind.bytes() as u32).to_le_bytes());
        bytes
    };
    let integer = |flags| {
        let mut bytes = start(FIXED_POINT, [flags, 0, 0]);
        let (offset, precision) = (0_u16, 8 * kind.bytes() as u16);
        bytes.extend(offset.to_le_bytes());
        bytes.extend(precision.to_le_bytes());
        bytes
    };
    match kind {
        Kind::U8 => integer(order),
        Kind::I32 | Kind::I64 => integer(order | SIGNED),
        Kind::F64 => {
            // IEEE double: the sign is bit 63, the first bit of the mantissa is implied.
            let mut bytes = start(FLOATING_POINT, [order | 0x20, 63, 0]);
            let (offset, precision) = (0_u16, 64_u16);
            bytes.extend(offset.to_le_bytes());
            bytes.extend(precision.to_le_bytes());
            let (exponent, exponent_bits, mantissa, mantissa_bits) = (52, 11, 0, 52);
            bytes.extend([exponent, exponent_bits, mantissa, mantissa_bits]);
            bytes.extend(1023_u32.to_le_bytes());
            bytes
        }
        // Padded with zeros, UTF-8.
        Kind::Text(_) => start(STRING, [0x11, 0, 0]),
    }
}

/// The type of text, but ASCII.
fn ascii(mut text: Vec<u8>) -> Vec<u8> {
    text[1] &= 0x0f;
    text
}
