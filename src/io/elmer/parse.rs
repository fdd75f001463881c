//! Lines of numbers to values, with the file and line of what is wrong.

use super::{MAX_ID, MAX_LINE};
use rayon::prelude::*;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

/// Why a mesh could not be read.
#[derive(Debug, thiserror::Error)]
pub enum ReadError {
    /// The operating system refused.
    #[error("cannot read {}: {source}", path.display())]
    Io {
        /// The file or folder.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// A line is not what belongs there.
    #[error("{}:{line}: {message}", path.display())]
    Line {
        /// The file.
        path: PathBuf,
        /// The line, from 1.
        line: u64,
        /// What is wrong.
        message: String,
    },
    /// No mesh in the folder.
    #[error("{} holds no Elmer mesh: neither mesh.header, nor part.1.header, nor partitioning.N", .0.display())]
    NoMesh(PathBuf),
    /// More than one mesh in the folder.
    #[error("{} holds several meshes; name one of them: {}", dir.display(), list(found))]
    Several {
        /// The folder.
        dir: PathBuf,
        /// The folders of the meshes.
        found: Vec<PathBuf>,
    },
}

fn list(paths: &[PathBuf]) -> String {
    paths.iter().map(|p| p.display().to_string()).collect::<Vec<_>>().join(", ")
}

impl ReadError {
    pub(super) fn io(path: &Path) -> impl FnOnce(io::Error) -> Self + '_ {
        move |source| Self::Io { path: path.to_path_buf(), source }
    }
}

/// What is left of a line.
pub(super) struct Fields<'a>(&'a [u8]);

impl<'a> Fields<'a> {
    pub fn new(line: &'a [u8]) -> Self {
        Self(line)
    }

    /// The next word; only blanks separate words.
    fn word(&mut self, what: &str) -> Result<&'a [u8], String> {
        let start =
            self.0.iter().position(|&b| b != b' ').ok_or(format!("the line ends before its {what}"))?;
        let rest = &self.0[start..];
        let end = rest.iter().position(|&b| b == b' ').unwrap_or(rest.len());
        self.0 = &rest[end..];
        Ok(&rest[..end])
    }

    /// The next word as a whole number that Elmer can hold.
    pub fn int(&mut self, what: &str) -> Result<u32, String> {
        let word = self.word(what)?;
        let wrong = || format!("the {what} is no whole number from 0 to {MAX_ID}: '{}'", shown(word));
        if !word.iter().all(u8::is_ascii_digit) {
            return Err(wrong());
        }
        let number = word.iter().fold(0_u64, |n, b| n.saturating_mul(10).saturating_add(u64::from(b - b'0')));
        if number <= MAX_ID { Ok(number as u32) } else { Err(wrong()) }
    }

    /// The next word as a number; Fortran's `1.5D-3` too.
    pub fn float(&mut self, what: &str) -> Result<f64, String> {
        let word = self.word(what)?;
        let text = std::str::from_utf8(word).unwrap_or_default();
        let number = text.parse().or_else(|_| text.replace(['d', 'D'], "e").parse());
        number.map_err(|_| format!("the {what} is no number: '{}'", shown(word)))
    }

    /// The next word, which must be this.
    pub fn expect(&mut self, what: &str, expected: &str) -> Result<(), String> {
        let word = self.word(what)?;
        if word == expected.as_bytes() {
            return Ok(());
        }
        Err(format!("the {what} is '{}'; only {expected} is read here", shown(word)))
    }

    /// Whether nothing is left.
    pub fn is_empty(&self) -> bool {
        self.0.iter().all(|&b| b == b' ')
    }

    /// Nothing may be left.
    pub fn end(&self) -> Result<(), String> {
        if self.is_empty() { Ok(()) } else { Err(format!("too much: '{}'", shown(self.0.trim_ascii()))) }
    }
}

