//! Fixed-point coordinates with more bits than doubles, and exact signs for them.
//!
//! A point exactly on an edge or in a triangle between points with double coordinates needs more
//! bits than a double has. If its weights are dyadic (fractions of a power of two), integers
//! suffice: a [`Fixed`] point has three coordinates of 256 bits, in one unit for all points, so
//! differences, products and signs need neither rounding nor division. Unlike implicit points,
//! which are represented by their construction (Attene 2020, "Indirect predicates for geometric
//! constructions"), such points need no rational numbers. The price is that they lie near the
//! wanted position, not at it.
//!
//! Coordinates must be multiples of 2⁻²⁴⁰ and below 2¹⁰ in magnitude: a double of magnitude 10⁻⁵⁶
//! or more is represented exactly.

use super::integers::{Parts, Words, add, is_negative, mul, parts, sign, sub, volume6};
use super::predicates::{Sign, volume6_and_error};
use crate::Point;

/// The unit is 2⁻²⁴⁰.
const FRACTION: i32 = 240;

/// The bias of the exponents of [`Parts`].
const EXPONENT_BIAS: i32 = 1075;

/// Maximum bits of a coordinate's magnitude, in units: differences have one more, and six times a
/// volume, below 6·2⁷⁵³, fits 768 bits.
const LARGEST: u32 = 250;

/// An upper bound of the rounding error of coordinates up to 1, which is 3·2⁻⁵³.
const ROUNDING: f64 = 1.0 / (1u64 << 50) as f64;

/// Six times a volume.
pub type Volume = Words<12>;

/// A point, or the difference of two.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Fixed([Words<4>; 3]);

impl Fixed {
    /// The same point; `None` if its coordinates do not fit.
    pub fn of(point: &Point) -> Option<Self> {
        let [x, y, z] = parts(point).map(shifted);
        Some(Self([x?, y?, z?]))
    }

    /// The point rounded to doubles, not always to the nearest; exact if its coordinates are
    /// doubles.
    pub fn rounded(&self) -> Point {
        Point::from(self.0.map(to_double))
    }

    /// The difference from `origin` to this point.
    #[must_use]
    pub fn minus(&self, origin: &Self) -> Self {
        Self([0, 1, 2].map(|k| sub(self.0[k], origin.0[k])))
    }

    /// The point at a difference from this one.
    #[must_use]
    pub fn plus(&self, difference: &Self) -> Self {
        Self([0, 1, 2].map(|k| add(self.0[k], difference.0[k])))
    }

    /// Half of a difference; `None` if that is not a multiple of the unit.
    pub fn halved(&self) -> Option<Self> {
        let is_even = self.0.iter().all(|x| x[0] & 1 == 0);
        is_even.then(|| Self(self.0.map(half)))
    }

    /// Half of a difference, rounded down to units; `None` if all coordinates become 0 or −1 unit.
    pub fn nearly_halved(&self) -> Option<Self> {
        let halves = self.0.map(half);
        halves.iter().any(|&x| x != [0; 4] && x != [u64::MAX; 4]).then_some(Self(halves))
    }

    /// The point self + Σ tₖ·wayₖ, where tₖ is the binary fraction `bits[k]` followed by a one;
    /// `None` if a halved way is not a multiple of the unit.
    ///
    /// All slices must have the same length. No tₖ is 0 or 1, and each is within half the last bit
    /// of every number that starts with these bits.
    pub fn along<const K: usize>(&self, ways: [Self; K], bits: [&[bool]; K]) -> Option<Self> {
        let (mut place, mut ways) = (*self, ways);
        for i in 0..=bits[0].len() {
            for (way, bits) in ways.iter_mut().zip(bits) {
                *way = way.halved()?;
                if bits.get(i).copied().unwrap_or(true) {
                    place = place.plus(way);
                }
            }
        }
        Some(place)
    }

    /// A key that sorts points along an axis.
    pub fn key(&self, axis: usize) -> impl Ord + use<> {
        let [a, b, c, d] = self.0[axis];
        (d as i64, c, b, a)
    }
}

fn shifted(p: Parts) -> Option<Words<4>> {
    let mut words = [0; 4];
    if p.mantissa == 0 {
        return Some(words);
    }
    let shift = u32::try_from(p.exponent.checked_sub(EXPONENT_BIAS - FRACTION)?).ok()?;
    let size = p.mantissa.unsigned_abs();
    if shift.checked_add(64 - size.leading_zeros())? > LARGEST {
        return None;
    }
    let (word, wide) = ((shift / 64) as usize, u128::from(size) << (shift % 64));
    words[word] = wide as u64;
    if let Some(next) = words.get_mut(word + 1) {
        *next = (wide >> 64) as u64;
    }
    Some(if p.mantissa < 0 { sub([0; 4], words) } else { words })
}

