//! Writes the cut geometry as a `.geo` file.

use super::cuts::{CutPlane, Cuts, Half};
use csg::{Body, BodyId, Geometry};
use std::fmt::Write;

/// The text of a geometry with its bodies cut, for tetmill and NETGEN: the original file without
/// its `tlo NAME;` statements, then the planes, the pieces and a `tlo` for each.
///
/// A body without a material gets its name as material, so that its pieces have the same material.
pub fn geo_text(source: &str, geometry: &Geometry, cuts: &Cuts, pieces: &[(usize, BodyId)]) -> String {
    let mut text = without_bodies(source);
    if !text.ends_with('\n') {
        text.push('\n');
    }
    let parts = cuts.leaves.len();
    let _ = writeln!(text, "\n# Cut into {parts} parts.");
    for (k, CutPlane { point, normal }) in cuts.planes.iter().enumerate() {
        let [p, n] = [point.coords, *normal].map(|v| format!("{:?}, {:?}, {:?}", v.x, v.y, v.z));
        let _ = writeln!(text, "solid cut_{} = plane ({p}; {n});", k + 1);
    }
    for &(part, body) in pieces {
        let body = &geometry.bodies[body.index()];
        let name = format!("part_{}_{}", part + 1, body.name);
        let half = |half: &Half| {
            let not = if half.positive { "not " } else { "" };
            format!(" and {not}cut_{}", half.plane + 1)
        };
        let halves: String = cuts.leaves[part].iter().map(half).collect();
        let _ = writeln!(text, "solid {name} = {}{halves};\ntlo {name}{};", body.name, flags(body));
    }
    text
}

/// The `tlo` flags of a body, for a piece of it.
fn flags(body: &Body) -> String {
    let mut flags = String::new();
    if let Some(maxh) = body.maxh {
        let _ = write!(flags, " -maxh={maxh:?}");
    }
    if let Some([red, green, blue]) = body.color {
        let _ = write!(flags, " -col=[{red:?}, {green:?}, {blue:?}]");
    }
    if body.transparent {
        flags.push_str(" -transparent");
    }
    let material = body.material.as_ref().unwrap_or(&body.name);
    let _ = write!(flags, " -material={material}");
    flags
}

/// The text without the statements `tlo NAME ...;` of bodies.
fn without_bodies(source: &str) -> String {
    let mut text = String::with_capacity(source.len());
    let mut rest = source;
    // Statements end at semicolons outside comments; the initial keyword `algebraic3d` has none.
    while !rest.is_empty() {
        let end = statement_end(rest);
        let (statement, after) = rest.split_at(end);
        let start = statement_start(statement);
        match is_body(&statement[start..]) {
            true => text.push_str(&statement[..start]),
            false => text.push_str(statement),
        }
        rest = after;
    }
    text
}

/// The end of a text's first statement, after its semicolon. Semicolons in brackets separate
/// points.
fn statement_end(text: &str) -> usize {
    let (mut in_comment, mut depth) = (false, 0);
    for (at, c) in text.char_indices() {
        match c {
            '\n' | '\r' => in_comment = false,
            _ if in_comment => {}
            '#' => in_comment = true,
            '(' | '[' => depth += 1,
            ')' | ']' => depth -= 1,
            ';' if depth == 0 => return at + 1,
            _ => {}
        }
    }
    text.len()
}

/// The start of the first word of a statement, after blanks, comments and the initial keyword.
fn statement_start(statement: &str) -> usize {
    let mut at = 0;
    loop {
        let rest = &statement[at..];
        let blank =
            rest.len() - rest.trim_start_matches(|c: char| c.is_whitespace() || c == '\u{feff}').len();
        let rest = &rest[blank..];
        at += blank;
        if rest.starts_with('#') {
            at += rest.find(['\n', '\r']).unwrap_or(rest.len());
        } else if rest.starts_with("algebraic3d") {
            at += "algebraic3d".len();
        } else {
            return at;
        }
    }
}

/// Whether a statement is `tlo NAME` (and not `tlo NAME SURFACE`).
fn is_body(statement: &str) -> bool {
    let mut words = statement.split(|c: char| c.is_whitespace() || c == ';').filter(|word| !word.is_empty());
    words.next() == Some("tlo") && words.nth(1).is_none_or(|word| word.starts_with(['-', '#']))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bodies_are_taken_out_and_all_else_is_kept() {
        let source = "algebraic3d # tlo a;\nsolid a = sphere (0, 0, 0; 1)\n  -maxh=1; solid tlow = a;\ntlo a -col=[1, 0, 0]; # red\n\
                      tlo a b;\ntlo tlow;point (0, 0, 0);";
        let expected = "algebraic3d # tlo a;\nsolid a = sphere (0, 0, 0; 1)\n  -maxh=1; solid tlow = a;\n # red\n\
                        tlo a b;\npoint (0, 0, 0);";
        assert_eq!(without_bodies(source), expected);
    }
}
