//! Owner updates: the holders of a vertex after its tets have moved.
//!
//! Each old holder of an affected vertex sends its changes to the vertex's owner (before the move),
//! in the thesis' triples:
//!
//! ```text
//!     (v, r, 0)   rank r no longer holds v        (v, r, 1)   rank r gets v
//! ```
//! The owner deletes first and then adds, because a rank that drops a vertex may get it back with
//! tets of another rank. It sends the new list to all ranks on it. The new owner follows from the
//! list by the general rule ([`owner`]), which spreads ownership evenly over the holders.

use super::pack::Leaving;
use crate::ground::comm::pack::{put_ascending, put_varint, take_ascending, take_varint};
use crate::ground::mesh::{GlobalId, Rank, VertexId};
use crate::parallel::distribution::{BareMesh, owner};

/// The kind byte of messages to owners.
const TO_OWNER: u8 = 1;

/// A change of the holders of a vertex.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Update {
    pub vertex: GlobalId,
    /// Whether `rank` is added (or removed). Removals sort first.
    pub gets: bool,
    pub rank: Rank,
}

/// The holders of a vertex.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Holders {
    pub vertex: GlobalId,
    /// Ascending.
    pub holders: Vec<Rank>,
}

/// The changes that this rank sends, with the owner to send them to; by ascending owner and vertex.
pub(super) fn updates(mesh: &BareMesh, leaving: &Leaving) -> Vec<(Rank, Update)> {
    let mut sent: Vec<(u32, Rank)> =
        leaving.vertices.iter().flat_map(|(to, vertices)| vertices.iter().map(|&v| (v, *to))).collect();
    // One ascending run per destination.
    sent.sort();
    let mut updates = Vec::with_capacity(2 * sent.len());
    for of_vertex in sent.chunk_by(|a, b| a.0 == b.0) {
        let v = VertexId(of_vertex[0].0);
        let vertex = mesh.vertex_ids[v.index()];
        let owner = owner(mesh.vertex_holders(v), vertex);
        if !leaving.kept.vertices[v.index()] {
            updates.push((owner, Update { vertex, gets: false, rank: mesh.rank }));
        }
        updates.extend(of_vertex.iter().map(|&(_, rank)| (owner, Update { vertex, gets: true, rank })));
    }
    updates.sort();
    updates
}

/// The messages to the owners.
pub(super) fn update_messages(updates: &[(Rank, Update)]) -> Vec<(Rank, Vec<u8>)> {
    let message = |run: &[(Rank, Update)]| {
        let mut message = vec![TO_OWNER];
        let mut previous = 0;
        for (_, update) in run {
            put_varint(&mut message, update.vertex - previous);
            put_varint(&mut message, u64::from(update.rank) << 1 | u64::from(update.gets));
            previous = update.vertex;
        }
        (run[0].0, message)
    };
    updates.chunk_by(|a, b| a.0 == b.0).map(message).collect()
}

/// Reads the changes of one holder, without the kind byte.
pub(super) fn read_updates(mut message: &[u8], updates: &mut Vec<Update>) {
    let mut vertex = 0;
    while !message.is_empty() {
        vertex += take_varint(&mut message);
        let code = take_varint(&mut message);
        updates.push(Update { vertex, gets: code & 1 == 1, rank: (code >> 1) as Rank });
    }
}

/// The new holders of a vertex, as its owner sends them.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct NewHolders {
    pub new: Holders,
    /// Whether the vertex was shared before; if so, a single remaining holder must be notified too.
    pub was_shared: bool,
}

/// Applies the received changes to the owner's lists.
pub(super) fn new_holders(mesh: &BareMesh, mut updates: Vec<Update>) -> Vec<NewHolders> {
    updates.sort_unstable();
    updates.dedup();
    let mut local = 0;
    let mut shared = 0;
    let mut new_holders = Vec::new();
    for of_vertex in updates.chunk_by(|a, b| a.vertex == b.vertex) {
        let vertex = of_vertex[0].vertex;
        local += mesh.vertex_ids[local..].partition_point(|&id| id < vertex);
        assert_eq!(
            mesh.vertex_ids.get(local),
            Some(&vertex),
            "rank {} got an update of vertex {vertex}, which it does not have",
            mesh.rank
        );
        shared += mesh.shared.ids[shared..].partition_point(|&id| (id as usize) < local);
        let was_shared = mesh.shared.ids.get(shared) == Some(&(local as u32));
        let old = if was_shared { mesh.shared.holders_at(shared) } else { std::slice::from_ref(&mesh.rank) };
        new_holders
            .push(NewHolders { new: Holders { vertex, holders: applied(old, of_vertex) }, was_shared });
    }
    new_holders
}

/// The new holders: the old ones with removals applied first, then additions.
fn applied(old: &[Rank], updates: &[Update]) -> Vec<Rank> {
    let (deletes, adds) = updates.split_at(updates.partition_point(|update| !update.gets));
    let stays = |rank: &&Rank| deletes.iter().all(|update| update.rank != **rank);
    let mut holders: Vec<Rank> = old.iter().filter(stays).copied().collect();
    holders.extend(adds.iter().map(|update| update.rank));
    holders.sort_unstable();
    holders.dedup();
    holders
}

/// The messages to the new holders: by ascending rank, vertices ascending.
///
/// A vertex with a single holder before and after needs no message: it is received as an unshared
/// vertex.
pub(super) fn holder_messages(new_holders: &[NewHolders]) -> Vec<(Rank, Vec<u8>)> {
    let mut to: Vec<(Rank, u32)> = Vec::new();
    for (index, NewHolders { new, was_shared }) in (0..).zip(new_holders) {
        if *was_shared || new.holders.len() > 1 {
            to.extend(new.holders.iter().map(|&rank| (rank, index)));
        }
    }
    to.sort_unstable();
    let message = |run: &[(Rank, u32)]| {
        let mut message = Vec::new();
        let mut previous = 0;
        for Holders { vertex, holders } in run.iter().map(|(_, index)| &new_holders[*index as usize].new) {
            put_varint(&mut message, vertex - previous);
            previous = *vertex;
            put_varint(&mut message, holders.len() as u64);
            put_ascending(&mut message, holders.iter().map(|&rank| u64::from(rank)));
        }
        (run[0].0, message)
    };
    to.chunk_by(|a, b| a.0 == b.0).map(message).collect()
}

/// Reads the message of one owner.
pub(super) fn read_holders(mut message: &[u8]) -> Vec<Holders> {
    let (mut read, mut vertex) = (Vec::new(), 0);
    while !message.is_empty() {
        vertex += take_varint(&mut message);
        let count = take_varint(&mut message) as usize;
        let holders = take_ascending(&mut message, count).map(|rank| rank as Rank).collect();
        read.push(Holders { vertex, holders });
    }
    read
}
