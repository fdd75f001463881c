//! Charts: maps of surfaces to sites whose orientation is decided exactly.
//!
//! A **chart** maps each point of a surface to a **site**, a few numbers, such that the triangle of
//! three sites has an exact sign. An embedded triangulation in the chart is one on the surface,
//! however coarse: topological decisions are made in the chart, decisions about shape and size in
//! space.
//!
//! * **Flat** (planes): coordinates in a fixed orthonormal frame of the plane.
//! * **Central** (spheres, ellipsoids): directions from the centre. Edges are great circles, and
//!   chords of the surface project to them exactly, so the sign is that of a tet with the centre.
//! * **Unrolled** (cylinders, one nappe of a cone, tori): the angle about the axis in turns,
//!   rounded to multiples of 2⁻⁵⁰ so that differences modulo one turn are exact, and a height; two
//!   symbolic **poles** are infinitely far up and down, and one of them is the apex of a cone. On
//!   tori and other revolved ellipses the height is a turn too.
//! * **Capped** (revolved ellipses that meet their axis): like central, with latitudes proportional
//!   to the parameter of the ellipse.
//! * **Swept** (sections moved along a circle): flat if the section is a line, with the angle along
//!   the circle and the position on the line; unrolled if it is an ellipse, with its parameter as
//!   turn and the angle as height.

use crate::ground::kernel::predicates::{Sign, orient2d, orient3d};
use crate::{Point, Vector};
use csg::Surface;
use csg::primitive::{Ellipse, Section, Sweep};
use start::{Start, bipyramid, icosahedron, torus_grid};
use std::f64::consts::{FRAC_PI_2, TAU};

mod start;

/// The coordinates of a point in a chart.
///
/// Flat: x, y, 0. Central: direction and length in half-axes. Unrolled: turn, height, and −1, 0 or
/// 1 for the lower pole, an ordinary point or the upper pole.
/// pole, a point, the upper pole.
pub(super) type Site = [f64; 3];

/// Resolution of turns: 2⁵⁰ per turn. Sums of two are exact, and vertices of a mesh are farther
/// apart.
const TURN_GRID: f64 = (1_u64 << 50) as f64;

/// A chart of one connected sheet of a surface.
#[derive(Clone, Debug)]
pub(super) struct Chart {
    origin: Point,
    axes: [Vector; 3],
    radii: [f64; 3],
    shape: Shape,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Shape {
    Flat,
    Central,
    /// A cylinder; the height is the coordinate along the axis.
    Straight,
    /// One nappe of a cone: radii are proportional to `1 + rate·height`, which has the sign of
    /// `nappe`.
    Conic {
        rate: f64,
        nappe: f64,
    },
    /// A torus; the minor radius is in `radii`.
    Around {
        major: f64,
    },
    /// A revolved ellipse that does not meet the axis, in coordinates (distance from the axis,
    /// height).
    Tube {
        profile: Ellipse,
    },
    /// A revolved ellipse that meets the axis: the parameter of the middle of its part off the
    /// axis, and half the parameter range to the poles.
    Capped {
        profile: Ellipse,
        middle: f64,
        half: f64,
    },
    /// A line swept along an ellipse.
    Strip(Sweep),
    /// An ellipse swept along an ellipse.
    Hose(Sweep),
}

/// The sheets of a surface: the signs of the nappes for a double cone, one sheet otherwise.
pub(super) fn sheets(surface: &Surface) -> &'static [f64] {
    match surface {
        Surface::Cone(_) | Surface::EllipticCone(_) => &[1.0, -1.0],
        _ => &[1.0],
    }
}

/// The nappe of a cone that contains a point: 1 or −1, or 0 for the apex up to rounding; 1 for
/// other surfaces.
pub(super) fn nappe(surface: &Surface, point: &Point) -> f64 {
    let (along, apex) = match surface {
        Surface::Cone(c) => (c.axis * c.slope.signum(), c.apex()),
        Surface::EllipticCone(c) => (c.axis * c.rate.signum(), c.apex()),
        Surface::Nappe(c) => (c.axis * c.slope.signum(), c.apex()),
        _ => return 1.0,
    };
    if is_apex(surface, point) { 0.0 } else { (point - apex).dot(&along).signum() }
}

