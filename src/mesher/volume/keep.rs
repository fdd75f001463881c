//! Kept points: vertices inside bodies requested by the caller.

use super::cavity::Cavity;
use super::tetrahedra::Tetrahedra;
use crate::Point;
use crate::ground::kernel::predicates::Sign;

/// Why a point cannot be a vertex inside a body.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum KeptPointFault {
    /// It lies outside all bodies.
    Outside,
    /// It lies on the surface.
    OnSurface,
    /// There is a vertex at the same position.
    Twice,
}

impl std::fmt::Display for KeptPointFault {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Outside => "lies outside all bodies",
            Self::OnSurface => "lies on the surface",
            Self::Twice => "coincides with a vertex",
        })
    }
}

/// Inserts a point as a vertex. The mesh must be carved and its facets locked.
///
/// # Errors
/// A [`KeptPointFault`] if the point is outside, on the surface, or equal to a vertex.
pub(super) fn keep(mesh: &mut Tetrahedra, cavity: &mut Cavity, point: Point) -> Result<u32, KeptPointFault> {
    // Kept points are few, and the surface could block a walk: test all tets.
    let mut around = Vec::new();
    for t in mesh.alive() {
        let signs: Vec<Sign> = (4 * t..4 * t + 4)
            .map(|h| {
                let [a, b, c] = mesh.face(h).map(|v| mesh.point(v));
                crate::ground::kernel::predicates::orient3d(a, b, c, &point)
            })
            .collect();
        if signs.contains(&Sign::Positive) {
            continue;
        }
        if mesh.corners(t).iter().any(|corner| **corner == point) {
            return Err(KeptPointFault::Twice);
        }
        if (0..4).any(|i| signs[i as usize] == Sign::Zero && mesh.is_locked(4 * t + i)) {
            return Err(KeptPointFault::OnSurface);
        }
        around.push(t);
    }
    let &seed = around.first().ok_or(KeptPointFault::Outside)?;
    cavity.grow(mesh, seed, &point);
    if !cavity.make_star_shaped(mesh, seed, &point) {
        cavity.set_tets(mesh, &around);
        if !cavity.make_star_shaped(mesh, seed, &point) {
            // All walls of the tets that contain the point are visible from it, unless it lies on
            // an edge of the surface.
            return Err(KeptPointFault::OnSurface);
        }
    }
    let body = mesh.bodies[seed as usize];
    let vertex = mesh.add_point(point);
    cavity.fill(mesh, vertex, body);
    Ok(vertex)
}
