//! Projection of points to patches and curves: all that refinement needs to know of a geometry.

use crate::{CurveId, Features, Geometry, PatchId, Point, Surface, SurfaceId};

/// A projection that did not converge.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("the point ({}, {}, {}) has no nearest point there that Newton's method finds", .0.x, .0.y, .0.z)]
pub struct ProjectionFailed(pub Point);

/// The surfaces of patches and curves, and projection to them.
///
/// Small, and made of plain numbers: every rank has one. Projection is a function of the point and the
/// entity alone, bit for bit the same on all ranks and threads.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Projector {
    surfaces: Vec<Surface>,
    curves: Vec<[SurfaceId; 2]>,
    patches: Vec<SurfaceId>,
}

impl Projector {
    /// Takes what it needs of a geometry.
    pub fn new(geometry: &Geometry, features: &Features) -> Self {
        Self {
            surfaces: geometry.surfaces.clone(),
            curves: features.curves.iter().map(|c| c.surfaces).collect(),
            patches: features.patches.iter().map(|p| p.surface).collect(),
        }
    }

    /// The point of the surface of `patch` nearest to `point`.
    pub fn project_patch(&self, _patch: PatchId, _point: &Point) -> Result<Point, ProjectionFailed> {
        todo!()
    }

    /// The point of both surfaces of `curve` nearest to `point`.
    pub fn project_curve(&self, _curve: CurveId, _point: &Point) -> Result<Point, ProjectionFailed> {
        todo!()
    }

    /// The distance of `point` from the surface of `patch`, to first order.
    pub fn patch_distance(&self, _patch: PatchId, _point: &Point) -> f64 {
        todo!()
    }

    /// The larger of the distances of `point` from the two surfaces of `curve`, to first order.
    pub fn curve_distance(&self, _curve: CurveId, _point: &Point) -> f64 {
        todo!()
    }

    /// The surface of `patch`.
    pub fn patch_surface(&self, patch: PatchId) -> &Surface {
        &self.surfaces[self.patches[patch.index()].index()]
    }

    /// The two surfaces of `curve`.
    pub fn curve_surfaces(&self, curve: CurveId) -> [&Surface; 2] {
        self.curves[curve.index()].map(|surface| &self.surfaces[surface.index()])
    }

    /// Everything as plain numbers, to be sent to other ranks.
    pub fn encode(&self) -> Vec<f64> {
        todo!()
    }

    /// The inverse of [`encode`](Self::encode); `None` for anything else.
    pub fn decode(_numbers: &[f64]) -> Option<Self> {
        todo!()
    }
}
