//! Pairs of surfaces swept by the same motion of a plane, compared in that plane.
//!
//! The chord and the ellipse of an extrusion or revolution next to an arc of its profile meet at a
//! small angle. In space, the ranges of their gradients over a cell vary by more than that angle.
//! In the plane, both are of degree two at most, and their common part cancels exactly. So cells
//! along such a pair can be as large as for any crossing pair.

use crate::interval::{Cell, dot};
use crate::primitive::quadric::reject;
use crate::primitive::{Ellipse, Section};
use crate::{Interval, Point, Surface, Vector};

/// Two curves in a moving plane, with the ranges of plane coordinates over a cell.
pub(super) struct Swept {
    curves: [Section; 2],
    /// The ranges of the plane coordinates over the cell.
    at: [Interval; 2],
    /// The range of ∇x × ∇y over the cell; `None` if the cell meets the axis of the motion.
    forward: Option<Cell>,
}

impl Swept {
    /// Two surfaces in a cell, if one motion sweeps both and comparison in space is less accurate.
    pub fn new(a: &Surface, b: &Surface, cell: &Cell) -> Option<Self> {
        match (a, b) {
            (Surface::Sweep(s), other) | (other, Surface::Sweep(s)) => {
                let second = match other {
                    Surface::Sweep(t) if s.is_along(t) => t.section,
                    // The torus about the path.
                    Surface::Torus(t)
                        if t.center == s.center && t.axis == s.axis && s.radii == [t.major; 2] =>
                    {
                        Section::Ellipse(circle([0.0, 0.0], t.minor))
                    }
                    _ => return None,
                };
                let (at, forward) = s.plane_ranges(cell);
                let curves =
                    if matches!(a, Surface::Sweep(_)) { [s.section, second] } else { [second, s.section] };
                Some(Self { curves, at, forward })
            }
            _ => Self::turned(a, b, cell),
        }
    }

    /// Surfaces of revolution about one axis. Plane coordinates: distance from the axis and height
    /// along it.
    fn turned(a: &Surface, b: &Surface, cell: &Cell) -> Option<Self> {
        /// Axes closer than this fraction of the cell are the same.
        const SAME_AXIS: f64 = 1e-6;
        let is_turned =
            |s: &Surface| matches!(s, Surface::Torus(_) | Surface::Nappe(_) | Surface::Revolved(_));
        let (origin, axis) = match (is_turned(a), is_turned(b)) {
            (true, _) => axis_of(a)?,
            (_, true) => axis_of(b)?,
            _ => return None,
        };
        let [(first, gap), (second, other_gap)] =
            [meridian(a, &origin, &axis)?, meridian(b, &origin, &axis)?];
        let gap = gap.max(other_gap);
        if gap > SAME_AXIS * cell[0].width() {
            return None;
        }
        let (at, forward) = crate::primitive::meridian_ranges(&origin, &axis, cell);
        let room = Interval::new(-gap, gap);
        let forward = forward.map(|range| range.map(|x| x + room * (2.0 / at[0].lo)));
        Some(Self { curves: [first, second], at: [at[0] + room, at[1]], forward })
    }

    /// Whether the two surfaces may meet in the cell.
    pub fn can_meet(&self) -> bool {
        let center = self.at.map(|side| side.middle());
        let arm = [0, 1].map(|i| self.at[i] - Interval::point(center[i]));
        let [f, g] = self.curves.map(|curve| Taylor::of(&curve, center));
        let factor = (f.gradient[0] * g.gradient[0] + f.gradient[1] * g.gradient[1])
            / (g.gradient[0].powi(2) + g.gradient[1].powi(2));
        let zero = Taylor { value: Interval::point(0.0), ..Taylor::default() };
        f.range(&zero, 0.0, arm).contains_zero()
            && g.range(&zero, 0.0, arm).contains_zero()
            && (!factor.is_finite() || f.range(&g, factor, arm).contains_zero())
            && self.common_points().is_none_or(|points| points.iter().any(Option::is_some))
    }

