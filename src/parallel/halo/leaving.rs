//! The tets of a part that are ghosts of other parts.

use super::interface::Interface;
use crate::ground::comm::{CommError, Communicator};
use crate::ground::mesh::ghosts::By;
use crate::ground::mesh::stream::LocalBlock;
use crate::ground::mesh::{GlobalId, Rank, TET_FACES};
use csg::BodyId;
use rayon::prelude::*;
use std::collections::BTreeMap;

/// A tet of this part that is a ghost elsewhere.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Tet {
    /// Its index within the part.
    pub index: u64,
    pub id: GlobalId,
    pub body: BodyId,
    /// By local index.
    pub vertices: [u32; 4],
    /// For second order, the nodes on its edges by local index.
    pub edge_nodes: Option<[u32; 6]>,
}

impl Tet {
    /// Its vertices, then the nodes on its edges.
    pub fn nodes(&self) -> impl Iterator<Item = u32> + '_ {
        self.vertices.iter().chain(self.edge_nodes.iter().flatten()).copied()
    }
}

/// A face by the global ids of its vertices, ascending.
type Key = [GlobalId; 3];

/// **Collective.** For each neighbouring rank, the tets of this part that are its ghosts, by
/// ascending index.
///
/// All ranks that share a vertex have a tet at it, so neighbours by vertices need no message. A
/// rank that has all vertices of a face may not have the face (it may have its three edges from
/// other faces), so neighbours by faces are confirmed by a message.
pub(super) fn leaving(
    comm: &dyn Communicator,
    interface: &Interface,
    by: By,
) -> Result<BTreeMap<Rank, Vec<Tet>>, CommError> {
    let mut to: BTreeMap<Rank, Vec<Tet>> = match by {
        By::Vertices => by_rank(each_tet(interface, |tet, out| {
            let mut ranks = Vec::new();
            tet.vertices.iter().for_each(|&vertex| ranks.extend(others(interface, vertex)));
            ranks.sort_unstable();
            ranks.dedup();
            out.extend(ranks.into_iter().map(|rank| (rank, *tet)));
        })),
        By::Faces => matched(comm, by_rank(each_tet(interface, |tet, out| faces(interface, tet, out))))?,
    };
    for tets in to.values_mut() {
        tets.sort_unstable();
        tets.dedup();
    }
    Ok(to)
}

/// The other ranks that share a vertex.
fn others<'a>(interface: &'a Interface, vertex: u32) -> impl Iterator<Item = Rank> + 'a {
    let rank = interface.part.rank();
    interface.holders(vertex).iter().copied().filter(move |&holder| holder != rank)
}

/// Collects the results of `look` for each tet with a shared vertex, in tet order.
fn each_tet<T: Send>(interface: &Interface, look: impl Fn(&Tet, &mut Vec<T>) + Sync) -> Vec<T> {
    let part = interface.part;
    let of_block = |block: &mut LocalBlock, index: usize| {
        let mut seen = Vec::new();
        part.local_block(index, block);
        if !block.vertices.iter().any(|&vertex| interface.is_shared(vertex)) {
            return seen;
        }
        let body = block.tets.body.expect("a tet block has a body");
        for place in 0..block.tets.tets.len() {
            let vertices = block.tet(place).expect("a tet of the block");
            if vertices.iter().any(|&vertex| interface.is_shared(vertex)) {
                let (index, id) = (block.tets.first_local + place as u64, block.tets.first_id + place as u64);
                let edge_nodes = block.tets.edge_nodes.get(place);
                let edge_nodes = edge_nodes.map(|nodes| nodes.map(|k| block.vertices[k as usize]));
                look(&Tet { index, id, body, vertices, edge_nodes }, &mut seen);
            }
        }
        seen
    };
    let found: Vec<Vec<T>> =
        (0..part.tet_blocks()).into_par_iter().map_init(LocalBlock::default, of_block).collect();
    found.into_iter().flatten().collect()
}

/// Adds the faces of a tet whose vertices are all shared with the same other rank.
fn faces(interface: &Interface, tet: &Tet, out: &mut Vec<(Rank, (Key, Tet))>) {
    for face in TET_FACES {
        let face = face.map(|k| tet.vertices[k]);
        if !face.iter().all(|&vertex| interface.is_shared(vertex)) {
            continue;
        }
        let [first, rest @ ..] = face.map(|vertex| interface.holders(vertex));
        let mut key = face.map(|vertex| interface.part.vertex_id(vertex));
        key.sort_unstable();
        let has_all = |rank: &Rank| rest.iter().all(|holders| holders.binary_search(rank).is_ok());
        let ranks = first.iter().copied().filter(|&rank| rank != interface.part.rank() && has_all(&rank));
        out.extend(ranks.map(|rank| (rank, (key, *tet))));
    }
}

fn by_rank<T>(list: Vec<(Rank, T)>) -> BTreeMap<Rank, Vec<T>> {
    let mut lists: BTreeMap<Rank, Vec<T>> = BTreeMap::new();
    for (rank, value) in list {
        lists.entry(rank).or_default().push(value);
    }
    lists
}

/// **Collective.** Keeps the faces that the other rank has too.
fn matched(
    comm: &dyn Communicator,
    mut mine: BTreeMap<Rank, Vec<(Key, Tet)>>,
) -> Result<BTreeMap<Rank, Vec<Tet>>, CommError> {
    mine.values_mut().for_each(|faces| faces.sort_unstable());
    let keys = |faces: &[(Key, Tet)]| faces.iter().map(|(key, _)| *key).collect::<Vec<Key>>();
    let asked = mine.iter().map(|(rank, faces)| (*rank, keys(faces))).collect();
    let mut to = BTreeMap::new();
    for (from, theirs) in comm.exchange::<Key>(asked)? {
        let faces = mine.remove(&from).unwrap_or_default();
        let has = |key: &Key| theirs.binary_search(key).is_ok();
        let tets: Vec<Tet> = faces.into_iter().filter(|(key, _)| has(key)).map(|(_, tet)| tet).collect();
        if !tets.is_empty() {
            to.insert(from, tets);
        }
    }
    Ok(to)
}
