//! One text file for the mesh of all ranks, written by all of them.
//!
//! A file is a list of sections. Some are text from rank 0. In the others each rank writes its
//! lines, in rank order: vertices by their owners, tets, and boundary triangles (one between two
//! parts is written by one of them, see [`once`](super::once)). The length of the text is not known
//! beforehand. So with several ranks each formats its lines twice: the first pass counts bytes,
//! from which every rank gets its offsets in the file, the second pass writes. This needs no memory
//! and no second file.
//!
//! ```text
//! rank 0  head  vertices 0              tets 0                end
//! rank 1                    vertices 1         tets 1
//! ```
//! Vertices and elements are numbered by part, so the order of lines depends on the number of
//! ranks; the mesh does not.

use super::lines::{self, ByPatch, TetLine, TriangleLine};
use super::node_order::arranged;
use super::number::{Numbering, number, number_corners_first};
use super::once::{LeftOut, left_out, share_of_triangles};
use super::output::{Output, folder_and_name, write_file, write_together};
use super::pairs::pairs;
use super::text::{FLOAT_CHARS, Line};
use super::{WriteError, Written, sum_written};
use crate::ground::comm::Communicator;
use crate::ground::mesh::stream::{Counts, MeshStream};
use crate::ground::mesh::{Names, Order};
use std::path::Path;

/// The largest number of a vertex or element: readers of these formats use 32-bit integers.
const MOST: u64 = i32::MAX as u64;

/// A format of one file.
pub(super) struct TextFormat {
    /// Name of the format for messages.
    pub name: &'static str,
    /// Whether corners are numbered before the nodes on edges.
    pub corners_first: bool,
    /// **Collective.** Lists the sections of the file in order.
    pub sections: for<'a> fn(&dyn Communicator, &'a Whole<'a>) -> Result<Vec<Section<'a>>, WriteError>,
}

/// Formats the line of a vertex from its number and coordinates.
type FormatVertex<'a> = Box<dyn Fn(&mut Line, u64, &[f64; 3]) + Sync + 'a>;
/// Formats the line of a boundary triangle.
type FormatTriangle<'a> = Box<dyn Fn(&mut Line, &TriangleLine) + Sync + 'a>;
/// Formats the line of a tet.
type FormatTet<'a> = Box<dyn Fn(&mut Line, &TetLine) + Sync + 'a>;

