//! Errors of surface meshing.

use super::SurfaceMesh;
use crate::Point;
use csg::{CurveId, PatchId, ProjectionFailed};

/// Why a patch could not be meshed. Segments are indices into those of the
/// surface mesh.
#[derive(Clone, Debug, thiserror::Error)]
pub enum SurfaceError {
    /// Segments are too long for their surroundings: they cross each other, pass through vertices,
    /// or span about half a turn of the surface. Shorter segments avoid this.
    #[error("on patch {} the segments of curve {} are too long near ({}, {}, {}){}: cut them finer there",
        .patch.0, .curve.0, .at.x, .at.y, .at.z,
        .other.map_or(String::new(), |c| format!(", where they cross those of curve {}", c.0)))]
    TooCoarse {
        /// The patch; the first if there are several.
        patch: PatchId,
        /// The curve of the first such segment.
        curve: CurveId,
        /// The curve of the segment that it crosses, if any.
        other: Option<CurveId>,
        /// The midpoint of the segment.
        at: Point,
        /// All segments that are too long, on all patches, ascending.
        segments: Vec<usize>,
        /// Their midpoints, at which a smaller size helps.
        places: Vec<Point>,
    },
    /// Two vertices have the same position.
    #[error("patch {} has two vertices at ({}, {}, {})", .patch.0, .at.x, .at.y, .at.z)]
    Coincident {
        /// The patch.
        patch: PatchId,
        /// The position.
        at: Point,
    },
    /// The curves disagree about the side of a curve on which the patch lies.
    #[error("patch {} is on the wrong side of its boundary curve {} near ({}, {}, {})",
        .patch.0, .curve.0, .at.x, .at.y, .at.z)]
    BothSides {
        /// The patch.
        patch: PatchId,
        /// The curve.
        curve: CurveId,
        /// The midpoint of one of its segments.
        at: Point,
    },
    /// The boundary does not enclose the patch.
    #[error("the boundary curves of patch {} do not enclose it", .0.0)]
    NotEnclosed(PatchId),
    /// Coordinates are too large or not finite.
    #[error("patch {} has vertices with coordinates that are too large or not finite", .0.0)]
    NotNumbers(PatchId),
    /// A point could not be projected onto the patch.
    #[error("on patch {}: {source}", .patch.0)]
    Projection {
        /// The patch.
        patch: PatchId,
        /// The failed projection.
        source: ProjectionFailed,
    },
    /// The size field returned a value that is not positive and finite.
    #[error("the mesh size at ({}, {}, {}) on patch {} is {size}, not a positive length", .at.x, .at.y, .at.z, .patch.0)]
    BadSize {
        /// The patch.
        patch: PatchId,
        /// The position.
        at: Point,
        /// The returned value.
        size: f64,
    },
    /// The sizes need more vertices than allowed.
    #[error("patch {} needs more than {limit} vertices: increase the mesh size", .patch.0)]
    TooManyVertices {
        /// The patch.
        patch: PatchId,
        /// The largest number allowed.
        limit: usize,
    },
}

/// The first error of several patches; if it is `TooCoarse`, with the segments that are too long on
/// all patches.
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
