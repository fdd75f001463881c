//! The facets unchanged as the surface mesh.

use super::FacetModel;
use crate::ground::mesh::{Class, Segment, VertexId};
use crate::mesher::surface::SurfaceMesh;
use csg::{CornerId, CurveId};

/// The facets unchanged, classified on patches, curves and corners. Vertices are the model's
/// points, in their order.
pub fn keep(model: &FacetModel) -> SurfaceMesh {
    // Every point is used by a facet; classes of lower dimension overwrite the others.
    let mut classes = vec![Class::Corner(CornerId(0)); model.points.len()];
    for triangle in &model.triangles {
        triangle.vertices.iter().for_each(|v| classes[v.index()] = Class::Patch(triangle.patch));
    }
    let mut segments = Vec::new();
    for (i, curve) in model.curves.iter().enumerate() {
        let id = CurveId::new(i);
        curve.vertices.iter().for_each(|&v| classes[v as usize] = Class::Curve(id));
        segments.extend(
            curve
                .vertices
                .windows(2)
                .map(|w| Segment { vertices: [VertexId(w[0]), VertexId(w[1])], curve: id }),
        );
    }
    for (i, &v) in model.corners.iter().enumerate() {
        classes[v as usize] = Class::Corner(CornerId::new(i));
    }
    SurfaceMesh { points: model.points.clone(), classes, segments, triangles: model.triangles.clone() }
}
