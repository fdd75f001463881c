//! VTK's XML format for ParaView and meshio: raw appended binary, 64-bit sizes.
//!
//! ```text
//! STEM.vtu            STEM.boundary.vtu             one part: tets; triangles on patches
//! STEM.pvtu           STEM.boundary.pvtu            several parts, which they list:
//! STEM.parts/part.K.vtu      …/boundary.K.vtu       K = 1 … N, rank K−1
//!
//! points   GlobalNodeId  vtkGhostType (several parts only: 1 on all copies but the owner's)
//!          PeriodicId (periodic faces only: the global id of the vertex's master, else its own)
//! tets     GlobalElementId  BodyId  PartitionId  vtkGhostType (halo only: 1 on ghosts)
//!                                    A ghost's PartitionId is its owner's.
//! triangles                 BoundaryId  PartitionId  vtkGhostType (1 on the second copy of an interface triangle)
//! values   of the caller, on points and tets: `write_fields`
//! fields   one for each name, `Body NAME` or `Boundary NAME`: the numbers with this name
//! ```
//! With [`Boundary::In`] the triangles follow the tets in the same files: all cells have `BodyId`,
//! `BoundaryId` and `PartitionId`, 0 if a number does not apply, and triangles have
//! `GlobalElementId` -1. MFEM reads `STEM.vtu` of one part without triangles. For its reader the
//! file has a copy `material` of `BodyId`, and its fields are in a comment (those of
//! `STEM.boundary.vtu` are not).
//!
//! The ids are the canonical ones, from 0, the same for every number of parts; `PartitionId` counts
//! from 1, like Elmer's file names. Tets and triangles are in separate files by default, so that a
//! rendered surface of the tets does not hide the triangles.

mod arrays;
mod boundary;
mod fields;
mod volume;

pub use fields::{Field, FieldError, On};

use arrays::{Piece, escaped};

use super::output::{folder_and_name, write_text, write_together};
use super::{WriteError, Written, sum_written};
use crate::ground::comm::Communicator;
use crate::ground::mesh::stream::MeshStream;
use crate::ground::mesh::{Label, Names};
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::io;
use std::path::Path;

/// Location of the boundary triangles.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Boundary {
    /// In separate files.
    #[default]
    Beside,
    /// In the files of the tets, after the tets.
    In,
}

/// **Collective.** Writes the part of each rank and, with several, the index files. `stem` is the
/// path without ending, or with `.vtu` or `.pvtu`; other dots in the name are kept. All ranks get
/// the totals.
///
/// # Errors
/// The ending of another format, a body or patch without a number, not enough disk space, or an I/O
/// error. All ranks get the error, and old files are kept.
pub fn write(
    comm: &dyn Communicator,
    part: &dyn MeshStream,
    names: &Names,
    stem: &Path,
) -> Result<Written, WriteError> {
    write_with(comm, part, names, stem, Boundary::Beside)
}

/// **Collective.** Like [`write()`], with a choice of where the triangles are.
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
    write_all(comm, part, names, stem, boundary, &[])
}

