//! Blunt ends of faces: where a fillet runs out to a point, its radius vanishes with its width.
//!
//! Sizes by curvature vanish there too, so that no tip of it is narrow beside them. So the end gets
//! no size from its curvature where it is narrow beside the sizes that there are without it, as a
//! small face does; then a tip of it can be cut off and merged.

use super::group::Small;
use super::layout::Layout;
use super::tips::{Candidate, last_narrow};
use crate::ground::size::{SizeField, UniformSize};
use crate::mesher::facets::BluntEnd;

/// Shares of the length of an end at which its curvatures are compared.
const SHARES: [f64; 2] = [0.5, 0.125];

/// The curvature at the first place is at least so much less than at the second one: four times if
/// the radius is proportional to the distance from the tip.
const GROWTH: f64 = 2.0;

/// The ends of faces at candidates whose radius vanishes, where they are narrow beside the sizes
/// that the model has `without` the influence of such ends; each with the index of its candidate.
pub(super) fn blunt(
    layout: &Layout,
    candidates: &[Candidate],
    small: &Small,
    without: impl FnOnce(&[BluntEnd]) -> Box<dyn SizeField>,
) -> Vec<(usize, BluntEnd)> {
    let largest = UniformSize(small.largest);
    let vanishing = |candidate: &Candidate| {
        if layout.model.patches[candidate.face()].surface.is_plane() {
            return None;
        }
        let end = end(layout, candidate, &largest, small.factor)?;
        radius_vanishes(layout, candidate, end.length).then_some(end)
    };
    let all: Vec<(usize, BluntEnd)> =
        candidates.iter().enumerate().filter_map(|(k, candidate)| Some((k, vanishing(candidate)?))).collect();
    if all.is_empty() {
        return all;
    }
    let size = without(&all.iter().map(|(_, end)| *end).collect::<Vec<_>>());
    let narrow = |(k, _): (usize, BluntEnd)| Some((k, end(layout, &candidates[k], &*size, small.factor)?));
    all.into_iter().filter_map(narrow).collect()
}

/// The end of a face where it is at most as wide as elements divided by a factor, if it is.
fn end(layout: &Layout, candidate: &Candidate, size: &dyn SizeField, factor: f64) -> Option<BluntEnd> {
    let [one, other] = candidate.sides(layout);
    let across = last_narrow(&one, &other, size, factor)?;
    let corner = one.tip();
    let length = across.places.map(|place| (place.point - corner).norm()).into_iter().fold(0.0, f64::max);
    Some(BluntEnd { patch: candidate.face(), corner, length })
}

/// Whether the radius of a face becomes smaller and smaller towards a tip.
fn radius_vanishes(layout: &Layout, candidate: &Candidate, length: f64) -> bool {
    let patch = &layout.model.patches[candidate.face()];
    let [side, _] = candidate.sides(layout);
    let curvature = |share: f64| {
        let (fin, at) = side.at_distance(share * length)?;
        let [u, v] = candidate.parameters(layout.model, fin, at)?;
        patch.surface.jet(u, v, 2).curvature()
    };
    let [Some(far), Some(near)] = SHARES.map(curvature) else { return false };
    near >= GROWTH * far
}
