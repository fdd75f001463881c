//! Moves interior points to positions representable as doubles.
//!
//! A point that replaces a Steiner point may have a position that only
//! [`Fixed`](crate::ground::kernel::fixed::Fixed) represents, between planes closer than two
//! doubles. Once the Steiner points are gone, exact smoothing of it and its neighbours usually
//! finds room ([`relax`]). But if vertices of the surface are coplanar up to rounding, tets of no
//! thickness between the point and the free space do not move. Then the star is extended across
//! walls that are not visible from a better position, including other interior points, or it is
//! filled from one of its own vertices.

use super::constraints::Constraints;
use super::flips::Flips;
use super::inside::{cavity, delete_one, refill};
use super::relax::{better, distance, relax, room};
use super::sector::{Sector, best_own, find_place, worst};
use super::tetrahedra::Tetrahedra;
use crate::Point;
use crate::mesher::half_face::NONE;
use std::collections::BTreeSet;

/// The most passes without progress; each smooths one more ring of points. Searches for fillings,
/// which are slow, start after the first.
const MOST_FAILURES: usize = 6;

/// The star is extended across walls within the clearance times a factor; every second pass without
/// progress multiplies it by this number.
const TIGHT: f64 = 8.0;

/// The most tets in an extended star.
const MOST_TETS: usize = 200;

/// Moves interior points with exact positions to doubles, or deletes them; returns those for which
/// neither succeeds.
pub(super) fn round(mesh: &mut Tetrahedra, constraints: &Constraints, inside: &mut Vec<u32>) -> Vec<u32> {
    let mut failures = 0;
    let inexact = |mesh: &Tetrahedra, inside: &[u32]| -> Vec<u32> {
        inside.iter().copied().filter(|&q| mesh.is_rounded(q)).collect()
    };
    let mut left = inexact(mesh, inside);
    while !left.is_empty() && failures < MOST_FAILURES {
        let before = left.len();
        relax(mesh, constraints, &left, 1 + failures);
        for q in inexact(mesh, inside) {
            // It may have been deleted with another point.
            if mesh.at_vertex[q as usize] != NONE {
                let points = mesh.points.len() as u32;
                if failures > 0 {
                    shrink_star(mesh, constraints, q);
                }
                round_one(mesh, constraints, q, failures);
                inside.extend(points..mesh.points.len() as u32);
            }
        }
        inside.retain(|&q| mesh.at_vertex[q as usize] != NONE);
        left = inexact(mesh, inside);
        failures = if left.len() < before { 0 } else { failures + 1 };
    }
    left
}

/// Flips away edges at a point where possible: a smaller star has more room.
fn shrink_star(mesh: &mut Tetrahedra, constraints: &Constraints, q: u32) {
    let (mut star, mut flips) = (Vec::new(), Flips::default());
    for v in mesh.neighbours(q, &mut star) {
        if let Some(tet) = mesh.tet_at_edge(q, v, &mut star) {
            // Edges that cannot be removed stay.
            let _ = flips.remove_edge(mesh, constraints, tet, [q, v], [NONE; 2]);
        }
    }
}

/// Moves a point to a double position that sees its whole star, or fills the star without it;
/// searches for fillings if `failures` > 0.
fn round_one(mesh: &mut Tetrahedra, constraints: &Constraints, q: u32, failures: usize) -> bool {
    let mut star = Vec::new();
    mesh.star(q, &mut star);
    let sector = cavity(mesh, star);
    let own = best_own(mesh, &sector).1;
    if own != NONE {
        return put(mesh, constraints, &sector, &sector.star_of(own));
    }
    let mut wider = sector.clone();
    let place = match find_place(mesh, &sector, q) {
        Some((_, place)) => Some(place),
        None => extend_star(mesh, constraints, &mut wider, q, TIGHT.powi(failures as i32 / 2)),
    };
    let points = mesh.points.len();
    if let Some(place) = place {
        let new = mesh.add_point(place);
        if put(mesh, constraints, &wider, &wider.star_of(new)) {
            return true;
        }
        mesh.forget_points(points);
    }
    failures > 0 && delete_one(mesh, constraints, q)
}

/// Replaces the tets of a sector and marks vertices left without tets; false if the new tets do not
/// fit.
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

/// Extends a star until a double position sees all of its boundary, and returns that position.
///
/// Tets are added behind walls that are not visible from the position of most clearance, or within
/// `times` that clearance.
fn extend_star(
    mesh: &Tetrahedra,
    constraints: &Constraints,
    star: &mut Sector,
    q: u32,
    times: f64,
) -> Option<Point> {
    let mut place = mesh.place(q);
    while star.tets.len() <= MOST_TETS {
        let reach = star.reach(mesh, mesh.point(q));
        if let Some((_, there)) = better(mesh, &star.skin, &place, reach) {
            place = there;
        }
        let room = room(mesh, &star.skin, &place);
        let rounded = place.rounded();
        if room > 0.0 && worst(mesh, &star.skin, &rounded, NONE, 0.0) >= 0.0 {
            return Some(rounded);
        }
        let tight = |wall| distance(mesh, mesh.face(wall), &place) <= room + times * room.abs();
        let grown = star.grow(mesh, tight);
        let keeps = star.keeps_vertices(mesh, |v| !constraints.is_of_surface(v));
        if !grown || !keeps {
            return None;
        }
    }
    None
}
