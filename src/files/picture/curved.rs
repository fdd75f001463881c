//! Curved faces of second order, as flat pieces.

use super::scene::Triangle;
use crate::files::color::Color;
use crate::ground::mesh::TRIANGLE_EDGES;

/// The largest distance of a piece from the curve, as a fraction of the edge: less than a pixel on
/// edges of 500 pixels.
const TOLERANCE: f64 = 0.002;

/// Maximum number of pieces of an edge.
const MOST: f64 = 16.0;

/// Appends the pieces of the face with these corners and nodes on its edges, in the order of
/// [`TRIANGLE_EDGES`].
pub(super) fn pieces(corners: [[f64; 3]; 3], nodes: [[f64; 3]; 3], color: Color, found: &mut Vec<Triangle>) {
    let n = pieces_of_edge(&corners, &nodes);
    let at = |i: u32, j: u32| point(&corners, &nodes, [n - i - j, i, j].map(|k| f64::from(k) / f64::from(n)));
    for i in 0..n {
        for j in 0..n - i {
            let corners = [at(i, j), at(i + 1, j), at(i, j + 1)];
            // The edges opposite the corners.
            let edges = [i + j + 1 == n, i == 0, j == 0];
            found.push(Triangle { corners, color, edges, pieces: n });
            if i + j + 1 < n {
                let corners = [at(i + 1, j + 1), at(i, j + 1), at(i + 1, j)];
                found.push(Triangle { corners, color, edges: [false; 3], pieces: n });
            }
        }
    }
}

/// The number of pieces that are close to the curve: n of them are n² times closer than one.
fn pieces_of_edge(corners: &[[f64; 3]; 3], nodes: &[[f64; 3]; 3]) -> u32 {
    let distance = |a: [f64; 3], b: [f64; 3]| (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>().sqrt();
    let bend = |(ends, node): (&[usize; 2], &[f64; 3])| {
        let [a, b] = ends.map(|end| corners[end]);
        let middle = [0, 1, 2].map(|k| 0.5 * (a[k] + b[k]));
        distance(*node, middle) / distance(a, b).max(f64::MIN_POSITIVE)
    };
    let bend = TRIANGLE_EDGES.iter().zip(nodes).map(bend).fold(0.0, f64::max);
    (bend / TOLERANCE).sqrt().ceil().clamp(1.0, MOST) as u32
}

/// The point of the curved face at barycentric coordinates.
fn point(corners: &[[f64; 3]; 3], nodes: &[[f64; 3]; 3], at: [f64; 3]) -> [f64; 3] {
    [0, 1, 2].map(|k| {
        let of_corner = |i: usize| at[i] * (2.0 * at[i] - 1.0) * corners[i][k];
        let of_edge = |i: usize| {
            let [a, b] = TRIANGLE_EDGES[i];
            4.0 * at[a] * at[b] * nodes[i][k]
        };
        (0..3).map(|i| of_corner(i) + of_edge(i)).sum()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const CORNERS: [[f64; 3]; 3] = [[0., 0., 0.], [2., 0., 0.], [0., 2., 0.]];

    fn drawn(nodes: [[f64; 3]; 3]) -> Vec<Triangle> {
        let mut found = Vec::new();
        pieces(CORNERS, nodes, [1.0; 3], &mut found);
        found
    }

    #[test]
    fn a_straight_face_is_one_triangle_with_its_edges() {
        let straight = drawn([[1., 0., 0.], [1., 1., 0.], [0., 1., 0.]]);
        assert_eq!(straight, [Triangle { corners: CORNERS, color: [1.0; 3], edges: [true; 3], pieces: 1 }]);
    }

    #[test]
    fn the_pieces_of_a_curved_face_cover_it_and_have_only_its_own_edges() {
        let curved = drawn([[1., -0.2, 0.], [1., 1., 0.], [0., 1., 0.]]);
        let n = curved[0].pieces;
        assert_eq!((n, curved.len()), (8, 64));
        let area = |t: &Triangle| {
            let [a, b, c] = t.corners;
            0.5 * ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]))
        };
        // Under a parabola of length 2 and height 0.2 there is 2/3 · 2 · 0.2.
        let areas = curved.iter().map(area).sum::<f64>();
        assert!((areas - 2.0 - 0.8 / 3.0).abs() < 0.01 * areas, "{areas}");
        assert!(curved.iter().all(|t| area(t) > 0.0));
        let edges = curved.iter().flat_map(|t| t.edges).filter(|drawn| *drawn).count();
        assert_eq!(edges as u32, 3 * n);
        assert!(curved.iter().any(|t| t.corners.contains(&[1., -0.2, 0.])), "the node is a corner");
    }
}
