//! Parses tokens into statements.
//!
//! A statement with an error is reported once; parsing resumes at the next keyword that begins a
//! statement. These keywords are reserved, so one error rarely causes another.

mod curve;
mod flag;
mod solid;
mod statement;

use super::ast::{Name, Num, Statement};
use super::diagnostic::{Report, Reported};
use super::suggest::{STATEMENTS, begins_statement, did_you_mean, is_reserved};
use super::token::{Token, TokenKind, tokenize};
use crate::geometry::Span;
use crate::{Point, Vector};

type Parsed<T> = Result<T, Reported>;

/// Parses `source`. Statements with errors are omitted, or [`Statement::Broken`] if they define a
/// name.
pub(super) fn parse(source: &str, report: &mut Report) -> Vec<Statement> {
    let tokens = tokenize(source, report);
    let mut parser = Parser { tokens: &tokens, at: 0, report, depth: 0, usage: "" };
    if parser.header().is_err() {
        return Vec::new();
    }
    let mut statements = Vec::new();
    while parser.peek().kind != TokenKind::End && !parser.report.is_full() {
        let start = parser.at;
        match parser.statement() {
            Ok(Some(statement)) => statements.push(statement),
            Ok(None) => {}
            Err(Reported) => {
                statements.extend(parser.broken_definition(start));
                parser.skip_to_statement(start);
            }
        }
    }
    statements
}

struct Parser<'a, 'r> {
    tokens: &'a [Token<'a>],
    at: usize,
    report: &'r mut Report,
    /// Nesting depth of the expression being parsed.
    depth: usize,
    /// Syntax of the construct being parsed, for help lines.
    usage: &'static str,
}

