//! Recursive coordinate bisection (Berger and Bokhari 1987): each box is cut across its longest
//! side so that the weights of the two sides are proportional to the numbers of parts they will
//! contain.
//!
//! ```text
//!     ┌─────┬───┐    All boxes of a level are cut at once. The cut is the key (coordinate, id) below which
//!     │  ┌──┤   │    the target weight lies. It is found by a search with fifteen pivots a round, for which
//!     ├──┤  ├───┤    the ranks sum the weights below each pivot. Only these sums are sent, and they are
//!     │  │  │   │    integers, so the parts do not depend on the distribution.
//!     └──┴──┴───┘
//! ```

use super::metrics::reduce_by_part;
use crate::ground::comm::{CommError, Communicator};
use crate::ground::mesh::{GlobalId, Rank};
use rayon::prelude::*;

/// Pivots per round: each round narrows the range of a group to a sixteenth.
const PIVOTS: usize = 15;

/// The position of a tet along an axis: the coordinate as an order-preserving integer, then the id,
/// which makes keys distinct.
type Key = u128;

fn key(coordinate: f64, id: GlobalId) -> Key {
    Key::from(ordered(coordinate)) << 64 | Key::from(id)
}

/// An integer that orders like the coordinate.
fn ordered(coordinate: f64) -> u64 {
    let bits = coordinate.to_bits();
    if bits >> 63 == 0 { bits | 1 << 63 } else { !bits }
}

/// The inverse of [`ordered`].
fn coordinate(ordered: u64) -> f64 {
    f64::from_bits(if ordered >> 63 == 1 { ordered & !(1 << 63) } else { !ordered })
}

/// A group of parts that are not separated yet, with the local tets in it.
struct Group {
    first: Rank,
    parts: u32,
    tets: Vec<u32>,
}

/// The local keys of a group along its axis, ascending, the weights before each, and the range that
/// contains the cut.
struct Search {
    keys: Vec<(Key, u32)>,
    /// One more entry than `keys`.
    before: Vec<u64>,
    /// The weight below the cut is the largest possible that is not above this.
    target: u64,
    range: [Key; 2],
}

/// **Collective.** A part (below `parts`) for each point, balanced by weight; with equal weights
/// parts differ by one point at most.
///
/// # Errors
/// [`CommError`] if another rank fails.
pub fn bisect(
    comm: &dyn Communicator,
    centers: &[[f64; 3]],
    ids: &[GlobalId],
    weights: &[u64],
    parts: u32,
) -> Result<Vec<Rank>, CommError> {
    let mut part = vec![0; centers.len()];
    let mut groups = vec![Group { first: 0, parts, tets: (0..centers.len() as u32).collect() }];
    while !groups.is_empty() {
        let (done, open): (Vec<Group>, Vec<Group>) = groups.into_iter().partition(|group| group.parts == 1);
        for group in done {
            group.tets.iter().for_each(|&tet| part[tet as usize] = group.first);
        }
        let axes = longest_sides(comm, centers, &open)?;
        let totals = totals(comm, weights, &open)?;
        let mut searches: Vec<Search> = open
            .iter()
            .zip(axes.into_iter().zip(totals))
            .map(|(group, (axis, total))| {
                Search::new(group, total, |tet| key(centers[tet][axis], ids[tet]), weights)
            })
            .collect();
        while searches.iter().any(|search| search.range[1] - search.range[0] > 1) {
            narrow(comm, &mut searches)?;
        }
        groups = open.into_iter().zip(searches).flat_map(|(group, search)| group.cut(&search)).collect();
    }
    Ok(part)
}

/// **Collective.** The axis along which each group is longest; the first on ties.
fn longest_sides(
    comm: &dyn Communicator,
    centers: &[[f64; 3]],
    groups: &[Group],
) -> Result<Vec<usize>, CommError> {
    // The minimum of each coordinate, and the minimum of its complement in place of the maximum.
    let nothing = [u64::MAX; 6];
    let fold = |all: &mut [u64; 6], more: [u64; 6]| {
        all.iter_mut().zip(more).for_each(|(least, other)| *least = other.min(*least));
    };
    let bounds = |group: &Group| {
        group.tets.iter().fold(nothing, |mut bounds, &tet| {
            let low = centers[tet as usize].map(ordered);
            fold(&mut bounds, [low[0], low[1], low[2], !low[0], !low[1], !low[2]]);
            bounds
        })
    };
    let mine: Vec<[u64; 6]> = groups.par_iter().map(bounds).collect();
    let longest = |bounds: [u64; 6]| {
        let extent = |axis: usize| coordinate(!bounds[axis + 3]) - coordinate(bounds[axis]);
        (1..3).fold(0, |best, axis| if extent(axis) > extent(best) { axis } else { best })
    };
    Ok(reduce_by_part(comm, &mine, nothing, fold)?.into_iter().map(longest).collect())
}

