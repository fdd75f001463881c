//! One HDF5 file for the mesh of all ranks, written by all of them, with an index for XDMF readers.
//!
//! ```text
//! STEM.h5
//!   /VTKHDF               VTK's unstructured grid of one piece: the tets
//!     Points, Connectivity, Offsets, Types, NumberOf…
//!     PointData/          GlobalNodeId; PeriodicId (periodic faces only)
//!     CellData/           GlobalElementId  BodyId  PartitionId
//!     FieldData/          for each name, `Body NAME` or `Boundary NAME`: the numbers with this name
//!   /geometry/vertices    another name of /VTKHDF/Points   ┐ PETSc's DMPlex, flavour of XDMF
//!   /viz/topology/cells   the tets, four columns           ┘
//!   /second_order/cells   the tets, ten columns, instead of /viz for second order
//!   /names/               BodyNumbers and BodyNames, BoundaryNumbers and BoundaryNames, in pairs
//!   /boundary/            cells (three or six columns)  BoundaryId  PartitionId  parents
//!   /adjacency/           edges, faces and who has them (`Settings::adjacency`)
//! STEM.xdmf               grids `mesh` and `boundary` by reference to STEM.h5
//! ```
//! All datasets are contiguous, so the place of each value in the file is known beforehand: rank 0
//! writes the metadata (`encode`), and each rank its own vertices and tets at their places, block
//! by block. Vertices and tets are numbered from 0 and contiguous per part, so their order depends
//! on the number of parts; the canonical ids are in `GlobalNodeId` and `GlobalElementId`.
//!
//! `parents` has for each boundary triangle the numbers of the tets behind it and in front of it,
//! -1 for none. A triangle between two parts is written once (`files::once`).
//!
//! The ending `.h5` is the one that PETSc's `DMPlexCreateFromFile` and DOLFINx's reader of XDMF
//! look for. Names are fixed-length strings, which VTK's reader does not accept as field data.
//!
//! `cells` repeats `Connectivity`: VTK requires a list, and PETSc and XDMF a table. Two datasets
//! with the same bytes are not defined by HDF5, and a program that rewrites one would damage the
//! other.

mod adjacency;
#[cfg(test)]
mod adjacency_tests;
mod checksum;
mod encode;
mod fill;
#[cfg(test)]
mod tests;
mod tree;
mod xdmf;

use super::lines::ByPatch;
use super::number::{Numbering, number};
use super::once::{Between, between, share_of_triangles};
use super::output::{folder_and_name, with_ending, write_text, write_together};
use super::{WriteError, Written, sum_written};
use crate::ground::comm::Communicator;
use crate::ground::memory;
use crate::ground::mesh::stream::{Counts, MeshStream};
use crate::ground::mesh::{Label, Names, Order, numbers_by_name};
use adjacency::Adjacency;
use std::collections::{BTreeMap, BTreeSet};
use std::io;
use std::path::Path;
use tree::{Kind, Tree, Value};

/// The endings of the two files.
pub const ENDINGS: [&str; 2] = [".h5", ".xdmf"];

/// Paths of datasets.
const POINTS: &str = "/VTKHDF/Points";
const CONNECTIVITY: &str = "/VTKHDF/Connectivity";
const OFFSETS: &str = "/VTKHDF/Offsets";
const TYPES: &str = "/VTKHDF/Types";
const NODE_IDS: &str = "/VTKHDF/PointData/GlobalNodeId";
const PERIODIC_IDS: &str = "/VTKHDF/PointData/PeriodicId";
const ELEMENT_IDS: &str = "/VTKHDF/CellData/GlobalElementId";
const BODIES: &str = "/VTKHDF/CellData/BodyId";
const PARTS: &str = "/VTKHDF/CellData/PartitionId";
const VERTICES: &str = "/geometry/vertices";
const TRIANGLES: &str = "/boundary/cells";
const BOUNDARIES: &str = "/boundary/BoundaryId";
const TRIANGLE_PARTS: &str = "/boundary/PartitionId";
const PARENTS: &str = "/boundary/parents";

/// The counts that VTK reads, one entry for each piece.
const COUNTS: [&str; 3] =
    ["/VTKHDF/NumberOfPoints", "/VTKHDF/NumberOfCells", "/VTKHDF/NumberOfConnectivityIds"];

/// The path of the tets as a table.
fn cells(order: Order) -> &'static str {
    match order {
        Order::First => "/viz/topology/cells",
        // PETSc would take ten nodes for ten corners.
        Order::Second => "/second_order/cells",
    }
}

