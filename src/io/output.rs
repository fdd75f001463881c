//! Output that is whole or not there.
//!
//! A **staging** folder inside the target folder takes what is written. When all ranks are done, each entry of it
//! takes the place of the entry of the same name; what was there before goes last, and comes back if a later step
//! fails. The target folder may hold a user's own files, a solver input say: nothing but entries of the same
//! name is ever touched, and in a replaced folder only files that are ours disappear.
//!
//! ```text
//! DIR/case.sif                                     stays
//! DIR/partitioning.4/part.1.nodes                  replaced     ◄── DIR/.tetmill-PID-0.partial/new/partitioning.4/…
//! DIR/partitioning.4/results.1                     stays
//! DIR/.tetmill-PID-0.partial/{new,old}             goes
//! ```
//! Not promised: two folders are not swapped in the same instant, so a machine that loses power between two
//! renames may show a new `partitioning.4` beside old names; a process killed by a signal leaves its staging
//! folder, which no reader takes for a mesh, and which the next writer to the target removes.

use super::{WriteError, agree};
use crate::comm::Communicator;
use fs4::FileExt;
use std::fs::{self, File};
use std::io::{self, Seek, Write};
use std::path::{Path, PathBuf};

/// **Collective.** Runs `write` on every rank with a folder (the same for all) to write into, then moves what all
/// have written into `target`, which is made if need be.
///
/// `needed` is an estimate of this rank's bytes. `ours` tells which files of a replaced folder may go. Where any
/// rank fails, every rank gets an error and `target` is as before.
pub fn write_together<T>(
    comm: &dyn Communicator,
    target: &Path,
    needed: u64,
    ours: fn(&str) -> bool,
    write: impl FnOnce(&Path) -> Result<T, WriteError>,
) -> Result<T, WriteError> {
    let [needed] = comm.all_reduce_sum_u64([needed])?;
    let staging = if comm.rank() == 0 { Some(Staging::begin(target, needed)).transpose() } else { Ok(None) };
    let staging = agree(comm, staging)?;

    let mut path = staging.as_ref().map(|s| path_bytes(&s.new_entries())).unwrap_or_default();
    comm.broadcast_bytes(0, &mut path)?;
    let value = agree(comm, write(&bytes_path(path)))?;
    let committed = staging.map_or(Ok(()), |staging| staging.commit(ours));
    agree(comm, committed)?;
    Ok(value)
}

/// Writes one file: `write` gets the path to write to, which then takes the place of `path`.
pub fn write_file<T>(
    path: &Path,
    needed: u64,
    write: impl FnOnce(&Path) -> Result<T, WriteError>,
) -> Result<T, WriteError> {
    let (folder, name) = folder_and_name(path)?;
    let staging = Staging::begin(&folder, needed)?;
    let value = write(&staging.new_entries().join(name))?;
    staging.commit(|_| false)?;
    Ok(value)
}

/// The folder that `path` is in and its name there.
pub fn folder_and_name(path: &Path) -> Result<(PathBuf, PathBuf), WriteError> {
    let name = path.file_name().ok_or_else(|| {
        WriteError::io(path)(io::Error::new(io::ErrorKind::InvalidInput, "this is no name of a file"))
    })?;
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    Ok((folder.to_path_buf(), name.into()))
}

/// A file that is being written, with its path for errors; or none, where bytes are only counted.
pub struct Output {
    file: Option<File>,
    path: PathBuf,
    written: u64,
}

impl Output {
    /// Creates the file, or empties it.
    pub fn create(path: &Path) -> Result<Self, WriteError> {
        Self::open(path, File::options().write(true).create(true).truncate(true))
    }

    /// Opens a file that several ranks write, each at its own places: the first one creates it.
    pub fn shared(path: &Path) -> Result<Self, WriteError> {
        Self::open(path, File::options().write(true).create(true).truncate(false))
    }

    /// Opens an existing file once more, to write from `offset` on (past the end too: zeros fill the gap).
    pub fn at(path: &Path, offset: u64) -> Result<Self, WriteError> {
        let mut output = Self::open(path, File::options().write(true))?;
        output.go_to(offset)?;
        Ok(output)
    }

    /// No file: counts what would be written.
    pub fn counter() -> Self {
        Self { file: None, path: PathBuf::new(), written: 0 }
    }

