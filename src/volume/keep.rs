//! Points that the caller wants as vertices inside bodies.

use super::cavity::Cavity;
use super::tetrahedra::Tetrahedra;
use crate::Point;
use crate::kernel::predicates::Sign;

/// Why a point cannot be a vertex inside.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum KeptPointFault {
    /// It lies in no body.
    Outside,
    /// It lies on the surface.
    OnSurface,
    /// There is a vertex in the same place.
    Twice,
}

impl std::fmt::Display for KeptPointFault {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Outside => "lies in no body",
            Self::OnSurface => "lies on the surface",
            Self::Twice => "is a vertex already",
        })
    }
}

/// Inserts a point as a vertex. The mesh must be carved and its facets locked.
pub(super) fn keep(mesh: &mut Tetrahedra, cavity: &mut Cavity, point: Point) -> Result<u32, KeptPointFault> {
    // User points are few, and a walk could be stopped by the surface: look at all tets.
    let mut around = Vec::new();
    for t in mesh.alive() {
        let signs: Vec<Sign> = (4 * t..4 * t + 4)
            .map(|h| {
                let [a, b, c] = mesh.face(h).map(|v| mesh.point(v));
                crate::kernel::predicates::orient3d(a, b, c, &point)
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
        cavity.take(mesh, &around);
        if !cavity.make_star_shaped(mesh, seed, &point) {
            // The tets whose closure holds a point see all of their own surface from it, unless it is on an edge of
            // the surface.
            return Err(KeptPointFault::OnSurface);
        }
    }
    let body = mesh.bodies[seed as usize];
    let vertex = mesh.add_point(point);
    cavity.fill(mesh, vertex, body);
    Ok(vertex)
}
