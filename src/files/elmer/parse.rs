//! Parses lines of numbers; errors carry the file and line.

use super::{MAX_ID, MAX_LINE};
use crate::files::input::ReadError;
use rayon::prelude::*;
use std::fs::{self, File};
use std::io::{self, Read, Seek, SeekFrom};
use std::path::Path;

/// The rest of a line.
pub(super) struct Fields<'a>(&'a [u8]);

impl<'a> Fields<'a> {
    pub fn new(line: &'a [u8]) -> Self {
        Self(line)
    }

    /// Returns the next word; only blanks separate words.
    #[inline]
    fn word(&mut self, what: &str) -> Result<&'a [u8], String> {
        let start = self.0.iter().position(|&b| b != b' ');
        // Build the message only on failure: files have hundreds of millions of words.
        let rest = &self.0[start.ok_or_else(|| format!("the line ends before its {what}"))?..];
        let end = rest.iter().position(|&b| b == b' ').unwrap_or(rest.len());
        self.0 = &rest[end..];
        Ok(&rest[..end])
    }

    /// Parses the next word as an integer in Elmer's range.
    #[inline]
    pub fn int(&mut self, what: &str) -> Result<u32, String> {
        let mut rest = self.0;
        while let [b' ', after @ ..] = rest {
            rest = after;
        }
        // Fast path for up to nine digits; anything else goes through `whole`.
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

    /// Parses the next word as an integer with an optional `/PART`, the part counted from 1.
    pub fn int_and_part(&mut self, what: &str) -> Result<(u32, Option<u32>), String> {
        let word = self.word(what)?;
        let Some(slash) = word.iter().position(|&b| b == b'/') else { return Ok((whole(word, what)?, None)) };
        let part = whole(&word[slash + 1..], "part behind the slash")?;
        if part == 0 {
            return Err(format!("the {what} is of part 0: '{}'", shown(word)));
        }
        Ok((whole(&word[..slash], what)?, Some(part)))
    }

    /// Parses the next word as a number; also Fortran's `1.5D-3`.
    pub fn float(&mut self, what: &str) -> Result<f64, String> {
        let word = self.word(what)?;
        let text = std::str::from_utf8(word).unwrap_or_default();
        let number = text.parse().or_else(|_| text.replace(['d', 'D'], "e").parse());
        number.map_err(|_| format!("the {what} is not a number: '{}'", shown(word)))
    }

    /// Whether only blanks are left.
    pub fn is_empty(&self) -> bool {
        self.0.iter().all(|&b| b == b' ')
    }

    /// Fails if anything but blanks is left.
    pub fn end(&self) -> Result<(), String> {
        if self.is_empty() { Ok(()) } else { Err(format!("too much: '{}'", shown(self.0.trim_ascii()))) }
    }
}

