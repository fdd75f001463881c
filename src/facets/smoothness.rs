//! Where patches and curves of facets are smooth, for the improvement of tets.

use super::FacetProjector;
use crate::improve::Smoothness;
use crate::{Point, Vector};
use csg::{CurveId, PatchId};

/// The smoothness of facets: patches have the normal of their facets, smoothed; curves the tangent of their polyline. Tips have no
/// normal.
#[derive(Clone, Copy)]
pub struct FacetSmoothness<'a>(pub &'a FacetProjector);

impl Smoothness for FacetSmoothness<'_> {
    fn normal(&self, patch: PatchId, at: &Point) -> Option<Vector> {
        (!self.0.is_tip(at)).then(|| self.0.normal(patch, at))
    }

    fn tangent(&self, curve: CurveId, at: &Point) -> Option<Vector> {
        self.0.tangent(curve, at)
    }
}
