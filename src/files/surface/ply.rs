//! PLY (Turk 1994): text, and binary in either byte order, with any properties.

use super::Surface;
use super::builder::Builder;
use crate::Point;
use crate::files::input::{Bytes, Fault, Words, coordinate, line_of, shown};

#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Number {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Number {
    fn of(name: &[u8]) -> Option<Self> {
        Some(match name {
            b"char" | b"int8" => Self::I8,
            b"uchar" | b"uint8" => Self::U8,
            b"short" | b"int16" => Self::I16,
            b"ushort" | b"uint16" => Self::U16,
            b"int" | b"int32" => Self::I32,
            b"uint" | b"uint32" => Self::U32,
            b"float" | b"float32" => Self::F32,
            b"double" | b"float64" => Self::F64,
            _ => return None,
        })
    }

    fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }

    fn is_whole(self) -> bool {
        !matches!(self, Self::F32 | Self::F64)
    }
}

struct Property {
    name: Vec<u8>,
    /// The type of the length, for a list.
    length: Option<Number>,
    number: Number,
}

struct Element {
    name: Vec<u8>,
    count: u64,
    properties: Vec<Property>,
}

impl Element {
    fn property(&self, names: &[&[u8]]) -> Option<usize> {
        self.properties.iter().position(|property| names.contains(&property.name.as_slice()))
    }
}

/// The data after the header.
enum Data<'a> {
    Text(Words<'a>),
    Binary(Bytes<'a>),
}

impl Data<'_> {
    fn number(&mut self, kind: Number) -> Result<f64, Fault> {
        match self {
            Self::Text(words) if kind.is_whole() => words.int("a value").map(|n| n as f64),
            Self::Text(words) => {
                // Other values than coordinates may be anything, for example a NaN normal.
                let word = words.word("a value")?;
                let number = std::str::from_utf8(word).ok().and_then(|text| text.parse().ok());
                number.ok_or_else(|| words.fault(format!("expected a number, found `{}`", shown(word))))
            }
            Self::Binary(bytes) => Ok(match kind {
                Number::I8 => bytes.i8("a value")?.into(),
                Number::U8 => bytes.u8("a value")?.into(),
                Number::I16 => bytes.i16("a value")?.into(),
                Number::U16 => bytes.u16("a value")?.into(),
                Number::I32 => bytes.i32("a value")?.into(),
                Number::U32 => bytes.u32("a value")?.into(),
                Number::F32 => bytes.f32("a value")?.into(),
                Number::F64 => bytes.f64("a value")?,
            }),
        }
    }

    /// The end of the last number.
    fn offset(&self) -> usize {
        match self {
            Self::Text(words) => words.offset(),
            Self::Binary(bytes) => bytes.offset(),
        }
    }

    /// A fault at this offset.
    fn fault_at(&self, offset: usize, message: String) -> Fault {
        match self {
            Self::Text(_) => Fault::text(offset, message),
            Self::Binary(_) => Fault::byte(offset, message),
        }
    }

    fn fault(&self, message: impl Into<String>) -> Fault {
        match self {
            Self::Text(words) => words.fault(message),
            Self::Binary(bytes) => bytes.fault(message),
        }
    }

    /// Checks that the rest of the file can hold this many items of at least this size.
    fn room(&self, count: u64, what: &str, numbers: usize, bytes_each: usize) -> Result<usize, Fault> {
        match self {
            Self::Binary(bytes) => bytes.count(count, what, bytes_each),
            Self::Text(words) => {
                let room = (words.rest().len() as u64).div_ceil(2) / numbers.max(1) as u64;
                if count <= room {
                    return Ok(count as usize);
                }
                Err(words.fault(format!(
                    "{count} {what} are announced, and what is left of the file has room for {room} at most"
                )))
            }
        }
    }

    /// Reads the length of a list and checks that the list fits into the file.
    fn length(&mut self, kind: Number, of: Number) -> Result<usize, Fault> {
        let length = self.number(kind)?;
        if length < 0.0 {
            return Err(self.fault(format!("a list has the length {length}")));
        }
        self.room(length as u64, "entries of a list", 1, of.size())
    }
}