/// Parses a word as an integer in Elmer's range.
fn whole(word: &[u8], what: &str) -> Result<u32, String> {
    let wrong = || format!("the {what} is not an integer from 0 to {MAX_ID}: '{}'", shown(word));
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

/// The start of some bytes, escaped for a message.
fn shown(bytes: &[u8]) -> String {
    const LONGEST: usize = 40;
    let text = String::from_utf8_lossy(&bytes[..bytes.len().min(LONGEST)]);
    text.escape_debug().collect()
}

/// Elmer truncates long lines without a message and ends a line at a tab, so both are refused.
pub(super) fn expect_readable_by_elmer(line: &[u8]) -> Result<(), String> {
    if line.contains(&b'\t') {
        return Err("a tab, at which Elmer stops reading the line: use blanks".into());
    }
    if line.len() > MAX_LINE.0 {
        return Err(format!("{} characters, of which Elmer reads {}", line.len(), MAX_LINE.0));
    }
    Ok(())
}

/// Bytes that one thread reads and parses at a time.
const PIECE: u64 = 1 << 20;

/// Reads a file of one value per line with many threads; `expected` is the count in the header.
pub(super) fn read_lines<T: Send>(
    path: &Path,
    expected: u32,
    parse: impl Fn(&[u8]) -> Result<T, String> + Sync,
) -> Result<Vec<T>, ReadError> {
    let mut all = Vec::with_capacity(room(path, expected));
    for_each_line(path, parse, |values| all.append(values))?;
    Ok(all)
}

/// Capacity to reserve: the header's count, unless the file is too small for it.
pub(super) fn room(path: &Path, expected: u32) -> usize {
    let bytes = fs::metadata(path).map_or(0, |file| file.len());
    (bytes / 2).min(expected.into()) as usize
}

/// Reads a file of one value per line with many threads; `take` receives the values in order, many
/// at a time.
///
/// The same few buffers are used for all chunks, because the system clears new memory on first use,
/// which takes longer than parsing.
pub(super) fn for_each_line<T: Send>(
    path: &Path,
    parse: impl Fn(&[u8]) -> Result<T, String> + Sync,
    mut take: impl FnMut(&mut Vec<T>),
) -> Result<(), ReadError> {
    let length = fs::metadata(path).map_err(ReadError::io(path))?.len();
    let pieces = length.div_ceil(PIECE);
    let at_once = pieces.min(4 * rayon::current_num_threads() as u64).max(1);
    let mut buffers: Vec<Buffer<T>> = (0..at_once).map(|_| Buffer::default()).collect();
    let mut line = 0;
    for first in (0..pieces).step_by(at_once as usize) {
        let filled = &mut buffers[..at_once.min(pieces - first) as usize];
        let found: Vec<Result<Option<String>, ReadError>> = filled
            .par_iter_mut()
            .enumerate()
            .map(|(k, buffer)| {
                buffer.read(path, (first + k as u64) * PIECE).map_err(ReadError::io(path))?;
                Ok(buffer.parse(&parse).err())
            })
            .collect();
        for (buffer, found) in filled.iter_mut().zip(found) {
            line += buffer.values.len() as u64;
            if let Some(message) = found? {
                return Err(ReadError::line(path, line + 1, message));
            }
            take(&mut buffer.values);
            buffer.values.clear();
        }
    }
    Ok(())
}

/// The lines that begin in one chunk of a file.
struct Buffer<T> {
    text: Vec<u8>,
    values: Vec<T>,
}

impl<T> Default for Buffer<T> {
    fn default() -> Self {
        Self { text: Vec::new(), values: Vec::new() }
    }
}

impl<T> Buffer<T> {
    /// Reads the lines that begin in the chunk from `start` on.
    fn read(&mut self, path: &Path, start: u64) -> io::Result<()> {
        const MORE: u64 = 1024;
        let mut file = File::open(path)?;
        // Start one byte early, because the chunk may begin with a line.
        let before = u64::from(start > 0);
        file.seek(SeekFrom::Start(start - before))?;
        self.text.clear();
        (&mut file).take(before + PIECE).read_to_end(&mut self.text)?;
        let begun = match before {
            0 => 0,
            _ => self.text.iter().position(|&b| b == b'\n').map_or(self.text.len(), |at| at + 1),
        };
        if begun == self.text.len() && self.text.last() != Some(&b'\n') {
            // The whole chunk belongs to a line that begins before it.
            self.text.clear();
            return Ok(());
        }
        // The last line may end in a later chunk.
        while self.text.last() != Some(&b'\n') {
            let end = self.text.len();
            if (&mut file).take(MORE).read_to_end(&mut self.text)? == 0 {
                break;
            }
            if let Some(at) = self.text[end..].iter().position(|&b| b == b'\n') {
                self.text.truncate(end + at + 1);
            }
        }
        self.text.drain(..begun);
        Ok(())
    }

    /// Parses the lines; on an error `values` has those before the bad line.
    fn parse(&mut self, parse: impl Fn(&[u8]) -> Result<T, String>) -> Result<(), String> {
        self.values.clear();
        if self.text.is_empty() {
            return Ok(());
        }
        let text = self.text.strip_suffix(b"\n").unwrap_or(&self.text);
        for line in text.split(|&b| b == b'\n') {
            self.values.push(parse(line.strip_suffix(b"\r").unwrap_or(line))?);
        }
        Ok(())
    }
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
        assert_eq!(read_lines(&path, 7, parse).unwrap(), (0..300_000).collect::<Vec<_>>());
        text += "12x\n";
        fs::write(&path, &text).unwrap();
        let error = read_lines(&path, 300_000, parse).unwrap_err().to_string();
        assert!(error.contains("f:300001: the number is not an integer"), "{error}");
    }

    #[test]
    fn lines_are_read_whole_wherever_pieces_end() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("f");
        let piece = PIECE as usize;
        let parse = |line: &[u8]| Ok(line.len());
        // Lines that end with a chunk, just before or after its end, span several, or end with the
        // file.
        for lengths in [
            vec![],
            vec![0],
            vec![piece - 2, 0, 5, 1],
            vec![piece - 1, 0, 5],
            vec![piece, 3, 0],
            vec![piece + 1, 3],
            vec![10, 3 * piece, 7, 2 * piece - 20, 1, 0, 4],
            vec![3; 1_000_000],
        ] {
            for end in ["\n", ""] {
                let text: String = lengths.iter().map(|&n| "x".repeat(n) + "\n").collect();
                let text = text.strip_suffix('\n').map(|text| text.to_string() + end).unwrap_or_default();
                let last_is_empty = end.is_empty() && lengths.last() == Some(&0);
                fs::write(&path, text).unwrap();
                let found = read_lines(&path, 0, parse).unwrap();
                let expected = if last_is_empty { &lengths[..lengths.len() - 1] } else { &lengths[..] };
                assert!(found == expected, "{:?}, end {end:?}", &lengths[..lengths.len().min(9)]);
            }
        }
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
