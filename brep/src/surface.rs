//! Surfaces.

use crate::bspline::SplineSurface;
use crate::curve::Curve;
use crate::{Placement, Point, Vector};
use nalgebra::Vector4;
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;

/// Derivatives of a surface: `d[i][j]` is the i-th in u and j-th in v, up to a total order.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Jet {
    /// The derivatives; those beyond the order are zero.
    pub d: [[Vector; 4]; 4],
}

impl Jet {
    /// The point.
    pub fn point(&self) -> Point {
        Point::from(self.d[0][0])
    }

    /// The unit normal, along the cross product of the first derivatives; `None` at poles, where
    /// one of them vanishes up to rounding, and where they are parallel.
    pub fn normal(&self) -> Option<Vector> {
        /// The shortest derivative, or sine of the angle between them, that is not rounding.
        const LEAST: f64 = 1e-10;
        let [a, b] = [self.d[1][0], self.d[0][1]];
        let (p, q) = (a.norm(), b.norm());
        let cross = a.cross(&b);
        let is_regular = p.min(q) > LEAST * p.max(q) && cross.norm() > LEAST * p * q;
        if is_regular { cross.try_normalize(0.0) } else { None }
    }

    /// The larger principal curvature by magnitude (1 / length); `None` where there is no normal.
    /// Needs derivatives up to order 2.
    pub fn curvature(&self) -> Option<f64> {
        let normal = self.normal()?;
        let [a, b] = [self.d[1][0], self.d[0][1]];
        let [e, f, g] = [a.dot(&a), a.dot(&b), b.dot(&b)];
        let [l, m, n] = [self.d[2][0], self.d[1][1], self.d[0][2]].map(|second| normal.dot(&second));
        let squared = e * g - f * f;
        let mean = 0.5 * (e * n - 2.0 * f * m + g * l) / squared;
        let product = (l * n - m * m) / squared;
        Some(mean.abs() + (mean * mean - product).max(0.0).sqrt())
    }
}

/// The curve that a [`Surface::Round`] turns about its axis.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Profile {
    /// Radius and height are linear in v: cylinders and cones.
    Line {
        /// The radius at v = 0.
        radius: f64,
        /// The growth of the radius and of the height with v.
        slope: [f64; 2],
    },
    /// A circle around (major, 0): spheres, if major is 0, and tori.
    Circle {
        /// The distance of the circle's center from the axis.
        major: f64,
        /// The circle's radius.
        minor: f64,
    },
}

impl Profile {
    /// Radius and height with their first three derivatives.
    #[inline]
    fn jet(&self, v: f64) -> [[f64; 2]; 4] {
        match *self {
            Self::Line { radius, slope: [a, b] } => [[radius + v * a, v * b], [a, b], [0.0; 2], [0.0; 2]],
            Self::Circle { major, minor } => {
                let (s, c) = v.sin_cos();
                let (s, c) = (s * minor, c * minor);
                [[major + c, s], [-s, c], [-c, -s], [s, -c]]
            }
        }
    }
}

/// A surface with its parametrisation.
///
/// Axes may have any length, so a similarity maps each kind to itself and keeps the parameters.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Surface {
    /// origin + u · x + v · y
    Plane {
        /// The point of parameters (0, 0).
        origin: Vector,
        /// The derivatives.
        axes: [Vector; 2],
    },
    /// origin + r(v) · (cos u · x + sin u · y) + h(v) · z: cylinders, cones, spheres, tori.
    Round {
        /// The origin.
        origin: Vector,
        /// x, y and z.
        axes: [Vector; 3],
        /// Radius r and height h.
        profile: Profile,
    },
    /// curve(u) + v · direction
    Extrusion {
        /// The curve.
        curve: Curve<3>,
        /// The direction.
        direction: Vector,
    },
    /// curve(v), turned by the angle u about an axis.
    Revolution {
        /// The curve.
        curve: Curve<3>,
        /// A point of the axis.
        origin: Vector,
        /// The unit vector of the axis.
        axis: Vector,
    },
    /// A Bézier or B-spline surface.
    Spline(SplineSurface),
    /// basis + distance · unit normal
    Offset {
        /// The other surface.
        basis: Box<Surface>,
        /// The distance.
        distance: f64,
    },
}

impl Surface {
    /// A box around the whole surface, if it is a spline: that of its poles.
    pub(crate) fn hull(&self) -> Option<[Point; 2]> {
        let Self::Spline(spline) = self else { return None };
        let mut poles = spline.poles.iter().map(|pole| Point::from(pole.xyz() / pole.w));
        let first = poles.next()?;
        Some(poles.fold([first; 2], |[low, high], pole| [low.inf(&pole), high.sup(&pole)]))
    }

