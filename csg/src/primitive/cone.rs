//! The circular double cone: (ρ² - R²)/(2 r √(1+s²)), with ρ the distance from the axis and R the
//! radius there.
//!
//! The gradient has unit length on the circle through the point that defines the cone, and grows
//! with R.

use super::quadric::{largest_curvature, reject};
use super::{Cone, Primitive, reject_range};
use crate::interval::{Cell, Interval, dot, offset};
use crate::{Point, ProjectionFailed, Vector};
use nalgebra::{Isometry3, Matrix3};

impl Cone {
    /// The apex, where both nappes meet.
    pub fn apex(&self) -> Point {
        self.point - self.axis * (self.radius / self.slope)
    }

    fn scale(&self) -> f64 {
        1.0 / (self.radius * (1.0 + self.slope * self.slope).sqrt())
    }

    /// The vector from the axis, and the signed radius at the height of the point.
    #[inline]
    fn split(&self, point: &Point) -> (Vector, f64) {
        let arm = point - self.point;
        (reject(&arm, &self.axis), self.radius + self.slope * arm.dot(&self.axis))
    }
}

impl Primitive for Cone {
    fn value(&self, point: &Point) -> f64 {
        let (arm, radius) = self.split(point);
        let distance = arm.norm();
        (distance - radius) * (distance + radius) * (0.5 * self.scale())
    }

    fn gradient(&self, point: &Point) -> Vector {
        let (arm, radius) = self.split(point);
        (arm - self.axis * (self.slope * radius)) * self.scale()
    }

    fn hessian(&self, _point: &Point) -> Matrix3<f64> {
        let along = self.axis * self.axis.transpose();
        (Matrix3::identity() - along * (1.0 + self.slope * self.slope)) * self.scale()
    }

    fn curvature(&self, point: &Point) -> f64 {
        largest_curvature(&self.gradient(point), &self.hessian(point))
    }

    fn project(&self, point: &Point) -> Result<Point, ProjectionFailed> {
        let (arm, radius) = self.split(point);
        let distance = arm.norm();
        if distance == 0.0 {
            return if radius == 0.0 { Ok(*point) } else { Err(ProjectionFailed(*point)) };
        }
        // In the half-plane through the axis, the nearest line is on the nappe on the point's side
        // of the apex, and the foot is never beyond the apex.
        let slope = self.slope * radius.signum();
        let lack = (distance - radius.abs()) / (1.0 + slope * slope);
        Ok(point - arm * (lack / distance) + self.axis * (lack * slope))
    }

    fn natural_range(&self, cell: &Cell) -> Interval {
        let arm = offset(cell, &self.point);
        let [x, y, z] = reject_range(&arm, &self.axis).map(Interval::square);
        let radius = Interval::point(self.radius) + dot(&self.axis, &arm) * self.slope;
        // The scale is a rounded number like the other parameters, so this is the range of the
        // scaled function.
        (x + y + z - radius.square()) * (0.5 * self.scale())
    }

    fn gradient_range(&self, cell: &Cell) -> Cell {
        let arm = offset(cell, &self.point);
        let across = reject_range(&arm, &self.axis);
        let radius = Interval::point(self.radius) + dot(&self.axis, &arm) * self.slope;
        [0, 1, 2].map(|i| (across[i] - radius * self.slope * self.axis[i]) * self.scale())
    }

    fn transformed(&self, motion: &Isometry3<f64>) -> Self {
        Self { point: motion * self.point, axis: (motion * self.axis).normalize(), ..*self }
    }
}
