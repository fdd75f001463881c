//! How much of a cut fits into a message.

use super::Region;
use crate::ground::comm::{CommError, Communicator};
use crate::ground::mesh::stream::{LocalBlock, MeshStream};
use rayon::prelude::*;

/// The number of windows that are tried.
const WINDOWS: usize = 256;

/// **Collective.** The region with the largest window about the same middle in which at most `most`
/// tets of some parts meet the cutter. It is the same on all ranks.
///
/// The tets of stored parts cannot be replaced by larger ones as those of a lattice.
///
/// # Errors
/// If the ranks cannot communicate.
pub fn fitting(
    comm: &dyn Communicator,
    streams: &[&dyn MeshStream],
    region: &Region,
    most: u64,
) -> Result<Region, CommError> {
    let mut counts = [0; WINDOWS + 1];
    for stream in streams {
        let found = counts_of(*stream, region);
        counts = std::array::from_fn(|k| counts[k] + found[k]);
    }
    let counts = comm.all_reduce_sum_u64(counts)?;
    let sums = counts.iter().scan(0, |sum, count| {
        *sum += count;
        Some(*sum)
    });
    let fitting = sums.take_while(|sum| *sum <= most).count();
    if fitting > WINDOWS {
        return Ok(*region);
    }
    // Half a step below the last window that fits: rounding adds no tets.
    Ok(region.shrunk((fitting as f64 - 1.5).max(0.0) / WINDOWS as f64))
}

/// The number of tets that meet the cutter from each window on, and not in smaller ones.
type Counts = [u64; WINDOWS + 1];

fn counts_of(stream: &dyn MeshStream, region: &Region) -> Counts {
    type Reading = (Counts, LocalBlock, Vec<[f64; 3]>);
    let read = |(mut counts, mut block, mut points): Reading, index: usize| {
        stream.local_block(index, &mut block);
        stream.block_points(&block, &mut points);
        for tet in &block.tets.tets {
            let corners = tet.map(|k| points[k as usize]);
            if region.meets(&corners) {
                let window = (region.least_factor(&corners) * WINDOWS as f64).ceil();
                counts[(window as usize).min(WINDOWS)] += 1;
            }
        }
        (counts, block, points)
    };
    let start = || ([0; WINDOWS + 1], LocalBlock::default(), Vec::new());
    let counts = (0..stream.tet_blocks()).into_par_iter().fold(start, read).map(|(counts, ..)| counts);
    counts.reduce(|| [0; WINDOWS + 1], |a, b| std::array::from_fn(|k| a[k] + b[k]))
}

#[cfg(test)]
mod tests {
    use super::super::{Cutter, Fill, part};
    use super::*;
    use crate::files::plain::PlainPart;
    use crate::files::testing::{cube, slabs, together};

    #[test]
    fn a_window_with_too_many_tets_shrinks_on_all_ranks_alike() {
        let mesh = cube(12);
        let cutter = Cutter::Plane { normal: [1.0, 0.0, 0.0], offset: 1.9 };
        let region = Region { cutter, low: [0.0; 3], high: [4.0; 3] };
        let results = together(3, |comm| {
            let stream = PlainPart::part(&mesh, &slabs(&mesh, 3), 3, comm.rank());
            let all = part(&stream, Fill::Near { region, most: 10_000 }).tets.len();
            let of = |most| {
                let window = fitting(comm, &[&stream], &region, most).unwrap();
                (part(&stream, Fill::Near { region: window, most }).tets.len(), window)
            };
            (all, of(250), of(10_000), of(0))
        });
        let sum = |count: &dyn Fn(usize) -> usize| (0..3).map(count).sum::<usize>();
        assert!(sum(&|k| results[k].0) > 800);
        let some = sum(&|k| results[k].1.0);
        assert!((150..=250).contains(&some), "{some}");
        assert_eq!(results[0].1.1, results[2].1.1);
        assert_eq!(sum(&|k| results[k].2.0), sum(&|k| results[k].0), "all fit");
        let middle = results[0].3.1;
        assert_eq!((middle.low, middle.high), ([2.0; 3], [2.0; 3]));
    }
}
