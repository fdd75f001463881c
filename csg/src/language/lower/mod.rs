//! Lowers statements to a [`Geometry`].
//!
//! Statements are processed in file order, because a name is known only after its definition. Each
//! primitive has its own surfaces until the end of the file; then equal surfaces are unified and
//! each body gets its tree.

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

use std::collections::{BTreeMap, BTreeSet};

use super::Settings;
use super::ast::{Name, Statement};
use super::diagnostic::{Report, Reported};
use super::suggest::did_you_mean;
use crate::Geometry;
use crate::geometry::{Aabb, Body, BoundaryLabel, Cutout, Span, UserPoint};
use forest::Forest;

/// Lowers statements; the geometry is complete if `report` has no errors.
pub(super) fn lower<'r>(
    statements: &'r [Statement],
    settings: &Settings,
    report: &'r mut Report,
) -> Geometry {
    let mut lowering = Lowering {
        report,
        solid_names: statements.iter().filter_map(Statement::solid_name).collect(),
        forest: Forest::default(),
        solids: BTreeMap::new(),
        curves: [BTreeMap::new(), BTreeMap::new()],
        tlos: Vec::new(),
        user_points: Vec::new(),
        overrides: Vec::new(),
        identifications: Vec::new(),
        singularities: Vec::new(),
        stated_box: None,
        has_warned_of_losses: false,
        is_redefined: false,
    };
    for statement in statements {
        // Errors are in the report; continue to find further ones.
        let _: Result<(), Reported> = lowering.statement(statement);
    }
    lowering.finish(settings.merge)
}

/// State of the lowering after the statements so far.
struct Lowering<'r> {
    report: &'r mut Report,
    /// The names of all solids of the file, also of those defined later.
    solid_names: BTreeSet<&'r str>,
    forest: Forest,
    /// The index of each named solid in the definitions.
    solids: BTreeMap<String, usize>,
    /// Plane curves and space curves; `None` for one with an error.
    curves: [BTreeMap<String, Option<curve::Curve>>; 2],
    tlos: Vec<Tlo>,
    user_points: Vec<UserPoint>,
    overrides: Vec<Override>,
    /// Definitions whose first surfaces are identified, their names, and the position of the
    /// statement.
    identifications: Vec<([usize; 2], [String; 2], Span)>,
    singularities: Vec<Singularity>,
    stated_box: Option<Aabb>,
    /// Whether the warning that copies lose their flags has been given.
    has_warned_of_losses: bool,
    /// Whether a solid was redefined.
    is_redefined: bool,
}

/// A top-level object.
struct Tlo {
    /// The index of its solid in the definitions.
    definition: usize,
    kind: TloKind,
    span: Span,
}

/// A top-level object without its tree.
enum TloKind {
    Body(Body),
    /// A cutout, and the definition whose first surface it is on.
    Cutout(Cutout, usize),
}

/// A `singular` statement with raw surfaces.
struct Singularity {
    /// The surfaces of each named solid.
    surfaces: Vec<Vec<usize>>,
    /// Index of a top-level object.
    tlo: Option<usize>,
    factor: i32,
    maxh: Option<f64>,
    span: Span,
}

/// A `boundarycondition` or `boundaryconditionname` statement with raw surfaces.
struct Override {
    surfaces: Vec<usize>,
    /// Index of a top-level object.
    tlo: usize,
    label: BoundaryLabel,
    span: Span,
}

impl Lowering<'_> {
    /// The definition of a named solid; reports an unknown name.
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

    /// The index of the top-level object whose body is the named solid; reports an unknown name.
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
