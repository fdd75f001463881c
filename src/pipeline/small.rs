//! What is small in a CAD file, beside the elements.

use super::facet_model::FacetSolid;
use crate::Point;
use crate::ground::mesh::Names;
use crate::ground::progress::Work;
use crate::ground::size::{Evaluation, SizeField, SizeSettings};
use crate::mesher::facets::{FacetModel, FacetSize, Kept, MergedSmall, Small, largest_size, merge};

/// Faces and edges are small if the elements are at least this many times as large. Merging moves
/// the boundary of a patch by the width of the face: less than the surface error of curved parts.
const SMALL: f64 = 20.0;

/// The same where sizes are smaller because other faces and edges are kept: what is kept beside
/// them would have elements as small as itself.
const STILL_SMALL: f64 = 5.0;

/// The same for tips of faces, of which only the end is as wide.
const TIP: f64 = 10.0;

/// The same for tips that go on smoothly beyond an edge: without it the shape is almost the same.
const SMOOTH_TIP: f64 = 4.0;

/// The same for the subdivisions of elements, whose vertices must not meet both sides of a step.
const SMALL_IN_PIECES: f64 = 4.0;

/// A size field with an upper bound.
struct AtMost(FacetSize, f64);

impl SizeField for AtMost {
    fn size_at(&self, point: &Point) -> f64 {
        self.0.size_at(point).min(self.1)
    }
}

impl FacetSolid {
    /// Whether small faces and edges may be merged: in a CAD file, unless its solids overlap, which
    /// no merged face changes.
    pub(super) fn may_be_merged(&self) -> bool {
        self.cad.is_some() && self.overlap.is_none()
    }

    /// Merges edges and faces of a CAD file that are small beside the elements into their
    /// neighbours, but for those that are `kept`; `None` for the solid if there are none. Elements
    /// are as large as the sizes, but at most `largest`, and are divided into `pieces` along each
    /// edge.
    pub(super) fn merge_small(
        &self,
        settings: &SizeSettings,
        largest: f64,
        pieces: u32,
        kept: &Kept,
        work: &Work,
    ) -> (Option<Self>, MergedSmall) {
        let Some(cad) = &self.cad else { return (None, MergedSmall::default()) };
        let in_pieces = SMALL_IN_PIECES * f64::from(pieces);
        let [factor, still_factor] = [SMALL, STILL_SMALL].map(|f| f.max(in_pieces));
        let tip_factors = [TIP, SMOOTH_TIP].map(|f| f.max(in_pieces));
        let largest = largest.min(largest_size(&self.model, settings));
        let size = |model: &FacetModel| -> Box<dyn SizeField> {
            Box::new(AtMost(FacetSize::evaluated(model, settings, Evaluation::Searched), largest))
        };
        let touching = &self.model.touching;
        let small = Small { factor, still_factor, largest, tip_factors, kept, touching, size: &size, work };
        let (merged, report) = merge(&cad.model, &cad.tessellation, &small);
        let solid = merged.map(|(model, exact, grouping)| {
            let label = |faces: &Vec<usize>| self.names.patches[faces[0]].clone();
            let patches = grouping.patches.iter().map(label).collect();
            let names = Names { bodies: self.names.bodies.clone(), patches };
            Self { model, exact: Some(exact), names, ..self.clone() }
        });
        (solid, report)
    }

    /// Adds what was merged beside some places to what is kept; returns whether there is any.
    pub(super) fn keep_beside(&self, places: &[Point], merged: &MergedSmall, kept: &mut Kept) -> bool {
        self.cad.as_ref().is_some_and(|cad| kept.add_beside(merged, &cad.tessellation, places))
    }
}
