//! Whether a tet and a box have a common point.

use crate::ground::mesh::{TET_EDGES, TET_FACES};
use nalgebra::Vector3;

/// Whether a tet has a point in a box that is parallel to the axes, up to rounding.
///
/// Two convex bodies are apart exactly if the normal of a face of either or the product of an edge
/// of each separates them (Gottschalk, Lin, Manocha 1996, section 4).
pub(super) fn overlaps(tet: &[[f64; 3]; 4], low: [f64; 3], high: [f64; 3]) -> bool {
    let corners = tet.map(Vector3::from);
    let [low, high] = [low, high].map(Vector3::from);
    let (middle, half) = ((low + high) * 0.5, (high - low) * 0.5);
    let separates = |axis: Vector3<f64>| {
        let along = corners.map(|corner| axis.dot(&(corner - middle)));
        let reach = axis.abs().dot(&half);
        along.iter().all(|x| *x > reach) || along.iter().all(|x| *x < -reach)
    };
    let axes = [Vector3::x(), Vector3::y(), Vector3::z()];
    let edge = |i: usize, j: usize| corners[j] - corners[i];
    let normal = |[a, b, c]: [usize; 3]| edge(a, b).cross(&edge(a, c));
    !axes.into_iter().any(separates)
        && !TET_FACES.iter().any(|face| separates(normal(*face)))
        && !TET_EDGES.iter().any(|&[i, j]| axes.iter().any(|axis| separates(axis.cross(&edge(i, j)))))
}
