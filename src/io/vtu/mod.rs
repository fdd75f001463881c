//! VTK's XML format for ParaView and meshio: raw appended binary, 64-bit sizes.
//!
//! ```text
//! STEM.vtu            STEM.boundary.vtu             one part: tets; triangles on patches
//! STEM.pvtu           STEM.boundary.pvtu            several parts, which they list:
//! STEM.parts/part.K.vtu      …/boundary.K.vtu       K = 1 … N, rank K−1
//!
//! points   GlobalNodeId  vtkGhostType (several parts only: 1 on all copies but the owner's)
//!          PeriodicId (periodic faces only: the global id of the vertex that this one is an image of, else its own)
//! tets     GlobalElementId  BodyId  PartitionId  vtkGhostType (with a halo only: 1 on ghosts, whose PartitionId is their owner's)
//! triangles                 BoundaryId  PartitionId  vtkGhostType (1 on the second copy of an interface triangle)
//! fields   one for each name, `Body NAME` or `Boundary NAME`: the numbers that have it
//! ```
//! With [`Boundary::In`] the triangles are behind the tets, in the same files: `BodyId`, `BoundaryId` and `PartitionId` of all cells, 0
//! where a number does not apply, and -1 for the `GlobalElementId` of triangles. MFEM reads `STEM.vtu` of one part without triangles: for its reader
//! there is a copy `material` of `BodyId`, and the fields of this file are in a comment (those of `STEM.boundary.vtu` are not).
//!
//! The ids are the canonical ones, from 0, the same for every number of parts; `PartitionId` counts from 1, as
//! Elmer's file names do. Tets and triangles are in files of their own unless asked otherwise, so that a surface drawn from the tets
//! does not hide the triangles.

mod arrays;
mod boundary;
mod volume;

use arrays::{Piece, escaped};

use super::output::{folder_and_name, write_text, write_together};
use super::{WriteError, Written, sum_written};
use crate::comm::Communicator;
use crate::mesh::stream::MeshStream;
use crate::mesh::{Label, Names};
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::io;
use std::path::Path;

/// Where the triangles on patches are.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Boundary {
    /// In files of their own, beside those of the tets.
    #[default]
    Beside,
    /// In the files of the tets, behind these.
    In,
}

/// **Collective.** Writes the part of each rank and, with several, the files that list them. `stem` may end in
/// `.vtu` or `.pvtu`. Each rank gets the sums over all ranks.
///
/// # Errors
/// A body or patch without a number, a full disk, what the system says: on all ranks alike, and the old files stay.
pub fn write(
    comm: &dyn Communicator,
    part: &dyn MeshStream,
    names: &Names,
    stem: &Path,
) -> Result<Written, WriteError> {
    write_with(comm, part, names, stem, Boundary::Beside)
}

