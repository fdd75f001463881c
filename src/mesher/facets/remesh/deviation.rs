//! Deviation of a surface mesh from its facets.

use crate::ground::projector::facets::{FacetProjector, Source};
use crate::mesher::facets::FacetModel;
use crate::mesher::surface::SurfaceMesh;
use crate::{Point, Vector};
use csg::PatchId;

/// The largest distances of the mesh from the facets of each patch, and of the facets from the
/// mesh's triangles on that patch (lengths).
///
/// They are sampled at corners, edge midpoints and centroids of triangles.
pub fn deviation(model: &FacetModel, mesh: &SurfaceMesh) -> [f64; 2] {
    let triangles: Vec<([u32; 3], PatchId)> =
        mesh.triangles.iter().map(|t| (t.vertices.map(|v| v.0), t.patch)).collect();
    let of_mesh = FacetProjector::new(Source {
        points: mesh.points.clone(),
        triangles: triangles.iter().map(|t| t.0).collect(),
        patch_of: triangles.iter().map(|t| t.1.0).collect(),
        patches: model.patches.len() as u32,
        ..Source::default()
    });
    let facets = model.triangles.iter().map(|t| (t.vertices.map(|v| model.points[v.index()]), t.patch));
    let own = triangles.iter().map(|&(v, patch)| (v.map(|v| mesh.points[v as usize]), patch));
    [farthest(own, &model.projector), farthest(facets, &of_mesh)]
}

fn farthest(triangles: impl Iterator<Item = ([Point; 3], PatchId)>, from: &FacetProjector) -> f64 {
    let farthest_of = |([a, b, c], patch): ([Point; 3], PatchId)| {
        let mean =
            |some: &[Point]| Point::from(some.iter().map(|p| p.coords).sum::<Vector>() / some.len() as f64);
        let samples = [a, b, c, mean(&[a, b]), mean(&[b, c]), mean(&[c, a]), mean(&[a, b, c])];
        samples.iter().map(|p| from.facet_distance(patch, p)).fold(0.0, f64::max)
    };
    triangles.map(farthest_of).fold(0.0, f64::max)
}
