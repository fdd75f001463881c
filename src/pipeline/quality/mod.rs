//! Measures the tets of a mesh with the quality measures of several programs.
//!
//! [`measure`] reads every tet once with many threads and sums over fixed chunks, so the numbers do
//! not depend on the number of threads. [`table`] compares several meshes, [`histograms`] draws
//! them. A tet that is not positively oriented counts as **inverted**: its smallest angle is 0°,
//! its largest 180°, and its badness NETGEN's largest.

mod svg;
mod table;
#[cfg(test)]
mod tests;

pub use svg::histograms;
pub use table::table;

use crate::Point;
use crate::files::volume::VolumeMesh;
use crate::ground::kernel::jacobian;
use crate::ground::kernel::predicates::{Sign, orient3d};
use crate::ground::kernel::quality::{mean_ratio, squared_lengths};
use crate::ground::kernel::simplex::{dihedral_angles, volume};
use crate::ground::mesh::{Mesh, VertexId};
use rayon::prelude::*;
use serde::Serialize;

/// Classes of [`Quality::smallest_dihedral_histogram`] and [`Quality::largest_dihedral_histogram`].
pub const ANGLE_CLASSES: usize = 36;
/// Width of these classes, degrees.
pub const ANGLE_STEP: f64 = 5.0;
/// Classes of [`Quality::badness_histogram`].
pub const BADNESS_CLASSES: usize = 20;
/// The badness of a flat or inverted tet in NETGEN.
pub const WORST_BADNESS: f64 = 1e24;

/// Quality of the tets of a mesh. The keys of its JSON form are stable: new ones may be added.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Quality {
    /// The mesh, named by its file.
    pub mesh: String,
    /// Vertices.
    pub vertices: usize,
    /// Tets.
    pub tets: usize,
    /// Triangles on patches.
    pub boundary: usize,
    /// Bodies.
    pub bodies: usize,
    /// Volume; negative for inverted tets.
    pub volume: f64,
    /// Volume of each body.
    pub body_volumes: Vec<f64>,
    /// Tets that are not positively oriented, by their corners.
    pub inverted: usize,
    /// The order of the elements: 1, or 2 for ten-node tets. Angles, ratios and badness are those
    /// of the corners.
    pub order: u32,
    /// Tets of second order whose Jacobian determinant is not proved positive; null for order 1.
    pub not_valid: Option<usize>,
    /// A lower bound of the scaled Jacobian, the ratio of the smallest determinant of a tet to the
    /// largest; null for order 1.
    pub scaled_jacobian: Option<f64>,
    /// The smallest dihedral angle, degrees.
    pub smallest_dihedral: f64,
    /// The 1st percentile of each tet's smallest dihedral angle, degrees.
    pub first_percentile_dihedral: f64,
    /// The 5th percentile of each tet's smallest dihedral angle, degrees.
    pub fifth_percentile_dihedral: f64,
    /// The median of each tet's smallest dihedral angle, degrees.
    pub median_dihedral: f64,
    /// The mean of each tet's smallest dihedral angle, degrees.
    pub mean_dihedral: f64,
    /// The largest dihedral angle, degrees.
    pub largest_dihedral: f64,
    /// The least mean ratio: 1 for the regular tet, negative for inverted ones.
    pub worst_mean_ratio: f64,
    /// The mean of the mean ratios.
    pub mean_mean_ratio: f64,
    /// The largest ratio of circumradius and shortest edge among tets that are not inverted; 0.612
    /// for the regular tet.
    pub worst_radius_edge: f64,
    /// NETGEN's badness, summed over all tets: 1 for the regular tet.
    pub total_badness: f64,
    /// The mean of NETGEN's badness.
    pub mean_badness: f64,
    /// The largest badness.
    pub worst_badness: f64,
    /// Tets by 1/badness in 20 classes of 0.05, as NETGEN counts them.
    pub badness_histogram: Vec<usize>,
    /// Tets by their smallest dihedral angle, in classes of 5 degrees from 0.
    pub smallest_dihedral_histogram: Vec<usize>,
    /// Repairs, additions and omissions of the reader.
    pub largest_dihedral_histogram: Vec<usize>,
    /// What the reader mended, added or left out.
    pub notes: Vec<String>,
}