/// Whether a point is the apex of the cone, up to rounding of its coordinates.
fn is_apex(surface: &Surface, point: &Point) -> bool {
    /// The apex is computed from the parameters, but features find it by Newton's method; both are
    /// off by some ulp.
    const APEX: f64 = 1e-10;
    let (apex, length) = match surface {
        Surface::Cone(c) => (c.apex(), c.radius.abs().max((c.radius / c.slope).abs())),
        Surface::EllipticCone(c) => (c.apex(), c.radii[0].max(c.radii[1]).max(1.0 / c.rate.abs())),
        Surface::Nappe(c) => (c.apex(), c.radius.max((c.radius / c.slope).abs())),
        _ => return false,
    };
    (point - apex).norm() <= APEX * (length + apex.coords.amax())
}

impl Chart {
    /// The chart of a surface; for a cone, of the nappe on which the radius has the sign of
    /// `nappe`.
    pub fn new(surface: &Surface, nappe: f64) -> Self {
        let round = |origin: Point, axis: &Vector, radius: f64, shape| {
            let [x, y] = frame(axis);
            Self { origin, axes: [x, y, *axis], radii: [radius, radius, 1.0], shape }
        };
        match surface {
            Surface::Plane(p) => {
                let [x, y] = frame(&p.normal);
                Self { origin: Point::origin(), axes: [x, y, p.normal], radii: [1.0; 3], shape: Shape::Flat }
            }
            Surface::Sphere(s) => Self {
                origin: s.center,
                axes: [Vector::x(), Vector::y(), Vector::z()],
                radii: [s.radius; 3],
                shape: Shape::Central,
            },
            Surface::Ellipsoid(e) => {
                let [x, y, z] = e.axes;
                // Right-handed, so that orientation is seen from outside.
                let z = if x.cross(&y).dot(&z) < 0.0 { -z } else { z };
                Self { origin: e.center, axes: [x, y, z], radii: e.radii, shape: Shape::Central }
            }
            Surface::Cylinder(c) => round(c.point, &c.axis, c.radius, Shape::Straight),
            Surface::EllipticCylinder(c) => Self {
                origin: c.point,
                axes: [c.axes[0], c.axes[1], c.axis()],
                radii: [c.radii[0], c.radii[1], 1.0],
                shape: Shape::Straight,
            },
            Surface::Cone(c) => {
                round(c.point, &c.axis, c.radius, Shape::Conic { rate: c.slope / c.radius, nappe })
            }
            Surface::EllipticCone(c) => {
                let [x, y] = c.axes;
                let y = if x.cross(&y).dot(&c.axis) < 0.0 { -y } else { y };
                Self {
                    origin: c.point,
                    axes: [x, y, c.axis],
                    radii: [c.radii[0], c.radii[1], 1.0],
                    shape: Shape::Conic { rate: c.rate, nappe },
                }
            }
            Surface::Torus(t) => round(t.center, &t.axis, t.minor, Shape::Around { major: t.major }),
            Surface::Nappe(c) => {
                round(c.point, &c.axis, c.radius, Shape::Conic { rate: c.slope / c.radius, nappe })
            }
            Surface::Revolved(r) => {
                let profile = r.profile;
                let shape = match profile.right_part() {
                    None => Shape::Tube { profile },
                    Some((middle, half)) => Shape::Capped { profile, middle, half },
                };
                round(r.point, &r.axis, 1.0, shape)
            }
            Surface::Sweep(s) => {
                let shape = match s.section {
                    Section::Line { .. } => Shape::Strip(*s),
                    Section::Ellipse(_) => Shape::Hose(*s),
                };
                round(s.center, &s.axis, 1.0, shape)
            }
        }
    }

    /// Whether the chart is planar: sites are coordinates in a plane, though the surface may be
    /// curved.
    pub fn is_flat(&self) -> bool {
        matches!(self.shape, Shape::Flat | Shape::Strip(_))
    }

    /// Whether the surface is closed, so that the vertices of the initial triangulation lie on it.
    pub fn is_closed(&self) -> bool {
        matches!(
            self.shape,
            Shape::Central | Shape::Around { .. } | Shape::Tube { .. } | Shape::Capped { .. }
        )
    }

    /// Whether a site is a pole.
    pub fn is_pole(&self, site: &Site) -> bool {
        matches!(self.shape, Shape::Straight | Shape::Conic { .. } | Shape::Hose(_)) && site[2] != 0.0
    }

    /// The pole that represents the apex of a cone: 1 above, −1 below, 0 if there is none.
    fn apex_pole(&self) -> f64 {
        match self.shape {
            Shape::Conic { rate, nappe } => -(rate * nappe).signum(),
            _ => 0.0,
        }
    }

