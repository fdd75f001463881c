//! A model whose solids share the parts of faces on which they touch.

use crate::model::Model;
use crate::shapes::Shapes;

impl Model {
    /// Divides faces of solids that touch on a common surface, so that they share the common parts,
    /// with a note of how many there are. Where that fails, the model stays as it is, with a note.
    ///
    /// Solids that touch in a line or a point alone, or overlap, are not changed.
    pub fn imprint(&mut self) {
        if self.bodies < 2 {
            return;
        }
        let mut shapes = Shapes::of(self);
        if !shapes.imprint() {
            return;
        }
        let mut imprinted = match shapes.remake(self, &[]) {
            Ok(imprinted) => imprinted,
            Err(error) => {
                self.notes.push(format!("solids touch, but cannot be imprinted on each other: {error}"));
                return;
            }
        };
        let common = |model: &Self| model.patches.iter().filter(|p| !p.bodies.contains(&None)).count();
        let added = common(&imprinted).saturating_sub(common(self));
        if added > 0 {
            imprinted
                .notes
                .push(format!("solids that touch are imprinted on each other: {added} common faces"));
            *self = imprinted;
        }
    }
}
