//! Surfaces: value, gradient, curvature, projection, ranges over boxes.

use crate::{Interval, Point, ProjectionFailed, Vector};
use nalgebra::{Isometry3, Matrix3};

use crate::primitive::{Cone, Cylinder, Ellipsoid, EllipticCone, EllipticCylinder, Plane, Sphere, Torus};

/// The zero set of a smooth function that is negative inside.
#[derive(Clone, Debug, PartialEq)]
pub enum Surface {
    /// A plane.
    Plane(Plane),
    /// A sphere.
    Sphere(Sphere),
    /// A circular cylinder, infinite both ways.
    Cylinder(Cylinder),
    /// A circular double cone.
    Cone(Cone),
    /// A torus.
    Torus(Torus),
    /// An ellipsoid with three axes.
    Ellipsoid(Ellipsoid),
    /// A cylinder over an ellipse, infinite both ways.
    EllipticCylinder(EllipticCylinder),
    /// A double cone over an ellipse.
    EllipticCone(EllipticCone),
}

impl Surface {
    /// The function at `point`: zero on the surface, negative inside, with a gradient of unit length on
    /// the surface wherever the kind allows, so that `value / |gradient|` is the distance to first order.
    pub fn value(&self, _point: &Point) -> f64 {
        todo!()
    }

    /// The gradient of the function at `point`: points outward.
    pub fn gradient(&self, _point: &Point) -> Vector {
        todo!()
    }

    /// The second derivatives of the function at `point`.
    pub fn hessian(&self, _point: &Point) -> Matrix3<f64> {
        todo!()
    }

    /// The unit outward normal at a point on or near the surface.
    pub fn normal(&self, _point: &Point) -> Vector {
        todo!()
    }

    /// The largest absolute principal curvature at a point on or near the surface, 1/length.
    pub fn curvature(&self, _point: &Point) -> f64 {
        todo!()
    }

    /// The nearest point of the surface.
    pub fn project(&self, _point: &Point) -> Result<Point, ProjectionFailed> {
        todo!()
    }

    /// An interval that contains the function's values over a box.
    pub fn value_range(&self, _cell: &[Interval; 3]) -> Interval {
        todo!()
    }

    /// An interval for each component of the gradient over a box.
    pub fn gradient_range(&self, _cell: &[Interval; 3]) -> [Interval; 3] {
        todo!()
    }

    /// The surface moved.
    #[must_use]
    pub fn transformed(&self, _motion: &Isometry3<f64>) -> Self {
        todo!()
    }

    /// Whether both are the same set of points within `tolerance` (a length), and if so whether their insides
    /// are the same side: `Some(true)` same side, `Some(false)` opposite sides, `None` different surfaces.
    pub fn same_as(&self, _other: &Self, _tolerance: f64) -> Option<bool> {
        todo!()
    }
}
