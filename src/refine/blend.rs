//! The lattice of the odd part of n, from which the dyadic rule goes on.
//!
//! For n = m·2ᵏ with m odd the points with weights that are multiples of 2ᵏ have no midpoints to come from. They
//! are the barycentric ones, displaced as the boundary of their entity is: transfinite interpolation in the form that asks
//! for the boundary at lattice points only (Perronnet 1998 gives such formulas for triangle and tetrahedron).
//!
//! With d the displacement from the barycentric place, zero at corners, and λ the barycentric coordinates,
//! the edges of a simplex give each of its points
//!
//! ```text
//!   E(λ) = Σ λ_i d(point of edge ij with weight λ_j at j)          over all i ≠ j
//! ```
//! which is d itself on each edge. In a tet what the faces lack, r = d − E, zero on edges, is added likewise:
//!
//! ```text
//!   F(λ) = Σ λ_i r(point of face ijk with weights λ_j, λ_k at j, k)  over all i and pairs jk without i
//! ```

use super::snap::Coordinates;

/// Splits n into its odd part m and the power of two 2ᵏ.
pub fn split(n: u32) -> (u32, u32) {
    let power = 1 << n.trailing_zeros();
    (n / power, power)
}

/// The barycentric point with these weights, whose sum is m. Exact where all corners have the same coordinate.
pub fn barycentric<const N: usize>(corners: &[Coordinates; N], weights: [u32; N]) -> Coordinates {
    let sum = f64::from(weights.iter().sum::<u32>());
    let mut point = corners[0];
    for x in 0..3 {
        let toward = (1..N).map(|i| f64::from(weights[i]) * (corners[i][x] - corners[0][x]));
        point[x] += toward.sum::<f64>() / sum;
    }
    point
}

/// A point with these weights, displaced as the edges are, and in a tet as the faces are. `at` gives the points that
/// have a zero weight.
pub fn blended<const N: usize>(
    corners: &[Coordinates; N],
    weights: [u32; N],
    at: impl Fn([u32; N]) -> Coordinates,
) -> Coordinates {
    let mut displacement = from_edges(corners, weights, &at);
    if N == 4 {
        add(&mut displacement, 1.0, from_faces(corners, weights, &at));
    }
    let mut point = barycentric(corners, weights);
    add(&mut point, 1.0, displacement);
    point
}

fn add(sum: &mut Coordinates, factor: f64, vector: Coordinates) {
    sum.iter_mut().zip(vector).for_each(|(s, v)| *s += factor * v);
}

/// How far a point that is there lies from its barycentric place.
fn displacement<const N: usize>(
    corners: &[Coordinates; N],
    weights: [u32; N],
    at: &impl Fn([u32; N]) -> Coordinates,
) -> Coordinates {
    let mut displacement = at(weights);
    add(&mut displacement, -1.0, barycentric(corners, weights));
    displacement
}

/// E of the module's text.
fn from_edges<const N: usize>(
    corners: &[Coordinates; N],
    weights: [u32; N],
    at: &impl Fn([u32; N]) -> Coordinates,
) -> Coordinates {
    let m: u32 = weights.iter().sum();
    let mut sum = [0.0; 3];
    for i in (0..N).filter(|&i| weights[i] > 0) {
        for j in (0..N).filter(|&j| j != i && weights[j] > 0) {
            let mut on_edge = [0; N];
            (on_edge[i], on_edge[j]) = (m - weights[j], weights[j]);
            add(&mut sum, f64::from(weights[i]) / f64::from(m), displacement(corners, on_edge, at));
        }
    }
    sum
}

/// F of the module's text: for each face and each of its corners.
fn from_faces<const N: usize>(
    corners: &[Coordinates; N],
    weights: [u32; N],
    at: &impl Fn([u32; N]) -> Coordinates,
) -> Coordinates {
    let m: u32 = weights.iter().sum();
    let mut sum = [0.0; 3];
    for opposite in 0..N {
        for i in (0..N).filter(|&i| i != opposite) {
            let mut on_face = weights;
            on_face[opposite] = 0;
            on_face[i] += weights[opposite];
            let mut lacking = displacement(corners, on_face, at);
            add(&mut lacking, -1.0, from_edges(corners, on_face, at));
            add(&mut sum, f64::from(weights[i]) / f64::from(m), lacking);
        }
    }
    sum
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
        for weights in [[0, 2, 4, 1], [3, 0, 1, 3], [2, 2, 0, 3], [1, 3, 3, 0], [0, 0, 5, 2], [7, 0, 0, 0]] {
            let (kept, given) = (blended(&corners, weights, bend), bend(weights));
            assert!((0..3).all(|x| (kept[x] - given[x]).abs() < 1e-15), "{kept:?} {given:?}");
        }
        let flat = |w: [u32; 4]| barycentric(&corners, w);
        let (inside, given) = (blended(&corners, [1, 2, 3, 1], flat), flat([1, 2, 3, 1]));
        assert!((0..3).all(|x| (inside[x] - given[x]).abs() < 1e-15));
    }
}
