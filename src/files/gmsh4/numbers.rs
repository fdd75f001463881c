//! Numbers as text or in binary.

use super::Storage;
use crate::files::text::Line;

/// Appends numbers to bytes: as lines of text, or in binary with the lowest byte first.
pub(super) struct Numbers<'a> {
    storage: Storage,
    bytes: &'a mut Vec<u8>,
    line: Line,
    begun: bool,
}

impl<'a> Numbers<'a> {
    pub fn new(storage: Storage, bytes: &'a mut Vec<u8>) -> Self {
        Self { storage, bytes, line: Line::default(), begun: false }
    }

    /// Appends a number that takes four bytes in binary.
    pub fn int(&mut self, number: u32) -> &mut Self {
        match self.storage {
            Storage::Text => self.text(|line| _ = line.int(number.into())),
            Storage::Binary => self.bytes.extend(number.to_le_bytes()),
        }
        self
    }

    /// Appends a number that takes eight bytes in binary.
    pub fn size(&mut self, number: u64) -> &mut Self {
        match self.storage {
            Storage::Text => self.text(|line| _ = line.int(number)),
            Storage::Binary => self.bytes.extend(number.to_le_bytes()),
        }
        self
    }

    pub fn float(&mut self, number: f64) -> &mut Self {
        match self.storage {
            Storage::Text => self.text(|line| _ = line.float(number)),
            Storage::Binary => self.bytes.extend(number.to_le_bytes()),
        }
        self
    }

    /// Ends a line of text.
    pub fn end(&mut self) {
        if self.storage == Storage::Text {
            self.line.end(self.bytes);
            self.begun = false;
        }
    }

    fn text(&mut self, append: impl FnOnce(&mut Line)) {
        if self.begun {
            self.line.blank();
        }
        append(&mut self.line);
        // Lists of numbers can be longer than a line under construction.
        self.line.move_to(self.bytes);
        self.begun = true;
    }
}

/// The line that ends a section. Binary data does not end with a line.
pub(super) fn end_of(section: &str, storage: Storage) -> Vec<u8> {
    let before = if storage == Storage::Binary { "\n" } else { "" };
    format!("{before}$End{section}\n").into_bytes()
}
