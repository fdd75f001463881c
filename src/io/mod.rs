//! Files: one format per module, written from a [`MeshStream`](crate::mesh::stream::MeshStream), never from a
//! whole mesh in memory.
//!
//! ```text
//! elmer     DIR/partitioning.N/part.K.*, DIR/mesh.*       every rank writes its part; read back and judged
//! vtu       STEM.vtu, or STEM.pvtu with a file per part   raw binary, for ParaView and meshio
//! geomview  STEM.off, or STEM.list with a file per part   the skin, a colour per part
//! serial    FILE.{msh,mesh,vol}                           Gmsh, Medit, NETGEN: all parts in one file
//!           FILE.{vtu,off}                                one part, by the name of the file
//! ```
//! All writers go through [`output`]: what is written stands in a temporary folder beside the target until every
//! rank is done, and only then takes the place of what was there. A writer that fails leaves the old files as
//! they were. A format of one stream can also go to a pipe, a device or the standard output. Numbers in text read back to the same bits.

pub mod chunks;
mod domains;
pub mod elmer;
pub mod geomview;
pub mod input;
mod joined;
#[cfg(test)]
mod joined_tests;
pub mod lines;
mod number;
pub(crate) mod once;
pub mod output;
mod pairs;
pub mod plain;
pub mod serial;
pub mod skin;
pub mod surface;
#[cfg(test)]
pub(crate) mod testing;
pub mod text;
pub mod volume;
pub mod vtu;

use crate::comm::{CommError, Communicator};
use crate::mesh::{Label, Names, Rank};
use csg::{BodyId, PatchId};
use std::io;
use std::path::{Path, PathBuf};

/// What was written, summed over all ranks.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Written {
    /// Files, hard links counted.
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
    /// The operating system refused.
    #[error("cannot write {}: {source}", path.display())]
    Io {
        /// The file or folder.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// The disk is too small.
    #[error(
        "{} has {available} bytes free and about {needed} are needed; write elsewhere, or ask for fewer tets",
        path.display()
    )]
    NoSpace {
        /// The folder.
        path: PathBuf,
        /// The estimate.
        needed: u64,
        /// What is free.
        available: u64,
    },
    /// More entities than the format can number.
    #[error("the format {format} numbers {what} up to {limit}, and there are {count}; write another format")]
    TooMany {
        /// The format.
        format: &'static str,
        /// What there are too many of.
        what: &'static str,
        /// How many.
        count: u64,
        /// The most that it can number.
        limit: u64,
    },
    /// A line that Elmer would cut.
    #[error(
        "Elmer reads 256 characters and 64 numbers of a line; vertex {vertex} is in {parts} parts, which takes \
         {characters} characters: use fewer parts"
    )]
    SharedLine {
        /// The vertex.
        vertex: u64,
        /// How many parts hold it.
        parts: usize,
        /// How long its line would be.
        characters: usize,
    },
    /// A part without tets.
    #[error("part {0} has no tets, which Elmer does not accept: use fewer parts or a finer mesh")]
    EmptyPart(u32),
    /// A body without number and name.
    #[error("body {} has no number to be written", .0.0)]
    UnknownBody(BodyId),
    /// A patch without number and name.
    #[error("patch {} has no boundary number to be written", .0.0)]
    UnknownPatch(PatchId),
    /// Something else stands where the output belongs.
    #[error("{} is in the way: a folder where a file belongs, or a file where a folder belongs", .0.display())]
    InTheWay(PathBuf),
    /// A device, a pipe or a socket where only a file or folder can be replaced.
    #[error("{} is a device, a pipe or a socket, where a regular file or a folder is needed", .0.display())]
    NoRegularFile(PathBuf),
    /// A format of two files, and a path that names one.
    #[error(
        "VTU takes two files, FILE.vtu and FILE.boundary.vtu, and {} is no such name: end it in .vtu, or write another format",
        .0.display()
    )]
    TwoFiles(PathBuf),
    /// A format that is not known by the end of the file's name.
    #[error("cannot tell the format of {} by its name; known are {}; or name it with --format", .0.display(), serial::KNOWN)]
    UnknownFormat(PathBuf),
    /// A format that holds one part.
    #[error("{} can hold one part, and there are {parts} parts", path.display())]
    SeveralParts {
        /// The file.
        path: PathBuf,
        /// How many parts there are.
        parts: u32,
    },
    /// A format that cannot tell ghosts from a part's own tets.
    #[error("{0} has no halo elements; write Elmer or VTU, or leave out the halo")]
    NoHalo(&'static str),
    /// The ranks could not agree.
    #[error(transparent)]
    Comm(#[from] CommError),
    /// Another rank failed; it has the same message.
    #[error("rank {rank}: {message}")]
    OtherRank {
        /// The first rank that failed.
        rank: Rank,
        /// Its message.
        message: String,
    },
}

impl WriteError {
    /// Turns what the system said of `path` into an error.
    pub fn io(path: &Path) -> impl FnOnce(io::Error) -> Self + '_ {
        move |source| Self::Io { path: path.to_path_buf(), source }
    }
}

/// The largest number of a body or boundary: formats keep them in 32 bits.
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

/// **Collective.** What all ranks have written.
pub(crate) fn sum_written(comm: &dyn Communicator, written: Written) -> Result<Written, WriteError> {
    let [files, bytes] = comm.all_reduce_sum_u64([written.files, written.bytes])?;
    Ok(Written { files, bytes })
}

/// **Collective.** Every rank's own result where all went well; else every rank gets an error, its own or that
/// of the first rank that failed.
pub(crate) fn agree<T>(comm: &dyn Communicator, result: Result<T, WriteError>) -> Result<T, WriteError> {
    let elsewhere = |rank, message| WriteError::OtherRank { rank, message };
    comm.agree(result).map_err(|agreed| agreed.into_error(elsewhere))
}
