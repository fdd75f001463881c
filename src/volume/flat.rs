//! Tets that rounding alone makes positive are flipped away.
//!
//! Steiner points lie on edges and triangles of the surface but for rounding. Tets with four vertices in one such plane or three on
//! one such line can come of flips, with volumes of 10⁻¹⁶ of their edges' cubes or so. They would stand between a point and where it is
//! to go (`relocate`).

use super::crossing::edges_of_tet;
use super::recover::{DEEPEST, Recovery};
use super::tetrahedra::NONE;

impl Recovery<'_> {
    /// Flips away what flat tets at Steiner points it can; the surface must be recovered.
    pub(super) fn remove_flat_tets(&mut self) {
        self.flips.never_flat = true;
        for depth in 0..=DEEPEST {
            let flat: Vec<u32> = self.mesh.alive().filter(|&t| self.is_flat(t)).collect();
            for t in flat {
                // An earlier flip may have taken it, or put another tet in its slot.
                if self.mesh.is_alive(t) && self.is_flat(t) {
                    self.remove_flat_tet(t, depth);
                }
            }
        }
        self.flips.never_flat = false;
    }

    fn is_flat(&self, t: u32) -> bool {
        self.flips.is_flat(self.constraints, self.mesh.tets[t as usize])
    }

    fn remove_flat_tet(&mut self, t: u32, depth: u32) {
        self.take_help();
        for edge in edges_of_tet(self.mesh.tets[t as usize]) {
            if self.remove_edge(t, edge, [NONE; 2], depth) || !self.mesh.is_alive(t) || !self.is_flat(t) {
                return;
            }
        }
        for half_face in 4 * t..4 * t + 4 {
            if self.flips.remove_face(self.mesh, self.constraints, half_face).is_ok() {
                return;
            }
        }
    }
}
