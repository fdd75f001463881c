//! Corners, curves and patches of the bodies of a geometry.

use crate::{Aabb, BodyId, CornerId, CurveId, PatchId, Point, SurfaceId};

/// A point where curves end, or a vertex of its own (`point`, the apex of a cone).
#[derive(Clone, Debug)]
pub struct Corner {
    /// Where it is.
    pub point: Point,
    /// The surfaces through it, ascending.
    pub surfaces: Vec<SurfaceId>,
}

/// A patch beside a curve: which one, and on which side.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Fin {
    /// The patch.
    pub patch: PatchId,
    /// Whether the patch lies to the left for one who walks along the curve in its direction with
    /// the patch's normal up (see [`Patch::flipped`] for the normal). Its boundary then has the curve forward.
    pub forward: bool,
}

/// A smooth piece of the intersection of two surfaces where patches meet.
#[derive(Clone, Debug)]
pub struct Curve {
    /// The two surfaces, ascending.
    pub surfaces: [SurfaceId; 2],
    /// The corners at its start and end (they may be the same), `None` where it is closed and smooth.
    pub ends: Option<[CornerId; 2]>,
    /// Points on the curve from its start to its end, exact within rounding, so dense that the curve
    /// turns by less than a quarter radian between two of them. A closed one repeats its first point at its end.
    pub trace: Vec<Point>,
    /// The patches that have it on their boundary: at most one each of (patch, direction).
    pub fins: Vec<Fin>,
}

/// The pieces of one surface that separate the same two regions.
#[derive(Clone, Debug)]
pub struct Patch {
    /// The surface.
    pub surface: SurfaceId,
    /// False: its normal is the gradient of the surface; true: the opposite.
    /// The normal points from `inside` to `outside`.
    pub flipped: bool,
    /// The body behind its normal (never `None` on both sides; for an outer patch `inside` is the body).
    pub inside: Option<BodyId>,
    /// The body in front of it, `None` for the exterior.
    pub outside: Option<BodyId>,
    /// Its boundary: curves, and whether each is run in its own direction with the patch on the left.
    /// Empty for a whole closed surface (sphere, torus, ellipsoid).
    pub boundary: Vec<(CurveId, bool)>,
    /// A point in the relative interior of each of its pieces that has no boundary curve, to begin a front from.
    pub seeds: Vec<Point>,
    /// Boundary-condition number, from 1; unique per patch unless the file gives one to several.
    pub bc: u32,
    /// Boundary name.
    pub name: String,
}

/// The geometric entities of a geometry.
#[derive(Clone, Debug)]
pub struct Features {
    /// The corners.
    pub corners: Vec<Corner>,
    /// The curves.
    pub curves: Vec<Curve>,
    /// The patches.
    pub patches: Vec<Patch>,
    /// The box of the bodies, computed.
    pub bounds: Aabb,
}

impl Features {
    /// The curve with this id.
    pub fn curve(&self, id: CurveId) -> &Curve {
        &self.curves[id.index()]
    }
    /// The patch with this id.
    pub fn patch(&self, id: PatchId) -> &Patch {
        &self.patches[id.index()]
    }
    /// The corner with this id.
    pub fn corner(&self, id: CornerId) -> &Corner {
        &self.corners[id.index()]
    }
}

/// Why the features could not be found.
#[derive(Clone, Debug, thiserror::Error)]
pub enum FeatureError {}
