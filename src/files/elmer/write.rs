//! Writing Elmer's files.

use super::names::names_text;
use super::periodic::{self, periodic_text};
use super::{MAX_ID, MAX_LINE, TET, TET_10, TRIANGLE, TRIANGLE_6};
use crate::files::lines::{self, ByPatch, FLUSH_AT};
use crate::files::node_order::{VTK, arranged};
use crate::files::number::{Numbering, number, watchers};
use crate::files::once::{LeftOut, left_out};
use crate::files::output::{Output, write_text, write_together};
use crate::files::text::{Line, digits};
use crate::files::{WriteError, Written, sum_written};
use crate::ground::comm::Communicator;
use crate::ground::mesh::ghosts::Ghosts;
use crate::ground::mesh::stream::{Counts, MeshStream, NO_TET, vertex_block_of};
use crate::ground::mesh::{Names, Order, Rank, TET_FACES};
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

/// Average length of a shortest round-trip coordinate with its blank; most on curved surfaces have
/// 17 digits.
const MEAN_FLOAT: u64 = 19;

/// **Collective.** Writes `DIR/partitioning.N/part.K.*` and `DIR/mesh.names`; with one part also
/// `DIR/mesh.*`, as hard links if the file system has them. All ranks get the totals.
///
/// The ids in the files are Elmer's own: from 1, and contiguous over the entities that a part owns.
/// The canonical ids are in the VTU files.
///
/// Ghosts are written like ElmerGrid's halos: elements `ID/OWNER`, their nodes, and these nodes in
/// `.shared` with all parts that have them; parts with the node in halo elements only come last.
///
/// Boundary elements belong to a part's own elements. Without ghosts an interface element is
/// written once, by the part of the body with the higher number, so that loads are counted once.
/// With ghosts both parts write it: Elmer then knows both parents and halves the contributions.
///
/// # Errors
/// Before anything is written: more ids than 2³¹−1, a `.shared` line longer than Elmer reads, a
/// part without tets, a body or patch without a number, not enough disk space. Later: I/O errors.
/// All ranks get the error, and `DIR` is unchanged.
pub fn write(
    comm: &dyn Communicator,
    part: &dyn MeshStream,
    names: &Names,
    dir: &Path,
) -> Result<Written, WriteError> {
    comm.agree(check_limits(part.totals(), part.counts(), part.rank()))?;
    let numbering = number(comm, part)?;
    comm.agree(check_shared_lines(part, &numbering))?;
    let periodic = periodic_text(comm, part, &numbering)?;
    let left_out = if part.ghosts().is_some() { LeftOut::default() } else { left_out(comm, part, names)? };
    let content = Content { part, names, numbering, left_out };

    let needed = content.estimate();
    let written = write_together(comm, dir, needed, is_part_file, |stage| {
        let folder = stage.join(format!("partitioning.{}", part.ranks()));
        // Every rank creates the folder: on another machine rank 0's may become visible only later.
        fs::create_dir_all(&folder).map_err(WriteError::io(&folder))?;
        let mut written = content.write_part(&folder)?;
        if part.rank() == 0 {
            let bytes = write_text(&stage.join("mesh.names"), names_text(names).as_bytes())?;
            written += Written { files: 1, bytes };
        }
        if let Some(text) = &periodic {
            let bytes = write_text(&folder.join(periodic::NAME), text.as_bytes())?;
            written += Written { files: 1, bytes };
        }
        if part.ranks() == 1 {
            written += content.link_serial_files(stage, &folder)?;
        }
        Ok(written)
    })?;
    sum_written(comm, written)
}

/// Whether a file of a replaced `partitioning.N` may be deleted.
fn is_part_file(name: &str) -> bool {
    if name == periodic::NAME {
        return true;
    }
    let Some((number, kind)) = name.strip_prefix("part.").and_then(|rest| rest.split_once('.')) else {
        return false;
    };
    number.bytes().all(|b| b.is_ascii_digit())
        && ["header", "nodes", "elements", "boundary", "shared"].contains(&kind)
}

pub(super) fn check_limits(totals: Counts, part: Counts, rank: Rank) -> Result<(), WriteError> {
    for (what, count) in
        [("vertices", totals.vertices), ("tets", totals.tets), ("boundary triangles", totals.boundary)]
    {
        if count > MAX_ID {
            return Err(WriteError::TooMany { format: "Elmer", what, count, limit: MAX_ID });
        }
    }
    if part.tets == 0 {
        return Err(WriteError::EmptyPart(rank + 1));
    }
    Ok(())
}

