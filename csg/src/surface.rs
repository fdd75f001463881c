//! Surfaces: value, gradient, curvature, projection, ranges over boxes.

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
