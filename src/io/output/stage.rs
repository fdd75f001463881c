//! Staging folders: their names, their locks, and the marks by which the next process continues what a killed one began.

use super::destination::same_inode;
use super::{entries, sync_folder, write_text};
use crate::io::WriteError;
use fs4::{FileExt, TryLockError};
use std::collections::BTreeSet;
use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};

/// How the name of a staging folder begins and ends.
const NAME: (&str, &str) = (".tetmill-", ".partial");
/// The new entries.
const NEW: &str = "new";
/// The entries that they replace.
const OLD: &str = "old";
/// Locked by the process that holds the stage.
const LOCK: &str = "lock";
/// Present once the new entries are whole: if the process is killed from then on, the next one moves them to their places.
const COMMIT: &str = "commit";
/// Present once all new entries are in their places: the old ones may be deleted.
const DONE: &str = "done";

/// Entries of replaced folders that go with them: the folder's name and the entry's.
pub(super) type Outdated = BTreeSet<(String, String)>;

/// A staging folder that this process holds.
pub(super) struct Stage {
    path: PathBuf,
    /// Locked as long as the stage is held. The system unlocks it when the process ends, in whatever way. The process id in the
    /// folder's name says nothing: another process may have it by now.
    _lock: File,
}

/// The result of an attempt to lock a stage.
enum Claim {
    Held(File),
    /// The file system has no locks.
    Unlockable(File),
    /// Another process holds it, or has just removed it.
    Taken,
}

impl Stage {
    /// A new staging folder in `target`.
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
                // Another process took the folder for abandoned before it had its lock.
                Ok(Claim::Taken) => {}
                Err(error) if error.kind() == io::ErrorKind::NotFound => {}
                Err(error) => return Err(WriteError::io(&path)(error)),
            }
        }
        unreachable!("one of 2^32 names is free")
    }

    /// The stages in `target` whose processes are gone. Those that cannot be locked are left alone.
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

    /// The folder of what is written.
    pub fn new_entries(&self) -> PathBuf {
        self.path.join(NEW)
    }

    /// The folder of what was replaced.
    pub fn old_entries(&self) -> PathBuf {
        self.path.join(OLD)
    }

    /// Records on the disk that the new entries are whole, and which entries of replaced folders may go.
    pub fn mark_commit(&self, outdated: &Outdated) -> Result<(), WriteError> {
        let (early, mark) = (self.path.join("commit.new"), self.path.join(COMMIT));
        sync_folder(&self.new_entries());
        write_text(&early, &serde_json::to_vec(outdated).expect("plain data"))?;
        fs::rename(&early, &mark).map_err(WriteError::io(&mark))?;
        sync_folder(&self.path);
        Ok(())
    }

    /// Takes the mark away, once nothing of the new entries is in its place any more.
    pub fn unmark_commit(&self) -> io::Result<()> {
        fs::remove_file(self.path.join(COMMIT))
    }

    /// Records that what is in `old` may go.
    pub fn mark_done(&self) -> Result<(), WriteError> {
        let (mark, done) = (self.path.join(COMMIT), self.path.join(DONE));
        fs::rename(&mark, &done).map_err(WriteError::io(&mark))
    }

    /// Whether the old entries may go.
    pub fn is_done(&self) -> bool {
        self.path.join(DONE).exists()
    }

    /// What [`mark_commit`](Self::mark_commit) recorded, if it was reached.
    pub fn committed(&self) -> Option<Outdated> {
        serde_json::from_slice(&fs::read(self.path.join(COMMIT)).ok()?).ok()
    }

    /// Removes the stage. The lock goes last, and before it the marks: a process that is killed here leaves a stage that the
    /// next one understands.
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

/// Locks a stage, making its lock file if there is none: a process may have been killed before it came to that.
fn claim(stage: &Path) -> io::Result<Claim> {
    let path = stage.join(LOCK);
    let lock = File::options().create(true).truncate(false).write(true).open(&path)?;
    match FileExt::try_lock(&lock) {
        Err(TryLockError::WouldBlock) => Ok(Claim::Taken),
        Err(TryLockError::Error(_)) => Ok(Claim::Unlockable(lock)),
        // Between opening and locking the file may have been removed by a process that held it.
        Ok(()) => Ok(if is_still_at(&lock, &path) { Claim::Held(lock) } else { Claim::Taken }),
    }
}

fn is_still_at(file: &File, path: &Path) -> bool {
    match (file.metadata(), fs::metadata(path)) {
        (Ok(file), Ok(found)) => same_inode(&file, &found) || cfg!(not(unix)),
        _ => false,
    }
}
