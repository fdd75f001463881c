//! Replaces the old tets by the reworked ones and renumbers without gaps.

use super::rework::Reworked;
use crate::ground::comm::{CommError, Communicator};
use crate::ground::mesh::stream::Counts;
use crate::ground::mesh::{GlobalId, Rank, TetId, VertexId};
use crate::parallel::distribution::{BareMesh, ClassifiedEdge, Shared, Side, directory_rank};
use std::collections::BTreeMap;

/// **Collective.** The part with the reworked tets, and the rank that each tet goes to.
///
/// Ids of removed tets are reused on their rank; additional tets and vertices get the highest ids.
/// Remaining gaps are closed by moving all higher ids down, so the order of ids is kept.
///
/// # Errors
/// [`CommError`] if another rank fails.
pub(super) fn put_back(
    comm: &dyn Communicator,
    mut part: BareMesh,
    reworked: Reworked,
) -> Result<(BareMesh, Vec<Rank>), CommError> {
    let Reworked {
        tets,
        bodies,
        to: ranks,
        sides,
        replaced_tets,
        moved,
        removed,
        added,
        edges,
        removed_triangles,
        ..
    } = reworked;
    for (v, point, class) in moved {
        (part.points[v as usize], part.vertex_classes[v as usize]) = (point, class);
    }
    let reused = replaced_tets.len().min(tets.len());
    let left_over = &replaced_tets[reused..];
    let more = tets.len() - reused;
    let counts = [added.len() as u64, more as u64, removed_triangles];
    let before = comm.exclusive_scan(counts)?;
    let [more_vertices, more_tets, removed_triangles] = comm.all_reduce_sum_u64(counts)?;
    let gone_ids: Vec<GlobalId> = removed.iter().map(|&v| part.vertex_ids[v as usize]).collect();
    let left_ids: Vec<GlobalId> = left_over.iter().map(|&tet| part.tet_ids[tet as usize]).collect();

    // Tets: first in the positions of removed ones, then at the end.
    let places: Vec<u32> =
        replaced_tets[..reused].iter().copied().chain(part.tets.len() as u32..).take(tets.len()).collect();
    let mut is_taken = vec![false; part.tets.len() + more];
    replaced_tets.iter().for_each(|&tet| is_taken[tet as usize] = true);
    part.sides.retain(|side| !is_taken[side.tet.index()]);
    part.sides.extend(sides.into_iter().map(|side| Side { tet: TetId(places[side.tet.index()]), ..side }));
    part.sides.sort_unstable();
    let mut to = vec![part.rank; part.tets.len() + more];
    places.iter().zip(ranks).for_each(|(&place, rank)| to[place as usize] = rank);
    for (&place, (tet, body)) in places.iter().zip(tets.into_iter().zip(bodies)) {
        if (place as usize) < part.tets.len() {
            (part.tets[place as usize], part.tet_bodies[place as usize]) = (tet, body);
        } else {
            part.tets.push(tet);
            part.tet_bodies.push(body);
        }
    }
    part.tet_ids.extend((part.totals.tets + before[1]..).take(more));
    drop_tets(&mut part, &mut to, left_over);

    part.vertex_ids.extend((part.totals.vertices + before[0]..).take(added.len()));
    for (point, class) in added {
        part.points.push(point);
        part.vertex_classes.push(class);
    }
    replace_edges(&mut part, &removed, edges);
    drop_vertices(&mut part, &removed);

    let fewer_vertices = close_gaps(comm, &mut part.vertex_ids, &gone_ids, part.totals.vertices)?;
    let fewer_tets = close_gaps(comm, &mut part.tet_ids, &left_ids, part.totals.tets)?;
    part.totals = Counts {
        vertices: part.totals.vertices + more_vertices - fewer_vertices,
        tets: part.totals.tets + more_tets - fewer_tets,
        boundary: part.totals.boundary - removed_triangles,
    };
    Ok((part, to))
}

/// **Collective.** Lowers each of the ascending `ids` by the number of unused ids below it.
///
/// `unused` are the unused ids of this rank, all below `count`. Returns the number of those of all
/// ranks.
///
/// Each rank is the directory of a block of ids. It gets the unused ids there, and sends to each
/// rank those between the first and the last id that the rank has in the block. So messages do not
/// grow with the number of ranks.
fn close_gaps(
    comm: &dyn Communicator,
    ids: &mut [GlobalId],
    unused: &[GlobalId],
    count: u64,
) -> Result<u64, CommError> {
    /// The first and the last id of a rank that has none in a block.
    const NO_IDS: [GlobalId; 2] = [0, 0];
    let directory = |id: GlobalId| directory_rank(id, count, comm.size());
    let same_block = |a: &GlobalId, b: &GlobalId| directory(*a) == directory(*b);
    let (old, new) = ids.split_at_mut(ids.partition_point(|&id| id < count));
    let mut requests: BTreeMap<Rank, Vec<GlobalId>> = BTreeMap::new();
    for block in old.chunk_by(same_block) {
        requests.insert(directory(block[0]), vec![block[0], block[block.len() - 1]]);
    }
    for &id in unused {
        requests.entry(directory(id)).or_insert_with(|| NO_IDS.to_vec()).push(id);
    }

    let requests = comm.exchange::<GlobalId>(requests.into_iter().collect())?;
    let mut here: Vec<GlobalId> = requests.iter().flat_map(|(_, request)| &request[2..]).copied().collect();
    here.sort_unstable();
    let [before] = comm.exclusive_scan([here.len() as u64])?;
    let [all] = comm.all_reduce_sum_u64([here.len() as u64])?;
    let reply = |(from, request): &(Rank, Vec<GlobalId>)| {
        let [start, end] = [0, 1].map(|k| here.partition_point(|&id| id < request[k]));
        let below = before + start as u64;
        (*from, std::iter::once(below).chain(here[start..end].iter().copied()).collect())
    };
    let replies = comm.exchange::<GlobalId>(requests.iter().map(reply).collect())?;
    for block in old.chunk_by_mut(same_block) {
        let place = replies.binary_search_by_key(&directory(block[0]), |(from, _)| *from);
        let (before, between) = replies[place.expect("each directory rank replies")]
            .1
            .split_first()
            .expect("a reply has a number");
        let mut below = 0;
        for id in block {
            while between.get(below).is_some_and(|gap| gap < id) {
                below += 1;
            }
            *id -= before + below as u64;
        }
    }
    new.iter_mut().for_each(|id| *id -= all);
    Ok(all)
}

