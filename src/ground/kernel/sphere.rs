//! Circumspheres of tets, kept to be asked often: a certified filter before the exact in-sphere sign.
//!
//! A Delaunay insertion asks each tet more than once whether a point lies inside its circumsphere. Centre and radius,
//! computed once, answer with eight operations and one load of 32 bytes, where the determinant needs the corners and a
//! hundred operations. Rounding makes them uncertain; so two squared radii are kept between which the true one lies, for
//! all that rounding may have done to centre, radius and question. A point between them is left to
//! [`predicates::insphere`](crate::ground::kernel::predicates::insphere).

use crate::{Point, Vector};

/// What is known of the sphere through the corners of a tet.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Circumsphere {
    center: [f64; 3],
    /// A point whose squared distance is below this lies inside; NaN where nothing was computed yet.
    inner: f32,
    /// A point whose squared distance is above this lies outside.
    outer: f32,
}

/// ε = 2⁻⁵³, the relative error of one rounding.
const HALF_ULP: f64 = f64::EPSILON / 2.0;

/// How much the squared radius may be wrong, relative to it, in units of ε·L³/V: L is the longest of the three edges
/// at the first corner, V six times the volume.
///
/// The centre is a + N/2V with N = u²·v×w + v²·w×u + w²·u×v = u²·v×w + u×(w²v − v²w). By the usual bounds the error of N is below 140·ε·L⁴, that of V
/// below 50·ε·L³, and L ≤ 2R; so the error e of the centre, but for its last addition, is below κR with κ = 200·ε·L³/V, and so is
/// that of R. A point at the distance d has a computed squared distance within 6ε of (d ± e)². All this makes less than
/// 4κ + 6ε; the rest of the constant is for terms of second order.
const SHAPE_ERROR: f64 = 2000.0 * HALF_ULP;

/// The same for the last addition, which rounds the centre's coordinates: in units of ε·(1 + |a|/R), for they are below |a| + R.
const PLACE_ERROR: f64 = 16.0 * HALF_ULP;

/// A sphere that is less certain than this, relative, is left to the exact sign always: the bounds above are of first order.
const LARGEST_ERROR: f64 = 0.05;

/// Squared radii outside this range do not fit the two bounds with room to round: such spheres are left to the exact sign.
const SQUARED_RADII: std::ops::Range<f64> = 1e-30..1e30;

/// More than the relative error of rounding to single precision.
const SINGLE_ERROR: f64 = 2e-7;

impl Circumsphere {
    /// Nothing is known yet.
    pub const UNKNOWN: Self = Self { center: [0.0; 3], inner: f32::NAN, outer: f32::NAN };

    /// The sphere through four points.
    #[inline]
    pub fn of([a, b, c, d]: [&Point; 4]) -> Self {
        let (u, v, w): (Vector, Vector, Vector) = (b - a, c - a, d - a);
        let squares = [u.norm_squared(), v.norm_squared(), w.norm_squared()];
        let vw = v.cross(&w);
        let volume = u.dot(&vw);
        // N of the bound above, its last two terms brought together.
        let offset = (squares[0] * vw + u.cross(&(squares[2] * v - squares[1] * w))) * (0.5 / volume);
        let center = a + offset;
        let radius2 = offset.norm_squared();
        let longest2 = squares[0].max(squares[1]).max(squares[2]);
        let shape = SHAPE_ERROR * longest2 * longest2.sqrt() / volume.abs();
        let place = PLACE_ERROR * (1.0 + (a.x.abs() + a.y.abs() + a.z.abs()) / radius2.sqrt());
        let error = shape + place;
        let center = [center.x, center.y, center.z];
        // Written so that NaN, from flat tets, is uncertain.
        if error < LARGEST_ERROR && SQUARED_RADII.contains(&radius2) {
            let error = error + SINGLE_ERROR;
            Self { center, inner: (radius2 * (1.0 - error)) as f32, outer: (radius2 * (1.0 + error)) as f32 }
        } else {
            Self { center, inner: -1.0, outer: f32::INFINITY }
        }
    }

    /// Whether [`Circumsphere::of`] made it.
    #[inline]
    pub fn is_known(&self) -> bool {
        !self.inner.is_nan()
    }