    fn open(path: &Path, options: &fs::OpenOptions) -> Result<Self, WriteError> {
        let file = options.open(path).map_err(WriteError::io(path))?;
        Ok(Self { file: Some(file), path: path.to_path_buf(), written: 0 })
    }

    /// Goes on at this offset.
    pub fn go_to(&mut self, offset: u64) -> Result<(), WriteError> {
        let Some(file) = &mut self.file else { return Ok(()) };
        file.seek(io::SeekFrom::Start(offset)).map(drop).map_err(WriteError::io(&self.path))
    }

    /// Appends bytes, unbuffered: give it much at a time.
    pub fn write(&mut self, bytes: &[u8]) -> Result<(), WriteError> {
        self.written += bytes.len() as u64;
        let Some(file) = &mut self.file else { return Ok(()) };
        file.write_all(bytes).map_err(WriteError::io(&self.path))
    }

    /// How many bytes were written here.
    pub fn written(&self) -> u64 {
        self.written
    }

    /// Writes and empties `text` if it is longer than `limit`.
    pub fn flush_past(&mut self, limit: usize, text: &mut Vec<u8>) -> Result<(), WriteError> {
        if text.len() > limit {
            self.write(text)?;
            text.clear();
        }
        Ok(())
    }

    /// Waits until the file is on the disk, and returns its length.
    pub fn finish(self) -> Result<u64, WriteError> {
        let Some(file) = self.file else { return Ok(self.written) };
        let length = file.sync_all().and_then(|()| file.metadata()).map(|m| m.len());
        length.map_err(WriteError::io(&self.path))
    }
}

/// Creates a file with this text; returns its length.
pub fn write_text(path: &Path, text: &[u8]) -> Result<u64, WriteError> {
    let mut output = Output::create(path)?;
    output.write(text)?;
    output.finish()
}

/// A folder that takes what is written until it is whole; gone when dropped.
struct Staging {
    target: PathBuf,
    target_is_new: bool,
    stage: PathBuf,
    /// Locked as long as this process works on the stage; see [`remove_abandoned`].
    lock: Option<File>,
    /// Set where the old files could not be put back: they are in the stage, which must then stay.
    keep: bool,
}

impl Staging {
    fn begin(target: &Path, needed: u64) -> Result<Self, WriteError> {
        let target_is_new = !target.exists();
        fs::create_dir_all(target).map_err(WriteError::io(target))?;
        remove_abandoned(target);
        let stage = new_folder(target)?;
        let mut staging =
            Self { target: target.to_path_buf(), target_is_new, stage, lock: None, keep: false };
        for folder in [staging.new_entries(), staging.old_entries()] {
            fs::create_dir(&folder).map_err(WriteError::io(&folder))?;
        }
        staging.lock = Some(lock(&staging.stage)?);
        let available = fs4::available_space(target).map_err(WriteError::io(target))?;
        if needed > available {
            return Err(WriteError::NoSpace { path: target.to_path_buf(), needed, available });
        }
        Ok(staging)
    }

    fn new_entries(&self) -> PathBuf {
        self.stage.join("new")
    }

    fn old_entries(&self) -> PathBuf {
        self.stage.join("old")
    }

    /// Moves the new entries into the target.
    fn commit(mut self, ours: impl Fn(&str) -> bool) -> Result<(), WriteError> {
        let names = entries(&self.new_entries())?;
        for name in &names {
            self.refuse_what_is_in_the_way(name)?;
        }
        sync_folder(&self.new_entries());
        for (done, name) in names.iter().enumerate() {
            if let Err(error) = self.swap_in(name) {
                self.undo(&names[..=done]);
                return Err(error);
            }
        }
        for name in &names {
            if let Err(error) = self.keep_foreign(name, &ours) {
                self.keep = true;
                return Err(error);
            }
        }
        sync_folder(&self.target);
        self.target_is_new = false;
        Ok(())
    }

    fn refuse_what_is_in_the_way(&self, name: &Path) -> Result<(), WriteError> {
        let (old, new) = (self.target.join(name), self.new_entries().join(name));
        match fs::metadata(&old) {
            Ok(found) if found.is_dir() != new.is_dir() => Err(WriteError::InTheWay(old)),
            _ => Ok(()),
        }
    }

