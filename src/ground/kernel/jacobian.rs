//! The Jacobian determinant of ten-node tets: proofs that it is positive, and its range.
//!
//! A ten-node tet is the image of the reference tet under a map of degree 2. The determinant of the
//! map's derivative has degree 3, so it is a combination of the 20 Bernstein polynomials of that
//! degree, which are nonnegative and add to 1. It therefore lies between the smallest and the
//! largest of its 20 **Bézier coefficients**; at the corners it equals them (Johnen, Remacle,
//! Geuzaine 2013, section 3). If they do not decide, the tet is bisected and the halves have
//! coefficients of their own, nearer to the determinant. For a tet with straight edges, all
//! coefficients are six times its volume.
//!
//! Rounding errors are bounded and count against the tet: a determinant that is called positive is
//! positive for the coordinates as given.

use super::simplex::TET_EDGES;

/// The nodes of a ten-node tet: its corners, then one node for each edge in the order of
/// [`TET_EDGES`].
pub type Nodes = [[f64; 3]; 10];

/// The nodes with these numbers: four corners and six nodes on edges.
#[inline]
pub fn nodes<T: Copy>(corners: [T; 4], edges: [T; 6], at: impl Fn(T) -> [f64; 3]) -> Nodes {
    let [a, b, c, d, e, f] = edges.map(&at);
    let [p, q, r, s] = corners.map(at);
    [p, q, r, s, a, b, c, d, e, f]
}

/// The number of Bézier coefficients.
const COUNT: usize = 20;

/// The Bézier coefficients of the determinant, in the order of [`EXPONENTS`].
type Coefficients = [f64; COUNT];

/// The number of polynomials' factors at each corner. First the corners, then two factors at one
/// corner and one at another, then three different corners.
const EXPONENTS: [[u8; 4]; COUNT] = [
    [3, 0, 0, 0],
    [0, 3, 0, 0],
    [0, 0, 3, 0],
    [0, 0, 0, 3],
    [2, 1, 0, 0],
    [2, 0, 1, 0],
    [2, 0, 0, 1],
    [1, 2, 0, 0],
    [0, 2, 1, 0],
    [0, 2, 0, 1],
    [1, 0, 2, 0],
    [0, 1, 2, 0],
    [0, 0, 2, 1],
    [1, 0, 0, 2],
    [0, 1, 0, 2],
    [0, 0, 1, 2],
    [0, 1, 1, 1],
    [1, 0, 1, 1],
    [1, 1, 0, 1],
    [1, 1, 1, 0],
];

/// Error of a coefficient in units of the product of the largest entries of the three rows.
///
/// Let u be the unit roundoff 2⁻⁵³, and D the largest entry of a row. Nodes relative to the first
/// corner are at most D, with errors of uD; control points at most 3D, with 7uD; differences of two
/// of them, doubled, have at most 40uD. So the six products of a determinant change by 6·3·40 uD³,
/// and its evaluation and the means of up to six determinants add less than 100 uD³. Sixty
/// bisections (three means each, of numbers below 6D³) add 1080 uD³.
const ERROR: f64 = 2048.0 * (0.5 * f64::EPSILON);

/// A range that contains the determinant all over a tet.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Range {
    /// A lower bound of the determinant.
    pub least: f64,
    /// An upper bound of the determinant.
    pub greatest: f64,
    /// Six times the volume of the tet.
    pub volume6: f64,
}

impl Range {
    /// Whether the determinant is proved to be positive everywhere.
    pub fn is_positive(&self) -> bool {
        self.least > 0.0
    }

    /// The **scaled Jacobian**: a lower bound of the ratio of the smallest determinant to the
    /// largest. It is 1 for straight edges, at most 0 if the determinant is not proved positive.
    pub fn scaled(&self) -> f64 {
        if self.greatest > 0.0 { (self.least / self.greatest).min(1.0) } else { -1.0 }
    }
}

/// The range of the determinant of a ten-node tet.
///
/// Bounds are sharp to a few percent if their ratio is below one half.
pub fn range(nodes: &Nodes) -> Range {
    let (coefficients, error) = coefficients(nodes);
    let range = bounds(&coefficients, error);
    if range.scaled() > SHARPENED { range } else { sharpened(coefficients, error, range) }
}

/// Below this scaled Jacobian the coefficients of the whole tet are too rough as bounds.
const SHARPENED: f64 = 0.5;

