//! Replacing the entries of a folder by new ones: all of them, or none.

use super::destination::Destination;
use super::stage::{Outdated, Stage};
use super::{entries, folder_and_name, sync_folder};
use crate::io::WriteError;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

/// A stage and the folder that its entries are for; gone when dropped.
pub(super) struct Staging {
    target: PathBuf,
    target_is_new: bool,
    /// Absent once it is removed.
    stage: Option<Stage>,
    /// Set where the old files could not be put back: they are in the stage, which must then stay.
    keep: bool,
}

impl Staging {
    /// Makes the target, if need be, and a stage in it, where the disk has room for so many bytes.
    pub fn begin(target: &Path, needed: u64) -> Result<Self, WriteError> {
        let target = &resolved(target)?;
        let target_is_new = !target.exists();
        fs::create_dir_all(target).map_err(WriteError::io(target))?;
        remove_abandoned(target);
        let stage = Some(Stage::new_in(target)?);
        let staging = Self { target: target.to_path_buf(), target_is_new, stage, keep: false };
        let available = fs4::available_space(target).map_err(WriteError::io(target))?;
        if needed > available {
            return Err(WriteError::NoSpace { path: target.to_path_buf(), needed, available });
        }
        Ok(staging)
    }

    fn stage(&self) -> &Stage {
        self.stage.as_ref().expect("the stage is there until the end")
    }

    /// The folder of what is written.
    pub fn new_entries(&self) -> PathBuf {
        self.stage().new_entries()
    }

    /// Moves the new entries into the target. `ours` tells which files of a replaced folder may go.
    pub fn commit(mut self, ours: fn(&str) -> bool) -> Result<(), WriteError> {
        for name in entries(&self.new_entries())? {
            self.refuse_what_is_in_the_way(&name)?;
        }
        let linked = self.divert_links()?;
        let names = entries(&self.new_entries())?;
        self.stage().mark_commit(&self.outdated(&names, ours)?)?;
        for (done, name) in names.iter().enumerate() {
            if let Err(error) = swap_in(self.stage(), &self.target, name) {
                self.undo(&names[..=done]);
                return Err(error);
            }
        }
        if let Err(error) = finish(self.stage(), &self.target) {
            self.keep = true;
            return Err(error);
        }
        self.target_is_new = false;
        linked.into_iter().try_for_each(|staging| staging.commit(ours))
    }

    fn refuse_what_is_in_the_way(&self, name: &Path) -> Result<(), WriteError> {
        let (old, new) = (self.target.join(name), self.new_entries().join(name));
        match fs::metadata(&old) {
            Ok(found) if !found.is_dir() && !found.is_file() => Err(WriteError::NoRegularFile(old)),
            Ok(found) if found.is_dir() != new.is_dir() => Err(WriteError::InTheWay(old)),
            _ => Ok(()),
        }
    }

    /// Moves new entries for symbolic links to stages beside the links' targets, which may be on other disks. The links stay.
    fn divert_links(&self) -> Result<Vec<Self>, WriteError> {
        let mut linked = Vec::new();
        for name in entries(&self.new_entries())? {
            let link = self.target.join(&name);
            if !link.is_symlink() {
                continue;
            }
            let (folder, end) = folder_and_name(&resolved(&link)?)?;
            let staging = Self::begin(&folder, 0)?;
            let (from, to) = (self.new_entries().join(&name), staging.new_entries().join(end));
            relocate(&from, &to).map_err(WriteError::io(&to))?;
            linked.push(staging);
        }
        Ok(linked)
    }

    /// The entries of folders to be replaced that are ours and have no successor.
    fn outdated(&self, names: &[PathBuf], ours: fn(&str) -> bool) -> Result<Outdated, WriteError> {
        let mut outdated = Outdated::new();
        for name in names.iter().filter(|name| self.target.join(name).is_dir()) {
            let Some(folder) = name.to_str() else { continue };
            for entry in entries(&self.target.join(name))? {
                let Some(text) = entry.to_str() else { continue };
                if ours(text) && !self.new_entries().join(name).join(&entry).exists() {
                    outdated.insert((folder.into(), text.into()));
                }
            }
        }
        Ok(outdated)
    }

    /// Puts the old entries back, the last one first.
    fn undo(&mut self, names: &[PathBuf]) {
        let (new_entries, old_entries) = (self.stage().new_entries(), self.stage().old_entries());
        for name in names.iter().rev() {
            let (target, old) = (self.target.join(name), old_entries.join(name));
            if !is_there(&new_entries.join(name)) && is_there(&target) {
                self.keep |= fs::rename(&target, new_entries.join(name)).is_err();
            }
            if is_there(&old) {
                self.keep |= fs::rename(&old, &target).is_err();
            }
        }
        if !self.keep {
            self.keep = self.stage().unmark_commit().is_err();
        }
    }
}

