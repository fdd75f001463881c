//! Interval arithmetic, to bound functions over boxes.
//!
//! Each operation rounds to nearest and then moves both ends outward by one floating-point number,
//! so the result contains the exact one (Moore, Kearfott, Cloud: Introduction to Interval Analysis,
//! 2009, chapter 2). Boxes are finite; ends that overflow become infinite and remain valid bounds.

use crate::{Point, Vector};
use std::ops::{Add, Div, Mul, Neg, Sub};

/// A closed interval. Operations round outward, so their results contain the exact ones.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interval {
    /// Lower end.
    pub lo: f64,
    /// Upper end.
    pub hi: f64,
}

/// A box: an interval for each coordinate.
pub type Cell = [Interval; 3];

impl Interval {
    /// The numbers from `lo` to `hi`.
    #[inline]
    pub(crate) fn new(lo: f64, hi: f64) -> Self {
        debug_assert!(lo <= hi, "an interval from {lo} to {hi}");
        Self { lo, hi }
    }

    /// The interval that contains only `x`.
    #[inline]
    pub(crate) fn point(x: f64) -> Self {
        Self { lo: x, hi: x }
    }

    #[inline]
    fn outward(lo: f64, hi: f64) -> Self {
        Self { lo: lo.next_down(), hi: hi.next_up() }
    }

    /// Whether the interval contains `x`.
    #[inline]
    pub(crate) fn contains(&self, x: f64) -> bool {
        self.lo <= x && x <= self.hi
    }

    /// Whether the interval contains zero.
    #[inline]
    pub fn contains_zero(&self) -> bool {
        self.contains(0.0)
    }

    /// The length.
    #[inline]
    pub(crate) fn width(&self) -> f64 {
        self.hi - self.lo
    }

    /// The midpoint, rounded to nearest.
    #[inline]
    pub(crate) fn middle(&self) -> f64 {
        0.5 * self.lo + 0.5 * self.hi
    }

    /// The largest absolute value.
    #[inline]
    pub(crate) fn magnitude(&self) -> f64 {
        self.lo.abs().max(self.hi.abs())
    }

    /// The smallest absolute value.
    #[inline]
    pub(crate) fn mignitude(&self) -> f64 {
        if self.contains_zero() { 0.0 } else { self.lo.abs().min(self.hi.abs()) }
    }

    /// The range of x² over the interval; tighter than the product of the interval with itself.
    #[inline]
    #[must_use]
    pub(crate) fn square(self) -> Self {
        let (near, far) = (self.mignitude(), self.magnitude());
        Self { lo: (near * near).next_down().max(0.0), hi: (far * far).next_up() }
    }

    /// The range of √x over the nonnegative part of the interval.
    #[inline]
    #[must_use]
    pub(crate) fn sqrt(self) -> Self {
        let (lo, hi) = (self.lo.max(0.0).sqrt(), self.hi.max(0.0).sqrt());
        Self { lo: lo.next_down().max(0.0), hi: hi.next_up() }
    }

    /// The intersection of two intervals that are known to overlap.
    #[inline]
    #[must_use]
    pub(crate) fn intersect(self, other: Self) -> Self {
        Self { lo: self.lo.max(other.lo), hi: self.hi.min(other.hi) }
    }
}

impl Add for Interval {
    type Output = Self;
    #[inline]
    fn add(self, other: Self) -> Self {
        Self::outward(self.lo + other.lo, self.hi + other.hi)
    }
}

impl Sub for Interval {
    type Output = Self;
    #[inline]
    fn sub(self, other: Self) -> Self {
        Self::outward(self.lo - other.hi, self.hi - other.lo)
    }
}

impl Neg for Interval {
    type Output = Self;
    #[inline]
    fn neg(self) -> Self {
        Self { lo: -self.hi, hi: -self.lo }
    }
}

impl Mul for Interval {
    type Output = Self;
    #[inline]
    fn mul(self, other: Self) -> Self {
        let products = [self.lo * other.lo, self.lo * other.hi, self.hi * other.lo, self.hi * other.hi];
        Self::outward(
            products.iter().copied().fold(f64::INFINITY, f64::min),
            products.iter().copied().fold(f64::NEG_INFINITY, f64::max),
        )
    }
}

impl Mul<f64> for Interval {
    type Output = Self;
    #[inline]
    fn mul(self, factor: f64) -> Self {
        let (a, b) = (self.lo * factor, self.hi * factor);
        Self::outward(a.min(b), a.max(b))
    }
}

impl Div for Interval {
    type Output = Self;
    /// The quotient; the whole real line if the divisor contains zero.
    #[inline]
    fn div(self, other: Self) -> Self {
        if other.contains_zero() {
            return Self { lo: f64::NEG_INFINITY, hi: f64::INFINITY };
        }
        let quotients = [self.lo / other.lo, self.lo / other.hi, self.hi / other.lo, self.hi / other.hi];
        Self::outward(
            quotients.iter().copied().fold(f64::INFINITY, f64::min),
            quotients.iter().copied().fold(f64::NEG_INFINITY, f64::max),
        )
    }
}

/// The box minus a point.
#[inline]
pub(crate) fn offset(cell: &Cell, origin: &Point) -> Cell {
    [0, 1, 2].map(|i| cell[i] - Interval::point(origin[i]))
}

/// The inner product of a vector with a box of vectors.
#[inline]
pub(crate) fn dot(direction: &Vector, cell: &Cell) -> Interval {
    cell[0] * direction.x + cell[1] * direction.y + cell[2] * direction.z
}

/// The center of a box.
#[inline]
pub(crate) fn middle(cell: &Cell) -> Point {
    Point::new(cell[0].middle(), cell[1].middle(), cell[2].middle())
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn interval() -> impl Strategy<Value = (Interval, f64)> {
        (-1e3..1e3f64, 0.0..1e2f64, 0.0..=1.0f64).prop_map(|(lo, width, at)| {
            let x = Interval::new(lo, lo + width);
            (x, (lo + at * width).clamp(x.lo, x.hi))
        })
    }

    proptest! {
        #![proptest_config(crate::seeded())]

        #[test]
        fn operations_on_intervals_contain_the_operations_on_their_numbers(
            (x, a) in interval(), (y, b) in interval(), factor in -5.0..5.0f64,
        ) {
            prop_assert!((x + y).contains(a + b));
            prop_assert!((x - y).contains(a - b));
            prop_assert!((x * y).contains(a * b));
            prop_assert!((x * factor).contains(a * factor));
            prop_assert!((x / y).contains(a / b));
            prop_assert!((-x).contains(-a));
            prop_assert!(x.square().contains(a * a));
            prop_assert!(a < 0.0 || x.sqrt().contains(a.sqrt()));
        }
    }

    #[test]
    fn a_sum_that_is_not_a_machine_number_lies_strictly_between_the_ends() {
        let sum = Interval::point(0.1) + Interval::point(0.2);
        assert!(sum.lo < 0.1 + 0.2 && 0.1 + 0.2 < sum.hi);
    }
}
