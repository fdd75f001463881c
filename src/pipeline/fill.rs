//! Fills the bodies inside a surface mesh, and improves the result.

use super::coarse_error::CoarseError;
use super::coarse_mesh::{CoarseMesh, CoarseReport};
use crate::Point;
use crate::ground::mesh::{Class, Mesh, Segment, Touching, VertexId, are_sides};
use crate::ground::size::SizeField;
use crate::mesher::improve::{self, Effort, Measure, Smoothness};
use crate::mesher::surface::SurfaceMesh;
use crate::mesher::volume::{self, ClosedSurface};
use crate::parallel::refine::EdgeDisplacements;
use csg::{BodyId, PatchId};

/// Up to this many tets the careful effort takes less than a second, and refinement multiplies its
/// effect.
const FEW_TETS: usize = 100_000;

fn effort_for(tets: usize) -> Effort {
    if tets <= FEW_TETS { Effort::Careful } else { Effort::Standard }
}

/// Fraction of the time after which the surface mesh is done, for a coarse mesh of 100,000 tets.
pub(super) const SURFACE_SHARE: f64 = 0.2;
/// Fraction of the time after which the bodies are filled.
const VOLUME_SHARE: f64 = 0.4;

/// How the tets of a coarse mesh are improved.
pub(super) struct Improvement<'a> {
    /// By the number of tets if `None`.
    pub effort: Option<Effort>,
    /// Whether the mesh will be neither refined nor curved.
    pub is_final: bool,
    /// The smoothness of the geometry, if it is known; not used for final meshes.
    pub smoothness: Option<&'a dyn Smoothness>,
}

impl Improvement<'_> {
    fn apply(&self, mesh: &mut Mesh, size: &dyn SizeField) -> improve::Report {
        let measure = if self.is_final { Measure::MeanRatio } else { Measure::Refined };
        let effort = self.effort.unwrap_or_else(|| effort_for(mesh.tets.len()));
        let smoothness = self.smoothness.filter(|_| !self.is_final);
        improve::improve_for(mesh, size, smoothness, &improve::Settings::of(effort, measure))
    }
}

/// Fills the bodies inside a surface mesh, and improves the result. `regions` returns the bodies
/// behind and in front of a patch; bodies that touch are filled each by itself.
pub(super) fn fill(
    surface: SurfaceMesh,
    regions: impl Fn(PatchId) -> [Option<BodyId>; 2],
    touching: &Touching,
    size: &dyn SizeField,
    how: &Improvement,
) -> Result<CoarseMesh, CoarseError> {
    size.work().proceed()?;
    size.work().step(SURFACE_SHARE, VOLUME_SHARE, 1);
    let common = common_edges(&surface);
    if !common.is_empty() {
        return Err(CoarseError::CommonEdges { middles: common });
    }
    let (mut mesh, volume) = fill_bodies(surface, regions, touching, size)?;
    size.work().proceed()?;
    size.work().step(VOLUME_SHARE, 1.0, 1);
    let improved = how.apply(&mut mesh, size);
    size.work().proceed()?;
    let report = CoarseReport {
        vertices: mesh.points.len() as u64,
        tets: mesh.tets.len() as u64,
        boundary: mesh.triangles.len() as u64,
        segments: mesh.segments.len() as u64,
        illegal_repaired: improved.illegal_before.saturating_sub(improved.illegal_left) as u64,
        illegal_left: improved.illegal_left as u64,
        quality: improved.after,
        steiner_points: volume.steiner_inside as u64,
        ..CoarseReport::default()
    };
    Ok(CoarseMesh { mesh, report, displacements: EdgeDisplacements::default() })
}

