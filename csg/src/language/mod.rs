//! The language of `.geo` files, from text to a [`Geometry`].
//!
//! A file begins with `algebraic3d`. `solid NAME = ...;` defines a named **solid** from primitives
//! (half-spaces, balls, infinite cylinders, ...) combined by `and`, `or` and `not`. `tlo NAME;`
//! declares a **top-level object**: the solid is a body to be meshed. Flags such as `-maxh=0.1`
//! follow at the end of a statement.
//!
//! ```
//! let source = "algebraic3d
//! solid can = cylinder (0, 0, 0; 0, 0, 1; 0.5)   # infinite
//!         and plane (0, 0, 0; 0, 0, -1)          # the normal points outward
//!         and plane (0, 0, 2; 0, 0, 1);
//! tlo can -material=tin;
//! ";
//! let parsed = csg::language::parse_geometry(source, "can.geo").unwrap();
//! assert_eq!(parsed.geometry.surfaces.len(), 3);
//! assert_eq!(parsed.geometry.bodies[0].material.as_deref(), Some("tin"));
//!
//! let errors = csg::language::parse_geometry("algebraic3d\ntlo can;", "can.geo").unwrap_err();
//! assert!(errors.to_string().starts_with("can.geo:2:5: error: there is no solid `can`"));
//! ```
//!
//! The language is NETGEN's. Mistakes that NETGEN ignores (unknown names, curves that do not join,
//! a radius of zero, misspelled flags) are reported, and every primitive can be transformed.
//! Numbers of bodies and boundaries are the same as in NETGEN.
//!
//! This module does not detect overlapping or unbounded bodies; [`Features`](crate::Features) does.

mod ast;
mod diagnostic;
mod lower;
mod parse;
mod suggest;
mod token;

pub use diagnostic::{Diagnostic, Diagnostics, Kind};
pub use suggest::did_you_mean;

use crate::Geometry;
use diagnostic::Report;

/// The result of reading a file.
#[derive(Clone, Debug)]
pub struct Parsed {
    /// The geometry.
    pub geometry: Geometry,
    /// Warnings, in file order.
    pub warnings: Vec<Diagnostic>,
}

/// How a geometry is read.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Settings {
    /// Surfaces of one kind are taken as one if they are at most this far apart (length). At least
    /// 10⁻⁸ of the size of the geometry counts.
    pub merge: f64,
}

/// Reads a geometry; `file_name` is used in messages only.
///
/// # Errors
/// All diagnostics, including warnings, if one of them is an error, or if the file contains
/// something that cannot be meshed yet ([`Kind::Unsupported`]).
pub fn parse_geometry(source: &str, file_name: &str) -> Result<Parsed, Diagnostics> {
    parse_geometry_with(source, file_name, &Settings::default())
}

/// [`parse_geometry`] with settings.
///
/// # Errors
/// As for [`parse_geometry`].
pub fn parse_geometry_with(
    source: &str,
    file_name: &str,
    settings: &Settings,
) -> Result<Parsed, Diagnostics> {
    let mut report = Report::default();
    let statements = parse::parse(source, &mut report);
    let mut geometry = lower::lower(&statements, settings, &mut report);
    crate::features::find_seams(&mut geometry);
    let failed = report.has_errors();
    let messages = report.finish(source, file_name);
    if failed { Err(Diagnostics { messages }) } else { Ok(Parsed { geometry, warnings: messages }) }
}

/// Reads a geometry from the bytes of a file; comments may have any encoding.
///
/// # Errors
/// As for [`parse_geometry`]. Outside comments, bytes that are not UTF-8 are unknown characters.
pub fn parse_geometry_bytes(
    source: &[u8],
    file_name: &str,
    settings: &Settings,
) -> Result<Parsed, Diagnostics> {
    parse_geometry_with(&String::from_utf8_lossy(source), file_name, settings)
}

#[cfg(test)]
mod tests;
