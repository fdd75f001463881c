//! Tests of the language: geometries of valid files, and messages of invalid ones.

mod flags;
mod fuzz;
mod grammar;
mod messages;
mod numbering;
mod solids;
mod swept;
mod tutorials;
mod unity;

use super::*;
use crate::{Point, Solid, Surface};

/// The result of parsing the statements.
fn parsed(statements: &str) -> Parsed {
    match parse_geometry(&format!("algebraic3d\n{statements}"), "t.geo") {
        Ok(parsed) => parsed,
        Err(errors) => panic!("{errors}"),
    }
}

/// The geometry of statements that give no warning.
fn geometry(statements: &str) -> Geometry {
    let Parsed { geometry, warnings } = parsed(statements);
    assert!(warnings.is_empty(), "{}", warnings[0]);
    geometry
}

/// The geometry of one solid named `a`.
fn solid(text: &str) -> Geometry {
    geometry(&format!("solid a = {text}; tlo a;"))
}

/// The errors of the statements, which start in line 2.
fn errors(statements: &str) -> Diagnostics {
    parse_geometry(&format!("algebraic3d\n{statements}"), "t.geo").expect_err(statements)
}

/// Whether all errors are of the kind [`Kind::Unsupported`].
fn is_unsupported(errors: &Diagnostics) -> bool {
    errors.errors().all(|message| message.kind == Kind::Unsupported)
}

/// The only error of the statements.
fn error(statements: &str) -> String {
    let errors = errors(statements);
    assert_eq!(errors.errors().count(), 1, "{statements}\n{errors}");
    errors.errors().next().map(ToString::to_string).unwrap_or_default()
}

/// The only warning of the statements.
fn warning(statements: &str) -> String {
    let warnings = parsed(statements).warnings;
    assert_eq!(warnings.len(), 1, "{statements}: {warnings:?}");
    warnings[0].to_string()
}

/// Whether a point, which must not be on a surface, is inside a solid.
fn is_inside(geometry: &Geometry, solid: &Solid, point: &Point) -> bool {
    match solid {
        Solid::Half { surface, positive } => {
            (geometry.surfaces[surface.index()].value(point) > 0.0) == *positive
        }
        Solid::And(members) => members.iter().all(|member| is_inside(geometry, member, point)),
        Solid::Or(members) => members.iter().any(|member| is_inside(geometry, member, point)),
        Solid::Not(member) => !is_inside(geometry, member, point),
    }
}

/// Points in the cube [-3, 3]³ that avoid round coordinates.
fn samples() -> impl Iterator<Item = Point> {
    // Fractional parts of multiples of powers of the real root of x⁴ = x + 1 are uniformly
    // distributed (Roberts 2018).
    let steps = [0.819_172_513, 0.671_043_607, 0.549_700_478];
    (1..4000).map(move |i| Point::from(steps.map(|step| (f64::from(i) * step).fract() * 6.0 - 3.0)))
}

/// Asserts that the first body agrees with `inside` at all samples.
fn assert_is(geometry: &Geometry, inside: impl Fn(&Point) -> bool) {
    let mut counts = [0, 0];
    for point in samples() {
        let expected = inside(&point);
        assert_eq!(is_inside(geometry, &geometry.bodies[0].solid, &point), expected, "at {point}");
        counts[usize::from(expected)] += 1;
    }
    assert!(counts[1] > 10 && counts[0] > 10, "too few samples inside or outside: {counts:?}");
}
