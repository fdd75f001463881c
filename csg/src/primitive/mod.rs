//! The primitive surfaces, one file each.

use crate::{Point, Vector};

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
