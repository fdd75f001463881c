//! Reads triangulated surfaces of other programs: STL, OFF, OBJ, PLY and TetGen's `.poly` and
//! `.smesh`.
//!
//! [`read`] returns points, triangles and the **group** of each triangle, by which the format
//! distinguishes faces (the solids of an STL, the groups or materials of an OBJ, the facet markers
//! of TetGen). Polygons are triangulated by constrained Delaunay triangulation in their plane, so
//! they need not be convex. Points with equal coordinates are merged, triangles that lose a corner
//! by that and copies of faces are dropped, and unused points are listed separately. STL has no
//! connectivity, so only there points that are merely close are merged too, if that closes gaps.
//! [`Surface::notes`] reports all of this.
//!
//! *Not* checked here: whether the surface is closed, oriented, or self-intersecting. Normals in
//! the files are ignored.

mod builder;
mod facet;
mod gaps;
mod merge;
mod obj;
mod off;
mod ply;
mod poly;
mod polygon;
mod repeated;
mod stl;
#[cfg(test)]
mod tests;

pub use super::input::{Place, ReadError};

use super::arrays::{ArrayError, SurfaceArrays, check};
use super::input::{Fault, ending, load, refuse_missing};
use crate::Point;
use builder::Builder;
use std::path::Path;

/// The extensions that [`read`] accepts.
pub const KNOWN: &str = ".stl, .off, .obj, .ply, .poly and .smesh (TetGen)";

/// A triangulated surface as in its file, except for certain artefacts.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Surface {
    /// The points of the triangles, all distinct.
    pub points: Vec<Point>,
    /// The triangles, each with three distinct corners, oriented as in the file.
    pub triangles: Vec<[u32; 3]>,
    /// The group of each triangle, an index of [`groups`](Self::groups).
    pub group: Vec<u32>,
    /// Names of the groups; not empty if there are triangles.
    pub groups: Vec<String>,
    /// Numbers of the groups: TetGen's facet markers, else consecutive from 1.
    pub group_numbers: Vec<i64>,
    /// Points that no triangle uses. In TetGen's formats they become vertices of the mesh.
    pub loose_points: Vec<Point>,
    /// Edges of no polygon. In TetGen's formats they become edges of the mesh.
    pub loose_edges: Vec<[Point; 2]>,
    /// Whether the order of corners is arbitrary, and points in holes define inside and outside
    /// (TetGen).
    pub unoriented: bool,
    /// Points in holes of the volume (TetGen).
    pub holes: Vec<Point>,
    /// Regions of the volume (TetGen).
    pub regions: Vec<Region>,
    /// Repairs and omissions, one sentence each.
    pub notes: Vec<String>,
}

/// A region of the volume in TetGen's formats.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Region {
    /// A point inside.
    pub place: Point,
    /// Its number.
    pub attribute: f64,
    /// The largest volume of a tet in it.
    pub max_volume: Option<f64>,
}

/// Reads a surface in the format of the file's extension, see [`KNOWN`]; the content must match.
///
/// # Errors
/// Unknown formats; malformed or truncated content, with line or byte; I/O errors.
pub fn read(path: &Path) -> Result<Surface, ReadError> {
    refuse_missing(path)?;
    let parse: fn(&[u8]) -> Result<Surface, Fault> = match ending(path).as_str() {
        "stl" => stl::parse,
        "off" => off::parse,
        "obj" => obj::parse,
        "ply" => ply::parse,
        "poly" => return poly::read(path, poly::Kind::Poly),
        "smesh" => return poly::read(path, poly::Kind::Smesh),
        _ => return Err(ReadError::UnknownFormat { path: path.to_path_buf(), known: KNOWN }),
    };
    let content = load(path)?;
    parse(&content)
        .map_err(|fault| misnamed(&content, &ending(path)).unwrap_or(fault).in_file(path, &content))
}

/// A fault if unreadable content clearly has another format than the file's extension.
fn misnamed(content: &[u8], ending: &str) -> Option<Fault> {
    let begins = |start: &[u8]| content.trim_ascii_start().starts_with(start);
    let found = if begins(b"ply\n") || begins(b"ply\r") {
        "ply"
    } else if begins(b"OFF") || begins(b"COFF") {
        "off"
    } else if begins(b"solid") && content.windows(5).take(1000).any(|w| w == b"facet") {
        "stl"
    } else {
        return None;
    };
    (found != ending).then(|| {
        Fault::file(format!("the name ends in .{ending}, but the content is .{found}; rename the file"))
    })
}

/// Makes a surface of arrays in memory.
///
/// # Errors
/// Indices out of range, coordinates that are not finite, lists of the wrong length.
pub fn of_arrays(arrays: &SurfaceArrays) -> Result<Surface, ArrayError> {
    check(arrays.points, [("boundary numbers", arrays.numbers.len(), arrays.triangles.len())])?;
    let mut builder = Builder::new(arrays.points.iter().map(|&p| p.into()).collect())?;
    let mut numbers: Vec<u32> = arrays.numbers.to_vec();
    numbers.sort_unstable();
    numbers.dedup();
    if numbers.is_empty() {
        numbers.push(1);
    }
    for number in &numbers {
        let name = arrays.names.get(number).cloned().unwrap_or_else(|| format!("boundary{number}"));
        builder.group(name, i64::from(*number));
    }
    for (index, corners) in arrays.triangles.iter().enumerate() {
        if let Some(beyond) = corners.iter().find(|&&corner| corner as usize >= arrays.points.len()) {
            let count = arrays.points.len();
            let what = format!("triangle {index} names point {beyond}, and there are {count}");
            return Err(Fault::file(what).into());
        }
        let number = arrays.numbers.get(index).copied().unwrap_or(numbers[0]);
        let group = numbers.binary_search(&number).expect("all numbers are listed");
        let corners = corners.map(|corner| builder.merged(corner));
        builder.face(&corners, index);
        builder.triangles(&[corners], group as u32);
    }
    Ok(builder.finish(&|triangle| format!("triangle {triangle}")))
}
