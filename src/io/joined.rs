//! One text file for the mesh of all ranks, written by all of them.
//!
//! A file is a list of sections. Rank 0 has the text of some; of others each rank has its lines, in the order of ranks:
//! vertices by their owners, tets, and boundary triangles (one between two parts by one of them, see [`once`](super::once)).
//! The length of text is not known before it is made. So with several ranks each formats its lines twice: first it counts
//! bytes, which gives every rank its places in the file, then it writes there. That takes no memory and no second file.
//!
//! ```text
//! rank 0  head  vertices 0              tets 0                end
//! rank 1                    vertices 1         tets 1
//! ```
//! Numbers of vertices and elements follow the parts, so the order of lines depends on the number of ranks; the mesh does not.

use super::lines::{self, ByPatch, TetLine, TriangleLine};
use super::number::{Numbering, number};
use super::once::{LeftOut, left_out};
use super::output::{Output, folder_and_name, write_file, write_together};
use super::pairs::pairs;
use super::text::{FLOAT_CHARS, Line};
use super::{WriteError, Written, agree, sum_written};
use crate::comm::Communicator;
use crate::mesh::Names;
use crate::mesh::stream::{Counts, MeshStream};
use std::path::Path;

/// The largest number of a vertex or element: what reads these formats has integers of 32 bits.
const MOST: u64 = i32::MAX as u64;

/// A format of one file.
pub(super) struct TextFormat {
    /// What it is called.
    pub name: &'static str,
    /// **Collective.** What is behind each other in the file.
    pub sections: for<'a> fn(&dyn Communicator, &'a Whole<'a>) -> Result<Vec<Section<'a>>, WriteError>,
}

/// Appends what a line says of a vertex, by its number and place.
type FormatVertex<'a> = Box<dyn Fn(&mut Line, u64, &[f64; 3]) + Sync + 'a>;
/// Appends what a line says of a triangle on a patch.
type FormatTriangle<'a> = Box<dyn Fn(&mut Line, &TriangleLine) + Sync + 'a>;
/// Appends what a line says of a tet.
type FormatTet<'a> = Box<dyn Fn(&mut Line, &TetLine) + Sync + 'a>;

