//! Shapes: vertices, edges, wires, faces, shells, solids and compounds.

use super::tokens::Tokens;
use crate::curve::Curve;
use crate::surface::Surface;
use crate::{BrepError, Placement, Point};

/// The content of a file.
#[derive(Clone, Debug, Default)]
pub(crate) struct File {
    /// Placements; the first is the identity.
    pub locations: Vec<Placement>,
    pub curves_2d: Vec<Curve<2>>,
    pub curves: Vec<Curve<3>>,
    pub surfaces: Vec<Surface>,
    /// Shapes; each uses only earlier ones.
    pub shapes: Vec<Shape>,
    pub roots: Vec<Use>,
}

/// How a shape is used by another one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Orientation {
    Forward,
    Reversed,
    Internal,
    External,
}

/// A use of a shape.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Use {
    pub shape: u32,
    pub orientation: Orientation,
    /// An index of [`File::locations`].
    pub location: u32,
}

/// A shape with its own geometry.
#[derive(Clone, Debug)]
pub(crate) struct Shape {
    pub kind: Kind,
    pub parts: Vec<Use>,
    /// The line where it starts.
    pub line: usize,
}

#[derive(Clone, Debug)]
pub(crate) enum Kind {
    Vertex {
        point: Point,
        tolerance: f64,
    },
    Edge {
        tolerance: f64,
        is_degenerate: bool,
        /// An index of [`File::curves`], one of [`File::locations`], and the range.
        curve: Option<(usize, usize, [f64; 2])>,
        on_surfaces: Vec<CurveOnSurface>,
    },
    Face {
        /// Indices of [`File::surfaces`] and [`File::locations`].
        surface: Option<(usize, usize)>,
    },
    Wire,
    Shell,
    Solid,
    Compound,
}

/// An edge in the parameters of a surface.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CurveOnSurface {
    /// Curves for the edge used forward and reversed; different ones on a seam.
    pub curves: [usize; 2],
    pub surface: usize,
    pub location: usize,
    pub range: [f64; 2],
}

pub(super) fn read(tokens: &mut Tokens, version: u32, mut file: File) -> Result<File, BrepError> {
    let count = tokens.count()?;
    for index in 0..count {
        let word = tokens.word()?;
        let line = tokens.line;
        let kind = match word {
            "Ve" => vertex(tokens, &file)?,
            "Ed" => edge(tokens, version, &file)?,
            "Fa" => face(tokens, &file)?,
            "Wi" => Kind::Wire,
            "Sh" => Kind::Shell,
            "So" => Kind::Solid,
            "CS" | "Co" => Kind::Compound,
            _ => return Err(tokens.error(&format!("`{word:.40}` is no kind of shape"))),
        };
        let flags = tokens.word()?;
        if flags.len() != 7 || flags.bytes().any(|c| !matches!(c, b'0' | b'1')) {
            return Err(tokens.error(&format!("seven flags are expected, not `{flags:.40}`")));
        }
        let mut parts = Vec::new();
        while let Some(part) = usage(tokens, count, index, &file)? {
            parts.push(part);
        }
        file.shapes.push(Shape { kind, parts, line });
    }
    while let Ok(word) = tokens.peek() {
        if word == "*" {
            tokens.word()?;
            continue;
        }
        // How OpenCASCADE's Draw ends a shape that it saved.
        if word == "0" && !file.roots.is_empty() {
            break;
        }
        match usage(tokens, count, count, &file)? {
            Some(root) => file.roots.push(root),
            None => break,
        }
    }
    if file.roots.is_empty() {
        return Err(tokens.error("the file ends without its main shape"));
    }
    Ok(file)
}

/// A use of a shape; `None` at the asterisk that ends a list. Shapes are numbered backward, and one
/// uses only shapes before it.
fn usage(tokens: &mut Tokens, count: usize, own: usize, file: &File) -> Result<Option<Use>, BrepError> {
    let word = tokens.word()?;
    let orientation = match word.as_bytes()[0] {
        b'*' => return Ok(None),
        b'+' => Orientation::Forward,
        b'-' => Orientation::Reversed,
        b'i' => Orientation::Internal,
        b'e' => Orientation::External,
        _ => return Err(tokens.error(&format!("a shape's use is expected, not `{word:.40}`"))),
    };
    let number = word.get(1..).and_then(|n| n.parse::<usize>().ok());
    let shape = number
        .and_then(|n| count.checked_sub(n))
        .filter(|&shape| shape < own)
        .ok_or_else(|| tokens.error(&format!("`{word:.40}` is not the number of an earlier shape")))?;
    let location = tokens.index(file.locations.len() - 1)?;
    Ok(Some(Use { shape: shape as u32, orientation, location: location as u32 }))
}

