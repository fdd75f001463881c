//! Summary of the shapes of a mesh's tets.

use super::{Mesh, VertexId};
use crate::Point;
use crate::ground::kernel::quality::{Diagonal, squared_lengths, worst_child_squares};
use crate::ground::kernel::simplex::{dihedral_cosines, volume6};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::cmp::Ordering;

/// Shape statistics of a mesh's tets.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct QualitySummary {
    /// The number of tets.
    pub tets: usize,
    /// The smallest mean ratio; 0 without tets.
    pub worst_mean_ratio: f64,
    /// The mean of the mean ratios.
    pub average_mean_ratio: f64,
    /// The smallest mean ratio of all tets and of their children along the best diagonal.
    pub worst_refined: f64,
    /// The smallest dihedral angle, degrees; 0 if a tet is not positively oriented.
    pub smallest_dihedral: f64,
    /// The largest dihedral angle, degrees; 180 if a tet is not positively oriented.
    pub largest_dihedral: f64,
    /// The 1st percentile of the tets' smallest dihedral angles, degrees.
    pub first_percentile: f64,
    /// The median of the tets' smallest dihedral angles, degrees.
    pub median: f64,
    /// Tets by their smallest dihedral angle, in bins of 5 degrees from 0 (the regular tet has
    /// 70.5).
    pub histogram: Vec<usize>,
}

/// The width of a class of [`QualitySummary::histogram`], degrees.
pub const HISTOGRAM_STEP: f64 = 5.0;
/// Classes up to the regular tet's angle.
const HISTOGRAM_CLASSES: usize = 15;
/// Bins up to the angle of the regular tet.
const CHUNK: usize = 4096;

/// Sums of one chunk of tets.
struct Part {
    /// For each tet the cosine of its smallest angle. Cosines order angles, so few arc cosines are
    /// needed.
    largest_cosines: Vec<f64>,
    worst_ratio: f64,
    sum_ratio: f64,
    worst_refined: f64,
    least_cosine: f64,
    histogram: [usize; HISTOGRAM_CLASSES],
}

impl QualitySummary {
    /// Measures all tets of a mesh.
    pub fn of(mesh: &Mesh) -> Self {
        Self::of_tets(&mesh.points, &mesh.tets)
    }

    /// Measures tets over points.
    pub fn of_tets(points: &[Point], tets: &[[VertexId; 4]]) -> Self {
        let parts: Vec<Part> = tets.par_chunks(CHUNK).map(|chunk| measure(points, chunk)).collect();
        if parts.is_empty() {
            return Self { histogram: vec![0; HISTOGRAM_CLASSES], ..Self::default() };
        }
        let mut summary = Self {
            tets: tets.len(),
            worst_mean_ratio: f64::INFINITY,
            worst_refined: f64::INFINITY,
            histogram: vec![0; HISTOGRAM_CLASSES],
            ..Self::default()
        };
        let mut cosines = Vec::with_capacity(tets.len());
        let mut least_cosine = 1.0_f64;
        for part in parts {
            summary.worst_mean_ratio = summary.worst_mean_ratio.min(part.worst_ratio);
            summary.average_mean_ratio += part.sum_ratio / tets.len() as f64;
            summary.worst_refined = summary.worst_refined.min(part.worst_refined);
            least_cosine = least_cosine.min(part.least_cosine);
            summary.histogram.iter_mut().zip(part.histogram).for_each(|(sum, count)| *sum += count);
            cosines.extend(part.largest_cosines);
        }
        let angle = |cosine: f64| cosine.acos().to_degrees();
        summary.largest_dihedral = angle(least_cosine);
        // Nearest-rank percentile: `percent` percent of the tets do not exceed the angle.
        let mut rank = |percent: usize| {
            let k = (cosines.len() * percent).div_ceil(100).max(1) - 1;
            angle(*cosines.select_nth_unstable_by(k, |a, b| b.total_cmp(a)).1)
        };
        summary.smallest_dihedral = rank(0);
        summary.first_percentile = rank(1);
        summary.median = rank(50);
        summary
    }

    /// Compares two meshes: greater is the one with the larger smallest dihedral angle, or for
    /// equal angles the one with the smaller share of tets in the first bin that differs.
    pub(crate) fn compare_angles(&self, other: &Self) -> Ordering {
        let share = |bin: usize, of: &Self, total: &Self| of.histogram[bin] as u128 * total.tets as u128;
        let bins = 0..self.histogram.len().min(other.histogram.len());
        let by_bins = bins.map(|k| share(k, other, self).cmp(&share(k, self, other)));
        let by_angle = self.smallest_dihedral.total_cmp(&other.smallest_dihedral);
        by_angle.then_with(|| by_bins.fold(Ordering::Equal, Ordering::then))
    }
}

