//! Points of a body-centred cubic lattice in regions of constant size.
//!
//! The Delaunay tets of this lattice (Sommerville 1923) all have one shape, with dihedral angles of
//! 60 and 90 degrees and a mean ratio of 0.952. Cut in eight, such a tet has only children of its
//! own shape, unlike the regular tet. An advancing front does not reach this quality: its layers
//! never fit exactly, so it leaves slivers everywhere. So in regions of constant size lattice
//! points are inserted first, and the front fills the gap between them and the boundary (as in
//! Fuchs 1998; Labelle, Shewchuk 2007 instead cut the lattice at the boundary, which changes the
//! boundary).
//!
//! On surfaces of a cube, a torus and a shaft of 200,000 tets this raises the 1st percentile of the
//! dihedral angles from 13 to at least 20 degrees before any improvement. One or two front layers
//! before the lattice give less, because the gap is only farther inside.

use super::candidates::Candidate;
use super::points::Filler;
use crate::ground::kernel::random::mix;
use crate::ground::kernel::simplex::{area_vector, volume};
use crate::ground::mesh::TET_FACES;
use crate::{Point, Vector};
use rayon::prelude::*;

/// Cube side of the lattice for size 1: 2^(1/6), so that its tets have the volume of a regular tet
/// of edge 1.
const SIDE: f64 = 1.122_462_048_309_373;

/// Largest ratio between a size and the size of its lattice, in both directions.
const LEVEL: f64 = 1.1;

/// Least fraction of all tets that a lattice must provide.
///
/// One step of [`LEVEL`] in a graded size field can hold a fifth of the tets, in shells too thin
/// for a lattice: with 0.2 some tutorials of NETGEN lose half a degree at the 1st percentile, with
/// 0.4 none does.
const LEAST_SHARE: f64 = 0.4;

/// The most lattices: more cannot reach [`LEAST_SHARE`].
const MOST_LATTICES: usize = 2;

/// Least number of tets for a lattice: at 100 tets (NETGEN's sphere) two lattice points do harm, at
/// 600 (its ellipsoid) eighty gain a degree.
const LEAST_TETS: f64 = 300.0;

/// A lattice is generated only if all space to be filled holds at most this many times its useful
/// points.
const PATIENCE: f64 = 50.0;

/// Random displacement of lattice points, as a fraction of the side.
///
/// It is too small to affect shapes and large enough for the floating-point filter of the in-sphere
/// test. Without it a partly inserted lattice has thousands of cospherical ties, each of which
/// needs an exact determinant.
const JITTER: f64 = 1e-4;

/// A size, and the number of tets of about this size.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Plateau {
    size: f64,
    pub tets: f64,
}

impl Filler<'_> {
    /// Inserts a lattice for each size that a large fraction of the tets has.
    pub(super) fn add_lattices(&mut self) {
        let coarse = self.coarse_tets();
        let mut samples: Vec<Plateau> = coarse.par_iter().map(|&t| self.sample(t)).collect();
        for (&t, sample) in coarse.iter().zip(&samples) {
            self.note_size(&self.mesh.centroid(t), sample.size);
        }
        let total: f64 = samples.iter().map(|s| s.tets).sum();
        let space: f64 = coarse.iter().map(|&t| self.volume(t)).sum();
        if self.stops() || total > self.limits.max_tets as f64 {
            // The front decides whether there are really too many.
            return;
        }
        samples.sort_unstable_by(|a, b| a.size.total_cmp(&b.size));
        for _ in 0..MOST_LATTICES {
            let plateau = widest_plateau(&samples);
            if plateau.tets < LEAST_TETS.max(LEAST_SHARE * total) {
                return;
            }
            samples.retain(|s| !is_level(s.size, plateau.size));
            // Testing lattice points in regions of another size is wasted time: little per point,
            // but a size requested in a small region only would have thousands of useless points.
            if tets_of_size(space, plateau.size) < PATIENCE * plateau.tets {
                let candidates = self.candidates(&self.coarse_tets(), plateau.size);
                self.add_candidates(candidates);
            }
        }
    }

    /// The tets that are larger than the wanted size.
    pub(super) fn coarse_tets(&self) -> Vec<u32> {
        let is_coarse = |&t: &u32| self.mesh.is_alive(t) && !self.is_fine(t);
        (0..self.mesh.tets.len() as u32).into_par_iter().filter(is_coarse).collect()
    }

    /// The size at the centroid of a tet, and how many tets of that size fill it.
    pub(super) fn sample(&self, t: u32) -> Plateau {
        let size = self.size_near(t, &self.mesh.centroid(t));
        Plateau { size, tets: tets_of_size(self.volume(t), size) }
    }

    fn volume(&self, t: u32) -> f64 {
        let [a, b, c, d] = self.mesh.corners(t);
        volume(a, b, c, d)
    }

    /// The lattice points inside some tets at which the size is the plateau's, in the order of the
    /// tets.
    fn candidates(&self, tets: &[u32], plateau: f64) -> Vec<Candidate> {
        /// Tets per parallel task.
        const CHUNK: usize = 512;
        let in_chunk = |chunk: &[u32]| {
            let (mut found, mut points) = (Vec::new(), Vec::new());
            for &t in chunk {
                points.clear();
                lattice_points(self.mesh.corners(t), SIDE * plateau, &mut points);
                let vertex = self.mesh.tets[t as usize][0];
                for &point in &points {
                    let size = self.size_near(t, &point);
                    if is_level(size, plateau) {
                        found.push(Candidate { point, size, vertex });
                    }
                }
            }
            found
        };
        let found: Vec<Vec<Candidate>> = tets.par_chunks(CHUNK).map(in_chunk).collect();
        found.into_iter().flatten().collect()
    }
}

