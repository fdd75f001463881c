//! Wavefront OBJ: points and polygons. Texture coordinates and normals are skipped.
//!
//! A face's group consists of those of object (`o`), group (`g`) and material (`usemtl`) that take
//! more than one value in the file.

use super::Surface;
use super::builder::Builder;
use crate::files::input::{Fault, Words, counted, line_of, shown};
use std::collections::BTreeMap;

pub(super) fn parse(content: &[u8]) -> Result<Surface, Fault> {
    let joined = join_continued(content);
    let content = joined.as_deref().unwrap_or(content);
    let points = points(content)?;
    let count = points.len();
    let mut faces =
        Faces { builder: Builder::new(points)?, labels: Labels::default(), count, corners: Vec::new() };
    let (mut seen, mut total, mut skipped) = (0, 0, 0);
    let mut words = Words::with_comments(content);
    while let Some(word) = words.next() {
        match word {
            b"v" => seen += 1,
            b"f" => {
                faces.face(&mut words, seen)?;
                total += 1;
            }
            b"o" => faces.labels.set(0, &mut words),
            b"g" => faces.labels.set(1, &mut words),
            b"usemtl" => faces.labels.set(2, &mut words),
            b"l" | b"p" | b"curv" | b"curv2" | b"surf" => skipped += 1,
            b"vt" | b"vn" | b"vp" | b"s" | b"mtllib" => {}
            _ if word.iter().all(|b| b.is_ascii_alphanumeric() || *b == b'_') => {}
            _ => return Err(words.fault(format!("`{}` begins no line of an OBJ file", shown(word)))),
        }
        words.rest_of_line();
    }
    if total == 0 {
        return Err(Fault::file("the file has no faces"));
    }
    let mut surface = faces.builder.finish(&|offset| format!("line {}", line_of(content, offset)));
    faces.labels.name(&mut surface);
    if skipped > 0 {
        surface.notes.push(format!("{} left out", counted(skipped, "line, point or free-form element")));
    }
    Ok(surface)
}

/// Joins lines continued with `\`: returns the text with blanks in place of these line ends, if
/// there are any, so that offsets stay.
fn join_continued(content: &[u8]) -> Option<Vec<u8>> {
    let continued = |k: usize| {
        let after = &content[k + 1..];
        content[k] == b'\\' && (after.starts_with(b"\n") || after.starts_with(b"\r\n"))
    };
    let places: Vec<usize> = (0..content.len()).filter(|&k| content[k] == b'\\' && continued(k)).collect();
    if places.is_empty() {
        return None;
    }
    let mut joined = content.to_vec();
    for k in places {
        let end = k + 1 + usize::from(content[k + 1] == b'\r');
        joined[k..=end].fill(b' ');
    }
    Some(joined)
}

fn points(content: &[u8]) -> Result<Vec<crate::Point>, Fault> {
    let mut points = Vec::new();
    let mut words = Words::with_comments(content);
    while let Some(word) = words.next() {
        if word == b"v" {
            points.push(words.point("a coordinate")?);
        }
        words.rest_of_line();
    }
    Ok(points)
}

struct Faces {
    builder: Builder,
    labels: Labels,
    count: usize,
    corners: Vec<u32>,
}

impl Faces {
    /// Parses a face; negative vertex numbers count back from the `seen` points before it.
    fn face(&mut self, words: &mut Words, seen: i64) -> Result<(), Fault> {
        self.corners.clear();
        let begin = words.clone();
        while let Some(word) = words.next_in_line() {
            let number = word.split(|&b| b == b'/').next().and_then(crate::files::input::int);
            let index = match number {
                Some(number) if number > 0 => number - 1,
                Some(number) if number < 0 => seen.saturating_add(number),
                _ => {
                    return Err(
                        words.fault(format!("expected the number of a vertex, found `{}`", shown(word)))
                    );
                }
            };
            if !(0..self.count as i64).contains(&index) {
                let number = number.unwrap_or_default();
                return Err(words.fault(format!("there is no vertex {number}: the file has {}", self.count)));
            }
            self.corners.push(index as u32);
        }
        if self.corners.len() < 3 {
            return Err(begin.fault("a face needs three corners or more"));
        }
        let group = self.labels.group(&mut self.builder);
        self.builder
            .polygon(&self.corners, group, begin.offset())
            .map_err(|fault| begin.fault(format!("the face cannot be cut into triangles: {fault}")))
    }
}

/// Object, group and material: current values, and those of each group.
#[derive(Default)]
struct Labels {
    current: [String; 3],
    group: Option<u32>,
    groups: BTreeMap<[String; 3], u32>,
    /// By group.
    labels: Vec<[String; 3]>,
}

impl Labels {
    fn set(&mut self, kind: usize, words: &mut Words) {
        let mut name = Vec::new();
        while let Some(word) = words.next_in_line() {
            name.push(String::from_utf8_lossy(word).into_owned());
        }
        self.current[kind] = name.join(" ");
        self.group = None;
    }

    /// The group of the next face.
    fn group(&mut self, builder: &mut Builder) -> u32 {
        if let Some(group) = self.group {
            return group;
        }
        let group = *self.groups.entry(self.current.clone()).or_insert_with(|| {
            self.labels.push(self.current.clone());
            // The name is assigned when all labels are known.
            builder.group(String::new(), self.labels.len() as i64)
        });
        self.group = Some(group);
        group
    }

    /// Names the groups of a finished surface.
    fn name(self, surface: &mut Surface) {
        let varies =
            [0, 1, 2].map(|kind| self.labels.iter().any(|label| label[kind] != self.labels[0][kind]));
        for (name, number) in surface.groups.iter_mut().zip(&mut surface.group_numbers) {
            let label = &self.labels[*number as usize - 1];
            let telling = |kind: &usize| !label[*kind].is_empty() && (varies[*kind] || varies == [false; 3]);
            let parts: Vec<&str> =
                [0, 1, 2].iter().filter(|k| telling(k)).map(|&k| label[k].as_str()).collect();
            *name = match (varies == [false; 3], parts.is_empty()) {
                (_, true) => "surface".into(),
                (true, false) => parts[0].into(),
                (false, false) => parts.join("/"),
            };
        }
        for (number, place) in surface.group_numbers.iter_mut().zip(1..) {
            *number = place;
        }
    }
}
