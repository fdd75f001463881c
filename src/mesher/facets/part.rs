//! A part of a surface mesh as a model.

use super::{FacetCurve, FacetModel, FacetPatch};
use crate::Point;
use crate::ground::kernel::tree;
use crate::ground::mesh::{BoundaryTriangle, Touching};
use crate::ground::projector::facets::{FacetProjector, Source, normals};

/// Triangles of a surface with their patches and curves; it need not be closed.
#[derive(Clone, Debug, Default)]
pub struct SurfacePart {
    /// The points, each used by a triangle.
    pub points: Vec<Point>,
    /// The triangles.
    pub triangles: Vec<BoundaryTriangle>,
    /// The vertices that must stay, ascending.
    pub corners: Vec<u32>,
    /// The edges where patches or the part end, or curves run.
    pub curves: Vec<FacetCurve>,
    /// The patches.
    pub patches: Vec<FacetPatch>,
}

impl From<SurfacePart> for FacetModel {
    fn from(part: SurfacePart) -> Self {
        let SurfacePart { points, triangles, corners, curves, patches } = part;
        let mut on_curves = vec![false; points.len()];
        curves.iter().flat_map(|curve| &curve.vertices).for_each(|&v| on_curves[v as usize] = true);
        let projector = FacetProjector::new(Source {
            points: points.clone(),
            triangles: triangles.iter().map(|t| t.vertices.map(|v| v.0)).collect(),
            patch_of: triangles.iter().map(|t| t.patch.0).collect(),
            patches: patches.len() as u32,
            curves: curves.iter().map(|curve| curve.vertices.clone()).collect(),
            tips: corners.iter().copied().filter(|&v| !on_curves[v as usize]).collect(),
        });
        Self {
            bounds: tree::bounds(&points),
            rounding: normals::rounding(&points),
            projector,
            points,
            triangles,
            corners,
            curves,
            patches,
            bodies: Vec::new(),
            merged: None,
            blunt: Vec::new(),
            touching: Touching::default(),
        }
    }
}
