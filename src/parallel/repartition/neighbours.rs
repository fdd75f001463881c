//! The tets beside each tet, also on other ranks: all that the choice of destinations needs of the
//! topology.
//!
//! Neighbours on other ranks are **ghosts**. A face whose vertices are all shared with another rank
//! may be on it or not, so the ranks send each other these faces and keep what both have.

use crate::ground::comm::{CommError, Communicator};
use crate::ground::mesh::topology;
use crate::ground::mesh::{GlobalId, Rank, TET_FACES};
use crate::parallel::distribution::{BareMesh, NumberError};
use bytemuck::Pod;
use std::collections::BTreeMap;

/// No neighbour across a face.
pub(super) const NONE: u32 = u32::MAX;

/// Face neighbours of tets, also on other ranks. Ghosts are numbered after the local tets.
///
/// A part takes 16 bytes a tet, and 32 while it is made.
#[derive(Debug)]
pub struct Neighbours {
    /// This rank.
    pub(super) rank: Rank,
    /// For each tet, the neighbour across each face.
    pub(super) beside: Vec<[u32; 4]>,
    /// For each ghost, the local tet next to it.
    own: Vec<u32>,
    /// The ghosts of each neighbouring rank, in an order that is the same on both.
    pub(super) with: Vec<(Rank, Vec<u32>)>,
}

/// A face of this rank that another may have too.
struct Candidate {
    /// The global ids of its vertices, ascending.
    vertices: [GlobalId; 3],
    tet: u32,
    /// Its number in the tet.
    local: u32,
}

impl Neighbours {
    /// **Collective.** Finds the neighbours of all tets.
    ///
    /// # Errors
    /// [`NumberError`] if a face has more than two tets, on one rank or several. All ranks return
    /// an error.
    pub fn find(comm: &dyn Communicator, mesh: &BareMesh) -> Result<Self, NumberError> {
        let global = |v| mesh.vertex_ids[v];
        let beside = topology::neighbours(mesh.points.len(), &mesh.tets)
            .map_err(|face| NumberError::FaceOfManyTets { vertices: face.map(|v| global(v.index())) });
        let mut beside = comm.agree(beside)?;
        let candidates = candidates(mesh, &beside);
        let vertices = |list: &Vec<Candidate>| list.iter().map(|face| face.vertices).collect();
        let messages = candidates.iter().map(|(rank, list)| (*rank, vertices(list))).collect();

        let mut ghosts: Vec<(&Candidate, Rank)> = Vec::new();
        for (from, theirs) in comm.exchange::<[GlobalId; 3]>(messages)? {
            let mut theirs = theirs.iter().peekable();
            for mine in candidates.get(&from).into_iter().flatten() {
                while theirs.next_if(|face| **face < mine.vertices).is_some() {}
                if theirs.next_if(|face| **face == mine.vertices).is_some() {
                    ghosts.push((mine, from));
                }
            }
        }
        ghosts.sort_unstable_by_key(|(face, rank)| (face.vertices, *rank));
        let crowded = ghosts.windows(2).find(|pair| pair[0].0.vertices == pair[1].0.vertices);
        let crowded = crowded.map(|pair| NumberError::FaceOfManyTets { vertices: pair[0].0.vertices });
        comm.agree(crowded.map_or(Ok(()), Err))?;

        let mut with: BTreeMap<Rank, Vec<u32>> = BTreeMap::new();
        for (place, (face, rank)) in (0..).zip(&ghosts) {
            beside[face.tet as usize][face.local as usize] = mesh.tets.len() as u32 + place;
            with.entry(*rank).or_default().push(place);
        }
        let own = ghosts.iter().map(|(face, _)| face.tet).collect();
        Ok(Self { rank: mesh.rank, beside, own, with: with.into_iter().collect() })
    }

    /// The number of local tets.
    pub(super) fn tets(&self) -> usize {
        self.beside.len()
    }

    /// The local tet next to a ghost.
    pub(super) fn own(&self, ghost: u32) -> u32 {
        self.own[ghost as usize]
    }