    /// The intersection points of a line and an ellipse that may be in the cell; `None` for other
    /// curves.
    fn common_points(&self) -> Option<[Option<[f64; 2]>; 2]> {
        /// Error of the points relative to the size of the ellipse and its distance from the
        /// origin. The angle has the error of the cosine, 10⁻¹⁵, divided by its sine. Lines too
        /// close to tangent for this accuracy are not evaluated.
        const ROUNDING: f64 = 1e-10;
        const TANGENT: f64 = 1e-10;
        let (normal, offset, e) = match self.curves {
            [Section::Line { normal, offset }, Section::Ellipse(e)]
            | [Section::Ellipse(e), Section::Line { normal, offset }] => (normal, offset, e),
            _ => return None,
        };
        let [c, s] = e.axis;
        // Map the ellipse to the unit circle; `cosine` is the distance of the mapped line from the
        // center.
        let across =
            [e.radii[0] * (c * normal[0] + s * normal[1]), e.radii[1] * (c * normal[1] - s * normal[0])];
        let distance = offset - normal[0] * e.center[0] - normal[1] * e.center[1];
        let cosine = distance / across[0].hypot(across[1]);
        if cosine.abs() > 1.0 - TANGENT {
            return (cosine.abs() > 1.0 + TANGENT).then_some([None; 2]);
        }
        let (middle, half) = (across[1].atan2(across[0]), cosine.acos());
        let size = e.radii[0].max(e.radii[1]) + e.center[0].abs() + e.center[1].abs();
        let room = Interval::new(-ROUNDING * size, ROUNDING * size);
        let is_near = |p: &[f64; 2]| (0..2).all(|i| (self.at[i] + room).contains(p[i]));
        Some([middle - half, middle + half].map(|angle| Some(e.point(angle)).filter(is_near)))
    }

    /// Whether the intersection runs forward along `direction` in the whole cell; `None` if the
    /// cell meets the axis.
    pub fn is_monotone(&self, direction: &Vector) -> Option<bool> {
        let along = dot(direction, &self.forward?);
        match self.common_points() {
            // The whole intersection in the cell is swept by this point, where both curves are
            // known to cross.
            Some([Some(point), None] | [None, Some(point)]) => {
                let [[a, b], [c, d]] = self.curves.map(|curve| curve.gradient(point));
                return Some((along * (a * d - b * c)).lo > 0.0);
            }
            Some([Some(_), Some(_)]) => return Some(false),
            _ => {}
        }
        let center = self.at.map(|side| side.middle());
        let arm = [0, 1].map(|i| self.at[i] - Interval::point(center[i]));
        let [f, g] = self.curves.map(|curve| Taylor::of(&curve, center));
        Some((f.cross(&g, arm) * along).lo > 0.0)
    }
}

/// A quadratic Taylor polynomial about a point of the plane.
#[derive(Clone, Copy, Debug)]
struct Taylor {
    value: Interval,
    gradient: [f64; 2],
    /// xx, xy, yy.
    hessian: [f64; 3],
}

impl Default for Taylor {
    fn default() -> Self {
        Self { value: Interval::point(0.0), gradient: [0.0; 2], hessian: [0.0; 3] }
    }
}

/// Rounding error of the coefficients (sums of few products) relative to the largest one.
const ROUNDING: f64 = 16.0 * f64::EPSILON;

impl Taylor {
    fn of(curve: &Section, center: [f64; 2]) -> Self {
        Self {
            value: curve.value_range(center.map(Interval::point)),
            gradient: curve.gradient(center),
            hessian: curve.hessian(),
        }
    }

    fn largest(&self) -> [f64; 2] {
        let most = |all: &[f64]| all.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
        [most(&self.gradient), most(&self.hessian)]
    }

