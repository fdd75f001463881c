//! Messages about a `.geo` file: where, what, and what to do.

use std::fmt;

use crate::geometry::Span;

/// What a message is about; all but [`Kind::Warning`] mean that there is no geometry.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// The text does not follow the grammar.
    Syntax,
    /// The text follows the grammar, but means nothing: an unknown name, a sphere without a radius.
    Meaning,
    /// The text is right, but what it asks for cannot be meshed yet.
    Unsupported,
    /// The geometry is made, perhaps not as the author thinks.
    Warning,
}

impl Kind {
    fn label(self) -> &'static str {
        match self {
            Kind::Syntax | Kind::Meaning => "error",
            Kind::Unsupported => "not meshed yet",
            Kind::Warning => "warning",
        }
    }
}

/// One message about one place of a file.
///
/// ```text
/// ball.geo:3:14: error: `sphere` needs a positive radius, not 0.0
///     3 | solid ball = sphere (0, 0, 0; 0);
///       |              ^
///       = help: radii are lengths from 1e-60 to 1e60
/// ```
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Diagnostic {
    /// What it is about.
    pub kind: Kind,
    /// The file's name, as the caller gave it.
    pub file: String,
    /// The place.
    pub span: Span,
    /// What is wrong: one sentence without a full stop.
    pub message: String,
    /// What to do about it.
    pub help: Option<String>,
    /// The line of the file that has the place.
    pub source_line: String,
}

/// Longest piece of a source line that is shown, in characters: a file may be a single line of megabytes.
const SHOWN_CHARACTERS: usize = 100;
/// How many of them stand before the place in a line that is too long.
const SHOWN_BEFORE: usize = 60;

impl fmt::Display for Diagnostic {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Span { line, column } = self.span;
        writeln!(f, "{}:{line}:{column}: {}: {}", self.file, self.kind.label(), self.message)?;
        let (shown, before) = shown_piece(&self.source_line, column);
        writeln!(f, "{line:>5} | {}", shown.trim_end())?;
        write!(f, "      | {before}^")?;
        if let Some(help) = &self.help {
            write!(f, "\n      = help: {help}")?;
        }
        Ok(())
    }
}

/// The piece of `line` to show for `column`, and the blanks that bring a caret under it (tabs stay tabs, so
/// that the caret is right whatever the width of a tab).
fn shown_piece(line: &str, column: u32) -> (String, String) {
    let at = column.max(1) as usize - 1;
    let long = line.chars().nth(SHOWN_CHARACTERS).is_some();
    let first = if long { at.saturating_sub(SHOWN_BEFORE) } else { 0 };
    let printable = |c: char| if c.is_control() && c != '\t' { ' ' } else { c };
    let mut shown = String::from(if first > 0 { "..." } else { "" });
    let mut before: String = shown.chars().map(|_| ' ').collect();
    shown.extend(line.chars().skip(first).take(SHOWN_CHARACTERS).map(printable));
    before.extend(line.chars().skip(first).take(at - first).map(|c| if c == '\t' { '\t' } else { ' ' }));
    (shown, before)
}

/// Why a file gives no geometry: at least one message that is not a warning.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Diagnostics {
    /// All messages, in file order.
    pub messages: Vec<Diagnostic>,
}

impl Diagnostics {
    /// Whether nothing is wrong with the file but that it asks for what cannot be meshed yet.
    pub fn is_unsupported(&self) -> bool {
        self.errors().all(|message| message.kind == Kind::Unsupported)
    }

    /// The messages that are not warnings.
    pub fn errors(&self) -> impl Iterator<Item = &Diagnostic> {
        self.messages.iter().filter(|message| message.kind != Kind::Warning)
    }
}

impl fmt::Display for Diagnostics {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (i, message) in self.messages.iter().enumerate() {
            let separator = if i == 0 { "" } else { "\n" };
            write!(f, "{separator}{message}")?;
        }
        Ok(())
    }
}

impl std::error::Error for Diagnostics {}

/// Most errors that are reported of one file; later ones mostly follow from earlier ones.
const MOST_ERRORS: usize = 20;
/// Most warnings that are reported of one file.
const MOST_WARNINGS: usize = 100;

/// Collects the messages of all stages.
#[derive(Debug, Default)]
pub(super) struct Report {
    notes: Vec<Note>,
    errors: usize,
    warnings: usize,
}