/// NETGEN's badness Q^(3/2) / V with the sum of squared edge lengths Q, scaled to 1 for the regular
/// tet (`CalcTetBadness` without size term).
pub fn netgen_badness(p: &[Point; 4]) -> f64 {
    /// √216 / (6⁴ √2): the regular tet of edge 1 has Q = 6 and V = √2 / 12.
    const SCALE: f64 = 0.008_018_753_738_744_795;
    /// Volumes below this times Q^(3/2) count as zero.
    const FLAT: f64 = 1e-24;
    let [a, b, c, d] = p;
    let volume = volume(a, b, c, d);
    let squares: f64 = squared_lengths(p).iter().sum();
    let cube = squares * squares.sqrt();
    if volume > FLAT * cube { SCALE * cube / volume } else { WORST_BADNESS }
}

/// The ratio of circumradius and shortest edge.
pub fn radius_edge_ratio(p: &[Point; 4]) -> f64 {
    let [u, v, w] = [p[1] - p[0], p[2] - p[0], p[3] - p[0]];
    let to_centre =
        u.norm_squared() * v.cross(&w) + v.norm_squared() * w.cross(&u) + w.norm_squared() * u.cross(&v);
    let radius = to_centre.norm() / (2.0 * u.cross(&v).dot(&w).abs());
    let shortest = squared_lengths(p).into_iter().fold(f64::INFINITY, f64::min).sqrt();
    radius / shortest
}

/// Tets measured by one task: fixed, so that sums do not depend on the number of threads.
const CHUNK: usize = 4096;

/// Statistics of some tets, which can be merged.
struct Part {
    smallest: Vec<f64>,
    body_volumes: Vec<f64>,
    inverted: usize,
    largest_dihedral: f64,
    worst_ratio: f64,
    sum_ratio: f64,
    worst_radius_edge: f64,
    total_badness: f64,
    worst_badness: f64,
    badness_histogram: [usize; BADNESS_CLASSES],
    largest_histogram: [usize; ANGLE_CLASSES],
}

impl Part {
    fn new(bodies: usize) -> Self {
        Self {
            smallest: Vec::new(),
            body_volumes: vec![0.0; bodies],
            inverted: 0,
            largest_dihedral: 0.0,
            worst_ratio: f64::INFINITY,
            sum_ratio: 0.0,
            worst_radius_edge: 0.0,
            total_badness: 0.0,
            worst_badness: 0.0,
            badness_histogram: [0; BADNESS_CLASSES],
            largest_histogram: [0; ANGLE_CLASSES],
        }
    }

    fn add(&mut self, p: &[Point; 4], body: usize) {
        let [a, b, c, d] = p;
        self.body_volumes[body] += volume(a, b, c, d);
        let is_positive = orient3d(a, b, c, d) == Sign::Positive;
        let (smallest, largest) = if is_positive {
            let angles = dihedral_angles(p);
            self.worst_radius_edge = self.worst_radius_edge.max(radius_edge_ratio(p).min(f64::MAX));
            (angles.into_iter().fold(180.0, f64::min), angles.into_iter().fold(0.0, f64::max))
        } else {
            self.inverted += 1;
            (0.0, 180.0)
        };
        self.smallest.push(smallest);
        self.largest_dihedral = self.largest_dihedral.max(largest);
        self.largest_histogram[angle_class(largest)] += 1;
        let ratio = mean_ratio(a, b, c, d);
        self.worst_ratio = self.worst_ratio.min(ratio);
        self.sum_ratio += ratio;
        let badness = if is_positive { netgen_badness(p) } else { WORST_BADNESS };
        self.total_badness += badness;
        self.worst_badness = self.worst_badness.max(badness);
        let class = (BADNESS_CLASSES as f64 / badness + 1.0) as usize;
        self.badness_histogram[class.clamp(1, BADNESS_CLASSES) - 1] += 1;
    }

    fn join(&mut self, other: Self) {
        self.smallest.extend(other.smallest);
        self.body_volumes.iter_mut().zip(other.body_volumes).for_each(|(a, b)| *a += b);
        self.inverted += other.inverted;
        self.largest_dihedral = self.largest_dihedral.max(other.largest_dihedral);
        self.worst_ratio = self.worst_ratio.min(other.worst_ratio);
        self.sum_ratio += other.sum_ratio;
        self.worst_radius_edge = self.worst_radius_edge.max(other.worst_radius_edge);
        self.total_badness += other.total_badness;
        self.worst_badness = self.worst_badness.max(other.worst_badness);
        self.badness_histogram.iter_mut().zip(other.badness_histogram).for_each(|(a, b)| *a += b);
        self.largest_histogram.iter_mut().zip(other.largest_histogram).for_each(|(a, b)| *a += b);
    }
}

