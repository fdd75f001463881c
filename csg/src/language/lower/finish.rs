//! The end of the file: equal surfaces become one, bodies get their trees.

use std::collections::BTreeSet;

use super::expand::{ExpandError, expand};
use super::forest::NodeId;
use super::unify::Classes;
use super::{Lowering, Override};
use crate::geometry::{Body, BodyId, BoundaryOverride, Span};
use crate::{Geometry, Solid, SurfaceId};

impl Lowering<'_> {
    /// The geometry; where something is wrong it is in the report, and the geometry is of no use.
    pub(super) fn finish(mut self) -> Geometry {
        if self.tlos.is_empty() && !self.report.has_errors() {
            let message = "there is no top-level object, hence nothing to mesh";
            self.report.meaning(Span { line: 1, column: 1 }, message, "write `tlo NAME;` for a solid");
        }
        let used = self.used_surfaces();
        if self.report.has_errors() {
            return Geometry::default();
        }
        let classes = Classes::find(&self.forest.surfaces, &used);
        self.warn_of_lost_numbers(&classes, &used);
        let bodies = self.bodies(&classes);
        let boundary_overrides = self.boundary_overrides(&classes, &bodies);
        let (surfaces, surface_info) = classes.surfaces(&self.forest.surfaces, &used);
        Geometry {
            surfaces,
            surface_info,
            bodies,
            user_points: self.user_points,
            boundary_overrides,
            stated_box: self.stated_box,
            seams: Vec::new(),
        }
    }

    /// The definition and the root of the tree of each top-level object that is a solid.
    fn roots(&self) -> Vec<(usize, Option<NodeId>)> {
        let bodies = self.tlos.iter().filter(|tlo| tlo.body.is_some());
        bodies.map(|tlo| (tlo.definition, self.forest.definitions[tlo.definition].root)).collect()
    }

    /// The raw surfaces that bodies need; primitives among them that cannot be meshed are reported.
    fn used_surfaces(&mut self) -> BTreeSet<usize> {
        let mut primitives = BTreeSet::new();
        for (_, root) in self.roots() {
            // Without a root, or with an error under it, there is an error in the report.
            let found = root.and_then(|root| self.forest.primitives_of(root).ok());
            primitives.extend(found.unwrap_or_default());
        }
        let mut used = BTreeSet::new();
        let mut refused = BTreeSet::new();
        for index in primitives {
            let primitive = &self.forest.primitives[index];
            if let Some(message) = &primitive.unsupported
                && refused.insert((primitive.span.line, primitive.span.column))
            {
                self.report.unsupported(primitive.span, message, "a top-level object uses it");
            }
            used.extend(primitive.surfaces.clone());
        }
        used
    }

    fn bodies(&mut self, classes: &Classes) -> Vec<Body> {
        let mut bodies = Vec::new();
        for tlo in &mut self.tlos {
            let Some(mut body) = tlo.body.take() else { continue };
            let definition = &self.forest.definitions[tlo.definition];
            let root = definition.root.ok_or(ExpandError::Graph(super::forest::ForestError::Broken));
            match root.and_then(|root| expand(&self.forest, classes, root)) {
                Ok(solid) => body.solid = solid,
                Err(error) => {
                    self.report.meaning(tlo.span, format!("`{}` {error}", body.name), "simplify the solid");
                }
            }
            body.maxh = body.maxh.or(definition.maxh);
            bodies.push(body);
        }
        bodies
    }

    /// The overrides over unified surfaces; those that reach nothing are warned of.
    fn boundary_overrides(&mut self, classes: &Classes, bodies: &[Body]) -> Vec<BoundaryOverride> {
        let mut overrides = Vec::new();
        for Override { surfaces, tlo, label, span } in std::mem::take(&mut self.overrides) {
            let number = tlo as u32 + 1;
            let Some(body) = bodies.iter().position(|body| body.number == number) else { continue };
            let mut of_body = BTreeSet::new();
            surfaces_of(&bodies[body].solid, &mut of_body);
            let ids: BTreeSet<SurfaceId> = surfaces.iter().filter_map(|&i| classes.id(i)).collect();
            if ids.is_disjoint(&of_body) {
                let message = format!("no surface of this solid bounds `{}`", bodies[body].name);
                self.report.warn(span, message, "");
            }
            let surfaces = ids.into_iter().collect();
            overrides.push(BoundaryOverride { surfaces, body: BodyId::new(body), label, span });
        }
        overrides
    }

    /// Boundary numbers and names that have no effect, as the surface is that of an earlier primitive.
    fn warn_of_lost_numbers(&mut self, classes: &Classes, used: &BTreeSet<usize>) {
        let mut told = BTreeSet::new();
        for &i in used {
            let [first, own] = [classes.first(i), i].map(|i| &self.forest.surfaces[i].info);
            let loses = (own.bc.is_some() && own.bc != first.bc)
                || (own.bc_name.is_some() && own.bc_name != first.bc_name);
            if loses && told.insert((first.solid.clone(), own.solid.clone())) {
                let (line, span) = (first.span.line, own.span);
                let message = format!(
                    "a surface of `{}` is also one of `{}` (line {line}), whose -bc and -bcname count for both",
                    own.solid, first.solid
                );
                let help = "`boundarycondition` and `boundaryconditionname` give them body by body";
                self.report.warn(span, message, help);
            }
        }
    }
}

fn surfaces_of(solid: &Solid, into: &mut BTreeSet<SurfaceId>) {
    match solid {
        Solid::Half { surface, .. } => {
            into.insert(*surface);
        }
        Solid::And(members) | Solid::Or(members) => {
            members.iter().for_each(|member| surfaces_of(member, into))
        }
        Solid::Not(member) => surfaces_of(member, into),
    }
}