    /// The range of `self - factor * other` over a box around the point.
    fn range(&self, other: &Self, factor: f64, [x, y]: [Interval; 2]) -> Interval {
        let ([g, h], [k, l]) = (self.largest(), other.largest());
        let around = |z: f64, slack: f64| Interval::new(z - ROUNDING * slack, z + ROUNDING * slack);
        let slope =
            [0, 1].map(|i| around(self.gradient[i] - factor * other.gradient[i], g + factor.abs() * k));
        let bend =
            [0, 1, 2].map(|i| around(self.hessian[i] - factor * other.hessian[i], h + factor.abs() * l));
        self.value - other.value * factor
            + slope[0] * x
            + slope[1] * y
            + x.square() * bend[0] * 0.5
            + y.square() * bend[2] * 0.5
            + x * y * bend[1]
    }

    /// The range of the cross product of the gradients over a box around the point.
    fn cross(&self, other: &Self, [x, y]: [Interval; 2]) -> Interval {
        let cross = |[a, b]: [f64; 2], [c, d]: [f64; 2]| a * d - b * c;
        let columns = |t: &Self| [[t.hessian[0], t.hessian[1]], [t.hessian[1], t.hessian[2]]];
        let ([f, g], [fh, gh]) = ([self.gradient, other.gradient], [columns(self), columns(other)]);
        let ([p, h], [q, l]) = (self.largest(), other.largest());
        let around = |z: f64, slack: f64| Interval::new(z - ROUNDING * slack, z + ROUNDING * slack);
        let slope = [0, 1].map(|i| around(cross(f, gh[i]) + cross(fh[i], g), 4.0 * (p * l + q * h)));
        let mixed = cross(fh[0], gh[1]) + cross(fh[1], gh[0]);
        let bend = [cross(fh[0], gh[0]), mixed, cross(fh[1], gh[1])].map(|z| around(z, 4.0 * h * l));
        around(cross(f, g), 2.0 * p * q)
            + slope[0] * x
            + slope[1] * y
            + x.square() * bend[0]
            + y.square() * bend[2]
            + x * y * bend[1]
    }
}

fn circle(center: [f64; 2], radius: f64) -> Ellipse {
    Ellipse { center, axis: [1.0, 0.0], radii: [radius; 2] }
}

/// A point on the axis of a surface of revolution, and the direction of the axis.
fn axis_of(surface: &Surface) -> Option<(Point, Vector)> {
    match surface {
        Surface::Torus(t) => Some((t.center, t.axis)),
        Surface::Nappe(c) => Some((c.point, c.axis)),
        Surface::Revolved(r) => Some((r.point, r.axis)),
        _ => None,
    }
}