pub(super) fn parse(content: &[u8]) -> Result<Surface, Fault> {
    let (elements, mut data) = header(content)?;
    let vertex_count = |e: &Element| (e.name == b"vertex").then_some(e.count);
    let vertices =
        elements.iter().find_map(vertex_count).ok_or(Fault::file("the file has no element `vertex`"))?;
    let mut points = Vec::new();
    let mut faces = Faces::default();
    for element in &elements {
        let numbers = element.properties.len();
        let bytes = element.properties.iter().map(|p| p.length.unwrap_or(p.number).size()).sum();
        if numbers == 0 && element.name != b"vertex" {
            continue;
        }
        let name = String::from_utf8_lossy(&element.name).into_owned();
        let count = data.room(element.count, &format!("elements `{name}`"), numbers, bytes)?;
        match element.name.as_slice() {
            b"vertex" => read_points(element, count, &mut data, &mut points)?,
            b"face" => read_faces(element, count, vertices, &mut data, &mut faces)?,
            b"tristrips" => read_strips(element, count, vertices, &mut data, &mut faces)?,
            _ => (0..count).try_for_each(|_| skip(&element.properties, &mut data))?,
        }
    }
    if faces.ends.is_empty() {
        return Err(Fault::file("the file has no faces"));
    }
    let mut builder = Builder::new(points)?;
    let group = builder.group("surface".into(), 1);
    let mut begin = 0;
    for (&end, &at) in faces.ends.iter().zip(&faces.places) {
        builder
            .polygon(&faces.corners[begin..end], group, at)
            .map_err(|fault| data.fault_at(at, format!("the face cannot be cut into triangles: {fault}")))?;
        begin = end;
    }
    Ok(builder.finish(&|offset| match data {
        Data::Text(_) => format!("line {}", line_of(content, offset)),
        Data::Binary(_) => format!("byte {offset}"),
    }))
}

fn header(content: &[u8]) -> Result<(Vec<Element>, Data<'_>), Fault> {
    let mut words = Words::new(content);
    if words.rest_of_line() != b"ply" {
        return Err(words.fault("expected `ply` on the first line"));
    }
    let mut elements: Vec<Element> = Vec::new();
    let mut format = None;
    loop {
        let word = words.word("`end_header`")?;
        match word {
            b"format" => format = Some(words.word("the name of a format")?),
            b"comment" | b"obj_info" => {}
            b"element" => {
                let name = words.word("the name of an element")?.to_vec();
                let count = words.int("the number of elements")?;
                let count =
                    u64::try_from(count).map_err(|_| words.fault("the number of elements is negative"))?;
                elements.push(Element { name, count, properties: Vec::new() });
            }
            b"property" => {
                let property = property(&mut words)?;
                let element = elements.last_mut();
                element
                    .ok_or_else(|| words.fault("a property before any element"))?
                    .properties
                    .push(property);
            }
            b"end_header" => break,
            _ => return Err(words.fault(format!("`{}` begins no line of a PLY header", shown(word)))),
        }
        words.rest_of_line();
    }
    words.rest_of_line();
    let data = match format {
        Some(b"ascii") => Data::Text(words),
        Some(b"binary_little_endian") => Data::Binary(Bytes::new(content, words.offset(), false)),
        Some(b"binary_big_endian") => Data::Binary(Bytes::new(content, words.offset(), true)),
        Some(other) => return Err(Fault::text(0, format!("the format `{}` is not known", shown(other)))),
        None => return Err(Fault::text(0, "the header names no format")),
    };
    Ok((elements, data))
}

fn property(words: &mut Words) -> Result<Property, Fault> {
    let length = if words.peek() == Some(b"list") {
        words.next();
        let length = number(words)?;
        if !length.is_whole() {
            return Err(words.fault("the length of a list must be of a whole type"));
        }
        Some(length)
    } else {
        None
    };
    let number = number(words)?;
    Ok(Property { length, number, name: words.word("the name of a property")?.to_vec() })
}

fn number(words: &mut Words) -> Result<Number, Fault> {
    let word = words.word("a type")?;
    Number::of(word).ok_or_else(|| words.fault(format!("`{}` is not a PLY type", shown(word))))
}

fn skip(properties: &[Property], data: &mut Data) -> Result<(), Fault> {
    for property in properties {
        let count = match property.length {
            Some(kind) => data.length(kind, property.number)?,
            None => 1,
        };
        for _ in 0..count {
            data.number(property.number)?;
        }
    }
    Ok(())
}

