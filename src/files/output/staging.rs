//! Replaces the entries of a folder by new ones: all of them, or none.

use super::destination::Destination;
use super::stage::{Outdated, Stage};
use super::{entries, folder_and_name, sync_folder};
use crate::files::WriteError;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

/// A stage with the folder that its entries are for; removed when dropped.
pub(super) struct Staging {
    target: PathBuf,
    target_is_new: bool,
    /// `None` after removal.
    stage: Option<Stage>,
    /// Set if old files could not be restored: they are in the stage, which must be kept.
    keep: bool,
}

impl Staging {
    /// Creates the target if necessary, and a stage in it, if the disk has `needed` bytes free.
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

    /// The folder of the new entries.
    pub fn new_entries(&self) -> PathBuf {
        self.stage().new_entries()
    }

    /// Moves the new entries into the target. `ours` decides which files of a replaced folder may
    /// be deleted.
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

    /// Moves new entries for symbolic links to stages beside the links' targets, which may be on
    /// other disks. The links stay.
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

    /// Entries of ours in folders to be replaced that have no successor.
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

    /// Restores the old entries in reverse order.
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
            // A folder that cannot be removed is left: no reader takes its name for a mesh, and the
            // next writer to the target tries again.
            let _ = stage.remove();
        }
        if self.target_is_new {
            // This succeeds only if the folder is empty.
            let _ = fs::remove_dir(&self.target);
        }
    }
}

/// Removes the stages of killed processes from a folder. A commit that had begun is completed
/// first, because its new files are complete; other new files are deleted. Stages of running
/// processes are kept, and so are stages that cannot be read or moved: they only take space.
pub fn remove_abandoned(target: &Path) {
    for stage in Stage::abandoned_in(target) {
        if complete_or_revert(&stage, target).is_ok() {
            let _ = stage.remove();
        }
    }
}

/// Completes or reverts an abandoned stage, so that it may be removed.
fn complete_or_revert(stage: &Stage, target: &Path) -> Result<(), WriteError> {
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

/// Moves old entries back to free places. Without a commit mark there should be none.
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

/// Ends a commit whose new entries are all in place: moves other files of replaced folders to the
/// new folders, then marks the old entries for deletion.
fn finish(stage: &Stage, target: &Path) -> Result<(), WriteError> {
    let outdated = stage.committed().unwrap_or_default();
    for name in entries(&stage.old_entries())? {
        keep_foreign(stage, target, &name, &outdated)?;
    }
    sync_folder(target);
    stage.mark_done()
}

/// Moves files that are not ours from a replaced folder into its successor.
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

/// Whether the path exists, including a dangling link.
fn is_there(path: &Path) -> bool {
    fs::symlink_metadata(path).is_ok()
}

/// The path, or the final target of a symbolic link.
fn resolved(path: &Path) -> Result<PathBuf, WriteError> {
    match Destination::of(path).map_err(WriteError::io(path))? {
        Destination::File(place) => Ok(place),
        _ => Err(WriteError::NoRegularFile(path.to_path_buf())),
    }
}

/// Moves a file or folder, also to another disk.
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
