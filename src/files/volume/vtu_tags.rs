//! The tags of VTK's XML files, and their nesting.
//!
//! They are parsed by hand, because a file with raw appended data is not well-formed XML. A file
//! that was cut off or put together wrongly is found by its tags: each must be closed, in its
//! place.

use crate::files::input::{Fault, shown};

/// Start of a comment with fields: MFEM's reader accepts fields nowhere else (see `files::vtu`).
const HIDDEN_FIELDS: &[u8] = b"<!-- <FieldData>";

/// A tag that opens an element: its name, attributes, and range in the file.
pub(super) struct Tag<'a> {
    pub name: &'a str,
    attributes: &'a str,
    pub begin: usize,
    pub end: usize,
    /// The name of the element around it; empty for the outermost.
    pub parent: &'a str,
}

impl Tag<'_> {
    /// The value of an attribute with XML references resolved.
    pub fn text(&self, name: &str) -> Option<String> {
        self.attribute(name).map(unescaped)
    }

    pub fn attribute(&self, name: &str) -> Option<&str> {
        let mut rest = self.attributes;
        while let Some((before, after)) = rest.split_once('=') {
            let quote = after.trim_start().chars().next().filter(|c| *c == '"' || *c == '\'')?;
            let (value, behind) = after.trim_start()[1..].split_once(quote)?;
            if before.trim() == name {
                return Some(value);
            }
            rest = behind;
        }
        None
    }

    /// The value of an attribute that is a count.
    ///
    /// # Errors
    /// If it is missing or no whole number.
    pub fn count(&self, name: &str) -> Result<u64, Fault> {
        let value = self.attribute(name);
        let value = value.ok_or_else(|| self.fault(format!("`{}` has no attribute {name}", self.name)))?;
        let count = value.trim().parse().ok();
        count.ok_or_else(|| self.fault(format!("{name} is no whole number: `{}`", shown(value.as_bytes()))))
    }

    /// A fault at this tag.
    pub fn fault(&self, message: impl Into<String>) -> Fault {
        Fault::text(self.begin, message)
    }
}

/// Resolves XML references; invalid ones are kept as text.
fn unescaped(text: &str) -> String {
    let mut plain = String::with_capacity(text.len());
    let mut rest = text;
    while let Some((before, after)) = rest.split_once('&') {
        plain.push_str(before);
        let reference = after.split_once(';').and_then(|(name, behind)| Some((character(name)?, behind)));
        match reference {
            Some((c, behind)) => {
                plain.push(c);
                rest = behind;
            }
            None => {
                plain.push('&');
                rest = after;
            }
        }
    }
    plain + rest
}

/// The character of the reference `&name;`.
fn character(name: &str) -> Option<char> {
    let code = |digits: &str, radix| u32::from_str_radix(digits, radix).ok().and_then(char::from_u32);
    match name {
        "amp" => Some('&'),
        "lt" => Some('<'),
        "gt" => Some('>'),
        "quot" => Some('"'),
        "apos" => Some('\''),
        _ => match name.strip_prefix('#')? {
            digits if digits.starts_with(['x', 'X']) => code(&digits[1..], 16),
            digits => code(digits, 10),
        },
    }
}

/// What is between `<` and `>`, and its range in the file.
struct Mark<'a> {
    text: &'a str,
    begin: usize,
    end: usize,
}

/// The tags of a file in order; checks that each element is closed in its place.
pub(super) struct Tags<'a> {
    content: &'a [u8],
    at: usize,
    /// The elements around the next tag, outermost first, with their places.
    open: Vec<(&'a str, usize)>,
    /// Whether the outermost element is closed.
    is_complete: bool,
}

impl<'a> Tags<'a> {
    pub fn new(content: &'a [u8]) -> Self {
        Self { content, at: 0, open: Vec::new(), is_complete: false }
    }

    /// Continues at another offset, inside the same element.
    pub fn go_to(&mut self, offset: usize) {
        self.at = offset;
    }

