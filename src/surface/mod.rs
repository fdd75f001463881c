//! Surface meshing: curves into segments, patches into triangles.
//!
//! [`mesh_patches`] takes the segments of all curves and fills each patch with triangles. A patch is meshed by itself, in
//! the **chart** of its surface (`chart`), in which the signs of triangles are exact:
//!
//! 1. `embed`: the triangulation of its boundary vertices in which all segments are edges, carved to the inside;
//! 2. `condition`: where that is far from parallel to the surface, it is cut first;
//! 3. `front`: new vertices advance in layers from the boundary inward, at the distance that the size field wants;
//! 4. `improve`: swaps, moves, collapses and splits, and the repair of triangles that would flatten in refinement.
//!
//! At every moment the triangles are an embedding in the chart, so no stage can leave a hole or an overlap. What is
//! *not* guaranteed is the shape of triangles where segments are far longer than the gaps between curves; segments that cross
//! in the chart, because curves are cut too coarsely there, are an error that says where. Where a surface bends sharply and the
//! size field is not graded accordingly (the rim of a very flat ellipsoid), triangles may look away from the surface:
//! [`Report::worst_normal`] is 90° or more then, and [`SurfaceMesh::check`] names them.

mod chart;
pub mod check;
pub mod closeness;
mod condition;
pub mod curves;
mod cusp;
mod embed;
mod error;
mod front;
mod improve;
pub mod narrow;
mod patch;
pub(crate) mod plane;
mod report;
mod sheet;
#[cfg(test)]
mod tests;
mod topology;

pub use check::SurfaceFault;
pub use error::SurfaceError;
pub use patch::mesh_patches;
pub use report::{PatchReport, Report};

use crate::Point;
use crate::mesh::{BoundaryTriangle, Class, Segment};
use crate::volume::{intersections, middles_of_sides};
use csg::CurveId;

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

impl SurfaceMesh {
    /// The edges on a curve, in its order and direction.
    pub(crate) fn segments_of(&self, curve: CurveId) -> impl Iterator<Item = &Segment> {
        let from = self.segments.partition_point(|s| s.curve < curve);
        self.segments[from..].iter().take_while(move |s| s.curve == curve)
    }
}

/// The middles of the sides of triangles that meet others elsewhere than in a common corner or edge, by exact signs: where smaller sizes part
/// them.
pub(crate) fn crossings(points: &[Point], triangles: &[BoundaryTriangle]) -> Vec<Point> {
    let corners: Vec<[u32; 3]> = triangles.iter().map(|t| t.vertices.map(|v| v.0)).collect();
    let pairs = intersections(points, &corners);
    middles_of_sides(points, &corners, pairs.into_iter().map(|(pair, _)| pair))
}

/// How patches are meshed.
#[derive(Clone, Debug)]
pub struct Settings {
    /// The most that the surface's normal may turn along an edge, in radians: bounds the size by `turn / curvature`, so that a
    /// closed surface is closed whatever the size field wants. The regular icosahedron needs 1.05.
    pub turn: f64,
    /// How fast the size grows away from the segments, as a length per length.
    pub growth: f64,
    /// Rounds of collapses, splits, swaps and moves after the front.
    pub rounds: usize,
    /// The most vertices of one patch; more is an error.
    pub max_vertices: usize,
}

impl Default for Settings {
    fn default() -> Self {
        Self { turn: 1.1, growth: 0.4, rounds: 3, max_vertices: 200_000_000 }
    }
}
