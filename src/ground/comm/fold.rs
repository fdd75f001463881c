//! Sums and maxima over the ranks whose messages do not grow with the number of ranks.
//!
//! All work on whole numbers, so the result does not depend on the order in which a backend
//! combines them. The least and largest of floating-point numbers are maxima of [`key`]s.

use super::pack::numbers;
use super::{CommError, Communicator};
use bytemuck::cast_slice;

/// How the numbers of the ranks are combined, entry by entry.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fold {
    /// The sum over all ranks.
    Sum,
    /// The largest of all ranks.
    Max,
    /// The sum over the ranks before this one; 0 on rank 0.
    SumBefore,
}

impl Fold {
    /// Combines `numbers` into `total`, entry by entry.
    ///
    /// # Panics
    /// If a sum exceeds 2⁶⁴ and overflows are checked.
    pub(crate) fn add(self, total: &mut [u64], numbers: &[u64]) {
        for (total, &number) in total.iter_mut().zip(numbers) {
            *total = match self {
                Self::Sum | Self::SumBefore => *total + number,
                Self::Max => (*total).max(number),
            };
        }
    }
}

/// [`Communicator::fold`] for backends without an operation for it.
pub(super) fn by_all_gather(
    comm: &(impl Communicator + ?Sized),
    fold: Fold,
    values: &mut [u64],
) -> Result<(), CommError> {
    let all: Vec<u64> = numbers(&comm.all_gather_equal_bytes(cast_slice(values))?);
    let ranks = if fold == Fold::SumBefore { comm.rank() } else { comm.size() } as usize;
    values.fill(0);
    all.chunks_exact(values.len().max(1)).take(ranks).for_each(|row| fold.add(values, row));
    Ok(())
}

/// A positive whole number that orders as `value` does; 0 for not-a-number.
pub(super) fn key(value: f64) -> u64 {
    let bits = value.to_bits();
    match bits & SIGN {
        _ if value.is_nan() => 0,
        0 => bits | SIGN,
        _ => !bits,
    }
}

/// The inverse of [`key`].
pub(super) fn value_of(key: u64) -> f64 {
    match key {
        0 => f64::NAN,
        _ if key & SIGN == 0 => f64::from_bits(!key),
        _ => f64::from_bits(key ^ SIGN),
    }
}

/// The sign of a floating-point number.
const SIGN: u64 = 1 << 63;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_order_as_their_values() {
        let ordered =
            [f64::NEG_INFINITY, -1e300, -1.0, -5e-324, -0.0, 0.0, 5e-324, 1.0, 1e300, f64::INFINITY];
        let keys = ordered.map(key);
        assert!(keys.is_sorted_by(|a, b| a < b) && keys[0] > 0, "{keys:?}");
        assert_eq!(keys.map(|key| value_of(key).to_bits()), ordered.map(f64::to_bits));
        assert!(key(f64::NAN) == 0 && key(-f64::NAN) == 0 && value_of(0).is_nan());
    }
}
