//! A lattice with a table of the starts of its rows of points, whose closed form is slow for loops
//! over 10⁹ children.

use super::lattice::{Lattice, STEP};

/// The starts of the rows of points of a lattice.
#[derive(Clone, Debug)]
pub(super) struct Rows {
    lattice: Lattice,
    /// By c + (n + 1)·d; 0 outside the tet.
    starts: Box<[u32]>,
}

impl Rows {
    /// Computes the starts.
    pub fn new(lattice: Lattice) -> Self {
        let n = lattice.n();
        let start = |d, c| if c + d <= n { lattice.row(c, d) } else { 0 };
        Self { lattice, starts: (0..=n).flat_map(|d| (0..=n).map(move |c| start(d, c))).collect() }
    }

    /// The lattice.
    #[inline]
    pub fn lattice(&self) -> Lattice {
        self.lattice
    }

    /// The index of the point (0, c, d).
    #[inline]
    pub fn start(&self, c: u32, d: u32) -> usize {
        self.starts[(c + (self.lattice.n() + 1) * d) as usize] as usize
    }

    /// The index of a point.
    #[inline]
    pub fn index(&self, [b, c, d]: [u32; 3]) -> usize {
        self.start(c, d) + b as usize
    }

    /// The starts of the four rows of points around a row of cells, numbered as in
    /// [`corner_place`](super::lattice::corner_place); 0 outside the tet.
    #[inline]
    pub fn around(&self, c: u32, d: u32) -> [usize; 4] {
        // The last row of a layer has no fourth row of points; none of its children uses it.
        let inside = c + d + 2 <= self.lattice.n();
        [
            self.start(c, d),
            self.start(c + 1, d),
            self.start(c, d + 1),
            if inside { self.start(c + 1, d + 1) } else { 0 },
        ]
    }

    /// The index of the point at position `k` of the edge from corner `from` to corner `to`.
    #[inline]
    pub fn on_edge(&self, [from, to]: [usize; 2], k: u32) -> usize {
        let i = self.lattice.n() - k;
        let (p, q) = (STEP[from], STEP[to]);
        self.index([i * p[0] + k * q[0], i * p[1] + k * q[1], i * p[2] + k * q[2]])
    }

    /// The index of the point of a face with weights `j` and `k` at its second and third corner.
    #[inline]
    pub fn on_face(&self, [p, q, r]: [usize; 3], j: u32, k: u32) -> usize {
        let i = self.lattice.n() - j - k;
        let (p, q, r) = (STEP[p], STEP[q], STEP[r]);
        // Written out because closures in `map` are not always inlined.
        self.index([
            i * p[0] + j * q[0] + k * r[0],
            i * p[1] + j * q[1] + k * r[1],
            i * p[2] + j * q[2] + k * r[2],
        ])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ground::mesh::{TET_EDGES, TET_FACES};

    #[test]
    fn the_table_has_the_indices_of_the_lattice() {
        for n in 1..=9 {
            let lattice = Lattice::new(n);
            let rows = Rows::new(lattice);
            for d in 0..=n {
                for c in 0..=n - d {
                    assert_eq!(rows.index([2, c, d]), lattice.index([2, c, d]) as usize, "n = {n}");
                }
            }
        }
    }

    #[test]
    fn points_inside_edges_faces_and_the_tet_cover_the_lattice_once() {
        let lattice = Lattice::new(7);
        let rows = Rows::new(lattice);
        let mut seen = vec![0; lattice.points() as usize];
        for corner in STEP {
            seen[rows.index(corner.map(|x| x * 7))] += 1;
        }
        for edge in TET_EDGES {
            (1..7).for_each(|k| seen[rows.on_edge(edge, k)] += 1);
        }
        for face in TET_FACES {
            lattice.face_interior().for_each(|(j, k)| seen[rows.on_face(face, j, k)] += 1);
        }
        for (first, count) in lattice.interior_rows() {
            (first..first + count).for_each(|i| seen[i as usize] += 1);
        }
        assert!(seen.iter().all(|&times| times == 1), "{seen:?}");
    }
}
