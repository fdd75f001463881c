//! Closed intervals of numbers, for ranges of functions over boxes.

/// A closed interval; every operation rounds outward far enough to contain the exact result.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interval {
    /// Lower end.
    pub lo: f64,
    /// Upper end.
    pub hi: f64,
}
