//! File formats, one per module, written from a
//! [`MeshStream`](crate::ground::mesh::stream::MeshStream), never from a whole mesh in memory.
//!
//! ```text
//! elmer     DIR/partitioning.N/part.K.*, DIR/mesh.*       every rank writes its part; read and checked
//! vtu       STEM.vtu, or STEM.pvtu with a file per part   raw binary, for ParaView and meshio
//! geomview  STEM.off, or STEM.list with a file per part   the surface, a colour per part
//! serial    FILE.{msh,mesh,vol,inp}                       Gmsh, Medit, NETGEN, Abaqus: all parts in one file
//!           FILE.{vtu,off}                                one part, format by extension
//! gmsh4     FILE.msh, or STEM_K.msh for each part           Gmsh 4.1 with partitions, for deal.II and t8code
//! mfem      a text for each rank, in memory or in a file  MFEM, parallel
//! hdf5      STEM.h5, STEM.xdmf                            one HDF5 file for VTK, DOLFINx and PETSc
//! ```
//! All writers of files use `output`: files are written to a temporary folder beside the target,
//! and replace the old ones when every rank has finished. A writer that fails leaves the old files
//! unchanged. A single-file format can also go to a pipe, a device or the standard output. Numbers
//! in text are read back bitwise equal.

pub(crate) mod arrays;
pub(crate) mod chunks;
pub(crate) mod color;
mod corners;
mod domains;
pub mod elmer;
pub mod geomview;
mod gmsh;
pub mod gmsh4;
pub mod hdf5;
pub(crate) mod input;
mod joined;
#[cfg(test)]
mod joined_tests;
pub(crate) mod lines;
pub mod mesh_size;
pub mod mfem;
pub(crate) mod node_order;
mod number;
pub(crate) mod once;
#[cfg(test)]
mod order_tests;
pub(crate) mod output;
mod pairs;
#[cfg(feature = "pictures")]
pub mod picture;
pub(crate) mod plain;
mod runs;
pub mod serial;
pub(crate) mod skin;
pub mod surface;
#[cfg(test)]
pub(crate) mod testing;
pub(crate) mod text;
pub mod view;
pub mod volume;
pub mod vtu;

pub use input::{Place, ReadError, refuse_missing};
pub use output::{Destination, Output, folder_of, is_same_place, remove_abandoned, with_ending, write_file};

use crate::ground::comm::{CommError, Communicator};
use crate::ground::error::{ErrorKind, HasKind};
use crate::ground::memory::sized;
use crate::ground::mesh::{Label, Names};
use crate::ground::progress::Cancelled;
use csg::{BodyId, PatchId};
use std::io;
use std::path::{Path, PathBuf};

/// The amount of output, summed over all ranks.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Written {
    /// Number of files, including hard links.
    pub files: u64,
    /// Bytes on disk.
    pub bytes: u64,
}

impl std::ops::AddAssign for Written {
    fn add_assign(&mut self, other: Self) {
        self.files += other.files;
        self.bytes += other.bytes;
    }
}

