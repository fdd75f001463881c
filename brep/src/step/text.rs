//! The text of a STEP file.
//!
//! Source: ISO 10303-21:2016, clear text encoding of the exchange structure.

use crate::BrepError;
use std::collections::BTreeMap;

/// A value of an attribute.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Value<'a> {
    /// A reference to a record.
    Id(u64),
    Number(f64),
    /// The characters between the apostrophes, not decoded.
    Text(&'a [u8]),
    /// A name between dots.
    Enum(&'a str),
    List(Vec<Value<'a>>),
    /// A value with the name of its type.
    Typed(&'a str, Vec<Value<'a>>),
    /// `$`, `*`, or binary data.
    Unset,
}

/// The attributes that one type gives to a record.
#[derive(Clone, Debug)]
pub(super) struct Part<'a> {
    pub name: &'a str,
    pub values: Vec<Value<'a>>,
}

/// A record `#id = …;` of one part, or of several in parentheses.
#[derive(Clone, Debug)]
pub(super) struct Record<'a> {
    /// The line where it starts, from 1.
    pub line: usize,
    pub parts: Vec<Part<'a>>,
}

/// All records of the data sections by their ids.
pub(super) type Records<'a> = BTreeMap<u64, Record<'a>>;

/// Lists may be nested this deep.
const DEEPEST: usize = 32;

/// Reads the records of a file.
///
/// # Errors
/// [`BrepError::Syntax`] with the line.
pub(super) fn read(text: &[u8]) -> Result<Records<'_>, BrepError> {
    let mut scanner = Scanner { text, at: 0, line: 1 };
    if scanner.name().ok() != Some("ISO-10303-21") {
        return Err(scanner.error("this is no STEP file: it does not start with `ISO-10303-21;`"));
    }
    let mut records = Records::new();
    while scanner.skip_to_data()? {
        while let Some((id, record)) = scanner.record()? {
            let line = record.line;
            if records.insert(id, record).is_some() {
                return Err(BrepError::Syntax { line, what: format!("#{id} is defined twice") });
            }
        }
    }
    Ok(records)
}

struct Scanner<'a> {
    text: &'a [u8],
    at: usize,
    line: usize,
}

impl<'a> Scanner<'a> {
    fn error(&self, what: &str) -> BrepError {
        BrepError::Syntax { line: self.line, what: what.to_owned() }
    }

    /// The next character after spaces and comments.
    fn peek(&mut self) -> Option<u8> {
        loop {
            match self.text.get(self.at)? {
                b'\n' => {
                    self.line += 1;
                    self.at += 1;
                }
                c if c.is_ascii_whitespace() || *c == 0 => self.at += 1,
                b'/' if self.text.get(self.at + 1) == Some(&b'*') => {
                    let rest = &self.text[self.at + 2..];
                    let length = rest.windows(2).position(|w| w == b"*/").unwrap_or(rest.len());
                    let end = (self.at + length + 4).min(self.text.len());
                    self.line += self.text[self.at..end].iter().filter(|c| **c == b'\n').count();
                    self.at = end;
                }
                c => return Some(*c),
            }
        }
    }

    fn expect(&mut self, wanted: u8) -> Result<(), BrepError> {
        match self.peek() {
            Some(c) if c == wanted => {
                self.at += 1;
                Ok(())
            }
            Some(c) => {
                let (wanted, c) = (wanted as char, c.escape_ascii());
                Err(self.error(&format!("`{wanted}` is expected, not `{c}`")))
            }
            None => Err(self.error("the file ends too early")),
        }
    }

