//! Into the units of the mesher and back, and what its results look like outside.

use super::constraints::Constraints;
use super::tetrahedra::{NONE, Tetrahedra};
use super::{ClosedSurface, VolumeError, VolumeMesh};
use crate::Point;
use csg::BodyId;

/// A power of two that brings the largest coordinate near 1, so that products of five differences
/// neither overflow nor underflow. Multiplying by it is exact.
pub(super) fn scale_of(points: &[Point]) -> f64 {
    /// Powers of two with an exact inverse.
    const LARGEST: i32 = 1021;
    let largest = points.iter().fold(0.0, |m: f64, p| m.max(p.coords.amax()));
    2f64.powi(-(largest.log2().ceil() as i32).clamp(-LARGEST, LARGEST))
}

/// The mesh without unused slots and vertices: the surface's points as given, then the others in order. Works in the arrays of
/// `mesh`, once those that are not needed any more are gone: this is where memory is scarce.
pub(super) fn finish(surface: &ClosedSurface, mesh: Tetrahedra, scale: f64) -> VolumeMesh {
    let Tetrahedra { points: mut places, mut tets, mut bodies, at_vertex, .. } = mesh;
    let given = surface.points.len();
    let mut new_vertex: Vec<u32> = (0..given as u32).collect();
    places[..given].copy_from_slice(&surface.points);
    let mut kept = given;
    for (v, &t) in at_vertex.iter().enumerate().skip(given) {
        new_vertex.push(kept as u32);
        if t != NONE {
            places[kept] = places[v] / scale;
            kept += 1;
        }
    }
    places.truncate(kept);
    let mut kept = 0;
    for slot in 0..tets.len() {
        if tets[slot][0] != NONE {
            tets[kept] = tets[slot].map(|v| new_vertex[v as usize]);
            bodies[kept] = bodies[slot];
            kept += 1;
        }
    }
    tets.truncate(kept);
    bodies.truncate(kept);
    VolumeMesh { points: places, tets, bodies: bodies.into_iter().map(BodyId).collect() }
}

/// The error for facets that a recovery left undone, by the surface's triangles.
pub(super) fn not_recovered(surface: &ClosedSurface, constraints: &Constraints, left: &[u32]) -> VolumeError {
    let mut triangles: Vec<u32> = left.iter().map(|&f| constraints.facets[f as usize].triangle).collect();
    triangles.sort_unstable();
    triangles.dedup();
    let places =
        triangles.iter().map(|&t| surface.points[surface.triangles[t as usize][0] as usize]).collect();
    VolumeError::NotRecovered { triangles, places }
}
