//! Surface meshing: curves into segments, patches into triangles.
//!
//! [`mesh_patches`] receives the segments of all curves and fills each patch with triangles. Each
//! patch is meshed independently in the **chart** of its surface (`chart`), in which the signs of
//! triangles are exact:
//!
//! 1. `embed`: triangulates the boundary vertices so that all segments are edges, and removes the
//!    outside;
//! 2. `condition`: splits triangles that are far from parallel to the surface;
//! 3. `front`: inserts vertices in layers from the boundary inward, at the distance of the size
//!    field;
//! 4. `improve`: swaps, moves, collapses and splits, and repairs triangles that would flatten in
//!    refinement.
//!
//! At all times the triangles are an embedding in the chart, so no stage can leave a hole or an
//! overlap. *Not* guaranteed is the shape of triangles where segments are much longer than the gaps
//! between curves. Segments that cross in the chart, because they are too long, are an error with
//! their positions. If a surface bends sharply and the size field is not graded accordingly (the
//! rim of a very flat ellipsoid), triangles may face away from the surface: then
//! [`Report::worst_normal`] is 90° or more, and [`SurfaceMesh::check`] lists them.

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
use crate::ground::mesh::{BoundaryTriangle, Class, Segment};
use crate::mesher::volume::{intersections, middles_of_sides};
use csg::CurveId;

/// A classified triangulation of all patches: vertices on corners, curves and patches, segments on
/// curves.
///
/// Before patches are meshed it has no triangles and no vertices on patches.
#[derive(Clone, Debug, Default)]
pub struct SurfaceMesh {
    /// The coordinates of the vertices.
    pub points: Vec<Point>,
    /// The geometric entity that each vertex is classified on (never a body).
    pub classes: Vec<Class>,
    /// The edges on curves, sorted by curve, and within a curve in its order and direction.
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

/// The midpoints of the edges of triangles that intersect others outside common corners and edges,
/// by exact predicates: smaller sizes there separate them. Pairs that may intersect are left out.
pub(crate) fn crossings(
    points: &[Point],
    triangles: &[BoundaryTriangle],
    may_meet: impl Fn([BoundaryTriangle; 2], &Point) -> bool,
) -> Vec<Point> {
    let corners: Vec<[u32; 3]> = triangles.iter().map(|t| t.vertices.map(|v| v.0)).collect();
    let mut found = intersections(points, &corners);
    found.retain(|(pair, at)| !may_meet(pair.map(|t| triangles[t as usize]), at));
    middles_of_sides(points, &corners, found.into_iter().map(|(pair, _)| pair))
}

/// Settings of surface meshing.
#[derive(Clone, Debug)]
pub struct Settings {
    /// Largest turn of the surface's normal along an edge, in radians. It limits the size to `turn
    /// / curvature`, so that a closed surface is resolved for any size field. The regular
    /// icosahedron needs 1.05.
    pub turn: f64,
    /// Growth of the size away from the segments, length per length.
    pub growth: f64,
    /// Rounds of collapses, splits, swaps and moves after the front.
    pub rounds: usize,
    /// The largest number of vertices of one patch; exceeding it is an error.
    pub max_vertices: usize,
}

impl Default for Settings {
    fn default() -> Self {
        Self { turn: 1.1, growth: 0.4, rounds: 3, max_vertices: 200_000_000 }
    }
}