    /// The local tets next to ghosts, by ghost.
    pub(super) fn at_ghosts(&self) -> &[u32] {
        &self.own
    }

    /// **Collective.** Extends values of local tets by those of the ghosts.
    pub(super) fn with_ghosts<T: Pod>(
        &self,
        comm: &dyn Communicator,
        values: &[T],
    ) -> Result<Vec<T>, CommError> {
        let mut all = Vec::with_capacity(values.len() + self.own.len());
        all.extend_from_slice(values);
        all.extend(self.ghosts(comm, |tet| values[tet as usize])?);
        Ok(all)
    }

    /// **Collective.** The values of the ghosts, given those of the local tets next to them.
    pub(super) fn ghosts<T: Pod>(
        &self,
        comm: &dyn Communicator,
        value: impl Fn(u32) -> T,
    ) -> Result<Vec<T>, CommError> {
        let of = |ghosts: &Vec<u32>| ghosts.iter().map(|&ghost| value(self.own(ghost))).collect();
        let messages = self.with.iter().map(|(rank, ghosts)| (*rank, of(ghosts))).collect();
        let mut values = vec![T::zeroed(); self.own.len()];
        for (from, received) in comm.exchange::<T>(messages)? {
            for (&ghost, value) in self.from(from).iter().zip(received) {
                values[ghost as usize] = value;
            }
        }
        Ok(values)
    }

    /// The ghosts of a rank.
    pub(super) fn from(&self, rank: Rank) -> &[u32] {
        let place = self.with.binary_search_by_key(&rank, |(rank, _)| *rank).expect("a neighbour");
        &self.with[place].1
    }

    /// **Collective.** Calls `visit` with the values of the two tets at each interior face; a face
    /// between ranks is visited on the lower one.
    pub(super) fn across_faces(
        &self,
        comm: &dyn Communicator,
        of_tet: &[u32],
        mut visit: impl FnMut(u32, u32),
    ) -> Result<(), CommError> {
        let all = self.with_ghosts(comm, of_tet)?;
        for (tet, beside) in (0..).zip(&self.beside) {
            let once = |other: &&u32| **other > tet && (**other as usize) < self.tets();
            beside.iter().filter(once).for_each(|&other| visit(of_tet[tet as usize], all[other as usize]));
        }
        for (_, ghosts) in self.with.iter().filter(|(rank, _)| *rank > self.rank) {
            for &ghost in ghosts {
                visit(of_tet[self.own(ghost) as usize], all[self.tets() + ghost as usize]);
            }
        }
        Ok(())
    }
}

/// By rank, the faces of one local tet whose vertices that rank has too, ascending.
fn candidates(mesh: &BareMesh, beside: &[[u32; 4]]) -> BTreeMap<Rank, Vec<Candidate>> {
    let mut candidates: BTreeMap<Rank, Vec<Candidate>> = BTreeMap::new();
    let mut is_shared = vec![false; mesh.points.len()];
    mesh.shared.ids.iter().for_each(|&v| is_shared[v as usize] = true);
    for ((tet, corners), beside) in (0..).zip(&mesh.tets).zip(beside) {
        for (local, (face, _)) in (0..).zip(TET_FACES.iter().zip(beside)).filter(|&(_, (_, &n))| n == NONE) {
            let face = face.map(|i| corners[i]);
            if !face.iter().all(|v| is_shared[v.index()]) {
                continue;
            }
            let mut vertices = face.map(|v| mesh.vertex_ids[v.index()]);
            vertices.sort_unstable();
            let [a, b, c] = face.map(|v| mesh.vertex_holders(v));
            let others = a.iter().filter(|rank| **rank != mesh.rank && b.contains(rank) && c.contains(rank));
            for &rank in others {
                candidates.entry(rank).or_default().push(Candidate { vertices, tet, local });
            }
        }
    }
    candidates.values_mut().for_each(|list| list.sort_unstable_by_key(|face| face.vertices));
    candidates
}
