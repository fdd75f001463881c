//! Orders of points that keep neighbours together: along the Hilbert curve, at once or in random
//! rounds.

use crate::Point;
use crate::ground::kernel::random::mix;
use rayon::prelude::*;

/// Bits per coordinate of a key; three coordinates fit 64 bits.
const BITS: u32 = 21;

/// The position of a cell on the Hilbert curve (Skilling 2004); its coordinates are below 2²¹.
pub fn hilbert_key(cell: [u32; 3]) -> u64 {
    let mut x = cell;
    let mut q = 1u32 << (BITS - 1);
    while q > 1 {
        let low = q - 1;
        for i in 0..3 {
            if x[i] & q != 0 {
                x[0] ^= low;
            } else {
                let t = (x[0] ^ x[i]) & low;
                x[0] ^= t;
                x[i] ^= t;
            }
        }
        q >>= 1;
    }
    x[1] ^= x[0];
    x[2] ^= x[1];
    let mut t = 0;
    let mut q = 1u32 << (BITS - 1);
    while q > 1 {
        if x[2] & q != 0 {
            t ^= q - 1;
        }
        q >>= 1;
    }
    let x = x.map(|v| v ^ t);
    (0..BITS).rev().fold(0u64, |key, bit| x.iter().fold(key, |key, v| (key << 1) | u64::from((v >> bit) & 1)))
}

/// The keys of all points in a cube around them.
fn keys(points: &[Point]) -> Vec<u64> {
    let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    for p in points {
        for k in 0..3 {
            low[k] = low[k].min(p[k]);
            high[k] = high[k].max(p[k]);
        }
    }
    let side = (0..3).map(|k| high[k] - low[k]).fold(0.0, f64::max);
    let cells = if side > 0.0 { f64::from((1u32 << BITS) - 1) / side } else { 0.0 };
    points.par_iter().map(|p| hilbert_key([0, 1, 2].map(|k| ((p[k] - low[k]) * cells) as u32))).collect()
}

/// The indices of the points in order along the Hilbert curve; ties by index.
pub fn hilbert_order(points: &[Point]) -> Vec<u32> {
    let keys = keys(points);
    let mut order: Vec<u32> = (0..points.len() as u32).collect();
    order.par_sort_unstable_by_key(|&i| (keys[i as usize], i));
    order
}

/// A biased randomized insertion order (Amenta, Choi, Rote 2003).
///
/// The points are drawn with a fixed seed into rounds of doubling size, each ordered along the
/// Hilbert curve. This keeps incremental Delaunay meshing near linear for any input.
pub fn random_rounds(points: &[Point]) -> Vec<u32> {
    /// Points in the first round: few enough that long walks cost nothing.
    const FIRST: usize = 64;
    let keys = keys(points);
    let rounds = (points.len() / FIRST).checked_ilog2().unwrap_or(0);
    // Random bits have k trailing ones with probability 2^−(k+1), so half the points are in the
    // last round.
    let round = |i: u32| rounds - mix(u64::from(i)).trailing_ones().min(rounds);
    let mut order: Vec<u32> = (0..points.len() as u32).collect();
    order.par_sort_unstable_by_key(|&i| (round(i), keys[i as usize], i));
    order
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn consecutive_cells_of_the_curve_are_neighbours() {
        let n = 8u32;
        let shift = BITS - 3;
        let mut cells: Vec<[u32; 3]> =
            (0..n * n * n).map(|i| [i % n, i / n % n, i / n / n].map(|c| c << shift)).collect();
        cells.sort_by_key(|&c| hilbert_key(c));
        for pair in cells.windows(2) {
            let step: u32 = (0..3).map(|k| pair[0][k].abs_diff(pair[1][k]) >> shift).sum();
            assert_eq!(step, 1, "{pair:?}");
        }
    }

    #[test]
    fn both_orders_hold_every_point_once() {
        let points: Vec<Point> =
            (0..1000).map(|i| Point::new(f64::from(i % 7), f64::from(i % 11), f64::from(i))).collect();
        for mut order in [hilbert_order(&points), random_rounds(&points)] {
            assert_ne!(order, (0..1000).collect::<Vec<u32>>());
            order.sort_unstable();
            assert_eq!(order, (0..1000).collect::<Vec<u32>>());
        }
        assert!(random_rounds(&[]).is_empty());
    }
}
