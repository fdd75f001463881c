//! Lowers definitions of solids and their expressions.

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

/// Rotations this close (radians) to a nonzero multiple of a right angle are made exact. Four
/// decimals are off by at most 1.5e-5 for up to a full turn (6.2832). The exact rotation gives a
/// rotated brick the same planes as its neighbor. An angle of 90.001 degrees (1.7e-5) is not
/// expected.
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
        // Only a redefined solid can contain itself, because names are known only after their
        // definition.
        if known.is_some()
            && let Err(ForestError::Cycle) = self.forest.post_order(root)
        {
            self.forest.definitions[index].root = None;
            let message = format!("the solid `{}` contains itself", name.text);
            return Err(self.report.meaning(name.span, message, "give the new solid another name"));
        }
        self.apply_flags(index, root, flags)
    }

    /// Declares a solid or curve with an error; using it gives no further error.
    pub(super) fn define_broken(&mut self, name: &Name) {
        for curves in &mut self.curves {
            curves.insert(name.text.clone(), None);
        }
        self.declare(name);
    }

    /// Adds a definition without a tree.
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
        let message = format!("`{}` is already defined in line {}", name.text, definition.span.line);
        definition.span = name.span;
        definition.maxh = None;
        definition.labelled = [false; 2];
        self.is_redefined = true;
        self.report.warn(name.span, message, "its earlier uses change too, as in NETGEN");
    }

    /// Assigns the flags of a definition to the surfaces below it; existing numbers and names are
    /// kept.
    fn apply_flags(&mut self, index: usize, root: NodeId, flags: &[Flag]) -> Result<(), Reported> {
        const ON_TLO: &str = "it belongs on the `tlo`";
        let idle = [("col", ON_TLO), ("transparent", ON_TLO), ("material", ON_TLO), ("layer", ON_TLO)];
        let flags = Flags::new(flags, &["maxh", "bc", "bcname"], &idle, &self.solid_names, self.report);
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
        // Skip definitions that already have all flags given here, so that a chain of definitions
        // with flags takes linear time. Lists must be counted, and after a redefinition nothing can
        // be skipped.
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
                self.report.warn(span, message, "give one value per surface, in file order");
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

    /// For each surface below `root`, its index in a list of boundary numbers (`NO_FACE` if it
    /// belongs to no segment), and the length of the list.
    ///
    /// Surfaces have one entry each, except that a single polyhedron counts by faces of the text,
    /// and swept solids count by segments of the profile.
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
                self.report.meaning(span, message, "nested transforms multiply the number of copies")
            }
            ForestError::Broken | ForestError::Cycle => Reported,
        })
    }

    /// Adds an expression that occurs in the definition of `solid`.
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

    /// Adds all members before failing, so that each reports its own error.
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
        // The motions of the copies, and whether the original is kept.
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
                // NETGEN's first copy is not rotated: it coincides with the original.
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
        let help = format!("give a number from 0 to {MOST_SURFACES}");
        Err(self.report.meaning(count.span, format!("there cannot be {} copies", count.value), &help))
    }

    fn translation(&mut self, shift: &Vector, times: f64, span: Span) -> Result<Isometry3<f64>, Reported> {
        let shift = shift * times;
        self.within_reach(&shift, span)?;
        Ok(Translation3::from(shift).into())
    }

    /// The rotation x ↦ c + Rz(γ) Rx(β) Rz(α) (x - c), each factor clockwise as seen from the tip
    /// of its axis.
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

    /// Warns, once per file, that copies do not have the flags of the original.
    fn warn_of_losses(&mut self, originals: &[usize], span: Span) {
        let infos = originals.iter().map(|&surface| &self.forest.surfaces[surface].info);
        let mut flagged = infos.filter(|i| i.maxh.is_some() || i.bc.is_some() || i.bc_name.is_some());
        if let (false, Some(info)) = (self.has_warned_of_losses, flagged.next()) {
            let message =
                format!("transformed copies do not inherit -bc, -bcname and -maxh from `{}`", info.solid);
            self.has_warned_of_losses = true;
            self.report.warn(span, message, "as in NETGEN; give flags to the solid defined here");
        }
    }
}

/// The nearby nonzero multiple of a right angle, or the angle itself.
fn snapped_to_right_angle(angle: f64) -> f64 {
    let quarters = (angle / FRAC_PI_2).round();
    let exact = quarters * FRAC_PI_2;
    if quarters != 0.0 && (angle - exact).abs() <= RIGHT_ANGLE_SNAP { exact } else { angle }
}
