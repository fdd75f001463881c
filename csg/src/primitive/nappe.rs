//! One nappe of a circular cone: (ρ - R)/√(1+s²), with ρ the distance from the axis and R the
//! radius there.
//!
//! The gradient has unit length everywhere except on the axis, where only the apex belongs to the
//! surface.

use super::quadric::reject;
use super::{Nappe, Primitive, direction_range, reject_range};
use crate::interval::{Cell, Interval, dot, offset};
use crate::{Point, ProjectionFailed, Vector};
use nalgebra::{Isometry3, Matrix3};

impl Nappe {
    /// The apex.
    pub fn apex(&self) -> Point {
        self.point - self.axis * (self.radius / self.slope)
    }

    fn scale(&self) -> f64 {
        1.0 / self.slope.hypot(1.0)
    }

    /// The vector from the axis, its length, and the radius at the height of the point (negative
    /// beyond the apex).
    #[inline]
    fn split(&self, point: &Point) -> (Vector, f64, f64) {
        let arm = point - self.point;
        let across = reject(&arm, &self.axis);
        (across, across.norm(), self.radius + self.slope * arm.dot(&self.axis))
    }
}

impl Primitive for Nappe {
    fn value(&self, point: &Point) -> f64 {
        let (_, distance, radius) = self.split(point);
        (distance - radius) * self.scale()
    }

    fn gradient(&self, point: &Point) -> Vector {
        let (across, distance, _) = self.split(point);
        if distance == 0.0 {
            return Vector::zeros();
        }
        (across / distance - self.axis * self.slope) * self.scale()
    }

    fn hessian(&self, point: &Point) -> Matrix3<f64> {
        let (across, distance, _) = self.split(point);
        if distance == 0.0 {
            return Matrix3::zeros();
        }
        let round = self.axis.cross(&across) / distance;
        round * round.transpose() * (self.scale() / distance)
    }

    fn curvature(&self, point: &Point) -> f64 {
        self.scale() / self.split(point).1
    }

    fn project(&self, point: &Point) -> Result<Point, ProjectionFailed> {
        let (across, distance, radius) = self.split(point);
        let lack = (distance - radius) * self.scale().powi(2);
        if lack >= distance {
            return Ok(self.apex());
        }
        if distance == 0.0 {
            return Err(ProjectionFailed(*point));
        }
        Ok(point - across * (lack / distance) + self.axis * (lack * self.slope))
    }

    fn natural_range(&self, cell: &Cell) -> Interval {
        let arm = offset(cell, &self.point);
        let [x, y, z] = reject_range(&arm, &self.axis).map(Interval::square);
        let radius = Interval::point(self.radius) + dot(&self.axis, &arm) * self.slope;
        // The scale is a rounded number like the other parameters, so this is the range of the
        // scaled function.
        ((x + y + z).sqrt() - radius) * self.scale()
    }

    fn gradient_range(&self, cell: &Cell) -> Cell {
        let outward = direction_range(&reject_range(&offset(cell, &self.point), &self.axis)).0;
        [0, 1, 2].map(|i| (outward[i] - Interval::point(self.slope * self.axis[i])) * self.scale())
    }

    fn transformed(&self, motion: &Isometry3<f64>) -> Self {
        Self { point: motion * self.point, axis: (motion * self.axis).normalize(), ..*self }
    }
}
