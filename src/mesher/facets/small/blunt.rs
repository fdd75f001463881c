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
    let mut wedges: Vec<(Wedge, BluntEnd)> = Vec::new();
    for (index, candidate) in candidates.iter().enumerate() {
        let mut wedge = Wedge { index, candidate, sides: candidate.sides(layout), vanishes: false };
        let Some(end) = wedge.end(&largest, small.factor) else { continue };
        wedge.vanishes = wedge.radius_vanishes(layout, end.length);
        if wedge.vanishes || wedge.has_bends(end.length) {
            wedges.push((wedge, end));
        }
    }
    if wedges.is_empty() {
        return Vec::new();
    }
    let larger = without(&wedges.iter().map(|(_, end)| *end).collect::<Vec<_>>());
    let narrow = |(wedge, _): &(Wedge, BluntEnd)| {
        let factor = if wedge.vanishes { small.factor } else { small.factor / FURTHER };
        let end = wedge.end(&*larger, factor)?;
        let is_longer = || {
            let length = wedge.end(size, factor).map_or(0.0, |end| end.length);
            end.length >= LONGER * length && wedge.has_bends(end.length)
        };
        (wedge.vanishes || is_longer()).then_some((wedge.index, end))
    };
    wedges.iter().filter_map(narrow).collect()
}

/// A face at a candidate, between two sides that meet in a tip.
struct Wedge<'a> {
    index: usize,
    candidate: &'a Candidate,
    sides: [Side<'a>; 2],
    /// Whether the radius of the face vanishes there.
    vanishes: bool,
}

impl Wedge<'_> {
    /// The end of the face where it is at most as wide as elements divided by a factor, if it is.
    fn end(&self, size: &dyn SizeField, factor: f64) -> Option<BluntEnd> {
        let [one, other] = &self.sides;
        let across = last_narrow(one, other, size, factor)?;
        let corner = one.tip();
        let length = across.places.map(|place| (place.point - corner).norm()).into_iter().fold(0.0, f64::max);
        Some(BluntEnd { patch: self.candidate.face(), corner, length })
    }

    /// Whether the radius of the face becomes smaller and smaller towards the tip.
    fn radius_vanishes(&self, layout: &Layout, length: f64) -> bool {
        let patch = &layout.model.patches[self.candidate.face()];
        if patch.surface.is_plane() {
            return false;
        }
        let curvature = |share: f64| {
            let (fin, at) = self.sides[0].at_distance(share * length)?;
            let [u, v] = self.candidate.parameters(layout.model, fin, at)?;
            patch.surface.jet(u, v, 2).curvature()
        };
        let [Some(far), Some(near)] = SHARES.map(curvature) else { return false };
        near >= GROWTH * far
    }

    /// Whether a side goes on over several edges within so much of the tip.
    fn has_bends(&self, length: f64) -> bool {
        let edge = |side: &Side, distance: f64| side.at_distance(distance).map(|(edge, _)| edge);
        self.sides.iter().any(|side| edge(side, length) != edge(side, 0.0))
    }
}
