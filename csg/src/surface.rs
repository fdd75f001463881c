//! Implicit surfaces: value, derivatives, projection, and ranges over boxes.

use crate::interval::{Cell, middle, offset};
use crate::primitive::quadric::{extremes, polish};
use crate::primitive::{
    Cone, Cylinder, Ellipsoid, EllipticCone, EllipticCylinder, Nappe, Plane, Primitive, Revolved, Sphere,
    Sweep, Torus, same,
};
use crate::{Interval, Point, ProjectionFailed, Vector};
use nalgebra::{Isometry3, Matrix3};

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
    /// One nappe of a circular cone.
    Nappe(Nappe),
    /// A surface of revolution whose profile is an ellipse, with the axis in the plane of the
    /// ellipse.
    Revolved(Revolved),
    /// A line or an ellipse swept along an elliptic path, turning with the path.
    Sweep(Sweep),
}

/// Dispatches to the primitive of a surface.
macro_rules! dispatch {
    ($surface:expr, $primitive:ident => $answer:expr) => {
        match $surface {
            Surface::Plane($primitive) => $answer,
            Surface::Sphere($primitive) => $answer,
            Surface::Cylinder($primitive) => $answer,
            Surface::Cone($primitive) => $answer,
            Surface::Torus($primitive) => $answer,
            Surface::Ellipsoid($primitive) => $answer,
            Surface::EllipticCylinder($primitive) => $answer,
            Surface::EllipticCone($primitive) => $answer,
            Surface::Nappe($primitive) => $answer,
            Surface::Revolved($primitive) => $answer,
            Surface::Sweep($primitive) => $answer,
        }
    };
}

