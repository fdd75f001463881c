//! Common parts of the two tet meshes of the mesher, `volume::tetrahedra` and `improve::complex`.
//!
//! A **half-face** is a face of one tet, stored as one number: 4·tet + index of the opposite
//! vertex.
//!
//! The meshes themselves stay separate, because they store different data for each tet (exact
//! positions and circumspheres; scores and passes), a walk crosses locked faces in one and ends
//! there in the other, and each rejects other replacements.

/// No tet, vertex or half-face.
pub(super) const NONE: u32 = u32::MAX;

/// The tets and vertices around an edge a→b, in right-handed order.
///
/// Tet i is (a, b, `vertices[i]`, `vertices[i + 1]`) up to an even permutation.
#[derive(Clone, Debug, Default)]
pub(super) struct Ring {
    /// The tets, in order around the edge.
    pub tets: Vec<u32>,
    /// The vertices, one for each tet.
    pub vertices: Vec<u32>,
}

impl Ring {
    /// Removes all tets and vertices.
    pub fn clear(&mut self) {
        self.tets.clear();
        self.vertices.clear();
    }
}

/// A set of tets that is cleared in constant time.
#[derive(Clone, Debug, Default)]
pub(super) struct Marks {
    /// Tets with the number `epoch` are in the set.
    marks: Vec<u32>,
    epoch: u32,
}

impl Marks {
    /// Clears the set, for tets below `count`.
    pub fn clear(&mut self, count: usize) {
        self.marks.resize(count, 0);
        if self.epoch == u32::MAX {
            self.marks.fill(0);
            self.epoch = 0;
        }
        self.epoch += 1;
    }

    /// Adds a tet; false if it was in the set already.
    #[inline]
    pub fn add(&mut self, tet: u32) -> bool {
        let mark = &mut self.marks[tet as usize];
        let fresh = *mark != self.epoch;
        *mark = self.epoch;
        fresh
    }

    /// Removes a tet.
    #[inline]
    pub fn remove(&mut self, tet: u32) {
        self.marks[tet as usize] = 0;
    }

    /// Whether a tet is in the set.
    #[inline]
    pub fn contains(&self, tet: u32) -> bool {
        self.marks[tet as usize] == self.epoch
    }

    /// Makes room for one more tet, which is not in the set.
    #[inline]
    pub fn push(&mut self) {
        self.marks.push(0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cleared_set_is_empty_also_when_the_epochs_run_out() {
        let mut marks = Marks::default();
        marks.clear(3);
        assert!(marks.add(1) && !marks.add(1) && marks.contains(1) && !marks.contains(0));
        marks.remove(1);
        assert!(!marks.contains(1));
        marks.add(2);
        marks.epoch = u32::MAX;
        marks.marks[0] = 1;
        marks.clear(3);
        assert!((0..3).all(|tet| !marks.contains(tet)));
    }
}
