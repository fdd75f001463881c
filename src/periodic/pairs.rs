//! Pairs of coarse entities, and of the fine vertices in them.

use crate::dist::DistMesh;
use crate::mesh::GlobalId;
use crate::refine::lattice::Lattice;
use crate::refine::numbering::{Entity, Numbering};

/// A coarse vertex, edge or face and the one that it is the image of, by global ids.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Pair {
    /// The image.
    pub image: GlobalId,
    /// What it is the image of.
    pub of: GlobalId,
    /// By corner of the image, in ascending order of global ids, the place of that corner among those of the other.
    pub corners: [u8; 3],
}

impl Pair {
    /// The pair of the image's image: `next` is a pair whose image is `self.of`.
    pub(super) fn after(self, next: Self) -> Self {
        Self { of: next.of, corners: self.corners.map(|c| next.corners[usize::from(c)]), ..self }
    }

    /// The same, the image and what it is an image of exchanged.
    pub(super) fn reversed(self) -> Self {
        let mut corners = [0; 3];
        (0..).zip(self.corners).for_each(|(i, c)| corners[usize::from(c)] = i);
        Self { image: self.of, of: self.image, corners }
    }
}

/// Pairs of vertices, of edges and of faces, each ascending by image.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Pairs(pub [Vec<Pair>; 3]);

impl Pairs {
    /// The fine vertices of a part that are images, by local index, ascending, and the global ids of what they are images of.
    pub fn fine(&self, part: &DistMesh, numbering: &Numbering) -> Vec<(u32, GlobalId)> {
        let mut found = Vec::new();
        for (dimension, pairs) in self.0.iter().enumerate() {
            let ids = [&part.vertex_ids, &part.edge_ids, &part.face_ids][dimension];
            for (id, pair) in met(ids, pairs, |pair| pair.image) {
                let inside = numbering.inside(Entity { dimension, id });
                let first = numbering.first_id(dimension, pair.of);
                let places = places(numbering.lattice(), dimension, &pair.corners);
                found.extend(inside.zip(places).map(|(local, place)| (local, first + u64::from(place))));
            }
        }
        found
    }

    /// The fine vertices of a part of which others are images, by local index, ascending.
    pub fn fine_originals(&self, part: &DistMesh, numbering: &Numbering) -> Vec<u32> {
        let mut found = Vec::new();
        for (dimension, pairs) in self.0.iter().enumerate() {
            let ids = [&part.vertex_ids, &part.edge_ids, &part.face_ids][dimension];
            let mut pairs = pairs.clone();
            pairs.sort_unstable_by_key(|pair| pair.of);
            pairs.dedup_by_key(|pair| pair.of);
            for (id, _) in met(ids, &pairs, |pair| pair.of) {
                found.extend(numbering.inside(Entity { dimension, id }));
            }
        }
        found
    }
}

/// The local ids, and the pairs, of those of the ascending `ids` that are keys of the ascending `pairs`.
fn met<'a>(
    ids: &'a [GlobalId],
    pairs: &'a [Pair],
    key: impl Fn(&Pair) -> GlobalId + 'a,
) -> impl Iterator<Item = (u32, &'a Pair)> {
    pairs.iter().filter_map(move |pair| ids.binary_search(&key(pair)).ok().map(|local| (local as u32, pair)))
}

/// For each fine vertex inside an entity, in order, the index of its partner inside the other.
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
                // Rows 1 … k − 1 before it, of n − 1 − row points each.
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

    #[test]
    fn a_pair_after_its_reverse_is_the_identity() {
        let pair = Pair { image: 4, of: 9, corners: [2, 0, 1] };
        assert_eq!(pair.after(pair.reversed()), Pair { image: 4, of: 4, corners: [0, 1, 2] });
    }
}