/// Checks that Elmer can read the `.shared` lines of all vertices, in whichever part they are
/// written.
fn check_shared_lines(part: &dyn MeshStream, numbering: &Numbering) -> Result<(), WriteError> {
    for index in 0..part.vertex_blocks() {
        let block = part.vertex_block(index);
        let Some(last) = block.local.end.checked_sub(1).filter(|_| !block.local.is_empty()) else { continue };
        let longest = block.local.map(|v| numbering.vertex(v)).max().unwrap_or(0);
        check_shared_line(block.holders, &[], longest, numbering.vertex(last))?;
    }
    let Some(ghosts) = part.ghosts() else { return Ok(()) };
    for (k, &local) in ghosts.watched.iter().enumerate() {
        let block = part.vertex_block(vertex_block_of(part, local));
        let number = numbering.vertex(local);
        check_shared_line(block.holders, ghosts.watchers.get(k), number, number)?;
    }
    Ok(())
}

/// Refuses a `.shared` line with these ranks if it is too long; `longest` is the largest id it may
/// start with.
fn check_shared_line(
    holders: &[Rank],
    watchers: &[Rank],
    longest: u64,
    vertex: u64,
) -> Result<(), WriteError> {
    let count = holders.len() + watchers.len();
    let parts: usize = holders.iter().chain(watchers).map(|&rank| 1 + digits(u64::from(rank) + 1)).sum();
    let characters = digits(longest) + 1 + digits(count as u64) + parts;
    if characters > MAX_LINE.0 || 2 + count > MAX_LINE.1 {
        return Err(WriteError::SharedLine { vertex, parts: count, characters });
    }
    Ok(())
}

/// Everything the files of one part are written from.
struct Content<'a> {
    part: &'a dyn MeshStream,
    names: &'a Names,
    numbering: Numbering,
    /// Boundary elements that other parts write.
    left_out: LeftOut,
}

