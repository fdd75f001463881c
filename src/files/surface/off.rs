//! OFF, Geomview's format of polygons, as text: `[ST][C][N]OFF` with three coordinates a point.
//!
//! Colours, normals and texture coordinates are skipped.

use super::Surface;
use super::builder::Builder;
use crate::files::input::{Fault, Words, line_of, shown};

pub(super) fn parse(content: &[u8]) -> Result<Surface, Fault> {
    let mut words = Words::with_comments(content);
    let has_extras = header(&mut words)?;
    let count = words.count("points", 3)?;
    let faces = words.count("faces", 1)?;
    // The number of edges is not used, and some writers omit it.
    if words.next_in_line().is_none() && is_alone_in_line(&words) {
        words.next();
    }
    let mut points = Vec::with_capacity(count);
    for _ in 0..count {
        points.push(words.point("a coordinate")?);
        if has_extras {
            words.rest_of_line();
        }
    }
    let mut builder = Builder::new(points)?;
    let group = builder.group("surface".into(), 1);
    let mut corners = Vec::new();
    for _ in 0..faces {
        let sides = words.count("corners of a face", 1)?;
        let begin = words.clone();
        corners.clear();
        for _ in 0..sides {
            corners.push(words.vertex(0, count)?);
        }
        builder
            .polygon(&corners, group, begin.offset())
            .map_err(|fault| begin.fault(format!("the face cannot be cut into triangles: {fault}")))?;
        // The rest of the line is a colour.
        words.rest_of_line();
    }
    if faces == 0 {
        return Err(Fault::file("the file has no faces"));
    }
    Ok(builder.finish(&|offset| format!("line {}", line_of(content, offset))))
}

/// Parses the keyword, which is optional; returns whether points have more than coordinates.
fn header(words: &mut Words) -> Result<bool, Fault> {
    let mut after = words.clone();
    let word = after.word("the keyword `OFF`")?;
    let name = String::from_utf8_lossy(word).into_owned();
    let Some(prefix) = name.strip_suffix("OFF") else {
        return if word[0].is_ascii_digit() {
            Ok(false)
        } else if word[0] == b'{' {
            Err(after.fault("an object in braces; only a plain OFF file is read"))
        } else {
            Err(after.fault(format!("expected the keyword `OFF`, found `{}`", shown(word))))
        };
    };
    let rest = prefix.strip_prefix("ST").unwrap_or(prefix);
    let rest = rest.strip_prefix('C').unwrap_or(rest);
    let rest = rest.strip_prefix('N').unwrap_or(rest);
    match rest {
        "" => {}
        "4" | "n" | "4n" => {
            return Err(after.fault(format!("`{name}`: points of other than three coordinates are not read")));
        }
        _ => return Err(after.fault(format!("expected the keyword `OFF`, found `{}`", shown(word)))),
    }
    if after.peek() == Some(b"BINARY") {
        return Err(after.fault("binary OFF is not read; write it as text, or as binary STL or PLY"));
    }
    *words = after;
    Ok(!prefix.is_empty())
}

/// Whether the next non-empty line has a single word.
fn is_alone_in_line(words: &Words) -> bool {
    let mut words = words.clone();
    words.next().is_some() && words.next_in_line().is_none()
}
