//! Splits text into tokens.

use super::diagnostic::Report;
use crate::geometry::Span;

/// The kind of a token.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum TokenKind<'a> {
    /// A keyword or a name.
    Word(&'a str),
    /// A number: finite and never negative (the sign is a separate token).
    Number(f64),
    /// One of `( ) [ ] - = , ;`.
    Mark(char),
    /// An invalid token, already reported.
    Bad,
    /// The end of the file.
    End,
}

/// A token and its position.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Token<'a> {
    pub kind: TokenKind<'a>,
    pub span: Span,
    /// The position behind its last character.
    pub end: Span,
}

/// The lines of a text, terminated by LF, CR LF or CR.
pub(super) fn lines(source: &str) -> impl Iterator<Item = &str> {
    source.split('\n').flat_map(|line| line.strip_suffix('\r').unwrap_or(line).split('\r'))
}

/// The tokens of a text; the last one is [`TokenKind::End`].
///
/// Comments extend from `#` to the end of the line. A byte-order mark is white space.
pub(super) fn tokenize<'a>(source: &'a str, report: &mut Report) -> Vec<Token<'a>> {
    let mut tokens = Vec::new();
    let mut end = Span { line: 1, column: 1 };
    for (line, text) in (1u32..).zip(lines(source)) {
        let mut scanner = Scanner { text, at: 0, span: Span { line, column: 1 } };
        while let Some(token) = scanner.next_token(&tokens, report) {
            tokens.push(token);
        }
        end = scanner.span;
    }
    tokens.push(Token { kind: TokenKind::End, span: end, end });
    tokens
}

/// Scans one line; no token extends across lines.
struct Scanner<'a> {
    text: &'a str,
    /// Number of bytes scanned.
    at: usize,
    /// Position of the next character.
    span: Span,
}

impl<'a> Scanner<'a> {
    fn rest(&self) -> &'a str {
        &self.text[self.at..]
    }

    /// Takes all following characters that satisfy `accept`.
    fn take_while(&mut self, accept: impl Fn(char) -> bool) -> &'a str {
        let rest = self.rest();
        let taken = &rest[..rest.find(|c| !accept(c)).unwrap_or(rest.len())];
        self.at += taken.len();
        self.span.column += taken.chars().count() as u32;
        taken
    }

    /// The next token of the line, which follows the tokens `before`.
    fn next_token(&mut self, before: &[Token<'a>], report: &mut Report) -> Option<Token<'a>> {
        self.take_while(is_blank);
        let span = self.span;
        let kind = match self.rest().chars().next()? {
            '#' => return None,
            c if c.is_alphabetic() => TokenKind::Word(self.take_while(continues_word)),
            c if c.is_ascii_digit() || c == '.' => self.number(report),
            quote @ ('"' | '\'') => {
                // Take the whole string, so that one mistake gives one message.
                self.take_one();
                let content = self.take_while(|c| c != quote);
                if self.rest().starts_with(quote) {
                    self.take_one();
                }
                report.syntax(span, "there are no quoted strings", &unquoted_help(before, content));
                TokenKind::Bad
            }
            c => {
                self.at += c.len_utf8();
                self.span.column += 1;
                if "()[]-=,;".contains(c) {
                    TokenKind::Mark(c)
                } else {
                    report.syntax(span, format!("unexpected character {c:?}"), stray_help(c));
                    TokenKind::Bad
                }
            }
        };
        Some(Token { kind, span, end: self.span })
    }

    /// Scans a number: digits, optional decimal point, optional exponent.
    fn number(&mut self, report: &mut Report) -> TokenKind<'a> {
        let span = self.span;
        let start = self.at;
        self.take_while(|c| c.is_ascii_digit());
        if self.rest().starts_with('.') {
            self.take_one();
            self.take_while(|c| c.is_ascii_digit());
        }
        if self.rest().starts_with(['e', 'E']) {
            self.take_one();
            if self.rest().starts_with(['+', '-']) {
                self.take_one();
            }
            self.take_while(|c| c.is_ascii_digit());
        }
        if self.rest().starts_with('.') {
            self.take_while(|c| c.is_ascii_digit() || c == '.');
        }
        let text = &self.text[start..self.at];
        match text.parse::<f64>() {
            Ok(value) if value.is_finite() => TokenKind::Number(value),
            Ok(_) => {
                report.syntax(
                    span,
                    format!("the number {text} is too large"),
                    "the largest is about 1.8e308",
                );
                TokenKind::Bad
            }
            Err(_) => {
                let help = "numbers look like 2, 0.5, .5, 1e-3 or 2.5E+4";
                report.syntax(span, format!("`{text}` is not a number"), help);
                TokenKind::Bad
            }
        }
    }

    fn take_one(&mut self) {
        self.at += 1;
        self.span.column += 1;
    }
}

/// The characters that C's `isspace` accepts within a line, and the byte-order mark.
fn is_blank(c: char) -> bool {
    matches!(c, ' ' | '\t' | '\u{b}' | '\u{c}' | '\u{feff}')
}

