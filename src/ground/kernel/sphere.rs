//! Cached circumspheres of tets: a certified filter before the exact in-sphere predicate.
//!
//! Delaunay insertion tests each tet more than once for points inside its circumsphere. With centre
//! and radius computed once, a test takes eight operations and one load of 32 bytes; the
//! determinant needs the corners and a hundred operations. Two squared radii enclose the true one
//! with all rounding errors of centre, radius and test. A point between them needs the exact sign
//! of [`predicates::insphere`](crate::ground::kernel::predicates::insphere).

use crate::{Point, Vector};

/// The sphere through the corners of a tet, with bounds of its radius.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Circumsphere {
    center: [f64; 3],
    /// A point with a smaller squared distance is inside; NaN if the sphere was not computed yet.
    inner: f32,
    /// A point with a larger squared distance is outside.
    outer: f32,
}

/// ε = 2⁻⁵³, the relative error of one rounding.
const HALF_ULP: f64 = f64::EPSILON / 2.0;

/// The relative error bound of the squared radius in units of ε·L³/V.
///
/// L is the longest of the three edges at the first corner, and V is six times the volume. The
/// centre is a + N/2V with N = u²·v×w + v²·w×u + w²·u×v = u²·v×w + u×(w²v − v²w). By the usual
/// bounds the error of N is below 140·ε·L⁴, that of V below 50·ε·L³, and L ≤ 2R. So the error e of
/// the centre, without its last addition, is below κR with κ = 200·ε·L³/V, and so is that of R. The
/// computed squared distance of a point at distance d is (d ± e)² with a relative error of 6ε. The
/// sum is less than 4κ + 6ε; the rest of the constant is for second-order terms.
const SHAPE_ERROR: f64 = 2000.0 * HALF_ULP;

/// The same for the last addition, in units of ε·(1 + |a|/R), because it rounds coordinates below
/// |a| + R.
const PLACE_ERROR: f64 = 16.0 * HALF_ULP;

/// Spheres with a larger relative error always need the exact sign, because the bounds above are of
/// first order.
const LARGEST_ERROR: f64 = 0.05;

/// Spheres with squared radii outside this range always need the exact sign, because the two bounds
/// are in single precision.
const SQUARED_RADII: std::ops::Range<f64> = 1e-30..1e30;

/// An upper bound of the relative error of rounding to single precision.
const SINGLE_ERROR: f64 = 2e-7;

impl Circumsphere {
    /// A sphere that was not computed yet.
    pub const UNKNOWN: Self = Self { center: [0.0; 3], inner: f32::NAN, outer: f32::NAN };

    /// The sphere through four points.
    #[inline]
    pub fn of([a, b, c, d]: [&Point; 4]) -> Self {
        let (u, v, w): (Vector, Vector, Vector) = (b - a, c - a, d - a);
        let squares = [u.norm_squared(), v.norm_squared(), w.norm_squared()];
        let vw = v.cross(&w);
        let volume = u.dot(&vw);
        // N/2V, see `SHAPE_ERROR`.
        let offset = (squares[0] * vw + u.cross(&(squares[2] * v - squares[1] * w))) * (0.5 / volume);
        let center = a + offset;
        let radius2 = offset.norm_squared();
        let longest2 = squares[0].max(squares[1]).max(squares[2]);
        let shape = SHAPE_ERROR * longest2 * longest2.sqrt() / volume.abs();
        let place = PLACE_ERROR * (1.0 + (a.x.abs() + a.y.abs() + a.z.abs()) / radius2.sqrt());
        let error = shape + place;
        let center = [center.x, center.y, center.z];
        // NaN, from flat tets, must fail this condition.
        if error < LARGEST_ERROR && SQUARED_RADII.contains(&radius2) {
            let error = error + SINGLE_ERROR;
            Self { center, inner: (radius2 * (1.0 - error)) as f32, outer: (radius2 * (1.0 + error)) as f32 }
        } else {
            Self { center, inner: -1.0, outer: f32::INFINITY }
        }
    }

    /// Whether the sphere was computed.
    #[inline]
    pub fn is_known(&self) -> bool {
        !self.inner.is_nan()
    }

    /// Whether a point is strictly inside (true) or outside (false); `None` if that is uncertain.
    #[inline]
    pub fn contains(&self, point: &Point) -> Option<bool> {
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

    /// The squared radius to six digits; infinite if it is uncertain.
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
        assert_eq!(sphere.contains(&Point::new(0.9, 0.9, 0.9)), Some(true));
        assert_eq!(sphere.contains(&Point::new(1.01, 1.0, 1.0)), Some(false));
        assert_eq!(sphere.contains(&Point::new(1.0, 1.0, 1.0)), None, "on it");
        assert_eq!(Circumsphere::UNKNOWN.contains(&p[0]), None);
    }

    #[test]
    fn the_sphere_of_a_flat_tet_is_always_uncertain() {
        let p = [[0., 0., 0.], [1., 0., 0.], [0., 1., 0.], [1., 1., 0.]].map(Point::from);
        let sphere = Circumsphere::of(p.each_ref());
        assert!(sphere.is_known());
        for point in [Point::new(0.5, 0.5, 0.0), Point::new(9.0, 9.0, 9.0)] {
            assert_eq!(sphere.contains(&point), None);
        }
    }

    /// Tets from well-shaped to nearly flat, large or small, near the origin or far from it.
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
        fn certain_answers_are_exact((tet, point) in any_case(), nudge in -60..-20i32, in_or_out in any::<bool>()) {
            let [a, b, c, d] = tet.each_ref();
            let positive = orient3d(a, b, c, d);
            prop_assume!(positive != Sign::Zero);
            let sphere = Circumsphere::of([a, b, c, d]);
            // The point itself, and moved very close to the sphere.
            let radius = sphere.squared_radius().sqrt();
            let to = (point - sphere.center()).normalize();
            let factor = 1.0 + 2f64.powi(nudge) * if in_or_out { 1.0 } else { -1.0 };
            for p in [point, sphere.center() + to * (radius * factor)] {
                let exact = insphere(a, b, c, d, &p);
                let exact = if positive == Sign::Positive { exact } else { exact.flipped() };
                match sphere.contains(&p) {
                    Some(true) => prop_assert_eq!(exact, Sign::Positive),
                    Some(false) => prop_assert_eq!(exact, Sign::Negative),
                    None => {}
                }
            }
        }
    }
}
