//! Exact signs by integers of fixed width (Fortune, Van Wyk 1996), for the near ties that
//! floating-point filters leave.
//!
//! The coordinates of a few points that are near each other are multiples of one power of two, and
//! their differences are small multiples, so a determinant fits a few machine words. Integer
//! arithmetic on them neither rounds nor underflows, and a tie costs the same as a near tie: an
//! in-sphere test near the sphere takes 0.12 to 0.2 µs, but floating-point expansions (Shewchuk
//! 1997) take 1.5 µs or more. Points whose coordinates differ too much in magnitude for the wide
//! width are left to the expansions.

use super::predicates::Sign;
use crate::Point;

/// The maximum bits of a difference in the **narrow** width.
///
/// A difference takes one word, a product of two takes two, and the in-sphere determinant, below
/// 4·(3·2¹²⁴)·(3·2¹⁸⁷) < 2³¹⁹, takes five.
const NARROW: u32 = 62;

/// The maximum bits of a coordinate in the **wide** width, twice the narrow one.
///
/// Differences are below 2¹²⁶, and the in-sphere determinant is below 4·(3·2²⁵²)·(3·2³⁷⁹) < 2⁶³⁹.
const WIDE: u32 = 125;

/// An integer in two's complement, lowest word first.
pub(super) type Words<const N: usize> = [u64; N];

/// The sign of (b−a)×(c−a)·(d−a); `None` if the coordinates do not fit.
pub(super) fn orient3d(a: &Point, b: &Point, c: &Point, d: &Point) -> Option<Sign> {
    let differences = differences([b, c, d], a)?;
    Some(if is_narrow(&differences) {
        sign(volume6::<1, 2, 3>(&differences.map(|d| d.map(|x| [x as u64]))))
    } else {
        sign(volume6::<2, 4, 6>(&differences.map(|d| d.map(words))))
    })
}

/// Positive if `e` is inside the circumsphere of the positively oriented tet a, b, c, d; `None` if
/// the coordinates do not fit.
pub(super) fn insphere(a: &Point, b: &Point, c: &Point, d: &Point, e: &Point) -> Option<Sign> {
    let differences = differences([a, b, c, d], e)?;
    Some(if is_narrow(&differences) {
        sign(in_sphere_determinant::<1, 2, 3, 5>(&differences.map(|d| d.map(|x| [x as u64]))))
    } else {
        sign(in_sphere_determinant::<2, 4, 6, 10>(&differences.map(|d| d.map(words))))
    })
}

/// The differences of points from an origin, in the largest power of two that divides all
/// coordinates.
fn differences<const N: usize>(points: [&Point; N], origin: &Point) -> Option<[[i128; 3]; N]> {
    let parts = points.map(parts);
    let origin = self::parts(origin);
    let unit = parts.iter().flatten().chain(&origin).map(|p| p.exponent).min()?;
    let mut fit = true;
    let mut integer = |p: Parts| {
        let shift = (p.exponent - unit) as u32;
        // Zero is a multiple of any unit.
        if p.mantissa == 0 {
            0
        } else if shift + 64 - p.mantissa.unsigned_abs().leading_zeros() <= WIDE {
            i128::from(p.mantissa) << shift
        } else {
            fit = false;
            0
        }
    };
    let origin = origin.map(&mut integer);
    let differences = parts.map(|p| {
        let [x, y, z] = p.map(&mut integer);
        [x - origin[0], y - origin[1], z - origin[2]]
    });
    fit.then_some(differences)
}

/// A number as mantissa·2^(exponent − 1075), with an odd mantissa.
#[derive(Clone, Copy)]
pub(super) struct Parts {
    pub mantissa: i64,
    pub exponent: i32,
}

