//! Loads a partition from disk as a distributed mesh, on any number of ranks.
//!
//! ```text
//!   part.1.* … part.M.* ──► ranks 0 … S−1, each a contiguous range of parts, or none
//!     own files       counts, tables, orientation: local
//!     ids             directory ranks compare the parts and renumber
//!     settle          numbers edges and faces
//!     faces           tets beside each face; boundary numbers become patches
//! ```
//! No rank has the whole mesh. The checks are those of [`check_elmer`](super::check_elmer), except
//! for two things: outer faces without boundary element are accepted, because other programs omit
//! them, and halo elements are dropped with the nodes that only they use. The first fault stops all
//! ranks, with file and line.
//!
//! There are no curves. A patch consists of the faces with one boundary number between the same
//! bodies, so refinement keeps its faces flat.

mod faces;
mod ids;
mod own;

use super::faults::FaultKind;
use super::names::{NamesByNumber, names_of};
use super::periodic;
use super::read::{Layout, only_layout};
use crate::files::input::{ReadError, counted};
use crate::ground::comm::{CommError, Communicator};
use crate::ground::error::{ErrorKind, HasKind};
use crate::ground::mesh::{Label, Names, Rank};
use crate::parallel::distribution::{DistMesh, NumberError, number_shared};
use own::OwnParts;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// A mesh loaded from a partition.
#[derive(Clone, Debug)]
pub struct Loaded {
    /// This rank's part, from its share of the files; it may be empty.
    pub mesh: DistMesh,
    /// For each tet the part of the files that had it, from 0.
    pub part: Vec<Rank>,
    /// Number of parts in the files.
    pub parts: u32,
    /// The folder with the files of the parts.
    pub folder: PathBuf,
    /// Numbers and names, the same on all ranks. Patches with the same boundary number between
    /// different bodies share it.
    pub names: Names,
    /// Whether the mesh has periodic faces; their pairs are not read.
    pub is_periodic: bool,
    /// Repairs and omissions, one sentence each, the same on all ranks.
    pub notes: Vec<String>,
}

/// Why a partition cannot be loaded.
#[derive(Debug, thiserror::Error)]
pub enum LoadError {
    /// A file is missing or malformed, or the parts disagree.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// The tets do not form a mesh.
    #[error("{}: {error}", folder.display())]
    Number {
        /// The folder with the files.
        folder: PathBuf,
        /// Why.
        error: NumberError,
    },
    /// Another rank met an error, or the ranks cannot communicate.
    #[error(transparent)]
    Comm(#[from] CommError),
}

impl HasKind for LoadError {
    fn kind(&self) -> ErrorKind {
        match self {
            Self::Read(_) | Self::Number { .. } => ErrorKind::Input,
            Self::Comm(error) => error.kind(),
        }
    }

