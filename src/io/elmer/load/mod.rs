//! A partition on the disk as a distributed mesh, on any number of ranks.
//!
//! ```text
//!   part.1.* … part.M.* ──► rank 0 … S−1, each some parts in a row, or none
//!     own files       counts, tables, orientation: each rank for itself
//!     ids             homes of ids: what the parts say together
//!     settle          edges and faces
//!     faces           what lies beside each face; boundary numbers to patches
//! ```
//! No rank sees the whole mesh. What is read is judged as strictly as by [`check_elmer`](super::check_elmer), but for faces without
//! boundary element, which other programs leave out and which are kept as they are, and for halo elements, which are left out with the
//! nodes that only they have; the first fault ends the reading on all ranks, with file and line.
//!
//! There are no curves, and a patch is what has one boundary number between the same bodies: to refine such a mesh is to refine it flat.

mod faces;
mod ids;
mod own;

use super::faults::FaultKind;
use super::names::{NamesByNumber, names_of};
use super::parse::ReadError;
use super::periodic;
use super::read::{Layout, only_layout};
use crate::comm::{Agreed, CommError, Communicator};
use crate::dist::{DistMesh, SettleError, settle};
use crate::mesh::{Label, Names, Rank};
use own::OwnParts;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// A mesh that was read in parts.
#[derive(Clone, Debug)]
pub struct Loaded {
    /// This rank's part: that of some of the files, or an empty one.
    pub mesh: DistMesh,
    /// The part of the files that each tet was in, from 0.
    pub part: Vec<Rank>,
    /// How many parts the files have.
    pub parts: u32,
    /// The folder with the files of the parts.
    pub folder: PathBuf,
    /// Numbers and names, the same on all ranks. A patch and its continuation between other bodies have the same number.
    pub names: Names,
    /// Whether the mesh has periodic faces; their pairs are not read.
    pub is_periodic: bool,
    /// What was mended, or is missing: a sentence each, the same on all ranks.
    pub notes: Vec<String>,
}

/// Why a partition cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum LoadError {
    /// A file is not what it should be.
    #[error("{message}")]
    Refused {
        /// The lowest rank that found it.
        rank: Rank,
        /// Which, where and why.
        message: String,
    },
    /// The tets are no mesh.
    #[error("{}: {error}", folder.display())]
    Settle {
        /// The folder with the files.
        folder: PathBuf,
        /// Why.
        error: SettleError,
    },
    /// The ranks cannot talk.
    #[error(transparent)]
    Comm(#[from] CommError),
}

impl From<Agreed<ReadError>> for LoadError {
    fn from(agreed: Agreed<ReadError>) -> Self {
        match agreed {
            // The same words on all ranks, also on others that met an error.
            Agreed::Failed { rank, message, .. } => Self::Refused { rank, message },
            Agreed::Comm(error) => Self::Comm(error),
        }
    }
}

/// A fault as an error, with the line from 1: it ends the reading.
fn fault(kind: FaultKind, path: PathBuf, line: usize, what: String) -> ReadError {
    ReadError::Line { path, line: line as u64, message: format!("{kind}: {what}") }
}

/// **Collective.** Reads the only partition in `dir` (or `dir` itself, if it is a `partitioning.M`), else `mesh.*` there: on as many ranks as
/// there are, whatever the number of parts.
///
/// # Errors
/// The same rank's on all ranks: files that are missing or malformed, with the line; counts that disagree; ids that stand twice; copies of
/// nodes that differ, and holders that are not those of the files; elements that are flat or overlap.
pub fn load(comm: &dyn Communicator, dir: &Path) -> Result<Loaded, LoadError> {
    let layout = share_layout(comm, dir)?;
    let own = comm.agree(OwnParts::read(comm, &layout))?;
    let settled = ids::settle_ids(comm, &own)?;
    let bodies = distinct(comm, own.files().flat_map(|files| &files.elements).map(|element| element.body))?;
    let assembled = comm.agree(own.assemble(comm, settled, &bodies))?;
    let own::Assembled { bare, of_tet, local, turned } = assembled;
    let folder = layout.folder().to_path_buf();
    let mut mesh = settle(comm, bare).map_err(|error| LoadError::Settle { folder: folder.clone(), error })?;
    let found = faces::find_boundary(comm, &own, &of_tet, &local, &mut mesh)?;

    let [turned] = comm.all_reduce_sum_u64([turned])?;
    let mut notes = Vec::new();
    if turned > 0 {
        notes.push(format!("{turned} tets stored in negative orientation turned round"));
    }
    if found.bare_faces > 0 {
        notes.push(format!("{} outer faces have no boundary element, and get none", found.bare_faces));
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

/// **Collective.** Rank 0 looks which mesh there is.
fn share_layout(comm: &dyn Communicator, dir: &Path) -> Result<Layout, LoadError> {
    let found = (comm.rank() == 0).then(|| only_layout(dir).and_then(expect_parts)).transpose();
    let found = comm.agree(found)?;
    // Folder and number of parts; 0 for a serial mesh. All ranks know the same `dir`.
    let mut text = match found {
        Some(Layout::Partitioned { folder, parts }) => format!("{parts} {}", folder.display()).into_bytes(),
        Some(Layout::Serial(folder)) => format!("0 {}", folder.display()).into_bytes(),
        None => Vec::new(),
    };
    comm.broadcast_bytes(0, &mut text)?;
    let text = String::from_utf8_lossy(&text).into_owned();
    let (parts, folder) = text.split_once(' ').expect("rank 0 wrote it so");
    let folder = PathBuf::from(folder);
    Ok(match parts.parse().expect("rank 0 wrote a number") {
        0 => Layout::Serial(folder),
        parts => Layout::Partitioned { folder, parts },
    })
}

/// Refuses a `partitioning.M` that does not hold M parts.
fn expect_parts(layout: Layout) -> Result<Layout, ReadError> {
    let Layout::Partitioned { folder, parts } = &layout else { return Ok(layout) };
    let name = folder.file_name().and_then(|name| name.to_str()).unwrap_or_default();
    let named = name.strip_prefix("partitioning.").and_then(|number| number.parse::<u32>().ok());
    match named {
        Some(named) if named != *parts => {
            let path = folder.join(format!("part.{}.header", named.min(parts + 1)));
            let source = std::io::Error::other(format!("the folder holds {parts} parts of {named}"));
            Err(ReadError::Io { path, source })
        }
        _ => Ok(layout),
    }
}

/// **Collective.** The distinct numbers that any rank has, ascending.
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

/// **Collective.** The names that rank 0 has read: not every rank may see the same moment of the file.
fn broadcast_names(comm: &dyn Communicator, names: &mut NamesByNumber) -> Result<(), CommError> {
    let mut text = serde_json::to_vec(&names).expect("plain data");
    comm.broadcast_bytes(0, &mut text)?;
    *names = serde_json::from_slice(&text).expect("what rank 0 wrote");
    Ok(())
}

/// Numbers with their names.
fn named(numbers: &[u32], names: &BTreeMap<i64, Vec<String>>) -> Vec<Label> {
    let names = |number: u32| names.get(&number.into()).cloned().unwrap_or_default();
    numbers.iter().map(|&number| Label { number, names: names(number) }).collect()
}

#[cfg(test)]
mod tests;