#[derive(Debug)]
struct Note {
    kind: Kind,
    span: Span,
    message: String,
    help: Option<String>,
}

/// A failure that [`Report`] knows already.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Reported;

impl Report {
    /// Adds a message; returned as an error so that callers may `return Err(report.error(..))`.
    pub fn add(&mut self, kind: Kind, span: Span, message: impl Into<String>, help: &str) -> Reported {
        let (count, most) = match kind {
            Kind::Warning => (&mut self.warnings, MOST_WARNINGS),
            _ => (&mut self.errors, MOST_ERRORS),
        };
        *count += 1;
        if *count <= most {
            let help = (!help.is_empty()).then(|| help.to_owned());
            self.notes.push(Note { kind, span, message: message.into(), help });
        }
        Reported
    }

    /// Adds an error of the grammar.
    pub fn syntax(&mut self, span: Span, message: impl Into<String>, help: &str) -> Reported {
        self.add(Kind::Syntax, span, message, help)
    }

    /// Adds an error of what the text means.
    pub fn meaning(&mut self, span: Span, message: impl Into<String>, help: &str) -> Reported {
        self.add(Kind::Meaning, span, message, help)
    }

    /// Adds a refusal of something right.
    pub fn unsupported(&mut self, span: Span, message: impl Into<String>, help: &str) -> Reported {
        self.add(Kind::Unsupported, span, message, help)
    }

    /// Adds a warning.
    pub fn warn(&mut self, span: Span, message: impl Into<String>, help: &str) {
        self.add(Kind::Warning, span, message, help);
    }

    /// Whether anything but warnings was added.
    pub fn has_errors(&self) -> bool {
        self.errors > 0
    }

    /// Whether more errors make no sense.
    pub fn is_full(&self) -> bool {
        self.errors > MOST_ERRORS
    }

    /// The messages in file order, each with its line of `source`.
    pub fn finish(mut self, source: &str, file: &str) -> Vec<Diagnostic> {
        if self.errors > MOST_ERRORS
            && let Some(last) = self.notes.iter_mut().rfind(|note| note.kind != Kind::Warning)
        {
            last.help = Some(format!("there are more than {MOST_ERRORS} errors; the others are not shown"));
        }
        self.notes.sort_by_key(|note| (note.span.line, note.span.column));
        let lines: Vec<&str> = super::token::lines(source).collect();
        let with_line = |note: Note| Diagnostic {
            kind: note.kind,
            file: file.to_owned(),
            span: note.span,
            message: note.message,
            help: note.help,
            source_line: lines.get(note.span.line as usize - 1).copied().unwrap_or_default().to_owned(),
        };
        self.notes.into_iter().map(with_line).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn diagnostic(column: u32, source_line: &str) -> Diagnostic {
        Diagnostic {
            kind: Kind::Meaning,
            file: "a.geo".into(),
            span: Span { line: 7, column },
            message: "it is wrong".into(),
            help: Some("mend it".into()),
            source_line: source_line.into(),
        }
    }

    #[test]
    fn a_message_shows_place_line_caret_and_help() {
        let text = diagnostic(5, "tlo x;").to_string();
        let expected = "a.geo:7:5: error: it is wrong\n    7 | tlo x;\n      |     ^\n      = help: mend it";
        assert_eq!(text, expected);
    }

    #[test]
    fn tabs_before_the_caret_stay_tabs() {
        assert!(diagnostic(3, "\t\tx").to_string().contains("      | \t\t^"));
    }

    #[test]
    fn of_a_very_long_line_the_piece_around_the_place_is_shown() {
        let line = "x".repeat(5000) + "!" + &"y".repeat(5000);
        let text = diagnostic(5001, &line).to_string();
        let lines: Vec<&str> = text.lines().collect();
        let caret = lines[2].chars().position(|c| c == '^').unwrap();
        assert_eq!(lines[1].chars().nth(caret), Some('!'));
        assert!(lines[1].len() < 120);
    }

    #[test]
    fn errors_past_the_limit_are_counted_but_not_kept() {
        let mut report = Report::default();
        for line in 1..=100 {
            report.syntax(Span { line, column: 1 }, "wrong", "");
        }
        let messages = report.finish("", "a.geo");
        assert_eq!(messages.len(), MOST_ERRORS);
        assert!(messages.last().unwrap().help.as_ref().unwrap().contains("more than 20 errors"));
    }
}
