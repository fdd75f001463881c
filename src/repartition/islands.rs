//! Parts in one piece: what hangs together with the rest of its part by no face goes to the part that it touches most.
//!
//! Parts that are evened out layer by layer, or mended across their interfaces, leave single tets and small groups of tets behind: more faces between
//! parts than need be, for the solver that gets them. Each rank finds those of its own part, without a message.

use crate::comm::{CommError, Communicator};
use crate::dist::BareMesh;
use crate::mesh::topology::{self, Faces};
use crate::mesh::{Rank, VertexId};
use std::cmp::Reverse;
use std::collections::BTreeMap;

/// A piece stays where it is if it has more of its part's tets than this: the part may be of several pieces for a reason, and even parts stay so.
const MOST: f64 = 0.02;

/// No tet.
const NONE: u32 = u32::MAX;

/// *Local.* A rank for each tet: another than this one for those of small pieces beside other parts.
pub fn islands(mesh: &BareMesh) -> Vec<Rank> {
    let parted = Pieces::of(mesh);
    let mut sizes = vec![0; parted.count as usize];
    parted.piece.iter().for_each(|&piece| sizes[piece as usize] += 1);
    let largest = (0..sizes.len()).max_by_key(|&piece| (sizes[piece], Reverse(piece)));
    let most = MOST * mesh.tets.len() as f64;
    let is_island = |piece: usize| Some(piece) != largest && f64::from(sizes[piece]) <= most;
    let mut touched: Vec<BTreeMap<Rank, u32>> = vec![BTreeMap::new(); sizes.len()];
    for (face, &[tet, other]) in parted.faces.faces.iter().zip(&parted.tets_at) {
        let piece = parted.piece[tet as usize] as usize;
        if other == NONE && is_island(piece) {
            others(mesh, face).for_each(|rank| *touched[piece].entry(rank).or_default() += 1);
        }
    }
    let most = |touched: &BTreeMap<Rank, u32>| {
        touched
            .iter()
            .max_by_key(|&(rank, faces)| (faces, Reverse(rank)))
            .map_or(mesh.rank, |(rank, _)| *rank)
    };
    let to: Vec<Rank> = touched.iter().map(most).collect();
    parted.piece.iter().map(|&piece| to[piece as usize]).collect()
}

/// **Collective.** How many pieces all parts have together: as many as parts where each is in one piece.
///
/// # Errors
/// If another rank fails.
pub fn pieces(comm: &dyn Communicator, mesh: &BareMesh) -> Result<u64, CommError> {
    Ok(comm.all_reduce_sum_u64([Pieces::of(mesh).count.into()])?[0])
}

/// The other ranks that have all vertices of a face.
fn others(mesh: &BareMesh, face: &[VertexId; 3]) -> impl Iterator<Item = Rank> {
    let [a, b, c] = face.map(|v| mesh.vertex_holders(v));
    a.iter().copied().filter(|rank| *rank != mesh.rank && b.contains(rank) && c.contains(rank))
}

/// The pieces of a part, numbered by their first tets.
struct Pieces {
    faces: Faces,
    tets_at: Vec<[u32; 2]>,
    /// By tet.
    piece: Vec<u32>,
    count: u32,
}

impl Pieces {
    fn of(mesh: &BareMesh) -> Self {
        let faces = topology::faces(mesh.points.len(), &mesh.tets);
        let tets_at = topology::face_tets(faces.faces.len(), &faces.tet_faces)
            .unwrap_or_else(|face| panic!("face {face:?} on rank {} has three tets", mesh.rank));
        let mut piece = vec![NONE; mesh.tets.len()];
        let mut count = 0;
        let mut open = Vec::new();
        for first in 0..piece.len() as u32 {
            if piece[first as usize] != NONE {
                continue;
            }
            open.push(first);
            while let Some(tet) = open.pop() {
                if std::mem::replace(&mut piece[tet as usize], count) == count {
                    continue;
                }
                let beside = faces.tet_faces[tet as usize].iter().flat_map(|face| tets_at[face.index()]);
                open.extend(beside.filter(|&other| other != NONE && piece[other as usize] == NONE));
            }
            count += 1;
        }
        Self { faces, tets_at, piece, count }
    }
}