    /// The value and the derivatives up to a total `order` of at most 3. Third derivatives of
    /// offsets are zero.
    pub fn jet(&self, u: f64, v: f64, order: usize) -> Jet {
        let mut jet = Jet::default();
        let d = &mut jet.d;
        match self {
            Self::Plane { origin, axes: [x, y] } => {
                d[0][0] = origin + x * u + y * v;
                (d[1][0], d[0][1]) = (*x, *y);
            }
            Self::Round { origin, axes: [x, y, z], profile } => {
                let (sine, cosine) = u.sin_cos();
                let (out, turn) = (x * cosine + y * sine, y * cosine - x * sine);
                let in_u = [out, turn, -out, -turn];
                let in_v = profile.jet(v);
                for i in 0..=order {
                    for j in 0..=order - i {
                        d[i][j] = in_u[i] * in_v[j][0];
                    }
                }
                for j in 0..=order {
                    d[0][j] += z * in_v[j][1];
                }
                d[0][0] += origin;
            }
            Self::Extrusion { curve, direction } => {
                let along = curve.jet(u);
                for i in 0..=order {
                    d[i][0] = along[i];
                }
                d[0][0] += direction * v;
                d[0][1] = *direction;
            }
            Self::Revolution { curve, origin, axis } => {
                let mut along = curve.jet(v);
                along[0] -= origin;
                let (sine, cosine) = u.sin_cos();
                for j in 0..=order {
                    let height = axis * axis.dot(&along[j]);
                    let (x, y) = (along[j] - height, axis.cross(&along[j]));
                    let (out, turn) = (x * cosine + y * sine, y * cosine - x * sine);
                    for (i, part) in [out, turn, -out, -turn].into_iter().enumerate().take(order - j + 1) {
                        d[i][j] = part;
                    }
                    d[0][j] += height;
                }
                d[0][0] += origin;
            }
            Self::Spline(spline) => return spline.jet(u, v, order),
            Self::Offset { basis, distance } => offset(&basis.jet(u, v, (order + 1).min(3)), *distance, d),
        }
        jet
    }

    /// The point of some parameters.
    pub fn point(&self, [u, v]: [f64; 2]) -> Point {
        self.jet(u, v, 0).point()
    }

    /// The periods in u and v.
    pub fn periods(&self) -> [Option<f64>; 2] {
        match self {
            Self::Plane { .. } => [None; 2],
            Self::Round { profile, .. } => match profile {
                Profile::Circle { major, .. } if *major > 0.0 => [Some(TAU); 2],
                _ => [Some(TAU), None],
            },
            Self::Extrusion { curve, .. } => [curve.period(), None],
            Self::Revolution { curve, .. } => [Some(TAU), curve.period()],
            Self::Spline(spline) => [spline.bases[0].period(), spline.bases[1].period()],
            Self::Offset { basis, .. } => basis.periods(),
        }
    }

    /// The parameters in u and v between which splines are defined: beyond they are extrapolated.
    pub(crate) fn domain(&self) -> [Option<[f64; 2]>; 2] {
        let of_curve = |curve: &Curve<3>| curve.domain().filter(|_| curve.period().is_none());
        match self {
            Self::Plane { .. } | Self::Round { .. } => [None; 2],
            Self::Extrusion { curve, .. } => [of_curve(curve), None],
            Self::Revolution { curve, .. } => [None, of_curve(curve)],
            Self::Spline(SplineSurface { bases, .. }) => {
                [0, 1].map(|i| Some(bases[i].range()).filter(|_| bases[i].period().is_none()))
            }
            Self::Offset { basis, .. } => basis.domain(),
        }
    }

    /// Whether it is a plane.
    pub fn is_plane(&self) -> bool {
        matches!(self, Self::Plane { .. })
    }

