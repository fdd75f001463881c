//! Choice among the Delaunay meshes of cospherical points: one that contains the surface's
//! diagonals.
//!
//! Points of a grid are cospherical, so their Delaunay mesh is not unique; but the surface has a
//! diagonal in each square, and a square split along the other diagonal is two missing triangles.
//! So ties of the in-sphere test are decided by **ranks** of the vertices: the lifted point of a
//! vertex is lowered by an infinitesimal amount, much more for a lower rank. (Perturbing the lifted
//! heights instead of positions makes no flat tets: Devillers, Teillaud 2003.) Then each cell is
//! split into tets at its vertex of lowest rank, and each of its faces likewise (a pulling
//! triangulation: Lee 1997), so a square has the diagonal from its lowest vertex.
//!
//! ```text
//!    3 ── 4 ── 5      Ranks for these diagonals: vertex 0 is an end of the first diagonal and in
//!    no
//!    │ ╱  │  ╱ │      other square, so it gets the lowest rank, which decides the first square.
//!    Then
//!    0 ── 1 ── 2      1 is in one undecided square only, at an end of its diagonal; and so on.
//! ```
//!
//! If no ranks give all diagonals (as for random ones), boundary recovery restores the rest.

use super::tetrahedra::Tetrahedra;
use crate::ground::kernel::predicates::{Sign, insphere, orient3d};
use crate::ground::kernel::simplex::area_vector;
use crate::{Point, Vector};
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// Two triangles of the surface with concyclic corners: their common diagonal, and the other one.
type Square = [[u32; 2]; 2];

/// The rank of each point, a permutation, such that many diagonals are those of the triangles.
///
/// Greedy: the next vertex is one that is off the diagonal in the fewest undecided squares.
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
    let mut decided = vec![false; squares.len()];
    let mut ranks = vec![u32::MAX; points.len()];
    let mut next = 0;
    let mut heap: BinaryHeap<Reverse<(u32, u32)>> =
        (0u32..).zip(&wrong).map(|(v, &wrong)| Reverse((wrong, v))).collect();
    while let Some(Reverse((count, v))) = heap.pop() {
        // A vertex is pushed again whenever its count decreases, so outdated entries are skipped.
        if ranks[v as usize] != u32::MAX || count != wrong[v as usize] {
            continue;
        }
        ranks[v as usize] = next;
        next += 1;
        for s in squares_at(v) {
            if !std::mem::replace(&mut decided[s], true) {
                for u in squares[s][1] {
                    wrong[u as usize] -= 1;
                    heap.push(Reverse((wrong[u as usize], u)));
                }
            }
        }
    }
    ranks
}

/// The pairs of triangles with exactly concyclic corners.
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

/// Whether the ends of a diagonal and the two points opposite to it are exactly concyclic.
fn on_one_circle(points: &[Point], [a, c]: [u32; 2], [b, d]: [u32; 2]) -> bool {
    /// Much larger than rounding errors, and small enough to spare most pairs the exact predicates.
    const NEARLY: f64 = 1e-6;
    let [a, b, c, d] = [a, b, c, d].map(|v| &points[v as usize]);
    // Opposite angles of a cyclic quadrilateral add up to π, so their cotangents cancel.
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
    // A sphere through three of them and a point off their plane cuts the plane in their circle.
    let normal: Vector = area_vector(a, b, c);
    let beside = a + normal * ((b - a).norm() / normal.norm());
    orient3d(a, b, c, &beside) != Sign::Zero && insphere(a, b, c, &beside, d) == Sign::Zero
}

/// Whether a vertex on the circumsphere of a tet counts as inside, by ranks.
pub(super) fn is_inside(mesh: &Tetrahedra, tet: u32, vertex: u32) -> bool {
    let tet_ranks = mesh.tets[tet as usize].map(|v| mesh.ranks[v as usize]);
    let mut corners = [0, 1, 2, 3].map(|i| (tet_ranks[i], i as u32));
    corners.sort_unstable();
    for (rank, i) in corners {
        if mesh.ranks[vertex as usize] < rank {
            break;
        }
        // Lowering a corner moves the sphere away from vertices on its side of the opposite face
        // and towards the others.
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
    use crate::ground::kernel::random::Random;
    use crate::ground::size::UniformSize;

    /// A cube of squares, some of them with the other diagonal.
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
