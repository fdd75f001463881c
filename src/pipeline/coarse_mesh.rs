//! A coarse mesh and its statistics.

use crate::ground::mesh::{Mesh, QualitySummary};
use crate::mesher::facets::{MergedSmall, SharpPlaces};
use crate::mesher::model::CsgModel;
use crate::mesher::surface::closeness::ThinRegions;
use crate::parallel::refine::EdgeDisplacements;

/// A coarse mesh with its statistics.
#[derive(Clone, Debug, Default)]
pub struct CoarseMesh {
    /// The mesh.
    pub mesh: Mesh,
    /// Edge displacements for refinement, by the edge ids that distribution assigns.
    pub displacements: EdgeDisplacements,
    /// Its statistics.
    pub report: CoarseReport,
}

/// Statistics of a coarse mesh.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize)]
pub struct CoarseReport {
    /// Vertices.
    pub vertices: u64,
    /// Tets.
    pub tets: u64,
    /// Triangles on patches.
    pub boundary: u64,
    /// Segments on curves.
    pub segments: u64,
    /// Shape quality of the tets.
    pub quality: QualitySummary,
    /// Number of tets that would have been inverted by refinement and snapping, and were repaired.
    pub illegal_repaired: u64,
    /// Number of such tets left.
    pub illegal_left: u64,
    /// Steiner points inside bodies that the boundary recovery needed.
    pub steiner_points: u64,
    /// Number of restarts with smaller sizes, where surfaces were too close to each other or
    /// refined tets would have been inverted.
    pub size_corrections: u64,
    /// Number of edges that refinement curves to avoid inverted or poor tets.
    pub curved_edges: u64,
    /// Thin regions in which the sizes were lowered.
    pub thin_regions: ThinRegions,
    /// Cusps without angle that were cut off bodies.
    pub cut_cusps: Vec<CutCusp>,
    /// Places where the triangles of the input are sharper than 10°.
    pub sharp_places: SharpPlaces,
    /// The volume inside of the triangles of the input, or of those that approximate the faces of a
    /// CAD file; null for other geometries.
    pub facets_volume: Option<f64>,
    /// Faces and edges of a CAD file that were merged because they are smaller than the elements.
    pub merged_small: MergedSmall,
}

/// A cusp without angle that was cut off bodies.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct CutCusp {
    /// A point where the surfaces touch.
    pub point: [f64; 3],
    /// The radius of the ball around the point, or of the tube around the curve of contact.
    pub radius: f64,
    /// Whether the surfaces touch along a curve.
    pub is_curve: bool,
    /// The number of the body that was cut; null for all.
    pub body: Option<u32>,
}

impl CutCusp {
    pub(super) fn of(model: &CsgModel) -> Vec<Self> {
        let body = |id: csg::BodyId| model.geometry.bodies[id.index()].number;
        let cusps = model.cut_cusps.iter().map(|cusp| Self {
            point: cusp.place.0.into(),
            radius: cusp.radius,
            is_curve: cusp.is_curve,
            body: cusp.body.as_ref().map(|cut| body(cut.0)),
        });
        cusps.collect()
    }
}
