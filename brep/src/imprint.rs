//! A model whose solids share the parts of faces on which they touch.

use crate::model::Model;
use crate::shapes::Shapes;
use std::collections::BTreeSet;

impl Model {
    /// Divides faces of solids that touch on a common surface, so that they share the common parts,
    /// with a note of how many there are. Where that fails, the model stays as it is.
    ///
    /// Solids that touch in a line or a point alone, or overlap, are not changed.
    pub fn imprint(&mut self) {
        if self.bodies < 2 {
            return;
        }
        let mut shapes = Shapes::of(self);
        let touching = shapes.imprint();
        if touching.is_empty() {
            return;
        }
        let mut imprinted = Self {
            bodies: self.bodies,
            body_names: self.body_names.clone(),
            metres: self.metres,
            notes: self.notes.clone(),
            ..Self::default()
        };
        let Ok(to) = shapes.build(&mut imprinted) else { return };
        let parts: BTreeSet<usize> = touching.into_iter().map(|face| to[face]).collect();
        let is_common = |patch: &usize| !imprinted.patches[*patch].bodies.contains(&None);
        let common = parts.into_iter().filter(is_common).count();
        if common > 0 {
            let note = format!("solids that touch are imprinted on each other: {common} common faces");
            imprinted.notes.push(note);
            *self = imprinted;
        }
    }
}
