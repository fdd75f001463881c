//! Parses flags: `-name`, `-name=word`, `-name=number`, `-name=[a, b]`.

use super::{Parsed, Parser};
use crate::language::ast::{Flag, FlagValue};
use crate::language::suggest::is_reserved;
use crate::language::token::TokenKind;

impl Parser<'_, '_> {
    pub(super) fn flags(&mut self) -> Parsed<Vec<Flag>> {
        let mut flags = Vec::new();
        self.usage = "flags such as -maxh=0.1, -bc=2, -material=air, -col=[1,0,0] or -transparent";
        while self.peek_mark('-') {
            let span = self.next().span;
            // Flags may have names of keywords: `-tlo=air`.
            let TokenKind::Word(word) = self.peek().kind else {
                return Err(self.expected("the name of a flag"));
            };
            self.next();
            let value = if self.take_mark('=') { self.flag_value()? } else { FlagValue::Nothing };
            flags.push(Flag { name: word.to_owned(), value, span });
        }
        Ok(flags)
    }

    fn flag_value(&mut self) -> Parsed<FlagValue> {
        if self.take_mark('[') {
            let value = match self.peek().kind {
                TokenKind::Word(_) => FlagValue::Words(self.list(Self::flag_word)?),
                _ => FlagValue::Numbers(self.list(Self::value)?),
            };
            self.mark(']')?;
            return Ok(value);
        }
        Ok(match self.peek().kind {
            TokenKind::Word(_) => FlagValue::Word(self.flag_word()?),
            TokenKind::Number(_) | TokenKind::Mark('-') => FlagValue::Number(self.value()?),
            _ => return Err(self.expected("the value of the flag")),
        })
    }

    fn list<T>(&mut self, item: impl Fn(&mut Self) -> Parsed<T>) -> Parsed<Vec<T>> {
        let mut items = vec![item(self)?];
        while self.take_mark(',') {
            items.push(item(self)?);
        }
        Ok(items)
    }

    fn flag_word(&mut self) -> Parsed<String> {
        let token = self.peek();
        match token.kind {
            TokenKind::Word(word) if is_reserved(word) => {
                self.next();
                let message = format!("`{word}` is a keyword and cannot be the value of a flag");
                Err(self.report.syntax(token.span, message, "choose another word"))
            }
            TokenKind::Word(word) => {
                self.next();
                Ok(word.to_owned())
            }
            _ => Err(self.expected("a word")),
        }
    }
}
