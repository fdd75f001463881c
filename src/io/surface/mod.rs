//! Triangulated surfaces of others: STL, OFF, OBJ, PLY and TetGen's `.poly` and `.smesh`.
//!
//! [`read`] gives points, triangles and the **group** of each triangle: what the format has to tell faces apart
//! (the solids of an STL, the groups or materials of an OBJ, the facet markers of TetGen). Polygons are cut into
//! triangles by the constrained Delaunay triangulation in their plane, so they need not be convex. Points at
//! exactly the same place become one, triangles that lose a corner by that go, and points that no triangle uses
//! stand apart. Only for STL, which has no connectivity of its own, points that are merely close become one too, and
//! only where that closes gaps. All of this is told in [`Surface::notes`].
//!
//! *Not* checked here: whether the surface is closed, oriented, or meets itself. Normals in the files are not read.

mod builder;
mod facet;
mod gaps;
mod merge;
mod obj;
mod off;
mod ply;
mod poly;
mod polygon;
mod stl;
#[cfg(test)]
mod tests;

pub use super::input::{Place, ReadError};

use super::input::{Fault, ending, load, refuse_missing};
use crate::Point;
use std::path::Path;

/// The ends of names that [`read`] knows.
pub const KNOWN: &str = ".stl, .off, .obj, .ply, .poly and .smesh (TetGen)";

/// Triangles of others, as a file says, cleaned of what is certainly an artefact.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Surface {
    /// The points of triangles, no two at the same place.
    pub points: Vec<Point>,
    /// The triangles, each with three different corners, oriented as in the file.
    pub triangles: Vec<[u32; 3]>,
    /// The group of each triangle, an index of [`groups`](Self::groups).
    pub group: Vec<u32>,
    /// The groups' names; never empty where there are triangles.
    pub groups: Vec<String>,
    /// The groups' numbers: TetGen's facet markers, else their places from 1.
    pub group_numbers: Vec<i64>,
    /// Points that no triangle uses. In TetGen's formats they are to be vertices of the mesh.
    pub loose_points: Vec<Point>,
    /// Edges that belong to no polygon; in TetGen's formats they are to be edges of the mesh.
    pub loose_edges: Vec<[Point; 2]>,
    /// Whether the order of corners says nothing of inside and outside, but points in holes do (TetGen).
    pub unoriented: bool,
    /// Points in holes of the volume (TetGen).
    pub holes: Vec<Point>,
    /// What is said about regions of the volume (TetGen).
    pub regions: Vec<Region>,
    /// What was mended or left out, a sentence each.
    pub notes: Vec<String>,
}

/// A region of the volume, as TetGen's formats mark it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Region {
    /// A point inside.
    pub place: Point,
    /// Its number.
    pub attribute: f64,
    /// The largest volume of a tet in it.
    pub max_volume: Option<f64>,
}

/// Reads a surface; the end of the file's name tells the format, see [`KNOWN`], and the content must agree.
///
/// # Errors
/// A format that is not known; content that is not of the format, or cut off, with line or byte; what the system says.
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

/// Where the content of a file that could not be read is plainly of another format than its name says.
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