/// The meridian of a surface of revolution with respect to a given axis, oriented like the surface,
/// and the distance of its own axis from the given one.
///
/// `None` for other surfaces.
fn meridian(surface: &Surface, origin: &Point, axis: &Vector) -> Option<(Section, f64)> {
    let sign = |own: &Vector| if own == axis { Some(1.0) } else { (-own == *axis).then_some(-1.0) };
    let height = |p: &Point| (p - origin).dot(axis);
    let gap = |p: &Point| reject(&(p - origin), axis).norm();
    match surface {
        Surface::Plane(p) => {
            let sign = sign(&p.normal)?;
            Some((Section::Line { normal: [0.0, sign], offset: sign * height(&p.point) }, 0.0))
        }
        Surface::Sphere(s) => {
            Some((Section::Ellipse(circle([0.0, height(&s.center)], s.radius)), gap(&s.center)))
        }
        Surface::Cylinder(c) => {
            sign(&c.axis)?;
            Some((Section::Line { normal: [1.0, 0.0], offset: c.radius }, gap(&c.point)))
        }
        Surface::Torus(t) => {
            sign(&t.axis)?;
            let center = [t.major, height(&t.center)];
            Some((Section::Ellipse(circle(center, t.minor)), gap(&t.center)))
        }
        Surface::Nappe(c) => {
            let slope = c.slope * sign(&c.axis)?;
            let length = slope.hypot(1.0);
            let normal = [1.0 / length, -slope / length];
            let offset = normal[0] * c.radius + normal[1] * height(&c.point);
            Some((Section::Line { normal, offset }, gap(&c.point)))
        }
        Surface::Revolved(r) => {
            let sign = sign(&r.axis)?;
            let Ellipse { center: [out, up], axis: [c, s], radii } = r.profile;
            let center = [out, height(&r.point) + sign * up];
            Some((Section::Ellipse(Ellipse { center, axis: [c, sign * s], radii }), gap(&r.point)))
        }
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::interval::middle;
    use crate::language::parse_geometry;
    use crate::project::project_to_both;
    use proptest::prelude::*;

    /// A ring with a profile of lines and arcs, and a bar along a curved path: pairs of chords and
    /// arcs.
    const SOURCE: &str = "algebraic3d
curve2d profile = (6; 0, 1; 1, 3; 3, 2; 3, 1; 2, 0.6; 1, 0.9; 4; 3, 1, 2, 3; 2, 3, 4; 3, 4, 5, 6; 2, 6, 1);
curve3d path = (3; 10, 0, 0; 15, 0, 2; 15, 5, 4; 1; 3, 1, 2, 3);
solid a = revolution (0, 0, 0; 1, 2, 2; profile);
curve2d bar = (6; 0.5, 0; 0.4, -0.5; -0.5, -0.4; -0.5, 0.1; -0.4, 0.5; 0, 0.5; 4; 3, 1, 2, 3; 2, 3, 4; 3, 4, 5, 6; 2, 6, 1);
solid b = extrusion (path; bar; 0, 0, 1);
tlo a; tlo b;";

    proptest! {
        #![proptest_config(crate::seeded())]

        #[test]
        fn pairs_excluded_in_the_plane_do_not_meet_in_space(
            pick in any::<[prop::sample::Index; 2]>(),
            at in [0.0..1.0_f64, 0.0..1.0_f64, 0.0..1.0_f64],
            inside in [0.0..1.0_f64, 0.0..1.0_f64, 0.0..1.0_f64],
            size in 0.01..0.5_f64,
        ) {
            let geometry = parse_geometry(SOURCE, "t.geo").unwrap().geometry;
            let [a, b] = pick.map(|i| i.get(&geometry.surfaces));
            let low = [0.0, -3.0, -3.0];
            let cell = [0, 1, 2].map(|i| {
                let start = low[i] + at[i] * [15.0, 8.0, 7.0][i];
                Interval::new(start, start + size)
            });
            let point = Point::from([0, 1, 2].map(|i| cell[i].lo + inside[i] * size));
            if let Some(swept) = Swept::new(a, b, &cell) {
                let center = swept.at.map(|side| side.middle());
                let arm = [0, 1].map(|i| swept.at[i] - Interval::point(center[i]));
                let [f, g] = swept.curves.map(|curve| Taylor::of(&curve, center));
                let zero = Taylor::default();
                for (taylor, surface) in [(f, a), (g, b)] {
                    let value = surface.value(&point);
                    let range = taylor.range(&zero, 0.0, arm);
                    prop_assert!(range.lo.signum() != range.hi.signum() || value.signum() == range.lo.signum());
                }
                let is_in = |p: &Point| (0..3).all(|i| cell[i].contains(p[i]));
                let on = project_to_both(a, b, &point, 1e-12).ok().filter(is_in);
                if on.is_some() {
                    prop_assert!(swept.can_meet(), "{a:?} {b:?} in {cell:?}");
                }
                let direction = a.gradient(&middle(&cell)).cross(&b.gradient(&middle(&cell)));
                if let (Some(true), Some(on)) = (swept.is_monotone(&direction), on) {
                    let cross = a.gradient(&on).cross(&b.gradient(&on));
                    prop_assert!(cross.dot(&direction) > 0.0, "{a:?} {b:?}");
                }
            }
        }
    }
}