/// Why nothing was written.
#[derive(Debug, thiserror::Error)]
pub enum WriteError {
    /// The operating system reported an error.
    #[error("cannot write {}: {source}", path.display())]
    Io {
        /// The file or folder.
        path: PathBuf,
        /// The system's error.
        source: io::Error,
    },
    /// The disk has too little space.
    #[error(
        "{} has {available} bytes free and about {needed} are needed; write elsewhere, or ask for fewer tets",
        path.display()
    )]
    NoSpace {
        /// The folder.
        path: PathBuf,
        /// The estimated size.
        needed: u64,
        /// The free space.
        available: u64,
    },
    /// The machine has too little memory for what is computed before it is written.
    #[error(
        "the adjacency takes {} of memory and this machine has {} free: leave it out, ask for fewer tets, or take more \
         machines",
        sized(*.needed), sized(*.available)
    )]
    NoMemory {
        /// The estimated bytes.
        needed: u64,
        /// Free bytes.
        available: u64,
    },
    /// More entities than the format can number.
    #[error("the format {format} numbers {what} up to {limit}, and there are {count}; write another format")]
    TooMany {
        /// The format.
        format: &'static str,
        /// The kind of entity.
        what: &'static str,
        /// Their number.
        count: u64,
        /// The largest number of the format.
        limit: u64,
    },
    /// A line longer than Elmer reads.
    #[error(
        "Elmer reads 256 characters and 64 numbers of a line; vertex {vertex} is in {parts} parts, which takes \
         {characters} characters: use fewer parts"
    )]
    SharedLine {
        /// The vertex.
        vertex: u64,
        /// Number of parts that share it.
        parts: usize,
        /// Length of its line.
        characters: usize,
    },
    /// A part without tets.
    #[error("part {0} has no tets, which Elmer does not accept: use fewer parts or a finer mesh")]
    EmptyPart(u32),
    /// A body without a number.
    #[error("body {} has no number to be written", .0.0)]
    UnknownBody(BodyId),
    /// A patch without a number.
    #[error("patch {} has no boundary number to be written", .0.0)]
    UnknownPatch(PatchId),
    /// A folder where a file is to be written, or the reverse.
    #[error("{} is in the way: a folder where a file belongs, or a file where a folder belongs", .0.display())]
    InTheWay(PathBuf),
    /// A device, pipe or socket where a file or folder is to be replaced.
    #[error("{} is a device, a pipe or a socket, where a regular file or a folder is needed", .0.display())]
    NoRegularFile(PathBuf),
    /// A path without the extension that a format of two files needs.
    #[error(
        "VTU takes two files, FILE.vtu and FILE.boundary.vtu, but the path is {}: end it in .vtu, or write another format",
        .0.display()
    )]
    TwoFiles(PathBuf),
    /// A path for VTU files with the extension of another format.
    #[error("VTU files end in .vtu or .pvtu, but the path is {}: end it in .vtu, or leave out the ending", .0.display())]
    ForeignEnding(PathBuf),
    /// Fields that do not fit the mesh.
    #[error(transparent)]
    Field(#[from] vtu::FieldError),
    /// The file's extension is that of no known format.
    #[error("cannot tell the format of {} by its name; known are {}; or name it with --format", .0.display(), serial::KNOWN)]
    UnknownFormat(PathBuf),
    /// A format for one part only.
    #[error("{} can hold one part, and there are {parts} parts", path.display())]
    SeveralParts {
        /// The file.
        path: PathBuf,
        /// Number of parts.
        parts: u32,
    },
    /// A format that cannot distinguish ghosts from a part's own tets.
    #[error("{0} has no halo elements; write Elmer, VTU or Gmsh 4.1, or leave out the halo")]
    NoHalo(&'static str),
    /// The observer cancelled the run.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
    /// Another rank failed, or the ranks cannot communicate.
    #[error(transparent)]
    Comm(#[from] CommError),
}

impl HasKind for WriteError {
    fn kind(&self) -> ErrorKind {
        match self {
            Self::Io { .. } | Self::NoSpace { .. } | Self::NoMemory { .. } => ErrorKind::Resources,
            Self::Cancelled(_) => ErrorKind::Cancelled,
            Self::Comm(error) => error.kind(),
            _ => ErrorKind::Input,
        }
    }

    fn is_elsewhere(&self) -> bool {
        matches!(self, Self::Comm(error) if error.is_elsewhere())
    }
}

impl WriteError {
    /// Turns a system error about `path` into an error.
    pub fn io(path: &Path) -> impl FnOnce(io::Error) -> Self + '_ {
        move |source| Self::Io { path: path.to_path_buf(), source }
    }
}

/// The largest number of a body or boundary: formats use 32 bits.
const MAX_NUMBER: u32 = i32::MAX as u32;

/// The number of a block's body, at least 1.
pub(crate) fn body_number(body: Option<BodyId>, names: &Names) -> Result<u64, WriteError> {
    let body = body.expect("a tet block has a body");
    number_of(&names.bodies, body.index()).ok_or(WriteError::UnknownBody(body))
}

/// The number of a block's patch, at least 1.
pub(crate) fn patch_number(patch: Option<PatchId>, names: &Names) -> Result<u64, WriteError> {
    let patch = patch.expect("a boundary block has a patch");
    number_of(&names.patches, patch.index()).ok_or(WriteError::UnknownPatch(patch))
}

fn number_of(list: &[Label], index: usize) -> Option<u64> {
    list.get(index).map(|label| label.number).filter(|n| (1..=MAX_NUMBER).contains(n)).map(u64::from)
}

/// **Collective.** Sums the output of all ranks.
pub(crate) fn sum_written(comm: &dyn Communicator, written: Written) -> Result<Written, WriteError> {
    let [files, bytes] = comm.all_reduce_sum_u64([written.files, written.bytes])?;
    Ok(Written { files, bytes })
}
