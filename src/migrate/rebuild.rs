//! The new part: what stayed and what arrived, merged by global id.
//!
//! All lists ascend already, or are a few ascending runs, so that this is merging, not sorting. Tets, nearly all of a part, are merged in
//! place, from the last to the first: a second copy would be most of the memory and, as fresh pages, of the time.

use super::owners::Holders;
use super::pack::{Kept, Load};
use super::{MigrateError, Settings};
use crate::dist::{BareMesh, LaidEdge, Shared, Side};
use crate::mesh::{GlobalId, Rank, TetId, VertexId};
use csg::BodyId;

/// Something that arrived: its global id, the load it is in, its place there.
type Arrival = (GlobalId, u32, u32);

/// Makes room in memory, or says that there is none.
#[derive(Clone, Copy)]
pub(super) struct Room {
    pub(super) rank: Rank,
    /// The most bytes that one list may take.
    pub(super) limit: u64,
}

impl Room {
    pub(super) fn make<T>(self, count: usize) -> Result<Vec<T>, MigrateError> {
        let bytes = count as u64 * size_of::<T>() as u64;
        let mut list = Vec::new();
        let refused = bytes > self.limit || list.try_reserve_exact(count).is_err();
        if refused { Err(MigrateError::OutOfMemory { rank: self.rank, bytes }) } else { Ok(list) }
    }

    /// Lengthens a list to `count` entries, and gives back what a much longer one took.
    fn grow<T: Copy>(self, list: &mut Vec<T>, count: usize, fill: T) -> Result<(), MigrateError> {
        let bytes = count as u64 * size_of::<T>() as u64;
        if bytes > self.limit || list.try_reserve_exact(count - list.len()).is_err() {
            return Err(MigrateError::OutOfMemory { rank: self.rank, bytes });
        }
        list.resize(count, fill);
        if list.capacity() / 2 > count {
            list.shrink_to_fit();
        }
        Ok(())
    }

    /// The number of things of a part, as far as local ids reach.
    fn count(self, count: usize, what: &'static str) -> Result<usize, MigrateError> {
        if u32::try_from(count).is_ok_and(|count| count < u32::MAX) {
            return Ok(count);
        }
        Err(MigrateError::TooMany { rank: self.rank, what, needed: count as u64 })
    }
}

/// New local ids: of old vertices (`u32::MAX` where one is gone) and of those in each load.
struct Renumbered {
    old: Vec<u32>,
    loads: Vec<Vec<u32>>,
}

/// *Local.* Builds the new part.
pub(super) fn rebuild(
    mut mesh: BareMesh,
    kept: &Kept,
    mut arrived: Vec<Load>,
    heard: Vec<Holders>,
    settings: &Settings,
) -> Result<BareMesh, MigrateError> {
    let room = Room { rank: mesh.rank, limit: settings.array_limit };
    let old_shared = std::mem::take(&mut mesh.shared);
    let renumbered = merge_vertices(&mut mesh, kept, &mut arrived, room)?;
    mesh.shared = merge_shared(&mesh.vertex_ids, &old_shared, &renumbered, heard);
    mesh.edges = merge_edges(&mesh.edges, kept, &arrived, &renumbered, room)?;
    merge_tets(&mut mesh, kept, &arrived, &renumbered, room)?;
    Ok(mesh)
}

/// All that arrived of one kind, by ascending global id.
fn arrivals<'a>(
    lists: impl Iterator<Item = &'a [GlobalId]> + Clone,
    room: Room,
) -> Result<Vec<Arrival>, MigrateError> {
    let mut arrivals = room.make(lists.clone().map(<[_]>::len).sum())?;
    for (load, ids) in (0..).zip(lists) {
        arrivals.extend((0..).zip(ids).map(|(place, &id)| (id, load, place)));
    }
    // Each list ascends: the stable sort merges such runs.
    arrivals.sort();
    Ok(arrivals)
}

