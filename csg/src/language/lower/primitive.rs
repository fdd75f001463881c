//! Lowers primitives to surfaces and half-spaces.

use super::forest::inside_of;
use super::polyhedron;
use super::swept::Joint;
use crate::geometry::Span;
use crate::language::ast::Primitive;
use crate::language::diagnostic::{Report, Reported};
use crate::primitive::{Cone, Cylinder, Ellipsoid, EllipticCone, EllipticCylinder, Plane, Sphere, Torus};
use crate::{Point, Solid, Surface, Vector};

/// Largest coordinate, radius or length of a vector; its fourth power still fits a double.
pub(super) const LARGEST_LENGTH: f64 = 1e60;
/// Smallest radius or length of a vector, for the same reason.
const SMALLEST_LENGTH: f64 = 1e-60;
/// Points closer than this fraction of their coordinates coincide up to rounding.
const ROUNDING: f64 = 1e-14;
/// Radii with a smaller relative difference are equal: such a cone is a cylinder, such an ellipse a
/// circle. It allows for the rounding of norms only.
const SAME_RADIUS: f64 = 1e-13;
/// Largest cosine between semi-axes that are perpendicular without a warning; axes with six digits
/// reach 10⁻⁶.
const RIGHT_ANGLE: f64 = 3e-6;
/// Largest cosine between semi-axes that are made perpendicular with a warning; axes with three
/// digits reach 10⁻³. Beyond it, they were not meant to be orthogonal.
const ALMOST_RIGHT_ANGLE: f64 = 3e-3;

/// A primitive that can be meshed: surfaces and a Boolean tree over them.
pub(super) struct Shape {
    pub surfaces: Vec<Surface>,
    pub inside: Solid,
    /// The face of the text for each surface.
    pub faces: Vec<usize>,
    /// The smooth joints of the path of an extrusion.
    pub joints: Vec<Joint>,
}

impl Shape {
    /// The negative side of one surface.
    fn of(surface: Surface) -> Self {
        Self { surfaces: vec![surface], inside: inside_of(0), faces: vec![0], joints: Vec::new() }
    }
}

/// Lowers a primitive other than an extrusion or a revolution.
pub(super) fn shape(primitive: &Primitive, span: Span, report: &mut Report) -> Result<Shape, Reported> {
    let mut check = Check { span, report };
    match primitive {
        Primitive::Plane(point, normal) => check.plane(point, normal),
        Primitive::Sphere(center, radius) => {
            let (center, radius) = (check.point(center)?, check.radius("sphere", *radius)?);
            Ok(Shape::of(Surface::Sphere(Sphere { center, radius })))
        }
        Primitive::Cylinder(a, b, radius) => {
            let (axis, _) = check.axis("cylinder", a, b)?;
            let radius = check.radius("cylinder", *radius)?;
            Ok(Shape::of(Surface::Cylinder(Cylinder { point: *a, axis, radius })))
        }
        Primitive::Cone(a, radius_a, b, radius_b) => check.cone([a, b], [*radius_a, *radius_b]),
        Primitive::EllipticCylinder(point, v, w) => {
            let (axes, radii) = check.semi_axes("ellipticcylinder", [v, w])?;
            Ok(Shape::of(elliptic_cylinder(check.point(point)?, axes, radii)))
        }
        Primitive::EllipticCone(base, v, w, height, ratio) => {
            check.elliptic_cone(base, [v, w], *height, *ratio)
        }
        Primitive::Ellipsoid(center, u, v, w) => {
            let (axes, radii) = check.semi_axes("ellipsoid", [u, v, w])?;
            let center = check.point(center)?;
            Ok(Shape::of(if same_radius(radii[0], radii[1]) && same_radius(radii[0], radii[2]) {
                Surface::Sphere(Sphere { center, radius: radii[0] })
            } else {
                Surface::Ellipsoid(Ellipsoid { center, axes, radii })
            }))
        }
        Primitive::Orthobrick(min, max) => check.brick(min, max),
        Primitive::Torus(center, axis, major, minor) => check.torus(center, axis, *major, *minor),
        Primitive::Polyhedron(points, faces) => {
            for point in points {
                check.point(point)?;
            }
            polyhedron::shape(points, faces, span, check.report)
        }
        Primitive::Extrusion { .. } | Primitive::Revolution { .. } => unreachable!("handled with the curves"),
    }
}

/// The direction of a vector; `None` if it is zero or its length is out of range.
pub(super) fn direction(vector: &Vector) -> Option<Vector> {
    let largest = vector.amax();
    // Scale first, so that squares neither overflow nor underflow.
    (SMALLEST_LENGTH..=LARGEST_LENGTH).contains(&largest).then(|| (vector / largest).normalize())
}

fn same_radius(a: f64, b: f64) -> bool {
    (a - b).abs() <= SAME_RADIUS * a.abs().max(b.abs())
}

