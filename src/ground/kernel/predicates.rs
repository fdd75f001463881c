//! Exact orientation and in-sphere predicates.
//!
//! In space, a predicate is evaluated in floating point with an error bound (Shewchuk 1997), then
//! in integers of fixed width (`integers`), and by Shewchuk's adaptive expansions if the
//! coordinates do not fit these. In the plane only the expansions are used.
//!
//! The signs are exact if products of coordinate differences neither overflow nor underflow in
//! floating point, so callers scale their input to a box of ordinary size first. In a box of size
//! near 1, as in the volume mesher, products of five differences underflow only if points are
//! closer than 10⁻⁶⁰.

use super::integers;
use crate::Point;
use robust::Coord3D;

/// The sign of a determinant.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Sign {
    /// Below zero.
    Negative,
    /// Exactly zero.
    Zero,
    /// Above zero.
    Positive,
}

impl Sign {
    /// The sign of a number whose computed sign is known to be right.
    fn of(value: f64) -> Self {
        if value > 0.0 {
            Self::Positive
        } else if value < 0.0 {
            Self::Negative
        } else {
            Self::Zero
        }
    }

    /// The opposite sign.
    #[must_use]
    pub fn flipped(self) -> Self {
        match self {
            Self::Negative => Self::Positive,
            Self::Zero => Self::Zero,
            Self::Positive => Self::Negative,
        }
    }
}

/// ε = 2⁻⁵³, the relative error of one rounding.
const HALF_ULP: f64 = f64::EPSILON / 2.0;

/// The bound A of Shewchuk's `orient3d` (1997, section 4.3), relative to the sum of magnitudes.
const ORIENT3D_ERROR: f64 = (7.0 + 56.0 * HALF_ULP) * HALF_ULP;

/// The bound A of Shewchuk's `insphere` (1997, section 4.4), relative to the sum of magnitudes.
const IN_SPHERE_ERROR: f64 = (16.0 + 224.0 * HALF_ULP) * HALF_ULP;

/// Six times the volume of a tet in floating point and its error bound, from the edges at one
/// corner.
///
/// It is a filter for loops over many tets: if the volume exceeds the bound, its sign is certain,
/// otherwise use [`orient3d`]. The edges must be differences of coordinates, each rounded once.
#[inline(always)]
pub fn volume6_and_error([u, v, w]: [[f64; 3]; 3]) -> (f64, f64) {
    let [a, b] = [v[1] * w[2], v[2] * w[1]];
    let [c, d] = [v[2] * w[0], v[0] * w[2]];
    let [e, f] = [v[0] * w[1], v[1] * w[0]];
    let volume = u[0] * (a - b) + u[1] * (c - d) + u[2] * (e - f);
    let size = u[0].abs() * (a.abs() + b.abs())
        + u[1].abs() * (c.abs() + d.abs())
        + u[2].abs() * (e.abs() + f.abs());
    (volume, ORIENT3D_ERROR * size)
}

#[inline]
fn coord(p: &Point) -> Coord3D<f64> {
    Coord3D { x: p.x, y: p.y, z: p.z }
}

/// The sign of (b−a)×(c−a)·(d−a): positive if the tet a, b, c, d is positively oriented.
#[inline]
pub fn orient3d(a: &Point, b: &Point, c: &Point, d: &Point) -> Sign {
    let (volume, error) = volume6_and_error([b, c, d].map(|p| [p.x - a.x, p.y - a.y, p.z - a.z]));
    // Nearly always certain, so only the exact sign is a call.
    if volume > error {
        Sign::Positive
    } else if volume < -error {
        Sign::Negative
    } else {
        exact_orient3d(a, b, c, d)
    }
}

#[cold]
fn exact_orient3d(a: &Point, b: &Point, c: &Point, d: &Point) -> Sign {
    integers::orient3d(a, b, c, d)
        .unwrap_or_else(|| Sign::of(-robust::orient3d(coord(a), coord(b), coord(c), coord(d))))
}

/// Positive if `e` is inside the circumsphere of the tet a, b, c, d; negative if it is outside.
///
/// The signs are reversed if the tet is negatively oriented.
#[inline]
pub fn insphere(a: &Point, b: &Point, c: &Point, d: &Point, e: &Point) -> Sign {
    let (determinant, error) = in_sphere_and_error([a, b, c, d].map(|p| [p.x - e.x, p.y - e.y, p.z - e.z]));
    if determinant > error {
        Sign::Positive
    } else if determinant < -error {
        Sign::Negative
    } else {
        exact_insphere(a, b, c, d, e)
    }
}

