//! Staging folders: their names, their locks, and the marks that let the next process continue
//! after a kill.

use super::destination::same_inode;
use super::{entries, sync_folder, write_text};
use crate::files::WriteError;
use fs4::{FileExt, TryLockError};
use std::collections::BTreeSet;
use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};

/// Prefix and suffix of the name of a staging folder.
const NAME: (&str, &str) = (".tetmill-", ".partial");
/// The new entries.
const NEW: &str = "new";
/// The replaced entries.
const OLD: &str = "old";
/// Locked by the process that owns the stage.
const LOCK: &str = "lock";
/// Present once the new entries are complete: if the process is killed later, the next one moves
/// them to their places.
const COMMIT: &str = "commit";
/// Present once all new entries are in their places, so that the old ones may be deleted.
const DONE: &str = "done";

/// Entries of replaced folders to delete with them: folder name and entry name.
pub(super) type Outdated = BTreeSet<(String, String)>;

/// A staging folder owned by this process.
pub(super) struct Stage {
    path: PathBuf,
    /// Locked as long as the stage is owned. The system unlocks it when the process ends for any
    /// reason. The process id in the folder's name is not sufficient, because ids are reused.
    _lock: File,
}

/// The result of an attempt to lock a stage.
enum Claim {
    Held(File),
    /// The file system does not support locks.
    Unlockable(File),
    /// Another process owns it, or has just removed it.
    Taken,
}

impl Stage {
    /// Creates a staging folder in `target`.
    pub fn new_in(target: &Path) -> Result<Self, WriteError> {
        for attempt in 0_u32.. {
            let path = target.join(format!("{}{}-{attempt}{}", NAME.0, std::process::id(), NAME.1));
            match fs::create_dir(&path) {
                Err(error) if error.kind() == io::ErrorKind::AlreadyExists => continue,
                made => made.map_err(WriteError::io(&path))?,
            }
            match claim(&path) {
                Ok(Claim::Held(lock) | Claim::Unlockable(lock)) => {
                    let stage = Self { path, _lock: lock };
                    for folder in [stage.new_entries(), stage.old_entries()] {
                        fs::create_dir(&folder).map_err(WriteError::io(&folder))?;
                    }
                    return Ok(stage);
                }
                // Another process removed the folder as abandoned before it was locked.
                Ok(Claim::Taken) => {}
                Err(error) if error.kind() == io::ErrorKind::NotFound => {}
                Err(error) => return Err(WriteError::io(&path)(error)),
            }
        }
        unreachable!("one of 2^32 names is free")
    }

    /// Finds the stages in `target` whose processes have ended. Stages that cannot be locked are
    /// skipped.
    pub fn abandoned_in(target: &Path) -> Vec<Self> {
        let is_stage = |name: &str| name.starts_with(NAME.0) && name.ends_with(NAME.1);
        let stages = entries(target).unwrap_or_default().into_iter();
        stages
            .filter(|name| name.to_str().is_some_and(is_stage))
            .map(|name| target.join(name))
            .filter_map(|path| match claim(&path) {
                Ok(Claim::Held(lock)) => Some(Self { path, _lock: lock }),
                _ => None,
            })
            .collect()
    }

    /// The folder of the new entries.
    pub fn new_entries(&self) -> PathBuf {
        self.path.join(NEW)
    }

    /// The folder of the replaced entries.
    pub fn old_entries(&self) -> PathBuf {
        self.path.join(OLD)
    }

    /// Records on disk that the new entries are complete, and which entries of replaced folders may
    /// be deleted.
    pub fn mark_commit(&self, outdated: &Outdated) -> Result<(), WriteError> {
        let (early, mark) = (self.path.join("commit.new"), self.path.join(COMMIT));
        sync_folder(&self.new_entries());
        write_text(&early, &serde_json::to_vec(outdated).expect("plain data"))?;
        fs::rename(&early, &mark).map_err(WriteError::io(&mark))?;
        sync_folder(&self.path);
        Ok(())
    }

    /// Removes the mark after all new entries have been moved back.
    pub fn unmark_commit(&self) -> io::Result<()> {
        fs::remove_file(self.path.join(COMMIT))
    }

    /// Records that the entries in `old` may be deleted.
    pub fn mark_done(&self) -> Result<(), WriteError> {
        let (mark, done) = (self.path.join(COMMIT), self.path.join(DONE));
        fs::rename(&mark, &done).map_err(WriteError::io(&mark))
    }

    /// Whether the old entries may be deleted.
    pub fn is_done(&self) -> bool {
        self.path.join(DONE).exists()
    }

    /// The record of [`mark_commit`](Self::mark_commit), if there is one.
    pub fn committed(&self) -> Option<Outdated> {
        serde_json::from_slice(&fs::read(self.path.join(COMMIT)).ok()?).ok()
    }

    /// Removes the stage: contents first, then the marks, then the lock. If the process is killed
    /// meanwhile, the next one can continue.
    pub fn remove(self) -> io::Result<()> {
        let absent_is_fine = |result: io::Result<()>| match result {
            Err(error) if error.kind() != io::ErrorKind::NotFound => Err(error),
            _ => Ok(()),
        };
        for folder in [self.new_entries(), self.old_entries()] {
            absent_is_fine(fs::remove_dir_all(folder))?;
        }
        for file in ["commit.new", COMMIT, DONE, LOCK] {
            absent_is_fine(fs::remove_file(self.path.join(file)))?;
        }
        fs::remove_dir(&self.path)
    }
}

/// Locks a stage. Creates the lock file if it is missing, because a process may have been killed
/// before it did.
fn claim(stage: &Path) -> io::Result<Claim> {
    let path = stage.join(LOCK);
    let lock = File::options().create(true).truncate(false).write(true).open(&path)?;
    match FileExt::try_lock(&lock) {
        Err(TryLockError::WouldBlock) => Ok(Claim::Taken),
        Err(TryLockError::Error(_)) => Ok(Claim::Unlockable(lock)),
        // The owner may have removed the file between opening and locking.
        Ok(()) => Ok(if is_still_at(&lock, &path) { Claim::Held(lock) } else { Claim::Taken }),
    }
}

fn is_still_at(file: &File, path: &Path) -> bool {
    match (file.metadata(), fs::metadata(path)) {
        (Ok(file), Ok(found)) => same_inode(&file, &found) || cfg!(not(unix)),
        _ => false,
    }
}