/// A rank's part of the mesh, with the numbering of the whole.
struct Content<'a> {
    part: &'a dyn MeshStream,
    names: &'a Names,
    /// Counts of the whole mesh.
    totals: Counts,
    numbering: Numbering,
    by_patch: ByPatch,
    /// Triangles of this part that another part writes, and tets of others at those of this part.
    between: Between,
    triangles_before: u64,
    adjacency: Option<Adjacency>,
}

/// What the file holds besides the mesh.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Settings {
    /// The group `/adjacency`: edges and faces, which of them a tet has, and the lists upward.
    /// Takes [`ADJACENCY_MEMORY`] while the file is written.
    pub adjacency: bool,
}

/// Memory of a tet while its adjacency is computed and written, in bytes. Measured are 473, and 486
/// of second order (`benches/results/disk-2026-11-25.md`).
pub const ADJACENCY_MEMORY: u64 = 500;

/// **Collective.** Writes the mesh of all ranks to `STEM.h5` and `STEM.xdmf`. All ranks get the
/// totals.
///
/// ```
/// use tetmill::comm::thread;
/// use tetmill::{Error, Geometry, Mesher, files::hdf5};
/// # let folder = tempfile::tempdir()?;
/// # let stem = folder.path().join("ball");
///
/// let ball = Geometry::from_text("algebraic3d solid ball = sphere (0, 0, 0; 1); tlo ball;")?;
/// thread::try_run(2, |comm| -> Result<(), Error> {
///     let mesh = Mesher::new().generate_on(comm, Some(&ball))?;
///     hdf5::write(comm, mesh.stream(), &mesh.names, &stem)?;
///     Ok(())
/// })?;
/// # assert!(folder.path().join("ball.h5").exists());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// A part with ghosts, a body or patch without a number, not enough disk space, or an I/O error.
/// All ranks get an error, and old files are kept.
pub fn write(
    comm: &dyn Communicator,
    part: &dyn MeshStream,
    names: &Names,
    stem: &Path,
) -> Result<Written, WriteError> {
    write_with(comm, part, names, stem, Settings::default())
}

/// **Collective.** Like [`write()`], with settings, which must be the same on all ranks.
///
/// # Errors
/// Those of [`write()`], and too little memory for the adjacency.
pub fn write_with(
    comm: &dyn Communicator,
    part: &dyn MeshStream,
    names: &Names,
    stem: &Path,
    settings: Settings,
) -> Result<Written, WriteError> {
    let refused = if part.ghosts().is_some() { Err(WriteError::NoHalo("HDF5")) } else { Ok(()) };
    comm.agree(refused)?;
    let (folder, name) = folder_and_name(stem)?;
    let [file, index] = ENDINGS.map(|ending| with_ending(&name, ending));
    let reference = file.to_str().map(str::to_owned).ok_or_else(|| {
        WriteError::io(stem)(io::Error::new(io::ErrorKind::InvalidInput, "the name is not in Unicode"))
    })?;

    let content = Content::of(comm, part, names, settings)?;
    let placed = content.tree().place();
    let is_first = comm.rank() == 0;
    let needed = if is_first { placed.bytes() } else { 0 };
    let written = write_together(
        comm,
        &folder,
        needed,
        |_| false,
        |stage| {
            content.fill(&placed, &stage.join(file), comm.size() - 1 == comm.rank())?;
            if !is_first {
                return Ok(Written::default());
            }
            let text = xdmf::text(&placed, part.order(), &reference);
            let bytes = write_text(&stage.join(index), text.as_bytes())?;
            Ok(Written { files: 2, bytes: bytes + placed.bytes() })
        },
    )?;
    sum_written(comm, written)
}

impl<'a> Content<'a> {
    /// **Collective.** Numbers the entities.
    fn of(
        comm: &dyn Communicator,
        part: &'a dyn MeshStream,
        names: &'a Names,
        settings: Settings,
    ) -> Result<Self, WriteError> {
        let numbering = number(comm, part)?;
        let between = between(comm, part, names, numbering.first_tet)?;
        let (triangles_before, totals) = share_of_triangles(comm, part, &between.left_out)?;
        let by_patch = ByPatch::of(part);
        let adjacency = if settings.adjacency {
            refuse_little_memory(comm, part)?;
            Some(Adjacency::of(comm, part, &numbering)?)
        } else {
            None
        };
        Ok(Self { part, names, totals, numbering, by_patch, between, triangles_before, adjacency })
    }

