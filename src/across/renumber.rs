//! Reworked tets in place of the old ones, and ids without gaps.

use super::rework::Reworked;
use crate::comm::{CommError, Communicator};
use crate::dist::{BareMesh, LaidEdge, Shared, Side};
use crate::mesh::stream::Counts;
use crate::mesh::{GlobalId, Rank, TetId, VertexId};

/// **Collective.** The part with reworked tets. Ids of tets and vertices that were taken out are used again on their rank; then what is too much gets
/// the highest, and where some are left over all others move up: so they keep their order, and only ids that are left over have to be told to all.
/// Also the rank that each tet goes to.
///
/// # Errors
/// What the ranks cannot say.
pub(super) fn put_back(
    comm: &dyn Communicator,
    mut part: BareMesh,
    reworked: Reworked,
) -> Result<(BareMesh, Vec<Rank>), CommError> {
    let Reworked { tets, bodies, to: ranks, sides, taken, moved, gone, added, edges, lost_triangles, .. } =
        reworked;
    for (v, point, class) in moved {
        (part.points[v as usize], part.vertex_classes[v as usize]) = (point, class);
    }
    let reused = taken.len().min(tets.len());
    let left_over = &taken[reused..];
    let more = tets.len() - reused;
    let counts = [added.len() as u64, more as u64, lost_triangles];
    let before = comm.exclusive_scan(counts)?;
    let [more_vertices, more_tets, lost_triangles] = comm.all_reduce_sum_u64(counts)?;
    let gone_ids: Vec<GlobalId> = gone.iter().map(|&v| part.vertex_ids[v as usize]).collect();
    let left_ids: Vec<GlobalId> = left_over.iter().map(|&tet| part.tet_ids[tet as usize]).collect();
    let gaps = [Gaps::gather(comm, &gone_ids)?, Gaps::gather(comm, &left_ids)?];

    // Tets: in the places of old ones, then at the end.
    let places: Vec<u32> =
        taken[..reused].iter().copied().chain(part.tets.len() as u32..).take(tets.len()).collect();
    let mut is_taken = vec![false; part.tets.len() + more];
    taken.iter().for_each(|&tet| is_taken[tet as usize] = true);
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
    replace_edges(&mut part, &gone, edges);
    drop_vertices(&mut part, &gone);

    gaps[0].close(&mut part.vertex_ids);
    gaps[1].close(&mut part.tet_ids);
    part.totals = Counts {
        vertices: part.totals.vertices + more_vertices - gaps[0].0.len() as u64,
        tets: part.totals.tets + more_tets - gaps[1].0.len() as u64,
        boundary: part.totals.boundary - lost_triangles,
    };
    Ok((part, to))
}

/// Ids that are left over, of all ranks; ascending.
struct Gaps(Vec<GlobalId>);

impl Gaps {
    /// **Collective.** From those of each rank.
    fn gather(comm: &dyn Communicator, mine: &[GlobalId]) -> Result<Self, CommError> {
        let mut all = comm.all_gather(mine)?.concat();
        all.sort_unstable();
        Ok(Self(all))
    }

    /// Moves ascending ids up.
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

/// New places after some were taken out, ascending; `u32::MAX` for those.
pub(super) fn places_without(count: usize, gone: &[u32]) -> Vec<u32> {
    let mut next = 0;
    let mut gone = gone.iter().peekable();
    let place = |old: u32| {
        if gone.next_if_eq(&&old).is_some() {
            return u32::MAX;
        }
        next += 1;
        next - 1
    };
    (0..count as u32).map(place).collect()
}

/// Keeps what has a new place.
pub(super) fn keep<T>(list: &mut Vec<T>, places: &[u32]) {
    let mut places = places.iter();
    list.retain(|_| places.next().is_some_and(|place| *place != u32::MAX));
}

fn drop_tets(part: &mut BareMesh, to: &mut Vec<Rank>, gone: &[u32]) {
    if gone.is_empty() {
        return;
    }
    let places = places_without(part.tets.len(), gone);
    keep(&mut part.tets, &places);
    keep(&mut part.tet_bodies, &places);
    keep(&mut part.tet_ids, &places);
    keep(to, &places);
    part.sides.iter_mut().for_each(|side| side.tet = TetId(places[side.tet.index()]));
}

/// Takes out the edges of vertices that are gone.
fn replace_edges(part: &mut BareMesh, gone: &[u32], edges: Vec<LaidEdge>) {
    if edges.is_empty() {
        return;
    }
    let is_gone = |v: &VertexId| gone.binary_search(&v.0).is_ok();
    part.edges.retain(|edge| !edge.vertices.iter().any(is_gone));
    part.edges.extend(edges);
    LaidEdge::sort(&mut part.edges);
}

fn drop_vertices(part: &mut BareMesh, gone: &[u32]) {
    if gone.is_empty() {
        return;
    }
    let places = places_without(part.points.len(), gone);
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