    /// The site of a point of the surface.
    pub fn site(&self, surface: &Surface, point: &Point) -> Site {
        let arm = point - self.origin;
        let [x, y, z] = [0, 1, 2].map(|i| arm.dot(&self.axes[i]) / self.radii[i]);
        match self.shape {
            Shape::Flat => [x, y, 0.0],
            Shape::Central => [x, y, z],
            Shape::Straight => [turn(x, y), z, 0.0],
            Shape::Conic { .. } if is_apex(surface, point) => [0.0, 0.0, self.apex_pole()],
            // The logarithm makes the map conformal; its sign makes the height increase along the
            // axis on both nappes.
            Shape::Conic { rate, nappe } => [turn(x, y), (rate * nappe).signum() * x.hypot(y).ln(), 0.0],
            Shape::Around { major } => {
                let radial = x.hypot(y) - major / self.radii[0];
                [turn(x, y), turn(radial, z / self.radii[0]), 0.0]
            }
            Shape::Tube { profile } => [turn(x, y), on_grid(profile.angle([x.hypot(y), z])), 0.0],
            Shape::Capped { profile, middle, half } => {
                let distance = x.hypot(y);
                let along = wrap((profile.angle([distance, z]) - middle) / TAU) * TAU;
                let (sin, cos) = ((along / half).clamp(-1.0, 1.0) * FRAC_PI_2).sin_cos();
                let [x, y] = if distance > 0.0 { [x, y].map(|c| c / distance * cos) } else { [0.0; 2] };
                [x, y, sin]
            }
            Shape::Strip(sweep) => {
                let (angle, [x, y]) = sweep.coordinates(point);
                let normal = line_normal(&sweep);
                [angle * mean_radius(&sweep), normal[0] * y - normal[1] * x, 0.0]
            }
            Shape::Hose(sweep) => {
                let (angle, at) = sweep.coordinates(point);
                [on_grid(section_ellipse(&sweep).angle(at)), -angle * mean_radius(&sweep), 0.0]
            }
        }
    }

    /// The sign of the triangle of three sites: positive if counter-clockwise as seen against the
    /// gradient.
    ///
    /// Also negative if the sites enclose no triangle because their edges wind around the axis.
    pub fn orient(&self, a: &Site, b: &Site, c: &Site) -> Sign {
        match self.shape {
            Shape::Flat | Shape::Strip(_) => orient2d([a[0], a[1]], [b[0], b[1]], [c[0], c[1]]),
            Shape::Central | Shape::Capped { .. } => {
                orient3d(&Point::origin(), &(*a).into(), &(*b).into(), &(*c).into())
            }
            Shape::Around { .. } | Shape::Tube { .. } => {
                let [(x1, y1), (x2, y2), (x3, y3)] =
                    [(a, b), (a, c), (b, c)].map(|(p, q)| (wrap(q[0] - p[0]), wrap(q[1] - p[1])));
                let wide = [x1, x2, x3, y1, y2, y3].iter().any(|d| d.abs() >= 0.5);
                if wide || x2 - x1 != x3 || y2 - y1 != y3 {
                    return Sign::Negative;
                }
                orient2d([0.0, 0.0], [x1, y1], [x2, y2])
            }
            Shape::Straight | Shape::Conic { .. } | Shape::Hose(_) => match [a[2], b[2], c[2]] {
                [0.0, 0.0, 0.0] => {
                    let [x1, x2, x3] = [(a, b), (a, c), (b, c)].map(|(p, q)| wrap(q[0] - p[0]));
                    if [x1, x2, x3].iter().any(|d| d.abs() >= 0.5) || x2 - x1 != x3 {
                        return Sign::Negative;
                    }
                    orient2d([0.0, a[1]], [x1, b[1]], [x2, c[1]])
                }
                [0.0, 0.0, pole] => with_pole(a, b, pole),
                [0.0, pole, 0.0] => with_pole(c, a, pole),
                [pole, 0.0, 0.0] => with_pole(b, c, pole),
                _ => Sign::Negative,
            },
        }
    }

