//! The ellipsoid: (Σ (dᵢ/rᵢ)² - 1)·r/2, with r the shortest semi-axis, so the gradient has at most
//! unit length on it.

use super::quadric::{largest_curvature, nearest_on_ellipsoid};
use super::{Ellipsoid, Primitive};
use crate::interval::{Cell, Interval, dot, offset};
use crate::{Point, ProjectionFailed, Vector};
use nalgebra::{Isometry3, Matrix3};

impl Ellipsoid {
    /// The support point in a direction.
    pub(crate) fn support(&self, direction: &Vector) -> Point {
        let weights = [0, 1, 2].map(|i| self.radii[i] * direction.dot(&self.axes[i]));
        let length = weights.iter().map(|w| w * w).sum::<f64>().sqrt();
        (0..3).fold(self.center, |p, i| p + self.axes[i] * (self.radii[i] * weights[i] / length))
    }

    fn scale(&self) -> f64 {
        self.radii.iter().copied().fold(f64::INFINITY, f64::min)
    }
}

impl Primitive for Ellipsoid {
    fn value(&self, point: &Point) -> f64 {
        let arm = point - self.center;
        let [x, y, z] = [0, 1, 2].map(|i| (arm.dot(&self.axes[i]) / self.radii[i]).powi(2));
        (x + y + z - 1.0) * (0.5 * self.scale())
    }

    fn gradient(&self, point: &Point) -> Vector {
        let arm = point - self.center;
        let terms = [0, 1, 2].map(|i| self.axes[i] * (arm.dot(&self.axes[i]) / self.radii[i].powi(2)));
        (terms[0] + terms[1] + terms[2]) * self.scale()
    }

    fn hessian(&self, _point: &Point) -> Matrix3<f64> {
        let terms = [0, 1, 2].map(|i| self.axes[i] * self.axes[i].transpose() / self.radii[i].powi(2));
        (terms[0] + terms[1] + terms[2]) * self.scale()
    }

    fn curvature(&self, point: &Point) -> f64 {
        largest_curvature(&self.gradient(point), &self.hessian(point))
    }

    fn project(&self, point: &Point) -> Result<Point, ProjectionFailed> {
        let arm = point - self.center;
        let x = nearest_on_ellipsoid([0, 1, 2].map(|i| arm.dot(&self.axes[i])), self.radii);
        Ok(self.center + self.axes[0] * x[0] + self.axes[1] * x[1] + self.axes[2] * x[2])
    }

    fn natural_range(&self, cell: &Cell) -> Interval {
        let arm = offset(cell, &self.center);
        let [x, y, z] =
            [0, 1, 2].map(|i| (dot(&self.axes[i], &arm) / Interval::point(self.radii[i])).square());
        (x + y + z - Interval::point(1.0)) * (0.5 * self.scale())
    }

    fn gradient_range(&self, cell: &Cell) -> Cell {
        linear_range(&self.hessian(&self.center), &offset(cell, &self.center))
    }

    fn transformed(&self, motion: &Isometry3<f64>) -> Self {
        Self {
            center: motion * self.center,
            axes: self.axes.map(|axis| (motion * axis).normalize()),
            radii: self.radii,
        }
    }
}

/// The range of a linear gradient: the Hessian times the vector from the center.
///
/// The entries of the Hessian are rounded sums; each is widened by a few units in the last place of
/// the largest one.
pub(super) fn linear_range(hessian: &Matrix3<f64>, arm: &Cell) -> Cell {
    /// Rounding errors in an entry: a sum of three products of three rounded numbers.
    const ROUNDINGS: f64 = 16.0;
    let slack = ROUNDINGS * f64::EPSILON * hessian.amax();
    [0, 1, 2].map(|i| {
        (0..3).fold(Interval::point(0.0), |sum, j| {
            sum + arm[j] * Interval::new(hessian[(i, j)] - slack, hessian[(i, j)] + slack)
        })
    })
}
