//! The lattice that subdivides a tet: counts, indices, and the corners of its children.
//!
//! Each edge of a tet is split into `n`. The **points** are those with integer barycentric
//! coordinates (a, b, c, d), a + b + c + d = n; since a follows from the others, a point is (b, c,
//! d). A **cell** is the part inside the tet of the unit cube of (b, c, d) that starts at a point.
//! It contains one **upright** child, a scaled copy of the parent; next to it an **octahedron** of
//! four children; and beyond that the **upside-down** child (Freudenthal 1942; Bey 1995).
//!
//! ```text
//!    in a face:     2         along a row, with n = 3:
//!                  / \              cells    0   1   2
//!                 5---4           upright    x   x   x
//!                / \ / \       octahedron    x   x
//!               0---3---1     upside down    x
//! ```
//!
//! Points and children are numbered **row by row**: d outermost, then c, then b. Within a row all
//! upright children come first, then the four of each octahedron, then the upside-down ones. So the
//! index of a child depends only on its position, not on the diagonals, and the corners of a row's
//! children are runs of consecutive points.

use crate::ground::mesh::TET_FACES;

/// Corner codes of the upright child of a cell. Bit 0 stands for b + 1, bit 1 for c + 1, bit 2 for
/// d + 1.
pub const UPRIGHT: [u8; 4] = [0, 1, 2, 4];

/// Corner codes of the upside-down child.
pub const UPSIDE_DOWN: [u8; 4] = [6, 7, 5, 3];

/// `MIDPOINT[i][j]`: corner code of the midpoint between corners i and j of the tet around an
/// octahedron.
pub const MIDPOINT: [[u8; 4]; 4] = [[0, 1, 2, 4], [1, 1, 3, 5], [2, 3, 2, 6], [4, 5, 6, 4]];

/// Corner codes of the four children of an octahedron, for each of its three diagonals.
///
/// Diagonal 0 joins the midpoints of the tet's edges 01 and 23, diagonal 1 those of 02 and 13,
/// diagonal 2 those of 03 and 12.
pub const OCTAHEDRON: [[[u8; 4]; 4]; 3] = [
    [[1, 6, 3, 2], [1, 6, 5, 3], [1, 6, 4, 5], [1, 6, 2, 4]],
    [[2, 5, 1, 3], [2, 5, 3, 6], [2, 5, 6, 4], [2, 5, 4, 1]],
    [[4, 3, 5, 1], [4, 3, 6, 5], [4, 3, 2, 6], [4, 3, 1, 2]],
];

/// The unit step of (b, c, d) toward each corner of the tet.
pub(super) const STEP: [[u32; 3]; 4] = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]];

/// The lattice with a given number of subdivisions per edge.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Lattice {
    n: u32,
}

/// Largest number of subdivisions per edge: 1024³ children still fit `u32` indices.
pub const MAX_PIECES: u32 = 1024;

fn choose2(k: u32) -> u32 {
    k * k.saturating_sub(1) / 2
}

fn choose3(k: u32) -> u32 {
    let k = u64::from(k);
    u32::try_from(k * k.saturating_sub(1) * k.saturating_sub(2) / 6).expect("at most C(1027, 3)")
}

impl Lattice {
    /// The lattice with `n` subdivisions per edge.
    ///
    /// # Panics
    /// Unless 1 ≤ n ≤ [`MAX_PIECES`].
    pub fn new(n: u32) -> Self {
        assert!(
            (1..=MAX_PIECES).contains(&n),
            "lattice with {n} subdivisions per edge, not 1 to {MAX_PIECES}"
        );
        Self { n }
    }

    /// The number of subdivisions per edge.
    pub fn n(self) -> u32 {
        self.n
    }

    /// The number of points in the tet, boundary included.
    pub fn points(self) -> u32 {
        choose3(self.n + 3)
    }

    /// The number of points interior to a coarse vertex, edge, face and tet.
    pub fn points_inside(self) -> [u32; 4] {
        [1, self.edge_points(), self.face_points(), self.tet_points()]
    }