    fn is_elsewhere(&self) -> bool {
        matches!(self, Self::Comm(error) if error.is_elsewhere())
    }
}

/// Makes an error of a fault; `line` counts from 1.
fn fault(kind: FaultKind, path: PathBuf, line: usize, what: String) -> ReadError {
    ReadError::line(path, line as u64, format!("{kind}: {what}"))
}

/// **Collective.** Loads the only partition in `dir` (or `dir` itself if it is a `partitioning.M`),
/// else `mesh.*`, on any number of ranks.
///
/// # Errors
/// The same on all ranks: missing or malformed files, with the line; wrong counts; duplicate ids;
/// shared nodes with different coordinates or the wrong list of parts; flat or overlapping
/// elements.
pub fn load(comm: &dyn Communicator, dir: &Path) -> Result<Loaded, LoadError> {
    let layout = share_layout(comm, dir)?;
    let own = comm.agree(OwnParts::read(comm, &layout).map_err(LoadError::from))?;
    let new_ids = ids::renumber(comm, &own)?;
    let bodies = distinct(comm, own.files().flat_map(|files| &files.elements).map(|element| element.body))?;
    let assembled = comm.agree(own.assemble(comm, new_ids, &bodies).map_err(LoadError::from))?;
    let own::Assembled { bare, of_tet, local, turned } = assembled;
    let folder = layout.folder().to_path_buf();
    let mut mesh =
        number_shared(comm, bare).map_err(|error| LoadError::Number { folder: folder.clone(), error })?;
    let found = faces::find_boundary(comm, &own, &of_tet, &local, &mut mesh)?;

    let [turned] = comm.all_reduce_sum_u64([turned])?;
    let mut notes = Vec::new();
    if turned > 0 {
        let tets = counted(turned as usize, "tet");
        notes.push(format!("{tets} stored in negative orientation turned round"));
    }
    if found.bare_faces > 0 {
        let faces = counted(found.bare_faces as usize, "outer face");
        notes.push(format!("{faces} without a boundary element, and none was added"));
    }
    let left_out = |kind: fn(u32) -> bool| -> u64 {
        let lines = own.files().flat_map(|files| &files.left_out);
        lines.filter(|(code, _)| kind(**code)).map(|(_, &count)| u64::from(count)).sum()
    };
    let halo: u64 = own.files().map(|files| files.halo.len() as u64).sum();
    let [halo, lesser] = comm.all_reduce_sum_u64([halo, left_out(|code| code != super::TRIANGLE)])?;
    if halo > 0 {
        notes.push(format!("{halo} halo elements left out"));
    }
    if lesser > 0 {
        notes.push(format!("{lesser} boundary elements that are points or edges left out"));
    }
    let has_pairs = u64::from(comm.rank() == 0 && folder.join(periodic::NAME).exists());
    let is_periodic = comm.all_reduce_max_u64([has_pairs])? == [1];
    if is_periodic {
        notes.push(format!("{} is left out: pairs of periodic nodes are not read", periodic::NAME));
    }
    let mut names = names_of(&folder);
    broadcast_names(comm, &mut names)?;
    let names = Names { bodies: named(&bodies, &names[0]), patches: named(&found.numbers, &names[1]) };
    let part = of_tet.iter().map(|tet| own.number(tet.part)).collect();
    Ok(Loaded { mesh, part, parts: own.parts, folder, names, is_periodic, notes })
}

/// **Collective.** Rank 0 finds the mesh and broadcasts its layout.
fn share_layout(comm: &dyn Communicator, dir: &Path) -> Result<Layout, LoadError> {
    let found = (comm.rank() == 0).then(|| only_layout(dir).and_then(expect_parts)).transpose();
    let found = comm.agree(found.map_err(LoadError::from))?;
    // Folder and number of parts, or 0 for a serial mesh. All ranks know the same `dir`.
    let mut text = match found {
        Some(Layout::Partitioned { folder, parts }) => format!("{parts} {}", folder.display()).into_bytes(),
        Some(Layout::Serial(folder)) => format!("0 {}", folder.display()).into_bytes(),
        None => Vec::new(),
    };
    comm.broadcast_bytes(0, &mut text)?;
    let text = String::from_utf8_lossy(&text).into_owned();
    let (parts, folder) = text.split_once(' ').expect("rank 0 sends a number and a path");
    let folder = PathBuf::from(folder);
    Ok(match parts.parse().expect("rank 0 sends a number") {
        0 => Layout::Serial(folder),
        parts => Layout::Partitioned { folder, parts },
    })
}

/// Refuses a `partitioning.M` that does not have M parts.
fn expect_parts(layout: Layout) -> Result<Layout, ReadError> {
    let Layout::Partitioned { folder, parts } = &layout else { return Ok(layout) };
    let name = folder.file_name().and_then(|name| name.to_str()).unwrap_or_default();
    let named = name.strip_prefix("partitioning.").and_then(|number| number.parse::<u32>().ok());
    match named {
        Some(named) if named != *parts => {
            let path = folder.join(format!("part.{}.header", named.min(parts + 1)));
            let source = std::io::Error::other(format!("the folder contains {parts} parts of {named}"));
            Err(ReadError::Io { path, source })
        }
        _ => Ok(layout),
    }
}

/// **Collective.** Returns the distinct numbers over all ranks, ascending.
fn distinct<T: bytemuck::Pod + Ord>(
    comm: &dyn Communicator,
    numbers: impl Iterator<Item = T>,
) -> Result<Vec<T>, CommError> {
    let mut mine: Vec<T> = numbers.collect();
    mine.sort_unstable();
    mine.dedup();
    let mut all = comm.all_gather(&mine)?.concat();
    all.sort_unstable();
    all.dedup();
    Ok(all)
}

/// **Collective.** Broadcasts the names from rank 0, because the file may change between the reads
/// of two ranks.
fn broadcast_names(comm: &dyn Communicator, names: &mut NamesByNumber) -> Result<(), CommError> {
    let mut text = serde_json::to_vec(&names).expect("plain data");
    comm.broadcast_bytes(0, &mut text)?;
    *names = serde_json::from_slice(&text).expect("JSON from rank 0");
    Ok(())
}

/// Pairs numbers with their names.
fn named(numbers: &[u32], names: &BTreeMap<i64, Vec<String>>) -> Vec<Label> {
    let names = |number: u32| names.get(&number.into()).cloned().unwrap_or_default();
    numbers.iter().map(|&number| Label { number, names: names(number) }).collect()
}

#[cfg(test)]
mod tests;
