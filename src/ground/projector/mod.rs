//! Projection to patches and curves: all that refinement, the check and other ranks know of a
//! geometry.

pub mod brep;
pub mod facets;

pub use brep::BrepProjector;
pub use facets::FacetProjector;

use crate::Point;
use csg::{CurveId, PatchId, ProjectionFailed};

/// Projection of points to the patches and curves that they are classified on.
///
/// The result depends only on the point and the entity, bit by bit, on all ranks and threads.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum Projector {
    /// The surfaces of a CSG geometry.
    Csg(csg::Projector),
    /// Triangles that approximate the surface.
    Facets(FacetProjector),
    /// The faces and edges of a boundary representation.
    Brep(BrepProjector),
    /// The faces of a mesh without geometry: points on them are not moved.
    #[default]
    Flat,
}

impl From<csg::Projector> for Projector {
    fn from(projector: csg::Projector) -> Self {
        Self::Csg(projector)
    }
}

impl From<FacetProjector> for Projector {
    fn from(projector: FacetProjector) -> Self {
        Self::Facets(projector)
    }
}

impl From<BrepProjector> for Projector {
    fn from(projector: BrepProjector) -> Self {
        Self::Brep(projector)
    }
}

/// The first byte of an encoded projector.
const CSG: u8 = 0;
const FACETS: u8 = 1;
const FLAT: u8 = 2;
const BREP: u8 = 3;

impl Projector {
    /// The maximum distance of a projected point from its patch or curve (length).
    pub fn tolerance(&self) -> f64 {
        match self {
            Self::Csg(projector) => projector.tolerance(),
            Self::Facets(projector) => projector.tolerance(),
            Self::Brep(projector) => projector.tolerance(),
            Self::Flat => 0.0,
        }
    }

    /// The point of `patch` nearest to `point`.
    ///
    /// # Errors
    /// [`ProjectionFailed`] if no nearest point is found, as at the centre of a sphere.
    #[inline]
    pub fn project_patch(&self, patch: PatchId, point: &Point) -> Result<Point, ProjectionFailed> {
        match self {
            Self::Csg(projector) => projector.project_patch(patch, point),
            Self::Facets(projector) => Ok(projector.project_patch(patch, point)),
            Self::Brep(projector) => projector.project_patch(patch, point),
            Self::Flat => Ok(*point),
        }
    }

    /// The point of `curve` nearest to `point`, to first order.
    ///
    /// # Errors
    /// [`ProjectionFailed`] if no nearest point is found.
    #[inline]
    pub fn project_curve(&self, curve: CurveId, point: &Point) -> Result<Point, ProjectionFailed> {
        match self {
            Self::Csg(projector) => projector.project_curve(curve, point),
            Self::Facets(projector) => Ok(projector.project_curve(curve, point)),
            Self::Brep(projector) => projector.project_curve(curve, point),
            Self::Flat => Ok(*point),
        }
    }

    /// The distance of `point` from `patch`, to first order.
    pub fn patch_distance(&self, patch: PatchId, point: &Point) -> f64 {
        match self {
            Self::Csg(projector) => projector.patch_distance(patch, point),
            Self::Facets(projector) => projector.patch_distance(patch, point),
            Self::Brep(projector) => projector.patch_distance(patch, point),
            Self::Flat => 0.0,
        }
    }

    /// Whether means of points of `patch` lie on it, so that they need no projection.
    pub fn is_flat_patch(&self, patch: PatchId) -> bool {
        match self {
            Self::Csg(projector) => is_plane(projector.patch_surface(patch)),
            Self::Facets(projector) => projector.is_flat_patch(patch),
            Self::Brep(projector) => projector.is_flat_patch(patch),
            Self::Flat => true,
        }
    }

    /// Whether `patch` has several surfaces, between which the nearest one changes.
    pub fn is_composite_patch(&self, patch: PatchId) -> bool {
        matches!(self, Self::Brep(projector) if projector.is_composite_patch(patch))
    }

    /// Whether means of points of `curve` lie on it, so that they need no projection.
    pub fn is_straight_curve(&self, curve: CurveId) -> bool {
        match self {
            Self::Csg(projector) => projector.curve_surfaces(curve).into_iter().all(is_plane),
            Self::Facets(projector) => projector.is_straight_curve(curve),
            Self::Brep(projector) => projector.is_straight_curve(curve),
            Self::Flat => true,
        }
    }

    /// Encodes the projector for other ranks: one byte for the kind, then the bytes of the
    /// projector.
    pub fn encode(&self) -> Vec<u8> {
        let (kind, content) = match self {
            Self::Csg(projector) => (CSG, bytemuck::cast_slice(&projector.encode()).to_vec()),
            Self::Facets(projector) => (FACETS, projector.encode()),
            Self::Brep(projector) => (BREP, projector.encode()),
            Self::Flat => (FLAT, Vec::new()),
        };
        [vec![kind], content].concat()
    }

    /// The inverse of [`encode`](Self::encode); `None` if the bytes are invalid.
    pub fn decode(bytes: &[u8]) -> Option<Self> {
        match bytes.split_first()? {
            (&CSG, content) if content.len() % size_of::<f64>() == 0 => {
                csg::Projector::decode(&bytemuck::pod_collect_to_vec::<u8, f64>(content)).map(Self::Csg)
            }
            (&FACETS, content) => FacetProjector::decode(content).map(Self::Facets),
            (&BREP, content) => BrepProjector::decode(content).map(Self::Brep),
            (&FLAT, []) => Some(Self::Flat),
            _ => None,
        }
    }
}

fn is_plane(surface: &csg::Surface) -> bool {
    matches!(surface, csg::Surface::Plane(_))
}