fn angle_class(degrees: f64) -> usize {
    ((degrees / ANGLE_STEP) as usize).min(ANGLE_CLASSES - 1)
}

impl Quality {
    /// Measures a mesh that was read, under the name of its file.
    pub fn of_file(name: impl Into<String>, read: &VolumeMesh) -> Self {
        let straight = Self { mesh: name.into(), notes: read.notes.clone(), ..measure(&read.mesh) };
        if read.edge_points.is_empty() { straight } else { straight.curved(read) }
    }

    /// Adds the measures of ten-node tets: their volumes are those of the curved tets.
    fn curved(mut self, read: &VolumeMesh) -> Self {
        let mesh = &read.mesh;
        let range = |(tet, edges): (&[VertexId; 4], &[[f64; 3]; 6])| {
            let [p, q, r, s] = tet.map(|v| mesh.points[v.index()].coords.into());
            let [a, b, c, d, e, f] = *edges;
            jacobian::range(&[p, q, r, s, a, b, c, d, e, f])
        };
        let ranges: Vec<jacobian::Range> = mesh.tets.par_iter().zip(&read.edge_points).map(range).collect();
        self.body_volumes.fill(0.0);
        for (range, body) in ranges.iter().zip(&mesh.bodies) {
            self.body_volumes[body.index()] += range.volume6 / 6.0;
        }
        self.volume = self.body_volumes.iter().sum();
        self.order = 2;
        self.not_valid = Some(ranges.iter().filter(|range| !range.is_positive()).count());
        self.scaled_jacobian = Some(ranges.iter().map(jacobian::Range::scaled).fold(1.0, f64::min));
        self
    }
}

/// Measures all tets of a mesh; without name and notes.
pub fn measure(mesh: &Mesh) -> Quality {
    let bodies = mesh.bodies.iter().map(|body| body.index() + 1).max().unwrap_or(0);
    let parts: Vec<Part> = mesh
        .tets
        .par_chunks(CHUNK)
        .zip(mesh.bodies.par_chunks(CHUNK))
        .map(|(tets, tet_bodies)| {
            let mut part = Part::new(bodies);
            for (tet, body) in tets.iter().zip(tet_bodies) {
                part.add(&tet.map(|v| mesh.points[v.index()]), body.index());
            }
            part
        })
        .collect();
    let mut all = Part::new(bodies);
    parts.into_iter().for_each(|part| all.join(part));
    let tets = all.smallest.len();
    let mean = |sum: f64| if tets > 0 { sum / tets as f64 } else { 0.0 };
    let mut smallest_dihedral_histogram = vec![0; ANGLE_CLASSES];
    all.smallest.iter().for_each(|&angle| smallest_dihedral_histogram[angle_class(angle)] += 1);
    let mean_dihedral = mean(all.smallest.iter().sum());
    all.smallest.par_sort_unstable_by(f64::total_cmp);
    // Nearest rank: the angle that this percentage of the tets does not exceed.
    let rank = |percent: usize| {
        let place = (tets * percent).div_ceil(100).max(1) - 1;
        all.smallest.get(place).copied().unwrap_or(0.0)
    };
    Quality {
        vertices: mesh.points.len(),
        tets,
        boundary: mesh.triangles.len(),
        bodies,
        volume: all.body_volumes.iter().sum(),
        inverted: all.inverted,
        order: 1,
        smallest_dihedral: rank(0),
        first_percentile_dihedral: rank(1),
        fifth_percentile_dihedral: rank(5),
        median_dihedral: rank(50),
        mean_dihedral,
        largest_dihedral: all.largest_dihedral,
        worst_mean_ratio: if tets > 0 { all.worst_ratio } else { 0.0 },
        mean_mean_ratio: mean(all.sum_ratio),
        worst_radius_edge: all.worst_radius_edge,
        total_badness: all.total_badness,
        mean_badness: mean(all.total_badness),
        worst_badness: all.worst_badness,
        badness_histogram: all.badness_histogram.to_vec(),
        smallest_dihedral_histogram,
        largest_dihedral_histogram: all.largest_histogram.to_vec(),
        body_volumes: all.body_volumes,
        ..Quality::default()
    }
}
