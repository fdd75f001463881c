//! Pieces between planes of a grid, for geometries that are periodic in several directions.
//!
//! A tree of planes cuts on one side of a plane where it does not on the other. If periodic faces
//! are on one side and their copies on the other, it cannot cut them any more. Planes of a grid cut
//! all that they meet.

use super::CutStatistics;
use super::cuts::{Cuts, Half};
use super::periodic::{PeriodicWithin, grid_normals};
use super::plan::{Piece, PlanSettings};
use super::scan::Scan;

/// Grids of this many shapes are compared.
const MOST_SHAPES: usize = 6;

/// The pieces of a grid, the better the smaller `settings.seed`; `None` without suitable planes, or
/// if one of the pieces would have nothing to mesh.
pub(super) fn grid(statistics: &CutStatistics, parts: u32, settings: &PlanSettings) -> Option<Cuts> {
    let normals = grid_normals(&statistics.periodic);
    let whole = Piece::whole(statistics, parts);
    if whole.samples.len() < 2 * parts as usize {
        return None;
    }
    let scans: Vec<Scan> = normals.iter().map(|normal| Scan::new(&whole.samples, *normal)).collect();
    // The number of samples that a plane in the middle cuts.
    let middles: Vec<usize> = scans.iter().map(|scan| scan.met_by(&scan.places(0.5, 0.0)[0]).len()).collect();
    let mut shapes = factors(parts, normals.len());
    shapes.sort_by_key(|counts| {
        counts.iter().zip(&middles).map(|(&count, cut)| (count as usize - 1) * cut).sum::<usize>()
    });
    shapes.truncate(MOST_SHAPES);
    let make = |counts: &Vec<u32>| Shape { whole: &whole, scans: &scans, counts }.cuts(statistics, settings);
    let mut grids: Vec<(f64, Cuts)> = shapes.iter().filter_map(make).collect();
    grids.sort_by(|a, b| a.0.total_cmp(&b.0));
    let at = settings.seed as usize;
    (at < grids.len()).then(|| grids.swap_remove(at).1)
}

/// A grid with so many layers in each direction.
struct Shape<'a> {
    whole: &'a Piece<'a>,
    scans: &'a [Scan<'a>],
    counts: &'a [u32],
}

impl Shape<'_> {
    /// The cost and the pieces.
    fn cuts(&self, statistics: &CutStatistics, settings: &PlanSettings) -> Option<(f64, Cuts)> {
        let everywhere = PeriodicWithin::new(&statistics.periodic, &[], &[], settings.together);
        let mut cuts = Cuts { planes: Vec::new(), leaves: vec![Vec::new()] };
        let mut costs = 0.0;
        for (scan, &count) in self.scans.iter().zip(self.counts) {
            let first = cuts.planes.len();
            for k in 1..count {
                let width = 1.0 / f64::from(count);
                let share = (f64::from(k) * width, width);
                let (cost, plane) =
                    self.whole.best_of_scan(scan, share, &cuts, (statistics, &everywhere), settings)?;
                costs += cost;
                cuts.planes.push(plane);
            }
            let layer = |k: usize| {
                let above = (k > 0).then(|| Half { plane: first + k - 1, positive: true });
                let below = (k + 1 < count as usize).then_some(Half { plane: first + k, positive: false });
                above.into_iter().chain(below).collect::<Vec<_>>()
            };
            let layers: Vec<Vec<Half>> = (0..count as usize).map(layer).collect();
            let with =
                |leaf: &Vec<Half>| layers.iter().map(|layer| [&leaf[..], layer].concat()).collect::<Vec<_>>();
            cuts.leaves = cuts.leaves.iter().flat_map(with).collect();
        }
        let mut samples = vec![0_usize; cuts.leaves.len()];
        self.whole.samples.iter().for_each(|sample| samples[cuts.leaf_of(&sample.point)] += 1);
        samples.iter().all(|&count| count > 0).then_some((costs, cuts))
    }
}

/// All ways to write a number as a product of so many factors, in order.
fn factors(number: u32, count: usize) -> Vec<Vec<u32>> {
    match count {
        0 => Vec::new(),
        1 => vec![vec![number]],
        _ => {
            let divides = (1..=number).filter(|first| number.is_multiple_of(*first));
            let with = |first: u32| {
                factors(number / first, count - 1).into_iter().map(move |rest| [vec![first], rest].concat())
            };
            divides.flat_map(with).collect()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::factors;

    #[test]
    fn factors_multiply_to_the_number() {
        assert_eq!(factors(4, 2), [[1, 4], [2, 2], [4, 1]]);
        assert_eq!(factors(7, 3).len(), 3);
        assert!(factors(12, 3).iter().all(|all| all.iter().product::<u32>() == 12));
        assert!(factors(5, 0).is_empty());
    }
}