    /// The characters from here on that satisfy a condition.
    fn run(&mut self, is_part: impl Fn(u8) -> bool) -> &'a [u8] {
        let rest = &self.text[self.at..];
        let length = rest.iter().position(|&c| !is_part(c)).unwrap_or(rest.len());
        self.at += length;
        &rest[..length]
    }

    /// The name of a section or type.
    fn name(&mut self) -> Result<&'a str, BrepError> {
        self.peek();
        let name = self.run(|c| c.is_ascii_alphanumeric() || matches!(c, b'_' | b'-' | b'!'));
        match std::str::from_utf8(name) {
            Ok(name) if !name.is_empty() => Ok(name),
            _ => Err(self.error("a name is expected")),
        }
    }

    fn digits(&mut self) -> Result<u64, BrepError> {
        let digits = std::str::from_utf8(self.run(|c| c.is_ascii_digit())).unwrap_or_default();
        digits.parse().map_err(|_| self.error("`#` must be followed by a number"))
    }

    /// Skips to the records of the next data section; `false` at the end of the file.
    fn skip_to_data(&mut self) -> Result<bool, BrepError> {
        loop {
            match self.peek() {
                None => return Err(self.error("the file ends without `END-ISO-10303-21;`: it is incomplete")),
                Some(b'\'') => drop(self.string()?),
                Some(b';' | b'(' | b')') => self.at += 1,
                Some(c) if c.is_ascii_alphabetic() => match self.name()? {
                    "DATA" => {
                        if self.peek() == Some(b'(') {
                            self.list(DEEPEST)?;
                        }
                        return self.expect(b';').map(|()| true);
                    }
                    "END-ISO-10303-21" => return Ok(false),
                    _ => {}
                },
                Some(_) => self.at += 1,
            }
        }
    }

    /// The next record; `None` at the end of the section.
    fn record(&mut self) -> Result<Option<(u64, Record<'a>)>, BrepError> {
        match self.peek() {
            Some(b'#') => self.at += 1,
            _ => {
                let name = self.name()?;
                if name != "ENDSEC" {
                    return Err(self.error(&format!("`#` or `ENDSEC` is expected, not `{name:.40}`")));
                }
                return self.expect(b';').map(|()| None);
            }
        }
        let line = self.line;
        let id = self.digits()?;
        self.expect(b'=')?;
        let mut parts = Vec::new();
        if self.peek() == Some(b'(') {
            self.at += 1;
            while self.peek() != Some(b')') {
                parts.push(self.part()?);
            }
            self.at += 1;
        } else {
            parts.push(self.part()?);
        }
        self.expect(b';')?;
        Ok(Some((id, Record { line, parts })))
    }

    fn part(&mut self) -> Result<Part<'a>, BrepError> {
        let name = self.name()?;
        Ok(Part { name, values: self.list(DEEPEST)? })
    }

    fn list(&mut self, depth: usize) -> Result<Vec<Value<'a>>, BrepError> {
        if depth == 0 {
            return Err(self.error(&format!("lists are nested more than {DEEPEST} deep")));
        }
        self.expect(b'(')?;
        let mut values = Vec::new();
        if self.peek() == Some(b')') {
            self.at += 1;
            return Ok(values);
        }
        loop {
            values.push(self.value(depth)?);
            match self.peek() {
                Some(b',') => self.at += 1,
                _ => return self.expect(b')').map(|()| values),
            }
        }
    }

    fn value(&mut self, depth: usize) -> Result<Value<'a>, BrepError> {
        match self.peek() {
            None => Err(self.error("the file ends too early")),
            Some(b'#') => {
                self.at += 1;
                Ok(Value::Id(self.digits()?))
            }
            Some(b'\'') => Ok(Value::Text(self.string()?)),
            Some(b'"') => {
                self.at += 1;
                self.run(|c| c != b'"');
                self.expect(b'"').map(|()| Value::Unset)
            }
            Some(b'.') => {
                self.at += 1;
                let name = self.name()?;
                self.expect(b'.').map(|()| Value::Enum(name))
            }
            Some(b'$' | b'*') => {
                self.at += 1;
                Ok(Value::Unset)
            }
            Some(b'(') => Ok(Value::List(self.list(depth - 1)?)),
            Some(c) if c.is_ascii_digit() || matches!(c, b'+' | b'-') => {
                let word = self.run(|c| c.is_ascii_alphanumeric() || matches!(c, b'+' | b'-' | b'.'));
                let word = std::str::from_utf8(word).unwrap_or_default();
                match word.parse::<f64>() {
                    Ok(number) if number.is_finite() => Ok(Value::Number(number)),
                    _ => Err(self.error(&format!("`{word:.40}` is no number"))),
                }
            }
            Some(_) => {
                let name = self.name()?;
                Ok(Value::Typed(name, self.list(depth - 1)?))
            }
        }
    }

    /// The characters between two apostrophes; a double apostrophe does not end them.
    fn string(&mut self) -> Result<&'a [u8], BrepError> {
        let start = self.at + 1;
        let mut end = start;
        loop {
            match (self.text.get(end), self.text.get(end + 1)) {
                (None, _) => return Err(self.error("a text does not end")),
                (Some(b'\''), Some(b'\'')) => end += 2,
                (Some(b'\''), _) => break,
                (Some(b'\n'), _) => {
                    self.line += 1;
                    end += 1;
                }
                _ => end += 1,
            }
        }
        self.at = end + 1;
        Ok(&self.text[start..end])
    }
}

