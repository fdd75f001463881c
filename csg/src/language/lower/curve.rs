//! Curves, and the solids swept along or around them: checked, not meshed yet.

use super::Lowering;
use crate::geometry::Span;
use crate::language::ast::{CurveText, Name, Num, Primitive, Segment};
use crate::language::diagnostic::Reported;
use crate::language::suggest::did_you_mean;

/// Index of the curves of the plane.
const IN_PLANE: usize = 0;
/// Index of the curves of space.
const IN_SPACE: usize = 1;

/// How far the ends of a closed profile may lie apart, as in NETGEN.
const CLOSED: f64 = 1e-7;

/// What is needed to check the uses of a curve.
#[derive(Clone, Debug)]
pub(super) struct Curve {
    segments: usize,
    /// Its first and its last point.
    ends: [Vec<f64>; 2],
}

impl Curve {
    fn is_closed(&self) -> bool {
        let [first, last] = &self.ends;
        first.iter().zip(last).all(|(a, b)| (a - b).abs() < CLOSED)
    }

    /// Whether both ends are on the axis of a revolution, or beyond.
    fn is_on_axis(&self) -> bool {
        self.ends.iter().all(|end| end[1] <= 0.0)
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
        let mut first = None;
        let mut end: Option<usize> = None;
        for segment in &text.segments {
            let indices = self.segment_points(segment, text.points.len())?;
            let start = indices[0];
            if let Some(end) = end
                && end != start
                && text.points[end] != text.points[start]
            {
                let message =
                    format!("this segment begins at point {}, the one before ends at {}", start + 1, end + 1);
                return Err(self.report.meaning(segment.kind.span, message, "segments follow one another"));
            }
            first = first.or(Some(start));
            end = indices.last().copied();
        }
        let point = |index: Option<usize>| index.map_or_else(Vec::new, |i| text.points[i].clone());
        Ok(Curve { segments: text.segments.len(), ends: [point(first), point(end)] })
    }

    /// The points of a segment, from 0.
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

    /// For an extrusion or a revolution its name and how many surfaces it has; `None` for other primitives.
    pub(super) fn swept(
        &mut self,
        primitive: &Primitive,
        span: Span,
    ) -> Result<Option<(&'static str, usize)>, Reported> {
        match primitive {
            Primitive::Extrusion { path, profile, up } => {
                self.curve_named(path, IN_SPACE)?;
                let segments = self.curve_named(profile, IN_PLANE)?.segments;
                if up.amax() == 0.0 {
                    let help = "it is the direction in space of the profile's y";
                    return Err(self.report.meaning(span, "the vector of `extrusion` is zero", help));
                }
                Ok(Some(("extrusion", segments)))
            }
            Primitive::Revolution { from, to, profile } => {
                let curve = self.curve_named(profile, IN_PLANE)?;
                if !curve.is_closed() && !curve.is_on_axis() {
                    let message = "the profile of `revolution` is open, and not closed by the axis either";
                    let help = "it returns to its first point, or begins and ends at y = 0";
                    return Err(self.report.meaning(profile.span, message, help));
                }
                if from == to {
                    let message = "the two points on the axis of `revolution` coincide";
                    return Err(self.report.meaning(span, message, "they give the direction of the axis"));
                }
                Ok(Some(("revolution", curve.segments)))
            }
            _ => Ok(None),
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
            help = "an extrusion takes a curve of space first, then one of the plane".into();
        } else if help.is_empty() {
            help = "a curve must be defined before it is used".into();
        }
        Err(self.report.meaning(name.span, format!("there is no {kind} `{}`", name.text), &help))
    }
}
