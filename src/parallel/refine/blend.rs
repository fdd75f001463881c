//! Transfinite interpolation of the lattice of the odd part of n, the starting point of the dyadic
//! rule.
//!
//! For n = m·2ᵏ with m odd, the points whose weights are multiples of 2ᵏ are not midpoints of other
//! lattice points. They are placed at their barycentric position, displaced like the boundary of
//! their entity: transfinite interpolation in the form that evaluates the boundary at lattice
//! points only (Perronnet 1998 gives such formulas for the triangle and the tetrahedron).
//!
//! Let d be the displacement from the barycentric position (zero at corners) and λ the barycentric
//! coordinates. The edges of a simplex contribute
//!
//! ```text
//!     E(λ) = Σ λ_i d(point of edge ij with weight λ_j at j)        over all i ≠ j
//! ```
//! which equals d on each edge. In a tet the residual of the faces, r = d − E (zero on edges), is
//! added in the same way:
//!
//! ```text
//!     F(λ) = Σ λ_i r(point of face ijk with weights λ_j, λ_k at j, k)    over all i and pairs jk without i
//! ```

use super::lattice::Lattice;
use super::snap::Coordinates;
use crate::ground::mesh::TET_FACES;

/// Splits n into its odd part m and the power of two 2ᵏ.
pub fn split(n: u32) -> (u32, u32) {
    let power = 1 << n.trailing_zeros();
    (n / power, power)
}

/// The point with these barycentric weights, whose sum is m.
///
/// Exact in each coordinate that all corners have in common.
pub fn barycentric<const N: usize>(corners: &[Coordinates; N], weights: [u32; N]) -> Coordinates {
    let sum = f64::from(weights.iter().sum::<u32>());
    let mut point = corners[0];
    for x in 0..3 {
        let toward = (1..N).map(|i| f64::from(weights[i]) * (corners[i][x] - corners[0][x]));
        point[x] += toward.sum::<f64>() / sum;
    }
    point
}

/// The boundary displacement of a triangle (N = 3) or tet (N = 4), to be interpolated inside.
pub struct Blend<const N: usize> {
    m: u32,
    /// Start of each row of points in `residuals`, by c + (m + 1)·d, as in [`Lattice`].
    rows: Vec<u32>,
    /// d at points on edges, r at points on faces.
    residuals: Vec<Coordinates>,
}

impl<const N: usize> Blend<N> {
    /// Allocates for the lattice with `m` subdivisions per edge.
    pub fn new(m: u32) -> Self {
        let lattice = Lattice::new(m);
        let row = |d, c| if c + d <= m { lattice.row(c, d) } else { 0 };
        let layers = if N == 4 { m + 1 } else { 1 };
        let points = if N == 4 { lattice.points() } else { (m + 1) * (m + 2) / 2 };
        Self {
            m,
            rows: (0..layers).flat_map(|d| (0..=m).map(move |c| row(d, c))).collect(),
            residuals: vec![[0.0; 3]; points as usize],
        }
    }

    fn index(&self, weights: [u32; N]) -> usize {
        let layer = if N == 4 { weights[3] * (self.m + 1) } else { 0 };
        (self.rows[(weights[2] + layer) as usize] + weights[1]) as usize
    }

    /// Sets the boundary displacements of an entity; `at` returns its boundary points by weights.
    pub fn take(&mut self, corners: &[Coordinates; N], at: impl Fn([u32; N]) -> Coordinates) {
        let m = self.m;
        let displacement = |weights| {
            let mut displacement = at(weights);
            add(&mut displacement, -1.0, barycentric(corners, weights));
            displacement
        };
        for i in 0..N {
            for j in i + 1..N {
                for k in 1..m {
                    let mut weights = [0; N];
                    (weights[i], weights[j]) = (m - k, k);
                    let index = self.index(weights);
                    self.residuals[index] = displacement(weights);
                }
            }
        }
        if N < 4 {
            return;
        }
        for face in TET_FACES {
            for (j, k) in Lattice::new(m).face_interior() {
                let mut weights = [0; N];
                (weights[face[0]], weights[face[1]], weights[face[2]]) = (m - j - k, j, k);
                let mut residual = displacement(weights);
                add(&mut residual, -1.0, self.by_edges(weights));
                let index = self.index(weights);
                self.residuals[index] = residual;
            }
        }
    }

    /// The interpolated point with these weights.
    pub fn point(&self, corners: &[Coordinates; N], weights: [u32; N]) -> Coordinates {
        let mut point = barycentric(corners, weights);
        add(&mut point, 1.0, self.by_edges(weights));
        if N == 4 {
            add(&mut point, 1.0, self.by_faces(weights));
        }
        point
    }

    /// E(λ) of the module documentation.
    fn by_edges(&self, weights: [u32; N]) -> Coordinates {
        let mut sum = [0.0; 3];
        for i in 0..N {
            for j in (0..N).filter(|&j| j != i && weights[j] > 0) {
                let mut on_edge = [0; N];
                (on_edge[i], on_edge[j]) = (self.m - weights[j], weights[j]);
                add(&mut sum, f64::from(weights[i]), self.residuals[self.index(on_edge)]);
            }
        }
        sum.map(|x| x / f64::from(self.m))
    }

    /// F(λ) of the module documentation: a sum over each face and each of its corners.
    fn by_faces(&self, weights: [u32; N]) -> Coordinates {
        let mut sum = [0.0; 3];
        for opposite in 0..N {
            for i in (0..N).filter(|&i| i != opposite) {
                let mut on_face = weights;
                on_face[opposite] = 0;
                on_face[i] += weights[opposite];
                // Points on edges have no residual (they store d, not r).
                if (0..N).any(|j| j != opposite && on_face[j] == 0) {
                    continue;
                }
                add(&mut sum, f64::from(weights[i]), self.residuals[self.index(on_face)]);
            }
        }
        sum.map(|x| x / f64::from(self.m))
    }
}

fn add(sum: &mut Coordinates, factor: f64, vector: Coordinates) {
    sum.iter_mut().zip(vector).for_each(|(s, v)| *s += factor * v);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn n_is_an_odd_number_times_a_power_of_two() {
        assert_eq!([1, 2, 3, 12, 40, 1024].map(split), [(1, 1), (1, 2), (3, 1), (3, 4), (5, 8), (1, 1024)]);
    }

    #[test]
    fn a_displacement_given_on_the_boundary_is_kept_there() {
        let corners = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.2], [0.0, 1.0, -0.1], [0.1, 0.2, 1.0]];
        let bend = |w: [u32; 4]| {
            let mut point = barycentric(&corners, w);
            let [p, q, r, s] = w.map(|w| f64::from(w) / 7.0);
            add(&mut point, 1.0, [p * q - r * r * s * p, p * q * r + s * q, 2.0 * s * p]);
            point
        };
        // At boundary points the interpolation must reproduce the given displacement.
        let mut blend = Blend::new(7);
        blend.take(&corners, bend);
        for weights in [[0, 2, 4, 1], [3, 0, 1, 3], [2, 2, 0, 3], [1, 3, 3, 0], [0, 0, 5, 2], [7, 0, 0, 0]] {
            let (kept, given) = (blend.point(&corners, weights), bend(weights));
            assert!((0..3).all(|x| (kept[x] - given[x]).abs() < 1e-15), "{kept:?} {given:?}");
        }
        blend.take(&corners, |w| barycentric(&corners, w));
        let (inside, given) = (blend.point(&corners, [1, 2, 3, 1]), barycentric(&corners, [1, 2, 3, 1]));
        assert!((0..3).all(|x| (inside[x] - given[x]).abs() < 1e-15));
    }
}
