//! Surface meshing: curves into segments, patches into triangles.

pub mod curves;

use crate::Point;
use crate::mesh::{BoundaryTriangle, Class, Segment};

/// A classified triangulation of all patches: vertices on corners, curves and patches, segments on curves.
///
/// Before the patches are meshed: the same without triangles and without vertices on patches.
#[derive(Clone, Debug, Default)]
pub struct SurfaceMesh {
    /// The vertices' coordinates.
    pub points: Vec<Point>,
    /// What each vertex lies on (never a body).
    pub classes: Vec<Class>,
    /// The edges on curves: by curve, and within a curve in its order and direction.
    pub segments: Vec<Segment>,
    /// The triangles, with normals from the patch's `inside` to its `outside`.
    pub triangles: Vec<BoundaryTriangle>,
}
