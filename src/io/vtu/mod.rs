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
//! The ids are the canonical ones, from 0, the same for every number of parts; `PartitionId` counts from 1, as
//! Elmer's file names do. Tets and triangles stand in files of their own, so that a surface drawn from the tets
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
    let (folder, name) = folder_and_name(stem)?;
    let name = name.to_str().ok_or_else(|| {
        WriteError::io(stem)(io::Error::new(io::ErrorKind::InvalidInput, "the name is not in Unicode"))
    })?;
    let name = [".pvtu", ".vtu"].iter().find_map(|end| name.strip_suffix(end)).unwrap_or(name);

    let mut tets = volume::piece(part);
    let surface = boundary::Surface::of(part);
    let mut triangles = surface.piece();
    tets.fields = numbers_by_name("Body", &names.bodies);
    triangles.fields = numbers_by_name("Boundary", &names.patches);
    let needed = tets.bytes() + triangles.bytes();
    let written = write_together(comm, &folder, needed, is_part_file, |stage| {
        let [tets_path, triangles_path] = if part.ranks() == 1 {
            [format!("{name}.vtu"), format!("{name}.boundary.vtu")]
        } else {
            let folder = stage.join(format!("{name}.parts"));
            fs::create_dir_all(&folder).map_err(WriteError::io(&folder))?;
            ["part", "boundary"].map(|kind| piece_path(name, kind, part.rank() + 1))
        };
        let mut written = Written { files: 2, bytes: 0 };
        written.bytes += volume::write(&tets, part, names, &stage.join(tets_path))?;
        written.bytes += surface.write(&triangles, part, names, &stage.join(triangles_path))?;
        if part.ranks() > 1 && part.rank() == 0 {
            let layers = u32::from(part.ghosts().is_some());
            for (piece, end, kind, layers) in
                [(&tets, "", "part", layers), (&triangles, ".boundary", "boundary", 0)]
            {
                let text = list_of_pieces(piece, part.ranks(), name, kind, layers);
                let bytes = write_text(&stage.join(format!("{name}{end}.pvtu")), text.as_bytes())?;
                written += Written { files: 1, bytes };
            }
        }
        Ok(written)
    })?;
    sum_written(comm, written)
}

/// For each name the numbers that have it, both ascending.
fn numbers_by_name(kind: &str, list: &[Label]) -> Vec<(String, Vec<u32>)> {
    let mut by_name: BTreeMap<&str, BTreeSet<u32>> = BTreeMap::new();
    for label in list {
        for name in &label.names {
            by_name.entry(name).or_default().insert(label.number);
        }
    }
    by_name
        .into_iter()
        .map(|(name, numbers)| (format!("{kind} {name}"), numbers.into_iter().collect()))
        .collect()
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
