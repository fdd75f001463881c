//! Points that the recovery left inside: moved where they are in the way, deleted where they are not needed.

use super::constraints::Constraints;
use super::relocate::{GOOD_ENOUGH, Sector, ball, find_place, worst};
use super::small;
use super::tetrahedra::{NONE, Tetrahedra};

/// How often all points are tried: one that is gone may let others go.
const ROUNDS: usize = 3;

/// Gives the points inside at the balls of others better places.
pub(super) fn make_room(mesh: &mut Tetrahedra, constraints: &Constraints, of: &[u32], inside: &mut [u32]) {
    for q in inside {
        let sector = surroundings(mesh, *q);
        let is_near = sector.skin.iter().flatten().any(|v| of.contains(v));
        let Some((quality, place)) = find_place(mesh, &sector, *q).filter(|_| is_near) else { continue };
        if quality <= worst(mesh, &sector.skin, mesh.point(*q), NONE, 0.0) {
            continue;
        }
        let points = mesh.points.len();
        let new = mesh.add_point(place);
        let tets: Vec<[u32; 4]> = sector.skin.iter().map(|&[a, b, c]| [new, a, b, c]).collect();
        if refill(mesh, constraints, &sector, &tets) {
            mesh.at_vertex[*q as usize] = NONE;
            *q = new;
        } else {
            mesh.forget_points(points);
        }
    }
}

/// Deletes those points inside whose ball can be filled without them, with no worse a tet unless it is good enough. Returns how
/// many are left.
pub(super) fn delete(mesh: &mut Tetrahedra, constraints: &Constraints, mut inside: Vec<u32>) -> usize {
    for _ in 0..ROUNDS {
        let before = inside.len();
        inside.retain(|&q| !delete_one(mesh, constraints, q));
        if inside.len() == before {
            break;
        }
    }
    inside.len()
}

fn delete_one(mesh: &mut Tetrahedra, constraints: &Constraints, q: u32) -> bool {
    let sector = surroundings(mesh, q);
    let least = worst(mesh, &sector.skin, mesh.point(q), NONE, 0.0).min(GOOD_ENOUGH);
    let Some(tets) = small::fill(&mesh.points, &sector.skin, least, &|_| false) else { return false };
    let done = refill(mesh, constraints, &sector, &tets);
    if done {
        mesh.at_vertex[q as usize] = NONE;
    }
    done
}

/// The ball of a point inside a body.
fn surroundings(mesh: &Tetrahedra, q: u32) -> Sector {
    let tets = ball(mesh, q);
    let wall = |&t: &u32| 4 * t + mesh.index_of(t, q).expect("a tet at the point") as u32;
    let walls = tets.iter().map(wall).collect();
    Sector::inside(mesh, mesh.bodies[tets[0] as usize], tets, walls)
}

fn refill(mesh: &mut Tetrahedra, constraints: &Constraints, sector: &Sector, tets: &[[u32; 4]]) -> bool {
    let tets: Vec<([u32; 4], u32)> = tets.iter().map(|&tet| (tet, sector.body)).collect();
    mesh.rebuild(&sector.tets, &tets, &|face| constraints.facet(face).is_some())
}
