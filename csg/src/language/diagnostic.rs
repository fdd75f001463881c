//! Diagnostics of a `.geo` file: position, message and help.

use std::fmt;

use crate::geometry::Span;

/// The kind of a diagnostic. All except [`Kind::Warning`] prevent a geometry.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// The text violates the grammar.
    Syntax,
    /// The text follows the grammar but is invalid: an unknown name, a sphere of radius zero.
    Meaning,
    /// The text is valid, but describes something that cannot be meshed yet.
    Unsupported,
    /// There is a geometry, but perhaps not the intended one.
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

/// One diagnostic at one position of a file.
///
/// ```text
/// ball.geo:3:14: error: `sphere` needs a positive radius, not 0.0
///     3 | solid ball = sphere (0, 0, 0; 0);
///       |              ^
///       = help: radii are lengths from 1e-60 to 1e60
/// ```
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Diagnostic {
    /// The kind.
    pub kind: Kind,
    /// The name of the file, as passed by the caller.
    pub file: String,
    /// The position.
    pub span: Span,
    /// What is wrong: one sentence without a period.
    pub message: String,
    /// How to correct it.
    pub help: Option<String>,
    /// The source line at the position.
    pub source_line: String,
}

/// Longest excerpt of a source line in characters; a file may be a single line of megabytes.
const SHOWN_CHARACTERS: usize = 100;
/// Longest word of a message in characters: a number may have a million digits.
const LONGEST_WORD: usize = 60;
/// Number of characters before the position in the excerpt of a long line.
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

/// The excerpt of `line` around `column`, and the blanks that place a caret under it.
///
/// Tabs are kept, so that the caret is right for any tab width.
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

/// A text whose long words are cut.
fn with_short_words(text: &str) -> String {
    let shortened = |word: &str| match word.char_indices().nth(LONGEST_WORD) {
        None => word.to_owned(),
        Some(_) => {
            let (begin, end) = (word.chars().take(LONGEST_WORD / 2), word.chars().next_back());
            let end = end.filter(|c| !c.is_alphanumeric());
            format!("{}...{}", begin.collect::<String>(), end.map_or_else(String::new, String::from))
        }
    };
    text.split(' ').map(shortened).collect::<Vec<_>>().join(" ")
}

/// The diagnostics of an invalid file; at least one is not a warning.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Diagnostics {
    /// All diagnostics, in file order.
    pub messages: Vec<Diagnostic>,
}

impl Diagnostics {
    /// The diagnostics that are not warnings.
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

/// Largest number of reported errors per file; later ones are mostly consequences.
const MOST_ERRORS: usize = 20;
/// Largest number of reported warnings per file.
const MOST_WARNINGS: usize = 100;

/// Collects the diagnostics of all stages.
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

/// Marks a failure that is already in the [`Report`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Reported;

impl Report {
    /// Adds a diagnostic; returns the error value for `return Err(report.add(..))`.
    pub fn add(&mut self, kind: Kind, span: Span, message: impl Into<String>, help: &str) -> Reported {
        let (count, most) = match kind {
            Kind::Warning => (&mut self.warnings, MOST_WARNINGS),
            _ => (&mut self.errors, MOST_ERRORS),
        };
        *count += 1;
        if *count <= most {
            let help = (!help.is_empty()).then(|| help.to_owned());
            self.notes.push(Note { kind, span, message: with_short_words(&message.into()), help });
        }
        Reported
    }

    /// Adds a syntax error.
    pub fn syntax(&mut self, span: Span, message: impl Into<String>, help: &str) -> Reported {
        self.add(Kind::Syntax, span, message, help)
    }

    /// Adds an error of meaning.
    pub fn meaning(&mut self, span: Span, message: impl Into<String>, help: &str) -> Reported {
        self.add(Kind::Meaning, span, message, help)
    }

    /// Adds an error for something valid that cannot be meshed yet.
    pub fn unsupported(&mut self, span: Span, message: impl Into<String>, help: &str) -> Reported {
        self.add(Kind::Unsupported, span, message, help)
    }

    /// Adds a warning.
    pub fn warn(&mut self, span: Span, message: impl Into<String>, help: &str) {
        self.add(Kind::Warning, span, message, help);
    }

    /// Whether anything other than warnings was added.
    pub fn has_errors(&self) -> bool {
        self.errors > 0
    }

    /// Whether the limit of errors is exceeded.
    pub fn is_full(&self) -> bool {
        self.errors > MOST_ERRORS
    }

    /// The diagnostics in file order, each with its line of `source`.
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
            help: Some("correct it".into()),
            source_line: source_line.into(),
        }
    }

    #[test]
    fn a_message_shows_place_line_caret_and_help() {
        let text = diagnostic(5, "tlo x;").to_string();
        let expected =
            "a.geo:7:5: error: it is wrong\n    7 | tlo x;\n      |     ^\n      = help: correct it";
        assert_eq!(text, expected);
    }

    #[test]
    fn tabs_before_the_caret_stay_tabs() {
        assert!(diagnostic(3, "\t\tx").to_string().contains("      | \t\t^"));
    }

    #[test]
    fn a_very_long_line_is_shown_around_the_position() {
        let line = "x".repeat(5000) + "!" + &"y".repeat(5000);
        let text = diagnostic(5001, &line).to_string();
        let lines: Vec<&str> = text.lines().collect();
        let caret = lines[2].chars().position(|c| c == '^').unwrap();
        assert_eq!(lines[1].chars().nth(caret), Some('!'));
        assert!(lines[1].len() < 120);
    }

    #[test]
    fn long_words_of_messages_are_cut() {
        let text = format!("the number {} is too large: `{}`", "9".repeat(1_000_000), "a".repeat(100));
        let expected = format!("the number {}... is too large: `{}...`", "9".repeat(30), "a".repeat(29));
        assert_eq!(with_short_words(&text), expected);
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