impl Content<'_> {
    /// Number of boundary elements written.
    fn boundary(&self) -> u64 {
        self.part.counts().boundary - self.left_out.len()
    }

    /// Estimated size of a part's files in bytes.
    fn estimate(&self) -> u64 {
        let (counts, totals) = (self.part.counts(), self.part.totals());
        let vertex = digits(totals.vertices) as u64 + 1;
        let tet = digits(totals.tets) as u64 + 1;
        let order = self.part.order();
        let (of_tet, of_triangle) = (order.tet_nodes() as u64, order.triangle_nodes() as u64);
        counts.vertices * (vertex + 3 + 3 * MEAN_FLOAT)
            + counts.tets * (tet + 6 + of_tet * vertex)
            + counts.boundary * (tet + 17 + of_triangle * vertex)
            + self.numbering.shared * (vertex + 8)
    }

    /// Writes the five files of a part.
    fn write_part(&self, folder: &Path) -> Result<Written, WriteError> {
        let path = |kind: &str| folder.join(format!("part.{}.{kind}", self.part.rank() + 1));
        let header = self.header_text(Some(self.numbering.shared));
        let bytes = write_text(&path("header"), header.as_bytes())?
            + self.write_nodes(&path("nodes"))?
            + self.write_elements(&path("elements"))?
            + self.write_boundary(&path("boundary"))?
            + self.write_shared(&path("shared"))?;
        Ok(Written { files: 5, bytes })
    }

    /// The text of the header; `shared` is `None` for a serial mesh.
    fn header_text(&self, shared: Option<u64>) -> String {
        let (counts, boundary) = (self.part.counts(), self.boundary());
        let [triangle, tet] = types(self.part.order());
        let mut text = format!("{} {} {boundary}\n", counts.vertices, counts.tets);
        if boundary > 0 {
            text += &format!("2\n{triangle} {boundary}\n");
        } else {
            text += "1\n";
        }
        text += &format!("{tet} {}\n", counts.tets);
        if let Some(shared) = shared {
            text += &format!("{shared} 0\n");
        }
        text
    }

    fn write_nodes(&self, path: &Path) -> Result<u64, WriteError> {
        let mut file = Output::create(path)?;
        lines::vertices(
            self.part,
            &mut file,
            |_| true,
            |line, vertex| {
                line.int(self.numbering.vertex(vertex.index as u32)).bytes(b" -1");
                vertex.point.iter().for_each(|&x| _ = line.blank().float(x));
            },
        )?;
        file.finish()
    }

    fn write_elements(&self, path: &Path) -> Result<u64, WriteError> {
        let mut file = Output::create(path)?;
        let [_, kind] = types(self.part.order());
        lines::tets(self.part, self.names, &mut file, |line, tet| {
            line.int(self.numbering.tet(tet.index));
            if let Some(ghost) = self.part.ghosts().and_then(|ghosts| ghosts.tet(tet.index)) {
                line.bytes(b"/").int(u64::from(ghost.owner) + 1);
            }
            line.blank().int(tet.number).blank().int(kind);
            self.ids(line, tet.vertices.iter().copied());
            self.ids(line, arranged(tet.edge_nodes, &VTK));
        })?;
        file.finish()
    }

    fn write_boundary(&self, path: &Path) -> Result<u64, WriteError> {
        let mut file = Output::create(path)?;
        let by_patch = ByPatch::of(self.part);
        let [kind, _] = types(self.part.order());
        let behind_cuts = self.part.ghosts().map(ghost_faces).unwrap_or_default();
        lines::triangles(self.part, self.names, &by_patch, &self.left_out, &mut file, |line, triangle| {
            line.int(triangle.index + 1).blank().int(triangle.number);
            // A local parent comes first, because solvers take the body of the boundary from it; a
            // ghost comes second.
            let here = triangle.parents.iter().filter(|&&tet| tet != NO_TET);
            let ghost = behind_cuts.get(&ascending(*triangle.vertices));
            let parents = here.chain(ghost).map(|&tet| self.numbering.tet(tet));
            parents.chain([0, 0]).take(2).for_each(|parent| _ = line.blank().int(parent));
            line.blank().int(kind);
            self.ids(line, triangle.vertices.iter().chain(triangle.edge_nodes).copied());
        })?;
        file.finish()
    }

    /// Appends the file ids of vertices.
    fn ids(&self, line: &mut Line, vertices: impl Iterator<Item = u32>) {
        vertices.for_each(|v| _ = line.blank().int(self.numbering.vertex(v)));
    }

    fn write_shared(&self, path: &Path) -> Result<u64, WriteError> {
        let part = self.part;
        let mut file = Output::create(path)?;
        let mut line = Line::default();
        let mut text = Vec::new();
        for index in 0..part.vertex_blocks() {
            let block = part.vertex_block(index);
            if block.holders.is_empty() && part.ghosts().is_none() {
                continue;
            }
            for (local, id) in block.local.clone().zip(block.ids()) {
                let watchers = watchers(part, local);
                let others = block.holders.len() + watchers.len();
                if others == 0 {
                    continue;
                }
                let owner = block.owner(id, part.rank());
                // A vertex that others have only as a ghost has no holders listed: count this part.
                let count = others + usize::from(block.holders.is_empty());
                line.int(self.numbering.vertex(local)).blank().int(count as u64);
                line.blank().int(u64::from(owner) + 1);
                for &other in block.holders.iter().filter(|&&holder| holder != owner).chain(watchers) {
                    line.blank().int(u64::from(other) + 1);
                }
                line.end(&mut text);
            }
            file.flush_past(FLUSH_AT, &mut text)?;
        }
        file.flush_past(0, &mut text)?;
        file.finish()
    }

    /// Writes `DIR/mesh.*` beside `partitioning.1`: hard links to its files, and a header of its
    /// own.
    fn link_serial_files(&self, stage: &Path, folder: &Path) -> Result<Written, WriteError> {
        let bytes = write_text(&stage.join("mesh.header"), self.header_text(None).as_bytes())?;
        let mut written = Written { files: 1, bytes };
        for kind in ["nodes", "elements", "boundary"] {
            let (from, to) = (folder.join(format!("part.1.{kind}")), stage.join(format!("mesh.{kind}")));
            if fs::hard_link(&from, &to).is_err() {
                written.bytes += fs::copy(&from, &to).map_err(WriteError::io(&to))?;
            }
            written.files += 1;
        }
        Ok(written)
    }
}

/// Elmer's codes of triangles and tets of an order.
fn types(order: Order) -> [u64; 2] {
    match order {
        Order::First => [TRIANGLE, TET].map(u64::from),
        Order::Second => [TRIANGLE_6, TET_10].map(u64::from),
    }
}

fn ascending(mut face: [u32; 3]) -> [u32; 3] {
    face.sort_unstable();
    face
}

/// Maps faces of ghost tets whose vertices all belong to the part to their tets; face vertices
/// ascend.
fn ghost_faces(ghosts: &Ghosts) -> BTreeMap<[u32; 3], u64> {
    let mut faces = BTreeMap::new();
    for (tet, index) in ghosts.tets.iter().zip(ghosts.first_tet..) {
        for face in TET_FACES.map(|face| face.map(|k| tet.vertices[k])) {
            if face.iter().all(|&vertex| vertex < ghosts.first_vertex) {
                faces.insert(ascending(face), index);
            }
        }
    }
    faces
}
