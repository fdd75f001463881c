//! Where each tet stands along a Hilbert curve through the centres of all: a parallel sort by samples.
//!
//! Each rank sends its tets' keys to the ranks that sort stretches of the curve (their limits are chosen from samples: Shi and Schaeffer
//! 1992), which answer with places. 16 bytes a tet go and 8 come, whatever the number of ranks.

use crate::Vector;
use crate::comm::{CommError, Communicator};
use crate::kernel::hilbert::hilbert_key;
use crate::mesh::{GlobalId, Rank};

/// Keys that each rank gives for each rank to choose limits from: stretches are then equal to some tens of percent, which matters
/// for the balance of this sort alone, not for its result.
const SAMPLES: usize = 32;

/// The most that a coordinate of a key can be.
const MOST: f64 = ((1u32 << 21) - 1) as f64;

/// The centre of a tet, times four.
pub fn center(corners: [&Vector; 4]) -> [f64; 3] {
    let sum = |axis: usize| corners[0][axis] + corners[1][axis] + corners[2][axis] + corners[3][axis];
    [sum(0), sum(1), sum(2)]
}

/// A place on the curve: the key of its cell, then the id of the tet, by which no two are equal.
type Key = [u64; 2];

/// **Collective.** The places, from 0, of this rank's tets in the order of all tets along the curve.
///
/// # Errors
/// If another rank fails.
pub fn places(
    comm: &dyn Communicator,
    centers: impl Iterator<Item = [f64; 3]> + Clone,
    ids: &[GlobalId],
) -> Result<Vec<u64>, CommError> {
    let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    for center in centers.clone() {
        low = [0, 1, 2].map(|k| low[k].min(center[k]));
        high = [0, 1, 2].map(|k| high[k].max(center[k]));
    }
    let (low, high) = (comm.all_reduce_min_f64(low)?, comm.all_reduce_max_f64(high)?);
    let side = (0..3).map(|k| high[k] - low[k]).fold(0.0, f64::max);
    let scale = if side > 0.0 { MOST / side } else { 0.0 };
    let key = |center: [f64; 3]| hilbert_key([0, 1, 2].map(|k| ((center[k] - low[k]) * scale) as u32));
    let mut keys: Vec<(Key, u32)> =
        centers.zip(ids).zip(0..).map(|((center, &id), local)| ([key(center), id], local)).collect();
    keys.sort_unstable();

    let limits = limits(comm, &keys)?;
    let sorter = |key: &Key| limits.partition_point(|limit| limit <= key) as Rank;
    let mut letters: Vec<(Rank, Vec<Key>)> = Vec::new();
    for run in keys.chunk_by(|a, b| sorter(&a.0) == sorter(&b.0)) {
        letters.push((sorter(&run[0].0), run.iter().map(|(key, _)| *key).collect()));
    }
    let answers = comm.exchange(sorted(comm, &comm.exchange(letters)?)?)?;
    // Ranks that sort later stretches answer later: in the order in which the keys were sent.
    let mut places = vec![0; keys.len()];
    for ((_, local), place) in keys.iter().zip(answers.into_iter().flat_map(|(_, places)| places)) {
        places[*local as usize] = place;
    }
    Ok(places)
}

/// Where the stretches of all ranks but the first begin.
fn limits(comm: &dyn Communicator, keys: &[(Key, u32)]) -> Result<Vec<Key>, CommError> {
    let ranks = comm.size() as usize;
    let wanted = (SAMPLES * ranks).min(keys.len());
    let samples: Vec<Key> = (0..wanted).map(|k| keys[k * keys.len() / wanted].0).collect();
    // A sample stands for as many keys as its rank has for each: ranks with few tets count for little.
    let weight = keys.len() as u64 / wanted.max(1) as u64;
    let weighted: Vec<[u64; 3]> = samples.iter().map(|&[key, id]| [key, id, weight]).collect();
    let mut all = comm.all_gather(&weighted)?.concat();
    all.sort_unstable();
    let total: u64 = all.iter().map(|sample| sample[2]).sum();
    let (mut limits, mut before) = (Vec::with_capacity(ranks - 1), 0);
    for [key, id, weight] in all {
        before += weight;
        while limits.len() + 1 < ranks && before * ranks as u64 > (limits.len() as u64 + 1) * total {
            limits.push([key, id]);
        }
    }
    Ok(limits)
}

/// Sorts the keys that came, and answers each sender with their places in its order.
fn sorted(comm: &dyn Communicator, came: &[(Rank, Vec<Key>)]) -> Result<Vec<(Rank, Vec<u64>)>, CommError> {
    let count: usize = came.iter().map(|(_, keys)| keys.len()).sum();
    let [first] = comm.exclusive_scan([count as u64])?;
    let mut all: Vec<(Key, u32)> = Vec::with_capacity(count);
    for (sender, (_, keys)) in (0..).zip(came) {
        all.extend(keys.iter().map(|&key| (key, sender)));
    }
    // Each sender's keys ascend: the stable sort merges such runs.
    all.sort();
    let mut answers: Vec<(Rank, Vec<u64>)> =
        came.iter().map(|(from, keys)| (*from, Vec::with_capacity(keys.len()))).collect();
    for (place, (_, sender)) in (first..).zip(&all) {
        answers[*sender as usize].1.push(place);
    }
    Ok(answers)
}

/// Equal stretches of the curve: parts whose sizes differ by one tet at most.
pub fn stretches(places: &[u64], tets: u64, parts: u32) -> Vec<Rank> {
    let part = |place: u64| (u128::from(place) * u128::from(parts) / u128::from(tets)) as Rank;
    places.iter().map(|&place| part(place)).collect()
}
