//! From the cosine of an angle to its whole degrees, without an inverse cosine for each of 10⁹ tets.

use std::sync::LazyLock;

/// Bins of one degree.
pub const DEGREES: usize = 180;

/// Cells of the table that narrows the search down: except near 0° and 180° a cell has one bound between degrees at most.
const CELLS: usize = 4096;

struct Table {
    /// The cosines of 0°, 1°, …, 180°.
    cosines: Vec<f64>,
    /// For each cell of [−1, 1], the places nearest to a multiple of its width, the bin of its upper end.
    first: Vec<u8>,
}

static TABLE: LazyLock<Table> = LazyLock::new(|| {
    let cosines: Vec<f64> = (0..=DEGREES).map(|k| (k as f64).to_radians().cos()).collect();
    let first = (0..=CELLS).map(|cell| {
        // A little more than half a width, for what rounding adds.
        let upper = 2.0 * (cell as f64 + 0.51) / CELLS as f64 - 1.0;
        (1..DEGREES).take_while(|&k| cosines[k] >= upper).count() as u8
    });
    let first = first.collect();
    Table { cosines, first }
});

/// The whole degrees of the angle with this cosine: 0 to 179. A cosine beyond ±1 by rounding counts as ±1.
#[inline]
pub fn whole_degrees(cosine: f64) -> usize {
    let table = &*TABLE;
    let mut degrees = usize::from(table.first[cell(cosine)]);
    // Nearly always one step or none: the first without a branch.
    degrees += usize::from(cosine <= table.cosines[degrees + 1] && degrees < DEGREES - 1);
    while degrees < DEGREES - 1 && cosine <= table.cosines[degrees + 1] {
        degrees += 1;
    }
    degrees
}

/// The cell of a cosine. A whole number appears in the last bits of a float that is large enough: a conversion that vector registers
/// know, where that to integers is made one by one.
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
        for k in 0..=20_000 {
            let angle = (f64::from(k) + 0.5) * 180.0 / 20_001.0;
            assert_eq!(whole_degrees(angle.to_radians().cos()), angle as usize, "{angle}");
        }
        assert_eq!([1.1, 1.0, -1.0, -1.1].map(whole_degrees), [0, 0, 179, 179]);
    }
}