    /// Returns the next tag that opens an element, `None` at the end of a complete file.
    /// Declarations and comments are skipped, except fields in a comment.
    ///
    /// # Errors
    /// A tag or element that is not closed, or closed in the wrong place; anything after the
    /// outermost element.
    pub fn next(&mut self) -> Result<Option<Tag<'a>>, Fault> {
        while let Some(mark) = self.mark()? {
            let name_of = |text: &'a str| text.split(char::is_whitespace).next().unwrap_or_default();
            if let Some(name) = mark.text.strip_prefix('/') {
                self.close(name_of(name), mark.begin)?;
                continue;
            }
            if self.is_complete {
                return Err(Fault::text(mark.begin, "the file goes on after its last element"));
            }
            let (text, is_empty) = match mark.text.strip_suffix('/') {
                Some(text) => (text, true),
                None => (mark.text, false),
            };
            let name = name_of(text);
            let parent = self.open.last().map_or("", |(name, _)| name);
            if !is_empty {
                self.open.push((name, mark.begin));
            } else if self.open.is_empty() {
                self.is_complete = true;
            }
            let attributes = &text[name.len()..];
            return Ok(Some(Tag { name, attributes, begin: mark.begin, end: mark.end, parent }));
        }
        match self.open.last() {
            Some((name, _)) => Err(self.cut_off(&format!("`</{name}>`"))),
            None => Ok(None),
        }
    }

    fn cut_off(&self, before: &str) -> Fault {
        Fault::text(self.content.len(), format!("the file ends before {before}: it is cut off"))
    }

    fn close(&mut self, name: &str, at: usize) -> Result<(), Fault> {
        match self.open.pop() {
            Some((open, _)) if open == name => {
                self.is_complete = self.open.is_empty();
                Ok(())
            }
            Some((open, _)) => Err(Fault::text(at, format!("expected `</{open}>`, found `</{name}>`"))),
            None => Err(Fault::text(at, format!("`</{name}>` closes nothing"))),
        }
    }

    /// Returns the next tag of either kind.
    fn mark(&mut self) -> Result<Option<Mark<'a>>, Fault> {
        let content = self.content;
        while let Some(length) = content[self.at..].iter().position(|&b| b == b'<') {
            self.refuse_text_outside(length)?;
            let begin = self.at + length;
            let rest = &content[begin..];
            if rest.starts_with(HIDDEN_FIELDS) {
                self.at = begin + 1;
            } else if rest.starts_with(b"<!--") {
                let length = rest.windows(3).position(|w| w == b"-->");
                self.at = begin + length.ok_or_else(|| self.cut_off("the end of a comment"))? + 3;
            } else {
                let end = begin + end_of_tag(rest).ok_or_else(|| self.cut_off("the end of a tag"))?;
                let text = std::str::from_utf8(&content[begin + 1..end - 1]);
                let text = text.map_err(|_| Fault::text(begin, "a tag that is not text in UTF-8"))?;
                self.at = end;
                if !text.starts_with(['?', '!']) {
                    return Ok(Some(Mark { text, begin, end }));
                }
            }
        }
        self.refuse_text_outside(content.len() - self.at)?;
        Ok(None)
    }

    /// Refuses text of this length outside the outermost element. A byte-order mark is none, nor is
    /// the end of a comment with fields.
    fn refuse_text_outside(&self, length: usize) -> Result<(), Fault> {
        let text = &self.content[self.at..self.at + length];
        let text = if self.at == 0 { text.strip_prefix(b"\xef\xbb\xbf").unwrap_or(text) } else { text };
        if self.open.is_empty() && !text.trim_ascii().is_empty() {
            let begin = self.at + length - text.trim_ascii_start().len();
            let what = shown(text.trim_ascii());
            return Err(Fault::text(begin, format!("expected `<`, found `{what}`: not a VTK file in XML")));
        }
        Ok(())
    }
}

/// The length of the tag at the start of a text; a `>` in quotes does not end it.
fn end_of_tag(text: &[u8]) -> Option<usize> {
    let mut quote = None;
    for (k, &b) in text.iter().enumerate() {
        match quote {
            Some(q) if b == q => quote = None,
            Some(_) => {}
            None if b == b'"' || b == b'\'' => quote = Some(b),
            None if b == b'>' => return Some(k + 1),
            None => {}
        }
    }
    None
}

/// Refuses an element of VTK's that is not where it belongs.
pub(super) fn check_place(tag: &Tag) -> Result<(), Fault> {
    let expected: &[&str] = match tag.name {
        "VTKFile" => &[""],
        "UnstructuredGrid" | "PUnstructuredGrid" | "AppendedData" => &["VTKFile"],
        "Piece" => &["UnstructuredGrid", "PUnstructuredGrid"],
        "Points" | "Cells" | "PointData" | "CellData" => &["Piece"],
        _ => return Ok(()),
    };
    if expected.contains(&tag.parent) {
        return Ok(());
    }
    let found = if tag.parent.is_empty() { "no element".into() } else { format!("`<{}>`", tag.parent) };
    Err(tag.fault(format!("`<{}>` is in {found}; it belongs in {}", tag.name, listed(expected))))
}

fn listed(names: &[&str]) -> String {
    match names {
        [""] => "none: it is the outermost".into(),
        _ => names.iter().map(|name| format!("`<{name}>`")).collect::<Vec<_>>().join(" or "),
    }
}

/// Refuses a VTK file of another type.
pub(super) fn check_type(tag: &Tag, wanted: &str) -> Result<(), Fault> {
    match tag.attribute("type").filter(|kind| *kind != wanted) {
        Some(kind) => Err(tag.fault(format!("a VTK file of type {kind}; {wanted} is needed"))),
        None => Ok(()),
    }
}
