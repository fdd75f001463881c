//! Shape measures of tets: 1 for the regular tet, 0 for a flat one, negative for an inverted one.
//!
//! A coarse tet that will be refined is as good as the worst of its **children**. Cutting it at the
//! midpoints of its edges gives four tets similar to itself and an octahedron, which one of its
//! three **diagonals** cuts into four more. Opposite ones of these are congruent, so a diagonal
//! adds two shapes, and every finer level repeats the same three (Bey 2000; Freudenthal 1942).
//! [`worst_child_squares`] computes the worst of them before refinement, from the six edge lengths.

use super::simplex::volume6;
use crate::Point;

/// The mean ratio 12·(3V)^(2/3) / Σl², with the sign of the volume (Liu, Joe 1994).
pub fn mean_ratio(a: &Point, b: &Point, c: &Point, d: &Point) -> f64 {
    let v6 = volume6(a, b, c, d);
    let squares: f64 = squared_lengths(&[*a, *b, *c, *d]).iter().sum();
    if squares > 0.0 { 12.0 * (0.5 * v6.abs()).cbrt().powi(2).copysign(v6) / squares } else { 0.0 }
}

/// A diagonal of the octahedron in the middle of a tet.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, Default)]
pub enum Diagonal {
    /// Between the midpoints of the edges 01 and 23.
    #[default]
    Mid01To23,
    /// Between the midpoints of the edges 02 and 13.
    Mid02To13,
    /// Between the midpoints of the edges 03 and 12.
    Mid03To12,
}

impl Diagonal {
    /// All three, in the order in which they are numbered 0, 1, 2.
    pub const ALL: [Self; 3] = [Self::Mid01To23, Self::Mid02To13, Self::Mid03To12];
}

/// The squared edge lengths in the order of [`TET_EDGES`](super::simplex::TET_EDGES).
///
/// The edge opposite edge k is edge 5−k.
#[inline]
pub fn squared_lengths(p: &[Point; 4]) -> [f64; 6] {
    [
        (p[1] - p[0]).norm_squared(),
        (p[2] - p[0]).norm_squared(),
        (p[3] - p[0]).norm_squared(),
        (p[2] - p[1]).norm_squared(),
        (p[3] - p[1]).norm_squared(),
        (p[3] - p[2]).norm_squared(),
    ]
}

/// The sum of squared edge lengths of the worst child for a diagonal.
///
/// The unit is such that a child similar to the tet has the tet's own sum. All children of one
/// level have the same volume, so the one with the largest sum has the smallest mean ratio. Let S
/// be the tet's sum and a, b the squared lengths of the two edges whose midpoints the diagonal
/// joins. The diagonal's squared length is (S − 2a − 2b)/4. A child of the octahedron has the
/// diagonal, half of each of the four other edges, and half of one of the two. So the worst sum is
/// 2S − 2(a+b) − min(a,b).
#[inline]
pub fn worst_child_squares(squares: &[f64; 6], diagonal: Diagonal) -> f64 {
    worst_child_of(squares.iter().sum(), squares, diagonal)
}

/// [`worst_child_squares`] with a known sum of the squares.
#[inline(always)]
pub fn worst_child_of(sum: f64, squares: &[f64; 6], diagonal: Diagonal) -> f64 {
    let (a, b) = (squares[diagonal as usize], squares[5 - diagonal as usize]);
    sum.max(2.0 * sum - 2.0 * (a + b) - a.min(b))
}

/// The mean ratio of the worst tet of all levels, with the sign of the volume, and the best
/// diagonal.
///
/// The levels are the tet itself and its children along the diagonal whose worst child is best, the
/// first of equal ones. The mean ratio is 6/7 for the regular tet and below 1 for all: the children
/// along one diagonal are never all regular.
#[cfg(test)]
pub fn refined_quality(p: &[Point; 4]) -> (f64, Diagonal) {
    let squares = squared_lengths(p);
    let mut best = (f64::INFINITY, Diagonal::default());
    for diagonal in Diagonal::ALL {
        let worst = worst_child_squares(&squares, diagonal);
        if worst < best.0 {
            best = (worst, diagonal);
        }
    }
    let v6 = volume6(&p[0], &p[1], &p[2], &p[3]);
    let quality =
        if best.0 > 0.0 { 12.0 * (0.5 * v6.abs()).cbrt().powi(2).copysign(v6) / best.0 } else { 0.0 };
    (quality, best.1)
}

