//! Quality of a partition of a distributed mesh.

use super::neighbours::Neighbours;
use crate::ground::comm::{CommError, Communicator};
use crate::ground::mesh::{Rank, VertexId};
use crate::parallel::distribution::{BareMesh, owner};
use std::collections::BTreeMap;

/// Quality of a partition, the same on all ranks.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Metrics {
    /// The number of parts.
    pub parts: u32,
    /// Tets in the smallest part.
    pub smallest: u64,
    /// Tets in the largest part.
    pub largest: u64,
    /// Tets in the largest part over the mean: 1 is perfect.
    pub imbalance: f64,
    /// Faces between parts.
    pub edge_cut: u64,
    /// Vertices in more than one part, counted once.
    pub shared_vertices: u64,
    /// The largest number of parts that one part shares vertices with.
    pub most_neighbours: u32,
    /// The mean number of parts that a part shares vertices with.
    pub mean_neighbours: f64,
    /// Tets assigned to another rank than the current one.
    pub moving: u64,
}

/// **Collective.** Measures the partition that assigns each local tet to the part in `part`.
///
/// # Errors
/// [`CommError`] if another rank fails.
///
/// # Panics
/// If `part` does not have one entry below `parts` per tet.
pub fn measure(
    comm: &dyn Communicator,
    mesh: &BareMesh,
    neighbours: &Neighbours,
    part: &[Rank],
    parts: u32,
) -> Result<Metrics, CommError> {
    assert_eq!(part.len(), mesh.tets.len(), "rank {}: expected one part per tet", mesh.rank);
    let mut sizes = vec![0u64; parts as usize];
    part.iter().for_each(|&p| sizes[p as usize] += 1);
    let sizes = sum_by_part(comm, &sizes)?;
    let mut cut = 0;
    neighbours.across_faces(comm, part, |a, b| cut += u64::from(a != b))?;
    let moving = part.iter().filter(|&&p| p != mesh.rank).count() as u64;
    let (shared, mut pairs) = pairs_at_vertices(comm, mesh, part)?;
    let [edge_cut, moving, shared_vertices] = comm.all_reduce_sum_u64([cut, moving, shared])?;
    pairs = comm.all_gather(&pairs)?.concat();
    pairs.sort_unstable();
    pairs.dedup();
    let mut neighbours = vec![0u32; parts as usize];
    pairs.iter().flatten().for_each(|&p| neighbours[p as usize] += 1);
    let largest = sizes.iter().copied().max().unwrap_or(0);
    Ok(Metrics {
        parts,
        smallest: sizes.iter().copied().min().unwrap_or(0),
        largest,
        imbalance: largest as f64 * f64::from(parts) / mesh.totals.tets.max(1) as f64,
        edge_cut,
        shared_vertices,
        most_neighbours: neighbours.iter().copied().max().unwrap_or(0),
        mean_neighbours: 2.0 * pairs.len() as f64 / f64::from(parts.max(1)),
        moving,
    })
}

/// **Collective.** The sums of `mine` over the ranks, by part.
pub(super) fn sum_by_part(comm: &dyn Communicator, mine: &[u64]) -> Result<Vec<u64>, CommError> {
    let mine: Vec<[u64; 1]> = mine.iter().map(|&count| [count]).collect();
    let sums = reduce_by_part(comm, &mine, [0], |sum, more| sum[0] += more[0])?;
    Ok(sums.into_iter().map(|[sum]| sum).collect())
}