/// The window of samples within a factor of [`LEVEL`] with the most tets: their sum and their
/// median size. Samples are ascending by size.
fn widest_plateau(samples: &[Plateau]) -> Plateau {
    let mut best = Plateau { size: 1.0, tets: 0.0 };
    let (mut first, mut sum) = (0, 0.0);
    let mut range = 0..0;
    for (last, sample) in samples.iter().enumerate() {
        sum += sample.tets;
        while samples[first].size * LEVEL < sample.size {
            sum -= samples[first].tets;
            first += 1;
        }
        if sum > best.tets {
            best.tets = sum;
            range = first..last + 1;
        }
    }
    let mut before = 0.0;
    for sample in &samples[range] {
        before += sample.tets;
        if before >= 0.5 * best.tets {
            best.size = sample.size;
            break;
        }
    }
    best
}

/// The number of tets of the lattice for a size that fill a volume.
fn tets_of_size(volume: f64, size: f64) -> f64 {
    12.0 * volume / (SIDE * size).powi(3)
}

fn is_level(size: f64, plateau: f64) -> bool {
    size <= LEVEL * plateau && plateau <= LEVEL * size
}

/// Appends the lattice points inside a tet, line by line.
///
/// Rounding decides for points on its faces: such a point may be found in both tets, and is
/// rejected the second time, or in neither, and the front fills the place.
fn lattice_points(corners: [&Point; 4], side: f64, found: &mut Vec<Point>) {
    let planes = TET_FACES.map(|face| {
        let [a, b, c] = face.map(|i| corners[i]);
        let outward = area_vector(a, b, c);
        (outward, outward.dot(&a.coords))
    });
    let (mut low, mut high) = (*corners[0], *corners[0]);
    for p in corners {
        (low, high) = (low.inf(p), high.sup(p));
    }
    // The corners of the cubes, then their centres.
    for shift in [0.0, 0.5] {
        let index = |x: f64| x / side - shift;
        for k in ceil(index(low.z))..=floor(index(high.z)) {
            for j in ceil(index(low.y))..=floor(index(high.y)) {
                let [y, z] = [j, k].map(|i| (i as f64 + shift) * side);
                let Some([from, to]) = clip(&planes, y, z, [low.x, high.x]) else { continue };
                for i in ceil(index(from))..=floor(index(to)) {
                    found.push(jittered([i, j, k], shift, side));
                }
            }
        }
    }
}

/// `f64::floor` as an integer. The standard function is a call on baseline x86-64, and rounding is
/// half of the search.
fn floor(x: f64) -> i64 {
    let whole = x as i64;
    whole - i64::from(whole as f64 > x)
}

fn ceil(x: f64) -> i64 {
    -floor(-x)
}

/// The interval of a line parallel to the x axis that is behind all planes.
fn clip(planes: &[(Vector, f64); 4], y: f64, z: f64, [mut from, mut to]: [f64; 2]) -> Option<[f64; 2]> {
    for (normal, offset) in planes {
        let rest = offset - normal.y * y - normal.z * z;
        if normal.x > 0.0 {
            to = to.min(rest / normal.x);
        } else if normal.x < 0.0 {
            from = from.max(rest / normal.x);
        } else if rest < 0.0 {
            return None;
        }
    }
    (from <= to).then_some([from, to])
}

/// The corner or centre of a lattice cube, displaced by [`JITTER`].
fn jittered(cube: [i64; 3], shift: f64, side: f64) -> Point {
    let mut bits = u64::from(shift > 0.0);
    Point::from(cube.map(|i| {
        bits = mix(bits ^ i as u64);
        let unit = (bits >> 11) as f64 / (1u64 << 53) as f64;
        (i as f64 + shift + JITTER * (unit - 0.5)) * side
    }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_lattice_point_of_a_cube_is_found_in_one_of_its_tets() {
        // Shifted, so that no lattice point lies on a face of the cube.
        let at = |bits: usize| {
            Point::new((bits & 1) as f64, (bits >> 1 & 1) as f64, (bits >> 2) as f64) + Vector::repeat(0.05)
        };
        let mut found = Vec::new();
        for [a, b] in [[1, 3], [3, 2], [2, 6], [6, 4], [4, 5], [5, 1]] {
            let tet = [0, a, b, 7].map(at);
            assert!(volume(&tet[0], &tet[1], &tet[2], &tet[3]) > 0.0);
            lattice_points(tet.each_ref(), 0.2, &mut found);
        }
        // 5³ corners and 5³ centres; the jitter moves some across inner faces, but none is lost.
        let mut cells: Vec<[i64; 3]> =
            found.iter().map(|p| [p.x, p.y, p.z].map(|x| (x / 0.1).round() as i64)).collect();
        cells.sort_unstable();
        cells.dedup();
        assert_eq!(cells.len(), 250);
    }

    #[test]
    fn the_widest_plateau_has_the_most_tets_not_the_most_samples() {
        let samples = [
            (1.0, 5.0),
            (1.05, 5.0),
            (2.0, 1.0),
            (2.0, 1.0),
            (2.0, 1.0),
            (3.0, 20.0),
            (3.2, 1.0),
            (9.0, 8.0),
        ]
        .map(|(size, tets)| Plateau { size, tets });
        assert_eq!(widest_plateau(&samples), Plateau { size: 3.0, tets: 21.0 });
        assert_eq!(widest_plateau(&[]).tets, 0.0);
    }
}
