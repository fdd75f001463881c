//! Parses `curve2d` and `curve3d`.

use super::{Parsed, Parser};
use crate::language::ast::{CurveText, Num, Segment, Statement};

impl Parser<'_, '_> {
    pub(super) fn curve(&mut self, in_space: bool) -> Parsed<Statement> {
        self.next();
        let name = self.name("a curve")?;
        self.usage = if in_space {
            "curve3d NAME = (POINTS; x, y, z; ...; SEGMENTS; 2, i, j; 3, i, j, k; ...);"
        } else {
            "curve2d NAME = (POINTS; x, y; ...; SEGMENTS; 2, i, j; 3, i, j, k; ...);"
        };
        self.mark('=')?;
        self.mark('(')?;
        let dimension = if in_space { 3 } else { 2 };
        let point_count = self.count("points")?;
        self.mark(';')?;
        let mut points = Vec::new();
        for i in 0..point_count {
            points.push(self.curve_point(dimension, i, point_count)?);
        }
        let segment_count = self.count("segments")?;
        if self.peek_mark(',') {
            let wanted = format!("`;` (the curve declares {point_count} points, but another follows)");
            return Err(self.expected(&wanted));
        }
        let mut segments = Vec::new();
        for _ in 0..segment_count {
            self.mark(';')?;
            segments.push(self.segment()?);
        }
        self.mark(')')?;
        let text = CurveText { points, segments };
        Ok(if in_space { Statement::Curve3d { name, text } } else { Statement::Curve2d { name, text } })
    }

    /// The coordinates of a point and the `;` after them.
    fn curve_point(&mut self, dimension: usize, done: u32, count: u32) -> Parsed<Vec<f64>> {
        let mut coordinates = vec![self.value()?];
        while coordinates.len() < dimension {
            if self.peek_mark(';') {
                let wanted = format!("`,` and another coordinate ({done} of {count} points are complete)");
                return Err(self.expected(&wanted));
            }
            self.mark(',')?;
            coordinates.push(self.value()?);
        }
        self.mark(';')?;
        Ok(coordinates)
    }

    fn count(&mut self, what: &str) -> Parsed<u32> {
        let Num { value, span } = self.number()?;
        if value < 1.0 || value > f64::from(u32::MAX) {
            let help = format!("write {}", self.usage);
            return Err(self.report.meaning(span, format!("a curve cannot have {value} {what}"), &help));
        }
        Ok(value as u32)
    }

    fn segment(&mut self) -> Parsed<Segment> {
        let kind = self.number()?;
        let mut points = Vec::new();
        while self.take_mark(',') {
            points.push(self.number()?);
        }
        Ok(Segment { kind, points })
    }
}
