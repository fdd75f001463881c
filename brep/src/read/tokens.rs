//! Words and numbers of a text, with their lines in errors.

use crate::{BrepError, Vector};
use nalgebra::SVector;

/// A text that is read word by word.
pub(super) struct Tokens<'a> {
    text: &'a [u8],
    at: usize,
    /// The line of the last word, from 1.
    pub line: usize,
}

impl<'a> Tokens<'a> {
    pub fn new(text: &'a [u8]) -> Self {
        Self { text, at: 0, line: 1 }
    }

    /// An error at the word just read.
    pub fn error(&self, what: &str) -> BrepError {
        BrepError::Syntax { line: self.line, what: what.to_owned() }
    }

    /// The next word.
    pub fn word(&mut self) -> Result<&'a str, BrepError> {
        let rest = &self.text[self.at..];
        let start = rest.iter().position(|c| !c.is_ascii_whitespace()).unwrap_or(rest.len());
        let length = rest[start..].iter().position(u8::is_ascii_whitespace).unwrap_or(rest.len() - start);
        if length == 0 {
            return Err(self.error("the file ends too early"));
        }
        self.line += rest[..start].iter().filter(|&&c| c == b'\n').count();
        self.at += start + length;
        std::str::from_utf8(&rest[start..start + length]).map_err(|_| self.error("a word is not text"))
    }

    /// The next word, which is not consumed.
    pub fn peek(&mut self) -> Result<&'a str, BrepError> {
        let (at, line) = (self.at, self.line);
        let word = self.word();
        (self.at, self.line) = (at, line);
        word
    }

    /// Skips the rest of the line.
    pub fn skip_line(&mut self) {
        let rest = &self.text[self.at..];
        self.at += rest.iter().position(|&c| c == b'\n').unwrap_or(rest.len());
    }

    pub fn expect(&mut self, wanted: &str) -> Result<(), BrepError> {
        match self.word()? {
            word if word == wanted => Ok(()),
            word => Err(self.error(&format!("`{wanted}` is expected, not `{word:.40}`"))),
        }
    }

    pub fn number(&mut self) -> Result<f64, BrepError> {
        let word = self.word()?;
        match word.parse::<f64>() {
            Ok(number) if number.is_finite() => Ok(number),
            _ => Err(self.error(&format!("a number is expected, not `{word:.40}`"))),
        }
    }

    pub fn integer(&mut self) -> Result<i64, BrepError> {
        let word = self.word()?;
        word.parse().map_err(|_| self.error(&format!("an integer is expected, not `{word:.40}`")))
    }

    /// A count of items that follow. Each takes two characters or more, so larger counts than the
    /// text can hold are refused.
    pub fn count(&mut self) -> Result<usize, BrepError> {
        let count = self.integer()?;
        let most = (self.text.len() - self.at) / 2 + 1;
        usize::try_from(count)
            .ok()
            .filter(|&count| count <= most)
            .ok_or_else(|| self.error(&format!("a count of {count} items does not fit the file")))
    }

    /// An index of at most `most`.
    pub fn index(&mut self, most: usize) -> Result<usize, BrepError> {
        let index = self.integer()?;
        usize::try_from(index)
            .ok()
            .filter(|&index| index <= most)
            .ok_or_else(|| self.error(&format!("there is no item {index}: the list has {most}")))
    }

    /// An index of at most `most`, which may be followed by a word without a space.
    pub fn index_before_word(&mut self, most: usize) -> Result<usize, BrepError> {
        let word = self.word()?;
        let digits = word.bytes().take_while(u8::is_ascii_digit).count();
        self.at -= word.len() - digits;
        word[..digits].parse().ok().filter(|&index| index <= most).ok_or_else(|| {
            self.error(&format!("`{word:.40}` does not start with an index of at most {most}"))
        })
    }

    /// A flag.
    pub fn flag(&mut self) -> Result<bool, BrepError> {
        Ok(self.integer()? != 0)
    }

    pub fn vector<const D: usize>(&mut self) -> Result<SVector<f64, D>, BrepError> {
        let mut vector = SVector::<f64, D>::zeros();
        for x in vector.iter_mut() {
            *x = self.number()?;
        }
        Ok(vector)
    }

    /// A vector of length one.
    pub fn unit<const D: usize>(&mut self) -> Result<SVector<f64, D>, BrepError> {
        let vector = self.vector::<D>()?;
        vector.try_normalize(1e-100).ok_or_else(|| self.error("a direction has no length"))
    }

    /// An origin, and the unit vectors z, x and y.
    pub fn frame(&mut self) -> Result<(Vector, [Vector; 3]), BrepError> {
        let origin = self.vector()?;
        let [z, x, y] = [self.unit()?, self.unit()?, self.unit()?];
        Ok((origin, [x, y, z]))
    }

    pub fn skip_numbers(&mut self, count: usize) -> Result<(), BrepError> {
        (0..count).try_for_each(|_| self.number().map(|_| ()))
    }

    /// A count, then as many items.
    pub fn list<T>(
        &mut self,
        mut item: impl FnMut(&mut Self) -> Result<T, BrepError>,
    ) -> Result<Vec<T>, BrepError> {
        let count = self.count()?;
        (0..count).map(|_| item(self)).collect()
    }
}