    /// Whether a point lies strictly inside (true) or outside (false), if that is certain.
    #[inline]
    pub fn holds(&self, point: &Point) -> Option<bool> {
        let [x, y, z] = [point.x - self.center[0], point.y - self.center[1], point.z - self.center[2]];
        let squared = x * x + y * y + z * z;
        if squared > f64::from(self.outer) {
            Some(false)
        } else if squared < f64::from(self.inner) {
            Some(true)
        } else {
            None
        }
    }

    /// The centre, rounded; not finite for a flat tet.
    #[inline]
    pub fn center(&self) -> Point {
        Point::from(self.center)
    }

    /// The squared radius to six digits; infinite where it is uncertain.
    #[inline]
    pub fn squared_radius(&self) -> f64 {
        f64::from(self.outer)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ground::kernel::predicates::{Sign, insphere, orient3d};
    use proptest::prelude::*;
    use proptest::test_runner::RngSeed;

    #[test]
    fn the_sphere_of_a_cubes_corner_is_that_of_the_cube() {
        let p = [[0., 0., 0.], [1., 0., 0.], [0., 1., 0.], [0., 0., 1.]].map(Point::from);
        let sphere = Circumsphere::of(p.each_ref());
        assert!(sphere.is_known() && !Circumsphere::UNKNOWN.is_known());
        assert_eq!(sphere.center(), Point::new(0.5, 0.5, 0.5));
        assert!((sphere.squared_radius() - 0.75).abs() < 1e-6);
        assert_eq!(sphere.holds(&Point::new(0.9, 0.9, 0.9)), Some(true));
        assert_eq!(sphere.holds(&Point::new(1.01, 1.0, 1.0)), Some(false));
        assert_eq!(sphere.holds(&Point::new(1.0, 1.0, 1.0)), None, "on it");
        assert_eq!(Circumsphere::UNKNOWN.holds(&p[0]), None);
    }

    #[test]
    fn a_flat_tet_is_sure_of_nothing() {
        let p = [[0., 0., 0.], [1., 0., 0.], [0., 1., 0.], [1., 1., 0.]].map(Point::from);
        let sphere = Circumsphere::of(p.each_ref());
        assert!(sphere.is_known());
        for point in [Point::new(0.5, 0.5, 0.0), Point::new(9.0, 9.0, 9.0)] {
            assert_eq!(sphere.holds(&point), None);
        }
    }

    /// Tets from round to nearly flat, from large to tiny and far from the origin.
    fn any_case() -> impl Strategy<Value = ([Point; 4], Point)> {
        let corner = || prop::array::uniform3(-1.0..1.0f64);
        (prop::array::uniform4(corner()), corner(), 0..40i32, 0..40i32, corner()).prop_map(
            |(tet, point, flat, small, shift)| {
                let place = |p: [f64; 3]| {
                    let p = Point::new(p[0], p[1], p[2] * 2f64.powi(-flat));
                    p * 2f64.powi(-small) + crate::Vector::from(shift)
                };
                (tet.map(place), place(point))
            },
        )
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 4096, rng_seed: RngSeed::Fixed(3), ..ProptestConfig::default() })]
        #[test]
        fn what_is_certain_is_true((tet, point) in any_case(), nudge in -60..-20i32, in_or_out in any::<bool>()) {
            let [a, b, c, d] = tet.each_ref();
            let positive = orient3d(a, b, c, d);
            prop_assume!(positive != Sign::Zero);
            let sphere = Circumsphere::of([a, b, c, d]);
            // The point as it is, and brought very near to the sphere.
            let radius = sphere.squared_radius().sqrt();
            let to = (point - sphere.center()).normalize();
            let factor = 1.0 + 2f64.powi(nudge) * if in_or_out { 1.0 } else { -1.0 };
            for p in [point, sphere.center() + to * (radius * factor)] {
                let exact = insphere(a, b, c, d, &p);
                let exact = if positive == Sign::Positive { exact } else { exact.flipped() };
                match sphere.holds(&p) {
                    Some(true) => prop_assert_eq!(exact, Sign::Positive),
                    Some(false) => prop_assert_eq!(exact, Sign::Negative),
                    None => {}
                }
            }
        }
    }
}