fn to_double(x: Words<4>) -> f64 {
    in_units(x, FRACTION)
}

/// A volume as a double, accurate to some units in the last place.
pub fn rounded_volume(volume: Volume) -> f64 {
    in_units(volume, 3 * FRACTION)
}

/// A double near x·2^−fraction.
fn in_units<const N: usize>(x: Words<N>, fraction: i32) -> f64 {
    let size = if is_negative(&x) { sub([0; N], x) } else { x };
    // Lowest word first, so that rounding errors are relative to the result.
    let sum = (0..).zip(size).fold(0.0, |sum, (k, word)| sum + word as f64 * 2f64.powi(64 * k - fraction));
    if is_negative(&x) { -sum } else { sum }
}

fn half(x: Words<4>) -> Words<4> {
    let [a, b, c, d] = x;
    [a >> 1 | b << 63, b >> 1 | c << 63, c >> 1 | d << 63, ((d as i64) >> 1) as u64]
}

/// (b−a)×(c−a)·(d−a), exactly.
pub fn volume([a, b, c, d]: [&Fixed; 4]) -> Volume {
    volume6::<4, 8, 12>(&[b, c, d].map(|p| p.minus(a).0))
}

/// The sign of (b−a)×(c−a)·(d−a).
pub fn orient3d_fixed([a, b, c, d]: [&Fixed; 4]) -> Sign {
    let differences = [b, c, d].map(|p| p.minus(a).0);
    // Most differences have few bits, so their lower half is zero.
    if differences.iter().flatten().all(|x| x[0] == 0 && x[1] == 0) {
        sign(volume6::<2, 4, 6>(&differences.map(|d| d.map(|x| [x[2], x[3]]))))
    } else {
        sign(volume6::<4, 8, 12>(&differences))
    }
}

/// The sign of (b−a)×(c−a) in the coordinate plane of axes i and j.
pub fn orient2d_fixed([i, j]: [usize; 2], [a, b, c]: [&Fixed; 3]) -> Sign {
    let (u, v) = (b.minus(a).0, c.minus(a).0);
    sign(sub(mul::<4, 4, 8>(u[i], v[j]), mul::<4, 4, 8>(u[j], v[i])))
}

/// The sign of [`orient3d_fixed`] from rounded coordinates; `None` if rounding may have changed it.
pub fn orient3d_rounded([a, b, c, d]: [&Point; 4]) -> Option<Sign> {
    let edges = [b, c, d].map(|p| [p.x - a.x, p.y - a.y, p.z - a.z]);
    let (volume, error) = volume6_and_error(edges);
    // With absolute values all terms are positive: their increase when every difference grows by
    // its rounding error bounds the change of the volume.
    let [u, v, w] = edges.map(|edge| edge.map(f64::abs));
    let permanent = |[u, v, w]: [[f64; 3]; 3]| {
        u[0] * (v[1] * w[2] + v[2] * w[1])
            + u[1] * (v[2] * w[0] + v[0] * w[2])
            + u[2] * (v[0] * w[1] + v[1] * w[0])
    };
    let size = permanent([u, v, w].map(|edge| edge.map(|x| x + 2.0 * ROUNDING)));
    // The last term is for rounding in the two permanents.
    let error = 2.0 * error + (size - permanent([u, v, w])) + 32.0 * f64::EPSILON * size;
    if volume > error {
        Some(Sign::Positive)
    } else if volume < -error {
        Some(Sign::Negative)
    } else {
        None
    }
}

/// The first binary digits of |part| / Σ|all|, where `all` includes `part`.
pub fn share<const N: usize>(part: Volume, all: [Volume; N], bits: usize) -> Vec<bool> {
    let size = |x: Volume| if is_negative(&x) { sub([0; 12], x) } else { x };
    let whole = all.into_iter().map(size).fold([0; 12], add);
    let mut rest = size(part);
    (0..bits)
        .map(|_| {
            rest = add(rest, rest);
            let less = sub(rest, whole);
            let bit = !is_negative(&less);
            if bit {
                rest = less;
            }
            bit
        })
        .collect()
}

