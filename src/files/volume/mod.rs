//! Reads tetrahedral meshes of other programs: Gmsh, NETGEN, Medit, TetGen, VTU and Elmer.
//!
//! [`read`] returns a classified [`Mesh`]: bodies from the numbers of tets; patches from the
//! numbers of triangles and the bodies on both sides; curves where patches meet and along the edges
//! in the file; corners where curves end or meet. Faces on the outside and between bodies without a
//! triangle in the file become patches of their own. [`VolumeMesh::notes`] lists repairs and
//! omissions.
//!
//! **Orientation.** NETGEN stores tets negatively, and its `.mesh` files do not record that. So the
//! orientation of most tets is taken as the convention of the file. The other tets are reversed if
//! this makes neighbours agree: the writer ignored the order of vertices. If neighbours agree
//! already, such tets are truly inverted: they are kept and listed in [`VolumeMesh::inverted`].
//!
//! *Not* checked: other overlaps of tets. Of second-order elements the mesh has the corners;
//! [`VolumeMesh::edge_points`] has the other nodes of the tets.

mod assemble;
mod boundary;
mod classify;
mod elmer;
mod gmsh;
mod gmsh4;
mod gmsh_periodic;
#[cfg(test)]
mod group_tests;
mod groups;
mod medit;
mod medit_binary;
mod netgen;
#[cfg(test)]
mod order_tests;
mod orient;
mod periodic;
mod pvtu;
mod raw;
#[cfg(test)]
mod samples;
#[cfg(test)]
mod tests;
mod tetgen;
mod vtu;
mod vtu_arrays;
mod vtu_tags;
#[cfg(test)]
mod vtu_tests;

pub use super::input::{Place, ReadError};

use super::arrays::{ArrayError, MeshArrays, check};
use super::input::{Fault, ending, load, refuse_missing};
use crate::ground::mesh::periodic::Link;
use crate::ground::mesh::{Mesh, Names, Rank, TetId};
use raw::{Label, NamesByNumber, Raw};
use std::collections::BTreeMap;
use std::io::Read;
use std::path::Path;

/// Files that [`read`] accepts.
pub const KNOWN: &str = ".vtu, .pvtu, .msh (Gmsh), .vol and .vol.gz (NETGEN), .mesh and .meshb (Medit), \
    .ele, .node and .face (TetGen), and the folder of an Elmer mesh";

/// A tetrahedral mesh read from a file or from arrays.
#[derive(Clone, Debug, Default)]
pub struct VolumeMesh {
    /// The mesh; its tets are positively oriented except the inverted ones.
    pub mesh: Mesh,
    /// Numbers and names, from 1. Patches with the same boundary number between different bodies
    /// share it.
    pub names: Names,
    /// The coordinates of the nodes on the edges of each tet in the order of
    /// [`TET_EDGES`](crate::mesh::TET_EDGES), if all tets are of second order; otherwise empty.
    pub edge_points: Vec<[[f64; 3]; 6]>,
    /// Number of tets whose vertices were reordered for a positive orientation.
    pub turned: usize,
    /// Tets that are not positively oriented: inverted or flat.
    pub inverted: Vec<TetId>,
    /// For each tet the piece of a `.pvtu` that has it, from 0; empty for other formats.
    pub parts: Vec<Rank>,
    /// Periodic copies of patches, with their masters.
    pub links: Vec<Link>,
    /// Repairs, additions and omissions, one sentence each.
    pub notes: Vec<String>,
}

/// Whether a path is a folder, which can be an Elmer mesh, or has the ending of a mesh.
pub fn is_mesh(path: &Path) -> bool {
    const ENDINGS: [&str; 10] = ["vtu", "pvtu", "msh", "vol", "gz", "mesh", "meshb", "ele", "node", "face"];
    path.is_dir() || ENDINGS.contains(&ending(path).as_str())
}

/// Reads a mesh in the format of the file's extension, see [`KNOWN`].
///
/// # Errors
/// Unknown formats; malformed or truncated content, with line or byte; elements other than tets and
/// their boundaries; faces of more than two tets; I/O errors.
pub fn read(path: &Path) -> Result<VolumeMesh, ReadError> {
    refuse_missing(path)?;
    if path.is_dir() {
        return elmer::read(path);
    }
    let parse: fn(&[u8]) -> Result<Raw, Fault> = match ending(path).as_str() {
        "vtu" => return vtu::read(path),
        "pvtu" => return pvtu::read(path),
        "ele" | "node" | "face" => return tetgen::read(path),
        "gz" if ending(Path::new(path.file_stem().unwrap_or_default())) == "vol" => {
            let text = unzipped(path)?;
            return finish(netgen::parse(&text), path, &text);
        }
        "msh" => gmsh::parse,
        "vol" => netgen::parse,
        "mesh" => medit::parse,
        "meshb" => medit_binary::parse,
        _ => return Err(ReadError::UnknownFormat { path: path.to_path_buf(), known: KNOWN }),
    };
    let content = load(path)?;
    finish(parse(&content), path, &content)
}

/// Reads a compressed text. Meshes shrink 3 to 30 times; a file of a thousand times its size is
/// refused before it fills the memory.
fn unzipped(path: &Path) -> Result<Vec<u8>, ReadError> {
    const MOST: u64 = 256;
    let content = load(path)?;
    let most = MOST * content.len() as u64;
    let mut text = Vec::new();
    flate2::read::MultiGzDecoder::new(&content[..])
        .take(most + 1)
        .read_to_end(&mut text)
        .map_err(ReadError::io(path))?;
    if text.len() as u64 > most {
        let what = format!("it holds more than {MOST} times its size, which is no mesh: unpack it first");
        return Err(Fault::file(what).in_file(path, &content));
    }
    Ok(text)
}

fn finish(raw: Result<Raw, Fault>, path: &Path, content: &[u8]) -> Result<VolumeMesh, ReadError> {
    raw.and_then(assemble::assemble).map_err(|fault| fault.in_file(path, content))
}

/// Makes a mesh of arrays in memory.
///
/// # Errors
/// Indices out of range, coordinates that are not finite, lists of the wrong length, faces of more
/// than two tets.
pub fn of_arrays(arrays: &MeshArrays) -> Result<VolumeMesh, ArrayError> {
    let lengths = [
        ("body numbers", arrays.bodies.len(), arrays.tets.len()),
        ("boundary numbers", arrays.boundaries.len(), arrays.triangles.len()),
    ];
    check(arrays.points, lengths)?;
    let labels = |numbers: &[u32], count: usize| -> Vec<Label> {
        let number = |index: usize| numbers.get(index).copied().map_or(1, i64::from);
        (0..count).map(|index| Label::number(number(index))).collect()
    };
    let names = |names: &BTreeMap<u32, String>| -> NamesByNumber {
        names.iter().map(|(number, name)| (i64::from(*number), vec![name.clone()])).collect()
    };
    let raw = Raw {
        points: arrays.points.iter().map(|&p| p.into()).collect(),
        tets: arrays.tets.to_vec(),
        tet_labels: labels(arrays.bodies, arrays.tets.len()),
        triangles: arrays.triangles.to_vec(),
        triangle_labels: labels(arrays.boundaries, arrays.triangles.len()),
        body_names: names(&arrays.body_names),
        patch_names: names(&arrays.boundary_names),
        ..Raw::default()
    };
    Ok(assemble::assemble(raw)?)
}