/// A tolerance (length).
fn tolerance(tokens: &mut Tokens) -> Result<f64, BrepError> {
    let tolerance = tokens.number()?;
    if tolerance >= 0.0 { Ok(tolerance) } else { Err(tokens.error("a tolerance is negative")) }
}

fn vertex(tokens: &mut Tokens, file: &File) -> Result<Kind, BrepError> {
    let tolerance = tolerance(tokens)?;
    let point = Point::from(tokens.vector::<3>()?);
    // Parameters on curves and surfaces are not needed.
    loop {
        tokens.number()?;
        let kind = tokens.integer()?;
        match kind {
            0 => return Ok(Kind::Vertex { point, tolerance }),
            1 => drop(tokens.index(file.curves.len())?),
            2 => {
                tokens.index(file.curves_2d.len())?;
                tokens.index(file.surfaces.len())?;
            }
            3 => {
                tokens.number()?;
                tokens.index(file.surfaces.len())?;
            }
            _ => return Err(tokens.error(&format!("a vertex has data of kind {kind}; 0 to 3 are known"))),
        }
        tokens.index(file.locations.len() - 1)?;
    }
}

/// An index from 1 as one from 0.
fn item(tokens: &mut Tokens, count: usize) -> Result<usize, BrepError> {
    let index = tokens.index(count)?;
    index.checked_sub(1).ok_or_else(|| tokens.error("an item 0 is used"))
}

/// Names of continuity, as between two surfaces at an edge.
fn continuity(tokens: &mut Tokens) -> Result<(), BrepError> {
    match tokens.word()? {
        "C0" | "C1" | "C2" | "C3" | "CN" | "G1" | "G2" => Ok(()),
        word => Err(tokens.error(&format!("a continuity is expected, not `{word:.40}`"))),
    }
}

fn edge(tokens: &mut Tokens, version: u32, file: &File) -> Result<Kind, BrepError> {
    let tolerance = tolerance(tokens)?;
    tokens.skip_numbers(2)?;
    let is_degenerate = tokens.flag()?;
    let mut curve = None;
    let mut on_surfaces = Vec::new();
    let location = |tokens: &mut Tokens| tokens.index(file.locations.len() - 1);
    loop {
        match tokens.integer()? {
            0 => return Ok(Kind::Edge { tolerance, is_degenerate, curve, on_surfaces }),
            1 => {
                let index = tokens.index(file.curves.len())?;
                let location = location(tokens)?;
                let range = [tokens.number()?, tokens.number()?];
                if let Some(index) = index.checked_sub(1) {
                    curve = Some((index, location, range));
                }
            }
            kind @ (2 | 3) => {
                let first = item(tokens, file.curves_2d.len())?;
                let mut curves = [first, first];
                if kind == 3 {
                    let second = tokens.index_before_word(file.curves_2d.len())?;
                    curves[1] = second.checked_sub(1).ok_or_else(|| tokens.error("an item 0 is used"))?;
                    continuity(tokens)?;
                }
                let surface = item(tokens, file.surfaces.len())?;
                let location = location(tokens)?;
                let range = [tokens.number()?, tokens.number()?];
                if version == 2 {
                    // The parameters of both ends.
                    tokens.skip_numbers(4)?;
                }
                on_surfaces.push(CurveOnSurface { curves, surface, location, range });
            }
            4 => {
                continuity(tokens)?;
                for _ in 0..2 {
                    tokens.index(file.surfaces.len())?;
                    location(tokens)?;
                }
            }
            5 => {
                tokens.integer()?;
                location(tokens)?;
            }
            kind @ (6 | 7) => {
                (4..kind).try_for_each(|_| tokens.integer().map(|_| ()))?;
                location(tokens)?;
            }
            kind => {
                return Err(tokens.error(&format!("an edge has data of kind {kind}; 0 to 7 are known")));
            }
        }
    }
}

fn face(tokens: &mut Tokens, file: &File) -> Result<Kind, BrepError> {
    tokens.flag()?;
    tolerance(tokens)?;
    let surface = tokens.index(file.surfaces.len())?;
    let location = tokens.index(file.locations.len() - 1)?;
    // A triangulation may follow; flags have seven digits.
    if tokens.peek()? == "2" {
        tokens.word()?;
        tokens.integer()?;
    }
    Ok(Kind::Face { surface: surface.checked_sub(1).map(|surface| (surface, location)) })
}