#[inline(always)]
pub(super) fn parts(point: &Point) -> [Parts; 3] {
    /// Stored bits of the mantissa of a double.
    const STORED: u32 = f64::MANTISSA_DIGITS - 1;
    /// Beyond all exponents: zeros must not affect the unit, and infinities must never fit.
    const LARGE: i32 = 1 << 20;
    [point.x, point.y, point.z].map(|x| {
        let bits = x.to_bits();
        let exponent = (bits >> STORED) as i32 & 0x7ff;
        let fraction = bits & ((1 << STORED) - 1);
        // Subnormal numbers have no hidden bit and the exponent of the smallest normal numbers.
        let mantissa = if exponent == 0 { fraction } else { fraction | 1 << STORED };
        let exponent = exponent.max(1);
        if mantissa == 0 {
            return Parts { mantissa: 0, exponent: LARGE };
        }
        let zeros = mantissa.trailing_zeros();
        let mantissa = (mantissa >> zeros) as i64;
        let exponent = if exponent == 0x7ff { -LARGE } else { exponent + zeros as i32 };
        Parts { mantissa: if x < 0.0 { -mantissa } else { mantissa }, exponent }
    })
}

fn is_narrow(differences: &[[i128; 3]]) -> bool {
    // The width of a negative number is that of its complement.
    let bits = differences.iter().flatten().fold(0, |bits, &x| bits | x ^ (x >> 127));
    bits >> NARROW == 0
}

fn words(x: i128) -> Words<2> {
    [x as u64, (x >> 64) as u64]
}

/// u·v×w, with D words for a difference, P = 2·D for a product, and T = D + P for the volume.
#[inline(always)]
pub(super) fn volume6<const D: usize, const P: usize, const T: usize>(
    [u, v, w]: &[[Words<D>; 3]; 3],
) -> Words<T> {
    let minor = |i: usize, j: usize| sub(mul::<D, D, P>(v[i], w[j]), mul::<D, D, P>(v[j], w[i]));
    let [x, y, z] = [minor(1, 2), minor(2, 0), minor(0, 1)];
    add(add(mul::<D, P, T>(u[0], x), mul::<D, P, T>(u[1], y)), mul::<D, P, T>(u[2], z))
}

/// The determinant with rows (difference, its square), negated for our orientation.
///
/// Minors are shared (Shewchuk 1997, section 4.4). The numbers of words are those of [`volume6`],
/// and F = P + T.
#[inline(always)]
fn in_sphere_determinant<const D: usize, const P: usize, const T: usize, const F: usize>(
    [a, b, c, d]: &[[Words<D>; 3]; 4],
) -> Words<F> {
    let minor =
        |p: &[Words<D>; 3], q: &[Words<D>; 3]| sub(mul::<D, D, P>(p[0], q[1]), mul::<D, D, P>(q[0], p[1]));
    let [ab, bc, cd, da, ac, bd] =
        [minor(a, b), minor(b, c), minor(c, d), minor(d, a), minor(a, c), minor(b, d)];
    let up = |p: &[Words<D>; 3], minor: Words<P>| mul::<D, P, T>(p[2], minor);
    let abc = add(sub(up(a, bc), up(b, ac)), up(c, ab));
    let bcd = add(sub(up(b, cd), up(c, bd)), up(d, bc));
    let cda = add(add(up(c, da), up(d, ac)), up(a, cd));
    let dab = add(add(up(d, ab), up(a, bd)), up(b, da));
    let lifted = |p: &[Words<D>; 3], volume: Words<T>| {
        let [x, y, z] = p.map(|x| mul::<D, D, P>(x, x));
        mul::<P, T, F>(add(add(x, y), z), volume)
    };
    add(sub(lifted(a, bcd), lifted(b, cda)), sub(lifted(c, dab), lifted(d, abc)))
}

pub(super) fn sign<const N: usize>(number: Words<N>) -> Sign {
    if is_negative(&number) {
        Sign::Negative
    } else if number == [0; N] {
        Sign::Zero
    } else {
        Sign::Positive
    }
}