fn elliptic_cylinder(point: Point, axes: [Vector; 2], radii: [f64; 2]) -> Surface {
    if same_radius(radii[0], radii[1]) {
        let axis = axes[0].cross(&axes[1]).normalize();
        return Surface::Cylinder(Cylinder { point, axis, radius: radii[0] });
    }
    Surface::EllipticCylinder(EllipticCylinder { point, axes, radii })
}

/// Checks the arguments of one primitive.
struct Check<'r> {
    span: Span,
    report: &'r mut Report,
}

impl Check<'_> {
    fn wrong(&mut self, message: String, help: &str) -> Reported {
        self.report.meaning(self.span, message, help)
    }

    fn point(&mut self, point: &Point) -> Result<Point, Reported> {
        if point.coords.amax() > LARGEST_LENGTH {
            let message = format!("a coordinate is larger than {LARGEST_LENGTH:e}");
            return Err(self.wrong(message, "choose another unit of length"));
        }
        Ok(*point)
    }

    fn radius(&mut self, what: &str, radius: f64) -> Result<f64, Reported> {
        if !(SMALLEST_LENGTH..=LARGEST_LENGTH).contains(&radius) {
            let help = "radii are lengths from 1e-60 to 1e60";
            return Err(self.wrong(format!("`{what}` needs a positive radius, not {radius:?}"), help));
        }
        Ok(radius)
    }

    fn direction(&mut self, what: &str, vector: &Vector) -> Result<Vector, Reported> {
        direction(vector).ok_or_else(|| {
            let [x, y, z] = [vector.x, vector.y, vector.z];
            self.wrong(
                format!("{what} ({x}, {y}, {z}) has no direction"),
                "give a vector with a length from 1e-60 to 1e60",
            )
        })
    }

    /// The direction from `a` to `b`, and their distance.
    fn axis(&mut self, what: &str, a: &Point, b: &Point) -> Result<(Vector, f64), Reported> {
        let (a, b) = (self.point(a)?, self.point(b)?);
        let arm = b - a;
        if arm.amax() <= ROUNDING * a.coords.amax().max(b.coords.amax()) {
            let message = format!("the two points on the axis of `{what}` coincide");
            return Err(self.wrong(message, "two different points define the axis"));
        }
        let axis = self.direction(&format!("the axis of `{what}`"), &arm)?;
        Ok((axis, arm.dot(&axis)))
    }

    fn plane(&mut self, point: &Point, normal: &Vector) -> Result<Shape, Reported> {
        let (point, normal) = (self.point(point)?, self.direction("the normal of the plane", normal)?);
        Ok(Shape::of(Surface::Plane(Plane { point, normal })))
    }

    fn cone(&mut self, ends: [&Point; 2], radii: [f64; 2]) -> Result<Shape, Reported> {
        let (axis, length) = self.axis("cone", ends[0], ends[1])?;
        let largest = radii[0].max(radii[1]);
        if radii[0].min(radii[1]) < 0.0 || largest <= 0.0 {
            let message = format!("`cone` cannot have the radii {} and {}", radii[0], radii[1]);
            return Err(self.wrong(message, "one radius may be zero (the apex), the other must be positive"));
        }
        self.radius("cone", largest)?;
        if same_radius(radii[0], radii[1]) {
            return Ok(Shape::of(Surface::Cylinder(Cylinder { point: *ends[0], axis, radius: largest })));
        }
        // Use the wider end, which is never the apex.
        let point = if radii[0] > radii[1] { *ends[0] } else { *ends[1] };
        let slope = (radii[1] - radii[0]) / length;
        if !(SMALLEST_LENGTH..=LARGEST_LENGTH).contains(&slope.abs()) {
            return Err(self.wrong(format!("the slope {slope:e} of `cone` is out of range"), ""));
        }
        Ok(Shape::of(Surface::Cone(Cone { point, axis, radius: largest, slope })))
    }

    /// An elliptic cone. As in NETGEN the axis is (longer semi-axis) × (shorter semi-axis).
    fn elliptic_cone(
        &mut self,
        base: &Point,
        semi_axes: [&Vector; 2],
        height: f64,
        ratio: f64,
    ) -> Result<Shape, Reported> {
        let (mut axes, mut radii) = self.semi_axes("ellipticcone", semi_axes)?;
        if radii[0] < radii[1] && !same_radius(radii[0], radii[1]) {
            axes.reverse();
            radii.reverse();
            let message = "the height of this `ellipticcone` is measured along second × first semi-axis";
            let help = "as in NETGEN, because the second semi-axis is longer; give the longer one first";
            self.report.warn(self.span, message, help);
        }
        let point = self.point(base)?;
        if !(SMALLEST_LENGTH..=LARGEST_LENGTH).contains(&height.abs()) {
            let message = format!("`ellipticcone` cannot have the height {height}");
            return Err(self.wrong(
                message,
                "the height is the distance at which the semi-axes are `ratio` times those of the base",
            ));
        }
        if !(0.0..=LARGEST_LENGTH).contains(&ratio) {
            let help = "0 puts the apex at the height, 1 makes a cylinder";
            return Err(self.wrong(format!("`ellipticcone` cannot have the ratio {ratio}"), help));
        }
        let rate = (ratio - 1.0) / height;
        let surface = if same_radius(ratio, 1.0) {
            elliptic_cylinder(point, axes, radii)
        } else if same_radius(radii[0], radii[1]) {
            let axis = axes[0].cross(&axes[1]).normalize();
            Surface::Cone(Cone { point, axis, radius: radii[0], slope: rate * radii[0] })
        } else {
            let axis = axes[0].cross(&axes[1]).normalize();
            Surface::EllipticCone(EllipticCone { point, axes, radii, axis, rate })
        };
        Ok(Shape::of(surface))
    }

    /// The semi-axes as orthogonal unit vectors and lengths.
    fn semi_axes<const N: usize>(
        &mut self,
        what: &str,
        vectors: [&Vector; N],
    ) -> Result<([Vector; N], [f64; N]), Reported> {
        let mut axes = [Vector::zeros(); N];
        let mut radii = [0.0; N];
        let mut largest_cosine: f64 = 0.0;
        for i in 0..N {
            let given = self.direction(&format!("a semi-axis of `{what}`"), vectors[i])?;
            radii[i] = self.radius(what, vectors[i].dot(&given))?;
            let mut axis = given;
            for other in &axes[..i] {
                largest_cosine = largest_cosine.max(given.dot(other).abs());
                axis -= other * axis.dot(other);
            }
            axes[i] = axis.try_normalize(ALMOST_RIGHT_ANGLE).unwrap_or(given);
        }
        let degrees = largest_cosine.min(1.0).acos().to_degrees();
        if largest_cosine > ALMOST_RIGHT_ANGLE {
            let message = format!("semi-axes of `{what}` are at {degrees:.4} degrees, not at right angles");
            return Err(self.wrong(message, "give the principal axes"));
        }
        if largest_cosine > RIGHT_ANGLE {
            let message = format!("semi-axes of `{what}` are at {degrees:.4} degrees and were turned to 90");
            self.report.warn(self.span, message, "give them with more digits");
        }
        Ok((axes, radii))
    }

    fn brick(&mut self, min: &Point, max: &Point) -> Result<Shape, Reported> {
        let (min, max) = (self.point(min)?, self.point(max)?);
        for (i, name) in ["x", "y", "z"].into_iter().enumerate() {
            if min[i] >= max[i] {
                let message =
                    format!("`orthobrick` has no extent along {name}: from {} to {}", min[i], max[i]);
                return Err(self.wrong(message, "give the corner with the smallest coordinates first"));
            }
        }
        // NETGEN's order, used by lists of boundary numbers: z, y, x, the lower face first.
        let plane = |point, normal| Surface::Plane(Plane { point, normal });
        let pair = |axis: Vector| [plane(min, -axis), plane(max, axis)];
        let surfaces = [Vector::z(), Vector::y(), Vector::x()].map(pair).concat();
        let inside = Solid::And((0..6).map(inside_of).collect());
        Ok(Shape { surfaces, inside, faces: (0..6).collect(), joints: Vec::new() })
    }

    fn torus(&mut self, center: &Point, axis: &Vector, major: f64, minor: f64) -> Result<Shape, Reported> {
        let (center, axis) = (self.point(center)?, self.direction("the axis of `torus`", axis)?);
        let (major, minor) = (self.radius("torus", major)?, self.radius("torus", minor)?);
        let torus = Torus { center, axis, major, minor };
        Ok(if minor < major { Shape::of(Surface::Torus(torus)) } else { self.closed_torus(torus) })
    }

    /// A torus without a hole: everything that the tube sweeps. Its surface has no tangent plane on
    /// the axis, so a rod about the axis fills the dimples up to a small radius.
    fn closed_torus(&mut self, torus: Torus) -> Shape {
        /// Radius of the rod, relative to the radius of the tube.
        const ROD: f64 = 0.1;
        /// Largest radius of the rod, relative to that of the center line: its ends stay in the
        /// dimples.
        const LARGEST_ROD: f64 = 0.5;
        let Torus { center, axis, major, minor } = torus;
        let radius = (ROD * minor).min(LARGEST_ROD * major);
        let end = (minor + major - radius).sqrt() * (minor - major + radius).sqrt();
        let message =
            format!("the `torus` has no hole: its dimples are filled up to {radius:.3e} from the axis");
        self.report.warn(self.span, message, "the larger radius comes first if a hole is meant");
        let cap = |normal: Vector| Surface::Plane(Plane { point: center + normal * end, normal });
        let rod = Surface::Cylinder(Cylinder { point: center, axis, radius });
        let surfaces = vec![Surface::Torus(torus), rod, cap(-axis), cap(axis)];
        let inside = Solid::Or(vec![inside_of(0), Solid::And((1..4).map(inside_of).collect())]);
        Shape { faces: vec![0; surfaces.len()], surfaces, inside, joints: Vec::new() }
    }
}