/// Replaces the vertices by those that stay and those that arrived.
fn merge_vertices(
    mesh: &mut BareMesh,
    kept: &Kept,
    arrived: &mut [Load],
    room: Room,
) -> Result<Renumbered, MigrateError> {
    let arrivals = arrivals(arrived.iter().map(|load| &load.vertex_ids[..]), room)?;
    let mut loads: Vec<Vec<u32>> = arrived.iter().map(|load| vec![0; load.vertex_ids.len()]).collect();
    let distinct = arrivals.chunk_by(|a, b| a.0 == b.0).count();
    let most = kept.vertices.iter().filter(|stays| **stays).count() + distinct;
    let most = room.count(most, "vertices")?;
    let mut old = room.make(mesh.vertex_ids.len())?;
    let (mut ids, mut classes, mut points) = (room.make(most)?, room.make(most)?, room.make(most)?);
    let mut next = 0;
    let mut take_before =
        |limit: Option<GlobalId>, ids: &mut Vec<_>, classes: &mut Vec<_>, points: &mut Vec<_>| {
            // Vertices that arrived, up to the limit, which is one that stays.
            while let Some(&(id, load, place)) = arrivals.get(next).filter(|a| limit.is_none_or(|l| a.0 <= l))
            {
                if limit != Some(id) && ids.last() != Some(&id) {
                    let load = &arrived[load as usize];
                    ids.push(id);
                    classes.push(load.vertex_classes[place as usize]);
                    points.push(load.points[place as usize]);
                }
                let new = ids.len() - usize::from(limit != Some(id));
                loads[load as usize][place as usize] = new as u32;
                next += 1;
            }
        };
    for (v, &stays) in kept.vertices.iter().enumerate() {
        if !stays {
            old.push(u32::MAX);
            continue;
        }
        let id = mesh.vertex_ids[v];
        take_before(Some(id), &mut ids, &mut classes, &mut points);
        old.push(ids.len() as u32);
        ids.push(id);
        classes.push(mesh.vertex_classes[v]);
        points.push(mesh.points[v]);
    }
    take_before(None, &mut ids, &mut classes, &mut points);
    for load in arrived {
        (load.vertex_ids, load.vertex_classes, load.points) = Default::default();
    }
    (mesh.vertex_ids, mesh.vertex_classes, mesh.points) = (ids, classes, points);
    Ok(Renumbered { old, loads })
}

/// The new holders: as heard; of vertices of which nothing was heard as before.
fn merge_shared(
    vertex_ids: &[GlobalId],
    old: &Shared,
    renumbered: &Renumbered,
    mut heard: Vec<Holders>,
) -> Shared {
    heard.sort_unstable_by_key(|holders| holders.vertex);
    let mut shared = Shared::default();
    let mut before = old
        .iter()
        .map(|(v, holders)| (renumbered.old[v as usize], holders))
        .filter(|(v, _)| *v != u32::MAX)
        .peekable();
    let mut from = 0;
    for Holders { vertex, holders } in &heard {
        from += gallop(&vertex_ids[from..], *vertex);
        assert_eq!(vertex_ids.get(from), Some(vertex), "a rank is told of a vertex that it does not have");
        while let Some((v, holders)) = before.next_if(|(v, _)| (*v as usize) < from) {
            shared.push(v, holders.iter().copied());
        }
        before.next_if(|(v, _)| *v as usize == from);
        if holders.len() > 1 {
            shared.push(from as u32, holders.iter().copied());
        }
    }
    before.for_each(|(v, holders)| shared.push(v, holders.iter().copied()));
    shared
}

/// Where `id` stands in an ascending list, or would: in time that grows with the logarithm of the place.
fn gallop(ids: &[GlobalId], id: GlobalId) -> usize {
    let mut end = 1;
    while end < ids.len() && ids[end] < id {
        end *= 2;
    }
    let start = end / 2;
    start + ids[start..ids.len().min(end + 1)].partition_point(|&other| other < id)
}