/// Whether a word can continue with `c`: a letter or digit of any script, `_`, or an accent that
/// follows its letter, as in names that were typed on a Mac.
fn continues_word(c: char) -> bool {
    c.is_alphanumeric() || c == '_' || matches!(c, '\u{300}'..='\u{36f}')
}

/// How to write the content of a quoted string that follows the tokens `before`.
fn unquoted_help(before: &[Token<'_>], content: &str) -> String {
    let content = content.trim();
    let is_word = content.starts_with(char::is_alphabetic);
    let word = if is_word {
        content.replace(|c: char| !continues_word(c), "_")
    } else if content.parse::<f64>().is_ok_and(f64::is_finite) {
        content.to_owned()
    } else {
        "WORD, a word of letters, digits and _ that begins with a letter".to_owned()
    };
    match before.last_chunk().map(|tokens| tokens.map(|token| token.kind)) {
        Some([TokenKind::Mark('-'), TokenKind::Word(flag), TokenKind::Mark('=')]) => {
            format!("write -{flag}={word}")
        }
        _ if word.starts_with("WORD") => format!("write {word}"),
        _ => format!("write {word} without quotes"),
    }
}

fn stray_help(c: char) -> &'static str {
    match c {
        '+' => "numbers take no leading +, and there is no arithmetic",
        '*' | '/' | '^' => "there is no arithmetic: write the value itself; a comment begins with #",
        '{' | '}' => "solids are grouped by ( )",
        '&' | '|' | '!' => "solids are combined by `and`, `or`, `not`",
        '_' => "names begin with a letter",
        '\u{fffd}' => "the file is not UTF-8: save it as UTF-8; other encodings are allowed in comments only",
        c if !c.is_ascii() => "outside comments only letters and digits of names may be non-ASCII",
        _ => "",
    }
}

#[cfg(test)]
mod tests {
    use super::TokenKind::{Bad, End, Mark, Number, Word};
    use super::*;

    fn kinds(source: &str) -> Vec<TokenKind<'_>> {
        tokenize(source, &mut Report::default()).iter().map(|token| token.kind).collect()
    }

    fn first_message(source: &str) -> String {
        let mut report = Report::default();
        tokenize(source, &mut report);
        report.finish(source, "t.geo").first().expect("a message").to_string()
    }

    #[test]
    fn numbers_have_the_forms_of_c_streams() {
        let expected: Vec<_> = [1., 1., 0.5, 1e-3, 2.5e4, 0.].into_iter().map(Number).chain([End]).collect();
        assert_eq!(kinds("1 1. .5 1e-3 2.5E+4 1e-999"), expected);
    }

    #[test]
    fn a_sign_is_a_token_of_its_own() {
        assert_eq!(kinds("--5"), [Mark('-'), Mark('-'), Number(5.), End]);
    }

    #[test]
    fn malformed_numbers_are_reported_once_and_do_not_stop_the_scanner() {
        for text in ["1e", "1.2.3", ".", "1e+", "1e999", "1e5.5"] {
            assert_eq!(kinds(&format!("{text};")), [Bad, Mark(';'), End], "{text}");
        }
    }

    #[test]
    fn comments_end_with_the_line_whatever_ends_the_line() {
        for end in ["\n", "\r\n", "\r"] {
            let source = format!("a # solid ä \u{fffd}{end}b#");
            let tokens = tokenize(&source, &mut Report::default());
            let [span, behind] = [1, 2].map(|column| Span { line: 2, column });
            assert_eq!(tokens[1], Token { kind: Word("b"), span, end: behind }, "{end:?}");
            assert_eq!(tokens.len(), 3);
        }
    }

    #[test]
    fn a_file_may_end_right_after_a_word() {
        assert_eq!(kinds("tlo a_1"), [Word("tlo"), Word("a_1"), End]);
    }

    #[test]
    fn columns_count_characters() {
        let message = first_message("é球$");
        assert!(message.starts_with("t.geo:1:3: "), "{message}");
        let tokens = tokenize("é;", &mut Report::default());
        assert_eq!(tokens[1].span, Span { line: 1, column: 2 });
    }

    #[test]
    fn stray_characters_get_advice() {
        assert!(first_message("-material='air'").contains("no quoted strings"));
        assert!(first_message("_a").contains("begin with a letter"));
        assert!(first_message("1*2").contains("no arithmetic"));
    }

    #[test]
    fn words_have_letters_of_any_script() {
        for word in ["würfel_2", "wu\u{308}rfel", "球", "стена1", "Außenwand"] {
            assert_eq!(kinds(word), [Word(word), End]);
        }
        for text in ["–", "（", "２", "\u{308}"] {
            assert_eq!(kinds(text), [Bad, End], "{text}");
            assert!(first_message(text).contains("only letters and digits of names"), "{text}");
        }
    }

    #[test]
    fn a_quoted_string_is_one_bad_token() {
        assert_eq!(kinds("\"air and water\"; \"open\nend"), [Bad, Mark(';'), Bad, Word("end"), End]);
    }

    #[test]
    fn a_byte_order_mark_is_skipped() {
        assert_eq!(kinds("\u{feff}a"), [Word("a"), End]);
    }
}
