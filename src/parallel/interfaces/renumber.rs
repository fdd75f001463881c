//! Replaces the old tets by the reworked ones and renumbers without gaps.

use super::rework::Reworked;
use crate::ground::comm::{CommError, Communicator};
use crate::ground::mesh::stream::Counts;
use crate::ground::mesh::{GlobalId, Rank, TetId, VertexId};
use crate::parallel::distribution::{BareMesh, ClassifiedEdge, Shared, Side};

/// **Collective.** The part with the reworked tets, and the rank that each tet goes to.
///
/// Ids of removed tets are reused on their rank; additional tets and vertices get the highest ids.
/// Remaining gaps are closed by moving all higher ids down. So the order of ids is kept, and only
/// the unused ids have to be gathered on all ranks.
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
    let gaps = [Gaps::gather(comm, &gone_ids)?, Gaps::gather(comm, &left_ids)?];

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

    gaps[0].close(&mut part.vertex_ids);
    gaps[1].close(&mut part.tet_ids);
    part.totals = Counts {
        vertices: part.totals.vertices + more_vertices - gaps[0].0.len() as u64,
        tets: part.totals.tets + more_tets - gaps[1].0.len() as u64,
        boundary: part.totals.boundary - removed_triangles,
    };
    Ok((part, to))
}

/// The unused ids of all ranks, ascending.
struct Gaps(Vec<GlobalId>);

impl Gaps {
    /// **Collective.** Gathers the unused ids of all ranks.
    fn gather(comm: &dyn Communicator, mine: &[GlobalId]) -> Result<Self, CommError> {
        let mut all = comm.all_gather(mine)?.concat();
        all.sort_unstable();
        Ok(Self(all))
    }

    /// Closes the gaps: lowers each id by the number of unused ids below it.
    fn close(&self, ids: &mut [GlobalId]) {
        let mut below = 0;
        for id in ids {
            while self.0.get(below).is_some_and(|gap| gap < id) {
                below += 1;
            }
            *id -= below as u64;
        }
    }
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
