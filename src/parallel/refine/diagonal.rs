//! The diagonal that cuts each octahedron: the best of three, stored in two bits.
//!
//! Octahedra lie inside coarse tets, so each can choose its diagonal independently. The measure is
//! the worst mean ratio of the four children, as (volume)²/(Σ edge²)³, which orders tets like the
//! mean ratio and needs no root. Ties go to the diagonal of lowest number; numbers follow the
//! vertex order of the coarse tet, which is the same for every partition.

use super::lattice::OCTAHEDRON;
use super::snap::Coordinates;

/// The diagonals of the octahedra of all coarse tets of a part.
#[derive(Clone, Debug)]
pub struct Diagonals {
    bytes_per_tet: usize,
    bytes: Vec<u8>,
}

impl Diagonals {
    /// Creates diagonals for `tets` tets of `octahedra` octahedra each, all set to 0; `None` if
    /// there is not enough memory.
    pub fn new(tets: usize, octahedra: u32) -> Option<Self> {
        let bytes_per_tet = Self::bytes_of_tet(octahedra);
        let bytes = bytemuck::allocation::try_zeroed_vec(tets * bytes_per_tet).ok()?;
        Some(Self { bytes_per_tet, bytes })
    }

    /// The number of bytes for a tet of `octahedra` octahedra.
    pub fn bytes_of_tet(octahedra: u32) -> usize {
        // At least one byte per tet, so that each tet has a chunk.
        octahedra.div_ceil(4).max(1) as usize
    }

    /// The number of bytes per tet.
    pub fn bytes_per_tet(&self) -> usize {
        self.bytes_per_tet
    }

    /// The packed diagonals, tet by tet.
    pub fn bytes_mut(&mut self) -> &mut [u8] {
        &mut self.bytes
    }

    /// The diagonals of one tet.
    pub fn of_tet(&self, tet: u32) -> TetDiagonals<'_> {
        TetDiagonals(&self.bytes[tet as usize * self.bytes_per_tet..][..self.bytes_per_tet])
    }
}

/// The diagonals of one tet's octahedra.
#[derive(Clone, Copy, Debug)]
pub struct TetDiagonals<'a>(&'a [u8]);

impl TetDiagonals<'_> {
    /// The diagonal (0 to 2) of an octahedron of the tet.
    #[inline]
    pub fn get(self, octahedron: u32) -> u8 {
        get(self.0, octahedron)
    }
}

/// The diagonal of an octahedron in packed diagonals.
#[inline]
pub fn get(bytes: &[u8], octahedron: u32) -> u8 {
    bytes[octahedron as usize / 4] >> (octahedron % 4 * 2) & 3
}

/// Replaces the diagonal of an octahedron.
pub fn replace(bytes: &mut [u8], octahedron: u32, diagonal: u8) {
    bytes[octahedron as usize / 4] &= !(3 << (octahedron % 4 * 2));
    set(bytes, octahedron, diagonal);
}

/// Sets the diagonal of an octahedron. The bits must be zero before.
#[inline]
pub fn set(bytes: &mut [u8], octahedron: u32, diagonal: u8) {
    bytes[octahedron as usize / 4] |= diagonal << (octahedron % 4 * 2);
}

/// The best diagonal for all octahedra of an affine (uncurved) tet.
pub fn best_of_tet(corners: &[Coordinates; 4]) -> u8 {
    // Maps the corner code of an edge midpoint of the only octahedron of n = 2 to twice its
    // coordinates.
    let twice = |code: u8| {
        let [p, q] = match code {
            1 => [0, 1],
            2 => [0, 2],
            4 => [0, 3],
            3 => [1, 2],
            5 => [1, 3],
            _ => [2, 3],
        };
        [0, 1, 2].map(|x| corners[p][x] + corners[q][x])
    };
    best(
        OCTAHEDRON.map(|children| {
            children.iter().map(|child| shape(child.map(twice))).fold(f64::INFINITY, f64::min)
        }),
    )
}

/// The diagonal with the largest worst shape, the lowest number on ties.
#[inline]
pub fn best(worst: [f64; 3]) -> u8 {
    let mut best = 0;
    for diagonal in [1, 2] {
        if worst[usize::from(diagonal)] > worst[usize::from(best)] {
            best = diagonal;
        }
    }
    best
}

/// (6V)²/(Σ edge²)³ with the sign of the volume; increases with the mean ratio.
#[inline]
pub fn shape([a, b, c, d]: [Coordinates; 4]) -> f64 {
    let minus = |p: Coordinates, q: Coordinates| [p[0] - q[0], p[1] - q[1], p[2] - q[2]];
    let square = |p: Coordinates| p[0] * p[0] + p[1] * p[1] + p[2] * p[2];
    let [u, v, w] = [minus(b, a), minus(c, a), minus(d, a)];
    let volume = u[0] * (v[1] * w[2] - v[2] * w[1])
        + u[1] * (v[2] * w[0] - v[0] * w[2])
        + u[2] * (v[0] * w[1] - v[1] * w[0]);
    let squares =
        square(u) + square(v) + square(w) + square(minus(v, u)) + square(minus(w, u)) + square(minus(w, v));
    volume * volume.abs() / (squares * squares * squares)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn diagonals_are_kept_in_two_bits_each() {
        let mut diagonals = Diagonals::new(2, 5).unwrap();
        let of = |octahedron: u32| (octahedron % 3) as u8;
        let bytes_per_tet = diagonals.bytes_per_tet();
        let second = &mut diagonals.bytes_mut()[bytes_per_tet..];
        (0..5).for_each(|octahedron| set(second, octahedron, of(octahedron)));
        for octahedron in 0..5 {
            assert_eq!(diagonals.of_tet(0).get(octahedron), 0);
            assert_eq!(diagonals.of_tet(1).get(octahedron), of(octahedron));
        }
    }

    #[test]
    fn the_best_diagonal_of_a_stretched_octahedron_is_its_shortest() {
        // Edges 01 and 23 nearly touch, so their midpoints give the shortest diagonal. Permuting
        // the corners permutes the diagonals.
        let tet = [[-1.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.4], [0.0, -1.0, 0.4]];
        assert_eq!(best_of_tet(&tet), 0);
        assert_eq!(best_of_tet(&[tet[0], tet[2], tet[3], tet[1]]), 2);
        assert_eq!(best_of_tet(&[tet[0], tet[3], tet[1], tet[2]]), 1);
    }
}
