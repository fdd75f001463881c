//! The new part: kept and received entities, merged by global id.
//!
//! All lists ascend already, or consist of a few ascending runs, so this is merging, not sorting.
//! Tets, nearly all of a part, are merged in place, from the last to the first: a second copy would
//! take most of the memory and, as freshly mapped pages, most of the time.

use super::owners::Holders;
use super::pack::{Kept, Message};
use super::{MigrateError, MoveSettings};
use crate::ground::memory;
use crate::ground::mesh::{GlobalId, Rank, TetId, VertexId};
use crate::parallel::distribution::{BareMesh, ClassifiedEdge, Shared, Side};
use csg::BodyId;

/// A received entity: its global id, the index of its message, its position there.
type Arrival = (GlobalId, u32, u32);

/// Allocates lists, or returns an error if memory runs out.
#[derive(Clone, Copy)]
pub(super) struct Room {
    pub(super) rank: Rank,
    /// The maximum bytes of one list.
    pub(super) limit: u64,
}

impl Room {
    pub(super) fn make<T>(self, count: usize) -> Result<Vec<T>, MigrateError> {
        let bytes = count as u64 * size_of::<T>() as u64;
        let mut list = Vec::new();
        let refused =
            bytes > self.limit || memory::try_to_allocate(|| list.try_reserve_exact(count)).is_err();
        if refused { Err(MigrateError::OutOfMemory { rank: self.rank, bytes }) } else { Ok(list) }
    }

    /// Extends a list to `count` entries, and releases memory if its capacity is more than twice
    /// that.
    fn grow<T: Copy>(self, list: &mut Vec<T>, count: usize, fill: T) -> Result<(), MigrateError> {
        let bytes = count as u64 * size_of::<T>() as u64;
        let more = count - list.len();
        if bytes > self.limit || memory::try_to_allocate(|| list.try_reserve_exact(more)).is_err() {
            return Err(MigrateError::OutOfMemory { rank: self.rank, bytes });
        }
        list.resize(count, fill);
        if list.capacity() / 2 > count {
            list.shrink_to_fit();
        }
        Ok(())
    }

    /// Checks that local ids can number `count` entities.
    fn count(self, count: usize, what: &'static str) -> Result<usize, MigrateError> {
        if u32::try_from(count).is_ok_and(|count| count < u32::MAX) {
            return Ok(count);
        }
        Err(MigrateError::TooMany { rank: self.rank, what, needed: count as u64 })
    }
}

/// New local ids: of old vertices (`u32::MAX` if removed) and of those in each message.
struct Renumbered {
    old: Vec<u32>,
    messages: Vec<Vec<u32>>,
}

/// *Local.* Builds the new part.
pub(super) fn rebuild(
    mut mesh: BareMesh,
    kept: &Kept,
    mut incoming: Vec<Message>,
    received: Vec<Holders>,
    settings: &MoveSettings,
) -> Result<BareMesh, MigrateError> {
    let room = Room { rank: mesh.rank, limit: settings.array_limit };
    let old_shared = std::mem::take(&mut mesh.shared);
    let renumbered = merge_vertices(&mut mesh, kept, &mut incoming, room)?;
    mesh.shared = merge_shared(&mesh.vertex_ids, &old_shared, &renumbered, received);
    mesh.edges = merge_edges(&mesh.edges, kept, &incoming, &renumbered, room)?;
    merge_tets(&mut mesh, kept, &incoming, &renumbered, room)?;
    Ok(mesh)
}

/// All received entities of one kind, by ascending global id.
fn arrivals<'a>(
    lists: impl Iterator<Item = &'a [GlobalId]> + Clone,
    room: Room,
) -> Result<Vec<Arrival>, MigrateError> {
    let mut arrivals = room.make(lists.clone().map(<[_]>::len).sum())?;
    for (message, ids) in (0..).zip(lists) {
        arrivals.extend((0..).zip(ids).map(|(place, &id)| (id, message, place)));
    }
    // Each list ascends: the stable sort merges such runs.
    arrivals.sort();
    Ok(arrivals)
}

