//! Parses solids: expressions of primitives, transforms and names.

use super::{Parsed, Parser};
use crate::geometry::Span;
use crate::language::ast::{Expr, PolyFace, Primitive, Transform};
use crate::language::suggest::{PRIMITIVES, did_you_mean};
use crate::language::token::TokenKind;

/// Largest nesting depth of parentheses, `not` and transforms. Each level uses stack space here and
/// in every traversal of the tree. Written files need about a dozen levels; generated files can use
/// named solids.
const DEEPEST_NESTING: usize = 200;

impl Parser<'_, '_> {
    /// `term { or term }`
    pub(super) fn solid(&mut self) -> Parsed<Expr> {
        let mut terms = vec![self.term()?];
        while self.peek_word("or") {
            self.next();
            terms.push(self.term()?);
        }
        Ok(if terms.len() == 1 { terms.swap_remove(0) } else { Expr::Or(terms) })
    }

    /// `primary { and primary }`
    fn term(&mut self) -> Parsed<Expr> {
        let mut factors = vec![self.primary()?];
        while self.peek_word("and") {
            self.next();
            factors.push(self.primary()?);
        }
        Ok(if factors.len() == 1 { factors.swap_remove(0) } else { Expr::And(factors) })
    }

    fn primary(&mut self) -> Parsed<Expr> {
        let span = self.peek().span;
        self.depth += 1;
        let primary = if self.depth > DEEPEST_NESTING {
            let message = format!("the solid is nested more than {DEEPEST_NESTING} deep");
            Err(self.report.syntax(span, message, "name its parts with `solid` definitions"))
        } else {
            self.primary_within_depth(span)
        };
        self.depth -= 1;
        primary
    }

    fn primary_within_depth(&mut self, span: Span) -> Parsed<Expr> {
        self.usage = "";
        match self.peek().kind {
            TokenKind::Mark('(') => {
                self.next();
                let inner = self.solid()?;
                self.close(span)?;
                Ok(inner)
            }
            TokenKind::Word("not") => {
                self.next();
                Ok(Expr::Not(Box::new(self.primary()?)))
            }
            TokenKind::Word(word) if PRIMITIVES.contains(&word) => {
                self.next();
                self.with_arguments(word, span)
            }
            TokenKind::Word(word @ ("tube" | "gencyl")) => {
                let help = "NETGEN reserves this word without a meaning";
                Err(self.report.unsupported(span, format!("`{word}` is not a primitive"), help))
            }
            TokenKind::Word(word) if self.tokens[self.at + 1].kind == TokenKind::Mark('(') => {
                let help = did_you_mean(word, PRIMITIVES);
                let help =
                    if help.is_empty() { format!("primitives are {}", PRIMITIVES.join(", ")) } else { help };
                Err(self.report.syntax(span, format!("unknown primitive `{word}`"), &help))
            }
            TokenKind::Word(_) => Ok(Expr::Name(self.name("a solid")?)),
            TokenKind::Mark('-') => {
                let help =
                    "there is no difference operator: write `a and not b`; flags follow the whole solid";
                Err(self.expected_with_help("a solid", help))
            }
            _ => Err(self.expected_with_help("a solid", "a primitive, a name, `not`, or a solid in ( )")),
        }
    }

    /// The `)` that closes the `(` at `open`.
    fn close(&mut self, open: Span) -> Parsed<()> {
        if self.take_mark(')') {
            return Ok(());
        }
        let Span { line, column } = open;
        let help = match self.peek().kind {
            TokenKind::Mark('-') => {
                "a difference is `a and not b`; flags follow the whole solid, after its parentheses"
            }
            _ => "only `and`, `or` and `not` combine solids",
        };
        let wanted = format!("`)` for the `(` of line {line}, column {column}");
        Err(self.expected_with_help(&wanted, help))
    }

