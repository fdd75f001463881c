//! One model of several.

use crate::model::{Model, On};

impl Model {
    /// Adds the solids of another model in the same unit. They share nothing with the others until
    /// [`imprint`](Self::imprint).
    pub fn join(&mut self, other: Self) {
        let (corners, curves, bodies) = (self.corners.len(), self.curves.len(), self.bodies);
        extend_names((&mut self.body_names, self.bodies), (other.body_names, other.bodies));
        extend_names((&mut self.patch_names, self.patches.len()), (other.patch_names, other.patches.len()));
        self.corners.extend(other.corners);
        self.curves.extend(other.curves.into_iter().map(|mut curve| {
            curve.ends = curve.ends.map(|end| end + corners);
            curve
        }));
        self.patches.extend(other.patches.into_iter().map(|mut patch| {
            for fin in patch.loops.iter_mut().flatten() {
                fin.on = match fin.on {
                    On::Curve(curve) => On::Curve(curve + curves),
                    On::Corner(corner) => On::Corner(corner + corners),
                };
            }
            patch.bodies = patch.bodies.map(|body| body.map(|body| body + bodies));
            patch
        }));
        self.bodies += other.bodies;
        self.from_faces |= other.from_faces;
        self.metres = self.metres.or(other.metres);
        self.notes.extend(other.notes);
    }
}

/// Appends the names of some items to those of others; lists are full or empty.
fn extend_names(
    (names, count): (&mut Vec<Option<String>>, usize),
    (mut others, other_count): (Vec<Option<String>>, usize),
) {
    names.resize(count, None);
    others.resize(other_count, None);
    names.append(&mut others);
}