#[inline(always)]
pub(super) fn is_negative<const N: usize>(number: &Words<N>) -> bool {
    number[N - 1] >> 63 == 1
}

#[inline(always)]
pub(super) fn add<const N: usize>(a: Words<N>, b: Words<N>) -> Words<N> {
    let mut sum = a;
    let mut carry = false;
    for (s, b) in sum.iter_mut().zip(b) {
        let (x, over) = s.overflowing_add(b);
        let (x, more) = x.overflowing_add(u64::from(carry));
        (*s, carry) = (x, over | more);
    }
    sum
}

#[inline(always)]
pub(super) fn sub<const N: usize>(mut a: Words<N>, b: Words<N>) -> Words<N> {
    take_away(&mut a, &b);
    a
}

/// Subtracts `b` modulo the width of `from`.
#[inline(always)]
fn take_away(from: &mut [u64], b: &[u64]) {
    let mut borrow = false;
    for (f, &b) in from.iter_mut().zip(b) {
        let (x, under) = f.overflowing_sub(b);
        let (x, more) = x.overflowing_sub(u64::from(borrow));
        (*f, borrow) = (x, under | more);
    }
}

/// The product, of exactly A + B words.
#[inline(always)]
pub(super) fn mul<const A: usize, const B: usize, const N: usize>(a: Words<A>, b: Words<B>) -> Words<N> {
    const { assert!(N == A + B) };
    let mut product = [0; N];
    for i in 0..A {
        let mut carry = 0;
        for j in 0..B {
            // At most (2⁶⁴ − 1)² + 2·(2⁶⁴ − 1) = 2¹²⁸ − 1.
            let sum = u128::from(a[i]) * u128::from(b[j]) + u128::from(product[i + j]) + u128::from(carry);
            (product[i + j], carry) = (sum as u64, (sum >> 64) as u64);
        }
        product[i + B] = carry;
    }
    // As an unsigned number, a negative one is too large by 2^(64·words).
    if is_negative(&a) {
        take_away(&mut product[A..], &b);
    }
    if is_negative(&b) {
        take_away(&mut product[B..], &a);
    }
    product
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ground::kernel::predicates;
    use proptest::prelude::*;
    use proptest::test_runner::RngSeed;
    use robust::Coord3D;

    fn coord(p: &Point) -> Coord3D<f64> {
        Coord3D { x: p.x, y: p.y, z: p.z }
    }

    fn sign_of(x: f64) -> Sign {
        if x > 0.0 {
            Sign::Positive
        } else if x < 0.0 {
            Sign::Negative
        } else {
            Sign::Zero
        }
    }

    /// Whether the signs, by integers and by the filtered predicates, agree with the expansions,
    /// and how many signs the integers gave.
    fn agrees([a, b, c, d, e]: [&Point; 5]) -> (bool, usize) {
        let volume = sign_of(-robust::orient3d(coord(a), coord(b), coord(c), coord(d)));
        let ball = sign_of(-robust::insphere(coord(a), coord(b), coord(c), coord(d), coord(e)));
        let found = [orient3d(a, b, c, d).map(|s| (s, volume)), insphere(a, b, c, d, e).map(|s| (s, ball))];
        let filtered = [predicates::orient3d(a, b, c, d), predicates::insphere(a, b, c, d, e)];
        let agree = filtered == [volume, ball] && found.iter().flatten().all(|(one, other)| one == other);
        (agree, found.iter().flatten().count())
    }

    #[test]
    fn coordinates_of_too_different_magnitude_are_refused() {
        let [o, x, y] = [[0., 0., 0.], [1., 0., 0.], [0., 1., 0.]].map(Point::from);
        for (z, fits) in
            [(2f64.powi(-124), true), (2f64.powi(-125), false), (5e-324, false), (f64::NAN, false)]
        {
            let z = Point::new(0., 0., z);
            assert_eq!(orient3d(&o, &x, &y, &z).is_some(), fits, "{z}");
        }
        // Far from 1, points of one magnitude fit.
        for size in [5e-324, 1e-300, 1e300] {
            let [x, y, z, e] = [x, y, Point::new(0., 0., 1.), Point::new(1., 1., 1.)].map(|p| p * size);
            assert_eq!(orient3d(&o, &x, &y, &z), Some(Sign::Positive));
            assert_eq!(insphere(&o, &x, &y, &z, &e), Some(Sign::Zero));
        }
    }

    /// Points with few values per coordinate, so that many are coplanar and cospherical.
    ///
    /// The values are integers, tenths, or tenths with noise in the last bits, scaled by 2⁻⁴⁰ to
    /// 2⁴⁰, at the origin or off it.
    fn grid_points() -> impl Strategy<Value = [Point; 5]> {
        let corner = || prop::array::uniform3(-2..3i32);
        (prop::array::uniform5(corner()), -40..40i32, 0..3usize, any::<bool>(), any::<u64>()).prop_map(
            |(grid, scale, kind, shifted, noise)| {
                let mut bits = noise;
                grid.map(|c| {
                    Point::from(c.map(|x| {
                        bits = crate::ground::kernel::random::mix(bits);
                        let step = [1.0, 0.1, 0.1][kind];
                        let x = f64::from(x) * step + if shifted { 7.3 } else { 0.0 };
                        let ulps = if kind == 2 { (bits % 3) as f64 - 1.0 } else { 0.0 };
                        (x + ulps * 2f64.powi(-52)) * 2f64.powi(scale)
                    }))
                })
            },
        )
    }

    /// Points on a sphere up to rounding, near each other or not.
    fn sphere_points() -> impl Strategy<Value = [Point; 5]> {
        let corner = || prop::array::uniform3(-1.0..1.0f64);
        (prop::array::uniform5(corner()), 0..30i32, corner()).prop_map(|(points, near, shift)| {
            points.map(|p| {
                let v = crate::Vector::new(1.0, 1.0, 1.0) + crate::Vector::from(p) * 2f64.powi(-near);
                Point::from(v.normalize()) + crate::Vector::from(shift) * f64::from(near % 2)
            })
        })
    }

    /// Coordinates of independent magnitudes from 2⁻⁷⁰ to 2³⁰.
    fn scattered_points() -> impl Strategy<Value = [Point; 5]> {
        let number = || (-1.0..1.0f64, -70..30i32).prop_map(|(x, e)| x * 2f64.powi(e));
        prop::array::uniform5((number(), number(), number()).prop_map(|(x, y, z)| Point::new(x, y, z)))
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 4096, rng_seed: RngSeed::Fixed(4), ..ProptestConfig::default() })]
        #[test]
        fn signs_on_grids_are_those_of_expansions(points in grid_points()) {
            prop_assert_eq!(agrees(points.each_ref()), (true, 2));
        }

        #[test]
        fn signs_near_a_sphere_are_those_of_expansions(points in sphere_points()) {
            prop_assert_eq!(agrees(points.each_ref()), (true, 2));
        }

        #[test]
        fn signs_of_coordinates_of_any_size_are_those_of_expansions(points in scattered_points()) {
            prop_assert!(agrees(points.each_ref()).0);
        }

        #[test]
        fn products_are_those_of_machine_integers(a in any::<i64>(), b in any::<i64>(), c in any::<i64>()) {
            let ab = i128::from(a) * i128::from(b);
            prop_assert_eq!(mul::<1, 1, 2>([a as u64], [b as u64]), words(ab));
            // −(ab + c) as a product of wider words.
            let sum = ab.wrapping_add(i128::from(c));
            let wide = mul::<2, 1, 3>(words(sum), [u64::MAX]);
            prop_assert_eq!([wide[0], wide[1]], words(sum.wrapping_neg()));
            prop_assert_eq!(sign(wide), sign(words(sum.wrapping_neg())));
        }
    }
}