    fn swap_in(&self, name: &Path) -> Result<(), WriteError> {
        let (target, old) = (self.target.join(name), self.old_entries().join(name));
        if fs::symlink_metadata(&target).is_ok() {
            fs::rename(&target, &old).map_err(WriteError::io(&target))?;
        }
        fs::rename(self.new_entries().join(name), &target).map_err(WriteError::io(&target))
    }

    /// Puts the old entries back, the last one first.
    fn undo(&mut self, names: &[PathBuf]) {
        for name in names.iter().rev() {
            let (target, old) = (self.target.join(name), self.old_entries().join(name));
            if fs::symlink_metadata(&target).is_ok() {
                self.keep |= fs::rename(&target, self.new_entries().join(name)).is_err();
            }
            if fs::symlink_metadata(&old).is_ok() {
                self.keep |= fs::rename(&old, &target).is_err();
            }
        }
    }

    /// Moves what is not ours from a replaced folder into its successor.
    fn keep_foreign(&self, name: &Path, ours: impl Fn(&str) -> bool) -> Result<(), WriteError> {
        let (target, old) = (self.target.join(name), self.old_entries().join(name));
        if !fs::symlink_metadata(&old).is_ok_and(|found| found.is_dir()) {
            return Ok(());
        }
        for entry in entries(&old)? {
            let from = old.join(&entry);
            if !entry.to_str().is_some_and(&ours) && !target.join(&entry).exists() {
                fs::rename(&from, target.join(&entry)).map_err(WriteError::io(&from))?;
            }
        }
        Ok(())
    }
}

impl Drop for Staging {
    fn drop(&mut self) {
        if self.keep {
            return;
        }
        self.lock = None;
        // Nothing can be done here about a folder that does not go: it bears a name that no reader takes for a mesh.
        let _ = fs::remove_dir_all(&self.stage);
        if self.target_is_new {
            let _ = fs::remove_dir(&self.target);
        }
    }
}

/// How the name of a staging folder begins and ends.
const STAGE: (&str, &str) = (".tetmill-", ".partial");

/// A new folder in `target` with a name that no process has.
fn new_folder(target: &Path) -> Result<PathBuf, WriteError> {
    for attempt in 0_u32.. {
        let path = target.join(format!("{}{}-{attempt}{}", STAGE.0, std::process::id(), STAGE.1));
        match fs::create_dir(&path) {
            Ok(()) => return Ok(path),
            Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {}
            Err(error) => return Err(WriteError::io(&path)(error)),
        }
    }
    unreachable!("one of 2^32 names is free")
}

/// Creates the stage's lock. It gets its name when it is held, so that nobody takes the stage for abandoned before.
fn lock(stage: &Path) -> Result<File, WriteError> {
    let (early, path) = (stage.join("lock.new"), stage.join("lock"));
    let file = File::create(&early).map_err(WriteError::io(&early))?;
    // Some file systems know no locks: there an abandoned stage looks as one in use, if anyone asks.
    let _ = FileExt::lock(&file);
    fs::rename(&early, &path).map_err(WriteError::io(&path))?;
    Ok(file)
}

/// Removes stages whose process ended without tidying up (a signal, a crash), unless they hold old files that
/// were moved aside. Whatever can't be looked into or removed stays: it does no harm but take room.
fn remove_abandoned(target: &Path) {
    for name in entries(target).unwrap_or_default() {
        let is_stage = name.to_str().is_some_and(|name| name.starts_with(STAGE.0) && name.ends_with(STAGE.1));
        let stage = target.join(&name);
        if !is_stage || !entries(&stage.join("old")).is_ok_and(|old| old.is_empty()) {
            continue;
        }
        if File::open(stage.join("lock")).is_ok_and(|lock| FileExt::try_lock(&lock).is_ok()) {
            let _ = fs::remove_dir_all(&stage);
        }
    }
}

/// The names in a folder, sorted.
fn entries(folder: &Path) -> Result<Vec<PathBuf>, WriteError> {
    let names: io::Result<Vec<PathBuf>> =
        fs::read_dir(folder).and_then(|list| list.map(|e| e.map(|e| e.file_name().into())).collect());
    let mut names = names.map_err(WriteError::io(folder))?;
    names.sort();
    Ok(names)
}

/// Asks for the folder's entries to be on the disk; systems that can't do so lose nothing but the promise.
fn sync_folder(folder: &Path) {
    if let Ok(folder) = File::open(folder) {
        let _ = folder.sync_all();
    }
}