impl Drop for Staging {
    fn drop(&mut self) {
        if let Some(stage) = self.stage.take().filter(|_| !self.keep) {
            // Nothing can be done here about a folder that does not go: it bears a name that no reader takes for a mesh, and
            // the next writer to the target tries again.
            let _ = stage.remove();
        }
        if self.target_is_new {
            // Only if it is empty.
            let _ = fs::remove_dir(&self.target);
        }
    }
}

/// Removes the stages that killed processes left in a folder. A commit that was begun is completed first, since its new files
/// are whole; other new files are deleted. Stages of living processes stay, and so do stages that cannot be read or moved:
/// they take room but do no harm.
pub fn remove_abandoned(target: &Path) {
    for stage in Stage::abandoned_in(target) {
        if settle(&stage, target).is_ok() {
            let _ = stage.remove();
        }
    }
}

/// Completes or undoes what an abandoned stage had begun, so that the stage may be removed.
fn settle(stage: &Stage, target: &Path) -> Result<(), WriteError> {
    if stage.is_done() {
        return Ok(());
    }
    if stage.committed().is_none() {
        return restore(stage, target);
    }
    for name in entries(&stage.new_entries())? {
        swap_in(stage, target, &name)?;
    }
    finish(stage, target)
}

/// Moves old entries back to places that are free. Without the mark of a commit there should be none.
fn restore(stage: &Stage, target: &Path) -> Result<(), WriteError> {
    let old_entries = stage.old_entries();
    if !old_entries.exists() {
        return Ok(());
    }
    for name in entries(&old_entries)? {
        let (old, place) = (old_entries.join(&name), target.join(&name));
        if is_there(&place) {
            return Err(WriteError::InTheWay(place));
        }
        fs::rename(&old, &place).map_err(WriteError::io(&place))?;
    }
    Ok(())
}

fn swap_in(stage: &Stage, target: &Path, name: &Path) -> Result<(), WriteError> {
    let (place, old) = (target.join(name), stage.old_entries().join(name));
    if is_there(&place) {
        fs::rename(&place, &old).map_err(WriteError::io(&place))?;
    }
    fs::rename(stage.new_entries().join(name), &place).map_err(WriteError::io(&place))
}

/// The end of a commit, when all new entries are in their places: foreign files of replaced folders move to the new folders;
/// then the old entries may be deleted.
fn finish(stage: &Stage, target: &Path) -> Result<(), WriteError> {
    let outdated = stage.committed().unwrap_or_default();
    for name in entries(&stage.old_entries())? {
        keep_foreign(stage, target, &name, &outdated)?;
    }
    sync_folder(target);
    stage.mark_done()
}

/// Moves what is not ours from a replaced folder into its successor.
fn keep_foreign(stage: &Stage, target: &Path, name: &Path, outdated: &Outdated) -> Result<(), WriteError> {
    let (place, old) = (target.join(name), stage.old_entries().join(name));
    if !fs::symlink_metadata(&old).is_ok_and(|found| found.is_dir()) {
        return Ok(());
    }
    for entry in entries(&old)? {
        let key = name.to_str().zip(entry.to_str()).map(|(name, entry)| (name.into(), entry.into()));
        let (from, to) = (old.join(&entry), place.join(&entry));
        if !key.is_some_and(|key| outdated.contains(&key)) && !is_there(&to) {
            fs::rename(&from, &to).map_err(WriteError::io(&from))?;
        }
    }
    Ok(())
}

/// Whether there is anything, a dangling link too.
fn is_there(path: &Path) -> bool {
    fs::symlink_metadata(path).is_ok()
}

/// The path itself, or the final target if it is a symbolic link.
fn resolved(path: &Path) -> Result<PathBuf, WriteError> {
    match Destination::of(path).map_err(WriteError::io(path))? {
        Destination::File(place) => Ok(place),
        _ => Err(WriteError::NoRegularFile(path.to_path_buf())),
    }
}

/// Moves a file or folder, to another disk too.
fn relocate(from: &Path, to: &Path) -> io::Result<()> {
    match fs::rename(from, to) {
        Err(error) if error.kind() == io::ErrorKind::CrossesDevices => {
            copy(from, to)?;
            if from.is_dir() { fs::remove_dir_all(from) } else { fs::remove_file(from) }
        }
        renamed => renamed,
    }
}

fn copy(from: &Path, to: &Path) -> io::Result<()> {
    if !from.is_dir() {
        fs::copy(from, to)?;
        return fs::File::open(to)?.sync_all();
    }
    fs::create_dir(to)?;
    fs::read_dir(from)?.try_for_each(|entry| {
        let name = entry?.file_name();
        copy(&from.join(&name), &to.join(&name))
    })
}
