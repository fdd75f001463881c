//! An ellipse in a plane: (u²/a² + v²/b² - 1)·s/2, with u, v along its axes and s the shorter
//! semi-axis.

use super::quadric::nearest_on_ellipsoid;
use crate::Interval;
use std::f64::consts::PI;

/// An ellipse in a plane with coordinates (x, y).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ellipse {
    /// The center.
    pub center: [f64; 2],
    /// Unit direction of the first axis; the second is perpendicular, counterclockwise.
    pub axis: [f64; 2],
    /// The semi-axes in the directions of both axes, positive.
    pub radii: [f64; 2],
}

impl Ellipse {
    fn scale(&self) -> f64 {
        self.radii[0].min(self.radii[1])
    }

    /// The coordinates of a point along the axes, relative to the center.
    fn local(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let ([p, q], [c, s]) = ([x - self.center[0], y - self.center[1]], self.axis);
        [c * p + s * q, c * q - s * p]
    }

    fn global(&self, [u, v]: [f64; 2]) -> [f64; 2] {
        let [c, s] = self.axis;
        [self.center[0] + c * u - s * v, self.center[1] + s * u + c * v]
    }

    pub(crate) fn value(&self, at: [f64; 2]) -> f64 {
        let [u, v] = self.local(at);
        ((u / self.radii[0]).powi(2) + (v / self.radii[1]).powi(2) - 1.0) * (0.5 * self.scale())
    }

    pub(crate) fn gradient(&self, at: [f64; 2]) -> [f64; 2] {
        let ([u, v], [a, b], [c, s]) = (self.local(at), self.radii, self.axis);
        let [gu, gv] = [u / (a * a), v / (b * b)].map(|g| g * self.scale());
        [c * gu - s * gv, s * gu + c * gv]
    }

    /// The second derivatives (xx, xy, yy).
    pub(crate) fn hessian(&self) -> [f64; 3] {
        let ([a, b], [c, s]) = (self.radii, self.axis);
        let [p, q] = [1.0 / (a * a), 1.0 / (b * b)].map(|h| h * self.scale());
        [c * c * p + s * s * q, c * s * (p - q), s * s * p + c * c * q]
    }

    fn local_range(&self, [x, y]: [Interval; 2]) -> [Interval; 2] {
        let [p, q] = [x - Interval::point(self.center[0]), y - Interval::point(self.center[1])];
        let [c, s] = self.axis;
        [p * c + q * s, q * c - p * s]
    }

    pub(crate) fn value_range(&self, at: [Interval; 2]) -> Interval {
        let [u, v] = self.local_range(at);
        let square = |w: Interval, r: f64| (w / Interval::point(r)).square();
        (square(u, self.radii[0]) + square(v, self.radii[1]) - Interval::point(1.0)) * (0.5 * self.scale())
    }

    pub(crate) fn gradient_range(&self, [x, y]: [Interval; 2]) -> [Interval; 2] {
        // The second derivatives are rounded numbers; this is the range for the rounded function.
        let [p, q] = [x - Interval::point(self.center[0]), y - Interval::point(self.center[1])];
        let [xx, xy, yy] = self.hessian();
        [p * xx + q * xy, p * xy + q * yy]
    }

    /// The nearest point of the ellipse.
    pub(crate) fn nearest(&self, at: [f64; 2]) -> [f64; 2] {
        self.global(nearest_on_ellipsoid(self.local(at), self.radii))
    }

    /// The support point in a direction.
    pub(crate) fn support(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let [c, s] = self.axis;
        let arms = [(c * x + s * y) * self.radii[0], (c * y - s * x) * self.radii[1]];
        let length = arms[0].hypot(arms[1]);
        let share = if length > 0.0 { arms.map(|arm| arm / length) } else { [1.0, 0.0] };
        self.global([share[0] * self.radii[0], share[1] * self.radii[1]])
    }

    /// The point at a parameter: the angle in the ellipse scaled to a circle, counterclockwise from
    /// the first axis.
    pub fn point(&self, angle: f64) -> [f64; 2] {
        let (sin, cos) = angle.sin_cos();
        self.global([cos * self.radii[0], sin * self.radii[1]])
    }

    /// The parameter of a point, in [-π, π].
    pub fn angle(&self, at: [f64; 2]) -> f64 {
        let [u, v] = self.local(at);
        (v / self.radii[1]).atan2(u / self.radii[0])
    }

    /// The part with x ≥ 0: the parameter of its middle and the half-width of its parameter range.
    ///
    /// `None` if the whole ellipse has x > 0; the half-width is 0 if no point has.
    pub fn right_part(&self) -> Option<(f64, f64)> {
        let [c, s] = self.axis;
        let (along, across) = (c * self.radii[0], -s * self.radii[1]);
        let reach = along.hypot(across);
        let half = (-self.center[0] / reach).clamp(-1.0, 1.0).acos();
        (half < PI).then(|| (across.atan2(along), half))
    }
}
