//! Blunt ends of faces, which have no influence on sizes.
//!
//! Where a fillet runs out to a point, its radius vanishes with its width. Sizes by curvature
//! vanish there too, so that no tip of it is narrow beside them. The same is true of sizes by the
//! distance of curves, where the sides of a tip go on over several edges: those beyond the first
//! are close to each other without a common corner. So such an end has neither of these sizes where
//! it is narrow beside those that there are without it, as a small face does; then a tip of it can
//! be cut off and merged.

use super::group::Small;
use super::layout::Layout;
use super::tips::{Candidate, Side, last_narrow};
use crate::ground::size::{SizeField, UniformSize};
use crate::mesher::facets::BluntEnd;

/// Shares of the length of an end at which its curvatures are compared.
const SHARES: [f64; 2] = [0.5, 0.125];

/// The curvature at the first place is at least so much less than at the second one: four times if
/// the radius is proportional to the distance from the tip.
const GROWTH: f64 = 2.0;

/// An end with several edges on a side reaches as far as it is narrow by a factor that is so much
/// smaller: beyond it, sizes by the distance of its sides begin at once.
const FURTHER: f64 = 4.0;

/// It is at least so many times as long as with sizes by the distance of its sides. Where they are
/// not that small, elements as small as the end is narrow have better angles than a tip cut off.
const LONGER: f64 = 10.0;

/// The ends of faces at candidates whose radius vanishes or whose sides are several edges, where
/// they are narrow beside the sizes that the model has `without` the influence of such ends; each
/// with the index of its candidate. `size` has those with it.
pub(super) fn blunt(
    layout: &Layout,
    candidates: &[Candidate],
    small: &Small,
    size: &dyn SizeField,
    without: impl FnOnce(&[BluntEnd]) -> Box<dyn SizeField>,
) -> Vec<(usize, BluntEnd)> {
    let largest = UniformSize(small.largest);
    // With whether the radius vanishes.
    let mut all: Vec<(usize, BluntEnd, bool)> = Vec::new();
    for (k, candidate) in candidates.iter().enumerate() {
        let Some(end) = end(layout, candidate, &largest, small.factor) else { continue };
        let vanishes = radius_vanishes(layout, candidate, end.length);
        if vanishes || has_bends(layout, candidate, end.length) {
            all.push((k, end, vanishes));
        }
    }
    if all.is_empty() {
        return Vec::new();
    }
    let larger = without(&all.iter().map(|(_, end, _)| *end).collect::<Vec<_>>());
    let narrow = |(k, _, vanishes): (usize, BluntEnd, bool)| {
        let factor = if vanishes { small.factor } else { small.factor / FURTHER };
        let candidate = &candidates[k];
        let at = end(layout, candidate, &*larger, factor)?;
        let is_longer = || {
            let length = end(layout, candidate, size, factor).map_or(0.0, |end| end.length);
            at.length >= LONGER * length && has_bends(layout, candidate, at.length)
        };
        (vanishes || is_longer()).then_some((k, at))
    };
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
    if patch.surface.is_plane() {
        return false;
    }
    let [side, _] = candidate.sides(layout);
    let curvature = |share: f64| {
        let (fin, at) = side.at_distance(share * length)?;
        let [u, v] = candidate.parameters(layout.model, fin, at)?;
        patch.surface.jet(u, v, 2).curvature()
    };
    let [Some(far), Some(near)] = SHARES.map(curvature) else { return false };
    near >= GROWTH * far
}

/// Whether a side of a face goes on over several edges within so much of a tip.
fn has_bends(layout: &Layout, candidate: &Candidate, length: f64) -> bool {
    let edge = |side: &Side, distance: f64| side.at_distance(distance).map(|(edge, _)| edge);
    candidate.sides(layout).iter().any(|side| edge(side, length) != edge(side, 0.0))
}