/// The midpoints of edges that triangles of different patches have in common, but no curve.
///
/// Between two curves a patch has edges straight across; so has another patch between the same
/// curves if both are almost flat there. The space between them would have no thickness.
fn common_edges(surface: &SurfaceMesh) -> Vec<Point> {
    let is_inside = |v: VertexId| matches!(surface.classes[v.index()], Class::Patch(_));
    let sorted = |[a, b]: [VertexId; 2]| [a.min(b), a.max(b)];
    let mut on_curves: Vec<[VertexId; 2]> = surface.segments.iter().map(|s| sorted(s.vertices)).collect();
    on_curves.sort_unstable();
    let mut across: Vec<([VertexId; 2], PatchId)> = Vec::new();
    for triangle in &surface.triangles {
        let [a, b, c] = triangle.vertices;
        let sides = [[a, b], [b, c], [c, a]].into_iter().filter(|side| !side.iter().any(|&v| is_inside(v)));
        across.extend(sides.map(|side| (sorted(side), triangle.patch)));
    }
    across.sort_unstable();
    across.dedup();
    let common = across.chunk_by(|x, y| x.0 == y.0).filter(|group| group.len() > 1).map(|group| group[0].0);
    let off_curves = common.filter(|edge| on_curves.binary_search(edge).is_err());
    off_curves
        .map(|edge| nalgebra::center(&surface.points[edge[0].index()], &surface.points[edge[1].index()]))
        .collect()
}

/// Fills the bodies inside a surface mesh.
fn fill_bodies(
    surface: SurfaceMesh,
    regions: impl Fn(PatchId) -> [Option<BodyId>; 2],
    touching: &Touching,
    size: &dyn SizeField,
) -> Result<(Mesh, volume::Report), CoarseError> {
    // User points inside a body are on no triangle: the volume mesher receives them separately and
    // numbers them after the others.
    let mut used = vec![false; surface.points.len()];
    for triangle in &surface.triangles {
        triangle.vertices.iter().for_each(|v| used[v.index()] = true);
    }
    let order: Vec<usize> = {
        let (on, inside): (Vec<usize>, Vec<usize>) = (0..used.len()).partition(|&v| used[v]);
        on.into_iter().chain(inside).collect()
    };
    let on_surface = used.iter().filter(|&&used| used).count();
    let mut old_to_new = vec![VertexId::default(); used.len()];
    order.iter().enumerate().for_each(|(new, &old)| old_to_new[old] = VertexId::new(new));
    let renumbered = |v: VertexId| old_to_new[v.index()];

    let points: Vec<Point> = order.iter().map(|&v| surface.points[v]).collect();
    let mut classes: Vec<Class> = order.iter().map(|&v| surface.classes[v]).collect();
    let mut triangles = surface.triangles;
    triangles.iter_mut().for_each(|t| t.vertices = t.vertices.map(renumbered));
    let mut segments = surface.segments;
    segments.iter_mut().for_each(|s| s.vertices = s.vertices.map(renumbered));
    let is_side = are_sides(&segments, &triangles);
    let (sides, loose): (Vec<_>, Vec<_>) = segments.into_iter().zip(is_side).partition(|(_, side)| *side);
    let [mut segments, loose] =
        [sides, loose].map(|part| part.into_iter().map(|(s, _)| s).collect::<Vec<_>>());

    let corners: Vec<[u32; 3]> = triangles.iter().map(|t| t.vertices.map(|v| v.0)).collect();
    let beside = triangles.iter().map(|t| regions(t.patch)).collect();
    let on_triangles = points[..on_surface].to_vec();
    let closed = ClosedSurface::of_touching(on_triangles, corners.clone(), beside, touching)
        .map_err(|faults| {
            let crossing = volume::middles_of_sides(&points, &corners, faults.crossings());
            CoarseError::NotClosed { faults, crossing }
        })?
        .with_kept_points(points[on_surface..].to_vec())
        .with_kept_edges(loose.iter().map(|s| s.vertices.map(|v| v.0)).collect());
    let (filled, report) = volume::mesh(&closed, size, &volume::Settings::default())?;

    classes.resize(filled.points.len(), Class::Corner(csg::CornerId(u32::MAX)));
    for (tet, body) in filled.tets.iter().zip(&filled.bodies) {
        for v in tet.iter().filter(|&&v| v as usize >= order.len()) {
            classes[*v as usize] = Class::Body(*body);
        }
    }
    for (edge, i) in filled.kept_edges {
        let curve = loose[i as usize].curve;
        for v in edge.into_iter().filter(|&v| v as usize >= order.len()) {
            classes[v as usize] = Class::Curve(curve);
        }
        segments.push(Segment { vertices: edge.map(VertexId), curve });
    }
    let mesh = Mesh {
        points: filled.points,
        classes,
        tets: filled.tets.into_iter().map(|t| t.map(VertexId)).collect(),
        bodies: filled.bodies,
        triangles,
        segments,
    };
    Ok((mesh, report))
}
