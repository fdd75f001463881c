//! The primitive surfaces, one per file.

use crate::interval::{Cell, Interval, dot};
use crate::{Point, ProjectionFailed, Vector};
use nalgebra::{Isometry3, Matrix3};

mod cone;
mod cylinder;
mod ellipse;
mod ellipsoid;
mod elliptic_cone;
mod elliptic_cylinder;
mod elliptic_path;
mod nappe;
mod plane;
pub(crate) mod quadric;
mod revolved;
pub(crate) mod same;
mod sphere;
mod sweep;
mod torus;

pub use ellipse::Ellipse;
pub(crate) use revolved::meridian_ranges;

/// The functions of a primitive; [`Surface`](crate::Surface) documents their meaning.
pub(crate) trait Primitive: Sized {
    /// The value of the implicit function.
    fn value(&self, point: &Point) -> f64;
    /// The gradient of the function.
    fn gradient(&self, point: &Point) -> Vector;
    /// The Hessian of the function.
    fn hessian(&self, point: &Point) -> Matrix3<f64>;
    /// The largest absolute principal curvature.
    fn curvature(&self, point: &Point) -> f64;
    /// The nearest point of the surface, up to rounding of the formula.
    fn project(&self, point: &Point) -> Result<Point, ProjectionFailed>;
    /// A range of the function over a box by interval evaluation of its formula.
    fn natural_range(&self, cell: &Cell) -> Interval;
    /// A range of the gradient over a box.
    fn gradient_range(&self, cell: &Cell) -> Cell;
    /// The primitive after a rigid motion.
    fn transformed(&self, motion: &Isometry3<f64>) -> Self;
}

/// The range over a box of vectors of their components orthogonal to `axis`.
///
/// Each component is a single linear form, so its range is tight.
fn reject_range(arm: &Cell, axis: &Vector) -> Cell {
    [0, 1, 2].map(|i| {
        let mut row = -axis * axis[i];
        row[i] = (0..3).filter(|&j| j != i).map(|j| axis[j] * axis[j]).sum();
        // Entries of the row are rounded, and the axis is a unit vector up to rounding: less than
        // four units in the last place of 1.
        let slack = 4.0 * f64::EPSILON * arm.iter().map(Interval::magnitude).fold(0.0, f64::max);
        dot(&row, arm) + Interval::new(-slack, slack)
    })
}

/// The range of the directions of the vectors of a box, and that of their lengths.
///
/// All unit vectors if the box contains zero.
fn direction_range(vectors: &Cell) -> (Cell, Interval) {
    let [x, y, z] = vectors.map(Interval::square);
    let length = (x + y + z).sqrt();
    (vectors.map(|v| (v / length).intersect(Interval::new(-1.0, 1.0))), length)
}

/// A plane; the inside is the side opposite to the normal.
#[derive(Clone, Debug, PartialEq)]
pub struct Plane {
    /// A point on the plane.
    pub point: Point,
    /// Outward unit normal.
    pub normal: Vector,
}

/// A sphere.
#[derive(Clone, Debug, PartialEq)]
pub struct Sphere {
    /// The center.
    pub center: Point,
    /// The radius, positive.
    pub radius: f64,
}

/// An infinite circular cylinder.
#[derive(Clone, Debug, PartialEq)]
pub struct Cylinder {
    /// A point on the axis.
    pub point: Point,
    /// Unit direction of the axis.
    pub axis: Vector,
    /// The radius, positive.
    pub radius: f64,
}

/// A circular double cone.
#[derive(Clone, Debug, PartialEq)]
pub struct Cone {
    /// A point on the axis, not the apex.
    pub point: Point,
    /// Unit direction of the axis.
    pub axis: Vector,
    /// The radius at `point`, positive.
    pub radius: f64,
    /// Growth of the radius per unit of length along the axis, nonzero.
    pub slope: f64,
}

/// A torus. If the minor radius is not less than the major one, it has singular points on its axis,
/// which must not be on the boundary; what is inside of the inner sheet is inside.
#[derive(Clone, Debug, PartialEq)]
pub struct Torus {
    /// The center.
    pub center: Point,
    /// Unit direction of the axis.
    pub axis: Vector,
    /// Distance of the tube's center line from the axis.
    pub major: f64,
    /// Radius of the tube.
    pub minor: f64,
}

/// An ellipsoid.
#[derive(Clone, Debug, PartialEq)]
pub struct Ellipsoid {
    /// The center.
    pub center: Point,
    /// Unit directions of the axes, mutually orthogonal.
    pub axes: [Vector; 3],
    /// The semi-axes, positive.
    pub radii: [f64; 3],
}

/// An infinite cylinder over an ellipse.
#[derive(Clone, Debug, PartialEq)]
pub struct EllipticCylinder {
    /// A point on the axis.
    pub point: Point,
    /// Unit directions of the axes of the ellipse, orthogonal.
    pub axes: [Vector; 2],
    /// The semi-axes, positive.
    pub radii: [f64; 2],
}

/// A double cone over an ellipse.
#[derive(Clone, Debug, PartialEq)]
pub struct EllipticCone {
    /// The center of the base ellipse.
    pub point: Point,
    /// Unit directions of the axes of the base ellipse, orthogonal.
    pub axes: [Vector; 2],
    /// The semi-axes of the base ellipse, positive.
    pub radii: [f64; 2],
    /// Unit direction of the axis of the cone.
    pub axis: Vector,
    /// Relative growth of the semi-axes per unit of length along the axis, nonzero: the semi-axes
    /// at a height are `radii * (1 + rate * height)`.
    pub rate: f64,
}

/// One nappe of a circular cone; the inside contains the axis on the nappe's side of the apex.
#[derive(Clone, Debug, PartialEq)]
pub struct Nappe {
    /// A point on the axis, not the apex.
    pub point: Point,
    /// Unit direction of the axis.
    pub axis: Vector,
    /// The radius at `point`, positive.
    pub radius: f64,
    /// Growth of the radius per unit of length along the axis, nonzero.
    pub slope: f64,
}

/// The surface of revolution of an ellipse about an axis in its plane.
#[derive(Clone, Debug, PartialEq)]
pub struct Revolved {
    /// A point on the axis.
    pub point: Point,
    /// Unit direction of the axis.
    pub axis: Vector,
    /// The ellipse in coordinates (distance from the axis, height above `point`). Its part with
    /// negative distance is ignored.
    pub profile: Ellipse,
}

/// A curve in the plane of a swept section that bounds the section on one side.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Section {
    /// The line normal·x = offset; the inside is the side opposite to the normal.
    Line {
        /// Unit normal.
        normal: [f64; 2],
        /// Signed distance of the line from the origin along the normal.
        offset: f64,
    },
    /// An ellipse.
    Ellipse(Ellipse),
}

/// The surface swept by a section curve along an elliptic or circular path.
///
/// The section stays in the plane perpendicular to the path and turns so that its y axis is the
/// projection of a fixed direction to that plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sweep {
    /// The center of the path.
    pub center: Point,
    /// Unit normal of the plane of the path; the path is counterclockwise about it.
    pub axis: Vector,
    /// Unit direction of the path's first axis, from the center to the point at parameter zero.
    pub start: Vector,
    /// The semi-axes of the path along `start` and perpendicular to it.
    pub radii: [f64; 2],
    /// Unit direction that the section's y axis follows, not in the plane of the path.
    pub up: Vector,
    /// The section curve; its x axis is (the path's direction) × y.
    pub section: Section,
}

#[cfg(test)]
mod tests;
