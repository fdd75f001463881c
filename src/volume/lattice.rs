//! Points of a body-centred cubic lattice, wherever the wanted size is level.
//!
//! The Delaunay tets of this lattice (Sommerville 1923) fill space in one shape, with dihedral angles of 60 and 90 degrees and a
//! mean ratio of 0.952; cut in eight, such a tet has children of its own shape only, which even the regular one has
//! not. No front reaches that inside: its layers never quite fit, so that it leaves slivers everywhere. So where the
//! size is the same over a region, lattice points go in first, and the front has only to fill the gap between them and the
//! boundary (as in Fuchs 1998; Labelle, Shewchuk 2007 cut the lattice at the boundary instead, which moves it).
//!
//! On the skins of the cube, torus and shaft of 200,000 tets this brings the 1st percentile of the dihedral angles from 13
//! to 20 and 26 degrees and the mean of the mean ratios from 0.86 to 0.90 and 0.92, before any improvement. One or two layers of the
//! front first, then the lattice, gave less: a worse gap farther in.

use super::cavity::{Walk, walk};
use super::points::Filler;
use crate::kernel::hilbert::random_rounds;
use crate::kernel::random::mix;
use crate::kernel::simplex::{area_vector, volume};
use crate::mesh::TET_FACES;
use crate::{Point, Vector};
use rayon::prelude::*;

/// The side of the lattice's cube for the size 1: 2^(1/6), so that its tets have the volume of a regular tet of edge 1.
const SIDE: f64 = 1.122_462_048_309_373;

/// Sizes differ by up to this factor, either way, from the one that a lattice is for.
const LEVEL: f64 = 1.1;

/// A size is worth a lattice where this part of all tets will have it. Of a graded field one step of [`LEVEL`] may hold a fifth,
/// in shells that are too thin: with a share of 0.2, tutorials of NETGEN (manyholes, torus) lose half a degree at the 1st
/// percentile, with 0.4 none does.
const LEAST_SHARE: f64 = 0.4;

/// Lattices at most: so many can have such a share.
const MOST_LATTICES: usize = 2;

/// A size is worth a lattice from this number of tets on: in the sphere of the tutorials, of 100 tets, two lattice points do harm;
/// in its ellipsoid, of 600, eighty bring a degree.
const LEAST_TETS: f64 = 300.0;

/// A lattice is made if there are up to this many times its points in all the space that is to be filled.
const PATIENCE: f64 = 50.0;

/// Lattice points are moved at random by this part of the side: far less than shapes feel, far more than the filter of
/// the in-sphere test needs. Else a lattice that is half there has thousands of exact ties, each of which needs an exact determinant.
const JITTER: f64 = 1e-4;

/// A size and the number of tets that will have about this size.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Plateau {
    size: f64,
    tets: f64,
}

/// A point that may be inserted.
struct Candidate {
    point: Point,
    /// The wanted size there.
    size: f64,
    /// A vertex that sees the point.
    vertex: u32,
}

