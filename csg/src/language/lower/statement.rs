//! Lowers the other statements.

use super::flags::Flags;
use super::primitive::LARGEST_LENGTH;
use super::{Lowering, Singularity, Tlo, TloKind};
use crate::geometry::{Aabb, Body, Cutout, Span, SurfaceId, UserPoint};
use crate::language::ast::{Flag, Name, Statement};
use crate::language::diagnostic::Reported;
use crate::{Point, Solid};

impl Lowering<'_> {
    pub(super) fn statement(&mut self, statement: &Statement) -> Result<(), Reported> {
        match statement {
            Statement::Solid { name, body, flags } => self.define_solid(name, body, flags),
            Statement::Broken { name } => {
                self.define_broken(name);
                Ok(())
            }
            Statement::Tlo { solid, surface: None, flags } => self.top_level_solid(solid, flags),
            Statement::Tlo { solid, surface: Some(surface), flags } => {
                self.top_level_surface(solid, surface, flags)
            }
            Statement::Curve2d { name, text } => self.define_curve(name, text, false),
            Statement::Curve3d { name, text } => self.define_curve(name, text, true),
            Statement::BoundingBox { min, max, span } => self.bounding_box(min, max, *span),
            Statement::UserPoint { point, flags, span } => self.user_point(point, flags, *span),
            Statement::IdentifyPeriodic { solids, span } => {
                let [first, second] = solids;
                let definitions = [self.solid_named(first)?, self.solid_named(second)?];
                let names = [first.text.clone(), second.text.clone()];
                self.identifications.push((definitions, names, *span));
                Ok(())
            }
            Statement::IdentifyCloseSurfaces { solids, flags, span } => {
                self.known_with_surfaces(solids)?;
                let known = ["tlo", "direction", "reflevels", "reflevels1", "reflevels2", "slices"];
                let flags = Flags::new(flags, &known, &[], &self.solid_names, self.report);
                if let (Some(tlo), Some(span)) = (flags.word("tlo", self.report), flags.span("tlo")) {
                    self.tlo_named(&Name { text: tlo.to_owned(), span })?;
                }
                let message =
                    "`identify closesurfaces` is ignored: it means prisms, and tetmill makes tets only";
                let help = "sizes become smaller between near surfaces, so that the gap is meshed with tets";
                self.report.warn(*span, message, help);
                Ok(())
            }
            Statement::SingularFace { tlo, solid, flags, span } => {
                let tlo = self.tlo_named(tlo)?;
                self.singular(std::slice::from_ref(solid), Some(tlo), flags, *span)
            }
            Statement::SingularEdge { solids, flags, span } => self.singular(solids, None, flags, *span),
            Statement::SingularPoint { solids, flags, span } => self.singular(solids, None, flags, *span),
            Statement::Boundary { solid, tlo, number } => self.boundary_number(solid, tlo, *number),
            Statement::BoundaryName { solid, tlo, word } => self.boundary_name(solid, tlo, word),
            Statement::Constant { name } => {
                let help = "constants cannot be used as values, and no identification needs a tolerance";
                let message = format!("the constant `{}` has no effect", name.text);
                self.report.warn(name.span, message, help);
                Ok(())
            }
        }
    }

    fn known_with_surfaces(&mut self, solids: &[Name]) -> Result<(), Reported> {
        for name in solids {
            self.solid_named(name)?;
        }
        Ok(())
    }

    /// `tlo solid flags;`
    fn top_level_solid(&mut self, name: &Name, flags: &[Flag]) -> Result<(), Reported> {
        const ON_SOLID: &str =
            "it belongs on the `solid`; `boundarycondition` numbers the boundaries of a tlo";
        let known = ["col", "transparent", "material", "layer", "maxh"];
        let flags = Flags::new(
            flags,
            &known,
            &[("bc", ON_SOLID), ("bcname", ON_SOLID)],
            &self.solid_names,
            self.report,
        );
        let definition = self.solid_named(name)?;
        let same = |tlo: &&Tlo| tlo.definition == definition && matches!(tlo.kind, TloKind::Body(_));
        if let Some(first) = self.tlos.iter().find(same) {
            let message =
                format!("`{}` is already a top-level object, in line {}", name.text, first.span.line);
            return Err(self.report.meaning(
                name.span,
                message,
                "remove one of the two `tlo`: bodies must not overlap",
            ));
        }
        let body = Body {
            name: name.text.clone(),
            solid: Solid::Or(Vec::new()),
            number: self.tlos.len() as u32 + 1,
            maxh: flags.maxh(self.report),
            material: flags.word("material", self.report).map(str::to_owned),
            color: flags.color(self.report),
            transparent: flags.is_set("transparent", self.report),
            layer: flags.layer(self.report).unwrap_or(1),
            span: name.span,
        };
        let body_of = |tlo: &'_ Tlo| match &tlo.kind {
            TloKind::Body(body) => Some((body.name.clone(), body.layer)),
            TloKind::Cutout(..) => None,
        };
        if let Some((other, layer)) = self.tlos.iter().find_map(body_of)
            && layer != body.layer
        {
            let message = format!("`{other}` and `{}` are in different layers", body.name);
            self.report.warn(name.span, message, "layers are ignored: all bodies are meshed conformingly");
        }
        self.tlos.push(Tlo { definition, kind: TloKind::Body(body), span: name.span });
        Ok(())
    }

    /// `tlo solid surface flags;`
    fn top_level_surface(&mut self, name: &Name, surface: &Name, flags: &[Flag]) -> Result<(), Reported> {
        let known = ["col", "transparent", "maxh", "layer", "bc", "bcname"];
        let idle = [("material", "surfaces have no material")];
        let flags = Flags::new(flags, &known, &idle, &self.solid_names, self.report);
        let definition = self.solid_named(name)?;
        let of_surface = self.solid_named(surface)?;
        let one_value = "a surface has one -bc and one -bcname, not a list";
        let cutout = Cutout {
            name: name.text.clone(),
            solid: Solid::Or(Vec::new()),
            surface: SurfaceId(0),
            number: self.tlos.len() as u32 + 1,
            maxh: flags.maxh(self.report),
            bc: flags.boundary_numbers(self.report).and_then(|number| {
                number.single().ok_or_else(|| self.report.meaning(name.span, one_value, "")).ok()
            }),
            bc_name: flags.boundary_names(self.report).and_then(|word| {
                word.single().ok_or_else(|| self.report.meaning(name.span, one_value, "")).ok()
            }),
            span: name.span,
        };
        self.tlos.push(Tlo { definition, kind: TloKind::Cutout(cutout, of_surface), span: surface.span });
        Ok(())
    }

    fn bounding_box(&mut self, min: &Point, max: &Point, span: Span) -> Result<(), Reported> {
        if (0..3).any(|i| min[i] >= max[i]) {
            let help = "give the corner with the smallest coordinates first";
            return Err(self.report.meaning(span, "the box of `boundingbox` is empty", help));
        }
        if self.stated_box.is_some() {
            self.report.warn(span, "this `boundingbox` replaces an earlier one", "");
        }
        self.stated_box = Some(Aabb { min: *min, max: *max });
        Ok(())
    }

    fn user_point(&mut self, point: &Point, flags: &[Flag], span: Span) -> Result<(), Reported> {
        let flags = Flags::new(flags, &["factor"], &[], &self.solid_names, self.report);
        if flags.has_factor(self.report) {
            self.report.warn(span, "the -factor of the point has no effect", ONLY_HP);
        }
        if point.coords.amax() > LARGEST_LENGTH {
            let message = format!("a coordinate is larger than {LARGEST_LENGTH:e}");
            return Err(self.report.meaning(span, message, "choose another unit of length"));
        }
        self.user_points.push(UserPoint { point: *point, span });
        Ok(())
    }

    /// `singular face`, `singular edge` or `singular point`, distinguished by the number of solids.
    fn singular(
        &mut self,
        solids: &[Name],
        tlo: Option<usize>,
        flags: &[Flag],
        span: Span,
    ) -> Result<(), Reported> {
        let is_edge = solids.len() == 2;
        let known: &[&str] = if is_edge { &["factor", "maxh", "tlo"] } else { &["factor"] };
        let idle =
            [("maxh", "it bounds the size along singular edges"), ("tlo", "it selects singular edges")];
        let flags =
            Flags::new(flags, known, if is_edge { &[] } else { &idle }, &self.solid_names, self.report);
        let mut surfaces = Vec::new();
        for solid in solids {
            let definition = self.solid_named(solid)?;
            let root = self.forest.definitions[definition].root.ok_or(Reported)?;
            surfaces.push(self.forest.surfaces_of(root).map_err(|_| Reported)?);
        }
        let tlo = match (flags.word("tlo", self.report), flags.span("tlo")) {
            (Some(tlo), Some(span)) if is_edge => Some(self.tlo_named(&Name { text: tlo.to_owned(), span })?),
            _ => tlo,
        };
        let factor = flags.factor(self.report).unwrap_or(1);
        let maxh = if is_edge { flags.maxh(self.report) } else { None };
        if maxh.is_none() {
            self.report.warn(span, "`singular` has no effect on the mesh", ONLY_HP);
        }
        self.singularities.push(Singularity { surfaces, tlo, factor, maxh, span });
        Ok(())
    }
}

/// The purpose of singularities, for help lines.
const ONLY_HP: &str = "it is for hp elements; the tetrahedral mesh is not graded";
