//! Volume meshing: Delaunay tetrahedra inside a closed surface that is kept exactly.

mod cavity;
pub mod closed_surface;
mod delaunay;
mod sectors;
mod tetrahedra;

pub use closed_surface::ClosedSurface;

use crate::Point;
use csg::BodyId;

/// Tets that fill the bodies of a [`ClosedSurface`].
#[derive(Clone, Debug, Default)]
pub struct VolumeMesh {
    /// The points of the surface, unchanged and in order, then those inside.
    pub points: Vec<Point>,
    /// The tets, positively oriented; their faces on the boundary are the surface's triangles, exactly.
    pub tets: Vec<[u32; 4]>,
    /// The body of each tet.
    pub bodies: Vec<BodyId>,
}
