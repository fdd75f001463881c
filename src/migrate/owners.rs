//! Owner updates: who holds a vertex after its tets have moved.
//!
//! Each old holder of a vertex that is touched tells the owner (before the move) in the thesis' triples what changes:
//!
//! ```text
//!   (v, r, 0)   rank r holds v no more          (v, r, 1)   rank r gets v
//! ```
//! The owner deletes first and adds then: a rank that says it drops a vertex may get it back with the tets of another. It
//! tells the new list to all that are on it. The new owner follows from the list by the rule for all ([`owner`]), which is even over holders.

use super::pack::Leaving;
use crate::comm::pack::{put_ascending, put_varint, take_ascending, take_varint};
use crate::dist::{BareMesh, owner};
use crate::mesh::{GlobalId, Rank, VertexId};

/// The kind of letter that goes to an owner.
const TO_OWNER: u8 = 1;

/// What changes for a vertex.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Update {
    pub vertex: GlobalId,
    /// Whether `rank` gets it: deletes come first.
    pub gets: bool,
    pub rank: Rank,
}

/// Who holds a vertex.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Holders {
    pub vertex: GlobalId,
    /// Ascending.
    pub holders: Vec<Rank>,
}

/// What this rank tells the owners (by rank), by ascending owner and vertex.
pub(super) fn updates(mesh: &BareMesh, leaving: &Leaving) -> Vec<(Rank, Update)> {
    let mut sent: Vec<(u32, Rank)> =
        leaving.vertices.iter().flat_map(|(to, vertices)| vertices.iter().map(|&v| (v, *to))).collect();
    // One ascending run for each destination.
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

/// The letters to the owners.
pub(super) fn letters(updates: &[(Rank, Update)]) -> Vec<(Rank, Vec<u8>)> {
    let letter = |run: &[(Rank, Update)]| {
        let mut message = vec![TO_OWNER];
        let mut previous = 0;
        for (_, update) in run {
            put_varint(&mut message, update.vertex - previous);
            put_varint(&mut message, u64::from(update.rank) << 1 | u64::from(update.gets));
            previous = update.vertex;
        }
        (run[0].0, message)
    };
    updates.chunk_by(|a, b| a.0 == b.0).map(letter).collect()
}

/// Reads what one holder tells, without the kind of letter.
pub(super) fn read(mut told: &[u8], updates: &mut Vec<Update>) {
    let mut vertex = 0;
    while !told.is_empty() {
        vertex += take_varint(&mut told);
        let code = take_varint(&mut told);
        updates.push(Update { vertex, gets: code & 1 == 1, rank: (code >> 1) as Rank });
    }
}

/// What an owner has to tell: the new holders of a vertex, and to whom that is news.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct News {
    pub new: Holders,
    /// Whether it was shared before: then also a single holder must be told.
    pub was_shared: bool,
}

/// What the holders told, applied to the lists that the owner has.
pub(super) fn news(mesh: &BareMesh, mut updates: Vec<Update>) -> Vec<News> {
    updates.sort_unstable();
    updates.dedup();
    let mut local = 0;
    let mut shared = 0;
    let mut news = Vec::new();
    for of_vertex in updates.chunk_by(|a, b| a.vertex == b.vertex) {
        let vertex = of_vertex[0].vertex;
        local += mesh.vertex_ids[local..].partition_point(|&id| id < vertex);
        assert_eq!(
            mesh.vertex_ids.get(local),
            Some(&vertex),
            "rank {} is told of a vertex of others",
            mesh.rank
        );
        shared += mesh.shared.ids[shared..].partition_point(|&id| (id as usize) < local);
        let was_shared = mesh.shared.ids.get(shared) == Some(&(local as u32));
        let old = if was_shared { mesh.shared.holders_at(shared) } else { std::slice::from_ref(&mesh.rank) };
        news.push(News { new: Holders { vertex, holders: applied(old, of_vertex) }, was_shared });
    }
    news
}

/// The new holders from the old ones and the updates: deletes first.
fn applied(old: &[Rank], updates: &[Update]) -> Vec<Rank> {
    let (deletes, adds) = updates.split_at(updates.partition_point(|update| !update.gets));
    let stays = |rank: &&Rank| deletes.iter().all(|update| update.rank != **rank);
    let mut holders: Vec<Rank> = old.iter().filter(stays).copied().collect();
    holders.extend(adds.iter().map(|update| update.rank));
    holders.sort_unstable();
    holders.dedup();
    holders
}

/// The letters to the new holders: by ascending rank, vertices ascending. A vertex that one rank alone held and one holds is no news: it gets the vertex as
/// one that is not shared.
pub(super) fn news_letters(news: &[News]) -> Vec<(Rank, Vec<u8>)> {
    let mut to: Vec<(Rank, u32)> = Vec::new();
    for (index, News { new, was_shared }) in (0..).zip(news) {
        if *was_shared || new.holders.len() > 1 {
            to.extend(new.holders.iter().map(|&rank| (rank, index)));
        }
    }
    to.sort_unstable();
    let letter = |run: &[(Rank, u32)]| {
        let mut message = Vec::new();
        let mut previous = 0;
        for Holders { vertex, holders } in run.iter().map(|(_, index)| &news[*index as usize].new) {
            put_varint(&mut message, vertex - previous);
            previous = *vertex;
            put_varint(&mut message, holders.len() as u64);
            put_ascending(&mut message, holders.iter().map(|&rank| u64::from(rank)));
        }
        (run[0].0, message)
    };
    to.chunk_by(|a, b| a.0 == b.0).map(letter).collect()
}

/// Reads the letter of one owner.
pub(super) fn read_news(mut letter: &[u8]) -> Vec<Holders> {
    let (mut read, mut vertex) = (Vec::new(), 0);
    while !letter.is_empty() {
        vertex += take_varint(&mut letter);
        let count = take_varint(&mut letter) as usize;
        let holders = take_ascending(&mut letter, count).map(|rank| rank as Rank).collect();
        read.push(Holders { vertex, holders });
    }
    read
}
