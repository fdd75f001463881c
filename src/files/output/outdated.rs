//! Files of an earlier run that had more parts, in formats with a file for each part beside the
//! target. Readers count such files, or read the mesh of both runs.

use super::{WriteError, sync_folder};
use crate::ground::comm::Communicator;
use std::fs;
use std::io::Read;
use std::path::{Path, PathBuf};

/// The files of parts from `first` on, without gaps: regular files that begin with `start`, so that
/// a user's file of the same name ends the list. `name` makes the path of a part's file.
pub fn files_of_parts(first: u32, name: impl Fn(u32) -> PathBuf, start: &[u8]) -> Vec<PathBuf> {
    (first..).map(name).take_while(|path| begins_with(path, start)).collect()
}

fn begins_with(path: &Path, start: &[u8]) -> bool {
    let is_file = fs::symlink_metadata(path).is_ok_and(|found| found.is_file());
    let mut bytes = vec![0; start.len()];
    let mut read = |path| fs::File::open(path).and_then(|mut file| file.read_exact(&mut bytes));
    is_file && read(path).is_ok() && bytes == start
}

/// **Collective.** Removes files on rank 0, the last one first, so that a killed run leaves no gap.
pub fn remove_files(
    comm: &dyn Communicator,
    folder: &Path,
    files: impl FnOnce() -> Vec<PathBuf>,
) -> Result<(), WriteError> {
    let remove = || {
        let files = files();
        for path in files.iter().rev() {
            fs::remove_file(path).map_err(WriteError::io(path))?;
        }
        if !files.is_empty() {
            sync_folder(folder);
        }
        Ok(())
    };
    comm.agree(if comm.rank() == 0 { remove() } else { Ok(()) })
}
