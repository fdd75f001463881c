//! The circular cylinder: (ρ² - r²)/2r, with ρ the distance from the axis.

use super::quadric::reject;
use super::{Cylinder, Primitive, reject_range};
use crate::interval::{Cell, Interval, offset};
use crate::{Point, ProjectionFailed, Vector};
use nalgebra::{Isometry3, Matrix3};

impl Primitive for Cylinder {
    fn value(&self, point: &Point) -> f64 {
        let distance = reject(&(point - self.point), &self.axis).norm();
        (distance - self.radius) * (distance + self.radius) / (2.0 * self.radius)
    }

    fn gradient(&self, point: &Point) -> Vector {
        reject(&(point - self.point), &self.axis) / self.radius
    }

    fn hessian(&self, _point: &Point) -> Matrix3<f64> {
        (Matrix3::identity() - self.axis * self.axis.transpose()) / self.radius
    }

    fn curvature(&self, _point: &Point) -> f64 {
        1.0 / self.radius
    }

    fn project(&self, point: &Point) -> Result<Point, ProjectionFailed> {
        let arm = reject(&(point - self.point), &self.axis);
        let distance = arm.norm();
        if distance == 0.0 {
            return Err(ProjectionFailed(*point));
        }
        Ok(point + arm * (self.radius / distance - 1.0))
    }

    fn natural_range(&self, cell: &Cell) -> Interval {
        let [x, y, z] = reject_range(&offset(cell, &self.point), &self.axis).map(Interval::square);
        let distance = (x + y + z).sqrt();
        let r = Interval::point(self.radius);
        (distance - r) * (distance + r) / (r + r)
    }

    fn gradient_range(&self, cell: &Cell) -> Cell {
        reject_range(&offset(cell, &self.point), &self.axis).map(|x| x / Interval::point(self.radius))
    }

    fn transformed(&self, motion: &Isometry3<f64>) -> Self {
        Self { point: motion * self.point, axis: (motion * self.axis).normalize(), radius: self.radius }
    }
}