impl Surface {
    /// Its kind in words.
    pub fn kind(&self) -> &'static str {
        match self {
            Self::Plane(_) => "plane",
            Self::Sphere(_) => "sphere",
            Self::Cylinder(_) => "cylinder",
            Self::Cone(_) => "cone",
            Self::Torus(_) => "torus",
            Self::Ellipsoid(_) => "ellipsoid",
            Self::EllipticCylinder(_) => "elliptic cylinder",
            Self::EllipticCone(_) => "elliptic cone",
            Self::Nappe(_) => "nappe of a cone",
            Self::Revolved(_) => "turned ellipse",
            Self::Sweep(s) if s.is_round() => "section moved along a circle",
            Self::Sweep(_) => "section moved along an ellipse",
        }
    }

    /// The function at `point`: zero on the surface, negative inside.
    ///
    /// Its gradient has unit length on the surface for most kinds; `value / |gradient|` is the
    /// distance to first order.
    pub fn value(&self, point: &Point) -> f64 {
        dispatch!(self, p => p.value(point))
    }

    /// The gradient of the function at `point`; it points outward.
    pub fn gradient(&self, point: &Point) -> Vector {
        dispatch!(self, p => p.gradient(point))
    }

    /// The Hessian of the function at `point`.
    pub(crate) fn hessian(&self, point: &Point) -> Matrix3<f64> {
        dispatch!(self, p => p.hessian(point))
    }

    /// The unit outward normal at a point on or near the surface.
    ///
    /// Zero where the gradient vanishes (on the axis of a cylinder, at the apex of a cone).
    pub fn normal(&self, point: &Point) -> Vector {
        self.gradient(point).try_normalize(0.0).unwrap_or_default()
    }

    /// The largest absolute principal curvature at a point on or near the surface, 1/length.
    pub fn curvature(&self, point: &Point) -> f64 {
        dispatch!(self, p => p.curvature(point))
    }

    /// The largest curvature of a normal section at a point on the surface whose center of
    /// curvature is on the side of `direction`, 1/length; 0 if the surface bends to the other side
    /// only.
    pub fn curvature_towards(&self, point: &Point, direction: &Vector) -> f64 {
        let gradient = self.gradient(point);
        let Some(normal) = gradient.try_normalize(0.0) else { return 0.0 };
        // The height over the tangent plane is minus one half of this form.
        let [least, most] = extremes(&(self.hessian(point) / gradient.norm()), &normal);
        if normal.dot(direction) < 0.0 { most.max(0.0) } else { (-least).max(0.0) }
    }

    /// The nearest point of the surface.
    ///
    /// The result is on the surface within a few units in the last place of the largest coordinate.
    ///
    /// # Errors
    /// [`ProjectionFailed`] if the nearest point is not unique (on the axis of a cylinder, at the
    /// center of a sphere).
    pub fn project(&self, point: &Point) -> Result<Point, ProjectionFailed> {
        dispatch!(self, p => Ok(polish(p.project(point)?, |x| p.value(x), |x| p.gradient(x))))
    }

    /// The distance of `point` from the surface to first order; infinite off the surface where the
    /// gradient vanishes.
    pub fn distance(&self, point: &Point) -> f64 {
        let value = self.value(point).abs();
        let distance = if value == 0.0 { 0.0 } else { value / self.gradient(point).norm() };
        // Close to the apex of a cone, value and gradient are both dominated by rounding.
        self.apex().map_or(distance, |apex| distance.min((point - apex).norm()))
    }

    /// The support point of a closed surface (sphere, torus, ellipsoid, revolved ellipse) in a unit
    /// direction.
    ///
    /// If several points are farthest, one of them; `None` for other surfaces.
    pub(crate) fn support(&self, direction: &Vector) -> Option<Point> {
        match self {
            Self::Sphere(s) => Some(s.center + direction * s.radius),
            Self::Torus(t) => Some(t.support(direction)),
            Self::Ellipsoid(e) => Some(e.support(direction)),
            Self::Revolved(r) => r.support(direction),
            _ => None,
        }
    }

    /// Whether the function is quadratic, so that its Hessian is constant.
    pub(crate) fn is_quadric(&self) -> bool {
        match self {
            Self::Plane(_)
            | Self::Sphere(_)
            | Self::Cylinder(_)
            | Self::Cone(_)
            | Self::Ellipsoid(_)
            | Self::EllipticCylinder(_)
            | Self::EllipticCone(_) => true,
            Self::Torus(_) | Self::Nappe(_) | Self::Revolved(_) | Self::Sweep(_) => false,
        }
    }

    /// The apex of a cone; `None` for other surfaces.
    pub fn apex(&self) -> Option<Point> {
        match self {
            Self::Cone(c) => Some(c.apex()),
            Self::EllipticCone(c) => Some(c.apex()),
            Self::Nappe(c) => Some(c.apex()),
            _ => None,
        }
    }

    /// Whether the apex, where the surface has no normal, is within the distance `within` of a
    /// point.
    pub fn has_apex_at(&self, point: &Point, within: f64) -> bool {
        self.apex().is_some_and(|apex| (point - apex).norm() <= within)
    }

    /// An interval that contains the function's values over a box.
    pub fn value_range(&self, cell: &Cell) -> Interval {
        // The error of the mean-value form decreases quadratically with the size of the box, which
        // natural evaluation in a skew frame does not achieve. On large boxes natural evaluation is
        // tighter (Moore, Kearfott, Cloud 2009, section 6.4).
        let natural = dispatch!(self, p => p.natural_range(cell));
        if !natural.contains_zero() {
            return natural;
        }
        let center = middle(cell);
        let arm = offset(cell, &center);
        let slope = self.gradient_range(cell);
        let at_center = dispatch!(self, p => p.natural_range(&[0, 1, 2].map(|i| Interval::point(center[i]))));
        natural.intersect(at_center + slope[0] * arm[0] + slope[1] * arm[1] + slope[2] * arm[2])
    }

    /// An interval for each component of the gradient over a box.
    pub(crate) fn gradient_range(&self, cell: &Cell) -> Cell {
        dispatch!(self, p => p.gradient_range(cell))
    }

    /// The surface after a rigid motion.
    #[must_use]
    pub(crate) fn transformed(&self, motion: &Isometry3<f64>) -> Self {
        match self {
            Self::Plane(p) => Self::Plane(p.transformed(motion)),
            Self::Sphere(p) => Self::Sphere(p.transformed(motion)),
            Self::Cylinder(p) => Self::Cylinder(p.transformed(motion)),
            Self::Cone(p) => Self::Cone(p.transformed(motion)),
            Self::Torus(p) => Self::Torus(p.transformed(motion)),
            Self::Ellipsoid(p) => Self::Ellipsoid(p.transformed(motion)),
            Self::EllipticCylinder(p) => Self::EllipticCylinder(p.transformed(motion)),
            Self::EllipticCone(p) => Self::EllipticCone(p.transformed(motion)),
            Self::Nappe(p) => Self::Nappe(p.transformed(motion)),
            Self::Revolved(p) => Self::Revolved(p.transformed(motion)),
            Self::Sweep(p) => Self::Sweep(p.transformed(motion)),
        }
    }

    /// Compares two surfaces as point sets within `tolerance` (a length).
    ///
    /// `Some(true)`: same surface and same inside; `Some(false)`: same surface, opposite insides;
    /// `None`: different surfaces.
    pub fn same_as(&self, other: &Self, tolerance: f64) -> Option<bool> {
        same::same(self, other, tolerance)
    }
}