/// A section of a file.
pub(super) enum Section<'a> {
    /// Text written by rank 0.
    Text(String),
    /// Text of this rank.
    Own(Vec<u8>),
    /// One line for each vertex, without those numbered behind all others.
    Vertices(FormatVertex<'a>),
    /// One line for each vertex that is numbered behind all others.
    LastVertices(FormatVertex<'a>),
    /// One line for each boundary triangle.
    Triangles(FormatTriangle<'a>),
    /// One line for each tet.
    Tets(FormatTet<'a>),
}

/// A rank's part of the mesh, with the numbering of the whole.
pub(super) struct Whole<'a> {
    pub part: &'a dyn MeshStream,
    pub names: &'a Names,
    /// Counts of the whole mesh.
    pub totals: Counts,
    pub numbering: Numbering,
    pub by_patch: ByPatch,
    /// Triangles of this part that another part writes.
    pub left_out: LeftOut,
    triangles_before: u64,
    /// On rank 0: pairs of periodic vertices (copy, master) with the index of their link.
    pub pairs: Vec<[u64; 3]>,
    /// On rank 0: the numbers of singular vertices with their factors.
    pub singular_vertices: Vec<(u64, i32)>,
}

impl<'a> Whole<'a> {
    /// **Collective.** Numbers the entities and gathers the periodic pairs and singular vertices.
    fn of(
        comm: &dyn Communicator,
        part: &'a dyn MeshStream,
        names: &'a Names,
        format: &TextFormat,
    ) -> Result<Self, WriteError> {
        let checked = check(part, part.totals(), format.name);
        comm.agree(checked)?;
        let numbering =
            if format.corners_first { number_corners_first(comm, part)? } else { number(comm, part)? };
        let pairs = pairs(comm, part, &numbering, |index, _| index as u64)?;
        let left_out = left_out(comm, part, names)?;
        let (triangles_before, totals) = share_of_triangles(comm, part, &left_out)?;
        let own_singular = part.singular().vertices;
        let own_singular = own_singular.iter().filter(|(local, _)| numbering.owns(*local as usize));
        let own_singular: Vec<[i64; 2]> =
            own_singular.map(|&(local, factor)| [numbering.vertex(local) as i64, factor.into()]).collect();
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

    /// Appends the numbers of vertices, each after a blank.
    pub fn ids(&self, line: &mut Line, vertices: impl IntoIterator<Item = u32>) {
        vertices.into_iter().for_each(|vertex| _ = line.blank().int(self.numbering.vertex(vertex)));
    }

    /// Appends the numbers of a tet's nodes, those on edges in the given order.
    pub fn tet_ids(&self, line: &mut Line, tet: &TetLine, order: &[usize; 6]) {
        self.ids(line, tet.vertices.iter().copied().chain(arranged(tet.edge_nodes, order)));
    }

    /// Appends the numbers of a triangle's nodes.
    pub fn triangle_ids(&self, line: &mut Line, triangle: &TriangleLine) {
        self.ids(line, triangle.vertices.iter().chain(triangle.edge_nodes).copied());
    }

    /// The order of the elements.
    pub fn order(&self) -> Order {
        self.part.order()
    }

    /// The number of a triangle, from 1.
    pub fn triangle(&self, line: &TriangleLine) -> u64 {
        self.triangles_before + line.index + 1
    }

    /// The number of a tet, from 1.
    pub fn tet(&self, line: &TetLine) -> u64 {
        self.numbering.tet(line.index)
    }

    /// Writes this rank's share of a section.
    fn write(&self, section: &Section, file: &mut Output) -> Result<(), WriteError> {
        match section {
            Section::Text(text) if self.part.rank() == 0 => file.write(text.as_bytes()),
            Section::Text(_) => Ok(()),
            Section::Own(text) => file.write(text),
            Section::Vertices(format) => {
                let is_own = |local| self.numbering.owns(local) && !self.numbering.owns_last(local);
                self.write_vertices(file, is_own, format)
            }
            Section::LastVertices(format) => {
                self.write_vertices(file, |local| self.numbering.owns_last(local), format)
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

    /// Writes the lines of some vertices.
    fn write_vertices(
        &self,
        file: &mut Output,
        chosen: impl Fn(usize) -> bool + Sync,
        format: &FormatVertex,
    ) -> Result<(), WriteError> {
        lines::vertices(self.part, file, chosen, |line, vertex| {
            format(line, self.numbering.vertex(vertex.index as u32), vertex.point);
        })
    }

    /// Counts the bytes of this rank's share of each section.
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
    // Gmsh numbers triangles and tets consecutively.
    for (what, count) in [("vertices", totals.vertices), ("elements", totals.tets + totals.boundary)] {
        if count > MOST {
            return Err(WriteError::TooMany { format, what, count, limit: MOST });
        }
    }
    Ok(())
}

/// **Collective.** Writes the mesh of all ranks to one file. All ranks get the totals.
///
/// # Errors
/// More vertices or elements than 32 bits can number, a part with ghosts, a body or patch without a
/// number, not enough disk space, or an I/O error. All ranks get the error, and an existing file is
/// kept.
pub(super) fn write(
    comm: &dyn Communicator,
    part: &dyn MeshStream,
    names: &Names,
    path: &Path,
    format: &TextFormat,
) -> Result<Written, WriteError> {
    let whole = Whole::of(comm, part, names, format)?;
    let sections = (format.sections)(comm, &whole)?;
    if comm.size() == 1 {
        let bytes = write_file(path, estimate(part), |file| {
            sections.iter().try_for_each(|section| whole.write(section, file))
        })?;
        return Ok(Written { files: 1, bytes });
    }
    write_shares(comm, path, whole.lengths(&sections), |section, file| whole.write(&sections[section], file))
}

/// **Collective.** Writes one file of sections, of which each rank has a share: all shares of the
/// first section by rank, then those of the next. `lengths` are those of this rank's shares in
/// bytes, and `write` writes one of them. All ranks get the totals.
pub(super) fn write_shares(
    comm: &dyn Communicator,
    path: &Path,
    lengths: Result<Vec<u64>, WriteError>,
    write: impl Fn(usize, &mut Output) -> Result<(), WriteError>,
) -> Result<Written, WriteError> {
    let (folder, name) = folder_and_name(path)?;
    let lengths = comm.agree(lengths)?;
    let places = places(comm, &lengths)?;
    let bytes = lengths.iter().sum();
    write_together(
        comm,
        &folder,
        bytes,
        |_| false,
        |stage| {
            let mut file = Output::shared(&stage.join(name))?;
            for (section, place) in places.into_iter().enumerate() {
                file.go_to(place)?;
                write(section, &mut file)?;
            }
            file.finish()
        },
    )?;
    sum_written(comm, Written { files: u64::from(comm.rank() == 0), bytes })
}

/// **Collective.** Computes the offset of this rank's share of each section in the file.
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

/// Estimated size of a text file in bytes.
fn estimate(part: &dyn MeshStream) -> u64 {
    const PER_ENTITY: u64 = 45;
    const PER_NODE: u64 = 8;
    let counts = part.counts();
    let nodes = match part.order() {
        Order::First => 0,
        Order::Second => 6 * counts.tets + 3 * counts.boundary,
    };
    counts.vertices * (3 * FLOAT_CHARS as u64)
        + (counts.tets + counts.boundary) * PER_ENTITY
        + nodes * PER_NODE
}
