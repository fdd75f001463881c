//! Triangulates polygons of any number of corners.

use super::facet::{self, Fill};
use crate::Point;
use crate::ground::kernel::predicates::{Sign, orient2d};

/// Why a polygon or facet cannot be triangulated.
#[derive(Clone, Copy, PartialEq, Eq, Debug, thiserror::Error)]
pub(super) enum PolygonFault {
    /// Its corners are collinear, or its outline encloses no area.
    #[error("its corners lie on one line, or its outline crosses itself")]
    Flat,
    /// Its outline is not simple.
    #[error("its edges cross, or its corners are far from one plane")]
    Crossing,
    /// Its coordinates are too large for the triangulation.
    #[error("its coordinates are too large")]
    TooLarge,
}

/// Triangulates a polygon of four or more corners in order, and keeps its orientation.
///
/// A polygon may traverse an edge in both directions, as one that reaches its hole by a bridge
/// does: the inside is defined by parity.
pub(super) fn triangulate(points: &[Point], corners: &[u32]) -> Result<Vec<[u32; 3]>, PolygonFault> {
    if let &[a, b, c, d] = corners
        && let Some(triangles) = quadrangle(points, [a, b, c, d])
    {
        return Ok(triangles.to_vec());
    }
    facet::triangulate(points, &[corners.to_vec()], &Fill::Parity)
}

/// Splits a quadrangle along the shorter of its valid diagonals; `None` if it has none.
fn quadrangle(points: &[Point], corners: [u32; 4]) -> Option<[[u32; 3]; 2]> {
    let plane = facet::Plane::of(points, &[&corners])?;
    let at = corners.map(|v| plane.project(&points[v as usize]));
    let is_left = |i: usize, j: usize, k: usize| orient2d(at[i], at[j], at[k]) == Sign::Positive;
    let length =
        |i: usize, j: usize| (points[corners[i] as usize] - points[corners[j] as usize]).norm_squared();
    let first = (is_left(0, 1, 2) && is_left(0, 2, 3)).then(|| length(0, 2));
    let second = (is_left(1, 2, 3) && is_left(1, 3, 0)).then(|| length(1, 3));
    let [a, b, c, d] = corners;
    match (first, second) {
        (Some(first), Some(second)) if second < first => Some([[b, c, d], [b, d, a]]),
        (Some(_), _) => Some([[a, b, c], [a, c, d]]),
        (None, Some(_)) => Some([[b, c, d], [b, d, a]]),
        (None, None) => None,
    }
}