    /// The groups and datasets of the file.
    fn tree(&self) -> Tree {
        let (order, totals) = (self.part.order(), self.totals);
        let (of_tet, of_triangle) = (order.tet_nodes() as u64, order.triangle_nodes() as u64);
        let mut tree = Tree::default();
        COUNTS.iter().for_each(|path| tree.add(path, Kind::I64, &[1]));
        tree.add(POINTS, Kind::F64, &[totals.vertices, 3]);
        tree.add(CONNECTIVITY, Kind::I64, &[of_tet * totals.tets]);
        tree.add(OFFSETS, Kind::I64, &[totals.tets + 1]);
        tree.add(TYPES, Kind::U8, &[totals.tets]);
        tree.add(NODE_IDS, Kind::I64, &[totals.vertices]);
        if !self.part.links().is_empty() {
            tree.add(PERIODIC_IDS, Kind::I64, &[totals.vertices]);
        }
        tree.add(ELEMENT_IDS, Kind::I64, &[totals.tets]);
        tree.add(BODIES, Kind::I32, &[totals.tets]);
        tree.add(PARTS, Kind::I32, &[totals.tets]);
        for (kind, labels) in self.labels() {
            let names = Named::of(labels);
            if !names.0.is_empty() {
                tree.add(&named_path(kind, "Numbers"), Kind::I32, &[names.0.len() as u64]);
                tree.add(&named_path(kind, "Names"), names.text(), &[names.0.len() as u64]);
            }
            for (path, numbers) in fields(kind, labels) {
                tree.add(&path, Kind::I32, &[numbers.len() as u64]);
            }
        }
        tree.attribute("/VTKHDF", "Version", Value::Integers(vec![2, 0]));
        tree.attribute("/VTKHDF", "Type", Value::Text("UnstructuredGrid"));
        for ids in [NODE_IDS, ELEMENT_IDS] {
            tree.attribute(ids, "Attribute", Value::Text("GlobalIds"));
        }

        tree.link(VERTICES, POINTS);
        tree.add(cells(order), Kind::I64, &[totals.tets, of_tet]);
        tree.attribute(cells(order), "cell_dim", Value::Integer(3));
        tree.add(TRIANGLES, Kind::I64, &[totals.boundary, of_triangle]);
        tree.add(BOUNDARIES, Kind::I32, &[totals.boundary]);
        tree.add(TRIANGLE_PARTS, Kind::I32, &[totals.boundary]);
        tree.add(PARENTS, Kind::I64, &[totals.boundary, 2]);
        if let Some(adjacency) = &self.adjacency {
            adjacency::add_to(&mut tree, adjacency);
        }
        tree
    }

    fn labels(&self) -> [(&'static str, &'a [Label]); 2] {
        [("Body", &self.names.bodies), ("Boundary", &self.names.patches)]
    }
}

/// **Collective.** Refuses the adjacency of parts that does not fit the memory of their machine.
fn refuse_little_memory(comm: &dyn Communicator, part: &dyn MeshStream) -> Result<(), WriteError> {
    let [needed] = memory::on_machine(comm, [ADJACENCY_MEMORY * part.counts().tets])?;
    let fits = match memory::available_bytes() {
        Some(available) if needed > available => Err(WriteError::NoMemory { needed, available }),
        _ => Ok(()),
    };
    comm.agree(fits)
}

/// The path of the numbers or names of bodies or boundaries.
fn named_path(kind: &str, what: &str) -> String {
    format!("/names/{kind}{what}")
}

/// For each name the path of its field, and the numbers with this name. Paths have slashes between
/// groups, so a slash in a name becomes `_`.
fn fields(kind: &str, labels: &[Label]) -> BTreeMap<String, BTreeSet<u32>> {
    let mut fields: BTreeMap<String, BTreeSet<u32>> = BTreeMap::new();
    for (name, numbers) in numbers_by_name(labels) {
        let path = format!("/VTKHDF/FieldData/{kind} {}", name.replace('/', "_"));
        fields.entry(path).or_default().extend(numbers);
    }
    fields
}

/// Numbers with their names; a number with several names is repeated.
struct Named<'a>(Vec<(u32, &'a str)>);

impl<'a> Named<'a> {
    fn of(labels: &'a [Label]) -> Self {
        let mut by_number: BTreeMap<u32, Vec<&str>> = BTreeMap::new();
        for label in labels {
            let names = by_number.entry(label.number).or_default();
            for name in label.names.iter().map(String::as_str) {
                if !names.contains(&name) {
                    names.push(name);
                }
            }
        }
        let pairs = |(number, names): (u32, Vec<&'a str>)| names.into_iter().map(move |name| (number, name));
        Self(by_number.into_iter().flat_map(pairs).collect())
    }

    /// The type of the names: as long as the longest.
    fn text(&self) -> Kind {
        Kind::Text(self.0.iter().map(|(_, name)| name.len()).max().unwrap_or_default().max(1) as u32)
    }
}
