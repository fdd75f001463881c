//! Medit's `.mesh`: keywords, counts and lists; each line ends with a reference.

use super::raw::{Label, Raw, Shape};
use crate::files::input::{Fault, Words, shown};
use crate::files::node_order::VTK;

/// The shape and number of nodes of a block of elements; corners come first.
pub(super) fn block(keyword: &str) -> Option<(Shape, usize)> {
    Some(match keyword {
        "Edges" => (Shape::Edge, 2),
        "Triangles" => (Shape::Triangle, 3),
        "Tetrahedra" => (Shape::Tet, 4),
        "EdgesP2" => (Shape::Edge, 3),
        "TrianglesP2" => (Shape::Triangle, 6),
        "TetrahedraP2" => (Shape::Tet, 10),
        "QuadrilateralsQ2" => (Shape::Other("quadrangle"), 9),
        "HexahedraQ2" => (Shape::Other("hexahedron"), 27),
        "PrismsP2" => (Shape::Other("prism"), 18),
        "PyramidsP2" => (Shape::Other("pyramid"), 14),
        "Quadrilaterals" => (Shape::Other("quadrangle"), 4),
        "Hexahedra" | "Hexaedra" => (Shape::Other("hexahedron"), 8),
        "Prisms" => (Shape::Other("prism"), 6),
        "Pyramids" => (Shape::Other("pyramid"), 5),
        _ => return None,
    })
}

/// Whether skipping a block would change the mesh: elements above second order, and node orders in
/// which corners may not come first.
fn is_unread(keyword: &str) -> bool {
    let is_order = |end: &str| matches!(end, "P3" | "P4" | "Q3" | "Q4");
    keyword.ends_with("Ordering") || keyword.get(keyword.len().saturating_sub(2)..).is_some_and(is_order)
}

/// The message that refuses such a block.
pub(super) fn unread(keyword: &str) -> String {
    format!("`{keyword}` is not read: save the mesh in first order")
}

pub(super) fn parse(content: &[u8]) -> Result<Raw, Fault> {
    let mut words = Words::with_comments(content);
    if words.word("MeshVersionFormatted")? != b"MeshVersionFormatted" {
        let mfem = words.peek() == Some(b"mesh");
        return Err(words.fault(if mfem {
            "MFEM's meshes are not read; this ending is Medit's"
        } else {
            "expected `MeshVersionFormatted`: not a Medit mesh"
        }));
    }
    words.int("the version")?;
    let mut raw = Raw { edge_order: Some(&VTK), ..Raw::default() };
    let mut nodes = Vec::new();
    let mut has_vertices = false;
    while let Some(word) = words.next() {
        let keyword = String::from_utf8_lossy(word);
        match (&*keyword, block(&keyword)) {
            ("Dimension", _) => {
                let dimension = words.int("the dimension")?;
                if dimension != 3 {
                    return Err(words.fault(format!("a mesh of dimension {dimension}; 3 is needed")));
                }
            }
            ("Vertices", _) => {
                let count = words.count("vertices", 4)?;
                raw.points = Vec::with_capacity(count);
                for _ in 0..count {
                    raw.points.push(words.point("a coordinate")?);
                    words.word("a reference")?;
                }
                has_vertices = true;
            }
            (_, Some((shape, corners))) => {
                let count = words.count("elements", corners + 1)?;
                for _ in 0..count {
                    nodes.clear();
                    for _ in 0..corners {
                        nodes.push(words.vertex_to_come(1)?);
                    }
                    let label = Label::number(words.int("a reference")?);
                    raw.add(shape, &nodes, label).map_err(|message| words.fault(message))?;
                }
            }
            (keyword, _) if is_unread(keyword) => return Err(words.fault(unread(keyword))),
            ("End", _) => return done(raw, has_vertices),
            _ if word[0].is_ascii_alphabetic() => skip_block(&mut words),
            _ => return Err(words.fault(format!("expected a keyword, found `{}`", shown(word)))),
        }
    }
    // Many writers omit `End`.
    done(raw, has_vertices)
}

fn done(raw: Raw, has_vertices: bool) -> Result<Raw, Fault> {
    if has_vertices { Ok(raw) } else { Err(Fault::file("the file has no `Vertices`")) }
}

/// Skips to the next keyword.
fn skip_block(words: &mut Words) {
    while words.peek().is_some_and(|word| !word[0].is_ascii_alphabetic()) {
        words.next();
    }
}