/// The first binary digits of a number from 0 to 1.
pub fn bits_of(number: f64, bits: usize) -> Vec<bool> {
    let mut rest = number;
    (0..bits)
        .map(|_| {
            rest *= 2.0;
            let bit = rest >= 1.0;
            if bit {
                rest -= 1.0;
            }
            bit
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ground::kernel::predicates::orient3d;
    use crate::ground::kernel::random::Random;

    fn random_point(random: &mut Random) -> Point {
        Point::from([0; 3].map(|_| 2.0 * random.unit() - 1.0))
    }

    #[test]
    fn doubles_are_represented_exactly() {
        for x in [0.0, -0.0, 1.0, -1.0, 0.1, -1e-9, 1e-56, 1023.9] {
            let p = Point::new(x, -x, 0.3);
            assert_eq!(Fixed::of(&p).map(|f| f.rounded()), Some(p), "{x}");
        }
        for x in [1e-60, 5e-324, 1024.0, f64::INFINITY, f64::NAN] {
            assert_eq!(Fixed::of(&Point::new(0.0, x, 0.0)), None, "{x}");
        }
    }

    #[test]
    fn points_of_edges_and_triangles_lie_exactly_there() {
        let mut random = Random::new(7);
        for _ in 0..200 {
            let [a, b, c, d] = [0; 4].map(|_| Fixed::of(&random_point(&mut random)).unwrap());
            let bits = |random: &mut Random| -> Vec<bool> {
                (0..60).map(|_| random.bits().is_multiple_of(2)).collect()
            };
            let (s, t) = (bits(&mut random), bits(&mut random));
            let on_edge = a.along([b.minus(&a)], [&s]).unwrap();
            assert_eq!(orient3d_fixed([&a, &b, &on_edge, &d]), Sign::Zero);
            assert_eq!(orient2d_fixed([0, 1], [&a, &b, &on_edge]), Sign::Zero);
            let inside = a.along([b.minus(&a), c.minus(&a)], [&s, &t]).unwrap();
            assert_eq!(orient3d_fixed([&a, &b, &c, &inside]), Sign::Zero);
            // The rounded point is nearly always off the plane, and the filter must be uncertain.
            assert_eq!(orient3d_rounded([&a, &b, &c, &inside].map(|p| p.rounded()).each_ref()), None);
        }
        let unit = Fixed::of(&Point::new(2f64.powi(-240), 0.0, 0.0)).unwrap();
        assert_eq!(unit.halved(), None);
    }

    #[test]
    fn certain_signs_of_rounded_points_are_those_of_the_exact_points() {
        let mut random = Random::new(8);
        let mut certain = 0;
        for case in 0..2000 {
            let near = 2f64.powi(-(case % 50));
            let origin = random_point(&mut random) * 0.9;
            let places = [0; 4].map(|_| {
                let p = Fixed::of(&(origin + random_point(&mut random).coords * (0.05 * near))).unwrap();
                let q = Fixed::of(&random_point(&mut random)).unwrap();
                // Moved by less than double precision resolves.
                p.along([q.minus(&p)], [&[false; 55]]).unwrap()
            });
            let exact = orient3d_fixed(places.each_ref());
            let found = orient3d_rounded(places.map(|p| p.rounded()).each_ref());
            assert!(found.is_none_or(|sign| sign == exact), "case {case}");
            certain += usize::from(found.is_some());
            let doubles = places.map(|p| p.rounded());
            let [a, b, c, d] = doubles.each_ref();
            assert_eq!(
                orient3d_fixed(doubles.map(|p| Fixed::of(&p).unwrap()).each_ref()),
                orient3d(a, b, c, d)
            );
        }
        assert!(certain > 500, "{certain}");
    }

    #[test]
    fn bits_of_shares_are_those_of_the_quotient() {
        let [o, x, y, z] = [[0., 0., 0.], [1., 0., 0.], [0., 1., 0.], [0., 0., 1.]].map(Point::from);
        let volume_to = |top: f64| volume([o, x, y, z * top].map(|p| Fixed::of(&p).unwrap()).each_ref());
        let (one, other) = (volume_to(0.75), volume_to(-2.0));
        let value =
            |bits: Vec<bool>| bits.iter().rev().fold(0.0, |sum, &bit| 0.5 * (sum + f64::from(u8::from(bit))));
        assert!((value(share(one, [one, other], 50)) - 0.75 / 2.75).abs() < 1e-14);
        assert_eq!(bits_of(0.625, 4), [true, false, true, false]);
        assert_eq!(share(one, [one], 3), [true; 3]);
    }
}
