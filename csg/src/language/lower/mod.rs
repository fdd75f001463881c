//! Statements to a [`Geometry`].
//!
//! Statements are taken in file order, as names are known from their definition on. Surfaces stay apart, one
//! for each primitive that is written, until the end of the file; then equal ones become one and each body gets its tree.

mod boundary;
mod conic;
mod curve;
mod expand;
mod extrusion;
mod finish;
mod flags;
mod forest;
mod polyhedron;
mod primitive;
mod profile;
mod revolution;
mod solid;
mod statement;
mod swept;
mod unify;

use std::collections::BTreeMap;

use super::ast::{Name, Statement};
use super::diagnostic::{Report, Reported};
use super::suggest::did_you_mean;
use crate::Geometry;
use crate::geometry::{Aabb, Body, BoundaryLabel, Cutout, Span, UserPoint};
use forest::Forest;

/// The geometry that the statements describe; without errors in `report` it is complete.
pub(super) fn lower(statements: &[Statement], report: &mut Report) -> Geometry {
    let mut lowering = Lowering {
        report,
        forest: Forest::default(),
        solids: BTreeMap::new(),
        curves: [BTreeMap::new(), BTreeMap::new()],
        tlos: Vec::new(),
        user_points: Vec::new(),
        overrides: Vec::new(),
        identifications: Vec::new(),
        singularities: Vec::new(),
        stated_box: None,
        losses_known: false,
        is_redefined: false,
    };
    for statement in statements {
        // What is wrong with it is in the report; the next statement may be wrong too.
        let _: Result<(), Reported> = lowering.statement(statement);
    }
    lowering.finish()
}

/// What the statements so far have said.
struct Lowering<'r> {
    report: &'r mut Report,
    forest: Forest,
    /// Index of each named solid among the definitions.
    solids: BTreeMap<String, usize>,
    /// The curves of the plane and those of space; `None` for one with an error.
    curves: [BTreeMap<String, Option<curve::Curve>>; 2],
    tlos: Vec<Tlo>,
    user_points: Vec<UserPoint>,
    overrides: Vec<Override>,
    /// The definitions whose first surfaces are identified, their names and where it says so.
    identifications: Vec<([usize; 2], [String; 2], Span)>,
    singularities: Vec<Singularity>,
    stated_box: Option<Aabb>,
    /// Whether it has been said that copies lose flags.
    losses_known: bool,
    /// Whether a solid was defined a second time.
    is_redefined: bool,
}

/// A top-level object.
struct Tlo {
    /// Its solid among the definitions.
    definition: usize,
    kind: TloKind,
    span: Span,
}

/// What a top-level object is; without its tree.
enum TloKind {
    Body(Body),
    /// A surface, and the definition whose first surface it is.
    Cutout(Cutout, usize),
}

/// A `singular`, its surfaces not yet unified.
struct Singularity {
    /// The surfaces of each solid that it names.
    surfaces: Vec<Vec<usize>>,
    /// Among the top-level objects.
    tlo: Option<usize>,
    factor: i32,
    maxh: Option<f64>,
    span: Span,
}

/// A `boundarycondition` or `boundaryconditionname`, its surfaces not yet unified.
struct Override {
    surfaces: Vec<usize>,
    /// Among the top-level objects.
    tlo: usize,
    label: BoundaryLabel,
    span: Span,
}

impl Lowering<'_> {
    /// The definition of the solid with this name.
    fn solid_named(&mut self, name: &Name) -> Result<usize, Reported> {
        if let Some(&index) = self.solids.get(&name.text) {
            return Ok(index);
        }
        let mut help = did_you_mean(&name.text, self.solids.keys().map(String::as_str));
        if help.is_empty() {
            help = "a solid must be defined before it is used".into();
        }
        Err(self.report.meaning(name.span, format!("there is no solid `{}`", name.text), &help))
    }

    /// The body, a top-level object, of the solid with this name.
    fn tlo_named(&mut self, name: &Name) -> Result<usize, Reported> {
        let name_of = |tlo: &Tlo| match tlo.kind {
            TloKind::Body(_) => Some(self.forest.definitions[tlo.definition].name.clone()),
            TloKind::Cutout(..) => None,
        };
        let names: Vec<Option<String>> = self.tlos.iter().map(name_of).collect();
        if let Some(index) = names.iter().position(|known| known.as_ref() == Some(&name.text)) {
            return Ok(index);
        }
        let mut help = did_you_mean(&name.text, names.iter().flatten().map(String::as_str));
        if help.is_empty() {
            help = format!("write `tlo {};` before this line", name.text);
        }
        Err(self.report.meaning(name.span, format!("there is no top-level object `{}`", name.text), &help))
    }
}
