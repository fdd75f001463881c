//! NETGEN's mesh-size files: sizes at points and along lines.
//!
//! ```text
//! 2                      number of points
//! 0 0 0  0.1             x y z and the size there
//! 1 0 0  0.05
//! 1                      number of lines
//! 0 0 0  1 1 1  0.02     both ends and the size between
//! ```
//! The lines are optional. Numbers may be on any number of lines. `#` starts a comment, an
//! extension of NETGEN's format.

use super::input::{ReadError, coordinate, shown};
use crate::Point;
use crate::ground::size::Source;
use std::path::Path;

/// Maximum number of sources along the lines of a file, 32 MB of them: a short file with a tiny
/// size must not fill the memory.
const MOST_SOURCES: usize = 1_000_000;
/// Maximum number of points or lines that a file may announce.
const MOST_COUNT: f64 = 1e9;

/// Maximum number of sources along a line: at a grading of 0.3 they need 60 million tets, and the
/// size field itself takes gigabytes.
const MOST_ON_LINE: f64 = 200_000.0;

/// Reads the sources of a mesh-size file; lines become sources one size apart.
///
/// # Errors
/// Malformed content, with the line.
pub fn read(path: &Path) -> Result<Vec<Source>, ReadError> {
    read_from(path, 0.0)
}

/// [`read`], which refuses sizes below `least`, the smallest of the geometry
/// ([`Geometry::least_size`](crate::Geometry::least_size)).
///
/// # Errors
/// Malformed content and too small sizes, with the line.
pub fn read_from(path: &Path, least: f64) -> Result<Vec<Source>, ReadError> {
    let text = std::fs::read(path).map_err(ReadError::io(path))?;
    parse(&String::from_utf8_lossy(&text), least)
        .map_err(|(line, reason)| ReadError::line(path, line as u64, reason))
}

fn parse(text: &str, least: f64) -> Result<Vec<Source>, (usize, String)> {
    let mut words = Words::new(text, least);
    let mut sources = Vec::new();
    for _ in 0..words.count("the number of points")? {
        let point = words.point("a point")?;
        sources.push(Source { point, size: words.size()? });
    }
    if words.is_at_end() {
        return Ok(sources);
    }
    let mut along_lines = 0.0;
    for _ in 0..words.count("the number of lines")? {
        let [from, to] = [words.point("the first end of a line")?, words.point("the second end of a line")?];
        let size = words.size()?;
        let pieces = ((to - from).norm() / size).ceil().max(1.0);
        along_lines += pieces + 1.0;
        if pieces > MOST_ON_LINE || along_lines > MOST_SOURCES as f64 {
            let most = format!("a line can have {MOST_ON_LINE} points with sizes, all lines {MOST_SOURCES}");
            return Err((
                words.line,
                format!("the size {size} is too small for a line from {from} to {to}: {most}"),
            ));
        }
        let at = |piece: usize| from + (to - from) * (piece as f64 / pieces);
        sources.extend((0..=pieces as usize).map(|piece| Source { point: at(piece), size }));
    }
    match words.next() {
        None => Ok(sources),
        Some(word) => {
            Err((words.line, format!("unexpected `{}` after the last line", shown(word.as_bytes()))))
        }
    }
}

/// The words of a text, and the line of the last one.
struct Words<'a> {
    rest: Vec<(usize, &'a str)>,
    line: usize,
    /// The smallest possible size.
    least: f64,
}

impl<'a> Words<'a> {
    fn new(text: &'a str, least: f64) -> Self {
        let words = text.lines().enumerate().flat_map(|(i, line)| {
            let content = line.split('#').next().unwrap_or_default();
            content.split_whitespace().map(move |word| (i + 1, word))
        });
        let mut rest: Vec<_> = words.collect();
        rest.reverse();
        Self { rest, line: 1, least }
    }

    fn is_at_end(&self) -> bool {
        self.rest.is_empty()
    }

    fn next(&mut self) -> Option<&'a str> {
        let (line, word) = self.rest.pop()?;
        self.line = line;
        Some(word)
    }

    fn number(&mut self, what: &str) -> Result<f64, (usize, String)> {
        let Some(word) = self.next() else {
            return Err((self.line, format!("the file ends before {what}")));
        };
        let number = word.parse().ok().filter(|number: &f64| number.is_finite());
        number.ok_or_else(|| (self.line, format!("expected {what}, found `{}`", shown(word.as_bytes()))))
    }

    fn count(&mut self, what: &str) -> Result<usize, (usize, String)> {
        let number = self.number(what)?;
        if number.fract() != 0.0 || !(0.0..=MOST_COUNT).contains(&number) {
            return Err((self.line, format!("{number} is not {what}")));
        }
        Ok(number as usize)
    }

    fn coordinate(&mut self, what: &str) -> Result<f64, (usize, String)> {
        coordinate(self.number(what)?).map_err(|message| (self.line, message))
    }

    fn point(&mut self, what: &str) -> Result<Point, (usize, String)> {
        Ok(Point::new(self.coordinate(what)?, self.coordinate(what)?, self.coordinate(what)?))
    }

    fn size(&mut self) -> Result<f64, (usize, String)> {
        let size = self.number("a size")?;
        if size <= 0.0 {
            return Err((self.line, format!("the size {size} is not positive")));
        }
        if size < self.least {
            let least = self.least;
            let reason = format!(
                "the size {size:?} is below {least:.1e}, the smallest that coordinates of the geometry resolve"
            );
            return Err((self.line, reason));
        }
        Ok(size)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_and_lines_become_sources() {
        let sources = parse("2 # points\n0 0 0 0.1\n1 0\n0 0.5\n1\n0 0 0  0 3 0  1\n", 0.0).unwrap();
        assert_eq!(sources.len(), 2 + 4);
        assert_eq!(sources[1], Source { point: Point::new(1.0, 0.0, 0.0), size: 0.5 });
        assert_eq!(sources[4], Source { point: Point::new(0.0, 2.0, 0.0), size: 1.0 });
        assert_eq!(parse("1\n0 0 0 1", 0.0).unwrap().len(), 1);
    }

    #[test]
    fn errors_have_their_line() {
        let cases = [
            ("", 1, "ends before the number of points"),
            ("2.5", 1, "2.5 is not the number of points"),
            ("1\n0 0 x 1", 2, "expected a point, found `x`"),
            ("1\n0 0 0\n0", 3, "0 is not positive"),
            ("1\n0 0 0 inf", 2, "expected a size, found `inf`"),
            ("1\n0 0\n0 1e-200", 3, "1e-200 is below 1.0e-14"),
            ("2\n0 0 0 1\n0 0", 3, "ends before a point"),
            ("0\n1\n0 0 0 1 0 0 1e-13", 3, "too small"),
            ("0\n1\n0 0 0 6 0 0 1e-5\n", 3, "200000 points"),
            ("1\n0 0 1e999 1\n", 2, "found `1e999`"),
            ("1\n0 0 1e61 1\n", 2, "larger than 1e60"),
            ("0\n0\n\n7", 4, "unexpected `7` after"),
        ];
        for (text, line, reason) in cases {
            let (found, said) = parse(text, 1e-14).unwrap_err();
            assert!(found == line && said.contains(reason), "{text:?}: line {found}, {said}");
        }
    }
}
