//! Small disconnected components of parts: each goes to the part that it shares most faces with.
//!
//! Diffusion and interface improvement leave single tets and small groups of tets that are
//! connected to the rest of their part by no face. They add faces between parts that a solver pays
//! for. Each rank finds those of its own part, without messages.

use crate::ground::comm::{CommError, Communicator};
use crate::ground::kernel::random::mix;
use crate::ground::kernel::sets::Sets;
use crate::ground::mesh::{Rank, TET_FACES, VertexId, sorted_face};
use crate::parallel::distribution::BareMesh;
use std::cmp::Reverse;
use std::collections::BTreeMap;

/// A component stays if it has more than this fraction of its part's tets: larger components may be
/// intended, and moving them would unbalance the parts.
const MOST: f64 = 0.02;

/// Not numbered.
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
    for &(face, tet) in &components.outer {
        let component = components.component[tet as usize] as usize;
        if is_small(component) {
            others(mesh, face).for_each(|rank| *touched[component].entry(rank).or_default() += 1);
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
    /// By tet.
    component: Vec<u32>,
    count: u32,
    /// The faces with one tet here, and the tet.
    outer: Vec<([VertexId; 3], u32)>,
}

impl Components {
    /// The tets around a vertex are connected by faces if all these faces have two tets; only the
    /// others are compared with each other.
    fn of(mesh: &BareMesh) -> Self {
        let is_inside = are_inside(mesh);
        // Tets at an inner vertex are in its set, each other tet is in a set of its own.
        let mut sets = Sets::new(mesh.points.len());
        let mut set_of = Vec::with_capacity(mesh.tets.len());
        let mut outer = Vec::new();
        for (tet, corners) in (0..).zip(&mesh.tets) {
            let mut inner = corners.iter().filter(|v| is_inside[v.index()]);
            let set = inner.next().map_or_else(|| sets.add(), |v| v.0);
            inner.for_each(|v| sets.join(set, v.0));
            set_of.push(set);
            let faces = TET_FACES.map(|face| face.map(|k| corners[k]));
            let on_surface = faces.into_iter().filter(|face| !face.iter().any(|v| is_inside[v.index()]));
            outer.extend(on_surface.map(|face| (sorted_face(face), tet)));
        }
        outer.sort_unstable();
        let mut single = Vec::new();
        for same in outer.chunk_by(|a, b| a.0 == b.0) {
            match same {
                [face] => single.push(*face),
                [(_, a), (_, b)] => sets.join(set_of[*a as usize], set_of[*b as usize]),
                _ => panic!("face {:?} on rank {} has three tets", same[0].0, mesh.rank),
            }
        }
        let (mut number, mut count) = (vec![NONE; sets.len()], 0);
        let numbered = set_of.into_iter().map(|set| {
            let number = &mut number[sets.find(set) as usize];
            if *number == NONE {
                *number = count;
                count += 1;
            }
            *number
        });
        Self { component: numbered.collect(), count, outer: single }
    }
}

/// For each vertex, whether all faces at it have two tets here: then those occur twice in a sum of
/// bits, and cancel.
fn are_inside(mesh: &BareMesh) -> Vec<bool> {
    let bits: Vec<u64> = (0..mesh.points.len() as u64).map(mix).collect();
    let mut sums = vec![0; bits.len()];
    for tet in &mesh.tets {
        for face in TET_FACES.map(|face| face.map(|k| tet[k].index())) {
            let of_face = mix(face.iter().fold(0, |sum: u64, &v| sum.wrapping_add(bits[v])));
            face.iter().for_each(|&v| sums[v] ^= of_face);
        }
    }
    sums.into_iter().map(|sum| sum == 0).collect()
}
