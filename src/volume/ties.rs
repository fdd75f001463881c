//! Which of many Delaunay meshes: the one that has the surface's own diagonals.
//!
//! Points of a grid lie on common spheres, so that the Delaunay mesh is free to triangulate their cells; but the surface
//! has a diagonal in each of its squares, and a square cut the other way is two missing triangles. So ties of the in-sphere test are
//! settled by **ranks** of the vertices: the paraboloid's point of a vertex is lowered by an infinitesimal amount, far more for
//! a vertex of lower rank. (Perturbing heights, not places, makes no flat tets: Devillers, Teillaud 2003.) Then each cell is cut
//! into tets at its vertex of lowest rank, and each of its faces at its own (a pulling triangulation: Lee 1997), and a square has the diagonal
//! from that vertex.
//!
//! ```text
//!    3 ── 4 ── 5      Ranks that suit the diagonals: 0 has one end of the first and is in no other
//!    │ ╱  │  ╱ │      square; when it has the lowest rank, the first square is settled, and
//!    0 ── 1 ── 2      1 is in one square only that is not, at an end of its diagonal; and so on.
//! ```
//!
//! A surface whose diagonals cannot all be had so (random ones) leaves some to the recovery.

use super::tetrahedra::Tetrahedra;
use crate::kernel::predicates::{Sign, insphere, orient3d};
use crate::kernel::simplex::area_vector;
use crate::{Point, Vector};
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// Two triangles of the surface whose four corners lie on one circle: the diagonal between them, and the one that it could be.
type Square = [[u32; 2]; 2];

/// The rank of each point, each once, such that as many diagonals as possible are those of the triangles: greedily, a vertex next
/// that is at the wrong corner of the fewest squares not settled yet.
pub(super) fn ranks(points: &[Point], triangles: &[[u32; 3]]) -> Vec<u32> {
    let squares = squares(points, triangles);
    let mut at_vertex: Vec<(u32, u32)> = (0u32..)
        .zip(&squares)
        .flat_map(|(s, [ends, others])| [ends[0], ends[1], others[0], others[1]].map(|v| (v, s)))
        .collect();
    at_vertex.sort_unstable();
    let squares_at = |v: u32| {
        let first = at_vertex.partition_point(|&(w, _)| w < v);
        at_vertex[first..].iter().take_while(move |&&(w, _)| w == v).map(|&(_, s)| s as usize)
    };
    let mut wrong = vec![0u32; points.len()];
    for &v in squares.iter().flat_map(|[_, others]| others) {
        wrong[v as usize] += 1;
    }
    let mut settled = vec![false; squares.len()];
    let mut ranks = vec![u32::MAX; points.len()];
    let mut next = 0;
    let mut heap: BinaryHeap<Reverse<(u32, u32)>> =
        (0u32..).zip(&wrong).map(|(v, &wrong)| Reverse((wrong, v))).collect();
    while let Some(Reverse((count, v))) = heap.pop() {
        // Whenever a count falls the vertex is put in again: older entries come later.
        if ranks[v as usize] != u32::MAX || count != wrong[v as usize] {
            continue;
        }
        ranks[v as usize] = next;
        next += 1;
        for s in squares_at(v) {
            if !std::mem::replace(&mut settled[s], true) {
                for u in squares[s][1] {
                    wrong[u as usize] -= 1;
                    heap.push(Reverse((wrong[u as usize], u)));
                }
            }
        }
    }
    ranks
}

/// The pairs of triangles with corners on one circle, exactly.
fn squares(points: &[Point], triangles: &[[u32; 3]]) -> Vec<Square> {
    let mut sides: Vec<([u32; 2], u32)> = triangles
        .iter()
        .flat_map(|&[a, b, c]| [(a, b, c), (b, c, a), (c, a, b)])
        .map(|(a, b, c)| ([a.min(b), a.max(b)], c))
        .collect();
    sides.sort_unstable();
    let mut squares = Vec::new();
    for group in sides.chunk_by(|one, other| one.0 == other.0) {
        for (i, &(ends, b)) in group.iter().enumerate() {
            let others = group[i + 1..].iter().map(|&(_, d)| [b, d]);
            squares.extend(others.filter(|&o| on_one_circle(points, ends, o)).map(|o| [ends, o]));
        }
    }
    squares
}

