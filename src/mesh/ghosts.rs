//! Ghosts: what a part knows of the tets of its neighbours.

use super::{GlobalId, Rank};
use csg::BodyId;

/// Which tets of other parts are ghosts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum By {
    /// Those that have a face in common with a tet of the part.
    Faces,
    /// Those that have a vertex in common with a tet of the part.
    Vertices,
}

/// A tet of another part.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct GhostTet {
    /// Its global id.
    pub id: GlobalId,
    /// The rank whose tet it is.
    pub owner: Rank,
    /// Its index within the owner's part.
    pub index: u64,
    /// Its body.
    pub body: BodyId,
    /// Its vertices by local index, positively oriented: those of the part, and behind them those of [`Ghosts::vertices`].
    pub vertices: [u32; 4],
}

/// A vertex that only ghost tets have.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GhostVertex {
    /// Its global id.
    pub id: GlobalId,
    /// Where it is.
    pub point: [f64; 3],
    /// Whether it lies on the boundary (corner, curve or patch).
    pub on_boundary: bool,
    /// The vertex that it is, at the end, the periodic image of; itself if it is none.
    pub origin: GlobalId,
}

/// A list of ranks for each of many things.
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

/// One layer of tets around a part.
///
/// A rank **holds** a vertex if it has a tet there; it **watches** one that only its ghost tets have. Owners are chosen from the holders,
/// as they are without ghosts.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Ghosts {
    /// The vertices of the part: ghost vertices have local indices from here on.
    pub first_vertex: u32,
    /// The tets of the part: ghost tets have indices from here on.
    pub first_tet: u64,
    /// Ghost vertices by ascending id.
    pub vertices: Vec<GhostVertex>,
    /// The ranks that hold each ghost vertex, ascending; this rank is none of them.
    pub holders: RankLists,
    /// Ghost tets by ascending id.
    pub tets: Vec<GhostTet>,
    /// Vertices, of the part and ghosts, that some rank watches: local indices, ascending.
    pub watched: Vec<u32>,
    /// The ranks that watch each, ascending.
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
