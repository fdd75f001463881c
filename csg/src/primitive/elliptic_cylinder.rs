//! The cylinder over an ellipse: (Σ (dᵢ/rᵢ)² - 1)·r/2, with r the shorter semi-axis.

use super::ellipsoid::linear_range;
use super::quadric::{largest_curvature, nearest_on_ellipsoid};
use super::{EllipticCylinder, Primitive};
use crate::interval::{Cell, Interval, dot, offset};
use crate::{Point, ProjectionFailed, Vector};
use nalgebra::{Isometry3, Matrix3};

impl EllipticCylinder {
    fn scale(&self) -> f64 {
        self.radii[0].min(self.radii[1])
    }

    /// The unit direction of the axis.
    pub fn axis(&self) -> Vector {
        self.axes[0].cross(&self.axes[1]).normalize()
    }
}

impl Primitive for EllipticCylinder {
    fn value(&self, point: &Point) -> f64 {
        let arm = point - self.point;
        let [x, y] = [0, 1].map(|i| (arm.dot(&self.axes[i]) / self.radii[i]).powi(2));
        (x + y - 1.0) * (0.5 * self.scale())
    }

    fn gradient(&self, point: &Point) -> Vector {
        let arm = point - self.point;
        let terms = [0, 1].map(|i| self.axes[i] * (arm.dot(&self.axes[i]) / self.radii[i].powi(2)));
        (terms[0] + terms[1]) * self.scale()
    }

    fn hessian(&self, _point: &Point) -> Matrix3<f64> {
        let terms = [0, 1].map(|i| self.axes[i] * self.axes[i].transpose() / self.radii[i].powi(2));
        (terms[0] + terms[1]) * self.scale()
    }

    fn curvature(&self, point: &Point) -> f64 {
        largest_curvature(&self.gradient(point), &self.hessian(point))
    }

    fn project(&self, point: &Point) -> Result<Point, ProjectionFailed> {
        let arm = point - self.point;
        let y = [0, 1].map(|i| arm.dot(&self.axes[i]));
        let x = nearest_on_ellipsoid(y, self.radii);
        Ok(point + self.axes[0] * (x[0] - y[0]) + self.axes[1] * (x[1] - y[1]))
    }

    fn natural_range(&self, cell: &Cell) -> Interval {
        let arm = offset(cell, &self.point);
        let [x, y] = [0, 1].map(|i| (dot(&self.axes[i], &arm) / Interval::point(self.radii[i])).square());
        (x + y - Interval::point(1.0)) * (0.5 * self.scale())
    }

    fn gradient_range(&self, cell: &Cell) -> Cell {
        linear_range(&self.hessian(&self.point), &offset(cell, &self.point))
    }

    fn transformed(&self, motion: &Isometry3<f64>) -> Self {
        Self {
            point: motion * self.point,
            axes: self.axes.map(|axis| (motion * axis).normalize()),
            radii: self.radii,
        }
    }
}
