//! Output that is complete or absent.
//!
//! Ranks write into a **staging** folder inside the target folder. When all ranks have finished,
//! each entry of the staging folder replaces the target's entry of the same name. Old entries are
//! deleted last, and are restored if an earlier step fails. The target folder may contain a user's
//! own files, such as a solver input: only entries of the same name are touched, and in a replaced
//! folder only files written by tetmill are deleted.
//!
//! ```text
//! DIR/case.sif                                     kept
//! DIR/partitioning.4/part.1.nodes                  replaced by  ◄── DIR/.tetmill-PID-0.partial/new/partitioning.4/…
//! DIR/partitioning.4/results.1                     kept
//! DIR/.tetmill-PID-0.partial/{new,old}             deleted
//! ```
//! A killed process leaves its staging folder, which no reader takes for a mesh. The next writer to
//! the target removes it ([`remove_abandoned`]), after completing the moves if the killed process
//! had begun them.
//!
//! Symbolic links are followed: their targets are replaced, the links stay. Devices, FIFOs and the
//! standard output are written through ([`Destination`]).
//!
//! Formats with a file for each part in the target folder remove those of an earlier run with more
//! parts when the new files are in place (`outdated`).
//!
//! Not guaranteed: several entries are not replaced atomically. After a power failure between two
//! renames a new `partitioning.4` may be beside old names until the next writer runs. Nor are
//! linked entries replaced together with the others.

mod destination;
mod outdated;
mod stage;
mod staging;
#[cfg(test)]
mod tests;

pub use destination::{Destination, is_same_place};
pub use outdated::{files_of_parts, remove_files};
pub use staging::remove_abandoned;

use super::WriteError;
use crate::ground::comm::Communicator;
use staging::Staging;
use std::fs::{self, File};
use std::io::{self, Seek, Write};
use std::path::{Path, PathBuf};

/// **Collective.** Runs `write` on every rank with a common staging folder, then moves the results
/// into `target`, which is created if necessary.
///
/// `needed` is an estimate of this rank's bytes. `ours` decides which files of a replaced folder
/// may be deleted. If any rank fails, all ranks get an error and `target` is unchanged.
pub fn write_together<T>(
    comm: &dyn Communicator,
    target: &Path,
    needed: u64,
    ours: fn(&str) -> bool,
    write: impl FnOnce(&Path) -> Result<T, WriteError>,
) -> Result<T, WriteError> {
    let [needed] = comm.all_reduce_sum_u64([needed])?;
    let staging = if comm.rank() == 0 { Some(Staging::begin(target, needed)).transpose() } else { Ok(None) };
    let staging = comm.agree(staging)?;

    let mut path = staging.as_ref().map(|s| path_bytes(&s.new_entries())).unwrap_or_default();
    comm.broadcast_bytes(0, &mut path)?;
    let value = comm.agree(write(&bytes_path(path)))?;
    let committed = staging.map_or(Ok(()), |staging| staging.commit(ours));
    comm.agree(committed)?;
    Ok(value)
}

/// Writes one file and returns its length. A regular file is replaced once the new one is complete;
/// any other path is written through, and `-` is the standard output, see [`Destination`].
pub fn write_file(
    path: &Path,
    needed: u64,
    write: impl FnOnce(&mut Output) -> Result<(), WriteError>,
) -> Result<u64, WriteError> {
    let place = match Destination::of(path).map_err(WriteError::io(path))? {
        Destination::File(place) => place,
        stream => {
            let mut output = Output::through(&stream)?;
            write(&mut output)?;
            return output.finish();
        }
    };
    let (folder, name) = folder_and_name(&place)?;
    let staging = Staging::begin(&folder, needed)?;
    let mut output = Output::create(&staging.new_entries().join(name))?;
    write(&mut output)?;
    let bytes = output.finish()?;
    staging.commit(|_| false)?;
    Ok(bytes)
}

/// Splits `path` into folder and file name.
pub fn folder_and_name(path: &Path) -> Result<(PathBuf, PathBuf), WriteError> {
    let name = path.file_name().ok_or_else(|| {
        WriteError::io(path)(io::Error::new(io::ErrorKind::InvalidInput, "not a file name"))
    })?;
    Ok((destination::parent(path).to_path_buf(), name.into()))
}

/// A path whose name goes on with an ending. Unlike [`Path::with_extension`] it replaces nothing:
/// names may contain dots.
pub fn with_ending(path: &Path, ending: &str) -> PathBuf {
    let mut name = path.as_os_str().to_os_string();
    name.push(ending);
    name.into()
}

/// The folder of an output file with links followed; `None` for a path that is written through.
pub fn folder_of(path: &Path) -> Option<PathBuf> {
    match Destination::of(path) {
        Ok(Destination::File(place)) => Some(destination::parent(&place).to_path_buf()),
        _ => None,
    }
}