/// The eight children of a tet cut along a diagonal: four at its corners, four around the diagonal.
#[cfg(test)]
pub fn children(p: &[Point; 4], diagonal: Diagonal) -> [[Point; 4]; 8] {
    let mid = |i: usize, j: usize| nalgebra::center(&p[i], &p[j]);
    // An even permutation after which the diagonal joins the edges 01 and 23.
    let [a, b, c, d] = match diagonal {
        Diagonal::Mid01To23 => [0, 1, 2, 3],
        Diagonal::Mid02To13 => [0, 2, 3, 1],
        Diagonal::Mid03To12 => [0, 3, 1, 2],
    };
    let (from, to) = (mid(a, b), mid(c, d));
    let ring = [mid(a, c), mid(b, c), mid(b, d), mid(a, d)];
    let inner = |k: usize| [from, to, ring[(k + 1) % 4], ring[k]];
    [
        [p[0], mid(0, 1), mid(0, 2), mid(0, 3)],
        [mid(0, 1), p[1], mid(1, 2), mid(1, 3)],
        [mid(0, 2), mid(1, 2), p[2], mid(2, 3)],
        [mid(0, 3), mid(1, 3), mid(2, 3), p[3]],
        inner(0),
        inner(1),
        inner(2),
        inner(3),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use proptest::test_runner::RngSeed;

    fn regular() -> [Point; 4] {
        [[1., 1., 1.], [-1., 1., -1.], [1., -1., -1.], [-1., -1., 1.]].map(Point::from)
    }

    fn ratio(p: &[Point; 4]) -> f64 {
        mean_ratio(&p[0], &p[1], &p[2], &p[3])
    }

    #[test]
    fn the_regular_tet_has_mean_ratio_one() {
        let p = regular();
        assert!((ratio(&p) - 1.0).abs() < 1e-14, "{}", ratio(&p));
        assert!((mean_ratio(&p[1], &p[0], &p[2], &p[3]) + ratio(&p)).abs() < 1e-14);
    }

    #[test]
    fn the_worst_child_of_the_regular_tet_has_six_sevenths() {
        let (quality, diagonal) = refined_quality(&regular());
        assert!((quality - 6.0 / 7.0).abs() < 1e-14, "{quality}");
        assert_eq!(diagonal, Diagonal::Mid01To23, "the first of equal ones");
    }

    fn any_tet() -> impl Strategy<Value = [Point; 4]> {
        prop::array::uniform4(prop::array::uniform3(-1.0..1.0f64)).prop_map(|p| p.map(Point::from))
    }

    proptest! {
        #![proptest_config(ProptestConfig { rng_seed: RngSeed::Fixed(1), ..ProptestConfig::default() })]

        #[test]
        fn refined_quality_is_the_worst_of_the_children(p in any_tet()) {
            prop_assume!(ratio(&p) > 1e-3);
            let (quality, best) = refined_quality(&p);
            let mut best_worst = f64::NEG_INFINITY;
            for diagonal in Diagonal::ALL {
                let worst = children(&p, diagonal).iter().map(ratio).fold(f64::INFINITY, f64::min);
                prop_assert!(worst > 0.0, "children are oriented like the parent");
                best_worst = best_worst.max(worst);
                if diagonal == best {
                    prop_assert!((worst - quality).abs() < 1e-9 * quality);
                }
            }
            prop_assert!((best_worst - quality).abs() < 1e-9 * quality);
        }

        #[test]
        fn children_fill_the_tet(p in any_tet()) {
            prop_assume!(ratio(&p) > 1e-3);
            let volume: f64 = volume6(&p[0], &p[1], &p[2], &p[3]);
            for diagonal in Diagonal::ALL {
                let sum: f64 = children(&p, diagonal).iter().map(|c| volume6(&c[0], &c[1], &c[2], &c[3])).sum();
                prop_assert!((sum - volume).abs() < 1e-12);
            }
        }
    }
}