/// **Collective.** Reduces `mine` over the ranks, by part, with `fold`, whose identity is
/// `nothing`. Efficient if most ranks have data of few parts only.
pub(super) fn reduce_by_part<const N: usize>(
    comm: &dyn Communicator,
    mine: &[[u64; N]],
    nothing: [u64; N],
    fold: impl Fn(&mut [u64; N], [u64; N]),
) -> Result<Vec<[u64; N]>, CommError> {
    let (parts, ranks) = (mine.len(), comm.size() as usize);
    // The directory ranks of parts are assigned in blocks.
    let block = parts.div_ceil(ranks);
    // Each part number is followed by its values.
    let mut messages: Vec<(Rank, Vec<u64>)> = Vec::new();
    for (part, words) in mine.iter().enumerate().filter(|(_, words)| **words != nothing) {
        let directory_rank = (part / block) as Rank;
        if messages.last().is_none_or(|(to, _)| *to != directory_rank) {
            messages.push((directory_rank, Vec::new()));
        }
        let message = &mut messages.last_mut().expect("a message was pushed above").1;
        message.push(part as u64);
        message.extend(words);
    }
    let first = (comm.rank() as usize * block).min(parts);
    let mut all = vec![nothing; block.min(parts - first)];
    for (_, message) in comm.exchange(messages)? {
        for entry in message.chunks_exact(1 + N) {
            let words = std::array::from_fn(|k| entry[1 + k]);
            fold(&mut all[entry[0] as usize - first], words);
        }
    }
    let words: Vec<u64> = all.concat();
    let all = comm.all_gather(&words)?.concat();
    Ok(all.chunks_exact(N).map(|words| std::array::from_fn(|k| words[k])).collect())
}

/// **Collective.** The number of vertices owned by this rank that are in several parts, and the
/// distinct pairs of parts that share one.
fn pairs_at_vertices(
    comm: &dyn Communicator,
    mesh: &BareMesh,
    part: &[Rank],
) -> Result<(u64, Vec<[Rank; 2]>), CommError> {
    // The parts at vertices that may be in several: vertices with two parts on this rank, and
    // shared vertices.
    let mut first = vec![Rank::MAX; mesh.points.len()];
    let mut wanted = vec![false; mesh.points.len()];
    mesh.shared.ids.iter().for_each(|&v| wanted[v as usize] = true);
    let uses = || mesh.tets.iter().zip(part).flat_map(|(tet, &p)| tet.iter().map(move |&v| (v, p)));
    for (VertexId(v), p) in uses() {
        let known = &mut first[v as usize];
        if *known == Rank::MAX {
            *known = p;
        }
        wanted[v as usize] |= *known != p;
    }
    let mut at: Vec<(u32, Rank)> =
        uses().map(|(v, p)| (v.0, p)).filter(|(v, _)| wanted[*v as usize]).collect();
    at.sort_unstable();
    at.dedup();

    // Each owner receives the parts from all ranks.
    let mut messages: BTreeMap<Rank, Vec<[u64; 2]>> = BTreeMap::new();
    let mut known: Vec<[u64; 2]> = Vec::new();
    let mut shared = mesh.shared.ids.iter().copied().zip(0..).peekable();
    for (v, p) in at {
        let id = mesh.vertex_ids[v as usize];
        while shared.next_if(|(shared, _)| *shared < v).is_some() {}
        let to = match shared.peek() {
            Some(&(of, place)) if of == v => owner(mesh.shared.holders_at(place), id),
            _ => mesh.rank,
        };
        let list = if to == mesh.rank { &mut known } else { messages.entry(to).or_default() };
        list.push([id, p.into()]);
    }
    let received = comm.exchange(messages.into_iter().collect())?;
    known.extend(received.into_iter().flat_map(|(_, list)| list));
    known.sort_unstable();
    known.dedup();
    let (mut count, mut pairs, mut room) = (0, Vec::new(), 1 << 16);
    for of_vertex in known.chunk_by(|a, b| a[0] == b[0]).filter(|parts| parts.len() > 1) {
        count += 1;
        for (k, [_, p]) in of_vertex.iter().enumerate() {
            pairs.extend(of_vertex[k + 1..].iter().map(|[_, q]| [*p as Rank, *q as Rank]));
        }
        // Most pairs are duplicates: remove them before the list grows too long.
        if pairs.len() > room {
            pairs.sort_unstable();
            pairs.dedup();
            room = room.max(2 * pairs.len());
        }
    }
    pairs.sort_unstable();
    pairs.dedup();
    Ok((count, pairs))
}
