//! The plane: the signed distance n·(x - p).

use super::{Plane, Primitive};
use crate::interval::{Cell, Interval, dot, offset};
use crate::{Point, ProjectionFailed, Vector};
use nalgebra::{Isometry3, Matrix3};

impl Primitive for Plane {
    fn value(&self, point: &Point) -> f64 {
        self.normal.dot(&(point - self.point))
    }

    fn gradient(&self, _point: &Point) -> Vector {
        self.normal
    }

    fn hessian(&self, _point: &Point) -> Matrix3<f64> {
        Matrix3::zeros()
    }

    fn curvature(&self, _point: &Point) -> f64 {
        0.0
    }

    fn project(&self, point: &Point) -> Result<Point, ProjectionFailed> {
        Ok(point - self.normal * self.value(point))
    }

    fn natural_range(&self, cell: &Cell) -> Interval {
        dot(&self.normal, &offset(cell, &self.point))
    }

    fn gradient_range(&self, _cell: &Cell) -> Cell {
        [0, 1, 2].map(|i| Interval::point(self.normal[i]))
    }

    fn transformed(&self, motion: &Isometry3<f64>) -> Self {
        Self { point: motion * self.point, normal: (motion * self.normal).normalize() }
    }
}
