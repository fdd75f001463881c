//! Why patches cannot be meshed.

use super::SurfaceMesh;
use crate::Point;
use csg::{CurveId, PatchId, ProjectionFailed};

/// Why a patch could not be meshed. Segments are indices into [`SurfaceMesh::segments`].
#[derive(Clone, Debug, thiserror::Error)]
pub enum SurfaceError {
    /// Segments are too long for their surroundings: they cross each other, run over vertices, or span about half a turn
    /// of the surface. Cut finer, they do not.
    #[error("on patch {} the segments of curve {} are too long near ({}, {}, {}){}: cut them finer there",
        .patch.0, .curve.0, .at.x, .at.y, .at.z,
        .other.map_or(String::new(), |c| format!(", where they cross those of curve {}", c.0)))]
    TooCoarse {
        /// The patch, the first if there are several.
        patch: PatchId,
        /// The curve of a segment.
        curve: CurveId,
        /// The curve that it crosses, if so.
        other: Option<CurveId>,
        /// The middle of the segment.
        at: Point,
        /// All segments that are too long, on all patches, ascending.
        segments: Vec<usize>,
        /// Their middles: where a smaller size helps.
        places: Vec<Point>,
    },
    /// Two vertices are at the same place.
    #[error("patch {} has two vertices at ({}, {}, {})", .patch.0, .at.x, .at.y, .at.z)]
    Coincident {
        /// The patch.
        patch: PatchId,
        /// The place.
        at: Point,
    },
    /// The curves contradict each other on which side of a curve the patch lies.
    #[error("the boundary of patch {} says of curve {} near ({}, {}, {}) that the patch is on the wrong side",
        .patch.0, .curve.0, .at.x, .at.y, .at.z)]
    BothSides {
        /// The patch.
        patch: PatchId,
        /// The curve.
        curve: CurveId,
        /// The middle of one of its segments.
        at: Point,
    },
    /// The boundary does not enclose the patch.
    #[error("the boundary curves of patch {} do not enclose it", .0.0)]
    NotEnclosed(PatchId),
    /// Coordinates that are too large or no numbers.
    #[error("patch {} has vertices with coordinates that are too large or no numbers", .0.0)]
    NotNumbers(PatchId),
    /// A point of the patch has no projection.
    #[error("on patch {}: {source}", .patch.0)]
    Projection {
        /// The patch.
        patch: PatchId,
        /// The point.
        source: ProjectionFailed,
    },
    /// The size field is not positive and finite.
    #[error("the mesh size at ({}, {}, {}) on patch {} is {size}", .at.x, .at.y, .at.z, .patch.0)]
    BadSize {
        /// The patch.
        patch: PatchId,
        /// Where.
        at: Point,
        /// What the size field gave.
        size: f64,
    },
    /// The size field asks for more vertices than allowed.
    #[error("patch {} needs more than {limit} vertices: the mesh size is too small for it", .patch.0)]
    TooManyVertices {
        /// The patch.
        patch: PatchId,
        /// The most allowed.
        limit: usize,
    },
}

/// The first error of several patches, with the segments that are too long on all of them if that is what it says.
pub(super) fn joined(mut errors: Vec<SurfaceError>, curves: &SurfaceMesh) -> Option<SurfaceError> {
    let mut all: Vec<usize> = errors
        .iter()
        .filter_map(|error| match error {
            SurfaceError::TooCoarse { segments, .. } => Some(segments),
            _ => None,
        })
        .flatten()
        .copied()
        .collect();
    all.sort_unstable();
    all.dedup();
    let first = errors.first_mut()?;
    if let SurfaceError::TooCoarse { segments, places, .. } = first {
        let middle = |&s: &usize| {
            let [a, b] = curves.segments[s].vertices.map(|v| &curves.points[v.index()]);
            nalgebra::center(a, b)
        };
        *places = all.iter().map(middle).collect();
        *segments = all;
    }
    Some(errors.swap_remove(0))
}