/// A part of a file.
pub(super) enum Section<'a> {
    /// This, from rank 0.
    Text(String),
    /// A line for each vertex.
    Vertices(FormatVertex<'a>),
    /// A line for each triangle on a patch.
    Triangles(FormatTriangle<'a>),
    /// A line for each tet.
    Tets(FormatTet<'a>),
}

/// A rank's part of the mesh, and what a file says of the whole.
pub(super) struct Whole<'a> {
    pub part: &'a dyn MeshStream,
    pub names: &'a Names,
    /// Of the whole mesh.
    pub totals: Counts,
    pub numbering: Numbering,
    pub by_patch: ByPatch,
    /// Triangles of this part that another one writes.
    pub left_out: LeftOut,
    triangles_before: u64,
    /// On rank 0: pairs of periodic vertices, image first, by the index of their link.
    pub pairs: Vec<[u64; 3]>,
    /// On rank 0: the numbers of singular vertices and their factors.
    pub singular_vertices: Vec<(u64, i32)>,
}

impl<'a> Whole<'a> {
    /// **Collective.**
    fn of(
        comm: &dyn Communicator,
        part: &'a dyn MeshStream,
        names: &'a Names,
        format: &'static str,
    ) -> Result<Self, WriteError> {
        let checked = check(part, part.totals(), format);
        agree(comm, checked)?;
        let numbering = number(comm, part)?;
        let pairs = pairs(comm, part, &numbering, |index, _| index as u64)?;
        let left_out = left_out(comm, part, names)?;
        let own_triangles = part.counts().boundary - left_out.len();
        let [triangles_before] = comm.exclusive_scan([own_triangles])?;
        let [boundary] = comm.all_reduce_sum_u64([own_triangles])?;
        let totals = Counts { boundary, ..part.totals() };
        let own_singular = part.singular().vertices;
        let own_singular = own_singular.iter().filter(|(local, _)| numbering.owns(*local as usize));
        let own_singular: Vec<[i64; 2]> = own_singular
            .map(|&(local, factor)| [numbering.vertices[local as usize].into(), factor.into()])
            .collect();
        let mut singular: Vec<[i64; 2]> = comm.gather(0, &own_singular)?.concat();
        singular.sort_unstable();
        let singular_vertices = singular.iter().map(|&[number, k]| (number as u64, k as i32)).collect();
        let by_patch = ByPatch::of(part);
        Ok(Self {
            part,
            names,
            totals,
            numbering,
            by_patch,
            left_out,
            triangles_before,
            pairs,
            singular_vertices,
        })
    }

    /// Appends the numbers of vertices, each behind a blank.
    pub fn ids(&self, line: &mut Line, vertices: &[u32]) {
        vertices.iter().for_each(|&v| _ = line.blank().int(self.numbering.vertices[v as usize].into()));
    }

    /// The number of a triangle, from 1.
    pub fn triangle(&self, line: &TriangleLine) -> u64 {
        self.triangles_before + line.index + 1
    }

    /// The number of a tet, from 1.
    pub fn tet(&self, line: &TetLine) -> u64 {
        self.numbering.tet(line.index)
    }

    /// Appends this rank's share of a section.
    fn write(&self, section: &Section, file: &mut Output) -> Result<(), WriteError> {
        match section {
            Section::Text(text) if self.part.rank() == 0 => file.write(text.as_bytes()),
            Section::Text(_) => Ok(()),
            Section::Vertices(format) => {
                let is_own = |local| self.numbering.owns(local);
                lines::vertices(self.part, file, is_own, |line, vertex| {
                    format(line, self.numbering.vertices[vertex.index].into(), vertex.point);
                })
            }
            Section::Triangles(format) => lines::triangles(
                self.part,
                self.names,
                &self.by_patch,
                &self.left_out,
                file,
                |line, triangle| format(line, &triangle),
            ),
            Section::Tets(format) => lines::tets(self.part, self.names, file, |line, tet| format(line, &tet)),
        }
    }

    /// How many bytes this rank's share of each section takes.
    fn lengths(&self, sections: &[Section]) -> Result<Vec<u64>, WriteError> {
        let length = |section: &Section| {
            let mut counter = Output::counter();
            self.write(section, &mut counter)?;
            Ok(counter.written())
        };
        sections.iter().map(length).collect()
    }
}

fn check(part: &dyn MeshStream, totals: Counts, format: &'static str) -> Result<(), WriteError> {
    if part.ghosts().is_some() {
        return Err(WriteError::NoHalo(format));
    }
    // Gmsh numbers triangles and tets in one row.
    for (what, count) in [("vertices", totals.vertices), ("elements", totals.tets + totals.boundary)] {
        if count > MOST {
            return Err(WriteError::TooMany { format, what, count, limit: MOST });
        }
    }
    Ok(())
}

/// **Collective.** Writes the mesh of all ranks to one file. Each rank gets the sums over all ranks.
///
/// # Errors
/// More vertices or elements than 32 bits number, a part with ghosts, a body or patch without a number, a full disk, what the system says: on
/// all ranks alike, and the file before it stays.
pub(super) fn write(
    comm: &dyn Communicator,
    part: &dyn MeshStream,
    names: &Names,
    path: &Path,
    format: &TextFormat,
) -> Result<Written, WriteError> {
    let whole = Whole::of(comm, part, names, format.name)?;
    let sections = (format.sections)(comm, &whole)?;
    if comm.size() == 1 {
        let bytes = write_file(path, estimate(part), |file| {
            sections.iter().try_for_each(|section| whole.write(section, file))
        })?;
        return Ok(Written { files: 1, bytes });
    }
    let (folder, name) = folder_and_name(path)?;
    let lengths = agree(comm, whole.lengths(&sections))?;
    let places = places(comm, &lengths)?;
    let bytes = lengths.iter().sum();
    write_together(
        comm,
        &folder,
        bytes,
        |_| false,
        |stage| {
            let mut file = Output::shared(&stage.join(name))?;
            for (section, place) in sections.iter().zip(places) {
                file.go_to(place)?;
                whole.write(section, &mut file)?;
            }
            file.finish()
        },
    )?;
    sum_written(comm, Written { files: u64::from(comm.rank() == 0), bytes })
}

/// **Collective.** Where this rank's share of each section begins in the file.
fn places(comm: &dyn Communicator, lengths: &[u64]) -> Result<Vec<u64>, WriteError> {
    let mut places = Vec::with_capacity(lengths.len());
    let mut section_begin = 0;
    for &length in lengths {
        let [before] = comm.exclusive_scan([length])?;
        places.push(section_begin + before);
        let [of_all] = comm.all_reduce_sum_u64([length])?;
        section_begin += of_all;
    }
    Ok(places)
}

/// About how many bytes a text format takes.
fn estimate(part: &dyn MeshStream) -> u64 {
    const PER_ENTITY: u64 = 45;
    let counts = part.counts();
    counts.vertices * (3 * FLOAT_CHARS as u64) + (counts.tets + counts.boundary) * PER_ENTITY
}
