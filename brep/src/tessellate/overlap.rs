//! Solids that lie inside of others, or repeat their faces, which no intersection of faces tells.

use super::{diagonal, orient::Shell};
use crate::shapes::{SAME, bounds, is_same_surface};
use crate::{BrepError, Model, Point};
use std::collections::HashMap;

/// Places of a solid that must all be inside of another one: one alone may be on its surface.
const PLACES: usize = 3;

/// Checks that no solid is inside of another one or repeats a face of it, given the shells of each.
///
/// # Errors
/// [`BrepError::Solid`] with a place of both.
pub(super) fn check(model: &Model, shells: &[Vec<Shell>]) -> Result<(), BrepError> {
    check_faces(model, shells)?;
    for (inner, own) in shells.iter().enumerate() {
        let places = places(model, own);
        let Some(&place) = places.first() else { continue };
        let contains = |outer: &Vec<Shell>, point: Point| {
            outer.iter().filter(|shell| shell.contains(point)).count() % 2 == 1
        };
        let others = shells.iter().enumerate().filter(|(body, _)| *body != inner);
        let around = others.into_iter().find(|(_, outer)| places.iter().all(|&place| contains(outer, place)));
        if let Some((outer, _)) = around {
            return Err(overlap(inner, outer, place));
        }
    }
    Ok(())
}

fn overlap(body: usize, other: usize, place: Point) -> BrepError {
    let other = other + 1;
    let what = format!(
        "it overlaps solid {other}, or lies inside of it: give the common part to one of them \
         (--overlap-to smaller), cut it off in the CAD program, or mesh one of them alone (--solid)"
    );
    BrepError::solid(body, what, Some(place))
}

/// Checks that no two solids have a face with the same edges on the same surface, each its own:
/// common faces of solids on both sides were made one.
fn check_faces(model: &Model, shells: &[Vec<Shell>]) -> Result<(), BrepError> {
    let size = diagonal(&model.corners, &model.curves, Vec::new());
    let mut known: HashMap<Vec<usize>, Vec<(usize, usize)>> = HashMap::new();
    for (body, own) in shells.iter().enumerate() {
        for &(number, _, place) in own.iter().flat_map(|shell| &shell.largest) {
            let patch = &model.patches[number];
            let edges = bounds(patch);
            if edges.is_empty() || !patch.bodies.contains(&None) {
                continue;
            }
            let same = known.entry(edges).or_default();
            let is_same = |&&(other, its): &&(usize, usize)| {
                its != body && is_same_surface(model, &model.patches[other], patch, SAME * size)
            };
            if let Some(&(_, other)) = same.iter().find(is_same) {
                return Err(overlap(body, other, place));
            }
            same.push((number, body));
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
