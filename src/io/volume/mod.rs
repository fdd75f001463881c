//! Tetrahedral meshes of others: Gmsh, NETGEN, Medit, TetGen, VTU and Elmer.
//!
//! [`read`] gives a classified [`Mesh`], as far as the file says: bodies by the numbers of tets, patches by the
//! numbers of triangles and the bodies on both sides, curves where patches meet and along the file's own edges,
//! corners where curves end or meet. Faces on the outside and between bodies that the file has no triangle for become
//! patches of their own. What is mended or left out is told in [`VolumeMesh::notes`].
//!
//! **Orientation.** NETGEN stores tets negatively, and its `.mesh` files say so nowhere; so what most tets
//! have is taken for the convention of the file. Tets that still differ are turned where that makes neighbours
//! agree (the writer did not care for the order); where neighbours agree as they are, such a tet is truly inverted: it
//! stays, and stands in [`VolumeMesh::inverted`].
//!
//! *Not* checked: whether tets overlap otherwise. Elements of second order keep their corners alone.

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
#[cfg(test)]
mod vtu_tests;

pub use super::input::{Place, ReadError};

use super::input::{Fault, ending, load, refuse_missing};
use crate::mesh::{Mesh, Names, TetId};
use crate::periodic::Link;
use raw::Raw;
use std::io::Read;
use std::path::Path;

/// What [`read`] knows.
pub const KNOWN: &str = ".vtu, .pvtu, .msh (Gmsh), .vol and .vol.gz (NETGEN), .mesh and .meshb (Medit), \
    .ele, .node and .face (TetGen), and the folder of an Elmer mesh";

/// A tetrahedral mesh of others.
#[derive(Clone, Debug, Default)]
pub struct VolumeMesh {
    /// The mesh; its tets are positively oriented but for the inverted ones.
    pub mesh: Mesh,
    /// Numbers and names, from 1; a patch and its continuation between other bodies have the same number.
    pub names: Names,
    /// Tets whose vertices were put in another order than the file's, for a positive orientation.
    pub turned: usize,
    /// Tets that are not positively oriented: inverted or flat.
    pub inverted: Vec<TetId>,
    /// Patches that are periodic images of others.
    pub links: Vec<Link>,
    /// What was mended, added or left out, a sentence each.
    pub notes: Vec<String>,
}

/// Reads a mesh; the end of the file's name tells the format, see [`KNOWN`].
///
/// # Errors
/// A format that is not known; content that is not of the format, or cut off, with line or byte; elements
/// other than tets and what bounds them; faces of more than two tets; what the system says.
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
            let content = load(path)?;
            let mut text = Vec::new();
            flate2::read::MultiGzDecoder::new(&content[..])
                .read_to_end(&mut text)
                .map_err(ReadError::io(path))?;
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

fn finish(raw: Result<Raw, Fault>, path: &Path, content: &[u8]) -> Result<VolumeMesh, ReadError> {
    raw.and_then(assemble::assemble).map_err(|fault| fault.in_file(path, content))
}