    /// The name of its kind.
    pub fn kind(&self) -> &'static str {
        match self {
            Self::Plane { .. } => "plane",
            Self::Round { profile: Profile::Line { slope: [0.0, _], .. }, .. } => "cylinder",
            Self::Round { profile: Profile::Line { .. }, .. } => "cone",
            Self::Round { profile: Profile::Circle { major: 0.0, .. }, .. } => "sphere",
            Self::Round { .. } => "torus",
            Self::Extrusion { .. } => "extrusion",
            Self::Revolution { .. } => "revolution",
            Self::Spline(_) => "B-spline",
            Self::Offset { .. } => "offset",
        }
    }

    /// The image under a similarity, with the same parameters.
    pub fn placed(&self, by: &Placement) -> Self {
        let point = |p: &Vector| by.point(&(*p).into()).coords;
        let sign = if by.is_mirrored() { -1.0 } else { 1.0 };
        match self {
            Self::Plane { origin, axes } => {
                Self::Plane { origin: point(origin), axes: axes.map(|a| by.vector(&a)) }
            }
            Self::Round { origin, axes, profile } => {
                Self::Round { origin: point(origin), axes: axes.map(|a| by.vector(&a)), profile: *profile }
            }
            Self::Extrusion { curve, direction } => {
                Self::Extrusion { curve: curve.placed(by), direction: by.vector(direction) }
            }
            Self::Revolution { curve, origin, axis } => Self::Revolution {
                curve: curve.placed(by),
                origin: point(origin),
                // A reflection reverses the sense of turning.
                axis: by.vector(axis).normalize() * sign,
            },
            Self::Spline(spline) => {
                let pole = |p: &Vector4<f64>| {
                    let image = by.linear * p.xyz() + by.shift * p.w;
                    Vector4::new(image.x, image.y, image.z, p.w)
                };
                Self::Spline(SplineSurface {
                    poles: spline.poles.iter().map(pole).collect(),
                    ..spline.clone()
                })
            }
            Self::Offset { basis, distance } => {
                Self::Offset { basis: Box::new(basis.placed(by)), distance: distance * by.scale() * sign }
            }
        }
    }

    /// The largest coordinate from which a point is computed: rounding is relative to it.
    pub(crate) fn largest_term(&self, v: f64) -> f64 {
        match self {
            Self::Round { origin, axes, profile } => {
                // All axes have one length.
                let length = axes[0].norm();
                let [radius, height] = match *profile {
                    Profile::Line { radius, slope: [a, b] } => {
                        [radius.abs().max((v * a).abs()), (v * b).abs()]
                    }
                    Profile::Circle { major, minor } => [major + minor.abs(), minor.abs()],
                };
                origin.amax().max(length * radius.max(height))
            }
            _ => 0.0,
        }
    }

    /// The surface, periodic in the directions in which it is closed.
    pub(crate) fn closed(self) -> Self {
        match self {
            Self::Spline(spline) => Self::Spline(spline.closed()),
            other => other,
        }
    }

    /// A cone with v = 0 at the height of a point; other surfaces as they are. Files give radii far
    /// from the part that are a thousand times its size, and their digits are lost.
    pub(crate) fn measured_from(self, point: &Point) -> Self {
        match self {
            Self::Round { origin, axes, profile: Profile::Line { radius, slope: [a, b] } }
                if a != 0.0 && b != 0.0 =>
            {
                let height = (point.coords - origin).dot(&axes[2]) / axes[2].norm_squared();
                let profile = Profile::Line { radius: radius + height / b * a, slope: [a, b] };
                Self::Round { origin: origin + axes[2] * height, axes, profile }
            }
            other => other,
        }
    }

    /// Whether evaluation finds all poles that it needs.
    pub fn is_sound(&self) -> bool {
        match self {
            Self::Extrusion { curve, .. } | Self::Revolution { curve, .. } => curve.is_sound(),
            Self::Spline(spline) => spline.is_sound(),
            Self::Offset { basis, .. } => basis.is_sound(),
            Self::Plane { .. } | Self::Round { .. } => true,
        }
    }
}

/// The offset of a surface by its jet of one more order.
fn offset(b: &Jet, distance: f64, d: &mut [[Vector; 4]; 4]) {
    let b = &b.d;
    let n = b[1][0].cross(&b[0][1]);
    // Derivatives of the cross product.
    let n_u = b[2][0].cross(&b[0][1]) + b[1][0].cross(&b[1][1]);
    let n_v = b[1][1].cross(&b[0][1]) + b[1][0].cross(&b[0][2]);
    let n_uu = b[3][0].cross(&b[0][1]) + b[2][0].cross(&b[1][1]) * 2.0 + b[1][0].cross(&b[2][1]);
    let n_uv =
        b[2][1].cross(&b[0][1]) + b[2][0].cross(&b[0][2]) + b[1][1].cross(&b[1][1]) + b[1][0].cross(&b[1][2]);
    let n_vv = b[1][2].cross(&b[0][1]) + b[1][1].cross(&b[0][2]) * 2.0 + b[1][0].cross(&b[0][3]);
    let length = n.norm().max(f64::MIN_POSITIVE);
    let unit = n / length;
    let along = |x: &Vector| (x - unit * unit.dot(x)) / length;
    let (first_u, first_v) = (along(&n_u), along(&n_v));
    let second = |x: &Vector, a: (&Vector, &Vector), c: (&Vector, &Vector)| {
        // a and c: the first derivatives of the normal and of the unit vector in both parameters.
        let (rate_a, rate_c) = (unit.dot(a.0), unit.dot(c.0));
        let rate = c.1.dot(a.0) + unit.dot(x);
        (x - c.1 * rate_a - a.1 * rate_c - unit * rate) / length
    };
    d[0][0] = b[0][0] + unit * distance;
    d[1][0] = b[1][0] + first_u * distance;
    d[0][1] = b[0][1] + first_v * distance;
    d[2][0] = b[2][0] + second(&n_uu, (&n_u, &first_u), (&n_u, &first_u)) * distance;
    d[1][1] = b[1][1] + second(&n_uv, (&n_u, &first_u), (&n_v, &first_v)) * distance;
    d[0][2] = b[0][2] + second(&n_vv, (&n_v, &first_v), (&n_v, &first_v)) * distance;
}
