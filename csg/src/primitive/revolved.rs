//! The surface of revolution of an ellipse: the ellipse's function of (ρ, h), with ρ the distance
//! from the axis and h the height along it.
//!
//! Only the part of the ellipse with ρ ≥ 0 is used. The surface is not smooth on the axis, unless
//! the ellipse meets the axis at a right angle and forms a cap.

use super::quadric::{largest_curvature, reject, tangents};
use super::{Ellipse, Primitive, Revolved, direction_range, reject_range};
use crate::interval::{Cell, Interval, dot, offset};
use crate::{Point, ProjectionFailed, Vector};
use nalgebra::{Isometry3, Matrix3};

/// Distances from the axis below this fraction of the larger semi-axis count as zero, because the
/// radial direction is rounding.
const ON_AXIS: f64 = 1e-12;

/// The ranges over a box of (ρ, h) and of ∇ρ × ∇h; the latter is `None` if the axis passes through
/// the box.
pub(crate) fn meridian_ranges(origin: &Point, axis: &Vector, cell: &Cell) -> ([Interval; 2], Option<Cell>) {
    let arm = offset(cell, origin);
    let ([x, y, z], distance) = direction_range(&reject_range(&arm, axis));
    let forward = || [y * axis.z - z * axis.y, z * axis.x - x * axis.z, x * axis.y - y * axis.x];
    ([distance, dot(axis, &arm)], (distance.lo > 0.0).then(forward))
}

impl Revolved {
    /// The vector from the axis, and the coordinates (ρ, h).
    #[inline]
    fn split(&self, point: &Point) -> (Vector, [f64; 2]) {
        let arm = point - self.point;
        let across = reject(&arm, &self.axis);
        (across, [across.norm(), arm.dot(&self.axis)])
    }

    /// An upper bound of the distance of the surface from `point`.
    pub(crate) fn reach(&self) -> f64 {
        let Ellipse { center, radii, .. } = &self.profile;
        center[0].hypot(center[1]) + radii[0].max(radii[1])
    }

    fn is_on_axis(&self, distance: f64) -> bool {
        distance <= ON_AXIS * self.profile.radii[0].max(self.profile.radii[1])
    }

    /// The support point in a unit direction; `None` if it is on the unused part of the ellipse.
    pub(crate) fn support(&self, direction: &Vector) -> Option<Point> {
        let across = reject(direction, &self.axis);
        // On the axis all directions support equally far: any will do.
        let outward = across.try_normalize(1e-9).unwrap_or_else(|| tangents(&self.axis).0);
        let [distance, height] = self.profile.support([direction.dot(&outward), direction.dot(&self.axis)]);
        (distance >= 0.0).then(|| self.point + outward * distance + self.axis * height)
    }
}

impl Primitive for Revolved {
    fn value(&self, point: &Point) -> f64 {
        self.profile.value(self.split(point).1)
    }

    fn gradient(&self, point: &Point) -> Vector {
        let (across, at) = self.split(point);
        let [outward, up] = self.profile.gradient(at);
        let across = if at[0] > 0.0 { across * (outward / at[0]) } else { Vector::zeros() };
        across + self.axis * up
    }

    fn hessian(&self, point: &Point) -> Matrix3<f64> {
        let (across, at) = self.split(point);
        let [xx, xy, yy] = self.profile.hessian();
        let along = self.axis * self.axis.transpose();
        if self.is_on_axis(at[0]) {
            return (Matrix3::identity() - along) * xx + along * yy;
        }
        let outward = across / at[0];
        let round = self.axis.cross(&outward);
        let mixed = outward * self.axis.transpose();
        outward * outward.transpose() * xx
            + (mixed + mixed.transpose()) * xy
            + along * yy
            + round * round.transpose() * (self.profile.gradient(at)[0] / at[0])
    }

    fn curvature(&self, point: &Point) -> f64 {
        largest_curvature(&self.gradient(point), &self.hessian(point))
    }

    fn project(&self, point: &Point) -> Result<Point, ProjectionFailed> {
        let (across, at) = self.split(point);
        let [distance, height] = self.profile.nearest(at);
        if distance <= 0.0 {
            // The nearest point of the used part is one of its ends, on the axis.
            let Some((middle, half)) = self.profile.right_part() else {
                return Err(ProjectionFailed(*point));
            };
            let ends = [middle - half, middle + half].map(|angle| self.profile.point(angle)[1]);
            let [first, second] = ends.map(|end| (end - at[1]).abs());
            return Ok(self.point + self.axis * if first <= second { ends[0] } else { ends[1] });
        }
        if at[0] == 0.0 {
            return Err(ProjectionFailed(*point));
        }
        Ok(self.point + across * (distance / at[0]) + self.axis * height)
    }

    fn natural_range(&self, cell: &Cell) -> Interval {
        let arm = offset(cell, &self.point);
        let [x, y, z] = reject_range(&arm, &self.axis).map(Interval::square);
        self.profile.value_range([(x + y + z).sqrt(), dot(&self.axis, &arm)])
    }

    fn gradient_range(&self, cell: &Cell) -> Cell {
        let arm = offset(cell, &self.point);
        let (direction, distance) = direction_range(&reject_range(&arm, &self.axis));
        let [outward, up] = self.profile.gradient_range([distance, dot(&self.axis, &arm)]);
        [0, 1, 2].map(|i| direction[i] * outward + up * self.axis[i])
    }

    fn transformed(&self, motion: &Isometry3<f64>) -> Self {
        Self { point: motion * self.point, axis: (motion * self.axis).normalize(), ..*self }
    }
}
