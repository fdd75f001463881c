//! Splits text into words and numbers.

use super::{Fault, coordinate, shown};
use crate::Point;

/// The rest of a text: words separated by blanks and line ends, without comments.
#[derive(Clone)]
pub(crate) struct Words<'a> {
    text: &'a [u8],
    at: usize,
    /// The offset of the last word.
    last: usize,
    /// The character that starts a comment.
    comment: Option<u8>,
}

impl<'a> Words<'a> {
    /// A text without comments.
    pub fn new(text: &'a [u8]) -> Self {
        Self { text, at: 0, last: 0, comment: None }
    }

    /// A text with comments from `#` to the end of the line.
    pub fn with_comments(text: &'a [u8]) -> Self {
        Self { comment: Some(b'#'), ..Self::new(text) }
    }

    /// The offset of the next character.
    pub fn offset(&self) -> usize {
        self.at
    }

    /// Continues at another offset.
    pub fn go_to(&mut self, offset: usize) {
        self.at = offset.min(self.text.len());
        self.last = self.at;
    }

    /// The rest of the text.
    pub fn rest(&self) -> &'a [u8] {
        &self.text[self.at..]
    }

    fn take_word(&mut self) -> &'a [u8] {
        let rest = self.rest();
        let length = rest
            .iter()
            .position(|b| b.is_ascii_whitespace() || Some(*b) == self.comment)
            .unwrap_or(rest.len());
        self.last = self.at;
        self.at += length;
        &rest[..length]
    }

    /// Skips to the next word; with `within_line` not past the end of the line.
    fn skip_blanks(&mut self, within_line: bool) {
        while let Some(&b) = self.text.get(self.at) {
            if b == b'\n' && within_line {
                return;
            } else if b.is_ascii_whitespace() {
                self.at += 1;
            } else if Some(b) == self.comment {
                self.at += self.rest().iter().position(|&b| b == b'\n').unwrap_or(self.rest().len());
            } else {
                return;
            }
        }
    }

    /// Returns the next word.
    pub fn next(&mut self) -> Option<&'a [u8]> {
        self.skip_blanks(false);
        let word = self.take_word();
        (!word.is_empty()).then_some(word)
    }

    /// Returns the next word of this line.
    pub fn next_in_line(&mut self) -> Option<&'a [u8]> {
        self.skip_blanks(true);
        let word = self.take_word();
        (!word.is_empty()).then_some(word)
    }

    /// Returns the next word without consuming it.
    pub fn peek(&self) -> Option<&'a [u8]> {
        self.clone().next()
    }

    /// Returns the trimmed rest of the line, including comments, and continues on the next line.
    pub fn rest_of_line(&mut self) -> &'a [u8] {
        let rest = self.rest();
        let length = rest.iter().position(|&b| b == b'\n').unwrap_or(rest.len());
        self.last = self.at;
        self.at += (length + 1).min(rest.len());
        rest[..length].trim_ascii()
    }

    /// A fault at the last word.
    pub fn fault(&self, message: impl Into<String>) -> Fault {
        Fault::text(self.last, message)
    }

    /// Returns the next word, or a fault at the end of the text.
    pub fn word(&mut self, what: &str) -> Result<&'a [u8], Fault> {
        self.next().ok_or_else(|| Fault::text(self.text.len(), format!("the file ends before {what}")))
    }

    /// Checks that the next word is `expected`.
    pub fn expect(&mut self, expected: &str) -> Result<(), Fault> {
        let word = self.word(&format!("`{expected}`"))?;
        if word == expected.as_bytes() {
            return Ok(());
        }
        Err(self.fault(format!("expected `{expected}`, found `{}`", shown(word))))
    }

    /// Parses the next word as a finite number; also Fortran's `1.5D-3`.
    pub fn float(&mut self, what: &str) -> Result<f64, Fault> {
        let word = self.word(what)?;
        float(word)
            .ok_or_else(|| self.fault(format!("expected {what}, a finite number, found `{}`", shown(word))))
    }

    /// Parses the next three words as a point.
    pub fn point(&mut self, what: &str) -> Result<Point, Fault> {
        Ok(Point::new(self.coordinate(what)?, self.coordinate(what)?, self.coordinate(what)?))
    }

    fn coordinate(&mut self, what: &str) -> Result<f64, Fault> {
        coordinate(self.float(what)?).map_err(|message| self.fault(message))
    }

    /// Parses the next word as an integer.
    pub fn int(&mut self, what: &str) -> Result<i64, Fault> {
        let word = self.word(what)?;
        int(word)
            .ok_or_else(|| self.fault(format!("expected {what}, a whole number, found `{}`", shown(word))))
    }

    /// Parses the next word as the number of items that follow, each of at least `words_each`
    /// words.
    pub fn count(&mut self, what: &str, words_each: usize) -> Result<usize, Fault> {
        let count = self.int(&format!("the number of {what}"))?;
        // A word has at least two characters with the blank after it, which the last word may lack.
        let room = (self.rest().len() as u64).div_ceil(2) / words_each.max(1) as u64;
        match u64::try_from(count) {
            Ok(number) if number <= room => Ok(number as usize),
            Ok(number) => Err(self.fault(format!(
                "{number} {what} are announced, and what is left of the file has room for {room} at most: \
                 the number is wrong or the file is cut off"
            ))),
            Err(_) => Err(self.fault(format!("the number of {what} is negative: {count}"))),
        }
    }

    /// Parses the next word as a vertex number; the first of the `count` vertices has the number
    /// `base`.
    pub fn vertex(&mut self, base: i64, count: usize) -> Result<u32, Fault> {
        let number = self.int("the number of a vertex")?;
        match number.checked_sub(base) {
            Some(index) if (0..count as i64).contains(&index) => Ok(index as u32),
            _ => Err(self.fault(format!(
                "there is no vertex {number}: the vertices are {base} to {}",
                base + count as i64 - 1
            ))),
        }
    }

    /// Parses the next word as the number of a vertex that may be defined later; `base` is the
    /// first number.
    pub fn vertex_to_come(&mut self, base: i64) -> Result<u32, Fault> {
        let number = self.int("the number of a vertex")?;
        let index = number.checked_sub(base).and_then(|index| u32::try_from(index).ok());
        index.ok_or_else(|| self.fault(format!("there is no vertex {number}")))
    }
}

