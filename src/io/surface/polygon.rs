//! Polygons without holes, of any number of corners, cut into triangles.

use super::facet::{self, Fill};
use crate::Point;
use crate::kernel::predicates::{Sign, orient2d};

/// Why a polygon or facet cannot be cut into triangles.
#[derive(Clone, Copy, PartialEq, Eq, Debug, thiserror::Error)]
pub(super) enum PolygonFault {
    /// Its corners span no plane.
    #[error("its corners lie on one line, or its outline crosses itself")]
    Flat,
    /// It has no simple outline.
    #[error("its edges cross, or its corners are far from one plane")]
    Crossing,
    /// Coordinates beyond what can be triangulated.
    #[error("its coordinates are too large")]
    TooLarge,
}

/// Cuts a polygon of four or more corners, given in order, into triangles that are turned as it is.
///
/// A polygon that runs along an edge twice, in both directions, as those do that reach their holes by a bridge, is
/// cut as it looks: what is inside is told by parity.
pub(super) fn triangulate(points: &[Point], corners: &[u32]) -> Result<Vec<[u32; 3]>, PolygonFault> {
    if let &[a, b, c, d] = corners
        && let Some(triangles) = quadrangle(points, [a, b, c, d])
    {
        return Ok(triangles.to_vec());
    }
    facet::triangulate(points, &[corners.to_vec()], &Fill::Parity)
}

/// The better of the two ways to cut a quadrangle, by its shorter diagonal; `None` if there is none.
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