/// A file or stream that is being written, with its path for errors.
pub struct Output {
    sink: Sink,
    path: PathBuf,
    /// Bytes written so far.
    written: u64,
}

enum Sink {
    /// Only counts bytes.
    Nothing,
    File(File),
    Stream(File),
    Stdout,
    Stderr,
}

impl Output {
    /// Creates or truncates the file.
    pub fn create(path: &Path) -> Result<Self, WriteError> {
        let file = File::create(path).map_err(WriteError::io(path))?;
        Ok(Self { sink: Sink::File(file), path: path.to_path_buf(), written: 0 })
    }

    /// Opens a file that several ranks write at different offsets; the first one creates it.
    pub fn shared(path: &Path) -> Result<Self, WriteError> {
        let options = File::options().write(true).create(true).truncate(false).clone();
        let file = options.open(path).map_err(WriteError::io(path))?;
        Ok(Self { sink: Sink::File(file), path: path.to_path_buf(), written: 0 })
    }

    /// A counter of bytes that writes no file.
    pub fn counter() -> Self {
        Self { sink: Sink::Nothing, path: PathBuf::new(), written: 0 }
    }

    /// Opens a path that is not a regular file. A FIFO blocks until it has a reader.
    fn through(destination: &Destination) -> Result<Self, WriteError> {
        let (sink, path) = match destination {
            Destination::Stdout => (Sink::Stdout, "the standard output".into()),
            Destination::Stderr => (Sink::Stderr, "the standard error".into()),
            Destination::Stream(path) | Destination::File(path) => {
                let file = File::options().append(true).open(path).map_err(WriteError::io(path))?;
                (Sink::Stream(file), path.clone())
            }
        };
        Ok(Self { sink, path, written: 0 })
    }

    /// Opens an existing file at an offset, which may be past the end: zeros fill the gap.
    pub fn at(path: &Path, offset: u64) -> Result<Self, WriteError> {
        let file = File::options().write(true).open(path).map_err(WriteError::io(path))?;
        let mut output = Self { sink: Sink::File(file), path: path.to_path_buf(), written: 0 };
        output.go_to(offset)?;
        Ok(output)
    }

    /// Continues at this offset of a file; a stream has no offsets.
    pub fn go_to(&mut self, offset: u64) -> Result<(), WriteError> {
        let Sink::File(file) = &mut self.sink else { return Ok(()) };
        file.seek(io::SeekFrom::Start(offset)).map(drop).map_err(WriteError::io(&self.path))
    }

    /// Number of bytes written.
    pub fn written(&self) -> u64 {
        self.written
    }

    /// Appends bytes, unbuffered: pass large blocks.
    pub fn write(&mut self, bytes: &[u8]) -> Result<(), WriteError> {
        let done = match &mut self.sink {
            Sink::Nothing => Ok(()),
            Sink::File(file) | Sink::Stream(file) => file.write_all(bytes),
            Sink::Stdout => unread_is_fine(io::stdout().lock().write_all(bytes)),
            Sink::Stderr => io::stderr().lock().write_all(bytes),
        };
        self.written += bytes.len() as u64;
        done.map_err(WriteError::io(&self.path))
    }

    /// Writes and clears `text` if it is longer than `limit`.
    pub fn flush_past(&mut self, limit: usize, text: &mut Vec<u8>) -> Result<(), WriteError> {
        if text.len() > limit {
            self.write(text)?;
            text.clear();
        }
        Ok(())
    }

    /// Flushes a file to disk and returns its length; for a stream the number of bytes written.
    pub fn finish(self) -> Result<u64, WriteError> {
        let length = match &self.sink {
            Sink::File(file) => file.sync_all().and_then(|()| file.metadata()).map(|m| m.len()),
            Sink::Stdout => unread_is_fine(io::stdout().lock().flush()).map(|()| self.written),
            Sink::Nothing | Sink::Stream(_) | Sink::Stderr => Ok(self.written),
        };
        length.map_err(WriteError::io(&self.path))
    }
}

/// A reader of the standard output that stops early, as in `| head`, is not an error.
fn unread_is_fine(result: io::Result<()>) -> io::Result<()> {
    match result {
        Err(error) if error.kind() == io::ErrorKind::BrokenPipe => Ok(()),
        result => result,
    }
}

/// Creates a file with this text and returns its length.
pub fn write_text(path: &Path, text: &[u8]) -> Result<u64, WriteError> {
    let mut output = Output::create(path)?;
    output.write(text)?;
    output.finish()
}

/// The names in a folder, sorted.
fn entries(folder: &Path) -> Result<Vec<PathBuf>, WriteError> {
    let names: io::Result<Vec<PathBuf>> =
        fs::read_dir(folder).and_then(|list| list.map(|e| e.map(|e| e.file_name().into())).collect());
    let mut names = names.map_err(WriteError::io(folder))?;
    names.sort();
    Ok(names)
}

/// Flushes the folder's entries to disk, on systems that can.
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