/// The edges on curves and patches that stay and that arrived, each once.
fn merge_edges(
    old: &[LaidEdge],
    kept: &Kept,
    arrived: &[Load],
    renumbered: &Renumbered,
    room: Room,
) -> Result<Vec<LaidEdge>, MigrateError> {
    let mut edges = room.make(old.len() + arrived.iter().map(|load| load.edges.len()).sum::<usize>())?;
    let moved = |edge: &LaidEdge, new: &[u32]| LaidEdge {
        vertices: edge.vertices.map(|v| VertexId(new[v.index()])),
        class: edge.class,
    };
    let stay = old.iter().zip(&kept.edges).filter(|(_, stays)| **stays);
    edges.extend(stay.map(|(edge, _)| moved(edge, &renumbered.old)));
    for (load, new) in arrived.iter().zip(&renumbered.loads) {
        edges.extend(load.edges.iter().map(|edge| moved(edge, new)));
    }
    edges.sort();
    edges.dedup();
    Ok(edges)
}

/// Replaces the tets, and their sides, by those that stay and those that arrived: in place, since tets are nearly all of a part.
fn merge_tets(
    mesh: &mut BareMesh,
    kept: &Kept,
    arrived: &[Load],
    renumbered: &Renumbered,
    room: Room,
) -> Result<(), MigrateError> {
    let arrivals = arrivals(arrived.iter().map(|load| &load.tet_ids[..]), room)?;
    let mut sides: Vec<Side> =
        room.make(kept.sides.len() + arrived.iter().map(|load| load.sides.len()).sum::<usize>())?;
    let side_ids: Vec<GlobalId> = kept.sides.iter().map(|side| mesh.tet_ids[side.tet.index()]).collect();

    keep(&mut mesh.tet_ids, &kept.tets);
    keep(&mut mesh.tet_bodies, &kept.tets);
    keep(&mut mesh.tets, &kept.tets);
    let staying = mesh.tet_ids.len();
    let count = room.count(staying + arrivals.len(), "tets")?;
    room.grow(&mut mesh.tet_ids, count, 0)?;
    room.grow(&mut mesh.tet_bodies, count, BodyId(0))?;
    room.grow(&mut mesh.tets, count, [VertexId(0); 4])?;
    let BareMesh { tet_ids: ids, tet_bodies: bodies, tets, .. } = mesh;
    let renumber = |tet: [VertexId; 4], new: &[u32]| tet.map(|v| VertexId(new[v.index()]));
    // From the last to the first: what stays moves up, over what has moved up before.
    let mut from = staying;
    for (before, &(id, load, place)) in arrivals.iter().enumerate().rev() {
        while from > 0 && ids[from - 1] > id {
            from -= 1;
            let to = from + before + 1;
            (ids[to], bodies[to]) = (ids[from], bodies[from]);
            tets[to] = renumber(tets[from], &renumbered.old);
        }
        let (load, new, place) = (&arrived[load as usize], &renumbered.loads[load as usize], place as usize);
        (ids[from + before], bodies[from + before]) = (id, load.tet_bodies[place]);
        tets[from + before] = renumber(load.tets[place].map(VertexId), new);
    }
    tets[..from].iter_mut().for_each(|tet| *tet = renumber(*tet, &renumbered.old));

    let mut put_sides = |of: &[Side], tet_id: &dyn Fn(usize) -> GlobalId| {
        let mut at = 0;
        for (index, side) in of.iter().enumerate() {
            at += gallop(&ids[at..], tet_id(index));
            sides.push(Side { tet: TetId(at as u32), ..*side });
        }
    };
    put_sides(&kept.sides, &|index| side_ids[index]);
    for load in arrived {
        put_sides(&load.sides, &|index| load.tet_ids[load.sides[index].tet.index()]);
    }
    sides.sort();
    mesh.sides = sides;
    Ok(())
}

/// Keeps the entries that stay, in their order.
fn keep<T: Copy>(list: &mut Vec<T>, stays: &[bool]) {
    let mut stays = stays.iter();
    list.retain(|_| *stays.next().expect("one for each entry"));
}
