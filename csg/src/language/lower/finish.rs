//! Finishes the geometry: unifies equal surfaces and expands the trees of bodies.

use std::collections::{BTreeMap, BTreeSet};

use super::expand::{ExpandError, expand};
use super::forest::{ForestError, NodeId, Primitive};
use super::swept::Joint;
use super::unify::Classes;
use super::{Lowering, Override, Tlo, TloKind};
use crate::geometry::{
    Body, BodyId, BoundaryOverride, Cutout, Identification, SingularPlace, Singularity, Span,
};
use crate::{Geometry, Seam, Solid, SurfaceId};

impl Lowering<'_> {
    /// The geometry; meaningless if there are errors in the report. Surfaces within `merge`
    /// (length) are taken as one.
    pub(super) fn finish(mut self, merge: f64) -> Geometry {
        if self.tlos.is_empty() && !self.report.has_errors() {
            let message = "there is no top-level object, hence nothing to mesh";
            self.report.meaning(Span { line: 1, column: 1 }, message, "write `tlo NAME;` for a solid");
        }
        let used = self.used_surfaces();
        if self.report.has_errors() {
            return Geometry::default();
        }
        let classes = Classes::find(&self.forest.surfaces, &used, merge);
        self.warn_of_gaps(&classes);
        self.warn_of_lost_numbers(&classes, &used);
        let (bodies, cutouts) = self.top_level_objects(&classes);
        self.warn_of_idle_cutouts(&bodies, &cutouts);
        let identifications = self.identifications(&classes);
        let singularities = self.singularities(&classes, &bodies);
        let boundary_overrides = self.boundary_overrides(&classes, &bodies);
        let seams = self.joints(&classes);
        let (surfaces, surface_info) = classes.surfaces(&self.forest.surfaces, &used);
        Geometry {
            surfaces,
            surface_info,
            bodies,
            cutouts,
            identifications,
            singularities,
            user_points: self.user_points,
            boundary_overrides,
            stated_box: self.stated_box,
            seams,
        }
    }

    /// The root nodes of all top-level objects.
    fn roots(&self) -> Vec<Option<NodeId>> {
        let root = |definition: usize| self.forest.definitions[definition].root;
        let of_surface = |tlo: &Tlo| match tlo.kind {
            TloKind::Body(_) => None,
            TloKind::Cutout(_, of_surface) => Some(root(of_surface)),
        };
        self.tlos.iter().flat_map(|tlo| [Some(root(tlo.definition)), of_surface(tlo)]).flatten().collect()
    }

    /// The raw surfaces used by top-level objects; reports primitives among them that cannot be
    /// meshed.
    fn used_surfaces(&mut self) -> BTreeSet<usize> {
        let mut primitives = BTreeSet::new();
        for root in self.roots() {
            // A missing root or an error below it has been reported.
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

    /// The bodies and the cutouts with their expanded trees.
    fn top_level_objects(&mut self, classes: &Classes) -> (Vec<Body>, Vec<Cutout>) {
        let (mut bodies, mut cutouts) = (Vec::new(), Vec::new());
        for tlo in std::mem::take(&mut self.tlos) {
            let definition = &self.forest.definitions[tlo.definition];
            let root = definition.root.ok_or(ExpandError::Graph(ForestError::Broken));
            let tree = root.and_then(|root| expand(&self.forest, classes, root)).unwrap_or_else(|error| {
                let message = format!("`{}` {error}", definition.name);
                self.report.meaning(tlo.span, message, "simplify the solid");
                Solid::Or(Vec::new())
            });
            match tlo.kind {
                TloKind::Body(body) => {
                    let maxh = body.maxh.or(definition.maxh);
                    bodies.push(Body { solid: tree, maxh, ..body });
                }
                TloKind::Cutout(cutout, of_surface) => match self.first_surface(classes, of_surface) {
                    Some(surface) => cutouts.push(Cutout { solid: tree, surface, ..cutout }),
                    None => {
                        let message = "this solid has no surface";
                        self.report.meaning(tlo.span, message, "name a solid with at least one primitive");
                    }
                },
            }
        }
        (bodies, cutouts)
    }

    /// Seams at smooth joints of extrusion paths: the surfaces before and after are tangent there.
    fn joints(&self, classes: &Classes) -> Vec<Seam> {
        let mut seams = BTreeMap::new();
        for Primitive { surfaces, joints, .. } in &self.forest.primitives {
            for Joint { sides, plane } in &**joints {
                let id = |index: usize| classes.id(surfaces.start + index);
                if let ([Some(a), Some(b)], Some(plane)) = (sides.map(id), id(*plane))
                    && a != b
                {
                    let (pair, surfaces) = ([a.min(b), a.max(b)], [a.min(plane), a.max(plane)]);
                    seams.entry(pair).or_insert(Seam { pair, surfaces, residual: None, is_complete: true });
                }
            }
        }
        seams.into_values().collect()
    }

    /// Warns of cutouts on surfaces that bound no body.
    fn warn_of_idle_cutouts(&mut self, bodies: &[Body], cutouts: &[Cutout]) {
        let mut of_bodies = BTreeSet::new();
        bodies.iter().for_each(|body| surfaces_of(&body.solid, &mut of_bodies));
        for cutout in cutouts.iter().filter(|cutout| !of_bodies.contains(&cutout.surface)) {
            let message = "this surface bounds no body: the top-level object has no effect";
            self.report.warn(
                cutout.span,
                message,
                "`tlo SOLID SURFACE` splits a surface of a body, it does not add one",
            );
        }
    }

    /// The identifications in terms of unified surfaces.
    fn identifications(&mut self, classes: &Classes) -> Vec<Identification> {
        let mut identifications = Vec::new();
        for (definitions, solids, span) in std::mem::take(&mut self.identifications) {
            let [first, second] = definitions.map(|definition| self.first_surface(classes, definition));
            match (first, second) {
                (Some(first), Some(second)) if first != second => {
                    identifications.push(Identification { surfaces: [first, second], solids, span });
                }
                (Some(_), Some(_)) => {
                    let message =
                        format!("the first surfaces of `{}` and `{}` are the same", solids[0], solids[1]);
                    self.report.meaning(span, message, "name two different surfaces");
                }
                (first, _) => {
                    let name = &solids[usize::from(first.is_some())];
                    let message = format!("the first surface of `{name}` bounds no body");
                    self.report.meaning(span, message, "name solids whose surfaces are boundaries of bodies");
                }
            }
        }
        identifications
    }

    /// The first surface of a definition, in file order.
    fn first_surface(&self, classes: &Classes, definition: usize) -> Option<SurfaceId> {
        let root = self.forest.definitions[definition].root?;
        let surfaces = self.forest.surfaces_of(root).ok()?;
        classes.id(*surfaces.first()?)
    }

    /// The singularities in terms of unified surfaces.
    fn singularities(&mut self, classes: &Classes, bodies: &[Body]) -> Vec<Singularity> {
        let of_bodies = |raw: Vec<usize>| raw.into_iter().filter_map(|i| classes.id(i)).collect::<Vec<_>>();
        let mut singularities = Vec::new();
        for tag in std::mem::take(&mut self.singularities) {
            let body_of = |tlo: usize| bodies.iter().position(|body| body.number == tlo as u32 + 1);
            let body = tag.tlo.and_then(body_of).map(BodyId::new);
            let mut lists = tag.surfaces.into_iter().map(of_bodies);
            let place = match (lists.next(), lists.next(), lists.next(), body) {
                (Some(first), Some(second), Some(third), _) => {
                    SingularPlace::Point { surfaces: [first, second, third] }
                }
                (Some(first), Some(second), None, body) => {
                    SingularPlace::Edge { surfaces: [first, second], body }
                }
                (Some(surfaces), None, None, Some(body)) => SingularPlace::Face { surfaces, body },
                _ => continue,
            };
            singularities.push(Singularity { place, factor: tag.factor, maxh: tag.maxh, span: tag.span });
        }
        singularities
    }

    /// The overrides in terms of unified surfaces; warns of those without effect.
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

    /// Warns of surfaces that were taken as one although they are apart, once per pair of solids.
    fn warn_of_gaps(&mut self, classes: &Classes) {
        let mut warned = BTreeSet::new();
        for &(i, gap) in classes.gaps() {
            let [first, own] = [classes.first(i), i].map(|i| &self.forest.surfaces[i].info);
            if warned.insert((first.solid.clone(), own.solid.clone())) {
                let (line, span) = (first.span.line, own.span);
                let message = format!(
                    "a surface of `{}` is {gap:.1e} from one of `{}` (line {line}): both are taken as one",
                    own.solid, first.solid
                );
                self.report.warn(span, message, "move one of them further away if both are meant");
            }
        }
    }

    /// Warns of boundary numbers and names without effect, because the surface belongs to an
    /// earlier primitive.
    fn warn_of_lost_numbers(&mut self, classes: &Classes, used: &BTreeSet<usize>) {
        let mut warned = BTreeSet::new();
        for &i in used {
            let [first, own] = [classes.first(i), i].map(|i| &self.forest.surfaces[i].info);
            let loses = (own.bc.is_some() && own.bc != first.bc)
                || (own.bc_name.is_some() && own.bc_name != first.bc_name);
            if loses && warned.insert((first.solid.clone(), own.solid.clone())) {
                let (line, span) = (first.span.line, own.span);
                let message = format!(
                    "a surface of `{}` is also one of `{}` (line {line}), whose -bc and -bcname apply to both",
                    own.solid, first.solid
                );
                let help = "use `boundarycondition` and `boundaryconditionname` to set them per body";
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