/// **Collective.** The same, with the triangles where they are wanted.
///
/// # Errors
/// Those of [`write()`].
pub fn write_with(
    comm: &dyn Communicator,
    part: &dyn MeshStream,
    names: &Names,
    stem: &Path,
    boundary: Boundary,
) -> Result<Written, WriteError> {
    let (folder, name) = folder_and_name(stem)?;
    let name = name.to_str().ok_or_else(|| {
        WriteError::io(stem)(io::Error::new(io::ErrorKind::InvalidInput, "the name is not in Unicode"))
    })?;
    let name = [".pvtu", ".vtu"].iter().find_map(|end| name.strip_suffix(end)).unwrap_or(name);

    let mut tets = volume::piece(part, boundary);
    let surface = (boundary == Boundary::Beside).then(|| boundary::Surface::of(part));
    let mut triangles = surface.as_ref().map(boundary::Surface::piece);
    let (of_bodies, of_boundaries) =
        (numbers_by_name("Body", &names.bodies), numbers_by_name("Boundary", &names.patches));
    tets.fields.clone_from(&of_bodies);
    triangles.as_mut().unwrap_or(&mut tets).fields = [of_bodies, of_boundaries].concat();
    let needed = tets.bytes() + triangles.as_ref().map_or(0, Piece::bytes);
    let written = write_together(comm, &folder, needed, is_part_file, |stage| {
        let [tets_path, triangles_path] = if part.ranks() == 1 {
            [format!("{name}.vtu"), format!("{name}.boundary.vtu")]
        } else {
            let folder = stage.join(format!("{name}.parts"));
            fs::create_dir_all(&folder).map_err(WriteError::io(&folder))?;
            ["part", "boundary"].map(|kind| piece_path(name, kind, part.rank() + 1))
        };
        let mut written =
            Written { files: 1, bytes: volume::write(&tets, part, names, &stage.join(tets_path))? };
        if let (Some(surface), Some(triangles)) = (&surface, &triangles) {
            let bytes = surface.write(triangles, part, names, &stage.join(triangles_path))?;
            written += Written { files: 1, bytes };
        }
        if part.ranks() > 1 && part.rank() == 0 {
            let layers = u32::from(part.ghosts().is_some());
            let of_tets = Some((&tets, "", "part", layers));
            let of_triangles = triangles.as_ref().map(|piece| (piece, ".boundary", "boundary", 0));
            for (piece, end, kind, layers) in of_tets.into_iter().chain(of_triangles) {
                let text = list_of_pieces(piece, part.ranks(), name, kind, layers);
                let bytes = write_text(&stage.join(format!("{name}{end}.pvtu")), text.as_bytes())?;
                written += Written { files: 1, bytes };
            }
        }
        Ok(written)
    })?;
    sum_written(comm, written)
}

/// For each name the numbers that have it, ascending. The names of a number are in the order of its label, as far as labels agree: its main
/// name comes back as the main one.
fn numbers_by_name(kind: &str, list: &[Label]) -> Vec<(String, Vec<u32>)> {
    let mut by_name: BTreeMap<&str, BTreeSet<u32>> = BTreeMap::new();
    // Which names come before a name in some label.
    let mut before: BTreeMap<&str, BTreeSet<&str>> = BTreeMap::new();
    for label in list {
        for (k, name) in label.names.iter().enumerate() {
            by_name.entry(name).or_default().insert(label.number);
            before.entry(name).or_default().extend(label.names[..k].iter().map(String::as_str));
        }
    }
    let mut fields = Vec::with_capacity(by_name.len());
    while !before.is_empty() {
        let is_first =
            |name: &&str| before[*name].iter().all(|other| other == name || !before.contains_key(other));
        // Labels that contradict each other have no first name: any will do.
        let next = before.keys().copied().find(|name| is_first(name)).or(before.keys().copied().next());
        let next = next.expect("a name is left");
        before.remove(next);
        fields.push((format!("{kind} {next}"), by_name[next].iter().copied().collect()));
    }
    fields
}

fn piece_path(name: &str, kind: &str, number: u32) -> String {
    format!("{name}.parts/{kind}.{number}.vtu")
}

/// The files of a replaced `STEM.parts` that may go.
fn is_part_file(name: &str) -> bool {
    let number = ["part.", "boundary."].iter().find_map(|kind| name.strip_prefix(kind)?.strip_suffix(".vtu"));
    number.is_some_and(|number| number.bytes().all(|b| b.is_ascii_digit()))
}

/// The `.pvtu`: the arrays of each piece, without data, how many layers of ghosts they have, and where the pieces are.
fn list_of_pieces(piece: &Piece, parts: u32, name: &str, kind: &str, layers: u32) -> String {
    let head = format!(" <PUnstructuredGrid GhostLevel=\"{layers}\">\n");
    let mut text = arrays::file_tag("PUnstructuredGrid") + &head;
    piece.for_each_section(|section, attributes, arrays| {
        // What the cells are made of is each piece's own affair.
        if section != "Cells" {
            text += &format!("  <P{section}{attributes}>\n");
            for array in arrays {
                text += &format!("   <PDataArray {}/>\n", array.attributes());
            }
            text += &format!("  </P{section}>\n");
        }
    });
    for number in 1..=parts {
        text += &format!("  <Piece Source=\"{}\"/>\n", escaped(&piece_path(name, kind, number)));
    }
    text + " </PUnstructuredGrid>\n</VTKFile>\n"
}

#[cfg(test)]
mod tests;
