//! The double cone over an ellipse: (Σ (dᵢ/rᵢ)² - (1 + q h)²)·r/2, with h the height and r the
//! shorter semi-axis.

use super::ellipsoid::linear_range;
use super::quadric::{largest_curvature, nearest_on_cone};
use super::{EllipticCone, Primitive};
use crate::interval::{Cell, Interval, dot, offset};
use crate::{Point, ProjectionFailed, Vector};
use nalgebra::{Isometry3, Matrix3};

impl EllipticCone {
    /// The apex, where both nappes meet.
    pub fn apex(&self) -> Point {
        self.point - self.axis / self.rate
    }

    fn scale(&self) -> f64 {
        self.radii[0].min(self.radii[1])
    }
}

impl Primitive for EllipticCone {
    fn value(&self, point: &Point) -> f64 {
        let arm = point - self.point;
        let [x, y] = [0, 1].map(|i| (arm.dot(&self.axes[i]) / self.radii[i]).powi(2));
        (x + y - (1.0 + self.rate * arm.dot(&self.axis)).powi(2)) * (0.5 * self.scale())
    }

    fn gradient(&self, point: &Point) -> Vector {
        let arm = point - self.point;
        let terms = [0, 1].map(|i| self.axes[i] * (arm.dot(&self.axes[i]) / self.radii[i].powi(2)));
        let along = self.axis * (self.rate * (1.0 + self.rate * arm.dot(&self.axis)));
        (terms[0] + terms[1] - along) * self.scale()
    }

    fn hessian(&self, _point: &Point) -> Matrix3<f64> {
        let terms = [0, 1].map(|i| self.axes[i] * self.axes[i].transpose() / self.radii[i].powi(2));
        (terms[0] + terms[1] - self.axis * self.axis.transpose() * self.rate.powi(2)) * self.scale()
    }

    fn curvature(&self, point: &Point) -> f64 {
        largest_curvature(&self.gradient(point), &self.hessian(point))
    }

    fn project(&self, point: &Point) -> Result<Point, ProjectionFailed> {
        let arm = point - self.apex();
        let y = [arm.dot(&self.axes[0]), arm.dot(&self.axes[1]), arm.dot(&self.axis)];
        let x = nearest_on_cone(y, [self.radii[0], self.radii[1], 1.0 / self.rate.abs()]);
        let shift = [x[0] - y[0], x[1] - y[1], x[2] - y[2]];
        Ok(point + self.axes[0] * shift[0] + self.axes[1] * shift[1] + self.axis * shift[2])
    }

    fn natural_range(&self, cell: &Cell) -> Interval {
        let arm = offset(cell, &self.point);
        let [x, y] = [0, 1].map(|i| (dot(&self.axes[i], &arm) / Interval::point(self.radii[i])).square());
        let size = Interval::point(1.0) + dot(&self.axis, &arm) * self.rate;
        (x + y - size.square()) * (0.5 * self.scale())
    }

    fn gradient_range(&self, cell: &Cell) -> Cell {
        let linear = linear_range(&self.hessian(&self.point), &offset(cell, &self.point));
        [0, 1, 2].map(|i| linear[i] - Interval::point(self.axis[i]) * (self.rate * self.scale()))
    }

    fn transformed(&self, motion: &Isometry3<f64>) -> Self {
        Self {
            point: motion * self.point,
            axes: self.axes.map(|axis| (motion * axis).normalize()),
            axis: (motion * self.axis).normalize(),
            ..*self
        }
    }
}
