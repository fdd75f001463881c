//! Consistency of corners, curves and patches.

use super::{Features, Place};
use crate::{CornerId, CurveId, PatchId};
use std::collections::BTreeMap;

/// An inconsistency between features.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Inconsistency {
    /// A curve has fewer than two adjacent patches.
    #[error("curve {} at {place} has {fins} adjacent patches instead of at least 2", .curve.0)]
    Fins {
        /// The curve.
        curve: CurveId,
        /// The number of fins.
        fins: usize,
        /// The first point of the curve.
        place: Place,
    },
    /// The boundary curves of a patch do not balance at a corner: incoming and outgoing counts
    /// differ.
    #[error("the boundary of patch {} is not closed at {place}", .patch.0)]
    OpenBoundary {
        /// The patch.
        patch: PatchId,
        /// The corner.
        place: Place,
    },
    /// A patch has neither boundary curves nor a seed, or the same body on both sides.
    #[error("patch {} does not separate two regions, or has neither boundary nor seed", .patch.0)]
    NoBoundary {
        /// The patch.
        patch: PatchId,
    },
    /// Only one of a curve and a patch lists the other as adjacent.
    #[error("curve {} and patch {} do not agree on whether they are adjacent", .curve.0, .patch.0)]
    Disagreement {
        /// The curve.
        curve: CurveId,
        /// The patch.
        patch: PatchId,
    },
    /// A trace has fewer than two points, or does not end at the corners of its curve.
    #[error("the trace of curve {} does not connect its end corners", .curve.0)]
    Trace {
        /// The curve.
        curve: CurveId,
    },
}

impl Features {
    /// Checks that patch boundaries are closed, that curves and patches agree on adjacency, and
    /// that traces connect corners.
    ///
    /// # Errors
    /// The first [`Inconsistency`] found.
    pub(crate) fn check(&self) -> Result<(), Inconsistency> {
        for (i, curve) in self.curves.iter().enumerate() {
            let id = CurveId::new(i);
            if curve.trace.len() < 2 {
                return Err(Inconsistency::Trace { curve: id });
            }
            let place = Place(curve.trace[0]);
            let ends = [curve.trace[0], curve.trace[curve.trace.len() - 1]];
            let expected = match curve.ends {
                Some(corners) => corners.map(|c| self.corner(c).point),
                None => [ends[0]; 2],
            };
            if ends != expected {
                return Err(Inconsistency::Trace { curve: id });
            }
            if curve.fins.len() < 2 {
                return Err(Inconsistency::Fins { curve: id, fins: curve.fins.len(), place });
            }
            for fin in &curve.fins {
                if !self.patch(fin.patch).boundary.contains(&(id, fin.forward)) {
                    return Err(Inconsistency::Disagreement { curve: id, patch: fin.patch });
                }
            }
        }
        (0..self.patches.len()).try_for_each(|i| self.check_patch(PatchId::new(i)))
    }

    fn check_patch(&self, id: PatchId) -> Result<(), Inconsistency> {
        let patch = self.patch(id);
        let is_bare = patch.boundary.is_empty() && patch.seeds.is_empty();
        if is_bare || patch.inside.is_none() || patch.inside == patch.outside {
            return Err(Inconsistency::NoBoundary { patch: id });
        }
        let mut balance: BTreeMap<CornerId, i32> = BTreeMap::new();
        for &(curve, forward) in &patch.boundary {
            if !self.curve(curve).fins.iter().any(|fin| fin.patch == id && fin.forward == forward) {
                return Err(Inconsistency::Disagreement { curve, patch: id });
            }
            if let Some([start, end]) = self.curve(curve).ends {
                let out = if forward { 1 } else { -1 };
                *balance.entry(start).or_default() += out;
                *balance.entry(end).or_default() -= out;
            }
        }
        match balance.into_iter().find(|&(_, sum)| sum != 0) {
            Some((corner, _)) => {
                Err(Inconsistency::OpenBoundary { patch: id, place: Place(self.corner(corner).point) })
            }
            None => Ok(()),
        }
    }
}