impl Filler<'_> {
    /// Adds the points of a lattice for each size that a large part of the bodies has.
    pub(super) fn add_lattices(&mut self) {
        let coarse = self.coarse_tets();
        let mut samples: Vec<Plateau> = coarse.iter().map(|&t| self.sample(t)).collect();
        let total: f64 = samples.iter().map(|s| s.tets).sum();
        let space: f64 = coarse.iter().map(|&t| self.volume(t)).sum();
        if self.stops() || total > self.limits.max_tets as f64 {
            // The front will find out whether there are really too many.
            return;
        }
        samples.sort_unstable_by(|a, b| a.size.total_cmp(&b.size));
        for _ in 0..MOST_LATTICES {
            let plateau = widest_plateau(&samples);
            if plateau.tets < LEAST_TETS.max(LEAST_SHARE * total) {
                return;
            }
            samples.retain(|s| !is_level(s.size, plateau.size));
            // Looking at lattice points where the size is another is in vain: a part of the time that the front takes for a
            // point, but for a size that is wanted in a small place only it would be thousands of times that.
            if tets_of_size(space, plateau.size) < PATIENCE * plateau.tets {
                let candidates = self.candidates(&self.coarse_tets(), plateau.size);
                self.add_candidates(&candidates);
            }
        }
    }

    /// The tets that are larger than wanted.
    fn coarse_tets(&self) -> Vec<u32> {
        self.mesh.alive().filter(|&t| !self.is_fine(t)).collect()
    }

    /// The size in the middle of a tet, and how many tets of that size would fill it.
    fn sample(&mut self, t: u32) -> Plateau {
        let [a, b, c, d] = self.mesh.corners(t);
        let middle = Point::from((a.coords + b.coords + c.coords + d.coords) * 0.25);
        let size = self.size_near(t, &middle);
        self.note_size(&middle, size);
        Plateau { size, tets: tets_of_size(self.volume(t), size) }
    }

    fn volume(&self, t: u32) -> f64 {
        let [a, b, c, d] = self.mesh.corners(t);
        volume(a, b, c, d)
    }

    /// The lattice points inside some tets where the size is the plateau's, in the order of the tets.
    fn candidates(&self, tets: &[u32], plateau: f64) -> Vec<Candidate> {
        /// Tets that one task looks through.
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

    /// Inserts points under the filter of the front, in random rounds along the Hilbert curve: cavities are smaller so, and a sixth
    /// less is to be done than along the curve at once.
    fn add_candidates(&mut self, candidates: &[Candidate]) {
        let points: Vec<Point> = candidates.iter().map(|c| c.point).collect();
        let order = random_rounds(&points);
        drop(points);
        let mut last = None;
        for i in order {
            if self.stops() {
                return;
            }
            let Candidate { point, size, vertex } = candidates[i as usize];
            // From the last point it is a few steps, unless the boundary lies between.
            let starts = [last, Some(self.mesh.at_vertex[vertex as usize])];
            let seed = starts.into_iter().flatten().find_map(|from| match walk(self.mesh, from, &point) {
                Walk::Inside(t) => Some(t),
                Walk::Blocked(_) => None,
            });
            let Some(seed) = seed else { continue };
            let size = self.grown_size(seed, &point, size);
            if self.insert(seed, point, size) {
                last = self.cavity.filled.first().copied();
            }
        }
    }
}

/// The samples within a factor of [`LEVEL`] that make the most tets: their sum, and the size at the middle of it. The samples
/// are in ascending order.
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

/// How many tets of the lattice for a size fill a volume.
fn tets_of_size(volume: f64, size: f64) -> f64 {
    12.0 * volume / (SIDE * size).powi(3)
}

fn is_level(size: f64, plateau: f64) -> bool {
    size <= LEVEL * plateau && plateau <= LEVEL * size
}

/// The lattice points inside a tet, line by line. On its faces rounding decides: such a point may be found in both tets, and is
/// refused the second time, or in none, which leaves it to the front.
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
    // The corners of the cubes, then their middles.
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

/// The standard functions are calls on processors of the oldest kind, and these are half of the search.
fn floor(x: f64) -> i64 {
    let whole = x as i64;
    whole - i64::from(whole as f64 > x)
}

fn ceil(x: f64) -> i64 {
    -floor(-x)
}

/// The part of a line parallel to the x axis that is behind all planes.
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

/// The point in or at a cube of the lattice, moved a little.
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
        // Off the lattice's planes, so that none lies on a face of the cube.
        let at = |bits: usize| {
            Point::new((bits & 1) as f64, (bits >> 1 & 1) as f64, (bits >> 2) as f64) + Vector::repeat(0.05)
        };
        let mut found = Vec::new();
        for [a, b] in [[1, 3], [3, 2], [2, 6], [6, 4], [4, 5], [5, 1]] {
            let tet = [0, a, b, 7].map(at);
            assert!(volume(&tet[0], &tet[1], &tet[2], &tet[3]) > 0.0);
            lattice_points(tet.each_ref(), 0.2, &mut found);
        }
        // 5³ corners and 5³ middles; the jitter moves some of them to either side of inner faces, none is lost but by rounding.
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