impl<'a> Parser<'a, '_> {
    fn peek(&self) -> Token<'a> {
        self.tokens[self.at]
    }

    /// Takes the next token; the end of the file is never consumed.
    fn next(&mut self) -> Token<'a> {
        let token = self.peek();
        self.at = (self.at + 1).min(self.tokens.len() - 1);
        token
    }

    fn peek_mark(&self, mark: char) -> bool {
        self.peek().kind == TokenKind::Mark(mark)
    }

    fn peek_word(&self, word: &str) -> bool {
        self.peek().kind == TokenKind::Word(word)
    }

    /// Takes `mark` if it is the next token; returns whether it was.
    fn take_mark(&mut self, mark: char) -> bool {
        let there = self.peek_mark(mark);
        if there {
            self.next();
        }
        there
    }

    /// Reports that the next token is not `wanted`.
    fn expected(&mut self, wanted: &str) -> Reported {
        let help = if self.usage.is_empty() { String::new() } else { format!("write {}", self.usage) };
        self.expected_with_help(wanted, &help)
    }

    fn expected_with_help(&mut self, wanted: &str, help: &str) -> Reported {
        self.expected_at(self.peek().span, wanted, help)
    }

    /// Reports at a position that the next token is not `wanted`.
    fn expected_at(&mut self, span: Span, wanted: &str, help: &str) -> Reported {
        match self.peek().kind {
            TokenKind::Bad => Reported,
            kind => self.report.syntax(span, format!("expected {wanted}, found {}", describe(kind)), help),
        }
    }

    /// The position behind the last token that was taken.
    fn behind(&self) -> Span {
        self.tokens[self.at.saturating_sub(1)].end
    }

    fn mark(&mut self, mark: char) -> Parsed<Span> {
        if self.peek_mark(mark) { Ok(self.next().span) } else { Err(self.expected(&format!("`{mark}`"))) }
    }

    /// A number with any number of minus signs before it.
    fn number(&mut self) -> Parsed<Num> {
        let span = self.peek().span;
        let mut negative = false;
        while self.take_mark('-') {
            negative = !negative;
        }
        match self.peek().kind {
            TokenKind::Number(value) => {
                self.next();
                Ok(Num { value: if negative { -value } else { value }, span })
            }
            TokenKind::Word(_) => {
                Err(self.expected_with_help("a number", "there are no variables and no arithmetic"))
            }
            _ => Err(self.expected("a number")),
        }
    }

    fn value(&mut self) -> Parsed<f64> {
        Ok(self.number()?.value)
    }

    fn point(&mut self) -> Parsed<Point> {
        let x = self.value()?;
        self.mark(',')?;
        let y = self.value()?;
        self.mark(',')?;
        Ok(Point::new(x, y, self.value()?))
    }

    fn vector(&mut self) -> Parsed<Vector> {
        Ok(self.point()?.coords)
    }

    /// `;` and a number.
    fn next_value(&mut self) -> Parsed<f64> {
        self.mark(';')?;
        self.value()
    }

    /// `;` and a number that must be an integer (checked later).
    fn next_number(&mut self) -> Parsed<Num> {
        self.mark(';')?;
        self.number()
    }

    fn next_point(&mut self) -> Parsed<Point> {
        self.mark(';')?;
        self.point()
    }

    fn next_vector(&mut self) -> Parsed<Vector> {
        self.mark(';')?;
        self.vector()
    }

    /// A name; `what` is the kind of named object, for messages.
    fn name(&mut self, what: &str) -> Parsed<Name> {
        let token = self.peek();
        match token.kind {
            TokenKind::Word(word) if is_reserved(word) => {
                self.next();
                if !(self.peek_mark('=') || self.peek_mark(';')) {
                    // It may begin the next statement, where parsing resumes.
                    self.at -= 1;
                }
                let message = format!("`{word}` is a keyword and cannot name {what}");
                Err(self.report.syntax(token.span, message, "choose another name"))
            }
            TokenKind::Word(word) => {
                self.next();
                Ok(Name { text: word.to_owned(), span: token.span })
            }
            _ => {
                let help = "names begin with a letter, followed by letters, digits and _";
                Err(self.expected_with_help(&format!("the name of {what}"), help))
            }
        }
    }

    /// The keyword `algebraic3d` at the beginning of the file.
    fn header(&mut self) -> Parsed<()> {
        let token = self.peek();
        match token.kind {
            TokenKind::Word("algebraic3d") => {
                self.next();
                Ok(())
            }
            TokenKind::Bad => Err(Reported),
            TokenKind::End => {
                let help = "write `algebraic3d`, solids, and `tlo NAME;` for each body to be meshed";
                Err(self.report.syntax(token.span, "the file is empty", help))
            }
            TokenKind::Word(word) if begins_statement(word) => {
                let help = "make `algebraic3d` the first word of the file";
                self.report.syntax(token.span, "a .geo file begins with the word `algebraic3d`", help);
                Ok(())
            }
            _ => {
                let help = "this may be a file of another kind";
                let message = "a .geo file begins with the word `algebraic3d`";
                Err(self.report.syntax(token.span, message, help))
            }
        }
    }

    /// The definition that a statement with an error (starting at token `start`) would have made.
    ///
    /// The first word is not checked, because it may be misspelled.
    fn broken_definition(&self, start: usize) -> Option<Statement> {
        let [word, name, mark] = self.tokens.get(start..start + 3)? else { return None };
        match (word.kind, name.kind, mark.kind) {
            (TokenKind::Word(_), TokenKind::Word(text), TokenKind::Mark('=')) if !is_reserved(text) => {
                Some(Statement::Broken { name: Name { text: text.to_owned(), span: name.span } })
            }
            _ => None,
        }
    }

    /// Skips to the next keyword after `start` that begins a statement.
    fn skip_to_statement(&mut self, start: usize) {
        self.at = self.at.max(start + 1).min(self.tokens.len() - 1);
        loop {
            let after_singular = self.tokens[self.at - 1].kind == TokenKind::Word("singular");
            match self.peek().kind {
                TokenKind::End => break,
                TokenKind::Word(word) if begins_statement(word) && !(word == "point" && after_singular) => {
                    break;
                }
                _ => {
                    self.next();
                }
            }
        }
    }

    /// Reports a token that does not begin a statement.
    fn no_statement(&mut self) -> Reported {
        let help = match self.peek().kind {
            TokenKind::Word(word) => did_you_mean(word, STATEMENTS),
            _ => String::new(),
        };
        let help = if help.is_empty() {
            format!("statements begin with one of {}", STATEMENTS.join(", "))
        } else {
            help
        };
        self.expected_with_help("a statement", &help)
    }
}

fn describe(kind: TokenKind<'_>) -> String {
    match kind {
        TokenKind::Word(word) => format!("`{word}`"),
        TokenKind::Number(value) => format!("the number {value}"),
        TokenKind::Mark(mark) => format!("`{mark}`"),
        TokenKind::Bad => "an unknown character".into(),
        TokenKind::End => "the end of the file".into(),
    }
}
