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

    /// The whole degrees (0 to 179) of the angle with this cosine, whose [`cell`] this is. A cosine
    /// beyond ±1 by rounding counts as ±1.
    #[inline(always)]
    pub fn whole_degrees(&self, cell: u64, cosine: f64) -> usize {
        // Both indices are within the tables by their lengths.
        let mut degrees = self.first[cell as usize % (2 * CELLS)];
        // Nearly always zero or one step: the first without a branch.
        degrees += u8::from(cosine <= self.cosines[usize::from(degrees) + 1]);
        while cosine <= self.cosines[usize::from(degrees) + 1] {
            degrees += 1;
        }
        usize::from(degrees)
    }
}

/// The cell of a cosine in the table.
#[inline(always)]
pub fn cell(cosine: f64) -> u64 {
    nearest((cosine + 1.0) * (CELLS / 2) as f64, CELLS as f64)
}

/// Floats from here on are integers: their low bits are those of the integer. Adding it vectorises,
/// unlike conversion to integers.
const LARGE: f64 = (1_u64 << 52) as f64;

#[inline(always)]
fn clamp(number: f64, most: f64) -> f64 {
    let clamped = if number > 0.0 { number } else { 0.0 };
    if clamped < most { clamped } else { most }
}

/// The integer nearest to a number that is clamped to 0 and `most`.
#[inline(always)]
fn nearest(number: f64, most: f64) -> u64 {
    (clamp(number, most) + LARGE).to_bits() & !LARGE.to_bits()
}

/// The whole part of a number that is clamped to 0 and `most`.
#[inline(always)]
pub fn whole(number: f64, most: f64) -> u64 {
    let number = clamp(number, most);
    let near = (number + LARGE) - LARGE;
    let whole = if near > number { near - 1.0 } else { near };
    (whole + LARGE).to_bits() & !LARGE.to_bits()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whole_degrees_are_those_of_the_inverse_cosine() {
        let whole_degrees = |cosine: f64| Table::get().whole_degrees(cell(cosine), cosine);
        for k in 0..=20_000 {
            let angle = (f64::from(k) + 0.5) * 180.0 / 20_001.0;
            assert_eq!(whole_degrees(angle.to_radians().cos()), angle as usize, "{angle}");
        }
        assert_eq!([1.1, 1.0, -1.0, -1.1].map(whole_degrees), [0, 0, 179, 179]);
    }

    #[test]
    fn whole_parts_are_those_of_conversion() {
        for k in -40..=4000 {
            let number = f64::from(k) / 16.0;
            assert_eq!(whole(number, 199.0), (number as u64).min(199), "{number}");
        }
    }
}
