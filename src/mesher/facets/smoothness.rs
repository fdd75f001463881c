//! Smoothness of facet patches and curves, for the improvement of tets.

use super::FacetProjector;
use crate::mesher::improve::Smoothness;
use crate::{Point, Vector};
use csg::{CurveId, PatchId};

/// The smoothness of facets: interpolated facet normals on patches, polyline tangents on curves.
/// Tips have no normal.
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
