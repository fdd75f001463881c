//! Solids that lie inside of others, which no intersection of faces tells.

use super::orient::Shell;
use crate::{BrepError, Model, Point};

/// Places of a solid that must all be inside of another one: one alone may be on its surface.
const PLACES: usize = 3;

/// Checks that no solid is inside of another one, given the shells of each.
///
/// # Errors
/// [`BrepError::Solid`] with a place inside of both.
pub(super) fn check(model: &Model, shells: &[Vec<Shell>]) -> Result<(), BrepError> {
    for (inner, own) in shells.iter().enumerate() {
        let places = places(model, own);
        let Some(&place) = places.first() else { continue };
        let contains = |outer: &Vec<Shell>, point: Point| {
            outer.iter().filter(|shell| shell.contains(point)).count() % 2 == 1
        };
        let others = shells.iter().enumerate().filter(|(body, _)| *body != inner);
        let around = others.into_iter().find(|(_, outer)| places.iter().all(|&place| contains(outer, place)));
        if let Some((outer, _)) = around {
            let outer = outer + 1;
            let what = format!(
                "it overlaps solid {outer}, or lies inside of it: give the common part to one of them \
                 (--overlap-to smaller), cut it off in the CAD program, or mesh one of them alone (--solid)"
            );
            return Err(BrepError::solid(inner, what, Some(place)));
        }
    }
    Ok(())
}

/// Middles of the largest triangles of some patches of a body that no other body shares.
fn places(model: &Model, shells: &[Shell]) -> Vec<Point> {
    let free = |patch: usize| model.patches[patch].bodies.contains(&None);
    let mut all: Vec<(f64, Point)> = shells
        .iter()
        .flat_map(|shell| shell.largest.iter())
        .filter(|(patch, ..)| free(*patch))
        .map(|l| (l.1, l.2))
        .collect();
    all.sort_by(|a, b| b.0.total_cmp(&a.0));
    all.into_iter().take(PLACES).map(|(_, place)| place).collect()
}
