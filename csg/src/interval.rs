//! Closed intervals of numbers, for ranges of functions over boxes.
//!
//! Every operation takes the two ends with the rounding of the machine and then moves each end one
//! number outward, so the exact result is always inside (Moore, Kearfott, Cloud: Introduction to Interval
//! Analysis, 2009, chapter 2). Boxes are finite; ends that overflow become infinite and stay correct.

use crate::{Point, Vector};
use std::ops::{Add, Div, Mul, Neg, Sub};

/// A closed interval; every operation rounds outward far enough to contain the exact result.
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
    pub fn new(lo: f64, hi: f64) -> Self {
        debug_assert!(lo <= hi, "an interval from {lo} to {hi}");
        Self { lo, hi }
    }

    /// One number.
    #[inline]
    pub fn point(x: f64) -> Self {
        Self { lo: x, hi: x }
    }

    #[inline]
    fn outward(lo: f64, hi: f64) -> Self {
        Self { lo: lo.next_down(), hi: hi.next_up() }
    }

    /// Whether `x` is in it.
    #[inline]
    pub fn contains(&self, x: f64) -> bool {
        self.lo <= x && x <= self.hi
    }

    /// Whether zero is in it.
    #[inline]
    pub fn contains_zero(&self) -> bool {
        self.contains(0.0)
    }

    /// The length.
    #[inline]
    pub fn width(&self) -> f64 {
        self.hi - self.lo
    }

    /// The middle, rounded.
    #[inline]
    pub fn middle(&self) -> f64 {
        0.5 * self.lo + 0.5 * self.hi
    }

    /// The largest absolute value in it.
    #[inline]
    pub fn magnitude(&self) -> f64 {
        self.lo.abs().max(self.hi.abs())
    }

    /// The least absolute value in it.
    #[inline]
    pub fn mignitude(&self) -> f64 {
        if self.contains_zero() { 0.0 } else { self.lo.abs().min(self.hi.abs()) }
    }

    /// The squares of its numbers: tighter than the product with itself.
    #[inline]
    #[must_use]
    pub fn square(self) -> Self {
        let (near, far) = (self.mignitude(), self.magnitude());
        Self { lo: (near * near).next_down().max(0.0), hi: (far * far).next_up() }
    }

    /// The square roots of its numbers that are not negative.
    #[inline]
    #[must_use]
    pub fn sqrt(self) -> Self {
        let (lo, hi) = (self.lo.max(0.0).sqrt(), self.hi.max(0.0).sqrt());
        Self { lo: lo.next_down().max(0.0), hi: hi.next_up() }
    }

    /// The numbers in both, when both are known to contain the same number.
    #[inline]
    #[must_use]
    pub fn intersect(self, other: Self) -> Self {
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
    /// The quotient; everything where the divisor contains zero.
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

/// The differences between the points of a box and a point.
#[inline]
pub fn offset(cell: &Cell, origin: &Point) -> Cell {
    [0, 1, 2].map(|i| cell[i] - Interval::point(origin[i]))
}

/// The inner products of a vector with the vectors of a box.
#[inline]
pub fn dot(direction: &Vector, cell: &Cell) -> Interval {
    cell[0] * direction.x + cell[1] * direction.y + cell[2] * direction.z
}

/// The middle of a box.
#[inline]
pub fn middle(cell: &Cell) -> Point {
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
