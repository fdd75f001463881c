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

/// The mesh without unused slots and vertices: the surface's points as given, then the others in order.
pub(super) fn finish(surface: &ClosedSurface, mesh: &Tetrahedra, scale: f64) -> VolumeMesh {
    let mut points = surface.points.clone();
    let mut new_vertex: Vec<u32> = (0..points.len() as u32).collect();
    for (v, &t) in mesh.at_vertex.iter().enumerate().skip(points.len()) {
        if t == NONE {
            new_vertex.push(NONE);
        } else {
            new_vertex.push(points.len() as u32);
            points.push(mesh.points[v] / scale);
        }
    }
    let mut result = VolumeMesh { points, ..VolumeMesh::default() };
    result.tets.reserve(mesh.len());
    result.bodies.reserve(mesh.len());
    for t in mesh.alive() {
        result.tets.push(mesh.tets[t as usize].map(|v| new_vertex[v as usize]));
        result.bodies.push(BodyId(mesh.bodies[t as usize]));
    }
    result
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