fn read_points(
    element: &Element,
    count: usize,
    data: &mut Data,
    points: &mut Vec<Point>,
) -> Result<(), Fault> {
    let mut axis_of = vec![None; element.properties.len()];
    for (axis, name) in [b"x", b"y", b"z"].into_iter().enumerate() {
        let place = element.property(&[name]).filter(|&k| element.properties[k].length.is_none());
        let place = place.ok_or_else(|| {
            Fault::file(format!("the element `vertex` has no property `{}`", char::from(name[0])))
        })?;
        axis_of[place] = Some(axis);
    }
    points.reserve(count);
    for _ in 0..count {
        let mut point = [0.0; 3];
        for (property, axis) in element.properties.iter().zip(&axis_of) {
            let Some(axis) = *axis else {
                skip(std::slice::from_ref(property), data)?;
                continue;
            };
            let number = data.number(property.number)?;
            point[axis] = coordinate(number).map_err(|message| data.fault(message))?;
        }
        points.push(point.into());
    }
    Ok(())
}

/// Concatenated polygons.
#[derive(Default)]
struct Faces {
    corners: Vec<u32>,
    ends: Vec<usize>,
    /// The place of each polygon in the file.
    places: Vec<usize>,
}

impl Faces {
    fn end(&mut self, at: usize) {
        self.ends.push(self.corners.len());
        self.places.push(at);
    }
}

/// The types of the length and the numbers of a list, with the properties before and after it.
type List<'e> = (&'e [Property], [Number; 2], &'e [Property]);

/// The list of vertices of an element.
fn vertex_list<'e>(element: &'e Element, data: &Data) -> Result<List<'e>, Fault> {
    let list = element.property(&[b"vertex_indices", b"vertex_index"]);
    let kinds = list.and_then(|k| Some([element.properties[k].length?, element.properties[k].number]));
    match list.zip(kinds.filter(|[_, number]| number.is_whole())) {
        Some((k, kinds)) => Ok((&element.properties[..k], kinds, &element.properties[k + 1..])),
        None => {
            let name = shown(&element.name);
            let what = format!("the element `{name}` has no list `vertex_indices` of whole numbers");
            Err(data.fault_at(0, what))
        }
    }
}

/// Reads the number of a vertex.
fn vertex(data: &mut Data, kind: Number, vertices: u64) -> Result<u32, Fault> {
    let vertex = data.number(kind)?;
    checked_vertex(data, vertex, vertices)
}

fn checked_vertex(data: &Data, vertex: f64, vertices: u64) -> Result<u32, Fault> {
    if (0.0..vertices as f64).contains(&vertex) {
        return Ok(vertex as u32);
    }
    Err(data.fault(format!("there is no vertex {vertex}: the file has {vertices}, from 0")))
}

/// Reads strips of triangles: each vertex makes a triangle with the two before it, every other one
/// in reverse order. The number −1 begins a new strip.
fn read_strips(
    element: &Element,
    count: usize,
    vertices: u64,
    data: &mut Data,
    faces: &mut Faces,
) -> Result<(), Fault> {
    let (before, [length, kind], after) = vertex_list(element, data)?;
    for _ in 0..count {
        skip(before, data)?;
        let mut strip: Vec<u32> = Vec::new();
        for _ in 0..data.length(length, kind)? {
            let number = data.number(kind)?;
            let at = data.offset();
            if number == -1.0 || (kind == Number::U32 && number == f64::from(u32::MAX)) {
                strip.clear();
                continue;
            }
            strip.push(checked_vertex(data, number, vertices)?);
            let &[.., a, b, c] = &strip[..] else { continue };
            // A vertex that is repeated continues the strip elsewhere.
            if a != b && b != c && c != a {
                faces.corners.extend(if strip.len() % 2 == 1 { [a, b, c] } else { [b, a, c] });
                faces.end(at);
            }
        }
        skip(after, data)?;
    }
    Ok(())
}

fn read_faces(
    element: &Element,
    count: usize,
    vertices: u64,
    data: &mut Data,
    faces: &mut Faces,
) -> Result<(), Fault> {
    let (before, [length, kind], after) = vertex_list(element, data)?;
    faces.ends.reserve(count);
    for _ in 0..count {
        skip(before, data)?;
        let sides = data.length(length, kind)?;
        let at = data.offset();
        for _ in 0..sides {
            let vertex = vertex(data, kind, vertices)?;
            faces.corners.push(vertex);
        }
        faces.end(at);
        skip(after, data)?;
    }
    Ok(())
}
