//! The smoothness of a geometry by its projector, which all ranks have.

use super::facets::FacetSmoothness;
use super::improve::{Smoothness, surface_normal, tangent_of_normals};
use crate::ground::projector::{BrepProjector, Projector};
use crate::{Point, Vector};
use csg::{CurveId, PatchId};

/// The smoothness of what a projector projects to; `None` if it moves no point.
pub fn smoothness(projector: &Projector) -> Option<Box<dyn Smoothness + '_>> {
    match projector {
        Projector::Csg(projector) => Some(Box::new(CsgSmoothness(projector))),
        Projector::Facets(projector) => Some(Box::new(FacetSmoothness(projector))),
        Projector::Brep(projector) => Some(Box::new(BrepSmoothness(projector))),
        Projector::Flat => None,
    }
}

/// The smoothness of the surfaces of a CSG geometry. Curves in which two surfaces touch have no
/// tangent here: the projector has no trace of them.
struct CsgSmoothness<'a>(&'a csg::Projector);

impl Smoothness for CsgSmoothness<'_> {
    fn normal(&self, patch: PatchId, at: &Point) -> Option<Vector> {
        surface_normal(self.0.patch_surface(patch), at)
    }

    fn tangent(&self, curve: CurveId, at: &Point) -> Option<Vector> {
        tangent_of_normals(self.0.curve_surfaces(curve), at)
    }
}

/// The smoothness of the faces and edges of a boundary representation. Poles have no normal.
#[derive(Clone, Copy)]
pub struct BrepSmoothness<'a>(pub &'a BrepProjector);

impl Smoothness for BrepSmoothness<'_> {
    fn normal(&self, patch: PatchId, at: &Point) -> Option<Vector> {
        self.0.normal(patch, at)
    }

    fn tangent(&self, curve: CurveId, at: &Point) -> Option<Vector> {
        self.0.tangent(curve, at)
    }
}
