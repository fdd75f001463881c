//! Points inside get places that doubles hold.
//!
//! A point that took the place of a Steiner point may have been put where only a [`Fixed`](crate::kernel::fixed::Fixed) one fits, between planes
//! that are nearer to each other than two doubles. With the Steiner points gone there is mostly room: the ball of the point has a place
//! with doubles that sees all of it, or is filled from one of its own vertices. Where vertices of the surface lie in one plane up to
//! rounding, tets of no thickness stand around it: the ball then takes in what is behind those walls that a place farther away does not see, other points inside
//! with it.

use super::clearance::{Plane, most_inside};
use super::constraints::Constraints;
use super::flips::Flips;
use super::inside::{cavity, delete_one, make_room, refill};
use super::sector::{Sector, best_own, find_place, worst};
use super::tetrahedra::{NONE, Tetrahedra};
use crate::kernel::predicates::Sign;
use crate::{Point, Vector};
use std::collections::BTreeSet;

/// How often all are tried in vain: as points beside them move they get room. Only then fillings are searched for, which takes long.
const IN_VAIN: usize = 4;

/// How often a ball takes in what is behind its walls for one place.
const GROWTHS: usize = 8;

/// How far away places are tried, as fractions of the ball's size.
const AWAY: [f64; 3] = [0.3, 0.03, 0.003];

/// Gives points inside that are only near their doubles places that are doubles, or deletes them. Returns those for which neither can be done.
pub(super) fn round(mesh: &mut Tetrahedra, constraints: &Constraints, inside: &mut Vec<u32>) -> Vec<u32> {
    let mut in_vain = 0;
    let mut left: Vec<u32> = inside.iter().copied().filter(|&q| mesh.is_rounded(q)).collect();
    while !left.is_empty() && in_vain < IN_VAIN {
        let before = left.len();
        for q in left {
            // Another point may have taken it in.
            if mesh.at_vertex[q as usize] != NONE {
                let points = mesh.points.len() as u32;
                if in_vain > 0 {
                    thin_out(mesh, constraints, q);
                }
                round_one(mesh, constraints, q, in_vain > 0);
                inside.extend(points..mesh.points.len() as u32);
            }
        }
        inside.retain(|&q| mesh.at_vertex[q as usize] != NONE);
        left = inside.iter().copied().filter(|&q| mesh.is_rounded(q)).collect();
        in_vain = if left.len() < before { 0 } else { in_vain + 1 };
        make_room(mesh, constraints, &left, inside);
    }
    left
}

/// Flips away what edges it can at a point: the smaller its ball is the more room there is.
fn thin_out(mesh: &mut Tetrahedra, constraints: &Constraints, q: u32) {
    let (mut star, mut flips) = (Vec::new(), Flips::default());
    for v in mesh.neighbours(q, &mut star) {
        if let Some(tet) = mesh.tet_at_edge(q, v, &mut star) {
            // What cannot go stays.
            let _ = flips.remove_edge(mesh, constraints, tet, [q, v], [NONE; 2]);
        }
    }
}

/// Moves a point to a place with doubles that sees all of its ball, or fills that without it, if need be after a `search`.
fn round_one(mesh: &mut Tetrahedra, constraints: &Constraints, q: u32, search: bool) -> bool {
    let mut ball = Vec::new();
    mesh.star(q, &mut ball);
    let sector = cavity(mesh, ball);
    let own = best_own(mesh, &sector).1;
    if own != NONE {
        return put(mesh, constraints, &sector, &sector.star_of(own));
    }
    let mut wider = sector.clone();
    let place = match find_place(mesh, &sector, q) {
        Some((_, place)) => Some(place),
        None => take_in(mesh, constraints, &mut wider, q),
    };
    let points = mesh.points.len();
    if let Some(place) = place {
        let new = mesh.add_point(place);
        if put(mesh, constraints, &wider, &wider.star_of(new)) {
            return true;
        }
        mesh.forget_points(points);
    }
    search && delete_one(mesh, constraints, q)
}

/// Fills a sector with other tets; false where they do not fit. Vertices that have none any more are told so.
fn put(mesh: &mut Tetrahedra, constraints: &Constraints, sector: &Sector, tets: &[[u32; 4]]) -> bool {
    let old: BTreeSet<u32> = sector.tets.iter().flat_map(|&t| mesh.tets[t as usize]).collect();
    let fits = refill(mesh, constraints, sector, tets);
    if fits {
        for v in old {
            if !sector.skin.iter().any(|face| face.contains(&v)) {
                mesh.at_vertex[v as usize] = NONE;
            }
        }
    }
    fits
}

/// A place with doubles that sees all of a ball and of the tets that this takes in.
fn take_in(mesh: &Tetrahedra, constraints: &Constraints, ball: &mut Sector, q: u32) -> Option<Point> {
    let start = ball.clone();
    for place in places(mesh, ball, q) {
        for _ in 0..GROWTHS {
            if worst(mesh, &ball.skin, &place, NONE, 0.0) >= 0.0 {
                return Some(place);
            }
            let grown = ball.grow(mesh, Some(&place));
            if !grown || !ball.keeps_vertices(mesh, |v| !constraints.is_of_surface(v)) {
                break;
            }
        }
        ball.clone_from(&start);
    }
    None
}

/// Places near a point: its own rounded one, where most of its ball is seen, where all facets beside it are, and such in some directions.
fn places(mesh: &Tetrahedra, ball: &Sector, q: u32) -> Vec<Point> {
    let near = *mesh.point(q);
    let locked = ball.walls.iter().filter(|&&wall| mesh.is_locked(wall));
    let fixed: Vec<Plane> = locked.filter_map(|&wall| Plane::of(mesh.face_points(wall))).collect();
    let reach = ball.reach(mesh, &near);
    let axes = |size: f64| [Vector::x(), Vector::y(), Vector::z()].map(|axis| axis * size);
    let mut places = vec![near];
    places.extend(where_most_is_seen(mesh, ball, &near));
    places.extend(AWAY.map(|share| most_inside(&near, &axes(share * reach), &fixed).0));
    for share in AWAY {
        for way in axes(share * reach) {
            places.extend([near + way, near - way]);
        }
    }
    places
}

/// The place that is farthest inside of all that a place near the surface sees; `None` if it does not see all that.
fn where_most_is_seen(mesh: &Tetrahedra, sector: &Sector, near: &Point) -> Option<Point> {
    let reach = sector.reach(mesh, near);
    let sees = |from: &Point, face: &[u32; 3]| mesh.side_of(*face, from) == Sign::Negative;
    let seen: Vec<[u32; 3]> = sector.skin.iter().filter(|face| sees(near, face)).copied().collect();
    let planes: Vec<Plane> = seen.iter().filter_map(|f| Plane::of(f.map(|v| mesh.point(v)))).collect();
    let axes = [Vector::x(), Vector::y(), Vector::z()].map(|axis| axis * reach);
    let (place, _) = most_inside(near, &axes, &planes);
    seen.iter().all(|face| sees(&place, face)).then_some(place)
}
