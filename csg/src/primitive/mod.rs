//! The primitive surfaces, one file each.

use crate::interval::{Cell, Interval, dot};
use crate::{Point, ProjectionFailed, Vector};
use nalgebra::{Isometry3, Matrix3};

mod cone;
mod course;
mod cylinder;
mod ellipse;
mod ellipsoid;
mod elliptic_cone;
mod elliptic_cylinder;
mod nappe;
mod plane;
pub(crate) mod quadric;
mod revolved;
pub(crate) mod same;
mod sphere;
mod sweep;
mod torus;

pub use ellipse::Ellipse;
pub(crate) use revolved::turned_ranges;

/// What each primitive answers; [`Surface`](crate::Surface) documents the meaning.
pub(crate) trait Primitive: Sized {
    /// The function.
    fn value(&self, point: &Point) -> f64;
    /// Its gradient.
    fn gradient(&self, point: &Point) -> Vector;
    /// Its second derivatives.
    fn hessian(&self, point: &Point) -> Matrix3<f64>;
    /// The largest absolute principal curvature.
    fn curvature(&self, point: &Point) -> f64;
    /// The nearest point of the surface, up to the rounding of the formula.
    fn project(&self, point: &Point) -> Result<Point, ProjectionFailed>;
    /// A range of the function over a box by its formula term for term.
    fn natural_range(&self, cell: &Cell) -> Interval;
    /// A range of the gradient over a box.
    fn gradient_range(&self, cell: &Cell) -> Cell;
    /// The primitive moved.
    fn transformed(&self, motion: &Isometry3<f64>) -> Self;
}

/// The range over a box of vectors of their parts that are orthogonal to `axis`: each component is one
/// linear form, so each is tight.
fn reject_range(arm: &Cell, axis: &Vector) -> Cell {
    [0, 1, 2].map(|i| {
        let mut row = -axis * axis[i];
        row[i] = (0..3).filter(|&j| j != i).map(|j| axis[j] * axis[j]).sum();
        // The entries of the row are rounded, and the axis is a unit vector but for rounding: less than four units of 1.
        let slack = 4.0 * f64::EPSILON * arm.iter().map(Interval::magnitude).fold(0.0, f64::max);
        dot(&row, arm) + Interval::new(-slack, slack)
    })
}

/// The range of the unit vectors along the vectors of a box, and that of their lengths; all unit vectors if zero is
/// among them.
fn direction_range(vectors: &Cell) -> (Cell, Interval) {
    let [x, y, z] = vectors.map(Interval::square);
    let length = (x + y + z).sqrt();
    (vectors.map(|v| (v / length).intersect(Interval::new(-1.0, 1.0))), length)
}

/// A plane; the inside is behind its normal.
#[derive(Clone, Debug, PartialEq)]
pub struct Plane {
    /// A point on it.
    pub point: Point,
    /// Unit normal, outward.
    pub normal: Vector,
}

/// A sphere.
#[derive(Clone, Debug, PartialEq)]
pub struct Sphere {
    /// Its centre.
    pub center: Point,
    /// Its radius, positive.
    pub radius: f64,
}

/// A circular cylinder, infinite both ways.
#[derive(Clone, Debug, PartialEq)]
pub struct Cylinder {
    /// A point on its axis.
    pub point: Point,
    /// Unit direction of its axis.
    pub axis: Vector,
    /// Its radius, positive.
    pub radius: f64,
}

/// A circular double cone.
#[derive(Clone, Debug, PartialEq)]
pub struct Cone {
    /// A point on its axis, not the apex.
    pub point: Point,
    /// Unit direction of its axis.
    pub axis: Vector,
    /// The radius at `point`, positive.
    pub radius: f64,
    /// Growth of the radius per unit of length along the axis, not zero.
    pub slope: f64,
}

/// A torus (ring: major radius larger than minor radius).
#[derive(Clone, Debug, PartialEq)]
pub struct Torus {
    /// Its centre.
    pub center: Point,
    /// Unit direction of its axis.
    pub axis: Vector,
    /// Distance of the tube's centre line from the axis.
    pub major: f64,
    /// Radius of the tube.
    pub minor: f64,
}

/// An ellipsoid.
#[derive(Clone, Debug, PartialEq)]
pub struct Ellipsoid {
    /// Its centre.
    pub center: Point,
    /// Unit directions of its axes, mutually orthogonal.
    pub axes: [Vector; 3],
    /// The semi-axes, positive.
    pub radii: [f64; 3],
}

/// A cylinder over an ellipse, infinite both ways.
#[derive(Clone, Debug, PartialEq)]
pub struct EllipticCylinder {
    /// A point on its axis.
    pub point: Point,
    /// Unit directions of the axes of the ellipse, orthogonal.
    pub axes: [Vector; 2],
    /// The semi-axes, positive.
    pub radii: [f64; 2],
}

/// A double cone over an ellipse.
#[derive(Clone, Debug, PartialEq)]
pub struct EllipticCone {
    /// The centre of the base ellipse.
    pub point: Point,
    /// Unit directions of the axes of the base ellipse, orthogonal.
    pub axes: [Vector; 2],
    /// The semi-axes of the base ellipse, positive.
    pub radii: [f64; 2],
    /// Unit direction of the axis of the cone.
    pub axis: Vector,
    /// Relative growth of the semi-axes per unit of length along the axis: they are
    /// `radii * (1 + rate * height)`. Not zero.
    pub rate: f64,
}

/// One nappe of a circular cone; its inside is around the axis, on the nappe's side of the apex.
#[derive(Clone, Debug, PartialEq)]
pub struct Nappe {
    /// A point on its axis, not the apex.
    pub point: Point,
    /// Unit direction of its axis.
    pub axis: Vector,
    /// The radius at `point`, positive.
    pub radius: f64,
    /// Growth of the radius per unit of length along the axis, not zero.
    pub slope: f64,
}

/// The surface of an ellipse that turns about an axis in its plane.
#[derive(Clone, Debug, PartialEq)]
pub struct Revolved {
    /// A point on the axis.
    pub point: Point,
    /// Unit direction of the axis.
    pub axis: Vector,
    /// The ellipse in coordinates (distance from the axis, height above `point`); what of it has a negative distance
    /// does not count.
    pub profile: Ellipse,
}

/// What bounds a section on one side, in the coordinates of the section's plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Section {
    /// A line: where normal·x = offset; the inside is behind the normal.
    Line {
        /// Unit normal.
        normal: [f64; 2],
        /// Distance of the line from the origin, along the normal.
        offset: f64,
    },
    /// An ellipse.
    Ellipse(Ellipse),
}

/// What a section sweeps that moves along an ellipse or a circle in the plane across it, and turns there so that its y points along a
/// fixed direction as far as that plane allows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sweep {
    /// The centre of the ellipse.
    pub center: Point,
    /// Unit direction across its plane; the section moves counter-clockwise around it.
    pub axis: Vector,
    /// Unit direction from the centre to where parameters are zero: one of its axes.
    pub start: Vector,
    /// Its semi-axes, along `start` and across it.
    pub radii: [f64; 2],
    /// Unit direction of the section's y, not in the plane of the ellipse.
    pub up: Vector,
    /// The section; its x is along (the path's direction) × y.
    pub section: Section,
}

#[cfg(test)]
mod tests;
