//! Small disconnected components of parts: each goes to the part that it shares most faces with.
//!
//! Diffusion and interface improvement leave single tets and small groups of tets that are
//! connected to the rest of their part by no face. They add faces between parts that a solver pays
//! for. Each rank finds those of its own part, without messages.

use crate::ground::comm::{CommError, Communicator};
use crate::ground::mesh::{Rank, TET_FACES, VertexId, topology};
use crate::parallel::distribution::BareMesh;
use std::cmp::Reverse;
use std::collections::BTreeMap;

/// A component stays if it has more than this fraction of its part's tets: larger components may be
/// intended, and moving them would unbalance the parts.
const MOST: f64 = 0.02;

/// No tet; not visited.
const NONE: u32 = u32::MAX;

/// *Local.* A rank for each tet: the neighbouring rank for tets of small components next to other
/// parts, otherwise this one.
pub fn absorb_small_components(mesh: &BareMesh) -> Vec<Rank> {
    let components = Components::of(mesh);
    let mut sizes = vec![0; components.count as usize];
    components.component.iter().for_each(|&component| sizes[component as usize] += 1);
    let largest = (0..sizes.len()).max_by_key(|&component| (sizes[component], Reverse(component)));
    let most = MOST * mesh.tets.len() as f64;
    let is_small = |component: usize| Some(component) != largest && f64::from(sizes[component]) <= most;
    let mut touched: Vec<BTreeMap<Rank, u32>> = vec![BTreeMap::new(); sizes.len()];
    for ((tet, beside), &component) in mesh.tets.iter().zip(&components.beside).zip(&components.component) {
        let component = component as usize;
        if is_small(component) {
            for (local, _) in TET_FACES.iter().zip(beside).filter(|(_, other)| **other == NONE) {
                let ranks = others(mesh, local.map(|i| tet[i]));
                ranks.for_each(|rank| *touched[component].entry(rank).or_default() += 1);
            }
        }
    }
    let most = |touched: &BTreeMap<Rank, u32>| {
        touched
            .iter()
            .max_by_key(|&(rank, faces)| (faces, Reverse(rank)))
            .map_or(mesh.rank, |(rank, _)| *rank)
    };
    let to: Vec<Rank> = touched.iter().map(most).collect();
    components.component.iter().map(|&component| to[component as usize]).collect()
}

/// **Collective.** The total number of components of all parts; equals the number of parts if each
/// is connected.
///
/// # Errors
/// [`CommError`] if another rank fails.
pub fn pieces(comm: &dyn Communicator, mesh: &BareMesh) -> Result<u64, CommError> {
    Ok(comm.all_reduce_sum_u64([Components::of(mesh).count.into()])?[0])
}

/// The other ranks that have all three vertices of a face.
fn others(mesh: &BareMesh, face: [VertexId; 3]) -> impl Iterator<Item = Rank> {
    let [a, b, c] = face.map(|v| mesh.vertex_holders(v));
    a.iter().copied().filter(|rank| *rank != mesh.rank && b.contains(rank) && c.contains(rank))
}

/// The connected components of a part, numbered by their first tets.
struct Components {
    /// For each tet the tet across each face.
    beside: Vec<[u32; 4]>,
    /// By tet.
    component: Vec<u32>,
    count: u32,
}

impl Components {
    fn of(mesh: &BareMesh) -> Self {
        let beside = topology::neighbours(mesh.points.len(), &mesh.tets)
            .unwrap_or_else(|face| panic!("face {face:?} on rank {} has three tets", mesh.rank));
        let mut component = vec![NONE; mesh.tets.len()];
        let mut count = 0;
        let mut open = Vec::new();
        for first in 0..component.len() as u32 {
            if component[first as usize] != NONE {
                continue;
            }
            open.push(first);
            while let Some(tet) = open.pop() {
                if std::mem::replace(&mut component[tet as usize], count) == count {
                    continue;
                }
                let others = beside[tet as usize].iter().copied();
                open.extend(others.filter(|&other| other != NONE && component[other as usize] == NONE));
            }
            count += 1;
        }
        Self { beside, component, count }
    }
}
