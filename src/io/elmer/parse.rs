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
    #[inline]
    fn word(&mut self, what: &str) -> Result<&'a [u8], String> {
        let start = self.0.iter().position(|&b| b != b' ');
        // Texts are made where something is wrong, not before: there are hundreds of millions of words.
        let rest = &self.0[start.ok_or_else(|| format!("the line ends before its {what}"))?..];
        let end = rest.iter().position(|&b| b == b' ').unwrap_or(rest.len());
        self.0 = &rest[end..];
        Ok(&rest[..end])
    }

    /// The next word as a whole number that Elmer can hold.
    #[inline]
    pub fn int(&mut self, what: &str) -> Result<u32, String> {
        let mut rest = self.0;
        while let [b' ', after @ ..] = rest {
            rest = after;
        }
        // In one go where it is a number of at most nine digits; all else is looked at more closely.
        let (mut number, mut digits) = (0_u32, 0);
        while let [digit @ b'0'..=b'9', after @ ..] = rest
            && digits < 9
        {
            number = 10 * number + u32::from(digit - b'0');
            digits += 1;
            rest = after;
        }
        if digits > 0 && matches!(rest, [] | [b' ', ..]) {
            self.0 = rest;
            return Ok(number);
        }
        whole(self.word(what)?, what)
    }

    /// The next word as a whole number, and behind a slash, where there is one, another from 1.
    pub fn int_and_part(&mut self, what: &str) -> Result<(u32, Option<u32>), String> {
        let word = self.word(what)?;
        let Some(slash) = word.iter().position(|&b| b == b'/') else { return Ok((whole(word, what)?, None)) };
        let part = whole(&word[slash + 1..], "part behind the slash")?;
        if part == 0 {
            return Err(format!("the {what} is of part 0: '{}'", shown(word)));
        }
        Ok((whole(&word[..slash], what)?, Some(part)))
    }

    /// The next word as a number; Fortran's `1.5D-3` too.
    pub fn float(&mut self, what: &str) -> Result<f64, String> {
        let word = self.word(what)?;
        let text = std::str::from_utf8(word).unwrap_or_default();
        let number = text.parse().or_else(|_| text.replace(['d', 'D'], "e").parse());
        number.map_err(|_| format!("the {what} is no number: '{}'", shown(word)))
    }

    /// The next number, which must be this.
    #[inline]
    pub fn expect(&mut self, what: &str, expected: u32) -> Result<(), String> {
        let found = self.int(what)?;
        if found == expected {
            return Ok(());
        }
        Err(format!("the {what} is '{found}'; only {expected} is read here"))
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

/// A word as a whole number that Elmer can hold.
fn whole(word: &[u8], what: &str) -> Result<u32, String> {
    let wrong = || format!("the {what} is no whole number from 0 to {MAX_ID}: '{}'", shown(word));
    let mut number = 0_u64;
    for &digit in word {
        let digit = digit.wrapping_sub(b'0');
        if digit > 9 || number > MAX_ID {
            return Err(wrong());
        }
        number = 10 * number + u64::from(digit);
    }
    if number <= MAX_ID && !word.is_empty() { Ok(number as u32) } else { Err(wrong()) }
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
    let pieces = read_pieces(path, parse)?;
    let mut values = Vec::with_capacity(pieces.iter().map(Vec::len).sum());
    pieces.into_iter().for_each(|piece| values.extend(piece));
    Ok(values)
}

/// The same, in pieces that follow one another.
pub(super) fn read_pieces<T: Send>(
    path: &Path,
    parse: impl Fn(&[u8]) -> Result<T, String> + Sync,
) -> Result<Vec<Vec<T>>, ReadError> {
    const PIECE: usize = 1 << 20;
    let text = fs::read(path).map_err(ReadError::io(path))?;
    let pieces = pieces(&text, PIECE);
    let parsed: Vec<Result<Vec<T>, (usize, String)>> =
        pieces.par_iter().map(|piece| parse_piece(piece, &parse)).collect();
    let failed = parsed.iter().position(Result::is_err).unwrap_or(0);
    let lines_before = || -> usize { pieces[..failed].iter().map(|piece| count_lines(piece)).sum() };
    let located = |(line, message)| {
        let line = (lines_before() + line) as u64 + 1;
        ReadError::Line { path: path.to_path_buf(), line, message }
    };
    parsed.into_iter().map(|piece| piece.map_err(located)).collect()
}

fn count_lines(piece: &[u8]) -> usize {
    piece.iter().filter(|&&b| b == b'\n').count()
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
