//! Periodic copies among the fine vertices, derived from the pairs of coarse entities.

use super::lattice::Lattice;
use super::numbering::{Entity, Numbering};
use crate::ground::mesh::GlobalId;
use crate::ground::mesh::periodic::{Pair, Pairs};
use crate::parallel::distribution::DistMesh;

/// The fine vertices of a part that are periodic copies, by ascending local index, with the global
/// ids of their masters.
pub fn fine_images(pairs: &Pairs, part: &DistMesh, numbering: &Numbering) -> Vec<(u32, GlobalId)> {
    let mut found = Vec::new();
    for (dimension, pairs) in pairs.0.iter().enumerate() {
        let ids = [&part.vertex_ids, &part.edge_ids, &part.face_ids][dimension];
        for (id, pair) in matching(ids, pairs, |pair| pair.image) {
            let inside = numbering.inside(Entity { dimension, id });
            let first = numbering.first_id(dimension, pair.of);
            let places = places(numbering.lattice(), dimension, &pair.corners);
            found.extend(inside.zip(places).map(|(local, place)| (local, first + u64::from(place))));
        }
    }
    found
}

/// The fine vertices of a part that are masters of periodic copies, by ascending local index.
pub fn fine_originals(pairs: &Pairs, part: &DistMesh, numbering: &Numbering) -> Vec<u32> {
    let mut found = Vec::new();
    for (dimension, pairs) in pairs.0.iter().enumerate() {
        let ids = [&part.vertex_ids, &part.edge_ids, &part.face_ids][dimension];
        let mut pairs = pairs.clone();
        pairs.sort_unstable_by_key(|pair| pair.of);
        pairs.dedup_by_key(|pair| pair.of);
        for (id, _) in matching(ids, &pairs, |pair| pair.of) {
            found.extend(numbering.inside(Entity { dimension, id }));
        }
    }
    found
}

/// The pairs whose key is among the ascending `ids`, with the local index of that id.
fn matching<'a>(
    ids: &'a [GlobalId],
    pairs: &'a [Pair],
    key: impl Fn(&Pair) -> GlobalId + 'a,
) -> impl Iterator<Item = (u32, &'a Pair)> {
    pairs.iter().filter_map(move |pair| ids.binary_search(&key(pair)).ok().map(|local| (local as u32, pair)))
}

/// For each fine vertex interior to an entity, in order, the index of its partner interior to the
/// paired entity.
fn places(lattice: Lattice, dimension: usize, corners: &[u8; 3]) -> Vec<u32> {
    let n = lattice.n();
    match dimension {
        0 => vec![0],
        1 if corners[0] == 0 => (0..n - 1).collect(),
        1 => (0..n - 1).rev().collect(),
        _ => {
            let place = |(j, k): (u32, u32)| {
                let mut weights = [0; 3];
                for (weight, corner) in [n - j - k, j, k].into_iter().zip(corners) {
                    weights[usize::from(*corner)] = weight;
                }
                let [_, j, k] = weights;
                // Skips rows 1 … k − 1, of n − 1 − row points each.
                (k - 1) * (n - 1) - k * (k - 1) / 2 + j - 1
            };
            lattice.face_interior().map(place).collect()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_in_a_turned_face_are_those_of_the_same_weights() {
        let lattice = Lattice::new(5);
        let inside: Vec<(u32, u32)> = lattice.face_interior().collect();
        assert_eq!(places(lattice, 2, &[0, 1, 2]), (0..inside.len() as u32).collect::<Vec<_>>());
        for corners in [[1, 2, 0], [2, 1, 0], [0, 2, 1]] {
            for (&(j, k), place) in inside.iter().zip(places(lattice, 2, &corners)) {
                let weights = [5 - j - k, j, k];
                let (j, k) = inside[place as usize];
                let there = [5 - j - k, j, k];
                (0..3).for_each(|c| assert_eq!(weights[c], there[usize::from(corners[c])]));
            }
        }
        assert_eq!(places(lattice, 1, &[1, 0, 2]), [3, 2, 1, 0]);
    }
}