/// **Collective.** The weight of each group.
fn totals(comm: &dyn Communicator, weights: &[u64], groups: &[Group]) -> Result<Vec<u64>, CommError> {
    let sum = |group: &Group| [group.tets.iter().map(|&tet| weights[tet as usize]).sum()];
    let mine: Vec<[u64; 1]> = groups.iter().map(sum).collect();
    Ok(reduce_by_part(comm, &mine, [0], add)?.into_iter().map(|[sum]| sum).collect())
}

fn add<const N: usize>(sums: &mut [u64; N], more: [u64; N]) {
    sums.iter_mut().zip(more).for_each(|(sum, other)| *sum += other);
}

/// **Collective.** One round of all searches.
fn narrow(comm: &dyn Communicator, searches: &mut [Search]) -> Result<(), CommError> {
    let mine: Vec<[u64; PIVOTS]> =
        searches.par_iter().map(|s| s.pivots().map(|pivot| s.below(pivot))).collect();
    let below = reduce_by_part(comm, &mine, [0; PIVOTS], add)?;
    for (search, below) in searches.iter_mut().zip(below) {
        let pivots = search.pivots();
        // The weights below the pivots ascend.
        let fit = below.partition_point(|&weight| weight <= search.target);
        search.range = [
            if fit == 0 { search.range[0] } else { pivots[fit - 1] },
            if fit == PIVOTS { search.range[1] } else { pivots[fit] },
        ];
    }
    Ok(())
}

impl Search {
    fn new(group: &Group, total: u64, key: impl Fn(usize) -> Key + Sync, weights: &[u64]) -> Self {
        let mut keys: Vec<(Key, u32)> = group.tets.par_iter().map(|&tet| (key(tet as usize), tet)).collect();
        keys.par_sort_unstable();
        let mut before = Vec::with_capacity(keys.len() + 1);
        before.push(0);
        let mut sum = 0;
        for (_, tet) in &keys {
            sum += weights[*tet as usize];
            before.push(sum);
        }
        let target = u128::from(total) * u128::from(group.parts / 2) / u128::from(group.parts);
        Self { keys, before, target: target as u64, range: [0, Key::MAX] }
    }

    /// Keys that divide the range into equal steps.
    fn pivots(&self) -> [Key; PIVOTS] {
        let [low, high] = self.range;
        let (step, rest) = ((high - low) / (PIVOTS as Key + 1), (high - low) % (PIVOTS as Key + 1));
        std::array::from_fn(|k| {
            let k = k as Key + 1;
            low + k * step + k * rest / (PIVOTS as Key + 1)
        })
    }

    /// The weight of the local tets below a key.
    fn below(&self, limit: Key) -> u64 {
        self.before[self.keys.partition_point(|(key, _)| *key < limit)]
    }
}

impl Group {
    fn cut(self, search: &Search) -> [Self; 2] {
        let place = search.keys.partition_point(|(key, _)| *key < search.range[0]);
        let tets = |keys: &[(Key, u32)]| keys.iter().map(|(_, tet)| *tet).collect();
        let (low, high) = search.keys.split_at(place);
        let less = self.parts / 2;
        [
            Self { first: self.first, parts: less, tets: tets(low) },
            Self { first: self.first + less, parts: self.parts - less, tets: tets(high) },
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ground::comm::thread;

    #[test]
    fn keys_are_in_the_order_of_coordinates() {
        let coordinates = [f64::MIN, -1.5, -1e-300, 0.0, 1e-300, 2.0, f64::MAX];
        assert!(coordinates.windows(2).all(|pair| ordered(pair[0]) < ordered(pair[1])));
        assert!(coordinates.iter().all(|&x| coordinate(ordered(x)) == x));
        assert!(key(1.0, 7) < key(1.0, 8) && key(1.0, 8) < key(1.5, 0));
    }

    #[test]
    fn a_row_of_points_is_cut_by_weight() {
        // Weights 1 to 8 along y, in any order on three ranks: 18 of 36 is the target; below the
        // sixth point there are 15, above it 21.
        let order = [4_u64, 0, 7, 2, 5, 1, 6, 3];
        let parts = thread::run(3, |comm| {
            let mine: Vec<u64> = order.into_iter().filter(|k| k % 3 == u64::from(comm.rank())).collect();
            let centers: Vec<[f64; 3]> = mine.iter().map(|&k| [0.5, k as f64 - 3.0, 0.0]).collect();
            let weights: Vec<u64> = mine.iter().map(|k| k + 1).collect();
            let part = bisect(comm, &centers, &mine, &weights, 2).unwrap();
            mine.into_iter().zip(part).collect::<Vec<_>>()
        });
        let mut all = parts.unwrap().concat();
        all.sort_unstable();
        let part: Vec<Rank> = all.into_iter().map(|(_, part)| part).collect();
        assert_eq!(part, [0, 0, 0, 0, 0, 1, 1, 1]);
    }
}