/// A few words of a file for a message.
fn shown(bytes: &[u8]) -> String {
    const LONGEST: usize = 40;
    let text = String::from_utf8_lossy(&bytes[..bytes.len().min(LONGEST)]);
    text.escape_debug().collect()
}

/// Elmer's reader cuts longer lines without a word, and takes a tab for the end of the line.
pub(super) fn refuse_what_elmer_cuts(line: &[u8]) -> Result<(), String> {
    if line.contains(&b'\t') {
        return Err("a tab, at which Elmer stops reading the line: use blanks".into());
    }
    if line.len() > MAX_LINE.0 {
        return Err(format!("{} characters, of which Elmer reads {}", line.len(), MAX_LINE.0));
    }
    Ok(())
}

/// Reads a file of one value per line, with many threads.
pub(super) fn read_lines<T: Send>(
    path: &Path,
    parse: impl Fn(&[u8]) -> Result<T, String> + Sync,
) -> Result<Vec<T>, ReadError> {
    const PIECE: usize = 1 << 20;
    let text = fs::read(path).map_err(ReadError::io(path))?;
    let pieces = pieces(&text, PIECE);
    let parsed: Vec<Result<Vec<T>, (usize, String)>> =
        pieces.par_iter().map(|piece| parse_piece(piece, &parse)).collect();
    let mut values = Vec::with_capacity(parsed.iter().flatten().map(Vec::len).sum());
    let mut lines = 0;
    for (piece, parsed) in pieces.iter().zip(parsed) {
        match parsed {
            Ok(parsed) => values.extend(parsed),
            Err((line, message)) => {
                let line = lines + line as u64 + 1;
                return Err(ReadError::Line { path: path.to_path_buf(), line, message });
            }
        }
        lines += piece.iter().filter(|&&b| b == b'\n').count() as u64;
    }
    Ok(values)
}

/// Splits a text into pieces of about `size` bytes that end with a line.
fn pieces(mut text: &[u8], size: usize) -> Vec<&[u8]> {
    let mut pieces = Vec::new();
    while !text.is_empty() {
        let end = text.iter().skip(size).position(|&b| b == b'\n').map_or(text.len(), |k| size + k + 1);
        let (piece, rest) = text.split_at(end);
        pieces.push(piece);
        text = rest;
    }
    pieces
}

/// The values of a piece, or the index of the first bad line and what is wrong with it.
fn parse_piece<T>(
    piece: &[u8],
    parse: impl Fn(&[u8]) -> Result<T, String>,
) -> Result<Vec<T>, (usize, String)> {
    let text = piece.strip_suffix(b"\n").unwrap_or(piece);
    text.split(|&b| b == b'\n')
        .enumerate()
        .map(|(k, line)| parse(line.strip_suffix(b"\r").unwrap_or(line)).map_err(|message| (k, message)))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bad_line_is_found_in_a_later_piece() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("f");
        let mut text: String = (0..300_000).map(|k| format!("{k}\n")).collect();
        fs::write(&path, &text).unwrap();
        let parse = |line: &[u8]| Fields::new(line).int("number");
        assert_eq!(read_lines(&path, parse).unwrap(), (0..300_000).collect::<Vec<_>>());
        text += "12x\n";
        fs::write(&path, &text).unwrap();
        let error = read_lines(&path, parse).unwrap_err().to_string();
        assert!(error.contains("f:300001: the number is no whole number"), "{error}");
    }

    #[test]
    fn numbers_beyond_elmers_integers_are_refused() {
        let int = |text: &str| Fields::new(text.as_bytes()).int("id");
        assert_eq!(int(" 2147483647 "), Ok(2_147_483_647));
        for text in ["2147483648", "-1", "1.5", "99999999999999999999", "1e3", ""] {
            assert!(int(text).is_err(), "{text}");
        }
        assert_eq!(Fields::new(b"1.5D-3").float("x"), Ok(1.5e-3));
    }
}