/// The range by the coefficients of the whole tet.
fn bounds(coefficients: &Coefficients, error: f64) -> Range {
    Range {
        least: minimum(coefficients) - error,
        greatest: maximum(coefficients) + error,
        volume6: coefficients.iter().sum::<f64>() / COUNT as f64,
    }
}

/// NaN if a number is NaN: then nothing is proved.
fn minimum(numbers: &[f64]) -> f64 {
    -numbers.iter().map(|x| -x).fold(f64::NEG_INFINITY, larger)
}

fn maximum(numbers: &[f64]) -> f64 {
    numbers.iter().copied().fold(f64::NEG_INFINITY, larger)
}

/// Whether a tet is straight so nearly that its scaled Jacobian is above 1 − 10⁻⁹: all its
/// determinants are then positive, and the volume is that of its corners, up to the same error.
///
/// A quick test, for the many tets inside a mesh. With straight edges the determinant has rows of
/// entries at most M. If each edge node is off the middle of its edge by at most e, they change by
/// at most 8e, so the determinant by at most 6((M+8e)³ − M³), axis by axis.
#[inline(always)]
pub fn is_straight(nodes: &Nodes) -> bool {
    let [mut span, mut off] = [[0.0_f64; 3]; 2];
    let mut edges = [[0.0; 3]; 3];
    for axis in 0..3 {
        let corner = nodes[0][axis];
        for k in 0..3 {
            edges[k][axis] = nodes[k + 1][axis] - corner;
            span[axis] = larger(span[axis], edges[k][axis].abs());
        }
        for (edge, [p, q]) in TET_EDGES.into_iter().enumerate() {
            let middle = 0.5 * (nodes[p][axis] + nodes[q][axis]);
            off[axis] = larger(off[axis], (nodes[4 + edge][axis] - middle).abs());
        }
        // The rounding of the middles and of the span.
        off[axis] += f64::EPSILON * (corner.abs() + span[axis]);
    }
    let [x, y, z] = span;
    let wide = [0, 1, 2].map(|axis| span[axis] + 8.0 * off[axis]);
    let change = 6.0 * (wide[0] * wide[1] * wide[2] - x * y * z) + ERROR * wide[0] * wide[1] * wide[2];
    let volume = determinant(edges[0], cross(edges[1], edges[2]));
    volume * STRAIGHT > change
}

/// The share by which determinants of a straight tet may differ.
const STRAIGHT: f64 = 0.5e-9;

/// The larger of two numbers; NaN if one is NaN.
#[inline(always)]
fn larger(a: f64, b: f64) -> f64 {
    if b <= a || a.is_nan() { a } else { b }
}

#[inline(always)]
fn cross(p: [f64; 3], q: [f64; 3]) -> [f64; 3] {
    [p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]]
}

#[inline(always)]
fn determinant(p: [f64; 3], minors: [f64; 3]) -> f64 {
    p[0] * minors[0] + p[1] * minors[1] + p[2] * minors[2]
}

#[inline(always)]
fn plus(p: [f64; 3], q: [f64; 3]) -> [f64; 3] {
    [p[0] + q[0], p[1] + q[1], p[2] + q[2]]
}

/// The Bézier coefficients of the determinant and the bound of their error.
///
/// The derivative in the direction of edge 0k is Σ λⱼ dₖⱼ with dₖⱼ = 2(bₖⱼ − b₀ⱼ), where b are the
/// control points of the map: bₖₖ the corners, bₖⱼ twice the edge node minus the middle of the
/// edge. A coefficient is the mean of the determinants of d₁ᵢ, d₂ⱼ, d₃ₖ over the orders i, j, k of
/// its corners.
#[inline(always)]
fn coefficients(nodes: &Nodes) -> (Coefficients, f64) {
    let rows = derivatives(nodes);
    let error = ERROR * size(&rows);
    let [first, second, third] = rows;
    let mut minors = [[[0.0; 3]; 4]; 4];
    for (i, minors) in minors.iter_mut().enumerate() {
        for (j, minor) in minors.iter_mut().enumerate() {
            *minor = cross(second[i], third[j]);
        }
    }
    let both = |i: usize, j: usize| plus(minors[i][j], minors[j][i]);
    let twice = |i: usize, j: usize| {
        (determinant(first[i], both(i, j)) + determinant(first[j], minors[i][i])) * (1.0 / 3.0)
    };
    let thrice = |i: usize, j: usize, k: usize| {
        let [p, q, r] = [(i, j, k), (j, i, k), (k, i, j)].map(|(i, j, k)| determinant(first[i], both(j, k)));
        (p + q + r) * (1.0 / 6.0)
    };
    let corner = |i: usize| determinant(first[i], minors[i][i]);
    let coefficients = [
        corner(0),
        corner(1),
        corner(2),
        corner(3),
        twice(0, 1),
        twice(0, 2),
        twice(0, 3),
        twice(1, 0),
        twice(1, 2),
        twice(1, 3),
        twice(2, 0),
        twice(2, 1),
        twice(2, 3),
        twice(3, 0),
        twice(3, 1),
        twice(3, 2),
        thrice(1, 2, 3),
        thrice(0, 2, 3),
        thrice(0, 1, 3),
        thrice(0, 1, 2),
    ];
    (coefficients, error)
}

