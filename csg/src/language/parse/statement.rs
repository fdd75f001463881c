//! Parses statements.

use super::{Parsed, Parser};
use crate::language::ast::Statement;
use crate::language::suggest::{begins_statement, did_you_mean, is_reserved};
use crate::language::token::TokenKind;

impl Parser<'_, '_> {
    /// A statement with its `;`, or a single `;`.
    pub(super) fn statement(&mut self) -> Parsed<Option<Statement>> {
        self.usage = "";
        let TokenKind::Word(word) = self.peek().kind else {
            return if self.take_mark(';') { Ok(None) } else { Err(self.no_statement()) };
        };
        let statement = match word {
            "solid" => self.solid_definition()?,
            "tlo" => self.top_level_object()?,
            "curve2d" | "curve3d" => self.curve(word == "curve3d")?,
            "boundingbox" => self.bounding_box()?,
            "point" => self.user_point()?,
            "identify" => self.identify()?,
            "singular" => self.singular()?,
            "boundarycondition" => self.boundary(false)?,
            "boundaryconditionname" => self.boundary(true)?,
            "define" => return self.constant().map(Some),
            _ => return Err(self.no_statement()),
        };
        self.end_of_statement()?;
        Ok(Some(statement))
    }

    fn end_of_statement(&mut self) -> Parsed<()> {
        if self.take_mark(';') {
            return Ok(());
        }
        let help = match self.peek().kind {
            TokenKind::Word("and" | "or" | "not") => {
                "flags follow the whole solid: define this part as a separate `solid`; a difference is `a and not b`"
            }
            TokenKind::Mark('(') => {
                "only `and`, `or` and `not` combine solids; a difference is `a and not b`"
            }
            _ => "every statement ends with `;`",
        };
        // Flags and operators are wrong where they are; otherwise `;` is missing behind the last
        // word, perhaps lines before the next one.
        let next = self.peek();
        let is_missing = match next.kind {
            TokenKind::Word(word) => begins_statement(word),
            kind => kind == TokenKind::End,
        };
        let span = if is_missing { self.behind() } else { next.span };
        Err(self.expected_at(span, "`;` at the end of the statement", help))
    }

    fn solid_definition(&mut self) -> Parsed<Statement> {
        self.next();
        let name = self.name("a solid")?;
        self.usage = "solid NAME = ...; (names have only letters, digits and _)";
        self.mark('=')?;
        let body = self.solid()?;
        let flags = self.flags()?;
        Ok(Statement::Solid { name, body, flags })
    }

    fn top_level_object(&mut self) -> Parsed<Statement> {
        self.next();
        let solid = self.name("a solid")?;
        let surface = match self.peek().kind {
            // A keyword begins the next statement, so the `;` is missing.
            TokenKind::Word(word) if !is_reserved(word) => Some(self.name("a solid")?),
            _ => None,
        };
        let flags = self.flags()?;
        Ok(Statement::Tlo { solid, surface, flags })
    }

    fn bounding_box(&mut self) -> Parsed<Statement> {
        let span = self.next().span;
        self.usage = "boundingbox (xmin, ymin, zmin; xmax, ymax, zmax);";
        self.mark('(')?;
        let min = self.point()?;
        let max = self.next_point()?;
        self.mark(')')?;
        Ok(Statement::BoundingBox { min, max, span })
    }

    fn user_point(&mut self) -> Parsed<Statement> {
        let span = self.next().span;
        self.usage = "point (x, y, z);";
        self.mark('(')?;
        let point = self.point()?;
        self.mark(')')?;
        let flags = self.flags()?;
        Ok(Statement::UserPoint { point, flags, span })
    }

    fn identify(&mut self) -> Parsed<Statement> {
        let span = self.next().span;
        let periodic = match self.peek().kind {
            TokenKind::Word("periodic") => true,
            TokenKind::Word("closesurfaces") => false,
            kind => return Err(self.expected_keyword(kind, &["closesurfaces", "periodic"])),
        };
        self.next();
        let solids = [self.name("a solid")?, self.name("a solid")?];
        if periodic {
            return Ok(Statement::IdentifyPeriodic { solids, span });
        }
        let flags = self.flags()?;
        Ok(Statement::IdentifyCloseSurfaces { solids, flags, span })
    }

    fn singular(&mut self) -> Parsed<Statement> {
        let span = self.next().span;
        let kind = match self.peek().kind {
            TokenKind::Word(word @ ("face" | "edge" | "point")) => word,
            kind => return Err(self.expected_keyword(kind, &["face", "edge", "point"])),
        };
        self.next();
        let first = self.name(if kind == "face" { "a top-level object" } else { "a solid" })?;
        let second = self.name("a solid")?;
        Ok(match kind {
            "face" => Statement::SingularFace { tlo: first, solid: second, flags: self.flags()?, span },
            "edge" => Statement::SingularEdge { solids: [first, second], flags: self.flags()?, span },
            _ => {
                let solids = [first, second, self.name("a solid")?];
                Statement::SingularPoint { solids, flags: self.flags()?, span }
            }
        })
    }

    fn boundary(&mut self, by_name: bool) -> Parsed<Statement> {
        self.next();
        let solid = self.name("a solid")?;
        let tlo = self.name("a top-level object")?;
        if by_name {
            self.usage = "boundaryconditionname SOLID TLO NAME;";
            return Ok(Statement::BoundaryName { solid, tlo, word: self.name("a boundary")? });
        }
        self.usage = "boundarycondition SOLID TLO NUMBER;";
        Ok(Statement::Boundary { solid, tlo, number: self.number()? })
    }

    /// `define constant NAME = number`; the `;` is optional.
    fn constant(&mut self) -> Parsed<Statement> {
        self.next();
        self.usage = "define constant NAME = NUMBER;";
        if !self.peek_word("constant") {
            let kind = self.peek().kind;
            return Err(self.expected_keyword(kind, &["constant"]));
        }
        self.next();
        let name = self.name("a constant")?;
        self.mark('=')?;
        self.number()?;
        self.take_mark(';');
        Ok(Statement::Constant { name })
    }

    fn expected_keyword(&mut self, found: TokenKind<'_>, keywords: &[&str]) -> super::Reported {
        let help = match found {
            TokenKind::Word(word) => did_you_mean(word, keywords.iter().copied()),
            _ => String::new(),
        };
        let quoted: Vec<String> = keywords.iter().map(|k| format!("`{k}`")).collect();
        self.expected_with_help(&quoted.join(" or "), &help)
    }
}
