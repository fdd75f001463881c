//! One layer of ghost tets around each part, for solvers that need neighbours across interfaces.
//!
//! ```text
//!     rank 0  /|\  rank 1      By faces, each rank gets the tet of the other; a rank that has only the lower
//!            / | \             vertex gets neither. By vertices, every rank that has one of the vertices
//!           /__|__\            gets both.
//! ```
//! A part is a [`MeshStream`], refined or stored. Its ghosts are stored separately ([`Ghosts`]),
//! and [`WithHalo`] streams both: the blocks of the part, then those of the ghosts.
//!
//! Each rank sends tets with shared vertices to the neighbouring ranks, with the data of vertices
//! that these do not have; the nodes on edges of second order are vertices, too. This takes one
//! exchange; by faces another one before it, because ranks that have the three vertices of a face
//! need not have the face. A rank **watches** a vertex if it has the vertex in ghosts only. It
//! notifies the owner, which notifies all holders and watchers, because Elmer's files list them
//! all. Ghosts are numbered by global ids, so nothing depends on message order.

mod interface;
mod leaving;
mod message;
mod stream;
#[cfg(test)]
mod tests;

pub use crate::ground::mesh::ghosts::{By, GhostTet, GhostVertex, Ghosts};
pub use stream::WithHalo;

use crate::ground::comm::{CommError, Communicator};
use crate::ground::error::{ErrorKind, HasKind};
use crate::ground::mesh::stream::MeshStream;
use crate::ground::mesh::{GlobalId, Rank};
use crate::parallel::distribution::owner;
use interface::Interface;
use message::Message;
use std::collections::BTreeMap;

/// Why ghosts cannot be made.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum HaloError {
    /// Local ids are 32-bit.
    #[error(
        "a part would have {needed} vertices with its halo, above the {} of one part: take more parts",
        u32::MAX
    )]
    TooManyVertices {
        /// The number of vertices of the part and its ghosts.
        needed: u64,
    },
    /// Another rank met an error, or the ranks cannot communicate.
    #[error(transparent)]
    Comm(#[from] CommError),
}

impl HasKind for HaloError {
    fn kind(&self) -> ErrorKind {
        match self {
            Self::TooManyVertices { .. } => ErrorKind::Resources,
            Self::Comm(error) => error.kind(),
        }
    }

    fn is_elsewhere(&self) -> bool {
        matches!(self, Self::Comm(error) if error.is_elsewhere())
    }
}

/// **Collective.** The ghosts of this rank's part: all adjacent tets of other parts, with their
/// vertices.
///
/// # Errors
/// [`HaloError::TooManyVertices`] if the vertices of a part and its ghosts exceed `u32`. All ranks
/// return an error.
pub fn halo(comm: &dyn Communicator, part: &dyn MeshStream, by: By) -> Result<Ghosts, HaloError> {
    let interface = Interface::new(part);
    let to = leaving::leaving(comm, &interface, by)?;
    let origins: BTreeMap<u32, GlobalId> = part.masters().into_iter().collect();
    // Vertices of this part that others may watch, by id; they need not be shared.
    let mut sent: BTreeMap<GlobalId, u32> = BTreeMap::new();
    let mut messages = Vec::new();
    for (&rank, tets) in &to {
        let vertices = message::unknown(&interface, rank, tets);
        messages.push((rank, message::write(&interface, &origins, &vertices, tets)));
        sent.extend(vertices.into_iter().map(|vertex| (part.vertex_id(vertex), vertex)));
    }
    let received = comm.exchange_bytes(messages)?;
    let messages = received.iter().map(|(from, message)| message::read(*from, message)).collect();
    let mut ghosts = comm.agree(numbered(&interface, messages))?;
    let known = |id: GlobalId| interface.find(id).or_else(|| sent.get(&id).copied());
    exchange_watchers(comm, &interface, known, &mut ghosts)?;
    Ok(ghosts)
}

/// The ghosts in the order of their ids, without watchers.
fn numbered(interface: &Interface, messages: Vec<Message>) -> Result<Ghosts, HaloError> {
    let counts = interface.part.counts();
    let mut vertices: Vec<(GhostVertex, Vec<Rank>)> = Vec::new();
    let mut named = Vec::new();
    for message in messages {
        vertices.extend(message.vertices);
        named.extend(message.tets);
    }
    // Several ranks may send the same vertex, with the same data.
    vertices.sort_by_key(|(vertex, _)| vertex.id);
    vertices.dedup_by_key(|(vertex, _)| vertex.id);
    named.sort_by_key(|named| named.tet.id);
    let needed = counts.vertices + vertices.len() as u64;
    if needed > u64::from(u32::MAX) {
        return Err(HaloError::TooManyVertices { needed });
    }
    let first_vertex = counts.vertices as u32;
    let find = |id: GlobalId| match vertices.binary_search_by_key(&id, |(vertex, _)| vertex.id) {
        Ok(place) => first_vertex + place as u32,
        Err(_) => interface.find(id).unwrap_or_else(|| panic!("vertex {id} of a ghost was not sent")),
    };
    let tet = |named: &message::Named| GhostTet {
        vertices: named.vertices.map(find),
        edge_nodes: named.edge_nodes.map(|nodes| nodes.map(find)),
        ..named.tet
    };
    let tets = named.iter().map(tet).collect();
    let mut ghosts = Ghosts { first_vertex, first_tet: counts.tets, tets, ..Ghosts::default() };
    for (vertex, holders) in vertices {
        ghosts.vertices.push(vertex);
        ghosts.holders.push(holders);
    }
    Ok(ghosts)
}

/// **Collective.** Finds the watchers of all vertices; `known` finds vertices of this part that
/// others may watch.
fn exchange_watchers(
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
    let mut notices: Vec<(GlobalId, Rank)> = Vec::new();
    for (from, ids) in comm.exchange::<GlobalId>(watched.into_iter().collect())? {
        notices.extend(ids.into_iter().map(|id| (id, from)));
    }
    notices.sort_unstable();
    // For each vertex its id, the number of watchers, and the watchers.
    let mut lists_to: BTreeMap<Rank, Vec<u64>> = BTreeMap::new();
    for of_vertex in notices.chunk_by(|a, b| a.0 == b.0) {
        let id = of_vertex[0].0;
        let vertex = known(id).unwrap_or_else(|| panic!("rank {rank} does not have vertex {id}"));
        let watchers = of_vertex.iter().map(|(_, watcher)| *watcher);
        for to in interface.holders(vertex).iter().copied().chain(watchers.clone()) {
            let words = lists_to.entry(to).or_default();
            words.extend([id, of_vertex.len() as u64]);
            words.extend(watchers.clone().map(u64::from));
        }
    }
    let mut lists: Vec<(u32, Vec<Rank>)> = Vec::new();
    for (_, words) in comm.exchange::<u64>(lists_to.into_iter().collect())? {
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
