//! The sphere: (|x - c|² - r²)/2r, with center c.

use super::{Primitive, Sphere};
use crate::interval::{Cell, Interval, offset};
use crate::{Point, ProjectionFailed, Vector};
use nalgebra::{Isometry3, Matrix3};

impl Primitive for Sphere {
    fn value(&self, point: &Point) -> f64 {
        let distance = (point - self.center).norm();
        // The difference of squares as a product, to avoid cancellation near the surface.
        (distance - self.radius) * (distance + self.radius) / (2.0 * self.radius)
    }

    fn gradient(&self, point: &Point) -> Vector {
        (point - self.center) / self.radius
    }

    fn hessian(&self, _point: &Point) -> Matrix3<f64> {
        Matrix3::identity() / self.radius
    }

    fn curvature(&self, _point: &Point) -> f64 {
        1.0 / self.radius
    }

    fn project(&self, point: &Point) -> Result<Point, ProjectionFailed> {
        let arm = point - self.center;
        let distance = arm.norm();
        if distance == 0.0 {
            return Err(ProjectionFailed(*point));
        }
        Ok(self.center + arm * (self.radius / distance))
    }

    fn natural_range(&self, cell: &Cell) -> Interval {
        let [x, y, z] = offset(cell, &self.center).map(Interval::square);
        let distance = (x + y + z).sqrt();
        let r = Interval::point(self.radius);
        (distance - r) * (distance + r) / (r + r)
    }

    fn gradient_range(&self, cell: &Cell) -> Cell {
        offset(cell, &self.center).map(|x| x / Interval::point(self.radius))
    }

    fn transformed(&self, motion: &Isometry3<f64>) -> Self {
        Self { center: motion * self.center, radius: self.radius }
    }
}
