//! The vertices, edges and faces that a part shares with others, by the ranks that have them.
//!
//! Two ranks may both have the two ends of an edge while only one of them has the edge. So each
//! rank sends the edges and faces of its tets whose vertices are all shared to each rank that has
//! all of these vertices: who sends an edge has it. Memory and messages are proportional to
//! interfaces.

use crate::ground::comm::{CommError, Communicator};
use crate::ground::mesh::stream::{MeshStream, TetBlock};
use crate::ground::mesh::{GlobalId, Rank};
use rayon::prelude::*;
use std::collections::BTreeMap;

/// The entities that exactly the ranks of a group share, by local vertices. They ascend with global
/// ids, and so do the vertices of each, so all ranks of the group have the same order.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct Group {
    pub vertices: Vec<u32>,
    pub edges: Vec<[u32; 2]>,
    pub faces: Vec<[u32; 3]>,
}

/// The groups of a part, by their ranks; each has this rank and others.
pub(super) type Groups = BTreeMap<Vec<Rank>, Group>;

/// An edge (2) or face (3): ascending global ids of its vertices, and their local indices.
type Candidate<const N: usize> = ([GlobalId; N], [u32; N]);

/// The local vertices of an edge or face, and the ranks that have it, ascending.
type Held<const N: usize> = ([u32; N], Vec<Rank>);

/// The index of the vertex block of each shared vertex.
struct SharedVertices<'a> {
    part: &'a dyn MeshStream,
    block: Vec<u32>,
}

/// Marks a vertex that only this rank has.
const OWN: u32 = u32::MAX;

impl<'a> SharedVertices<'a> {
    fn of(part: &'a dyn MeshStream) -> Self {
        let mut block = vec![OWN; part.counts().vertices as usize];
        for index in 0..part.vertex_blocks() {
            let vertices = part.vertex_block(index);
            if !vertices.holders.is_empty() {
                let local = vertices.local;
                block[local.start as usize..local.end as usize].fill(index as u32);
            }
        }
        Self { part, block }
    }

    fn is_shared(&self, vertex: u32) -> bool {
        self.block[vertex as usize] != OWN
    }

    fn holders(&self, vertex: u32) -> &'a [Rank] {
        self.part.vertex_block(self.block[vertex as usize] as usize).holders
    }

    /// The other ranks that have all these vertices.
    fn common<const N: usize>(&self, vertices: [u32; N]) -> Vec<Rank> {
        let [first, rest @ ..] = &vertices[..] else { return Vec::new() };
        let all_have = |rank: &Rank| rest.iter().all(|&vertex| self.holders(vertex).contains(rank));
        let holders = self.holders(*first).iter().copied();
        holders.filter(|rank| *rank != self.part.rank() && all_have(rank)).collect()
    }

    fn candidate<const N: usize>(&self, vertices: [u32; N]) -> Candidate<N> {
        let mut pairs = vertices.map(|vertex| (self.part.vertex_id(vertex), vertex));
        pairs.sort_unstable();
        (pairs.map(|(id, _)| id), pairs.map(|(_, vertex)| vertex))
    }

    /// The candidates of all tets, each once, ascending. `of_tet` lists those of one tet.
    fn candidates<const N: usize>(
        &self,
        of_tet: impl Fn([u32; 4], &mut Vec<[u32; N]>) + Sync,
    ) -> Vec<Candidate<N>> {
        let of_block = |(block, found): &mut (TetBlock, Vec<[u32; N]>), index: usize| {
            self.part.tet_block(index, block);
            found.clear();
            for tet in &block.tets {
                if tet.iter().filter(|&&vertex| self.is_shared(vertex)).count() >= N {
                    of_tet(*tet, found);
                }
            }
            found.retain(|vertices| vertices.iter().all(|&vertex| self.is_shared(vertex)));
            found.iter().map(|&vertices| self.candidate(vertices)).collect::<Vec<_>>()
        };
        let blocks = (0..self.part.tet_blocks()).into_par_iter();
        let mut all: Vec<Candidate<N>> = blocks.map_init(Default::default, of_block).flatten_iter().collect();
        all.par_sort_unstable();
        all.dedup();
        all
    }
}

/// **Collective.** The groups of this rank's part.
pub(super) fn groups(comm: &dyn Communicator, part: &dyn MeshStream) -> Result<Groups, CommError> {
    let shared = SharedVertices::of(part);
    let mut groups = Groups::new();
    let mut vertices: Vec<(GlobalId, u32)> = (0..part.counts().vertices as u32)
        .filter(|&vertex| shared.is_shared(vertex))
        .map(|vertex| (part.vertex_id(vertex), vertex))
        .collect();
    vertices.sort_unstable();
    for (_, vertex) in vertices {
        group(&mut groups, shared.holders(vertex)).vertices.push(vertex);
    }
    let edges = shared.candidates(|[a, b, c, d], found| {
        found.extend([[a, b], [a, c], [a, d], [b, c], [b, d], [c, d]]);
    });
    for (edge, holders) in with_holders(comm, &shared, edges)? {
        group(&mut groups, &holders).edges.push(edge);
    }
    let faces = shared.candidates(|[a, b, c, d], found| {
        found.extend([[a, b, c], [a, b, d], [a, c, d], [b, c, d]]);
    });
    for (face, holders) in with_holders(comm, &shared, faces)? {
        group(&mut groups, &holders).faces.push(face);
    }
    Ok(groups)
}

fn group<'a>(groups: &'a mut Groups, ranks: &[Rank]) -> &'a mut Group {
    if !groups.contains_key(ranks) {
        groups.insert(ranks.to_vec(), Group::default());
    }
    groups.get_mut(ranks).expect("it is there now")
}

/// **Collective.** The candidates that other ranks have too, with all ranks that have them,
/// ascending.
fn with_holders<const N: usize>(
    comm: &dyn Communicator,
    shared: &SharedVertices<'_>,
    candidates: Vec<Candidate<N>>,
) -> Result<Vec<Held<N>>, CommError> {
    let mut messages: BTreeMap<Rank, Vec<GlobalId>> = BTreeMap::new();
    for (ids, vertices) in &candidates {
        for rank in shared.common(*vertices) {
            messages.entry(rank).or_default().extend(ids);
        }
    }
    let mut holders: Vec<Vec<Rank>> = vec![Vec::new(); candidates.len()];
    for (from, ids) in comm.exchange(messages.into_iter().collect())? {
        for ids in ids.chunks_exact(N) {
            if let Ok(index) = candidates.binary_search_by(|(own, _)| own.as_slice().cmp(ids)) {
                holders[index].push(from);
            }
        }
    }
    let both = candidates.into_iter().zip(holders).filter(|(_, holders)| !holders.is_empty());
    let with_own = |((_, vertices), mut holders): (Candidate<N>, Vec<Rank>)| {
        holders.push(comm.rank());
        holders.sort_unstable();
        (vertices, holders)
    };
    Ok(both.map(with_own).collect())
}
