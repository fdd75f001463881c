//! Orientation and quality of a row of children.
//!
//! The corners of the children are runs of consecutive numbers, so plain loops over them vectorise.

use crate::ground::kernel::predicates::volume6_and_error;

/// The corners of the children in one row of cells.
pub struct Run<'a> {
    /// By axis, then by corner; slices of `count` numbers.
    pub axes: [[&'a [f64]; 4]; 3],
    /// The number of tets.
    pub count: usize,
}

impl Run<'_> {
    /// The edge vectors from the first corner to the others: by corner, then by axis.
    #[inline(always)]
    fn edges(&self, i: usize) -> [[f64; 3]; 3] {
        // Written out because closures are not always inlined, and this is the innermost loop.
        let [x, y, z] = &self.axes;
        let (px, py, pz) = (x[0][i], y[0][i], z[0][i]);
        [
            [x[1][i] - px, y[1][i] - py, z[1][i] - pz],
            [x[2][i] - px, y[2][i] - py, z[2][i] - pz],
            [x[3][i] - px, y[3][i] - py, z[3][i] - pz],
        ]
    }

    /// The same run with slices trimmed to `count`, so that the compiler drops the bounds checks.
    #[inline(always)]
    fn trimmed(&self) -> Run<'_> {
        fn trim([p, q, r, s]: [&[f64]; 4], count: usize) -> [&[f64]; 4] {
            [&p[..count], &q[..count], &r[..count], &s[..count]]
        }
        let [x, y, z] = self.axes;
        let count = self.count;
        Run { axes: [trim(x, count), trim(y, count), trim(z, count)], count }
    }

    /// Whether all tets are positive beyond the rounding error bound.
    #[inline(always)]
    pub fn all_positive(&self) -> bool {
        let run = self.trimmed();
        let mut certain = true;
        for i in 0..self.count {
            let (volume, error) = volume6_and_error(run.edges(i));
            certain &= volume > error;
        }
        certain
    }

    /// Lowers each entry of `shapes` to the shape of its tet if that is worse, and sets its entry
    /// of `certain` to 0 if the tet's sign is not certainly positive.
    #[inline(always)]
    pub fn measure(&self, shapes: &mut [f64], certain: &mut [f64]) {
        let run = self.trimmed();
        let (shapes, certain) = (&mut shapes[..self.count], &mut certain[..self.count]);
        for i in 0..self.count {
            let edges = run.edges(i);
            let (volume, error) = volume6_and_error(edges);
            let squares = sum_of_squares(edges);
            let shape = volume * volume.abs() / (squares * squares * squares);
            shapes[i] = if shape < shapes[i] { shape } else { shapes[i] };
            certain[i] = if volume > error { certain[i] } else { 0.0 };
        }
    }
}

/// The sum of the squares of a tet's six edges, given the three edge vectors at one corner.
#[inline(always)]
fn sum_of_squares([u, v, w]: [[f64; 3]; 3]) -> f64 {
    // |u−v|² + |v−w|² + |w−u|² = 3 (|u|² + |v|² + |w|²) − |u+v+w|²
    let square = |p: [f64; 3]| p[0] * p[0] + p[1] * p[1] + p[2] * p[2];
    let sum = [u[0] + v[0] + w[0], u[1] + v[1] + w[1], u[2] + v[2] + w[2]];
    4.0 * (square(u) + square(v) + square(w)) - square(sum)
}