    /// The number of interior points of an edge.
    pub fn edge_points(self) -> u32 {
        self.n - 1
    }

    /// The number of interior points of a face.
    pub fn face_points(self) -> u32 {
        choose2(self.n - 1)
    }

    /// The number of interior points of a tet.
    pub fn tet_points(self) -> u32 {
        choose3(self.n - 1)
    }

    /// The number of children of a tet.
    pub fn children(self) -> u32 {
        self.n.pow(3)
    }

    /// The number of children of a boundary triangle.
    pub fn face_children(self) -> u32 {
        self.n.pow(2)
    }

    /// The number of octahedra in a tet.
    pub fn octahedra(self) -> u32 {
        choose3(self.n + 1)
    }

    /// The index of the point (0, c, d); the index of (b, c, d) is larger by b.
    #[inline]
    pub fn row(self, c: u32, d: u32) -> u32 {
        let m = self.n - d;
        choose3(self.n + 3) - choose3(m + 3) + c * (m + 1) - choose2(c)
    }

    /// The index of a point.
    #[inline]
    pub fn index(self, [b, c, d]: [u32; 3]) -> u32 {
        self.row(c, d) + b
    }

    /// The index of the first child of the row of cells (·, c, d).
    #[inline]
    pub fn child_row(self, c: u32, d: u32) -> u32 {
        // A layer of size k has k³ − (k − 1)³ children, a row of m cells 6m − 6 (one if m = 1).
        let layer = |k: u32| if k == 0 { 0 } else { 3 * k * (k - 1) + 1 };
        let m = self.n - d;
        self.n.pow(3) - m.pow(3) + layer(m) - layer(m - c)
    }

    /// The index of the first octahedron of the row of cells (·, c, d).
    #[inline]
    pub fn octahedron_row(self, c: u32, d: u32) -> u32 {
        let m = self.n - d;
        choose3(self.n + 1) - choose3(m + 1) + choose2(m) - choose2(m - c)
    }

    /// The rows of cells in order: (c, d, number of cells).
    ///
    /// Every cell has an upright child, all but the last of a row an octahedron, all but the last
    /// two an upside-down child.
    pub fn rows(self) -> impl Iterator<Item = (u32, u32, u32)> {
        let n = self.n;
        (0..n).flat_map(move |d| (0..n - d).map(move |c| (c, d, n - d - c)))
    }

    /// The interior points (j, k) of a face in order, k outermost.
    pub fn face_interior(self) -> impl Iterator<Item = (u32, u32)> {
        let n = self.n;
        (1..n).flat_map(move |k| (1..n - k).map(move |j| (j, k)))
    }

    /// The rows of interior points of the tet in order: (index of the first, count).
    pub fn interior_rows(self) -> impl Iterator<Item = (u32, u32)> {
        let n = self.n;
        (1..n).flat_map(move |d| {
            (1..n - d).filter(move |c| c + d + 1 < n).map(move |c| (self.index([1, c, d]), n - 1 - c - d))
        })
    }

    /// The index of the child whose face is the upright child (j, k) of a face of the tet.
    pub fn upright_behind_face(self, [p, q, r]: [usize; 3], j: u32, k: u32) -> u32 {
        let i = self.n - 1 - j - k;
        let [b, c, d] = [0, 1, 2].map(|x| i * STEP[p][x] + j * STEP[q][x] + k * STEP[r][x]);
        self.child_row(c, d) + b
    }

    /// The cell (b, c, d) of the octahedron next to the upside-down child (j, k) of a face of the
    /// tet.
    pub fn octahedron_behind_face(self, [p, q, r]: [usize; 3], j: u32, k: u32) -> [u32; 3] {
        let i = self.n - 2 - j - k;
        [0, 1, 2].map(|x| i * STEP[p][x] + j * STEP[q][x] + k * STEP[r][x])
    }

