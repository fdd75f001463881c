//! Definitions of solids and the expressions in them.

use nalgebra::{Isometry3, Translation3, UnitQuaternion};
use std::f64::consts::FRAC_PI_2;
use std::ops::Range;
use std::rc::Rc;

use super::Lowering;
use super::flags::{Flags, PerSurface};
use super::forest::{Definition, ForestError, MOST_SURFACES, Node, NodeId, Primitive, RawSurface};
use super::primitive::{self, LARGEST_LENGTH, Shape};
use super::swept::NO_FACE;
use crate::geometry::{Span, SurfaceInfo};
use crate::language::ast::{self, Expr, Flag, Name, Num, Transform};
use crate::language::diagnostic::Reported;
use crate::{Point, Solid, Vector};

/// How near to a multiple of a right angle (but zero) a rotation is that multiple, in radians. Four decimals
/// are at most 1.5e-5 off for a full turn or less (6.2832); the matrix is then exact to rounding, and a brick that was
/// turned has the same planes as its neighbour that was not. Nobody means 90.001 degrees (1.7e-5).
const RIGHT_ANGLE_SNAP: f64 = 1.6e-5;

impl Lowering<'_> {
    /// `solid name = body flags;`
    pub(super) fn define_solid(&mut self, name: &Name, body: &Expr, flags: &[Flag]) -> Result<(), Reported> {
        let root = self.expression(body, &name.text);
        let known = self.solids.get(&name.text).copied();
        let index = known.unwrap_or_else(|| self.declare(name));
        if known.is_some() {
            self.redefined(index, name);
        }
        self.forest.definitions[index].root = root.ok();
        let root = root?;
        // Only what is defined again can come into itself: names are known from their definition on.
        if known.is_some()
            && let Err(ForestError::Cycle) = self.forest.post_order(root)
        {
            self.forest.definitions[index].root = None;
            let message = format!("the solid `{}` is made of itself", name.text);
            return Err(self.report.meaning(name.span, message, "give the new solid a name of its own"));
        }
        self.apply_flags(index, root, flags)
    }

    /// A solid or curve that could not be read: using it gives no further error.
    pub(super) fn define_broken(&mut self, name: &Name) {
        for curves in &mut self.curves {
            curves.insert(name.text.clone(), None);
        }
        self.declare(name);
    }

    /// A new definition that has no tree yet.
    fn declare(&mut self, name: &Name) -> usize {
        let definition = Definition {
            name: name.text.clone(),
            span: name.span,
            root: None,
            maxh: None,
            labelled: [false; 2],
        };
        self.forest.definitions.push(definition);
        let index = self.forest.definitions.len() - 1;
        self.solids.insert(name.text.clone(), index);
        index
    }

    fn redefined(&mut self, index: usize, name: &Name) {
        let definition = &mut self.forest.definitions[index];
        let message = format!("`{}` was defined in line {} already", name.text, definition.span.line);
        definition.span = name.span;
        definition.maxh = None;
        definition.labelled = [false; 2];
        self.is_redefined = true;
        self.report.warn(name.span, message, "what was made of it before now changes too, as in NETGEN");
    }

    /// The flags of a definition go to the surfaces under it; what a surface already has, it keeps.
    fn apply_flags(&mut self, index: usize, root: NodeId, flags: &[Flag]) -> Result<(), Reported> {
        const ON_TLO: &str = "it belongs on the `tlo`";
        let idle = [("col", ON_TLO), ("transparent", ON_TLO), ("material", ON_TLO), ("layer", ON_TLO)];
        let flags = Flags::new(flags, &["maxh", "bc", "bcname"], &idle, self.report);
        let maxh = flags.maxh(self.report);
        let numbers = flags.boundary_numbers(self.report);
        let names = flags.boundary_names(self.report);
        self.forest.definitions[index].maxh = maxh;
        if maxh.is_none() && numbers.is_none() && names.is_none() {
            return Ok(());
        }
        let is_list = |length: Option<usize>| length.is_some();
        let lists = [
            numbers.as_ref().is_some_and(|n| is_list(n.len())),
            names.as_ref().is_some_and(|n| is_list(n.len())),
        ];
        let labels = [numbers.is_some(), names.is_some()];
        // Definitions that have all that is given here keep it: a chain of definitions with flags takes linear
        // time. Lists must be counted, and after a second definition nothing is sure.
        let must_walk = self.is_redefined || lists.contains(&true);
        let has_all = |d: &Definition| {
            let fine = maxh.is_none_or(|maxh| d.maxh.is_some_and(|known| known <= maxh));
            fine && (0..2).all(|i| d.labelled[i] || !labels[i])
        };
        let surfaces =
            self.forest.surfaces_except(root, |d| !must_walk && has_all(d)).map_err(|_| Reported)?;
        self.forest.definitions[index].labelled = [0, 1].map(|i| labels[i] && !lists[i]);
        let (entries, count) =
            if lists.contains(&true) { self.list_entries(root) } else { (vec![0; surfaces.len()], 1) };
        let lengths = [
            ("bc", numbers.as_ref().and_then(PerSurface::len)),
            ("bcname", names.as_ref().and_then(PerSurface::len)),
        ];
        for (flag, length) in lengths {
            if let (Some(length), Some(span)) = (length, flags.span(flag))
                && length != count
            {
                let message = format!("the list of -{flag} has {length} values for {count} surfaces");
                self.report.warn(span, message, "one value for each surface, in the order of the text");
            }
        }
        for (surface, entry) in surfaces.into_iter().zip(entries) {
            let info = &mut self.forest.surfaces[surface].info;
            if let Some(maxh) = maxh {
                info.maxh = Some(info.maxh.map_or(maxh, |known| known.min(maxh)));
            }
            if info.bc.is_none() {
                info.bc = numbers.as_ref().and_then(|numbers| numbers.get(entry)).copied();
            }
            if info.bc_name.is_none() {
                info.bc_name = names.as_ref().and_then(|names| names.get(entry)).cloned();
            }
        }
        Ok(())
    }

    /// For each of the surfaces under `root` its place in a list of boundary numbers, none for a surface that belongs to no
    /// segment, and how many places there are. A surface has a place of its own, except that those of a polyhedron alone
    /// count by faces of the text and those of swept solids by segments of the profile.
    fn list_entries(&self, root: NodeId) -> (Vec<usize>, usize) {
        let primitives = self.forest.primitives_of(root).unwrap_or_default();
        let (mut entries, mut count) = (Vec::new(), 0);
        for &index in &primitives {
            let Primitive { surfaces, segments, .. } = &self.forest.primitives[index];
            let faces = self.forest.surfaces[surfaces.clone()].iter().map(|raw| raw.face);
            let by_face = segments.is_some() || primitives.len() == 1;
            let places = faces.clone().max().map_or(0, |last| last.saturating_add(1));
            let entry = |(i, face): (usize, usize)| match (by_face, face) {
                (false, _) => count + i,
                (true, NO_FACE) => NO_FACE,
                (true, face) => count + face,
            };
            entries.extend(faces.enumerate().map(entry));
            count += if by_face { segments.unwrap_or(places) } else { surfaces.len() };
        }
        (entries, count)
    }

    fn add(&mut self, node: Node, span: Span) -> Result<NodeId, Reported> {
        let node = self.forest.add(node);
        self.located(node, span)
    }

    fn located<T>(&mut self, result: Result<T, ForestError>, span: Span) -> Result<T, Reported> {
        result.map_err(|error| match error {
            ForestError::TooLarge => {
                let message = format!("the primitives have more than {MOST_SURFACES} surfaces");
                self.report.meaning(span, message, "transforms within transforms multiply")
            }
            ForestError::Broken | ForestError::Cycle => Reported,
        })
    }

    /// Adds an expression in the definition of `solid`.
    fn expression(&mut self, expr: &Expr, solid: &str) -> Result<NodeId, Reported> {
        match expr {
            Expr::Primitive(primitive, span) => self.primitive(primitive, *span, solid),
            Expr::Transform(transform, span, inner) => {
                let inner = self.expression(inner, solid)?;
                self.transform(*transform, *span, inner, solid)
            }
            Expr::Name(name) => {
                let index = self.solid_named(name)?;
                if self.forest.definitions[index].root.is_none() {
                    return Err(Reported);
                }
                self.add(Node::Named(index), name.span)
            }
            Expr::Not(inner) => {
                let inner = self.expression(inner, solid)?;
                self.add(Node::Not(inner), Span::default())
            }
            Expr::And(members) => {
                let members = self.expressions(members, solid)?;
                self.add(Node::And(members), Span::default())
            }
            Expr::Or(members) => {
                let members = self.expressions(members, solid)?;
                self.add(Node::Or(members), Span::default())
            }
        }
    }

    /// All of them, so that each reports its own error.
    fn expressions(&mut self, members: &[Expr], solid: &str) -> Result<Vec<NodeId>, Reported> {
        let members: Vec<_> = members.iter().map(|member| self.expression(member, solid)).collect();
        members.into_iter().collect()
    }

    fn primitive(&mut self, primitive: &ast::Primitive, span: Span, solid: &str) -> Result<NodeId, Reported> {
        let info = SurfaceInfo { solid: solid.to_owned(), span, ..SurfaceInfo::default() };
        let first = self.forest.surfaces.len();
        let (shape, segments) = match self.swept(primitive, span)? {
            Some((swept, segments)) => (swept, Some(segments)),
            None => (Ok(primitive::shape(primitive, span, self.report)?), None),
        };
        let (inside, joints, unsupported) = match shape {
            Ok(Shape { surfaces, inside, faces, joints }) => {
                let raw = |(surface, face)| RawSurface { surface: Some(surface), info: info.clone(), face };
                self.forest.surfaces.extend(surfaces.into_iter().zip(faces).map(raw));
                (inside, joints, None)
            }
            Err(message) => {
                let raw = |face| RawSurface { surface: None, info: info.clone(), face };
                self.forest.surfaces.extend((0..segments.unwrap_or(0)).map(raw));
                (Solid::And(Vec::new()), Vec::new(), Some(message))
            }
        };
        let surfaces = Range { start: first, end: self.forest.surfaces.len() };
        let (inside, joints) = (Rc::new(inside), Rc::new(joints));
        self.forest.primitives.push(Primitive { surfaces, inside, unsupported, segments, joints, span });
        self.add(Node::Primitive(self.forest.primitives.len() - 1), span)
    }

    fn transform(
        &mut self,
        transform: Transform,
        span: Span,
        inner: NodeId,
        solid: &str,
    ) -> Result<NodeId, Reported> {
        let moved = |motion: Isometry3<f64>| vec![motion];
        // The copies to make, and whether the original stays.
        let (motions, keeps_original) = match transform {
            Transform::Translate(shift) => (moved(self.translation(&shift, 1.0, span)?), false),
            Transform::Rotate(center, angles) => (moved(self.rotation(&center, &angles, span)?), false),
            Transform::MultiTranslate(shift, count) => {
                let count = self.copies(count)?;
                let shifts = (1..=count).map(|i| self.translation(&shift, i as f64, span));
                (shifts.collect::<Result<_, _>>()?, true)
            }
            Transform::MultiRotate(center, angles, count) => {
                let motion = self.rotation(&center, &angles, span)?;
                // The first of the copies that NETGEN makes is not turned: it is the original again.
                let turns = self.copies(count)?.saturating_sub(1);
                let next = |last: &Isometry3<f64>| Some(last * motion);
                (std::iter::successors(Some(motion), next).take(turns).collect(), true)
            }
        };
        let surfaces = self.forest.surfaces_of(inner);
        let surfaces = self.located(surfaces, span)?;
        if self.forest.surfaces.len() + surfaces.len() * motions.len() > MOST_SURFACES {
            return self.located(Err(ForestError::TooLarge), span);
        }
        self.warn_of_losses(&surfaces, span);
        let mut members = if keeps_original { vec![inner] } else { Vec::new() };
        for motion in &motions {
            let copy = self.forest.copy(inner, motion, solid);
            members.push(self.located(copy, span)?);
        }
        if members.len() == 1 { Ok(members[0]) } else { self.add(Node::Or(members), span) }
    }

    fn copies(&mut self, count: Num) -> Result<usize, Reported> {
        if (0.0..=MOST_SURFACES as f64).contains(&count.value) {
            return Ok(count.value as usize);
        }
        let help = format!("a number from 0 to {MOST_SURFACES}");
        Err(self.report.meaning(count.span, format!("there cannot be {} copies", count.value), &help))
    }

    fn translation(&mut self, shift: &Vector, times: f64, span: Span) -> Result<Isometry3<f64>, Reported> {
        let shift = shift * times;
        self.within_reach(&shift, span)?;
        Ok(Translation3::from(shift).into())
    }

    /// x ↦ c + Rz(γ) Rx(β) Rz(α) (x - c), each turning clockwise as seen from the tip of its axis.
    fn rotation(&mut self, center: &Point, angles: &Vector, span: Span) -> Result<Isometry3<f64>, Reported> {
        self.within_reach(&center.coords, span)?;
        self.within_reach(angles, span)?;
        let clockwise =
            |axis, angle: f64| UnitQuaternion::from_axis_angle(&axis, -snapped_to_right_angle(angle));
        let [x, z] = [Vector::x_axis(), Vector::z_axis()];
        let turn = clockwise(z, angles.z) * clockwise(x, angles.y) * clockwise(z, angles.x);
        Ok(Isometry3::rotation_wrt_point(turn, *center))
    }

    fn within_reach(&mut self, vector: &Vector, span: Span) -> Result<(), Reported> {
        if vector.amax() <= LARGEST_LENGTH {
            return Ok(());
        }
        let message = format!("a number of this transform is larger than {LARGEST_LENGTH:e}");
        Err(self.report.meaning(span, message, "choose another unit of length"))
    }

    /// Copies have none of the flags of their original; said once a file.
    fn warn_of_losses(&mut self, originals: &[usize], span: Span) {
        let infos = originals.iter().map(|&surface| &self.forest.surfaces[surface].info);
        let mut flagged = infos.filter(|i| i.maxh.is_some() || i.bc.is_some() || i.bc_name.is_some());
        if let (false, Some(info)) = (self.losses_known, flagged.next()) {
            let message = format!("moved copies do not have the -bc, -bcname and -maxh of `{}`", info.solid);
            self.losses_known = true;
            self.report.warn(span, message, "as in NETGEN; give flags to the solid that is defined here");
        }
    }
}

/// The multiple of a right angle (but zero) that the angle stands for, or the angle.
fn snapped_to_right_angle(angle: f64) -> f64 {
    let quarters = (angle / FRAC_PI_2).round();
    let exact = quarters * FRAC_PI_2;
    if quarters != 0.0 && (angle - exact).abs() <= RIGHT_ANGLE_SNAP { exact } else { angle }
}
