//! From the cosine of an angle to its whole degrees, without an inverse cosine for each of 10⁹ tets.

use std::sync::LazyLock;

/// Bins of one degree.
pub const DEGREES: usize = 180;

/// Cells of the table that narrows the search down; near 0° and 180° a cell covers a few degrees.
const CELLS: usize = 1024;

struct Table {
    /// The cosines of 0°, 1°, …, 180°.
    cosines: Vec<f64>,
    /// For each cell of [−1, 1] the bin of its upper end.
    first: Vec<u8>,
}

static TABLE: LazyLock<Table> = LazyLock::new(|| {
    let cosines: Vec<f64> = (0..=DEGREES).map(|k| (k as f64).to_radians().cos()).collect();
    let first = (0..CELLS).map(|cell| {
        let upper = 2.0 * (cell + 1) as f64 / CELLS as f64 - 1.0;
        (1..DEGREES).take_while(|&k| cosines[k] >= upper).count() as u8
    });
    let first = first.collect();
    Table { cosines, first }
});

/// The whole degrees of the angle with this cosine: 0 to 179. A cosine beyond ±1 by rounding counts as ±1.
#[inline]
pub fn whole_degrees(cosine: f64) -> usize {
    let table = &*TABLE;
    let cell = ((cosine + 1.0) * (CELLS / 2) as f64) as usize;
    let mut degrees = usize::from(table.first[cell.min(CELLS - 1)]);
    while degrees < DEGREES - 1 && cosine <= table.cosines[degrees + 1] {
        degrees += 1;
    }
    degrees
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
