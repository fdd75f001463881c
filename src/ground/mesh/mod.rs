//! Meshes: flat arrays of vertices and tets, classified on the geometry.

mod arrays;
pub mod blocks;
#[cfg(test)]
pub(crate) mod fixtures;
pub mod ghosts;
pub mod ids;
mod names;
mod order;
pub mod periodic;
mod quality;
mod sharing;
pub mod stream;
pub mod topology;
mod touching;
mod watched;

pub use super::comm::Rank;
pub use super::kernel::simplex::{EDGE_BETWEEN, TET_EDGES, TET_FACES, TRIANGLE_EDGES};
pub use arrays::Arrays;
pub use ids::{EdgeId, FaceId, GlobalId, TetId, VertexId};
pub(crate) use names::numbers_by_name;
pub use names::{Label, Names, UnknownName};
pub use order::Order;
pub use quality::QualitySummary;
pub(crate) use sharing::add_received;
pub use sharing::{Neighbour, Sharing};
pub use touching::Touching;
pub(crate) use touching::{have_common_body, pairs_of_bodies};
pub use watched::Watched;

use crate::Point;
use csg::{BodyId, CornerId, CurveId, PatchId};

/// The geometric entity that a mesh entity is classified on: the one of lowest dimension.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Hash, PartialOrd, Ord)]
pub enum Class {
    /// On a corner.
    Corner(CornerId),
    /// In the relative interior of a curve.
    Curve(CurveId),
    /// In the relative interior of a patch.
    Patch(PatchId),
    /// Inside a body.
    Body(BodyId),
}

impl Class {
    /// The kind and the id as two numbers, for messages.
    pub(crate) fn code(self) -> [u32; 2] {
        match self {
            Self::Corner(id) => [0, id.0],
            Self::Curve(id) => [1, id.0],
            Self::Patch(id) => [2, id.0],
            Self::Body(id) => [3, id.0],
        }
    }

    /// The inverse of [`code`](Self::code).
    pub(crate) fn decode([kind, id]: [u32; 2]) -> Self {
        match kind {
            0 => Self::Corner(CornerId(id)),
            1 => Self::Curve(CurveId(id)),
            2 => Self::Patch(PatchId(id)),
            3 => Self::Body(BodyId(id)),
            _ => panic!("unknown kind {kind} of geometric entity"),
        }
    }
}

/// A triangle of the mesh on a patch.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct BoundaryTriangle {
    /// Its vertices; the right-hand normal is that of the patch, from `inside` to `outside`.
    pub vertices: [VertexId; 3],
    /// The patch.
    pub patch: PatchId,
}

/// An edge of the mesh on a curve.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Segment {
    /// Its end points in the direction of the curve.
    pub vertices: [VertexId; 2],
    /// The curve.
    pub curve: CurveId,
}

impl Segment {
    /// The edge of this class; `None` if it is not on a curve.
    pub(crate) fn of_class(vertices: [VertexId; 2], class: Class) -> Option<Self> {
        match class {
            Class::Curve(curve) => Some(Self { vertices, curve }),
            _ => None,
        }
    }
}

/// The ends of an edge, the lower first.
pub(crate) fn sorted_edge([a, b]: [VertexId; 2]) -> [VertexId; 2] {
    [a.min(b), a.max(b)]
}

/// The corners of a face, ascending.
pub(crate) fn sorted_face(mut corners: [VertexId; 3]) -> [VertexId; 3] {
    corners.sort_unstable();
    corners
}

/// For each segment, whether it is an edge of a triangle; the others are edges inside bodies.
pub(crate) fn are_sides(segments: &[Segment], triangles: &[BoundaryTriangle]) -> Vec<bool> {
    let mut order: Vec<([VertexId; 2], usize)> =
        segments.iter().map(|s| sorted_edge(s.vertices)).zip(0..).collect();
    order.sort_unstable();
    let mut are = vec![false; segments.len()];
    for [a, b, c] in triangles.iter().map(|t| t.vertices) {
        for side in [[a, b], [b, c], [c, a]].map(sorted_edge) {
            let first = order.partition_point(|(edge, _)| *edge < side);
            for (_, i) in order[first..].iter().take_while(|(edge, _)| *edge == side) {
                are[*i] = true;
            }
        }
    }
    are
}

/// A classified tetrahedral mesh on one rank.
///
/// An edge is classified on a curve only if it is one of `segments`, otherwise on a patch only if
/// it is an edge of one of the patch's triangles, otherwise in a body. Faces likewise.
#[derive(Clone, Debug, Default)]
pub struct Mesh {
    /// The vertices' coordinates.
    pub points: Vec<Point>,
    /// The geometric entity that each vertex is classified on.
    pub classes: Vec<Class>,
    /// The tets, positively oriented: (v1−v0)×(v2−v0)·(v3−v0) > 0.
    pub tets: Vec<[VertexId; 4]>,
    /// The body of each tet.
    pub bodies: Vec<BodyId>,
    /// The triangles on patches, each once.
    pub triangles: Vec<BoundaryTriangle>,
    /// The edges on curves, each once.
    pub segments: Vec<Segment>,
}