/// The in-sphere determinant in floating point and its error bound, from the edges to four corners.
#[inline]
fn in_sphere_and_error(edges: [[f64; 3]; 4]) -> (f64, f64) {
    let minor = |p: [f64; 3], q: [f64; 3]| {
        let (x, y) = (p[0] * q[1], q[0] * p[1]);
        (x - y, x.abs() + y.abs())
    };
    let [a, b, c, d] = edges;
    let [ab, bc, cd, da, ac, bd] =
        [minor(a, b), minor(b, c), minor(c, d), minor(d, a), minor(a, c), minor(b, d)];
    let up = |p: [f64; 3], (minor, size): (f64, f64)| (p[2] * minor, p[2].abs() * size);
    let plus = |x: (f64, f64), y: (f64, f64)| (x.0 + y.0, x.1 + y.1);
    let minus = |x: (f64, f64), y: (f64, f64)| (x.0 - y.0, x.1 + y.1);
    let abc = plus(minus(up(a, bc), up(b, ac)), up(c, ab));
    let bcd = plus(minus(up(b, cd), up(c, bd)), up(d, bc));
    let cda = plus(plus(up(c, da), up(d, ac)), up(a, cd));
    let dab = plus(plus(up(d, ab), up(a, bd)), up(b, da));
    let lifted = |p: [f64; 3], (volume, size): (f64, f64)| {
        let lift = p[0] * p[0] + p[1] * p[1] + p[2] * p[2];
        (lift * volume, lift * size)
    };
    let (determinant, size) =
        plus(minus(lifted(a, bcd), lifted(b, cda)), minus(lifted(c, dab), lifted(d, abc)));
    (determinant, IN_SPHERE_ERROR * size)
}

#[cold]
fn exact_insphere(a: &Point, b: &Point, c: &Point, d: &Point, e: &Point) -> Sign {
    integers::insphere(a, b, c, d, e)
        .unwrap_or_else(|| Sign::of(-robust::insphere(coord(a), coord(b), coord(c), coord(d), coord(e))))
}

/// The sign of the area of the planar triangle a, b, c: positive if it is counter-clockwise.
#[inline]
pub fn orient2d(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> Sign {
    let coord = |p: [f64; 2]| robust::Coord { x: p[0], y: p[1] };
    Sign::of(robust::orient2d(coord(a), coord(b), coord(c)))
}

/// Positive if `d` is inside the circumcircle of the counter-clockwise triangle a, b, c.
#[inline]
#[cfg(test)]
pub fn incircle(a: [f64; 2], b: [f64; 2], c: [f64; 2], d: [f64; 2]) -> Sign {
    let coord = |p: [f64; 2]| robust::Coord { x: p[0], y: p[1] };
    Sign::of(robust::incircle(coord(a), coord(b), coord(c), coord(d)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_unit_tet_is_positive_and_holds_its_centre() {
        let [o, x, y, z] =
            [Point::new(0., 0., 0.), Point::new(1., 0., 0.), Point::new(0., 1., 0.), Point::new(0., 0., 1.)];
        assert_eq!(orient3d(&o, &x, &y, &z), Sign::Positive);
        assert_eq!(orient3d(&o, &y, &x, &z), Sign::Negative);
        assert_eq!(orient3d(&o, &x, &y, &Point::new(0.3, 0.3, 0.)), Sign::Zero);
        assert_eq!(insphere(&o, &x, &y, &z, &Point::new(0.5, 0.5, 0.5)), Sign::Positive);
        assert_eq!(insphere(&o, &x, &y, &z, &Point::new(1., 1., 1.)), Sign::Zero);
        assert_eq!(insphere(&o, &x, &y, &z, &Point::new(2., 1., 1.)), Sign::Negative);
    }

    #[test]
    fn the_filter_is_certain_of_a_plain_tet_and_doubts_a_flat_one() {
        let (volume, error) = volume6_and_error([[1., 0., 0.], [0., 1., 0.], [0., 0., 1.]]);
        assert!(volume == 1.0 && error < 1e-15);
        let (volume, error) = volume6_and_error([[0.1, 0.2, 0.3], [0.4, 0.5, 0.6], [0.7, 0.8, 0.9]]);
        assert!(volume.abs() <= error, "{volume} {error}");
    }

    #[test]
    fn a_counter_clockwise_triangle_is_positive() {
        let [a, b, c] = [[0., 0.], [1., 0.], [0., 1.]];
        assert_eq!(orient2d(a, b, c), Sign::Positive);
        assert_eq!(incircle(a, b, c, [0.9, 0.9]), Sign::Positive);
        assert_eq!(incircle(a, b, c, [1., 1.]), Sign::Zero);
    }
}
