//! Sectors that no single place sees whole, filled by search.
//!
//! Where vertices of the surface lie in one plane with a Steiner point up to rounding, some walls of its sector stand edge-on to every
//! place that sees the rest. Then most of the sector is filled from a new point, and what is near those walls from other vertices,
//! whichever fit: a search finds out (`small`). The cavity grows where it finds nothing (Marot, Verhetsel, Remacle 2020).

use super::clearance::{Plane, most_inside};
use super::relocate::{Sector, directions};
use super::small::{self, Effort};
use super::tetrahedra::Tetrahedra;
use crate::kernel::predicates::Sign;
use crate::{Point, Vector};

/// How many tets may be put in search of one filling. Those that are found mostly need less than a hundred.
const TRIES: usize = 1000;

/// How often the cavity grows: each time it takes in the tets behind walls that a place near the point does not see, or if
/// these must stay, behind all.
const GROWTHS: usize = 3;

/// Cavities with more vertices are left alone: a search that looks at all their tets costs more than another attempt.
const MOST_VERTICES: usize = 60;

/// Off the surface, as fractions of the sector's size, where a new point is tried: which walls it leaves to other vertices differs.
const OFF: [f64; 4] = [1e-6, 1e-3, 0.02, 0.1];

/// Tets that fill a sector, with one new point or none; the sector takes in tets behind its walls if need be. Where nothing is found
/// it and the mesh are as before.
pub(super) fn fill(mesh: &mut Tetrahedra, sector: &mut Sector, p: u32) -> Option<Vec<[u32; 4]>> {
    let start = sector.clone();
    let inward = directions(mesh, sector, p);
    for growth in 0..=GROWTHS {
        // Walls that are seen stand in the way too where those that are not must stay.
        let near = mesh.point(p) + inward * OFF[0];
        let grown = growth == 0 || sector.grow(mesh, Some(&near)) || sector.grow(mesh, None);
        if !grown || !sector.keeps_vertices(mesh, |v| v == p) {
            break;
        }
        if let Some(tets) = search(mesh, sector, &[]) {
            return Some(tets);
        }
        for off in OFF {
            let near = mesh.point(p) + inward * off;
            let Some(place) = where_most_is_seen(mesh, sector, &near) else { continue };
            let points = mesh.points.len();
            let new = mesh.add_point(place);
            match search(mesh, sector, &[new]) {
                Some(tets) => {
                    if !tets.iter().flatten().any(|&v| v == new) {
                        mesh.forget_points(points);
                    }
                    return Some(tets);
                }
                None => mesh.forget_points(points),
            }
        }
    }
    *sector = start;
    None
}

fn search(mesh: &Tetrahedra, sector: &Sector, free: &[u32]) -> Option<Vec<[u32; 4]>> {
    let mut effort = Effort { vertices: MOST_VERTICES, tries: TRIES };
    small::fill(mesh, &sector.skin, free, 0.0, &mut effort)
}

/// The place that is farthest inside of all that a place near the surface sees; `None` if it does not see all that.
pub(super) fn where_most_is_seen(mesh: &Tetrahedra, sector: &Sector, near: &Point) -> Option<Point> {
    let reach = sector.reach(mesh, near);
    let sees = |from: &Point, face: &[u32; 3]| mesh.side_of(*face, from) == Sign::Negative;
    let seen: Vec<[u32; 3]> = sector.skin.iter().filter(|face| sees(near, face)).copied().collect();
    let planes: Vec<Plane> = seen.iter().filter_map(|f| Plane::of(f.map(|v| mesh.point(v)))).collect();
    let axes = [Vector::x(), Vector::y(), Vector::z()].map(|axis| axis * reach);
    let (place, _) = most_inside(near, &axes, &planes);
    seen.iter().all(|face| sees(&place, face)).then_some(place)
}