    /// A primitive or transform; its keyword `word` has been consumed.
    fn with_arguments(&mut self, word: &str, span: Span) -> Parsed<Expr> {
        self.usage = usage(word);
        self.mark('(')?;
        let primitive = match word {
            "plane" => Primitive::Plane(self.point()?, self.next_vector()?),
            "sphere" => Primitive::Sphere(self.point()?, self.next_value()?),
            "cylinder" => Primitive::Cylinder(self.point()?, self.next_point()?, self.next_value()?),
            "cone" => {
                Primitive::Cone(self.point()?, self.next_value()?, self.next_point()?, self.next_value()?)
            }
            "ellipticcylinder" => {
                Primitive::EllipticCylinder(self.point()?, self.next_vector()?, self.next_vector()?)
            }
            "ellipticcone" => {
                let (base, long, short) = (self.point()?, self.next_vector()?, self.next_vector()?);
                Primitive::EllipticCone(base, long, short, self.next_value()?, self.next_value()?)
            }
            "ellipsoid" => {
                let (center, first) = (self.point()?, self.next_vector()?);
                Primitive::Ellipsoid(center, first, self.next_vector()?, self.next_vector()?)
            }
            "orthobrick" => Primitive::Orthobrick(self.point()?, self.next_point()?),
            "torus" => {
                Primitive::Torus(self.point()?, self.next_vector()?, self.next_value()?, self.next_value()?)
            }
            "polyhedron" => self.polyhedron()?,
            "extrusion" => {
                let path = self.name("a curve")?;
                self.mark(';')?;
                Primitive::Extrusion { path, profile: self.name("a curve")?, up: self.next_vector()? }
            }
            "revolution" => {
                let (from, to) = (self.point()?, self.next_point()?);
                self.mark(';')?;
                Primitive::Revolution { from, to, profile: self.name("a curve")? }
            }
            _ => return self.transform(word, span),
        };
        self.mark(')')?;
        Ok(Expr::Primitive(primitive, span))
    }

    fn transform(&mut self, word: &str, open: Span) -> Parsed<Expr> {
        let motion = match word {
            "translate" => Transform::Translate(self.vector()?),
            "rotate" => Transform::Rotate(self.point()?, self.next_vector()?),
            "multitranslate" => Transform::MultiTranslate(self.vector()?, self.next_number()?),
            _ => Transform::MultiRotate(self.point()?, self.next_vector()?, self.next_number()?),
        };
        self.mark(';')?;
        let solid = self.solid()?;
        self.close(open)?;
        Ok(Expr::Transform(motion, open, Box::new(solid)))
    }

    /// The points, `;;`, and the faces.
    fn polyhedron(&mut self) -> Parsed<Primitive> {
        let mut points = Vec::new();
        while !self.peek_mark(';') {
            points.push(self.point()?);
            self.mark(';')?;
        }
        self.mark(';')?;
        let mut faces = vec![self.polyhedron_face()?];
        while self.take_mark(';') {
            faces.push(self.polyhedron_face()?);
        }
        Ok(Primitive::Polyhedron(points, faces))
    }

    fn polyhedron_face(&mut self) -> Parsed<PolyFace> {
        let span = self.peek().span;
        let mut points = vec![self.number()?];
        self.mark(',')?;
        points.push(self.number()?);
        self.mark(',')?;
        points.push(self.number()?);
        if self.take_mark(',') {
            points.push(self.number()?);
        }
        Ok(PolyFace { points, span })
    }
}

/// The syntax of a primitive or transform.
fn usage(word: &str) -> &'static str {
    match word {
        "plane" => "plane (px, py, pz; nx, ny, nz), with the normal pointing outward",
        "sphere" => "sphere (cx, cy, cz; r)",
        "cylinder" => "cylinder (ax, ay, az; bx, by, bz; r)",
        "cone" => "cone (ax, ay, az; ra; bx, by, bz; rb)",
        "ellipticcylinder" => "ellipticcylinder (ax, ay, az; vx, vy, vz; wx, wy, wz)",
        "ellipticcone" => "ellipticcone (ax, ay, az; vx, vy, vz; wx, wy, wz; height; ratio)",
        "ellipsoid" => "ellipsoid (cx, cy, cz; ux, uy, uz; vx, vy, vz; wx, wy, wz)",
        "orthobrick" => "orthobrick (xmin, ymin, zmin; xmax, ymax, zmax)",
        "torus" => "torus (cx, cy, cz; nx, ny, nz; R; r)",
        "polyhedron" => "polyhedron (x, y, z; x, y, z; ... ;; i, j, k; i, j, k, l; ...)",
        "extrusion" => "extrusion (PATH; PROFILE; dx, dy, dz)",
        "revolution" => "revolution (ax, ay, az; bx, by, bz; PROFILE)",
        "translate" => "translate (dx, dy, dz; SOLID)",
        "rotate" => "rotate (cx, cy, cz; alpha, beta, gamma; SOLID), angles in radians",
        "multitranslate" => "multitranslate (dx, dy, dz; COUNT; SOLID)",
        _ => "multirotate (cx, cy, cz; alpha, beta, gamma; COUNT; SOLID), angles in radians",
    }
}