/// The vectors dₖⱼ of [`coefficients`], by k − 1 and j.
#[inline(always)]
fn derivatives(nodes: &Nodes) -> [[[f64; 3]; 4]; 3] {
    // The control points by their two corners, relative to the first corner.
    let mut control = [[[0.0; 3]; 4]; 4];
    let at = |node: usize| [0, 1, 2].map(|axis| nodes[node][axis] - nodes[0][axis]);
    (1..4).for_each(|corner| control[corner][corner] = at(corner));
    for (edge, [p, q]) in TET_EDGES.into_iter().enumerate() {
        let (node, p_at, q_at) = (at(4 + edge), at(p), at(q));
        let point = [0, 1, 2].map(|axis| 2.0 * node[axis] - 0.5 * (p_at[axis] + q_at[axis]));
        (control[p][q], control[q][p]) = (point, point);
    }
    let mut rows = [[[0.0; 3]; 4]; 3];
    for k in 0..3 {
        for j in 0..4 {
            for axis in 0..3 {
                rows[k][j][axis] = 2.0 * (control[k + 1][j][axis] - control[0][j][axis]);
            }
        }
    }
    rows
}

/// The product over the axes of the largest entries.
#[inline(always)]
fn size(rows: &[[[f64; 3]; 4]; 3]) -> f64 {
    let mut largest = [0.0_f64; 3];
    for vector in rows.as_flattened() {
        for axis in 0..3 {
            largest[axis] = larger(largest[axis], vector[axis].abs());
        }
    }
    largest[0] * largest[1] * largest[2]
}

/// Bisections of one tet, at most.
const BISECTIONS: usize = 256;

/// Sharpens the range by bisecting the piece with the smallest coefficient, until the lower bound
/// is within a few percent of a value of the determinant.
fn sharpened(coefficients: Coefficients, error: f64, whole: Range) -> Range {
    const SHARP: f64 = 0.02;
    let mut pieces = vec![coefficients];
    let mut least_value = minimum(&coefficients[..4]);
    for _ in 0..BISECTIONS {
        let (lowest, least) = lowest_piece(&pieces);
        let slack = SHARP * least.abs().max(SHARP * whole.greatest);
        // A value that is not positive decides, as does a bound near to a value.
        if least_value <= error || least_value - least <= slack || least.is_nan() {
            break;
        }
        let halves = bisected(&pieces.swap_remove(lowest));
        for half in halves {
            least_value = least_value.min(minimum(&half[..4]));
            pieces.push(half);
        }
    }
    let (_, least) = lowest_piece(&pieces);
    let greatest = pieces.iter().map(|piece| maximum(piece)).fold(f64::NEG_INFINITY, f64::max);
    Range { least: least - error, greatest: greatest + error, ..whole }
}

/// The piece with the smallest coefficient, and that.
fn lowest_piece(pieces: &[Coefficients]) -> (usize, f64) {
    let of = |(index, piece): (usize, &Coefficients)| (index, minimum(piece));
    let all = pieces.iter().enumerate().map(of);
    all.reduce(|a, b| if b.1 < a.1 || b.1.is_nan() { b } else { a }).unwrap_or((0, f64::NAN))
}

/// The index of a coefficient.
fn index_of(exponents: [u8; 4]) -> usize {
    EXPONENTS.iter().position(|e| *e == exponents).expect("exponents that add to 3")
}

