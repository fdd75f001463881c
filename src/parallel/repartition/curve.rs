//! Positions of tets along a Hilbert curve through all centroids, by a parallel sample sort.
//!
//! Each rank sends the keys and weights of its tets to the ranks that sort the respective segments
//! of the curve (whose limits are chosen from samples: Shi and Schaeffer 1992). These reply with
//! the positions. 24 bytes per tet are sent and 8 received, whatever the number of ranks.

use crate::ground::comm::{CommError, Communicator};
use crate::ground::kernel::hilbert::hilbert_key;
use crate::ground::mesh::{GlobalId, Rank};

/// Sample keys per rank and segment. Segments are then equal to some tens of percent, which affects
/// only the balance of this sort, not its result.
const SAMPLES: usize = 32;

/// The largest coordinate of a key.
const MOST: f64 = ((1u32 << 21) - 1) as f64;

/// The centroid of a tet, times four.
pub fn center(corners: [&[f64; 3]; 4]) -> [f64; 3] {
    let sum = |axis: usize| corners[0][axis] + corners[1][axis] + corners[2][axis] + corners[3][axis];
    [sum(0), sum(1), sum(2)]
}

/// A position on the curve: the key of its cell, then the tet id, which makes keys distinct.
type Key = [u64; 2];

/// **Collective.** For each local tet, the total weight of all tets before it on the curve; with
/// weights of 1, its position from 0.
///
/// # Errors
/// [`CommError`] if another rank fails.
pub fn places(
    comm: &dyn Communicator,
    centers: impl Iterator<Item = [f64; 3]> + Clone,
    ids: &[GlobalId],
    weight: impl Fn(usize) -> u64,
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
    let mut messages: Vec<(Rank, Vec<[u64; 3]>)> = Vec::new();
    for run in keys.chunk_by(|a, b| sorter(&a.0) == sorter(&b.0)) {
        let weighted = run.iter().map(|&([key, id], local)| [key, id, weight(local as usize)]);
        messages.push((sorter(&run[0].0), weighted.collect()));
    }
    let answers = comm.exchange(sorted(comm, &comm.exchange(messages)?)?)?;
    // Replies arrive by ascending rank, which is the order in which the keys were sent.
    let mut places = vec![0; keys.len()];
    for ((_, local), place) in keys.iter().zip(answers.into_iter().flat_map(|(_, places)| places)) {
        places[*local as usize] = place;
    }
    Ok(places)
}

/// The starts of the segments of all ranks but the first.
fn limits(comm: &dyn Communicator, keys: &[(Key, u32)]) -> Result<Vec<Key>, CommError> {
    let ranks = comm.size() as usize;
    let wanted = (SAMPLES * ranks).min(keys.len());
    let samples: Vec<Key> = (0..wanted).map(|k| keys[k * keys.len() / wanted].0).collect();
    // The weight of a sample is the number of keys it represents, so ranks with few tets have
    // little influence.
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

/// Sorts the received keys, and replies to each sender with the weight before each of its keys, in
/// its order.
fn sorted(
    comm: &dyn Communicator,
    came: &[(Rank, Vec<[u64; 3]>)],
) -> Result<Vec<(Rank, Vec<u64>)>, CommError> {
    let count: usize = came.iter().map(|(_, keys)| keys.len()).sum();
    let weight: u64 = came.iter().flat_map(|(_, keys)| keys).map(|key| key[2]).sum();
    let [mut before] = comm.exclusive_scan([weight])?;
    let mut all: Vec<([u64; 3], u32)> = Vec::with_capacity(count);
    for (sender, (_, keys)) in (0..).zip(came) {
        all.extend(keys.iter().map(|&key| (key, sender)));
    }
    // Each sender's keys ascend: the stable sort merges such runs.
    all.sort();
    let mut answers: Vec<(Rank, Vec<u64>)> =
        came.iter().map(|(from, keys)| (*from, Vec::with_capacity(keys.len()))).collect();
    for ([.., weight], sender) in &all {
        answers[*sender as usize].1.push(before);
        before += weight;
    }
    Ok(answers)
}

/// The part of each position on a curve of that length, cut into equal segments.
pub fn stretches(places: impl Iterator<Item = u64>, length: u64, parts: u32) -> Vec<Rank> {
    let part = |place: u64| (u128::from(place) * u128::from(parts) / u128::from(length.max(1))) as Rank;
    places.map(|place| part(place).min(parts - 1)).collect()
}
