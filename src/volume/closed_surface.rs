//! The input of the volume mesher: a triangulation that bounds bodies.

use crate::Point;
use csg::BodyId;

/// Triangles that bound bodies without gap: checked when made.
#[derive(Clone, Debug, Default)]
pub struct ClosedSurface {
    pub(crate) points: Vec<Point>,
    pub(crate) triangles: Vec<[u32; 3]>,
    pub(crate) regions: Vec<[Option<BodyId>; 2]>,
}
