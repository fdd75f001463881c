//! Smoothness of facet patches and curves, for the improvement of tets.

use super::FacetProjector;
use crate::mesher::improve::Smoothness;
use crate::{Point, Vector};
use csg::{CurveId, PatchId};

/// The smoothness of facets: interpolated facet normals on patches, polyline tangents on curves.
/// Tips have no normal.
#[derive(Clone, Copy)]
pub struct FacetSmoothness<'a>(pub &'a FacetProjector);

/// Strength of the penalty for corners that shrink in the limit of refinement: less than that of
/// smooth surfaces, because fine vertices come to lie on flat facets, not on the surface of the
/// interpolated normals.
///
/// 3, as for geometries, flattens more tets beside folds of scans than it saves: the smallest
/// dihedral angle of a skull is then 4.2° instead of 10.3°, and 3.5° instead of 7.5° after two
/// levels (`benches/results/facets-2026-11-23.md`). 0 leaves worse refined tets on CAD
/// parts.
const HARM: f64 = 1.0;

impl Smoothness for FacetSmoothness<'_> {
    fn normal(&self, patch: PatchId, at: &Point) -> Option<Vector> {
        (!self.0.is_tip(at)).then(|| self.0.normal(patch, at))
    }

    fn tangent(&self, curve: CurveId, at: &Point) -> Option<Vector> {
        self.0.tangent(curve, at)
    }

    fn harm(&self) -> f64 {
        HARM
    }
}
