//! The edge lengths that filled parts have, relative to the sizes that were wanted.

use super::{Filled, PartSizes, Skin};
use crate::Point;
use crate::ground::comm::{CommError, Communicator};
use crate::ground::mesh::TET_EDGES;
use crate::ground::size::SizeField;

/// Edge lengths divided by the size field at the middles of the edges, over the edges of every k-th
/// tet of each part.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct DeliveredSizes {
    /// The mean ratio.
    pub mean: f64,
    /// The 5th percentile of the ratios, to a hundredth of its value.
    pub low: f64,
    /// The 95th percentile of the ratios, to a hundredth of its value.
    pub high: f64,
}

/// Classes of ratios, each wider by a hundredth than the one before; the middle one begins at 1.
const CLASSES: usize = 1024;
const STEP: f64 = 0.01;
const MIDDLE: f64 = (CLASSES / 2) as f64;

/// About as many tets of each part are measured; each edge needs a search in the coarse mesh.
const SAMPLES: usize = 2_000;

/// **Collective.** Measures the edges of filled parts; `None` if no part has tets.
///
/// # Errors
/// [`CommError`] if another rank fails.
pub fn delivered(
    comm: &dyn Communicator,
    skin: &Skin,
    filled: &Filled,
    sizes: &PartSizes,
) -> Result<Option<DeliveredSizes>, CommError> {
    let inside = |v: usize| Point::from(filled.inside[v - skin.points.len()]);
    let point = |v: u32| skin.points.get(v as usize).copied().unwrap_or_else(|| inside(v as usize));
    let class = |ratio: f64| (ratio.ln() / STEP + MIDDLE).clamp(0.0, (CLASSES - 1) as f64) as usize;
    let (mut sum, mut counts) = (0.0, [0; CLASSES]);
    for tet in filled.tets.iter().step_by((filled.tets.len() / SAMPLES).max(1)) {
        for [p, q] in TET_EDGES.map(|edge| edge.map(|k| point(tet[k]))) {
            let ratio = (p - q).norm() / sizes.size_at(&nalgebra::center(&p, &q));
            sum += ratio;
            counts[class(ratio)] += 1;
        }
    }
    let counts = comm.all_reduce_sum_u64(counts)?;
    let sum: f64 = comm.all_gather_one(sum)?.into_iter().sum();
    let total: u64 = counts.iter().sum();
    let percentile = |percent: u64| {
        let mut below = 0;
        let at = counts.iter().position(|count| {
            below += count;
            below * 100 >= percent * total
        });
        ((at.unwrap_or(0) as f64 + 0.5 - MIDDLE) * STEP).exp()
    };
    let made = DeliveredSizes { mean: sum / total as f64, low: percentile(5), high: percentile(95) };
    Ok((total > 0).then_some(made))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ground::comm::thread;
    use crate::ground::mesh::VertexId;

    /// A corner of a cube: three edges of length 1, three of √2.
    #[test]
    fn edges_are_measured_by_the_sizes_at_their_middles() {
        let points = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(Point::from).to_vec();
        let corners = [0, 1, 2, 3];
        let skin = Skin { points: points.clone(), ..Skin::default() };
        let filled = Filled { tets: vec![corners], ..Filled::default() };
        let made = |size: f64| {
            let sizes = PartSizes::new(points.clone(), vec![corners.map(VertexId)], vec![size; 4]);
            delivered(&thread::alone(), &skin, &filled, &sizes).unwrap().unwrap()
        };
        for size in [1.0, 0.25] {
            let made = made(size);
            assert!((made.mean * size - (1.0 + 2_f64.sqrt()) / 2.0).abs() < 1e-12, "{made:?}");
            assert!((made.low * size - 1.0).abs() < 0.01, "{made:?}");
            assert!((made.high * size - 2_f64.sqrt()).abs() < 0.015, "{made:?}");
        }
        let sizes = PartSizes::new(points.clone(), vec![corners.map(VertexId)], vec![1.0; 4]);
        assert_eq!(delivered(&thread::alone(), &skin, &Filled::default(), &sizes), Ok(None));
    }
}
