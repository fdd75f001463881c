//! Lowers `boundarycondition` and `boundaryconditionname`.

use super::{Lowering, Override};
use crate::geometry::{BoundaryLabel, Span};
use crate::language::ast::{Name, Num};
use crate::language::diagnostic::Reported;

impl Lowering<'_> {
    pub(super) fn boundary_number(&mut self, solid: &Name, tlo: &Name, number: Num) -> Result<(), Reported> {
        if !(1.0..=f64::from(i32::MAX)).contains(&number.value) {
            let message = format!("{} is not a boundary-condition number", number.value);
            return Err(self.report.meaning(
                number.span,
                message,
                "boundary-condition numbers are integers from 1",
            ));
        }
        self.override_boundary(solid, tlo, BoundaryLabel::Number(number.value as u32), solid.span)
    }

    pub(super) fn boundary_name(&mut self, solid: &Name, tlo: &Name, word: &Name) -> Result<(), Reported> {
        self.override_boundary(solid, tlo, BoundaryLabel::Name(word.text.clone()), solid.span)
    }

    fn override_boundary(
        &mut self,
        solid: &Name,
        tlo: &Name,
        label: BoundaryLabel,
        span: Span,
    ) -> Result<(), Reported> {
        let definition = self.solid_named(solid)?;
        let tlo = self.tlo_named(tlo)?;
        let Some(root) = self.forest.definitions[definition].root else {
            return Err(Reported);
        };
        let surfaces = self.forest.surfaces_of(root).map_err(|_| Reported)?;
        self.overrides.push(Override { surfaces, tlo, label, span });
        Ok(())
    }
}
