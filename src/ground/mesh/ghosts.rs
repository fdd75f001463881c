//! Ghosts: copies of the tets of neighbouring parts.

use super::{GlobalId, Rank};
use csg::BodyId;

/// Which tets of other parts are ghosts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum By {
    /// Tets that share a face with a tet of the part.
    Faces,
    /// Tets that share a vertex with a tet of the part.
    Vertices,
}

/// A tet of another part.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct GhostTet {
    /// Its global id.
    pub id: GlobalId,
    /// The rank of the part that has the tet.
    pub owner: Rank,
    /// Its index in the owner's part.
    pub index: u64,
    /// Its body.
    pub body: BodyId,
    /// Its corners by local index, positively oriented: those of the part, followed by those of
    /// [`Ghosts::vertices`].
    pub vertices: [u32; 4],
    /// For second order, the nodes on its edges by local index, in the order of
    /// [`TET_EDGES`](super::TET_EDGES).
    pub edge_nodes: Option<[u32; 6]>,
}

/// A vertex, or a node on an edge, that only ghost tets have.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GhostVertex {
    /// Its global id.
    pub id: GlobalId,
    /// Its coordinates.
    pub point: [f64; 3],
    /// Whether it is on the boundary (corner, curve or patch).
    pub on_boundary: bool,
    /// The global id of its periodic master, or its own id if it has none.
    pub origin: GlobalId,
}

/// A list of ranks for each of several entities.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct RankLists {
    ends: Vec<usize>,
    ranks: Vec<Rank>,
}

impl RankLists {
    /// Appends a list.
    pub fn push(&mut self, ranks: impl IntoIterator<Item = Rank>) {
        self.ranks.extend(ranks);
        self.ends.push(self.ranks.len());
    }

    /// The list at `index`.
    pub fn get(&self, index: usize) -> &[Rank] {
        let start = index.checked_sub(1).map_or(0, |before| self.ends[before]);
        &self.ranks[start..self.ends[index]]
    }
}

/// One layer of ghost tets around a part.
///
/// A rank is a **holder** of a vertex if a tet of its part has it; it **watches** a vertex that
/// only its ghost tets have. Owners are chosen from the holders, as without ghosts.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Ghosts {
    /// The number of vertices of the part; ghost vertices have local indices from here on.
    pub first_vertex: u32,
    /// The number of tets of the part; ghost tets have indices from here on.
    pub first_tet: u64,
    /// Ghost vertices by ascending id.
    pub vertices: Vec<GhostVertex>,
    /// The holders of each ghost vertex, ascending; this rank is not among them.
    pub holders: RankLists,
    /// Ghost tets by ascending id.
    pub tets: Vec<GhostTet>,
    /// Vertices (of the part or ghosts) that some rank watches: local indices, ascending.
    pub watched: Vec<u32>,
    /// The ranks that watch each of these, ascending.
    pub watchers: RankLists,
}

impl Ghosts {
    /// The ranks that watch the vertex with this local index, ascending.
    pub fn watchers_of(&self, local: u32) -> &[Rank] {
        self.watched.binary_search(&local).map_or(&[], |place| self.watchers.get(place))
    }

    /// The ghost tet with this index in the part, if it is one.
    pub fn tet(&self, index: u64) -> Option<&GhostTet> {
        index.checked_sub(self.first_tet).map(|ghost| &self.tets[ghost as usize])
    }
}
