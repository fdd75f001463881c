//! Points inside get places that doubles hold.
//!
//! A point that took the place of a Steiner point may have been put where only a [`Fixed`](crate::kernel::fixed::Fixed) one fits, between planes
//! that are nearer to each other than two doubles. With the Steiner points gone there is mostly room where it and its neighbours move
//! exactly ([`relax`]). Where vertices of the surface lie in one plane up to rounding, tets of no thickness stand between such a point and
//! that room, and do not move: the ball of the point then takes in what is behind those walls that a place farther away does not see,
//! other points inside with it, or is filled from one of its own vertices.

use super::constraints::Constraints;
use super::flips::Flips;
use super::inside::{cavity, delete_one, refill};
use super::relax::{better, distance, relax, room};
use super::sector::{Sector, best_own, find_place, worst};
use super::tetrahedra::{NONE, Tetrahedra};
use crate::Point;
use std::collections::BTreeSet;

/// How often all are tried in vain, each time with one ring of points more that move. Only then fillings are searched for, which takes long.
const IN_VAIN: usize = 6;

/// Walls are taken for those that leave a place no room up to so many times farther away, each second time that all were tried in vain.
const TIGHT: f64 = 8.0;

/// A ball takes in no more tets.
const MOST_TETS: usize = 200;

/// Gives points inside that are only near their doubles places that are doubles, or deletes them. Returns those for which neither can be done.
pub(super) fn round(mesh: &mut Tetrahedra, constraints: &Constraints, inside: &mut Vec<u32>) -> Vec<u32> {
    let mut in_vain = 0;
    let rough = |mesh: &Tetrahedra, inside: &[u32]| -> Vec<u32> {
        inside.iter().copied().filter(|&q| mesh.is_rounded(q)).collect()
    };
    let mut left = rough(mesh, inside);
    while !left.is_empty() && in_vain < IN_VAIN {
        let before = left.len();
        relax(mesh, constraints, &left, 1 + in_vain);
        for q in rough(mesh, inside) {
            // Another point may have taken it in.
            if mesh.at_vertex[q as usize] != NONE {
                let points = mesh.points.len() as u32;
                if in_vain > 0 {
                    thin_out(mesh, constraints, q);
                }
                round_one(mesh, constraints, q, in_vain);
                inside.extend(points..mesh.points.len() as u32);
            }
        }
        inside.retain(|&q| mesh.at_vertex[q as usize] != NONE);
        left = rough(mesh, inside);
        in_vain = if left.len() < before { 0 } else { in_vain + 1 };
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

/// Moves a point to a place with doubles that sees all of its ball, or fills that without it: after a search if all has been tried `in_vain` so often.
fn round_one(mesh: &mut Tetrahedra, constraints: &Constraints, q: u32, in_vain: usize) -> bool {
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
        None => take_in(mesh, constraints, &mut wider, q, TIGHT.powi(in_vain as i32 / 2)),
    };
    let points = mesh.points.len();
    if let Some(place) = place {
        let new = mesh.add_point(place);
        if put(mesh, constraints, &wider, &wider.star_of(new)) {
            return true;
        }
        mesh.forget_points(points);
    }
    in_vain > 0 && delete_one(mesh, constraints, q)
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

/// A place with doubles that sees all of a ball and of the tets that this takes in: those behind the walls that are not seen from where there is
/// most room, or are within so many times that room.
fn take_in(
    mesh: &Tetrahedra,
    constraints: &Constraints,
    ball: &mut Sector,
    q: u32,
    times: f64,
) -> Option<Point> {
    let mut place = mesh.place(q);
    while ball.tets.len() <= MOST_TETS {
        let reach = ball.reach(mesh, mesh.point(q));
        if let Some((_, there)) = better(mesh, &ball.skin, &place, reach) {
            place = there;
        }
        let room = room(mesh, &ball.skin, &place);
        let rounded = place.rounded();
        if room > 0.0 && worst(mesh, &ball.skin, &rounded, NONE, 0.0) >= 0.0 {
            return Some(rounded);
        }
        let tight = |wall| distance(mesh, mesh.face(wall), &place) <= room + times * room.abs();
        let grown = ball.grow(mesh, tight);
        let keeps = ball.keeps_vertices(mesh, |v| !constraints.is_of_surface(v));
        if !grown || !keeps {
            return None;
        }
    }
    None
}
