//! STL, text and binary.
//!
//! Binary headers may begin with `solid` too. So a file is binary if its length matches the number
//! of triangles in it.

use super::builder::Builder;
use super::merge::Merger;
use super::repeated::Place;
use super::{Surface, gaps};
use crate::Point;
use crate::files::input::{Bytes, Fault, Words, counted, line_of, shown};

/// Bytes before the first triangle of a binary file: 80 of free text, and the number of triangles.
const HEAD: usize = 84;
/// Bytes of a triangle: normal and corners in single precision, and two unused bytes.
const PER_TRIANGLE: usize = 50;

/// Triangles by the indices of their corners, with their solids.
#[derive(Default)]
struct Facets {
    merger: Merger,
    triangles: Vec<[u32; 3]>,
    /// The place of each triangle in the file.
    places: Vec<usize>,
    solid: Vec<u32>,
    names: Vec<String>,
    is_binary: bool,
}

impl Facets {
    fn corner(&mut self, place: Point) -> Result<u32, Fault> {
        self.merger.number(place).ok_or_else(|| Fault::file("the file has more than 2^32 points"))
    }
}

pub(super) fn parse(content: &[u8]) -> Result<Surface, Fault> {
    let announced = content.get(80..HEAD).map(|n| u32::from_le_bytes(n.try_into().expect("four bytes")));
    let length = |triangles: u32| HEAD as u64 + u64::from(triangles) * PER_TRIANGLE as u64;
    let facets = match announced {
        Some(triangles) if length(triangles) == content.len() as u64 => binary(content, triangles as usize)?,
        _ if is_text(content) => text(content)?,
        Some(triangles) => {
            return Err(Fault::byte(
                80,
                format!(
                    "{triangles} triangles are announced, which take {} bytes, but the file has {}: it is cut \
                     off, or no STL file (text would begin with `solid`)",
                    length(triangles),
                    content.len()
                ),
            ));
        }
        None => {
            return Err(Fault::file("neither a text that begins with `solid` nor 84 bytes of binary STL"));
        }
    };
    if facets.triangles.is_empty() {
        return Err(Fault::file("the file has no triangles"));
    }
    let is_binary = facets.is_binary;
    Ok(joined(facets, &|offset| {
        if is_binary { format!("byte {offset}") } else { format!("line {}", line_of(content, offset)) }
    }))
}

fn is_text(content: &[u8]) -> bool {
    let start = content.trim_ascii_start();
    start.len() >= 5 && start[..5].eq_ignore_ascii_case(b"solid") && !content.contains(&0)
}

/// Merges close points where that closes gaps, and builds the surface.
fn joined(facets: Facets, place: Place) -> Surface {
    let Facets { merger, mut triangles, places, solid, names, .. } = facets;
    let points = merger.into_points();
    let closed = gaps::close(&points, &mut triangles);
    let mut builder = Builder::of_distinct(points);
    let count = names.len();
    for (k, name) in names.into_iter().enumerate() {
        let name = match (name.is_empty(), count) {
            (false, _) => name,
            (true, 1) => "surface".into(),
            (true, _) => format!("solid {}", k + 1),
        };
        builder.group(name, k as i64 + 1);
    }
    for ((triangle, solid), at) in triangles.iter().zip(solid).zip(places) {
        builder.face(triangle, at);
        builder.triangles(&[*triangle], solid);
    }
    let mut surface = builder.finish(place);
    if let Some(closed) = closed {
        // Merged points are not loose points of the file.
        surface.loose_points.clear();
        surface.notes.retain(|note| !note.ends_with("in no face"));
        surface.notes.push(format!(
            "{} within {:.3e} of others merged with them, which closed {} of {}",
            counted(closed.points, "point"),
            closed.distance,
            closed.open_before - closed.open_after,
            counted(closed.open_before, "open edge"),
        ));
    }
    surface
}

fn binary(content: &[u8], count: usize) -> Result<Facets, Fault> {
    let mut facets =
        Facets { names: vec![String::new()], solid: vec![0; count], is_binary: true, ..Facets::default() };
    facets.triangles.reserve(count);
    let mut bytes = Bytes::new(content, HEAD, false);
    for _ in 0..count {
        facets.places.push(bytes.offset());
        bytes.take(12, "a normal")?;
        let mut triangle = [0; 3];
        for corner in &mut triangle {
            *corner = facets.corner(bytes.point_f32()?)?;
        }
        facets.triangles.push(triangle);
        bytes.take(2, "a triangle")?;
    }
    Ok(facets)
}

fn text(content: &[u8]) -> Result<Facets, Fault> {
    let mut facets = Facets::default();
    let mut words = Words::new(content);
    while let Some(word) = words.next() {
        if !word.eq_ignore_ascii_case(b"solid") {
            return Err(words.fault(format!("expected `solid`, found `{}`", shown(word))));
        }
        facets.names.push(String::from_utf8_lossy(words.rest_of_line()).into_owned());
        solid(&mut words, &mut facets)?;
    }
    Ok(facets)
}

/// Parses the facets of one solid to its end.
fn solid(words: &mut Words, facets: &mut Facets) -> Result<(), Fault> {
    loop {
        let word = words.word("`endsolid`: it is cut off")?;
        if word.eq_ignore_ascii_case(b"endsolid") {
            words.rest_of_line();
            return Ok(());
        }
        if !word.eq_ignore_ascii_case(b"facet") {
            return Err(words.fault(format!("expected `facet` or `endsolid`, found `{}`", shown(word))));
        }
        facets.places.push(words.offset());
        // The normal is everything before `outer loop`; it is often wrong and not needed.
        const MOST: usize = 5;
        let mut before = 0;
        while !words.word("`outer loop`")?.eq_ignore_ascii_case(b"outer") {
            before += 1;
            if before > MOST {
                return Err(words.fault("expected `outer loop` after the normal of a facet"));
            }
        }
        keyword(words, "loop")?;
        let mut triangle = [0; 3];
        for corner in &mut triangle {
            keyword(words, "vertex")?;
            *corner = facets.corner(words.point("a coordinate")?)?;
        }
        keyword(words, "endloop")?;
        keyword(words, "endfacet")?;
        facets.triangles.push(triangle);
        facets.solid.push(facets.names.len() as u32 - 1);
    }
}

fn keyword(words: &mut Words, expected: &str) -> Result<(), Fault> {
    let word = words.word(&format!("`{expected}`: it is cut off"))?;
    if word.eq_ignore_ascii_case(expected.as_bytes()) {
        return Ok(());
    }
    Err(words.fault(format!("expected `{expected}`, found `{}`", shown(word))))
}
