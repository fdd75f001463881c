//! Converts the cosine of an angle to whole degrees without an inverse cosine for each of 10⁹ tets.

use std::sync::LazyLock;

/// Bins of one degree.
pub const DEGREES: usize = 180;

/// Cells of the lookup table. Except near 0° and 180° a cell contains at most one bound between
/// degrees.
const CELLS: usize = 4096;

/// The lookup table; fetch it once for many angles.
pub struct Table {
    /// The cosines of 0°, 1°, …, 179°, then a value below every cosine.
    cosines: [f64; 257],
    /// For each cell, centred at a multiple of its width in [−1, 1], the bin of its upper end.
    first: [u8; 2 * CELLS],
}

static TABLE: LazyLock<Table> = LazyLock::new(|| {
    let cosine = |k: usize| if k < DEGREES { (k as f64).to_radians().cos() } else { f64::NEG_INFINITY };
    let cosines: [f64; 257] = std::array::from_fn(cosine);
    let first = |cell: usize| {
        // A little more than half a width, to allow for rounding.
        let upper = 2.0 * (cell as f64 + 0.51) / CELLS as f64 - 1.0;
        (1..DEGREES).take_while(|&k| cosines[k] >= upper).count() as u8
    };
    Table { cosines, first: std::array::from_fn(first) }
});

impl Table {
    /// The shared table.
    pub fn get() -> &'static Self {
        &TABLE
    }

    /// The whole degrees (0 to 179) of the angle with this cosine. A cosine beyond ±1 by rounding
    /// counts as ±1.
    #[inline(always)]
    pub fn whole_degrees(&self, cosine: f64) -> usize {
        // Both indices are within the tables by their lengths.
        let mut degrees = self.first[cell(cosine) % (2 * CELLS)];
        // Nearly always zero or one step: the first without a branch.
        degrees += u8::from(cosine <= self.cosines[usize::from(degrees) + 1]);
        while cosine <= self.cosines[usize::from(degrees) + 1] {
            degrees += 1;
        }
        usize::from(degrees)
    }
}

/// The cell of a cosine. The integer appears in the low bits of a float that is large enough; this
/// vectorises, unlike conversion to integers.
#[inline(always)]
fn cell(cosine: f64) -> usize {
    const LARGE: f64 = (1_u64 << 52) as f64;
    let clamped = if cosine > -1.0 { cosine } else { -1.0 };
    let clamped = if clamped < 1.0 { clamped } else { 1.0 };
    let bits = ((clamped + 1.0) * (CELLS / 2) as f64 + LARGE).to_bits();
    (bits & !LARGE.to_bits()) as usize
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whole_degrees_are_those_of_the_inverse_cosine() {
        let table = Table::get();
        for k in 0..=20_000 {
            let angle = (f64::from(k) + 0.5) * 180.0 / 20_001.0;
            assert_eq!(table.whole_degrees(angle.to_radians().cos()), angle as usize, "{angle}");
        }
        assert_eq!([1.1, 1.0, -1.0, -1.1].map(|cosine| table.whole_degrees(cosine)), [0, 0, 179, 179]);
    }
}
