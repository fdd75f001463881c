//! Common parts of the readers: the file in memory, its words or bytes, and errors with their
//! location.
//!
//! A reader is a function of the file's bytes. It fails with a `Fault` that has an offset, which
//! becomes a line number only in the error shown. Counts in a file are limited by the remaining
//! length of the file, so that a corrupt header cannot make a reader allocate more than a few times
//! the file's size.

mod bytes;
pub(crate) mod tetgen_nodes;
mod words;

pub(crate) use bytes::Bytes;
pub(crate) use words::{Words, float, int};

use std::fmt;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

/// Why a file could not be read.
#[derive(Debug, thiserror::Error)]
pub enum ReadError {
    /// The operating system reported an error.
    #[error("cannot read {}: {}", path.display(), reason(source))]
    Io {
        /// The file or folder.
        path: PathBuf,
        /// The system's error.
        source: io::Error,
    },
    /// The content is malformed.
    #[error("{}{place}: {message}", path.display())]
    Content {
        /// The file.
        path: PathBuf,
        /// The location.
        place: Place,
        /// The error, and what was expected.
        message: String,
    },
    /// The file's extension is that of no known format.
    #[error("cannot tell the format of {} by its name; known are {known}", path.display())]
    UnknownFormat {
        /// The file.
        path: PathBuf,
        /// The known extensions.
        known: &'static str,
    },
    /// No Elmer mesh in the folder.
    #[error("{} contains no Elmer mesh: neither mesh.header, nor part.1.header, nor partitioning.N", .0.display())]
    NoElmerMesh(PathBuf),
    /// More than one Elmer mesh in the folder.
    #[error("{} contains several meshes; name one of them: {}", dir.display(), list(found))]
    SeveralElmerMeshes {
        /// The folder.
        dir: PathBuf,
        /// The folders of the meshes.
        found: Vec<PathBuf>,
    },
}

fn list(paths: &[PathBuf]) -> String {
    paths.iter().map(|p| p.display().to_string()).collect::<Vec<_>>().join(", ")
}

/// A place in a file.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Place {
    /// The file as a whole.
    File,
    /// A line of text, from 1.
    Line(u64),
    /// A byte of binary data, from 0.
    Byte(u64),
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Self::File => Ok(()),
            Self::Line(line) => write!(f, ":{line}"),
            Self::Byte(byte) => write!(f, ", byte {byte}"),
        }
    }
}

/// An error in the content of a file, with its offset.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(crate) struct Fault {
    at: At,
    message: String,
}

#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum At {
    File,
    Text(usize),
    Byte(usize),
}

impl Fault {
    /// A fault of the file as a whole.
    pub fn file(message: impl Into<String>) -> Self {
        Self { at: At::File, message: message.into() }
    }

    /// A fault at this offset of a text.
    pub fn text(offset: usize, message: impl Into<String>) -> Self {
        Self { at: At::Text(offset), message: message.into() }
    }

    /// A fault at this offset of binary data.
    pub fn byte(offset: usize, message: impl Into<String>) -> Self {
        Self { at: At::Byte(offset), message: message.into() }
    }

    /// The message, if there is no file.
    pub fn into_message(self) -> String {
        self.message
    }

    /// The error for users, with the path and the line in this content.
    pub fn in_file(self, path: &Path, content: &[u8]) -> ReadError {
        let place = match self.at {
            At::File => Place::File,
            At::Text(offset) => Place::Line(line_of(content, offset)),
            At::Byte(offset) => Place::Byte(offset as u64),
        };
        ReadError::Content { path: path.to_path_buf(), place, message: self.message }
    }
}

impl ReadError {
    /// An error on a line of a text file, from 1.
    pub(crate) fn line(path: impl Into<PathBuf>, line: u64, message: impl Into<String>) -> Self {
        Self::Content { path: path.into(), place: Place::Line(line), message: message.into() }
    }

    /// Turns a system error about `path` into an error.
    pub fn io(path: &Path) -> impl FnOnce(io::Error) -> Self + '_ {
        move |source| Self::Io { path: path.to_path_buf(), source }
    }
}

/// The system's reason for a failed read. A missing file has the same text on all systems.
pub(crate) fn reason(error: &io::Error) -> String {
    match error.kind() {
        io::ErrorKind::NotFound => "it does not exist".into(),
        _ => error.to_string(),
    }
}

