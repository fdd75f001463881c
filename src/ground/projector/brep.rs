//! Projection to the exact faces and edges of a boundary representation.

use crate::ground::kernel::nearest::{at, in_segment, in_triangle};
use crate::ground::kernel::tree::{Tree, bounds};
use crate::{Point, Vector};
use brep::{Curve, Surface, Tessellation, project_to_curve, project_to_surface};
use csg::{CurveId, PatchId, ProjectionFailed};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// Faces and edges, each with triangles or segments from which searches for nearest points start.
///
/// The start is the nearest point of the triangles of the trimmed face, so a projection finds the
/// nearest point of the face and not of another part of its surface. The result depends only on the
/// point and the entity, bit by bit, on all ranks and threads. Beyond its edges a face continues
/// along its surface: the chord of an edge that bends into its face is outside of the face.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BrepProjector {
    source: Source,
    patches: Vec<Triangles>,
    curves: Vec<Segments>,
}

/// The data of a projector, which is also what ranks exchange.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
struct Source {
    points: Vec<[f64; 3]>,
    surfaces: Vec<Face>,
    curves: Vec<Edge>,
    tolerance: f64,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Face {
    surface: Surface,
    /// Whether its normal is that of the surface reversed.
    is_reversed: bool,
    /// Vertices and parameters of its triangles.
    triangles: Vec<([u32; 3], [[f64; 2]; 3])>,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Edge {
    curve: Curve<3>,
    /// Vertices with their parameters.
    line: Vec<(u32, f64)>,
}

/// The triangles of a face.
#[derive(Clone, Debug, Default, PartialEq)]
struct Triangles {
    tree: Tree,
    corners: Vec<[Point; 3]>,
}

/// The segments of an edge.
#[derive(Clone, Debug, Default, PartialEq)]
struct Segments {
    tree: Tree,
    points: Vec<Point>,
}

/// The tolerance as a fraction of the diagonal of the box, as for analytic surfaces ...
const ON_SURFACE: f64 = 1e-12;
/// ... and relative to the largest coordinate: four units in the last place.
const COORDINATE_ROUNDING: f64 = 4.0 * f64::EPSILON;
/// Edges are sampled where they leave their faces; between samples they may be further away.
const GAP_ROOM: f64 = 1.5;

impl BrepProjector {
    /// The faces of a model with its tessellation, and those of its edges that are `curves`;
    /// `is_reversed` says which faces have normals against those of their surfaces.
    pub fn new(
        model: &brep::Model,
        tessellation: &Tessellation,
        is_reversed: &[bool],
        curves: &[usize],
    ) -> Self {
        let mut surfaces: Vec<Face> = model
            .patches
            .iter()
            .zip(is_reversed)
            .map(|(patch, &is_reversed)| Face {
                surface: patch.surface.clone(),
                is_reversed,
                triangles: Vec::new(),
            })
            .collect();
        for t in &tessellation.triangles {
            surfaces[t.patch as usize].triangles.push((t.vertices, t.parameters));
        }
        let edge =
            |&c: &usize| Edge { curve: model.curves[c].curve.clone(), line: tessellation.lines[c].clone() };
        let all = bounds(&tessellation.points);
        let largest = all.min.coords.amax().max(all.max.coords.amax());
        let rounding = f64::max(ON_SURFACE * all.diagonal(), COORDINATE_ROUNDING * largest);
        Self::of(Source {
            points: tessellation.points.iter().map(|&p| p.into()).collect(),
            surfaces,
            curves: curves.iter().map(edge).collect(),
            tolerance: rounding.max(GAP_ROOM * tessellation.gap),
        })
    }

    fn of(source: Source) -> Self {
        let point = |v: u32| Point::from(source.points[v as usize]);
        let triangles = |face: &Face| {
            let corners: Vec<[Point; 3]> = face.triangles.iter().map(|t| t.0.map(point)).collect();
            Triangles { tree: Tree::new(&corners.iter().map(bounds).collect::<Vec<_>>()), corners }
        };
        let segments = |edge: &Edge| {
            let points: Vec<Point> = edge.line.iter().map(|&(v, _)| point(v)).collect();
            Segments { tree: Tree::new(&points.windows(2).map(bounds).collect::<Vec<_>>()), points }
        };
        let patches = source.surfaces.par_iter().map(triangles).collect();
        let curves = source.curves.par_iter().map(segments).collect();
        Self { source, patches, curves }
    }

    /// The maximum distance of a projected point from its face or, on an edge, from the faces
    /// beside it (length).
    pub fn tolerance(&self) -> f64 {
        self.source.tolerance
    }

    /// The start of a search on a face: the parameters of the nearest point of its triangles.
    fn start(&self, patch: PatchId, point: &Point) -> [f64; 2] {
        let Triangles { tree, corners } = &self.patches[patch.index()];
        let squared = |i: u32| {
            let triangle = &corners[i as usize];
            (at(triangle, in_triangle(point, triangle)) - point).norm_squared()
        };
        let (nearest, _) = tree.nearest(point, squared).expect("a face has triangles");
        let weights = in_triangle(point, &corners[nearest as usize]);
        let parameters = &self.source.surfaces[patch.index()].triangles[nearest as usize].1;
        [0, 1].map(|i| (0..3).map(|k| weights[k] * parameters[k][i]).sum())
    }

    fn foot(&self, patch: PatchId, point: &Point) -> brep::SurfaceFoot {
        let start = self.start(patch, point);
        project_to_surface(&self.source.surfaces[patch.index()].surface, point, start)
    }

    /// The point of the surface of `patch` nearest to `point`, near the face.
    ///
    /// # Errors
    /// [`ProjectionFailed`] if the search does not converge.
    pub fn project_patch(&self, patch: PatchId, point: &Point) -> Result<Point, ProjectionFailed> {
        let foot = self.foot(patch, point);
        if foot.is_converged { Ok(foot.point) } else { Err(ProjectionFailed(*point)) }
    }

    /// The nearest segment of an edge and the parameter there.
    fn start_on_curve(&self, curve: CurveId, point: &Point) -> f64 {
        let Segments { tree, points } = &self.curves[curve.index()];
        let on = |i: u32| in_segment(point, &points[i as usize], &points[i as usize + 1]);
        let (nearest, _) = tree.nearest(point, |i| on(i).1).expect("an edge has segments");
        let line = &self.source.curves[curve.index()].line;
        let (low, high) = (line[nearest as usize].1, line[nearest as usize + 1].1);
        low + on(nearest).0 * (high - low)
    }

    fn foot_on_curve(&self, curve: CurveId, point: &Point) -> brep::CurveFoot {
        let edge = &self.source.curves[curve.index()];
        let mut range = [edge.line[0].1, edge.line[edge.line.len() - 1].1];
        if let (Some(period), true) =
            (edge.curve.period(), edge.line[0].0 == edge.line[edge.line.len() - 1].0)
        {
            // A whole period: its end is no end.
            range = [range[0] - period, range[1] + period];
        }
        project_to_curve(&edge.curve, range, point, self.start_on_curve(curve, point))
    }

    /// The point of `curve` nearest to `point`.
    ///
    /// # Errors
    /// [`ProjectionFailed`] if the search does not converge.
    pub fn project_curve(&self, curve: CurveId, point: &Point) -> Result<Point, ProjectionFailed> {
        let foot = self.foot_on_curve(curve, point);
        if foot.is_converged { Ok(foot.point) } else { Err(ProjectionFailed(*point)) }
    }

    /// The distance of `point` from the surface of `patch`.
    pub fn patch_distance(&self, patch: PatchId, point: &Point) -> f64 {
        (self.foot(patch, point).point - point).norm()
    }

    /// The unit normal of a patch near a point, away from the body behind it; `None` at poles.
    pub fn normal(&self, patch: PatchId, near: &Point) -> Option<Vector> {
        let normal = self.foot(patch, near).normal;
        let sign = if self.source.surfaces[patch.index()].is_reversed { -1.0 } else { 1.0 };
        (normal != Vector::zeros()).then(|| normal * sign)
    }

    /// The unit tangent of a curve near a point.
    pub fn tangent(&self, curve: CurveId, near: &Point) -> Option<Vector> {
        Some(self.foot_on_curve(curve, near).tangent).filter(|t| *t != Vector::zeros())
    }

    /// The name of the kind of a patch's surface.
    pub fn kind(&self, patch: PatchId) -> &'static str {
        self.source.surfaces[patch.index()].surface.kind()
    }

    /// Whether a patch is plane.
    pub fn is_flat_patch(&self, patch: PatchId) -> bool {
        self.source.surfaces[patch.index()].surface.is_plane()
    }

    /// Whether a curve is straight.
    pub fn is_straight_curve(&self, curve: CurveId) -> bool {
        matches!(self.source.curves[curve.index()].curve, Curve::Line { .. })
    }

    /// Encodes the projector for other ranks, as JSON.
    pub fn encode(&self) -> Vec<u8> {
        serde_json::to_vec(&self.source).expect("plain data")
    }

    /// The inverse of [`encode`](Self::encode); `None` if the bytes are invalid.
    pub fn decode(bytes: &[u8]) -> Option<Self> {
        let source: Source = serde_json::from_slice(bytes).ok()?;
        let exists = |v: u32| (v as usize) < source.points.len();
        let face = |f: &Face| {
            f.surface.is_sound()
                && !f.triangles.is_empty()
                && f.triangles.iter().all(|t| t.0.into_iter().all(exists))
        };
        let edge = |e: &Edge| e.curve.is_sound() && e.line.len() >= 2 && e.line.iter().all(|on| exists(on.0));
        (source.surfaces.iter().all(face) && source.curves.iter().all(edge)).then(|| Self::of(source))
    }
}