/// The coefficients of the halves of a piece, cut in the middle of the edge along which the
/// determinant is least linear, by the algorithm of de Casteljau.
fn bisected(piece: &Coefficients) -> [Coefficients; 2] {
    let [p, q] = most_curved_edge(piece);
    let (mut near, mut far) = (*piece, *piece);
    // A line of coefficients has the same factors at the other two corners and `degree` at p and q.
    for (index, exponents) in EXPONENTS.iter().enumerate().filter(|(_, e)| e[q] == 0) {
        let degree = usize::from(exponents[p]);
        let place = |k: usize| {
            let mut moved = *exponents;
            (moved[p], moved[q]) = ((degree - k) as u8, k as u8);
            index_of(moved)
        };
        let mut line = [0.0; 4];
        (0..=degree).for_each(|k| line[k] = piece[place(k)]);
        for step in 0..=degree {
            near[place(step)] = line[0];
            far[place(degree - step)] = line[degree - step];
            (0..degree - step).for_each(|k| line[k] = 0.5 * (line[k] + line[k + 1]));
        }
        debug_assert_eq!(near[index], piece[index], "the first corner stays");
    }
    [near, far]
}

/// The edge with the largest second difference of the coefficients along it, or the largest
/// difference if all are linear.
fn most_curved_edge(piece: &Coefficients) -> [usize; 2] {
    let curvature = |[p, q]: [usize; 2]| {
        let mut most = 0.0_f64;
        for exponents in EXPONENTS.iter().filter(|e| e[p] >= 2) {
            let moved = |by: u8| {
                let mut moved = *exponents;
                (moved[p], moved[q]) = (moved[p] - by, moved[q] + by);
                piece[index_of(moved)]
            };
            most = most.max((moved(0) - 2.0 * moved(1) + moved(2)).abs());
        }
        most
    };
    let curvatures = TET_EDGES.map(curvature);
    let most = (1..6).fold(0, |most, edge| if curvatures[edge] > curvatures[most] { edge } else { most });
    TET_EDGES[most]
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// A tet with straight edges.
    fn straight(corners: [[f64; 3]; 4]) -> Nodes {
        let mut nodes = [[0.0; 3]; 10];
        nodes[..4].copy_from_slice(&corners);
        for (edge, [p, q]) in TET_EDGES.into_iter().enumerate() {
            nodes[4 + edge] = [0, 1, 2].map(|x| 0.5 * (corners[p][x] + corners[q][x]));
        }
        nodes
    }

    const UNIT: [[f64; 3]; 4] = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

    /// The determinant at a point, from the derivatives of the shape functions: written anew, to
    /// compare.
    fn value(nodes: &Nodes, weights: [f64; 4]) -> f64 {
        let mut gradient = [[0.0; 3]; 3];
        let slopes = |k: usize| {
            // Of the weight of corner k in the three directions of the reference tet.
            if k == 0 { [-1.0; 3] } else { [0, 1, 2].map(|x| f64::from(u8::from(x + 1 == k))) }
        };
        let mut add = |node: [f64; 3], slope: [f64; 3]| {
            for direction in 0..3 {
                for x in 0..3 {
                    gradient[direction][x] += slope[direction] * node[x];
                }
            }
        };
        for k in 0..4 {
            add(nodes[k], slopes(k).map(|s| (4.0 * weights[k] - 1.0) * s));
        }
        for (edge, [p, q]) in TET_EDGES.into_iter().enumerate() {
            let (a, b) = (slopes(p), slopes(q));
            add(nodes[4 + edge], [0, 1, 2].map(|d| 4.0 * (a[d] * weights[q] + b[d] * weights[p])));
        }
        determinant(gradient[0], cross(gradient[1], gradient[2]))
    }

    #[test]
    fn all_coefficients_of_a_straight_tet_are_six_times_its_volume() {
        let nodes = straight([[1.0, 2.0, 3.0], [3.0, 2.0, 3.5], [1.0, 5.0, 2.0], [0.5, 2.5, 4.0]]);
        let (coefficients, error) = coefficients(&nodes);
        let volume = value(&nodes, [0.25; 4]);
        assert!(error < 1e-10 && volume > 1.0);
        for coefficient in coefficients {
            assert!((coefficient - volume).abs() < 1e-13, "{coefficient} is not {volume}");
        }
        let range = range(&nodes);
        assert!(range.is_positive() && range.scaled() > 1.0 - 1e-9 && is_straight(&nodes));
    }

    #[test]
    fn positive_four_node_children_do_not_make_a_ten_node_tet_valid() {
        // The node of edge 01 is near corner 0. All children of the refinement are positive, but
        // the derivative at corner 0 along the edge is reversed.
        let mut nodes = straight(UNIT);
        nodes[4] = [0.24, 0.0, 0.0];
        let range = range(&nodes);
        assert!(!range.is_positive() && !is_straight(&nodes), "{range:?}");
        assert!(value(&nodes, [1.0, 0.0, 0.0, 0.0]) < 0.0);
        nodes[4] = [0.26, 0.0, 0.0];
        assert!(super::range(&nodes).is_positive());
    }

    #[test]
    fn what_the_coefficients_leave_open_is_decided_by_bisection() {
        // Nodes that move around an axis: the smallest coefficient is negative, the determinant
        // not.
        let mut nodes = straight(UNIT);
        nodes[9] = [0.0, 0.78, 0.78];
        nodes[7] = [0.78, 0.78, 0.0];
        nodes[8] = [0.78, 0.0, 0.78];
        let (coefficients, error) = coefficients(&nodes);
        let rough = bounds(&coefficients, error);
        let sharp = range(&nodes);
        let steps = 40;
        let mut least = f64::INFINITY;
        for a in 0..=steps {
            for b in 0..=steps - a {
                for c in 0..=steps - a - b {
                    let weights = [a, b, c, steps - a - b - c].map(|w| f64::from(w) / f64::from(steps));
                    least = least.min(value(&nodes, weights));
                }
            }
        }
        assert!(rough.least < 0.9 * sharp.least || sharp.least > 0.0, "{rough:?} {sharp:?}");
        assert!(sharp.least <= least && least - sharp.least < 0.05 * least.abs() + 1e-3, "{least} {sharp:?}");
    }

    #[test]
    fn numbers_that_are_none_prove_nothing() {
        for bad in [f64::NAN, f64::INFINITY, 1e200] {
            for node in 0..10 {
                let mut nodes = straight(UNIT);
                nodes[node][1] = bad;
                assert!(!is_straight(&nodes) && !range(&nodes).is_positive(), "{bad} at {node}");
            }
        }
    }

    proptest! {
        #[test]
        fn the_range_contains_every_value(
            corners in prop::array::uniform4(prop::array::uniform3(-1.0..1.0)),
            shifts in prop::array::uniform6(prop::array::uniform3(-0.2..0.2)),
            weights in prop::array::uniform4(0.0..1.0),
            places in prop::array::uniform3(-100.0..100.0),
        ) {
            let mut nodes = straight(corners);
            for (node, shift) in nodes[4..].iter_mut().zip(shifts) {
                (0..3).for_each(|x| node[x] += shift[x]);
            }
            nodes.iter_mut().for_each(|node| (0..3).for_each(|x| node[x] += places[x]));
            let found = range(&nodes);
            let sum: f64 = weights.iter().sum();
            prop_assume!(sum > 0.1);
            let value = value(&nodes, weights.map(|w| w / sum));
            prop_assert!(found.least <= value + 1e-11 && value <= found.greatest + 1e-11);
            for corner in 0..4 {
                let at = super::tests::value(&nodes, [0, 1, 2, 3].map(|k| f64::from(u8::from(k == corner))));
                prop_assert!(found.least <= at + 1e-11 && at <= found.greatest + 1e-11);
            }
        }

        #[test]
        fn halves_have_the_values_of_the_whole(coefficients in prop::array::uniform20(-1.0..1.0)) {
            let of = |piece: &Coefficients, weights: [f64; 4]| -> f64 {
                let factorial = [1.0, 1.0, 2.0, 6.0];
                EXPONENTS.iter().zip(piece).map(|(exponents, c)| {
                    let mut term = 6.0 * c;
                    for k in 0..4 {
                        let e = exponents[k];
                        term *= weights[k].powi(i32::from(e)) / factorial[usize::from(e)];
                    }
                    term
                }).sum()
            };
            let [near, far] = bisected(&coefficients);
            let [p, q] = most_curved_edge(&coefficients);
            let weights = [0.1, 0.2, 0.3, 0.4];
            for (half, moved, kept) in [(near, q, p), (far, p, q)] {
                // The moved corner of the half is the middle of the edge.
                let mut whole = weights;
                whole[moved] = 0.5 * weights[moved];
                whole[kept] += 0.5 * weights[moved];
                prop_assert!((of(&half, weights) - of(&coefficients, whole)).abs() < 1e-12);
            }
        }
    }
}