/// New positions after the removal of some (ascending), `u32::MAX` for the removed ones.
pub(super) fn places_without(count: usize, removed: &[u32]) -> Vec<u32> {
    let mut next = 0;
    let mut removed = removed.iter().peekable();
    let place = |old: u32| {
        if removed.next_if_eq(&&old).is_some() {
            return u32::MAX;
        }
        next += 1;
        next - 1
    };
    (0..count as u32).map(place).collect()
}

/// Retains the entries that have a new position.
pub(super) fn keep<T>(list: &mut Vec<T>, places: &[u32]) {
    let mut places = places.iter();
    list.retain(|_| places.next().is_some_and(|place| *place != u32::MAX));
}

fn drop_tets(part: &mut BareMesh, to: &mut Vec<Rank>, removed: &[u32]) {
    if removed.is_empty() {
        return;
    }
    let places = places_without(part.tets.len(), removed);
    keep(&mut part.tets, &places);
    keep(&mut part.tet_bodies, &places);
    keep(&mut part.tet_ids, &places);
    keep(to, &places);
    part.sides.iter_mut().for_each(|side| side.tet = TetId(places[side.tet.index()]));
}

/// Replaces the classified edges after removal of vertices.
fn replace_edges(part: &mut BareMesh, removed: &[u32], edges: Vec<ClassifiedEdge>) {
    if edges.is_empty() {
        return;
    }
    let is_gone = |v: &VertexId| removed.binary_search(&v.0).is_ok();
    part.edges.retain(|edge| !edge.vertices.iter().any(is_gone));
    part.edges.extend(edges);
    ClassifiedEdge::sort(&mut part.edges);
}

fn drop_vertices(part: &mut BareMesh, removed: &[u32]) {
    if removed.is_empty() {
        return;
    }
    let places = places_without(part.points.len(), removed);
    keep(&mut part.points, &places);
    keep(&mut part.vertex_classes, &places);
    keep(&mut part.vertex_ids, &places);
    let placed = |v: VertexId| VertexId(places[v.index()]);
    part.tets.iter_mut().for_each(|tet| *tet = tet.map(placed));
    part.edges.iter_mut().for_each(|edge| edge.vertices = edge.vertices.map(placed));
    let old = std::mem::take(&mut part.shared);
    let mut shared = Shared::default();
    old.iter().for_each(|(v, holders)| shared.push(places[v as usize], holders.iter().copied()));
    part.shared = shared;
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ground::comm::thread;

    #[test]
    fn ids_are_lowered_by_the_unused_ones_below_on_any_rank() {
        const COUNT: u64 = 100;
        // Unused are 0, 7, 14, ...; rank r has the ids with remainder r by `ranks`, and a new one.
        let is_unused = |id: &u64| id.is_multiple_of(7);
        for ranks in [1, 2, 3, 7, 16] {
            let closed = thread::run(ranks, |comm| {
                let rank = u64::from(comm.rank());
                let mine = || (rank..COUNT).step_by(ranks as usize);
                let unused: Vec<u64> = mine().filter(is_unused).collect();
                let mut ids: Vec<u64> = mine().filter(|id| !is_unused(id)).chain([COUNT + rank]).collect();
                let all = close_gaps(comm, &mut ids, &unused, COUNT).unwrap();
                assert_eq!(all, 15);
                ids
            });
            let mut closed = closed.unwrap().concat();
            closed.sort_unstable();
            assert_eq!(closed, (0..COUNT - 15 + u64::from(ranks)).collect::<Vec<u64>>());
        }
    }

    #[test]
    fn ranks_without_ids_or_without_unused_ones_take_part() {
        let closed = thread::run(4, |comm| {
            let (mut ids, unused) = match comm.rank() {
                0 => (vec![0, 9], vec![]),
                2 => (vec![5], vec![4, 1, 8]),
                _ => (vec![], vec![]),
            };
            assert_eq!(close_gaps(comm, &mut ids, &unused, 10).unwrap(), 3);
            ids
        });
        assert_eq!(closed.unwrap(), [vec![0, 6], vec![], vec![3], vec![]]);
    }
}