    /// Whether `x`, on the line through `a` and `b`, is on the same side of `a` as `b`.
    pub fn ahead(&self, a: &Site, b: &Site, x: &Site) -> bool {
        match self.shape {
            Shape::Flat | Shape::Strip(_) => {
                (b[0] - a[0]) * (x[0] - a[0]) + (b[1] - a[1]) * (x[1] - a[1]) > 0.0
            }
            Shape::Central | Shape::Capped { .. } => {
                let [a, b, x] = [a, b, x].map(|s| Vector::from(*s));
                a.cross(&b).dot(&a.cross(&x)) > 0.0
            }
            Shape::Around { .. } | Shape::Tube { .. } => {
                let step = |p: &Site| [wrap(p[0] - a[0]), wrap(p[1] - a[1])];
                let ([b0, b1], [x0, x1]) = (step(b), step(x));
                b0 * x0 + b1 * x1 > 0.0
            }
            Shape::Straight | Shape::Conic { .. } | Shape::Hose(_) => {
                if a[2] != 0.0 {
                    return true;
                }
                let step = |p: &Site| {
                    if p[2] == 0.0 { [wrap(p[0] - a[0]), p[1] - a[1]] } else { [0.0, p[2]] }
                };
                let ([b0, b1], [x0, x1]) = (step(b), step(x));
                b0 * x0 + b1 * x1 > 0.0
            }
        }
    }

    /// An initial triangulation that covers the whole sheet; empty for a flat chart.
    ///
    /// `heights` is the range of heights of the vertices that will be inserted. Different
    /// `attempt`s put the initial vertices at different sites, in case one coincides with an
    /// inserted vertex.
    pub fn start(&self, heights: [f64; 2], attempt: u32) -> Start {
        // Irrational fractions avoid sites that occur in practice.
        let shift = (0.137_213_1 + f64::from(attempt) * 0.618_033_988_749).fract();
        match self.shape {
            Shape::Flat | Shape::Strip(_) => Start { sites: Vec::new(), triangles: Vec::new() },
            Shape::Central | Shape::Capped { .. } => icosahedron(shift),
            Shape::Around { major } => torus_grid(shift, major / self.radii[0]),
            Shape::Tube { profile } => {
                torus_grid(shift, profile.center[0] / profile.radii[0].max(profile.radii[1]))
            }
            Shape::Straight | Shape::Conic { .. } | Shape::Hose(_) => {
                let margin = 1.0 + (heights[1] - heights[0]);
                let apex = self.apex_pole();
                let height = if apex < 0.0 { heights[1] + margin } else { heights[0] - margin };
                bipyramid(height, shift, apex)
            }
        }
    }

    /// The point of the surface at a site, up to rounding; `None` for a pole, in the chart of a
    /// plane, and on the inner sheet of a torus without a hole, which is on no boundary.
    pub fn point(&self, site: &Site) -> Option<Point> {
        let round = |radius: f64| {
            let (sin, cos) = (TAU * site[0]).sin_cos();
            [radius * cos, radius * sin]
        };
        let [x, y, z] = match self.shape {
            Shape::Flat => return None,
            Shape::Central => *site,
            Shape::Around { major } => {
                let (sin, cos) = (TAU * site[1]).sin_cos();
                let distance = major / self.radii[0] + cos;
                if distance <= 0.0 {
                    return None;
                }
                let [x, y] = round(distance);
                [x, y, sin * self.radii[0]]
            }
            Shape::Tube { profile } => {
                let [distance, height] = profile.point(TAU * site[1]);
                let [x, y] = round(distance);
                [x, y, height]
            }
            Shape::Capped { profile, middle, half } => {
                let level = site[0].hypot(site[1]);
                let [distance, height] = profile.point(middle + site[2].atan2(level) / FRAC_PI_2 * half);
                let [x, y] =
                    if level > 0.0 { [site[0], site[1]].map(|c| c / level * distance) } else { [0.0; 2] };
                [x, y, height]
            }
            Shape::Strip(sweep) => {
                let (normal, t) = (line_normal(&sweep), site[1]);
                let Section::Line { offset, .. } = sweep.section else { return None };
                let at = [offset * normal[0] - t * normal[1], offset * normal[1] + t * normal[0]];
                return Some(sweep.place(site[0] / mean_radius(&sweep), at));
            }
            _ if site[2] != 0.0 => return None,
            Shape::Hose(sweep) => {
                let at = section_ellipse(&sweep).point(TAU * site[0]);
                return Some(sweep.place(-site[1] / mean_radius(&sweep), at));
            }
            Shape::Straight => {
                let [x, y] = round(1.0);
                [x, y, site[1]]
            }
            Shape::Conic { rate, nappe } => {
                let radius = ((rate * nappe).signum() * site[1]).exp();
                let [x, y] = round(radius);
                [x, y, (nappe * radius - 1.0) / rate]
            }
        };
        Some(
            self.origin
                + self.axes[0] * (x * self.radii[0])
                + self.axes[1] * (y * self.radii[1])
                + self.axes[2] * (z * self.radii[2]),
        )
    }