/// Refuses a file or folder that does not exist, whatever its extension.
///
/// # Errors
/// If it does not exist; the error has the path.
pub fn refuse_missing(path: &Path) -> Result<(), ReadError> {
    match path.try_exists() {
        Ok(false) => Err(ReadError::io(path)(io::ErrorKind::NotFound.into())),
        // If the existence cannot be determined, opening the file reports why.
        _ => Ok(()),
    }
}

/// Reads a file that must not be empty.
pub(crate) fn load(path: &Path) -> Result<Vec<u8>, ReadError> {
    let content = fs::read(path).map_err(ReadError::io(path))?;
    if content.is_empty() {
        return Err(Fault::file("the file is empty").in_file(path, &content));
    }
    Ok(content)
}

/// The largest coordinate: products of five differences, as in tests of circumspheres, are finite.
const LARGEST: f64 = 1e60;

/// Checks a coordinate; adding zero turns −0 into 0, so that equal points have equal bits.
///
/// # Errors
/// The message, if no mesh can be made of it.
pub(crate) fn coordinate(x: f64) -> Result<f64, String> {
    if x.abs() <= LARGEST {
        return Ok(x + 0.0);
    }
    let reason = if x.is_finite() {
        format!("larger than {LARGEST:e}, choose another unit of length")
    } else {
        "not a finite number".into()
    };
    Err(format!("a coordinate is {reason}: {x:e}"))
}

/// The file beside `path` with another extension, in upper case if only that exists.
pub(crate) fn beside(path: &Path, other: &str) -> PathBuf {
    if ending(path) == other {
        return path.to_path_buf();
    }
    let [lower, upper] = [other.to_owned(), other.to_ascii_uppercase()].map(|e| path.with_extension(e));
    if upper.exists() && !lower.exists() { upper } else { lower }
}

/// The extension of a file name, in lower case without the dot.
pub(crate) fn ending(path: &Path) -> String {
    path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase()
}

/// The line at an offset of a text, from 1.
pub(crate) fn line_of(content: &[u8], offset: usize) -> u64 {
    let before = &content[..offset.min(content.len())];
    before.iter().filter(|&&b| b == b'\n').count() as u64 + 1
}

/// The start of some bytes, escaped for a message.
pub(crate) fn shown(bytes: &[u8]) -> String {
    const LONGEST: usize = 40;
    String::from_utf8_lossy(&bytes[..bytes.len().min(LONGEST)]).escape_debug().collect()
}

/// A count with its noun: `1 triangle`, `2 triangles`, `3 vertices`, `4 bodies`, `5 patches`.
pub(crate) fn counted(count: usize, what: &str) -> String {
    match (count, what.strip_suffix('y')) {
        (1, _) => format!("1 {what}"),
        (_, Some(stem)) => format!("{count} {stem}ies"),
        _ if what == "vertex" => format!("{count} vertices"),
        _ if what.ends_with("ch") => format!("{count} {what}es"),
        _ => format!("{count} {what}s"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nouns_agree_with_their_counts() {
        let nouns = ["triangle", "vertex", "body", "periodic patch"];
        assert_eq!(
            nouns.map(|noun| counted(1, noun)),
            ["1 triangle", "1 vertex", "1 body", "1 periodic patch"]
        );
        let plurals = ["0 triangles", "0 vertices", "0 bodies", "0 periodic patches"];
        assert_eq!(nouns.map(|noun| counted(0, noun)), plurals);
    }

    #[test]
    fn a_fault_names_its_line_or_byte() {
        let shown = |fault: Fault| fault.in_file("f".as_ref(), b"one\ntwo\nthree").to_string();
        assert_eq!(shown(Fault::text(5, "bad")), "f:2: bad");
        assert_eq!(shown(Fault::byte(5, "bad")), "f, byte 5: bad");
        assert_eq!(shown(Fault::file("bad")), "f: bad");
    }

    #[test]
    fn an_empty_and_a_missing_file_are_refused() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("f");
        assert!(load(&path).unwrap_err().to_string().ends_with("f: it does not exist"));
        fs::write(&path, "").unwrap();
        assert!(load(&path).unwrap_err().to_string().ends_with("f: the file is empty"));
    }
}