/// Replaces the vertices by the kept and received ones.
fn merge_vertices(
    mesh: &mut BareMesh,
    kept: &Kept,
    incoming: &mut [Message],
    room: Room,
) -> Result<Renumbered, MigrateError> {
    let arrivals = arrivals(incoming.iter().map(|message| &message.vertex_ids[..]), room)?;
    let mut messages: Vec<Vec<u32>> =
        incoming.iter().map(|message| vec![0; message.vertex_ids.len()]).collect();
    let distinct = arrivals.chunk_by(|a, b| a.0 == b.0).count();
    let most = kept.vertices.iter().filter(|stays| **stays).count() + distinct;
    let most = room.count(most, "vertices")?;
    let mut old = room.make(mesh.vertex_ids.len())?;
    let (mut ids, mut classes, mut points) = (room.make(most)?, room.make(most)?, room.make(most)?);
    let mut next = 0;
    let mut take_before =
        |limit: Option<GlobalId>, ids: &mut Vec<_>, classes: &mut Vec<_>, points: &mut Vec<_>| {
            // Received vertices up to the limit, which is the id of a kept vertex.
            while let Some(&(id, message, place)) =
                arrivals.get(next).filter(|a| limit.is_none_or(|l| a.0 <= l))
            {
                if limit != Some(id) && ids.last() != Some(&id) {
                    let message = &incoming[message as usize];
                    ids.push(id);
                    classes.push(message.vertex_classes[place as usize]);
                    points.push(message.points[place as usize]);
                }
                let new = ids.len() - usize::from(limit != Some(id));
                messages[message as usize][place as usize] = new as u32;
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
    for message in incoming {
        (message.vertex_ids, message.vertex_classes, message.points) = Default::default();
    }
    (mesh.vertex_ids, mesh.vertex_classes, mesh.points) = (ids, classes, points);
    Ok(Renumbered { old, messages })
}

/// The new holders: received from the owners, or unchanged for vertices without an update.
fn merge_shared(
    vertex_ids: &[GlobalId],
    old: &Shared,
    renumbered: &Renumbered,
    mut received: Vec<Holders>,
) -> Shared {
    received.sort_unstable_by_key(|holders| holders.vertex);
    let mut shared = Shared::default();
    let mut before = old
        .iter()
        .map(|(v, holders)| (renumbered.old[v as usize], holders))
        .filter(|(v, _)| *v != u32::MAX)
        .peekable();
    let mut from = 0;
    for Holders { vertex, holders } in &received {
        from += gallop(&vertex_ids[from..], *vertex);
        assert_eq!(
            vertex_ids.get(from),
            Some(vertex),
            "received holders of vertex {vertex}, which is not in the part"
        );
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

/// The position of `id` in an ascending list, or where it would be inserted: exponential search, in
/// time logarithmic in the position.
fn gallop(ids: &[GlobalId], id: GlobalId) -> usize {
    let mut end = 1;
    while end < ids.len() && ids[end] < id {
        end *= 2;
    }
    let start = end / 2;
    start + ids[start..ids.len().min(end + 1)].partition_point(|&other| other < id)
}

/// The kept and received edges on curves and patches, without duplicates.
fn merge_edges(
    old: &[ClassifiedEdge],
    kept: &Kept,
    incoming: &[Message],
    renumbered: &Renumbered,
    room: Room,
) -> Result<Vec<ClassifiedEdge>, MigrateError> {
    let mut edges =
        room.make(old.len() + incoming.iter().map(|message| message.edges.len()).sum::<usize>())?;
    let moved = |edge: &ClassifiedEdge, new: &[u32]| ClassifiedEdge {
        vertices: edge.vertices.map(|v| VertexId(new[v.index()])),
        class: edge.class,
    };
    let stay = old.iter().zip(&kept.edges).filter(|(_, stays)| **stays);
    edges.extend(stay.map(|(edge, _)| moved(edge, &renumbered.old)));
    for (message, new) in incoming.iter().zip(&renumbered.messages) {
        edges.extend(message.edges.iter().map(|edge| moved(edge, new)));
    }
    edges.sort();
    edges.dedup();
    Ok(edges)
}

/// Replaces the tets and their sides by the kept and received ones, in place because tets are
/// nearly all of a part.
fn merge_tets(
    mesh: &mut BareMesh,
    kept: &Kept,
    incoming: &[Message],
    renumbered: &Renumbered,
    room: Room,
) -> Result<(), MigrateError> {
    let arrivals = arrivals(incoming.iter().map(|message| &message.tet_ids[..]), room)?;
    let mut sides: Vec<Side> =
        room.make(kept.sides.len() + incoming.iter().map(|message| message.sides.len()).sum::<usize>())?;
    let side_ids: Vec<GlobalId> = kept.sides.iter().map(|side| mesh.tet_ids[side.tet.index()]).collect();

    keep(&mut mesh.tet_ids, &kept.tets);
    keep(&mut mesh.tet_bodies, &kept.tets);
    keep(&mut mesh.tets, &kept.tets);
    // A part without tets does not show the order of the mesh.
    let is_second =
        !mesh.edge_nodes.is_empty() || incoming.iter().any(|message| !message.edge_nodes.is_empty());
    if is_second {
        keep(&mut mesh.edge_nodes, &kept.tets);
    }
    let staying = mesh.tet_ids.len();
    let count = room.count(staying + arrivals.len(), "tets")?;
    room.grow(&mut mesh.tet_ids, count, 0)?;
    room.grow(&mut mesh.tet_bodies, count, BodyId(0))?;
    room.grow(&mut mesh.tets, count, [VertexId(0); 4])?;
    if is_second {
        room.grow(&mut mesh.edge_nodes, count, [VertexId(0); 6])?;
    }
    let BareMesh { tet_ids: ids, tet_bodies: bodies, tets, edge_nodes, .. } = mesh;
    let renumber = |tet: [VertexId; 4], new: &[u32]| tet.map(|v| VertexId(new[v.index()]));
    let renumber_edges = |nodes: [VertexId; 6], new: &[u32]| nodes.map(|v| VertexId(new[v.index()]));
    // From the last to the first: kept tets move up, over entries that were moved before.
    let mut from = staying;
    for (before, &(id, message, place)) in arrivals.iter().enumerate().rev() {
        while from > 0 && ids[from - 1] > id {
            from -= 1;
            let to = from + before + 1;
            (ids[to], bodies[to]) = (ids[from], bodies[from]);
            tets[to] = renumber(tets[from], &renumbered.old);
            if is_second {
                edge_nodes[to] = renumber_edges(edge_nodes[from], &renumbered.old);
            }
        }
        let (message, new, place) =
            (&incoming[message as usize], &renumbered.messages[message as usize], place as usize);
        (ids[from + before], bodies[from + before]) = (id, message.tet_bodies[place]);
        tets[from + before] = renumber(message.tets[place].map(VertexId), new);
        if is_second {
            edge_nodes[from + before] = renumber_edges(message.edge_nodes[place].map(VertexId), new);
        }
    }
    tets[..from].iter_mut().for_each(|tet| *tet = renumber(*tet, &renumbered.old));
    let staying = edge_nodes.get_mut(..from).unwrap_or_default();
    staying.iter_mut().for_each(|nodes| *nodes = renumber_edges(*nodes, &renumbered.old));

    let mut put_sides = |of: &[Side], tet_id: &dyn Fn(usize) -> GlobalId| {
        let mut at = 0;
        for (index, side) in of.iter().enumerate() {
            at += gallop(&ids[at..], tet_id(index));
            sides.push(Side { tet: TetId(at as u32), ..*side });
        }
    };
    put_sides(&kept.sides, &|index| side_ids[index]);
    for message in incoming {
        put_sides(&message.sides, &|index| message.tet_ids[message.sides[index].tet.index()]);
    }
    sides.sort();
    mesh.sides = sides;
    Ok(())
}

/// Retains the entries marked in `stays`, in order.
fn keep<T: Copy>(list: &mut Vec<T>, stays: &[bool]) {
    let mut stays = stays.iter();
    list.retain(|_| *stays.next().expect("one flag per entry"));
}