/// Parses an integer.
pub(crate) fn int(word: &[u8]) -> Option<i64> {
    let (negative, digits) = match word {
        [b'-', digits @ ..] => (true, digits),
        [b'+', digits @ ..] => (false, digits),
        digits => (false, digits),
    };
    if digits.is_empty() {
        return None;
    }
    let mut number = 0_i64;
    for &b in digits {
        let digit = i64::from(b.wrapping_sub(b'0'));
        if digit > 9 {
            return None;
        }
        number = number.checked_mul(10)?.checked_add(digit)?;
    }
    Some(if negative { -number } else { number })
}

/// Parses a finite number.
pub(crate) fn float(word: &[u8]) -> Option<f64> {
    let text = std::str::from_utf8(word).ok()?;
    let number: f64 = text.parse().or_else(|_| text.replace(['d', 'D'], "e").parse()).ok()?;
    number.is_finite().then_some(number)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn said<T: std::fmt::Debug>(result: Result<T, Fault>, text: &[u8]) -> String {
        result.unwrap_err().in_file("f".as_ref(), text).to_string()
    }

    #[test]
    fn words_end_at_blanks_and_comments() {
        let mut words = Words::with_comments(b"# head\n  a b# c\r\n\n d");
        assert_eq!(words.next(), Some(&b"a"[..]));
        assert_eq!(words.next_in_line(), Some(&b"b"[..]));
        assert_eq!(words.next_in_line(), None);
        assert_eq!(words.next(), Some(&b"d"[..]));
        assert_eq!(words.next(), None);
    }

    #[test]
    fn numbers_that_are_none_are_refused_with_their_line() {
        for word in ["nan", "inf", "1e999", "1.0.0", "x", "-"] {
            let text = format!("1\n{word} ");
            let mut words = Words::new(text.as_bytes());
            words.float("x").unwrap();
            let said = said(words.float("x"), text.as_bytes());
            assert!(said.starts_with("f:2: ") && said.contains(word), "{said}");
        }
        assert_eq!(Words::new(b"1.5D-3").float("x"), Ok(1.5e-3));
        for word in ["1.0", "", "-", "+-1", "99999999999999999999", "1e3"] {
            assert_eq!(int(word.as_bytes()), None, "{word}");
        }
        assert_eq!([&b"-12"[..], b"+7", b"0"].map(int), [Some(-12), Some(7), Some(0)]);
    }

    #[test]
    fn a_count_beyond_what_is_left_is_refused() {
        let text = b"3 1 2 3 4 5 6 7 8 9";
        assert_eq!(Words::new(text).count("points", 3), Ok(3));
        let said = said(Words::new(b"4 1 2 3 4 5 6 7 8 9").count("points", 3), text);
        assert!(said.contains("4 points are announced") && said.contains("room for 3"), "{said}");
        assert!(Words::new(b"-1").count("points", 3).is_err());
        assert!(Words::new(b"9223372036854775807 1").count("points", 0).is_err());
    }
}