#[cfg(unix)]
fn path_bytes(path: &Path) -> Vec<u8> {
    use std::os::unix::ffi::OsStrExt;
    path.as_os_str().as_bytes().to_vec()
}

#[cfg(unix)]
fn bytes_path(bytes: Vec<u8>) -> PathBuf {
    use std::os::unix::ffi::OsStringExt;
    std::ffi::OsString::from_vec(bytes).into()
}

#[cfg(not(unix))]
fn path_bytes(path: &Path) -> Vec<u8> {
    path.to_string_lossy().into_owned().into_bytes()
}

#[cfg(not(unix))]
fn bytes_path(bytes: Vec<u8>) -> PathBuf {
    String::from_utf8_lossy(&bytes).into_owned().into()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::testing::together;

    fn is_part(name: &str) -> bool {
        name.starts_with("part.")
    }

    /// Writes as the only rank.
    fn alone(dir: &Path, write: impl Fn(&Path) -> Result<(), WriteError> + Sync) -> Result<(), WriteError> {
        together(1, |comm| write_together(comm, dir, 10, is_part, &write)).remove(0)
    }

    /// Writes DIR/mesh.names and DIR/partitioning.1/part.1.nodes.
    fn write_mesh(dir: &Path, text: &str) -> Result<(), WriteError> {
        alone(dir, |stage| {
            write_text(&stage.join("mesh.names"), text.as_bytes())?;
            fs::create_dir(stage.join("partitioning.1")).unwrap();
            write_text(&stage.join("partitioning.1/part.1.nodes"), text.as_bytes())?;
            Ok(())
        })
    }

    fn names(dir: &Path) -> Vec<String> {
        entries(dir).unwrap().into_iter().map(|p| p.to_str().unwrap().to_string()).collect()
    }

    #[test]
    fn new_files_replace_old_ones_and_leave_all_others_alone() {
        let dir = tempfile::tempdir().unwrap();
        let target = dir.path().join("a/mesh");
        write_mesh(&target, "old").unwrap();
        fs::write(target.join("case.sif"), "mine").unwrap();
        fs::write(target.join("partitioning.1/results.1"), "mine").unwrap();
        fs::write(target.join("partitioning.1/part.2.nodes"), "of a mesh that is no more").unwrap();
        write_mesh(&target, "new").unwrap();
        assert_eq!(names(&target), ["case.sif", "mesh.names", "partitioning.1"]);
        assert_eq!(names(&target.join("partitioning.1")), ["part.1.nodes", "results.1"]);
        assert_eq!(fs::read_to_string(target.join("mesh.names")).unwrap(), "new");
        assert_eq!(fs::read_to_string(target.join("partitioning.1/part.1.nodes")).unwrap(), "new");
    }

    #[test]
    fn a_failure_leaves_the_old_files_and_nothing_new() {
        let dir = tempfile::tempdir().unwrap();
        let target = dir.path().join("mesh");
        let fail = |target: &Path| {
            alone(target, |stage| {
                write_text(&stage.join("mesh.names"), b"half")?;
                Output::create(&stage.join("no/such/folder")).map(drop)
            })
        };
        let error = fail(&target).unwrap_err().to_string();
        assert!(error.contains("no/such/folder"), "{error}");
        assert!(!target.exists(), "a target that was not there is not left behind");

        write_mesh(&target, "old").unwrap();
        fail(&target).unwrap_err();
        assert_eq!(names(&target), ["mesh.names", "partitioning.1"]);
        assert_eq!(fs::read_to_string(target.join("mesh.names")).unwrap(), "old");
    }

    #[test]
    fn a_failure_on_one_rank_is_an_error_on_all_and_leaves_nothing() {
        let dir = tempfile::tempdir().unwrap();
        let target = dir.path().join("mesh");
        let errors = together(3, |comm| {
            let write = |stage: &Path| match comm.rank() {
                1 => Err(WriteError::EmptyPart(2)),
                rank => write_text(&stage.join(format!("part.{rank}")), b"half"),
            };
            write_together(comm, &target, 10, is_part, write).unwrap_err()
        });
        assert!(matches!(errors[1], WriteError::EmptyPart(2)));
        for error in [&errors[0], &errors[2]] {
            assert!(matches!(error, WriteError::OtherRank { rank: 1, .. }), "{error}");
        }
        assert!(!target.exists());
    }

    #[test]
    fn a_rank_that_panics_leaves_nothing_new_on_any() {
        let dir = tempfile::tempdir().unwrap();
        let target = dir.path().join("mesh");
        let outcome = crate::comm::thread::run(3, |comm| {
            let write = |stage: &Path| {
                assert_ne!(comm.rank(), 2, "a broken invariant");
                write_text(&stage.join(format!("part.{}", comm.rank())), b"half")
            };
            let error = write_together(comm, &target, 10, is_part, write).unwrap_err();
            assert!(matches!(error, WriteError::Comm(_)), "{error}");
        });
        assert!(outcome.is_err());
        assert!(!target.exists());
    }

    #[test]
    fn a_panic_leaves_nothing_new() {
        let dir = tempfile::tempdir().unwrap();
        let target = dir.path().join("mesh");
        let outcome = std::panic::catch_unwind(|| {
            alone(&target, |stage| {
                write_text(&stage.join("mesh.names"), b"half")?;
                panic!("a broken invariant")
            })
        });
        assert!(outcome.is_err());
        assert!(!target.exists());
    }

    #[test]
    fn a_folder_in_the_way_of_a_file_is_refused_and_stays() {
        let dir = tempfile::tempdir().unwrap();
        fs::create_dir_all(dir.path().join("mesh.names/precious")).unwrap();
        let error = write_mesh(dir.path(), "new").unwrap_err();
        assert!(matches!(error, WriteError::InTheWay(_)), "{error}");
        assert_eq!(names(dir.path()), ["mesh.names"]);
        assert!(dir.path().join("mesh.names/precious").exists());
    }

    #[test]
    fn an_entry_that_cannot_be_moved_brings_the_earlier_ones_back() {
        let dir = tempfile::tempdir().unwrap();
        fs::write(dir.path().join("a"), "old").unwrap();
        let staging = Staging::begin(dir.path(), 0).unwrap();
        fs::write(staging.new_entries().join("a"), "new").unwrap();
        // As if the second of two entries, b, had vanished from the stage before its turn.
        staging.swap_in(Path::new("a")).unwrap();
        let mut staging = staging;
        assert!(staging.swap_in(Path::new("b")).is_err());
        staging.undo(&["a".into(), "b".into()]);
        drop(staging);
        assert_eq!(names(dir.path()), ["a"]);
        assert_eq!(fs::read_to_string(dir.path().join("a")).unwrap(), "old");
    }

    #[test]
    fn what_a_killed_process_left_goes_and_what_a_living_one_writes_stays() {
        let dir = tempfile::tempdir().unwrap();
        let abandoned = |name: &str| {
            let stage = dir.path().join(name);
            fs::create_dir_all(stage.join("new")).unwrap();
            fs::create_dir_all(stage.join("old")).unwrap();
            fs::write(stage.join("lock"), "").unwrap();
            stage
        };
        abandoned(".tetmill-1-0.partial");
        let aside = abandoned(".tetmill-2-0.partial");
        fs::write(aside.join("old/mesh.names"), "the last copy").unwrap();
        let living = Staging::begin(dir.path(), 0).unwrap();
        let own = living.stage.file_name().unwrap().to_str().unwrap().to_string();
        write_file(&dir.path().join("f"), 0, |path| write_text(path, b"new")).unwrap();
        let mut expected = vec![".tetmill-2-0.partial".to_string(), own, "f".to_string()];
        expected.sort();
        assert_eq!(names(dir.path()), expected);
    }

    #[test]
    fn a_disk_that_is_too_small_is_refused_with_the_numbers() {
        let dir = tempfile::tempdir().unwrap();
        let error = write_file(&dir.path().join("f.vtu"), u64::MAX, |_| Ok(())).unwrap_err();
        assert!(matches!(error, WriteError::NoSpace { needed: u64::MAX, .. }), "{error}");
        assert!(names(dir.path()).is_empty());
    }

    #[test]
    fn a_file_replaces_the_one_before_it() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("f.vtu");
        for text in ["old", "new"] {
            write_file(&path, 3, |path| write_text(path, text.as_bytes())).unwrap();
        }
        assert_eq!(fs::read_to_string(&path).unwrap(), "new");
        assert_eq!(names(dir.path()), ["f.vtu"]);
    }
}