fn measure(points: &[Point], tets: &[[VertexId; 4]]) -> Part {
    let mut part = Part {
        largest_cosines: Vec::with_capacity(tets.len()),
        worst_ratio: f64::INFINITY,
        sum_ratio: 0.0,
        worst_refined: f64::INFINITY,
        least_cosine: 1.0,
        histogram: [0; HISTOGRAM_CLASSES],
    };
    let bounds: [f64; HISTOGRAM_CLASSES - 1] =
        std::array::from_fn(|k| ((k + 1) as f64 * HISTOGRAM_STEP).to_radians().cos());
    for tet in tets {
        let p = tet.map(|v| points[v.index()]);
        let squares = squared_lengths(&p);
        let v6 = volume6(&p[0], &p[1], &p[2], &p[3]);
        let scaled = 12.0 * (0.5 * v6.abs()).cbrt().powi(2).copysign(v6);
        let over = |sum: f64| if sum > 0.0 { scaled / sum } else { 0.0 };
        let ratio = over(squares.iter().sum());
        part.worst_ratio = part.worst_ratio.min(ratio);
        part.sum_ratio += ratio;
        let children = Diagonal::ALL.map(|d| worst_child_squares(&squares, d));
        part.worst_refined = part.worst_refined.min(over(children.into_iter().fold(f64::INFINITY, f64::min)));
        let cosines = if ratio > 0.0 { dihedral_cosines(&p) } else { [1.0, -1.0, 0.0, 0.0, 0.0, 0.0] };
        let largest = cosines.into_iter().fold(-1.0, f64::max);
        part.largest_cosines.push(largest);
        part.least_cosine = cosines.into_iter().fold(part.least_cosine, f64::min);
        part.histogram[bounds.iter().filter(|&&bound| largest <= bound).count()] += 1;
    }
    part
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ground::kernel::quality::mean_ratio;
    use crate::ground::kernel::simplex::dihedral_angles;

    #[test]
    fn the_smallest_angle_decides_which_mesh_is_better_and_then_the_share_of_small_angles() {
        let mesh = |smallest_dihedral: f64, histogram: &[usize]| QualitySummary {
            smallest_dihedral,
            tets: histogram.iter().sum(),
            histogram: histogram.to_vec(),
            ..QualitySummary::default()
        };
        let few_bad = mesh(7.0, &[0, 1, 99]);
        assert!(mesh(8.0, &[0, 60, 40]).compare_angles(&few_bad).is_gt());
        assert!(mesh(7.0, &[0, 2, 98]).compare_angles(&few_bad).is_lt());
        // The larger mesh has more small angles, but a smaller share of them.
        assert!(mesh(7.0, &[0, 2, 298]).compare_angles(&few_bad).is_gt());
        assert!(mesh(7.0, &[0, 2, 198]).compare_angles(&few_bad).is_eq());
    }

    #[test]
    fn a_summary_counts_every_tet_and_finds_the_worst() {
        let regular = [[1., 1., 1.], [-1., 1., -1.], [1., -1., -1.], [-1., -1., 1.]].map(Point::from);
        let flat = [[0., 0., 0.], [1., 0., 0.], [0., 1., 0.], [0.3, 0.3, 0.01]].map(Point::from);
        let points: Vec<Point> = regular.into_iter().chain(flat).collect();
        let tets = [[0, 1, 2, 3], [4, 5, 6, 7]].map(|t| t.map(VertexId));
        let summary = QualitySummary::of_tets(&points, &tets);
        assert_eq!(summary.tets, 2);
        assert_eq!(summary.histogram.iter().sum::<usize>(), 2);
        assert_eq!(summary.histogram[14], 1, "the regular tet");
        assert!(
            (summary.worst_mean_ratio - mean_ratio(&flat[0], &flat[1], &flat[2], &flat[3])).abs() < 1e-15
        );
        let expected = dihedral_angles(&flat).into_iter().fold(180.0, f64::min);
        assert_eq!(summary.smallest_dihedral, expected);
        assert_eq!(summary.first_percentile, expected);
        assert_eq!(QualitySummary::of_tets(&points, &[]).tets, 0);
    }
}