    /// The index of the first of the four children of a cell's octahedron.
    pub fn octahedron_child(self, [b, c, d]: [u32; 3]) -> u32 {
        self.child_row(c, d) + (self.n - c - d) + 4 * b
    }
}

/// The number (0 to 3) of the octahedron's child that has a face on the parent's face opposite
/// corner `face`.
pub fn octahedron_child_on_face(diagonal: u8, face: usize) -> u32 {
    let [i, j, k] = TET_FACES[face];
    let corners = [MIDPOINT[i][j], MIDPOINT[i][k], MIDPOINT[j][k]];
    let children = &OCTAHEDRON[usize::from(diagonal)];
    let child = children.iter().position(|child| corners.iter().all(|c| child.contains(c)));
    child.expect("no diagonal cuts a face of the octahedron") as u32
}

/// The position of a corner code in a row of cells: which of the four rows of points (bit 0: c + 1,
/// bit 1: d + 1), and the offset along it.
#[inline]
pub fn corner_place(code: u8) -> (usize, usize) {
    (usize::from(code >> 1), usize::from(code & 1))
}

/// Calls `visit(j, k, upright)` for each child of a triangle, row by row: the upright ones, then
/// the upside-down ones.
pub fn for_each_face_child(n: u32, mut visit: impl FnMut(u32, u32, bool)) {
    for k in 0..n {
        (0..n - k).for_each(|j| visit(j, k, true));
        (0..n - k - 1).for_each(|j| visit(j, k, false));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn corner(code: u8) -> [i64; 3] {
        [0, 1, 2].map(|x| i64::from(code >> x & 1))
    }

    fn volume6(child: [u8; 4]) -> i64 {
        let [p, q, r, s] = child.map(corner);
        let minus = |x: [i64; 3]| [x[0] - p[0], x[1] - p[1], x[2] - p[2]];
        let [u, v, w] = [minus(q), minus(r), minus(s)];
        u[0] * (v[1] * w[2] - v[2] * w[1])
            + u[1] * (v[2] * w[0] - v[0] * w[2])
            + u[2] * (v[0] * w[1] - v[1] * w[0])
    }

    #[test]
    fn every_child_is_positive_and_has_the_same_volume() {
        assert_eq!(volume6(UPRIGHT), 1);
        assert_eq!(volume6(UPSIDE_DOWN), 1);
        for child in OCTAHEDRON.as_flattened() {
            assert_eq!(volume6(*child), 1, "{child:?}");
        }
    }

    #[test]
    fn points_rows_children_and_octahedra_are_counted_without_gaps() {
        for n in 1..=12 {
            let lattice = Lattice::new(n);
            let (mut points, mut children, mut octahedra) = (0, 0, 0);
            for d in 0..=n {
                for c in 0..=n - d {
                    assert_eq!(lattice.row(c, d), points, "n = {n}, c = {c}, d = {d}");
                    points += n - d - c + 1;
                }
            }
            assert_eq!(points, lattice.points());
            for (c, d, cells) in lattice.rows() {
                assert_eq!(lattice.child_row(c, d), children, "n = {n}, c = {c}, d = {d}");
                assert_eq!(lattice.octahedron_row(c, d), octahedra);
                children += cells + 4 * (cells - 1) + cells.saturating_sub(2);
                octahedra += cells - 1;
            }
            assert_eq!(children, lattice.children());
            assert_eq!(octahedra, lattice.octahedra());
            assert_eq!(lattice.face_interior().count() as u32, lattice.face_points());
            assert_eq!(lattice.interior_rows().map(|r| r.1).sum::<u32>(), lattice.tet_points());
        }
    }

    #[test]
    fn the_largest_lattice_is_numbered_by_u32() {
        let lattice = Lattice::new(MAX_PIECES);
        assert_eq!(lattice.points(), 180_007_425);
        assert_eq!(lattice.children(), 1 << 30);
        assert_eq!(lattice.child_row(0, MAX_PIECES - 1), (1 << 30) - 1);
    }
}