/// A text with its escapes replaced: apostrophes, pages of ISO 8859, and UTF-16 or UTF-32 in
/// hexadecimal digits. What is no valid escape stays as it is.
pub(super) fn decoded(text: &[u8]) -> String {
    let mut out = String::new();
    let mut rest = text;
    while let Some(&c) = rest.first() {
        let (decoded, length) = match rest {
            [b'\'', b'\'', ..] => ("'".to_owned(), 2),
            [b'\\', b'\\', ..] => ("\\".to_owned(), 2),
            [b'\\', b'S', b'\\', c, ..] if c.is_ascii() => (char::from(c | 0x80).to_string(), 4),
            [b'\\', b'X', b'\\', ..] if rest.len() >= 5 => match hex(&rest[3..5], 2) {
                Some(text) => (text, 5),
                None => ("\\".to_owned(), 1),
            },
            [b'\\', b'X', width @ (b'2' | b'4'), b'\\', ..] => {
                let digits = if *width == b'2' { 4 } else { 8 };
                let end = rest.windows(4).position(|w| w == br"\X0\");
                match end.and_then(|end| Some((hex(rest.get(4..end)?, digits)?, end + 4))) {
                    Some(decoded) => decoded,
                    None => ("\\".to_owned(), 1),
                }
            }
            // Line breaks inside of texts have no meaning.
            [b'\n' | b'\r', ..] => (String::new(), 1),
            _ if c.is_ascii() => (char::from(c).to_string(), 1),
            // Many programs write UTF-8, others ISO 8859-1.
            _ => match rest.utf8_chunks().next().map(|chunk| chunk.valid()) {
                Some(valid) if !valid.is_empty() => {
                    let first = valid.chars().next().unwrap_or_default();
                    (first.to_string(), first.len_utf8())
                }
                _ => (char::from(c).to_string(), 1),
            },
        };
        out.push_str(&decoded);
        rest = &rest[length..];
    }
    out
}

/// The characters of groups of hexadecimal digits.
fn hex(digits: &[u8], width: usize) -> Option<String> {
    let text = std::str::from_utf8(digits).ok()?;
    let groups = digits
        .chunks(width)
        .enumerate()
        .map(|(k, group)| u32::from_str_radix(text.get(k * width..k * width + group.len())?, 16).ok());
    let codes: Vec<u32> = groups.collect::<Option<_>>()?;
    if width == 4 {
        let units: Vec<u16> = codes.into_iter().map(|code| code as u16).collect();
        return String::from_utf16(&units).ok();
    }
    codes.into_iter().map(char::from_u32).collect()
}
