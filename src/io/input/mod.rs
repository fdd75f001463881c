//! What all readers of other programs' files have in common: the file in memory, its words or bytes, and errors
//! that name the place.
//!
//! A reader of a format is a function of the file's bytes. It fails with a `Fault`, which knows an offset; only
//! when a fault is shown is the offset turned to a line. Counts in a file are believed no further than what is
//! left of the file has room for, so that no header makes a reader reserve more than a few times the file's size.

mod bytes;
pub(crate) mod tetgen_nodes;
mod words;

pub(crate) use bytes::Bytes;
pub(crate) use words::{Words, float, int};

use crate::io::elmer;
use std::fmt;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

/// Why a file could not be read.
#[derive(Debug, thiserror::Error)]
pub enum ReadError {
    /// The operating system refused.
    #[error("cannot read {}: {}", path.display(), reason(source))]
    Io {
        /// The file or folder.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// The content is not what belongs there.
    #[error("{}{place}: {message}", path.display())]
    Content {
        /// The file.
        path: PathBuf,
        /// Where in it.
        place: Place,
        /// What is wrong, and what was expected.
        message: String,
    },
    /// A format that is not known by the end of the file's name.
    #[error("cannot tell the format of {} by its name; known are {known}", path.display())]
    UnknownFormat {
        /// The file.
        path: PathBuf,
        /// The known ends of names.
        known: &'static str,
    },
    /// An Elmer mesh is not what it should be.
    #[error(transparent)]
    Elmer(#[from] elmer::ReadError),
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

/// What is wrong with the content of a file, with the offset of the place.
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
    /// Of the file as a whole.
    pub fn file(message: impl Into<String>) -> Self {
        Self { at: At::File, message: message.into() }
    }

    /// At this offset of a text.
    pub fn text(offset: usize, message: impl Into<String>) -> Self {
        Self { at: At::Text(offset), message: message.into() }
    }

    /// At this offset of binary data.
    pub fn byte(offset: usize, message: impl Into<String>) -> Self {
        Self { at: At::Byte(offset), message: message.into() }
    }

    /// The error for users: of the file at `path`, with this content.
    pub fn in_file(self, path: &Path, content: &[u8]) -> ReadError {
        let place = match self.at {
            At::File => Place::File,
            At::Text(offset) => {
                let before = &content[..offset.min(content.len())];
                Place::Line(before.iter().filter(|&&b| b == b'\n').count() as u64 + 1)
            }
            At::Byte(offset) => Place::Byte(offset as u64),
        };
        ReadError::Content { path: path.to_path_buf(), place, message: self.message }
    }
}

impl ReadError {
    /// Turns what the system said of `path` into an error.
    pub(crate) fn io(path: &Path) -> impl FnOnce(io::Error) -> Self + '_ {
        move |source| Self::Io { path: path.to_path_buf(), source }
    }
}

/// Why the system could not read a file or folder: its own words, but that a file is missing is told in the same ones on all
/// systems.
pub(crate) fn reason(error: &io::Error) -> String {
    match error.kind() {
        io::ErrorKind::NotFound => "it does not exist".into(),
        _ => error.to_string(),
    }
}

/// Refuses a file or folder that is not there, whatever its name ends in.
pub(crate) fn refuse_missing(path: &Path) -> Result<(), ReadError> {
    match path.try_exists() {
        Ok(false) => Err(ReadError::io(path)(io::ErrorKind::NotFound.into())),
        // What cannot even be looked for is left to those who open it.
        _ => Ok(()),
    }
}

/// The content of a file.
pub(crate) fn load(path: &Path) -> Result<Vec<u8>, ReadError> {
    let content = fs::read(path).map_err(ReadError::io(path))?;
    if content.is_empty() {
        return Err(Fault::file("the file is empty").in_file(path, &content));
    }
    Ok(content)
}

/// The end of a file's name, without the dot, in small letters.
pub(crate) fn ending(path: &Path) -> String {
    path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase()
}

/// A few words of a file for a message.
pub(crate) fn shown(bytes: &[u8]) -> String {
    const LONGEST: usize = 40;
    String::from_utf8_lossy(&bytes[..bytes.len().min(LONGEST)]).escape_debug().collect()
}

/// `1 triangle`, `2 triangles`, `3 vertices`.
pub(crate) fn counted(count: usize, what: &str) -> String {
    match (count, what) {
        (1, _) => format!("1 {what}"),
        (_, "vertex") => format!("{count} vertices"),
        _ => format!("{count} {what}s"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