    /// The vector from one site to another on the unrolled surface, with angles and lengths nearly
    /// those on the surface up to a common factor; `None` for poles, and in charts that are not
    /// unrolled.
    pub fn unrolled(&self, from: &Site, to: &Site) -> Option<[f64; 2]> {
        if self.is_pole(from) || self.is_pole(to) {
            return None;
        }
        let radius = 0.5 * (self.radii[0] + self.radii[1]);
        let turned = TAU * wrap(to[0] - from[0]);
        let (along, turned_along) = (to[1] - from[1], TAU * wrap(to[1] - from[1]));
        match self.shape {
            Shape::Straight => Some([radius * turned, along]),
            // Along the axis the cone is longer than the change of its radius.
            Shape::Conic { rate, .. } => Some([turned, along * (1.0 / (rate * radius)).hypot(1.0)]),
            Shape::Hose(sweep) => {
                let [a, b] = section_ellipse(&sweep).radii;
                Some([0.5 * (a + b) * turned, along])
            }
            Shape::Around { major } => Some([major * turned, radius * turned_along]),
            Shape::Tube { profile } => {
                let [a, b] = profile.radii;
                Some([profile.center[0] * turned, 0.5 * (a + b) * turned_along])
            }
            Shape::Flat | Shape::Central | Shape::Capped { .. } | Shape::Strip(_) => None,
        }
    }

    /// The point of the surface at the midpoint of a chart edge, up to rounding; `None` if
    /// [`point`](Self::point) has none.
    pub fn middle(&self, a: &Site, b: &Site) -> Option<Point> {
        if self.is_pole(a) || self.is_pole(b) {
            return None;
        }
        let half = |i: usize| a[i] + 0.5 * wrap(b[i] - a[i]);
        self.point(&match self.shape {
            Shape::Flat => return None,
            Shape::Central | Shape::Capped { .. } => {
                let direction = (Vector::from(*a) + Vector::from(*b)).try_normalize(0.0)?;
                [direction.x, direction.y, direction.z]
            }
            Shape::Strip(_) => [0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1]), 0.0],
            Shape::Around { .. } | Shape::Tube { .. } => [half(0), half(1), 0.0],
            Shape::Straight | Shape::Conic { .. } | Shape::Hose(_) => [half(0), 0.5 * (a[1] + b[1]), 0.0],
        })
    }
}

/// Factor that makes the parameter of a sweep's path approximately its arc length.
fn mean_radius(sweep: &Sweep) -> f64 {
    0.5 * (sweep.radii[0] + sweep.radii[1])
}

/// The normal of the line that is a strip's section.
fn line_normal(sweep: &Sweep) -> [f64; 2] {
    match sweep.section {
        Section::Line { normal, .. } => normal,
        Section::Ellipse(_) => [0.0; 2],
    }
}

/// The ellipse that is a hose's section.
fn section_ellipse(sweep: &Sweep) -> Ellipse {
    match sweep.section {
        Section::Ellipse(ellipse) => ellipse,
        Section::Line { .. } => Ellipse { center: [0.0; 2], axis: [1.0, 0.0], radii: [1.0; 2] },
    }
}

/// The sign of the triangle of a, b and a pole.
fn with_pole(a: &Site, b: &Site, pole: f64) -> Sign {
    let across = wrap(b[0] - a[0]);
    if across.abs() >= 0.5 {
        return Sign::Negative;
    }
    orient2d([0.0, 0.0], [across, 0.0], [0.0, pole])
}

/// Maps a difference of turns to −1/2 … 1/2; exact for multiples of the grid.
fn wrap(turns: f64) -> f64 {
    turns - turns.round()
}

/// The angle of (x, y) in turns from 0 to 1, rounded to the grid.
fn turn(x: f64, y: f64) -> f64 {
    on_grid(y.atan2(x))
}

/// An angle in turns from 0 to 1, rounded to the grid.
fn on_grid(angle: f64) -> f64 {
    let turns = ((angle / TAU).rem_euclid(1.0) * TURN_GRID).round() / TURN_GRID;
    if turns >= 1.0 { 0.0 } else { turns }
}

/// Two unit vectors that form a right-handed frame with a unit normal; coordinate axes if the
/// normal is one.
fn frame(normal: &Vector) -> [Vector; 2] {
    let k = if normal.x.abs() < 0.6 { 0 } else { 1 };
    let mut x = Vector::zeros();
    x[k] = 1.0;
    let x = (x - normal * normal[k]).normalize();
    [x, normal.cross(&x)]
}

#[cfg(test)]
mod tests;
