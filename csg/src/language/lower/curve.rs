//! Lowers curves, and the solids swept along or around them.

use super::conic::Piece;
use super::primitive::{LARGEST_LENGTH, Shape, direction};
use super::swept::SweepError;
use super::{Lowering, extrusion, revolution};
use crate::Vector;
use crate::geometry::Span;
use crate::language::ast::{CurveText, Name, Num, Primitive, Segment};
use crate::language::diagnostic::Reported;
use crate::language::suggest::did_you_mean;

/// Index of the plane curves.
const IN_PLANE: usize = 0;
/// Index of the space curves.
const IN_SPACE: usize = 1;

/// Largest distance between the ends of a closed profile, as in NETGEN.
const CLOSED: f64 = 1e-7;

/// Consecutive segments; never empty.
#[derive(Clone, Debug)]
pub(super) struct Curve {
    pieces: Vec<Piece>,
}

/// A swept solid or the reason why it cannot be meshed, and the number of segments of its profile.
type Swept = (Result<Shape, String>, usize);

impl Curve {
    /// The first and the last point.
    fn ends(&self) -> [Vector; 2] {
        [self.pieces[0].ends()[0], self.pieces[self.pieces.len() - 1].ends()[1]]
    }

    fn is_closed(&self) -> bool {
        let [first, last] = self.ends();
        (first - last).amax() < CLOSED
    }

    /// Whether both ends are on the axis of a revolution or below it.
    fn is_on_axis(&self) -> bool {
        self.ends().iter().all(|end| end.y <= 0.0)
    }
}

impl Lowering<'_> {
    /// `curve2d` or `curve3d`
    pub(super) fn define_curve(
        &mut self,
        name: &Name,
        text: &CurveText,
        in_space: bool,
    ) -> Result<(), Reported> {
        let checked = self.check_segments(text);
        let curves = &mut self.curves[if in_space { IN_SPACE } else { IN_PLANE }];
        curves.insert(name.text.clone(), checked.clone().ok());
        checked.map(drop)
    }

    fn check_segments(&mut self, text: &CurveText) -> Result<Curve, Reported> {
        let place = |&i: &usize| Vector::from_fn(|axis, _| text.points[i].get(axis).copied().unwrap_or(0.0));
        let mut pieces = Vec::new();
        let mut end: Option<usize> = None;
        for segment in &text.segments {
            let indices = self.segment_points(segment, text.points.len())?;
            let start = indices[0];
            if let Some(end) = end
                && end != start
                && text.points[end] != text.points[start]
            {
                let message = format!(
                    "this segment begins at point {}, but the one before ends at {}",
                    start + 1,
                    end + 1
                );
                return Err(self.report.meaning(
                    segment.kind.span,
                    message,
                    "each segment begins where the previous one ends",
                ));
            }
            end = indices.last().copied();
            let points: Vec<Vector> = indices.iter().map(place).collect();
            if points.windows(2).any(|two| two[0] == two[1]) {
                let message = "two consecutive points of this segment coincide";
                return Err(self.report.meaning(
                    segment.kind.span,
                    message,
                    "consecutive points of a segment must differ",
                ));
            }
            if points.iter().any(|p| p.amax() > LARGEST_LENGTH) {
                let message = format!("a coordinate is larger than {LARGEST_LENGTH:e}");
                return Err(self.report.meaning(segment.kind.span, message, "choose another unit of length"));
            }
            pieces.push(Piece::new(&points));
        }
        Ok(Curve { pieces })
    }

    /// The point indices of a segment, from 0.
    fn segment_points(&mut self, segment: &Segment, count: usize) -> Result<Vec<usize>, Reported> {
        let Num { value, span } = segment.kind;
        let help = "a segment is `2, i, j` (a line) or `3, i, j, k` (a conic with control point j)";
        if value == 4.0 {
            let message = "segments of kind 4 have no tangents and cannot bound a solid";
            return Err(self.report.meaning(span, message, help));
        }
        if !((value == 2.0 || value == 3.0) && segment.points.len() as f64 == value) {
            let message = format!("there is no segment of kind {value} with {} points", segment.points.len());
            return Err(self.report.meaning(span, message, help));
        }
        let mut indices = Vec::new();
        for number in &segment.points {
            if number.value.fract() != 0.0 || !(1.0..=count as f64).contains(&number.value) {
                let message = format!("there is no point {} in this curve", number.value);
                let help = format!("its points have the numbers 1 to {count}");
                return Err(self.report.meaning(number.span, message, &help));
            }
            indices.push(number.value as usize - 1);
        }
        Ok(indices)
    }

    /// Lowers an extrusion or a revolution; `None` for other primitives.
    pub(super) fn swept(&mut self, primitive: &Primitive, span: Span) -> Result<Option<Swept>, Reported> {
        let (profile, shape) = match primitive {
            Primitive::Extrusion { path, profile, up } => {
                let path = self.curve_named(path, IN_SPACE)?;
                let curve = self.curve_named(profile, IN_PLANE)?;
                let Some(up) = direction(up) else {
                    let help = "give the direction in space of the profile's y axis";
                    return Err(self.report.meaning(span, "the vector of `extrusion` is zero", help));
                };
                if !curve.is_closed() {
                    let message = "the profile of `extrusion` is open";
                    return Err(self.report.meaning(
                        profile.span,
                        message,
                        "it must return to its first point",
                    ));
                }
                let shape = extrusion::shape(&path.pieces, &curve.pieces, up);
                (curve, shape)
            }
            Primitive::Revolution { from, to, profile } => {
                let curve = self.curve_named(profile, IN_PLANE)?;
                if !curve.is_closed() && !curve.is_on_axis() {
                    let message = "the profile of `revolution` is open, and not closed by the axis either";
                    let help = "it must return to its first point, or begin and end at y = 0";
                    return Err(self.report.meaning(profile.span, message, help));
                }
                let Some(axis) = direction(&(to - from)) else {
                    let message = "the two points on the axis of `revolution` coincide";
                    return Err(self.report.meaning(span, message, "two different points define the axis"));
                };
                let shape = revolution::shape(from.coords, axis, &curve.pieces);
                (curve, shape)
            }
            _ => return Ok(None),
        };
        match shape {
            Ok(shape) => Ok(Some((Ok(shape), profile.pieces.len()))),
            Err(SweepError::Unsupported(message)) => Ok(Some((Err(message), profile.pieces.len()))),
            Err(SweepError::Wrong(message, help)) => Err(self.report.meaning(span, message, help)),
        }
    }

    fn curve_named(&mut self, name: &Name, dimension: usize) -> Result<Curve, Reported> {
        if let Some(known) = self.curves[dimension].get(&name.text) {
            return known.clone().ok_or(Reported);
        }
        let kind = if dimension == IN_PLANE { "curve2d" } else { "curve3d" };
        let other = self.curves[1 - dimension].contains_key(&name.text);
        let mut help = did_you_mean(&name.text, self.curves[dimension].keys().map(String::as_str));
        if other {
            help = "an extrusion takes a curve3d (the path) first, then a curve2d (the profile)".into();
        } else if help.is_empty() {
            help = "a curve must be defined before it is used".into();
        }
        Err(self.report.meaning(name.span, format!("there is no {kind} `{}`", name.text), &help))
    }
}