/// **Collective.** Like [`write()`], with values on vertices and tets, such as a solution. Fields
/// on vertices are in the files of the triangles, too.
///
/// Each rank passes the values of its part, in the order of its [`Arrays`](crate::mesh::Arrays).
/// Names, order and components must be the same on all ranks. Copies of a vertex should have the
/// same value on all their ranks.
///
/// ```
/// use tetmill::files::vtu::{self, Field, On};
/// use tetmill::{Geometry, Mesher, comm::thread};
/// # let folder = tempfile::tempdir()?;
/// # let folder = folder.path();
///
/// let ball = Geometry::from_text("algebraic3d solid ball = sphere (0, 0, 0; 1); tlo ball;")?;
/// let mesh = Mesher::new().generate(&ball)?;
/// let arrays = mesh.arrays();
/// let heights: Vec<f64> = arrays.points.iter().map(|point| point[2]).collect();
/// let flux = [0.0, 0.0, -1.0].repeat(arrays.tets.len());
/// let fields = [
///     Field { name: "height", on: On::Points, values: &heights, components: 1 },
///     Field { name: "flux", on: On::Cells, values: &flux, components: 3 },
/// ];
/// vtu::write_fields(&thread::alone(), mesh.stream(), &mesh.names, &folder.join("ball"), &fields)?;
/// # assert!(folder.join("ball.vtu").exists());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// Those of [`write()`], and [`FieldError`]: a wrong number of values, an empty or repeated name,
/// or different fields on two ranks. All ranks get an error.
pub fn write_fields(
    comm: &dyn Communicator,
    part: &dyn MeshStream,
    names: &Names,
    stem: &Path,
    fields: &[Field<'_>],
) -> Result<Written, WriteError> {
    fields::check(comm, part, fields)?;
    write_all(comm, part, names, stem, Boundary::Beside, fields)
}

/// Endings of other formats of meshes, geometries and results.
const FOREIGN: [&str; 27] = [
    "vtk", "vtp", "vti", "vtr", "vts", "vtm", "vtmb", "vtkhdf", "pvd", "pvtp", "xdmf", "xmf", "h5", "hdf",
    "exo", "med", "msh", "mesh", "meshb", "vol", "off", "stl", "obj", "ply", "csv", "vtx", "geo",
];

/// **Collective.** Writes the files; fields are checked, and there are none with [`Boundary::In`].
fn write_all(
    comm: &dyn Communicator,
    part: &dyn MeshStream,
    names: &Names,
    stem: &Path,
    boundary: Boundary,
    fields: &[Field<'_>],
) -> Result<Written, WriteError> {
    let (folder, name) = folder_and_name(stem)?;
    let name = name.to_str().ok_or_else(|| {
        WriteError::io(stem)(io::Error::new(io::ErrorKind::InvalidInput, "the name is not in Unicode"))
    })?;
    if let Some((_, ending)) = name.rsplit_once('.')
        && FOREIGN.iter().any(|foreign| ending.eq_ignore_ascii_case(foreign))
    {
        return Err(WriteError::ForeignEnding(stem.to_path_buf()));
    }
    let is_ours = |ending: &str| ["vtu", "pvtu"].iter().any(|ours| ending.eq_ignore_ascii_case(ours));
    let (name, ending) = name.rsplit_once('.').filter(|(_, ending)| is_ours(ending)).unwrap_or((name, ""));
    let ending = if ending.eq_ignore_ascii_case("vtu") { ending } else { "vtu" };

    let mut tets = volume::piece(part, boundary, fields);
    let surface = (boundary == Boundary::Beside).then(|| boundary::Surface::of(part));
    let mut triangles = surface.as_ref().map(|surface| surface.piece(fields));
    let (of_bodies, of_boundaries) =
        (numbers_by_name("Body", &names.bodies), numbers_by_name("Boundary", &names.patches));
    tets.fields.clone_from(&of_bodies);
    triangles.as_mut().unwrap_or(&mut tets).fields = [of_bodies, of_boundaries].concat();
    let needed = tets.bytes() + triangles.as_ref().map_or(0, Piece::bytes);
    let written = write_together(comm, &folder, needed, is_part_file, |stage| {
        let [tets_path, triangles_path] = if part.ranks() == 1 {
            [format!("{name}.{ending}"), format!("{name}.boundary.vtu")]
        } else {
            let folder = stage.join(format!("{name}.parts"));
            fs::create_dir_all(&folder).map_err(WriteError::io(&folder))?;
            ["part", "boundary"].map(|kind| piece_path(name, kind, part.rank() + 1))
        };
        let mut written =
            Written { files: 1, bytes: volume::write(&tets, part, names, fields, &stage.join(tets_path))? };
        if let (Some(surface), Some(triangles)) = (&surface, &triangles) {
            let bytes = surface.write(triangles, part, names, fields, &stage.join(triangles_path))?;
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

/// Lists for each name the numbers that have it, ascending. Names are ordered as in the labels
/// where these agree, so that a reader restores the main name of a number as the first.
fn numbers_by_name(kind: &str, list: &[Label]) -> Vec<(String, Vec<u32>)> {
    let mut by_name: BTreeMap<&str, BTreeSet<u32>> = BTreeMap::new();
    // The names that precede a name in some label.
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
        // Labels that contradict each other leave no first name: take any.
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

/// Whether a file of a replaced `STEM.parts` may be deleted.
fn is_part_file(name: &str) -> bool {
    let number = ["part.", "boundary."].iter().find_map(|kind| name.strip_prefix(kind)?.strip_suffix(".vtu"));
    number.is_some_and(|number| number.bytes().all(|b| b.is_ascii_digit()))
}

/// The text of the `.pvtu`: the arrays of the pieces without data, the number of ghost layers, and
/// the paths of the pieces.
fn list_of_pieces(piece: &Piece, parts: u32, name: &str, kind: &str, layers: u32) -> String {
    let head = format!(" <PUnstructuredGrid GhostLevel=\"{layers}\">\n");
    let mut text = arrays::file_tag("PUnstructuredGrid") + &head;
    piece.for_each_section(|section, attributes, arrays| {
        // Cell types and vertices are declared by the pieces only.
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
