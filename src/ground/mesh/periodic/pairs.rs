//! Pairs of coarse entities of which one is the periodic copy of the other.

use crate::ground::mesh::GlobalId;

/// A coarse vertex, edge or face and the entity it is a copy of, by global ids.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Pair {
    /// The copy.
    pub image: GlobalId,
    /// The entity it is a copy of.
    pub of: GlobalId,
    /// For each corner of the copy, by ascending global ids, the position of its master among the
    /// corners of the other entity.
    pub corners: [u8; 3],
}

impl Pair {
    /// The pair of `self.image` with the entity that `self.of` is a copy of; `next` is a pair whose
    /// image is `self.of`.
    pub(super) fn after(self, next: Self) -> Self {
        Self { of: next.of, corners: self.corners.map(|c| next.corners[usize::from(c)]), ..self }
    }

    /// The pair with the copy and its original exchanged.
    pub(super) fn reversed(self) -> Self {
        let mut corners = [0; 3];
        (0..).zip(self.corners).for_each(|(i, c)| corners[usize::from(c)] = i);
        Self { image: self.of, of: self.image, corners }
    }
}

/// Pairs of vertices, of edges and of faces, each ascending by copy.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Pairs(pub [Vec<Pair>; 3]);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pair_after_its_reverse_is_the_identity() {
        let pair = Pair { image: 4, of: 9, corners: [2, 0, 1] };
        assert_eq!(pair.after(pair.reversed()), Pair { image: 4, of: 4, corners: [0, 1, 2] });
    }
}
