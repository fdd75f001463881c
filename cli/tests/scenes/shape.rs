//! The primitives of the language: their text, and independent formulas for their surfaces.
//!
//! Nothing here uses the crate `csg`, so that errors of the parser, the features or the mesh are
//! found.

use std::fmt::Write;

pub type Vec3 = [f64; 3];

pub fn add(a: Vec3, b: Vec3) -> Vec3 {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}
pub fn sub(a: Vec3, b: Vec3) -> Vec3 {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}
pub fn scale(a: Vec3, t: f64) -> Vec3 {
    a.map(|x| x * t)
}
pub fn dot(a: Vec3, b: Vec3) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}
pub fn cross(a: Vec3, b: Vec3) -> Vec3 {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}
pub fn norm(a: Vec3) -> f64 {
    dot(a, a).sqrt()
}

/// A primitive. The scene bounds infinite ones by planes.
#[derive(Clone, Debug)]
pub enum Shape {
    Plane {
        point: Vec3,
        normal: Vec3,
    },
    Sphere {
        center: Vec3,
        radius: f64,
    },
    Cylinder {
        ends: [Vec3; 2],
        radius: f64,
    },
    Cone {
        ends: [Vec3; 2],
        radii: [f64; 2],
    },
    Torus {
        center: Vec3,
        axis: Vec3,
        radii: [f64; 2],
    },
    Ellipsoid {
        center: Vec3,
        axes: [Vec3; 3],
    },
    EllipticCylinder {
        center: Vec3,
        axes: [Vec3; 2],
    },
    /// Base centre, semi-axes of the base (the longer first), height, ratio of top to base.
    EllipticCone {
        center: Vec3,
        axes: [Vec3; 2],
        height: f64,
        ratio: f64,
    },
    Brick {
        low: Vec3,
        high: Vec3,
    },
    /// A convex polyhedron: its points and its triangles or quadrilaterals, counterclockwise from
    /// outside.
    Polyhedron {
        points: Vec<Vec3>,
        faces: Vec<Vec<usize>>,
    },
}

/// Signed distance of a point from the surface, negative inside, to first order; and the least
/// radius of curvature.
#[derive(Clone, Copy, Debug)]
pub struct Sight {
    pub distance: f64,
    pub radius: f64,
}

impl Shape {
    /// The text in a `.geo` file.
    pub fn text(&self) -> String {
        let v = |p: &Vec3| format!("{}, {}, {}", p[0], p[1], p[2]);
        match self {
            Self::Plane { point, normal } => format!("plane ({}; {})", v(point), v(normal)),
            Self::Sphere { center, radius } => format!("sphere ({}; {radius})", v(center)),
            Self::Cylinder { ends: [a, b], radius } => format!("cylinder ({}; {}; {radius})", v(a), v(b)),
            Self::Cone { ends: [a, b], radii: [r, s] } => format!("cone ({}; {r}; {}; {s})", v(a), v(b)),
            Self::Torus { center, axis, radii: [r, s] } => {
                format!("torus ({}; {}; {r}; {s})", v(center), v(axis))
            }
            Self::Ellipsoid { center, axes: [a, b, c] } => {
                format!("ellipsoid ({}; {}; {}; {})", v(center), v(a), v(b), v(c))
            }
            Self::EllipticCylinder { center, axes: [a, b] } => {
                format!("ellipticcylinder ({}; {}; {})", v(center), v(a), v(b))
            }
            Self::EllipticCone { center, axes: [a, b], height, ratio } => {
                format!("ellipticcone ({}; {}; {}; {height}; {ratio})", v(center), v(a), v(b))
            }
            Self::Brick { low, high } => format!("orthobrick ({}; {})", v(low), v(high)),
            Self::Polyhedron { points, faces } => {
                let mut text = "polyhedron (".to_owned();
                points.iter().for_each(|p| write!(text, "{}; ", v(p)).unwrap());
                for face in faces {
                    let indices: Vec<String> = face.iter().map(|i| (i + 1).to_string()).collect();
                    write!(text, "; {}", indices.join(", ")).unwrap();
                }
                text + ")"
            }
        }
    }

    /// The distance and radius of curvature at a point.
    pub fn look(&self, p: Vec3) -> Sight {
        let flat = |distance: f64| Sight { distance, radius: f64::INFINITY };
        match self {
            Self::Plane { point, normal } => flat(dot(sub(p, *point), *normal) / norm(*normal)),
            Self::Sphere { center, radius } => {
                Sight { distance: norm(sub(p, *center)) - radius, radius: *radius }
            }
            Self::Cylinder { ends: [a, b], radius } => {
                let axis = scale(sub(*b, *a), 1.0 / norm(sub(*b, *a)));
                Sight { distance: norm(cross(sub(p, *a), axis)) - radius, radius: *radius }
            }
            Self::Cone { ends: [a, b], radii: [r, s] } => {
                let length = norm(sub(*b, *a));
                let axis = scale(sub(*b, *a), 1.0 / length);
                let height = dot(sub(p, *a), axis);
                let slope = (s - r) / length;
                let at = (r + slope * height).abs();
                let distance = (norm(cross(sub(p, *a), axis)) - at) / slope.hypot(1.0);
                Sight { distance, radius: at }
            }
            Self::Torus { center, axis, radii: [major, minor] } => {
                let axis = scale(*axis, 1.0 / norm(*axis));
                let arm = sub(p, *center);
                let out = norm(cross(arm, axis)) - major;
                Sight { distance: out.hypot(dot(arm, axis)) - minor, radius: minor.min(major - minor) }
            }
            Self::Ellipsoid { center, axes } => quadratic(sub(p, *center), axes),
            Self::EllipticCylinder { center, axes } => quadratic(sub(p, *center), axes),
            Self::EllipticCone { center, axes, height, ratio } => {
                let up = cross(axes[0], axes[1]);
                let arm = sub(p, *center);
                let factor = 1.0 + (ratio - 1.0) / height * dot(arm, up) / norm(up);
                let axes = axes.map(|a| scale(a, factor.abs().max(1e-12)));
                quadratic(arm, &axes)
            }
            Self::Brick { low, high } => {
                let out = |i: usize| f64::max(low[i] - p[i], p[i] - high[i]);
                flat(out(0).max(out(1)).max(out(2)))
            }
            Self::Polyhedron { points, faces } => {
                let out = |face: &Vec<usize>| {
                    let [a, b, c] = [points[face[0]], points[face[1]], points[face[2]]];
                    let normal = cross(sub(b, a), sub(c, a));
                    dot(sub(p, a), normal) / norm(normal)
                };
                flat(faces.iter().map(out).fold(f64::NEG_INFINITY, f64::max))
            }
        }
    }
}

/// The distance and radius of curvature for the quadric with these orthogonal semi-axes.
fn quadratic(arm: Vec3, axes: &[Vec3]) -> Sight {
    let squares = axes.iter().map(|a| dot(*a, *a));
    let (mut value, mut gradient) = (0.0, [0.0; 3]);
    for (axis, square) in axes.iter().zip(squares.clone()) {
        let part = dot(arm, *axis) / square;
        value += part * part;
        gradient = add(gradient, scale(*axis, part / square));
    }
    let (least, most) = squares.fold((f64::INFINITY, 0.0_f64), |(low, high), s| (low.min(s), high.max(s)));
    let root = value.sqrt();
    // The square root of the quadratic form has the gradient of a distance near the surface.
    let slope = (norm(gradient) / root.max(1e-300)).max(1.0 / most.sqrt());
    Sight { distance: (root - 1.0) / slope, radius: least / most.sqrt() }
}
