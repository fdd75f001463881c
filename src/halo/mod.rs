//! One layer of ghost tets around each part, for solvers that look across the cuts.
//!
//! ```text
//!   rank 0  /|\  rank 1       By faces, each rank sees the tet of the other; a rank that has only the lower vertex sees
//!          / | \              neither. By vertices, every rank that holds one of the vertices sees both.
//!         /__|__\
//! ```
//! A part is a [`MeshStream`], refined or stored; its ghosts are stored beside it ([`Ghosts`]), and [`WithHalo`] is the stream of both:
//! the blocks of the part, then those of the ghosts.
//!
//! How: each rank sends tets with shared vertices to the ranks beside them, with what these do not know of the vertices (one exchange; by
//! faces another before it, since ranks that hold the three vertices of a face need not have the face). Then each rank that **watches** a
//! vertex, having it in ghosts only, tells its owner, who tells all holders and watchers: Elmer's files name them all. Ghosts are numbered
//! by their global ids, so that nothing depends on the order of messages.

mod interface;
mod leaving;
mod letter;
mod stream;
#[cfg(test)]
mod tests;

pub use crate::mesh::ghosts::{By, GhostTet, GhostVertex, Ghosts, RankLists};
pub use stream::WithHalo;

use crate::comm::{Agreed, CommError, Communicator};
use crate::dist::owner;
use crate::error::{Failure, Status};
use crate::mesh::stream::MeshStream;
use crate::mesh::{GlobalId, Rank};
use interface::Interface;
use letter::Letter;
use std::collections::BTreeMap;

/// Why there are no ghosts: local ids are 32-bit.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "a part would have {needed} vertices with its halo, above the {} of one part: take more parts",
    u32::MAX
)]
pub struct TooManyVertices {
    /// How many.
    pub needed: u64,
}

impl From<Agreed<TooManyVertices>> for Failure {
    fn from(error: Agreed<TooManyVertices>) -> Self {
        let status = if matches!(error, Agreed::Comm(_)) { Status::Rank } else { Status::Resources };
        Self::new(status, error)
    }
}

/// **Collective.** The ghosts of this rank's part: all tets of other parts beside it, with their vertices.
///
/// # Errors
/// On all ranks alike, where vertices of a part and its ghosts pass `u32`.
pub fn halo(
    comm: &dyn Communicator,
    part: &dyn MeshStream,
    by: By,
) -> Result<Ghosts, Agreed<TooManyVertices>> {
    let interface = Interface::new(part);
    let to = leaving::leaving(comm, &interface, by)?;
    let origins: BTreeMap<u32, GlobalId> = part.origins().into_iter().collect();
    // Vertices of this part that others watch, by id: they need not be shared.
    let mut sent: BTreeMap<GlobalId, u32> = BTreeMap::new();
    let mut messages = Vec::new();
    for (&rank, tets) in &to {
        let vertices = letter::unknown(&interface, rank, tets);
        messages.push((rank, letter::write(&interface, &origins, &vertices, tets)));
        sent.extend(vertices.into_iter().map(|vertex| (part.vertex_id(vertex), vertex)));
    }
    let received = comm.exchange_bytes(messages)?;
    let letters = received.iter().map(|(from, message)| letter::read(*from, message)).collect();
    let mut ghosts = comm.agree(settled(&interface, letters))?;
    let known = |id: GlobalId| interface.find(id).or_else(|| sent.get(&id).copied());
    tell_watchers(comm, &interface, known, &mut ghosts)?;
    Ok(ghosts)
}

/// Ghosts in the order of their ids, without their watchers.
fn settled(interface: &Interface, letters: Vec<Letter>) -> Result<Ghosts, TooManyVertices> {
    let counts = interface.part.counts();
    let mut vertices: Vec<(GhostVertex, Vec<Rank>)> = Vec::new();
    let mut named = Vec::new();
    for letter in letters {
        vertices.extend(letter.vertices);
        named.extend(letter.tets);
    }
    // Several ranks may tell of a vertex, all the same.
    vertices.sort_by_key(|(vertex, _)| vertex.id);
    vertices.dedup_by_key(|(vertex, _)| vertex.id);
    named.sort_by_key(|named| named.tet.id);
    let needed = counts.vertices + vertices.len() as u64;
    if needed > u64::from(u32::MAX) {
        return Err(TooManyVertices { needed });
    }
    let first_vertex = counts.vertices as u32;
    let find = |id: GlobalId| match vertices.binary_search_by_key(&id, |(vertex, _)| vertex.id) {
        Ok(place) => first_vertex + place as u32,
        Err(_) => interface.find(id).unwrap_or_else(|| panic!("vertex {id} of a ghost was not sent")),
    };
    let tets =
        named.iter().map(|named| GhostTet { vertices: named.vertices.map(find), ..named.tet }).collect();
    let mut ghosts = Ghosts { first_vertex, first_tet: counts.tets, tets, ..Ghosts::default() };
    for (vertex, holders) in vertices {
        ghosts.vertices.push(vertex);
        ghosts.holders.push(holders);
    }
    Ok(ghosts)
}

/// **Collective.** Settles who watches what; `known` finds vertices of this part that others may watch.
fn tell_watchers(
    comm: &dyn Communicator,
    interface: &Interface,
    known: impl Fn(GlobalId) -> Option<u32>,
    ghosts: &mut Ghosts,
) -> Result<(), CommError> {
    let rank = comm.rank();
    let mut watched: BTreeMap<Rank, Vec<GlobalId>> = BTreeMap::new();
    for (k, vertex) in ghosts.vertices.iter().enumerate() {
        watched.entry(owner(ghosts.holders.get(k), vertex.id)).or_default().push(vertex.id);
    }
    let mut heard: Vec<(GlobalId, Rank)> = Vec::new();
    for (from, ids) in comm.exchange::<GlobalId>(watched.into_iter().collect())? {
        heard.extend(ids.into_iter().map(|id| (id, from)));
    }
    heard.sort_unstable();
    // An id, how many watch it, and who.
    let mut told: BTreeMap<Rank, Vec<u64>> = BTreeMap::new();
    for of_vertex in heard.chunk_by(|a, b| a.0 == b.0) {
        let id = of_vertex[0].0;
        let vertex = known(id).unwrap_or_else(|| panic!("rank {rank} does not hold vertex {id}"));
        let watchers = of_vertex.iter().map(|(_, watcher)| *watcher);
        for to in interface.holders(vertex).iter().copied().chain(watchers.clone()) {
            let words = told.entry(to).or_default();
            words.extend([id, of_vertex.len() as u64]);
            words.extend(watchers.clone().map(u64::from));
        }
    }
    let mut lists: Vec<(u32, Vec<Rank>)> = Vec::new();
    for (_, words) in comm.exchange::<u64>(told.into_iter().collect())? {
        let mut rest = &words[..];
        while let [id, count, after @ ..] = rest {
            let (watchers, after) = after.split_at(*count as usize);
            let ghost = ghosts.vertices.binary_search_by_key(id, |vertex| vertex.id);
            let vertex = ghost.map(|place| ghosts.first_vertex + place as u32).ok().or_else(|| known(*id));
            let vertex = vertex.unwrap_or_else(|| panic!("rank {rank} has no vertex {id}"));
            lists.push((vertex, watchers.iter().map(|&watcher| watcher as Rank).collect()));
            rest = after;
        }
    }
    lists.sort_unstable();
    for (vertex, watchers) in lists {
        ghosts.watched.push(vertex);
        ghosts.watchers.push(watchers);
    }
    Ok(())
}
