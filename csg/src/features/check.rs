//! Whether corners, curves and patches fit together.

use super::{Features, Place};
use crate::{CornerId, CurveId, PatchId};
use std::collections::BTreeMap;

/// A way in which features do not fit together.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Inconsistency {
    /// A curve belongs to fewer than two sides of patches.
    #[error("curve {} at {place} has {fins} patches beside it", .curve.0)]
    Fins {
        /// The curve.
        curve: CurveId,
        /// How many.
        fins: usize,
        /// Its first point.
        place: Place,
    },
    /// The boundary of a patch comes into a corner more often than it leaves it, or less often.
    #[error("the boundary of patch {} is not closed at {place}", .patch.0)]
    OpenBoundary {
        /// The patch.
        patch: PatchId,
        /// Where.
        place: Place,
    },
    /// A patch with neither boundary nor seed, or with the same body on both sides.
    #[error("patch {} is no boundary", .patch.0)]
    NoBoundary {
        /// The patch.
        patch: PatchId,
    },
    /// A curve and a patch do not agree on whether they are beside each other.
    #[error("curve {} and patch {} do not agree on being beside each other", .curve.0, .patch.0)]
    Disagreement {
        /// The curve.
        curve: CurveId,
        /// The patch.
        patch: PatchId,
    },
    /// A trace with fewer than two points, or whose ends are not at its corners.
    #[error("the trace of curve {} does not run between its ends", .curve.0)]
    Trace {
        /// The curve.
        curve: CurveId,
    },
}

impl Features {
    /// Checks that the boundary of each patch is closed, that each curve has patches beside it all of which know it, and
    /// that traces run from corner to corner.
    ///
    /// # Errors
    /// The first thing that does not fit.
    pub fn check(&self) -> Result<(), Inconsistency> {
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
