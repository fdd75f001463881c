//! The torus: ((ρ - R)² + τ² - r²)/2r, with ρ the distance from the axis and τ the height.
//!
//! Not smooth on the axis, which a ring torus does not meet. A torus without a hole meets it in two
//! points, or one.

use super::quadric::{reject, tangents};
use super::{Primitive, Torus, reject_range};
use crate::interval::{Cell, Interval, dot, offset};
use crate::{Point, ProjectionFailed, Vector};
use nalgebra::{Isometry3, Matrix3};

impl Torus {
    /// The support point in a unit direction.
    pub(crate) fn support(&self, direction: &Vector) -> Point {
        let across = reject(direction, &self.axis);
        // On the axis all directions support equally far: any will do.
        let outward = across.try_normalize(1e-9).unwrap_or_else(|| tangents(&self.axis).0);
        self.center + outward * self.major + direction * self.minor
    }

    /// The vector from the axis, its length, and the height over the middle plane.
    #[inline]
    fn split(&self, point: &Point) -> (Vector, f64, f64) {
        let arm = point - self.center;
        let across = reject(&arm, &self.axis);
        (across, across.norm(), arm.dot(&self.axis))
    }
}

impl Primitive for Torus {
    fn value(&self, point: &Point) -> f64 {
        let (_, distance, height) = self.split(point);
        let tube = (distance - self.major).hypot(height);
        (tube - self.minor) * (tube + self.minor) / (2.0 * self.minor)
    }

    fn gradient(&self, point: &Point) -> Vector {
        let (across, distance, height) = self.split(point);
        if distance == 0.0 {
            return self.axis * (height / self.minor);
        }
        (across * (1.0 - self.major / distance) + self.axis * height) / self.minor
    }

    fn hessian(&self, point: &Point) -> Matrix3<f64> {
        let (across, distance, _) = self.split(point);
        if distance == 0.0 {
            return Matrix3::identity() / self.minor;
        }
        let round = self.axis.cross(&across) / distance;
        (Matrix3::identity() - round * round.transpose() * (self.major / distance)) / self.minor
    }

    fn curvature(&self, point: &Point) -> f64 {
        let (_, distance, height) = self.split(point);
        let (radial, tube) = (distance - self.major, (distance - self.major).hypot(height));
        let cosine = if tube > 0.0 { radial / tube } else { 0.0 };
        f64::max(1.0 / self.minor, cosine.abs() / (self.major + self.minor * cosine))
    }

    fn project(&self, point: &Point) -> Result<Point, ProjectionFailed> {
        let (across, distance, height) = self.split(point);
        let tube = (distance - self.major).hypot(height);
        if distance == 0.0 || tube == 0.0 {
            return Err(ProjectionFailed(*point));
        }
        let factor = self.minor / tube;
        let radius = self.major + (distance - self.major) * factor;
        Ok(self.center + across * (radius / distance) + self.axis * (height * factor))
    }

    fn natural_range(&self, cell: &Cell) -> Interval {
        let arm = offset(cell, &self.center);
        let [x, y, z] = reject_range(&arm, &self.axis).map(Interval::square);
        let radial = (x + y + z).sqrt() - Interval::point(self.major);
        let tube = (radial.square() + dot(&self.axis, &arm).square()).sqrt();
        let r = Interval::point(self.minor);
        (tube - r) * (tube + r) / (r + r)
    }

    fn gradient_range(&self, cell: &Cell) -> Cell {
        let arm = offset(cell, &self.center);
        let across = reject_range(&arm, &self.axis);
        let [x, y, z] = across.map(Interval::square);
        let distance = (x + y + z).sqrt();
        let height = dot(&self.axis, &arm);
        let radial = distance - Interval::point(self.major);
        let cosines = Interval::new(-1.0, 1.0);
        [0, 1, 2].map(|i| {
            let direction = (across[i] / distance).intersect(cosines);
            (direction * radial + height * self.axis[i]) / Interval::point(self.minor)
        })
    }

    fn transformed(&self, motion: &Isometry3<f64>) -> Self {
        Self { center: motion * self.center, axis: (motion * self.axis).normalize(), ..*self }
    }
}
