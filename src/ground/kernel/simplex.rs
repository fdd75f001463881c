//! Volumes, areas and angles of simplices.

use super::nearest::in_segment;
use crate::{Point, Vector};

/// The faces of a tet: face i is opposite vertex i, outward if the tet is positively oriented.
pub const TET_FACES: [[usize; 3]; 4] = [[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]];

/// The edges of a tet, in lexicographic order.
pub const TET_EDGES: [[usize; 2]; 6] = [[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]];

/// The edges of a triangle, around it.
pub const TRIANGLE_EDGES: [[usize; 2]; 3] = [[0, 1], [1, 2], [2, 0]];

/// `EDGE_BETWEEN[i][j]`: the position in [`TET_EDGES`] of the edge between vertices i and j.
pub const EDGE_BETWEEN: [[usize; 4]; 4] = [[6, 0, 1, 2], [0, 6, 3, 4], [1, 3, 6, 5], [2, 4, 5, 6]];

/// For a directed edge i→j of a tet, the other two vertices k, l such that (i, j, k, l) is an even
/// permutation.
#[rustfmt::skip]
pub(crate) const OPPOSITE_EDGE: [[[usize; 2]; 4]; 4] = [
    [[0, 0], [2, 3], [3, 1], [1, 2]],
    [[3, 2], [0, 0], [0, 3], [2, 0]],
    [[1, 3], [3, 0], [0, 0], [0, 1]],
    [[2, 1], [0, 2], [1, 0], [0, 0]],
];

/// The vertices of a triangle, ascending: a key that does not depend on its orientation.
#[inline(always)]
pub(crate) fn ascending([a, b, c]: [u32; 3]) -> [u32; 3] {
    let (low, high) = (a.min(b), a.max(b));
    [low.min(c), high.min(c).max(low), high.max(c)]
}

/// Six times the signed volume of the tet a, b, c, d: (b−a)×(c−a)·(d−a). Its sign is not exact.
#[inline]
pub fn volume6(a: &Point, b: &Point, c: &Point, d: &Point) -> f64 {
    (b - a).cross(&(c - a)).dot(&(d - a))
}

/// The signed volume of the tet a, b, c, d.
#[inline]
pub fn volume(a: &Point, b: &Point, c: &Point, d: &Point) -> f64 {
    volume6(a, b, c, d) / 6.0
}

/// Twice the area of the triangle a, b, c times its normal by the right-hand rule.
#[inline]
pub fn area_vector(a: &Point, b: &Point, c: &Point) -> Vector {
    (b - a).cross(&(c - a))
}

/// The area of the triangle a, b, c.
#[inline]
pub fn area(a: &Point, b: &Point, c: &Point) -> f64 {
    0.5 * area_vector(a, b, c).norm()
}

/// The six dihedral angles of a positively oriented tet in degrees, in the order of
/// [`TET_EDGES`](TET_EDGES).
pub fn dihedral_angles(p: &[Point; 4]) -> [f64; 6] {
    dihedral_cosines(p).map(|cosine| cosine.acos().to_degrees())
}

/// The cosines of the [`dihedral_angles`].
pub fn dihedral_cosines(p: &[Point; 4]) -> [f64; 6] {
    let normal = |face: usize| {
        let [a, b, c] = TET_FACES[face];
        let n = area_vector(&p[a], &p[b], &p[c]);
        n * (1.0 / n.norm().max(f64::MIN_POSITIVE))
    };
    let [n0, n1, n2, n3] = [normal(0), normal(1), normal(2), normal(3)];
    // The edge between vertices i and j lies on the faces opposite the other two.
    let between = |n: &crate::Vector, m: &crate::Vector| (-n.dot(m)).clamp(-1.0, 1.0);
    [
        between(&n2, &n3),
        between(&n1, &n3),
        between(&n1, &n2),
        between(&n0, &n3),
        between(&n0, &n2),
        between(&n0, &n1),
    ]
}

/// The largest of the [`dihedral_cosines`]: that of the smallest angle.
pub fn largest_cosine(p: &[Point; 4]) -> f64 {
    dihedral_cosines(p).into_iter().fold(-1.0, f64::max)
}

/// The corners of a triangle rotated so that the smallest is first: a key that keeps the
/// orientation.
pub fn from_lowest<T: Ord>([a, b, c]: [T; 3]) -> [T; 3] {
    if a < b && a < c {
        [a, b, c]
    } else if b < c {
        [b, c, a]
    } else {
        [c, a, b]
    }
}

/// The squared distance of a point from a triangle.
pub fn squared_distance(point: &Point, corners: [&Point; 3]) -> f64 {
    let [a, b, c] = corners;
    let normal = area_vector(a, b, c);
    let edges = [[a, b], [b, c], [c, a]];
    if edges.iter().all(|[u, v]| normal.cross(&(*v - *u)).dot(&(point - *u)) >= 0.0) {
        return (point - a).dot(&normal).powi(2) / normal.norm_squared();
    }
    edges.map(|[u, v]| in_segment(point, u, v).1).into_iter().fold(f64::INFINITY, f64::min)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_corner_of_the_cube_has_three_right_angles() {
        let p = [[0., 0., 0.], [1., 0., 0.], [0., 1., 0.], [0., 0., 1.]].map(Point::from);
        assert_eq!(volume(&p[0], &p[1], &p[2], &p[3]), 1.0 / 6.0);
        let angles = dihedral_angles(&p);
        for (k, angle) in angles.iter().enumerate() {
            let expected = if k < 3 { 90.0 } else { 54.735_610_317_245_346 };
            assert!((angle - expected).abs() < 1e-9, "edge {k}: {angle}");
        }
    }

    #[test]
    fn the_distance_of_a_point_is_that_from_the_face_an_edge_or_a_corner() {
        let corners = [[0., 0., 0.], [2., 0., 0.], [0., 2., 0.]].map(Point::from);
        for (point, squared) in [
            ([0.5, 0.5, 3.], 9.),
            ([1., -1., 1.], 2.),
            ([2., 2., 0.], 2.),
            ([-3., -4., 0.], 25.),
            ([4., 0., 1.], 5.),
        ] {
            assert!((squared_distance(&point.into(), corners.each_ref()) - squared).abs() < 1e-12);
        }
    }
}
