//! Reads the text of a BREP file.
//!
//! Source: Open CASCADE Technology, documentation "BRep Format" (versions 1 to 3 of the topology).

mod geometry;
mod shapes;
mod tokens;

pub(crate) use shapes::{CurveOnSurface, File, Kind, Orientation, Use};

use crate::{BrepError, Placement};
use nalgebra::Matrix3;
use tokens::Tokens;

/// Reads a file.
///
/// # Errors
/// [`BrepError::Syntax`] with the line.
pub(crate) fn read(text: &[u8]) -> Result<File, BrepError> {
    let mut tokens = Tokens::new(text);
    let version = header(&mut tokens)?;
    tokens.expect("Locations")?;
    let locations = locations(&mut tokens)?;
    tokens.expect("Curve2ds")?;
    let curves_2d = tokens.list(geometry::curve_2d)?;
    tokens.expect("Curves")?;
    let curves = tokens.list(geometry::curve_3d)?;
    tokens.expect("Polygon3D")?;
    tokens.list(skip_polygon)?;
    tokens.expect("PolygonOnTriangulations")?;
    tokens.list(skip_polygon_on_triangulation)?;
    tokens.expect("Surfaces")?;
    let surfaces = tokens.list(geometry::surface)?;
    tokens.expect("Triangulations")?;
    tokens.list(|tokens| skip_triangulation(tokens, version))?;
    tokens.expect("TShapes")?;
    shapes::read(&mut tokens, version, File { locations, curves_2d, curves, surfaces, ..File::default() })
}

/// Reads up to the version of the topology.
fn header(tokens: &mut Tokens) -> Result<u32, BrepError> {
    const UNKNOWN: &str = "this is no BREP text: `CASCADE Topology V1`, `V2` or `V3` is missing";
    let mut word = tokens.word().map_err(|_| tokens.error(UNKNOWN))?;
    if word == "DBRep_DrawableShape" {
        word = tokens.word()?;
    }
    if word == "Open" {
        return Err(tokens.error("this is a binary BREP file: write it as text"));
    }
    if word != "CASCADE" || tokens.word()? != "Topology" {
        return Err(tokens.error(UNKNOWN));
    }
    let version = match tokens.word()?.trim_end_matches(',') {
        "V1" => 1,
        "V2" => 2,
        "V3" => 3,
        _ => return Err(tokens.error(UNKNOWN)),
    };
    tokens.skip_line();
    Ok(version)
}

/// Reads the table of placements. The first is the identity, index 0.
fn locations(tokens: &mut Tokens) -> Result<Vec<Placement>, BrepError> {
    let count = tokens.count()?;
    let mut all = vec![Placement::IDENTITY];
    for _ in 0..count {
        let placement = match tokens.integer()? {
            1 => {
                let mut rows = [[0.0; 4]; 3];
                for x in rows.iter_mut().flatten() {
                    *x = tokens.number()?;
                }
                let [a, b, c] = rows;
                let linear = Matrix3::new(a[0], a[1], a[2], b[0], b[1], b[2], c[0], c[1], c[2]);
                let placement = Placement { linear, shift: [a[3], b[3], c[3]].into() };
                if !placement.is_similarity() {
                    return Err(tokens.error("a location must be a rotation, a uniform scale and a shift"));
                }
                placement
            }
            2 => {
                let mut product = Placement::IDENTITY;
                loop {
                    let index = tokens.index(all.len() - 1)?;
                    if index == 0 {
                        break product;
                    }
                    let power = tokens.integer()?;
                    // The innermost factor comes first.
                    product = power_of(&all[index], power)
                        .ok_or_else(|| tokens.error("the power of a location must be -1000 to 1000"))?
                        .after(&product);
                }
            }
            other => return Err(tokens.error(&format!("a location has kind {other}; 1 and 2 are known"))),
        };
        all.push(placement);
    }
    Ok(all)
}

fn power_of(base: &Placement, power: i64) -> Option<Placement> {
    let base = if power < 0 { base.inverse()? } else { *base };
    let count = power.unsigned_abs();
    (count <= 1000).then(|| (0..count).fold(Placement::IDENTITY, |product, _| product.after(&base)))
}

fn skip_polygon(tokens: &mut Tokens) -> Result<(), BrepError> {
    let nodes = tokens.count()?;
    let has_parameters = tokens.integer()? != 0;
    tokens.number()?;
    tokens.skip_numbers(nodes.saturating_mul(if has_parameters { 4 } else { 3 }))
}

fn skip_polygon_on_triangulation(tokens: &mut Tokens) -> Result<(), BrepError> {
    let nodes = tokens.count()?;
    tokens.skip_numbers(nodes)?;
    tokens.expect("p")?;
    tokens.number()?;
    let has_parameters = tokens.integer()? != 0;
    tokens.skip_numbers(if has_parameters { nodes } else { 0 })
}

fn skip_triangulation(tokens: &mut Tokens, version: u32) -> Result<(), BrepError> {
    let (nodes, triangles) = (tokens.count()?, tokens.count()?);
    let has_parameters = tokens.integer()? != 0;
    let has_normals = version >= 3 && tokens.integer()? != 0;
    tokens.number()?;
    let of_node = 3 + if has_parameters { 2 } else { 0 } + if has_normals { 3 } else { 0 };
    tokens.skip_numbers(nodes.saturating_mul(of_node).saturating_add(triangles.saturating_mul(3)))
}