/// Whether the ends of a diagonal and two points on either side of it lie on one circle, exactly.
fn on_one_circle(points: &[Point], [a, c]: [u32; 2], [b, d]: [u32; 2]) -> bool {
    /// Far more than rounding can make of a circle, and little enough to spare most pairs the exact signs.
    const NEARLY: f64 = 1e-6;
    let [a, b, c, d] = [a, b, c, d].map(|v| &points[v as usize]);
    // Opposite angles of a quadrilateral on a circle sum up to two right ones: their cotangents cancel.
    let [(u, v), (w, x)] = [(a - b, c - b), (a - d, c - d)];
    let (one, other) = (u.cross(&v), w.cross(&x));
    let cosines = u.dot(&v) * other.norm() + w.dot(&x) * one.norm();
    let size = u.norm() * v.norm() * w.norm() * x.norm();
    if cosines.abs() > NEARLY * size || one.cross(&other).norm() > NEARLY * size || one.dot(&other) > 0.0 {
        return false;
    }
    if orient3d(a, b, c, d) != Sign::Zero {
        return false;
    }
    // A sphere through three of them and a point beside their plane meets the plane in their circle.
    let normal: Vector = area_vector(a, b, c);
    let beside = a + normal * ((b - a).norm() / normal.norm());
    orient3d(a, b, c, &beside) != Sign::Zero && insphere(a, b, c, &beside, d) == Sign::Zero
}

/// Whether a vertex that lies on the circumsphere of a tet counts as inside.
pub(super) fn is_inside(mesh: &Tetrahedra, tet: u32, vertex: u32) -> bool {
    let tet_ranks = mesh.tets[tet as usize].map(|v| mesh.ranks[v as usize]);
    let mut corners = [0, 1, 2, 3].map(|i| (tet_ranks[i], i as u32));
    corners.sort_unstable();
    for (rank, i) in corners {
        if mesh.ranks[vertex as usize] < rank {
            break;
        }
        // Lowered, a corner takes the sphere away from a vertex on its own side of the face opposite, and brings it nearer to one behind.
        let [a, b, c] = mesh.face_points(4 * tet + i);
        match orient3d(a, b, c, mesh.point(vertex)) {
            Sign::Zero => {}
            sign => return sign == Sign::Positive,
        }
    }
    true
}

#[cfg(test)]
mod tests {
    use super::super::samples::*;
    use super::super::{Settings, mesh};
    use super::*;
    use crate::kernel::random::Random;
    use crate::size::UniformSize;

    /// A cube of squares, some of which have the other diagonal.
    fn cube(squares: usize, turned: &mut dyn FnMut(usize) -> bool) -> Soup {
        let mut soup = Soup::default();
        soup.brick([0.; 3], [1.; 3], squares, INSIDE);
        for (i, pair) in soup.triangles.chunks_exact_mut(2).enumerate() {
            if turned(i) {
                let ([a, b, c], d) = (pair[0], pair[1][2]);
                (pair[0], pair[1]) = ([a, b, d], [b, c, d]);
            }
        }
        soup
    }

    fn missing_faces(soup: Soup) -> usize {
        let surface = soup.surface().unwrap();
        let settings = Settings { fill: false, ..Settings::default() };
        let (mesh, report) = mesh(&surface, &UniformSize(1.0), &settings).unwrap();
        check_fills(&surface, &mesh);
        report.missing_faces
    }

    #[test]
    fn the_delaunay_mesh_of_a_grid_has_its_diagonals_however_they_run() {
        let mut random = Random::new(31);
        for n in [2, 7, 16] {
            assert_eq!(missing_faces(cube(n, &mut |_| false)), 0, "{n} squares a side");
            assert_eq!(missing_faces(cube(n, &mut |i| (i / n + i % n) % 2 == 0)), 0, "{n} squares a side");
            assert_eq!(
                missing_faces(cube(n, &mut |_| random.bits().is_multiple_of(2))),
                0,
                "{n} squares a side"
            );
        }
    }

    #[test]
    fn only_corners_on_one_circle_are_a_square() {
        let points =
            [[0., 0., 0.], [3., 0., 0.], [3., 4., 0.], [0., 4., 0.], [0., 4., 1e-9], [0., 4.001, 0.]];
        let points = points.map(Point::from);
        assert!(on_one_circle(&points, [0, 2], [1, 3]));
        assert!(!on_one_circle(&points, [0, 2], [1, 4]));
        assert!(!on_one_circle(&points, [0, 2], [1, 5]));
        assert!(!on_one_circle(&points, [0, 1], [2, 3]));
        assert_eq!(squares(&points, &[[0, 1, 2], [0, 2, 3]]), [[[0, 2], [1, 3]]]);
    }
}
