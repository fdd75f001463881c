//! TetGen's `.node`, `.ele` and, if it exists, `.face`.

use super::raw::{Label, Raw, Shape};
use super::{VolumeMesh, finish};
use crate::files::input::tetgen_nodes;
use crate::files::input::{Fault, ReadError, Words, beside, float, load, shown};
use std::path::Path;

/// Reads the files with the name of `path` and TetGen's extensions.
pub(super) fn read(path: &Path) -> Result<VolumeMesh, ReadError> {
    let [node, ele, face] = ["node", "ele", "face"].map(|ending| beside(path, ending));
    let content = load(&node)?;
    let nodes = tetgen_nodes::read(&mut Words::with_comments(&content))
        .map_err(|fault| fault.in_file(&node, &content))?;
    let mut raw = Raw { points: nodes.points, ..Raw::default() };
    let content = load(&ele)?;
    let corners = tets(&content, nodes.base, &mut raw).map_err(|fault| fault.in_file(&ele, &content))?;
    if face.exists() {
        let content = load(&face)?;
        faces(&content, nodes.base, corners > 4, &mut raw).map_err(|fault| fault.in_file(&face, &content))?;
    } else {
        raw.notes.push(format!("there is no {}: no boundary numbers", face.display()));
    }
    finish(Ok(raw), &ele, &content)
}

/// Parses `count nodes attributes`, then `id vertex… region`; returns the number of nodes per tet.
fn tets(content: &[u8], base: i64, raw: &mut Raw) -> Result<usize, Fault> {
    let mut words = Words::with_comments(content);
    let count = words.count("tetrahedra", 5)?;
    let corners = words.int("the number of corners, 4 or 10")?;
    if corners != 4 && corners != 10 {
        return Err(words.fault(format!("elements of {corners} corners; 4 or 10 are expected")));
    }
    let has_region = words.next_in_line().is_some_and(|word| word != b"0");
    words.rest_of_line();
    let mut nodes = Vec::new();
    for _ in 0..count {
        let number = words.int("the number of a tetrahedron")?;
        read_nodes(&mut words, corners as usize, base, raw.points.len(), &mut nodes)?;
        let label = if has_region { region(&mut words)? } else { Label::default() };
        words.rest_of_line();
        raw.add(Shape::Tet, &nodes, label).map_err(|message| words.fault(message))?;
        raw.tet_numbers.push(number.unsigned_abs());
    }
    Ok(corners as usize)
}

/// Parses a region attribute, which may be written as `1.0`. Non-integers distinguish regions by
/// entity only.
fn region(words: &mut Words) -> Result<Label, Fault> {
    let word = words.word("a region")?;
    let value =
        float(word).ok_or_else(|| words.fault(format!("expected a region, found `{}`", shown(word))))?;
    if value.fract() == 0.0 && value.abs() < 1e15 {
        return Ok(Label::number(value as i64));
    }
    Ok(Label { entity: value.to_bits() as i64, number: 0 })
}

/// Parses `count marker`, then `id vertex… marker`, and with `-nn` the tets on both sides.
///
/// With second-order tets (`-o2`) faces have six nodes too, which the header does not say. The
/// number of columns decides: three nodes with everything that may follow are fewer columns.
fn faces(content: &[u8], base: i64, second_order: bool, raw: &mut Raw) -> Result<(), Fault> {
    let mut words = Words::with_comments(content);
    let count = words.count("faces", 4)?;
    let has_marker = words.next_in_line().is_some_and(|word| word != b"0");
    words.rest_of_line();
    let has_six = second_order && columns(&words) >= 1 + 6 + usize::from(has_marker);
    let mut nodes = Vec::new();
    for _ in 0..count {
        words.int("the number of a face")?;
        read_nodes(&mut words, if has_six { 6 } else { 3 }, base, raw.points.len(), &mut nodes)?;
        let marker = if has_marker { words.int("a marker")? } else { 0 };
        words.rest_of_line();
        raw.add(Shape::Triangle, &nodes, Label::number(marker)).map_err(|message| words.fault(message))?;
    }
    Ok(())
}

/// Number of words on the next non-empty line.
fn columns(words: &Words) -> usize {
    let mut ahead = words.clone();
    let first = usize::from(ahead.next().is_some());
    first + std::iter::from_fn(|| ahead.next_in_line()).count()
}

fn read_nodes(
    words: &mut Words,
    corners: usize,
    base: i64,
    count: usize,
    nodes: &mut Vec<u32>,
) -> Result<(), Fault> {
    nodes.clear();
    for _ in 0..corners {
        nodes.push(words.vertex(base, count)?);
    }
    Ok(())
}
