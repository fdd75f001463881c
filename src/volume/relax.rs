//! Points inside go to the middle of what sees all of their ball, exactly.
//!
//! A point that has left the surface may have found a place only just beside it, and points that left there later places between: layers of a thickness that
//! doubles do not tell apart, where no single point can get a place with doubles. But beyond the last of them there is room; when that one has gone
//! there, the next can follow. So the points go in turn, each to the middle of the largest ball in the kernel of its tets, however thin that
//! is: its walls' distances are exact volumes over areas, right in all their digits, and the linear program is solved in boxes about the
//! point that grow from its nearest wall's distance on. (Smoothing by rational places, to round them later, as in Hu and others 2018, "Tetrahedral
//! meshing in the wild", section 3.)

use super::clearance::{Plane, most_inside};
use super::constraints::Constraints;
use super::tetrahedra::Tetrahedra;
use crate::kernel::fixed::{Fixed, rounded_volume, volume};
use crate::{Point, Vector};
use std::collections::BTreeSet;

/// How often all go.
const SWEEPS: usize = 10;

/// The boxes grow by this factor.
const GROWTH: f64 = 8.0;

/// A point moves where that brings it farther from its nearest wall by this factor.
const WORTH: f64 = 1.05;

/// A point farther than this from its walls, where coordinates are below 1, goes to the nearest doubles: they are a hundredth of that away. One nearer
/// would be caught between its walls there.
const ROOM_FOR_DOUBLES: f64 = 1e-14;

/// Moves some points inside and those within so many rings of tets round them, until those have places that are doubles or nothing moves.
pub(super) fn relax(mesh: &mut Tetrahedra, constraints: &Constraints, of: &[u32], rings: usize) {
    let near = near(mesh, constraints, of, rings);
    for _ in 0..SWEEPS {
        let moved = near.iter().filter(|&&q| centre(mesh, q)).count();
        if moved == 0 || !of.iter().any(|&q| mesh.is_rounded(q)) {
            break;
        }
    }
}

/// Some points inside and others within so many rings of tets round them.
fn near(mesh: &mut Tetrahedra, constraints: &Constraints, of: &[u32], rings: usize) -> BTreeSet<u32> {
    let mut star = Vec::new();
    let mut near: BTreeSet<u32> = of.iter().copied().collect();
    for _ in 0..rings {
        for v in near.clone() {
            let beside = mesh.neighbours(v, &mut star);
            near.extend(beside.into_iter().filter(|&v| !constraints.is_of_surface(v)));
        }
    }
    near
}

/// Moves a point to the middle of the kernel of its ball; false where it is there already.
fn centre(mesh: &mut Tetrahedra, q: u32) -> bool {
    let mut ball = Vec::new();
    mesh.star(q, &mut ball);
    let across = |&t: &u32| (4 * t..4 * t + 4).find(|h| mesh.tets[t as usize][(h & 3) as usize] == q);
    let walls: Vec<[u32; 3]> = ball.iter().filter_map(across).map(|h| mesh.face(h)).collect();
    let place = mesh.place(q);
    let from_q = |v: &u32| (mesh.point(*v) - mesh.point(q)).norm();
    let reach = walls.iter().flatten().map(from_q).fold(0.0, f64::max);
    let found = better(mesh, &walls, &place, reach);
    let (room, at) = found.unwrap_or_else(|| (room(mesh, &walls, &place), place));
    mesh.put_at(q, &at);
    if room > ROOM_FOR_DOUBLES
        && let Some(rounded) = Fixed::of(&at.rounded())
        && self::room(mesh, &walls, &rounded) > 0.5 * room
    {
        mesh.put_at(q, &rounded);
    }
    found.is_some()
}

/// A place with more room than some place, and how much. `reach` is how far the walls reach.
pub(super) fn better(
    mesh: &Tetrahedra,
    walls: &[[u32; 3]],
    place: &Fixed,
    reach: f64,
) -> Option<(f64, Fixed)> {
    let distances: Vec<f64> = walls.iter().map(|&wall| distance(mesh, wall, place)).collect();
    let now = distances.iter().copied().fold(f64::INFINITY, f64::min);
    let enough = if now > 0.0 { WORTH * now } else { now / WORTH };
    let plane = |(&wall, &distance): (&[u32; 3], &f64)| {
        let outward = normal(mesh, wall).try_normalize(0.0)?;
        Plane::across(&outward, &Point::from(outward * distance))
    };
    let planes: Vec<Plane> = walls.iter().zip(&distances).filter_map(plane).collect();
    let nearest = distances.iter().map(|d| d.abs()).filter(|&d| d > 0.0).fold(reach, f64::min);
    ways(&planes, enough, nearest, reach).iter().rev().find_map(|way| {
        let there = place.plus(&Fixed::of(way)?);
        let room = room(mesh, walls, &there);
        (room > enough).then_some((room, there))
    })
}

/// Where from the origin it is farther than `enough` from all planes, in boxes from about `nearest` to `reach`: the larger the farther.
fn ways(planes: &[Plane], enough: f64, nearest: f64, reach: f64) -> Vec<Point> {
    let (mut ways, mut size) = (Vec::new(), GROWTH * nearest);
    loop {
        let axes = [Vector::x(), Vector::y(), Vector::z()].map(|axis| axis * size.min(reach));
        let (way, room) = most_inside(&Point::origin(), &axes, planes);
        if room > enough {
            ways.push(way);
        }
        // A larger box would not change it.
        if size >= reach || way.coords.amax() < 0.5 * size {
            return ways;
        }
        size *= GROWTH;
    }
}

/// The distance of a place from the nearest of the walls that must see it; not positive where one does not.
pub(super) fn room(mesh: &Tetrahedra, walls: &[[u32; 3]], place: &Fixed) -> f64 {
    walls.iter().map(|&wall| distance(mesh, wall, place)).fold(f64::INFINITY, f64::min)
}

/// How far a place is inside of an outward face: the sign is exact, and the number so but for some units in its last place.
pub(super) fn distance(mesh: &Tetrahedra, wall: [u32; 3], place: &Fixed) -> f64 {
    let [a, b, c] = wall.map(|v| mesh.place(v));
    let volume = -rounded_volume(volume([&a, &b, &c, place]));
    // A flat face has no volume and no area.
    if volume == 0.0 { 0.0 } else { volume / normal(mesh, wall).norm() }
}

/// Twice the outward area of a face, from exact differences.
fn normal(mesh: &Tetrahedra, wall: [u32; 3]) -> Vector {
    let [a, b, c] = wall.map(|v| mesh.place(v));
    b.minus(&a).rounded().coords.cross(&c.minus(&a).rounded().coords)
}

#[cfg(test)]
mod tests {
    use super::super::delaunay::delaunay;
    use super::*;
    use crate::kernel::random::Random;

    /// Moves a point as far in a direction as its tets stay positive, but for 2⁻¹⁵⁰ of that.
    fn squeeze(mesh: &mut Tetrahedra, q: u32, way: &Vector) {
        let mut ball = Vec::new();
        mesh.star(q, &mut ball);
        let mut way = Fixed::of(&Point::from(*way)).unwrap();
        for _ in 0..150 {
            way = way.nearly_halved().unwrap();
            let place = mesh.place(q);
            mesh.put_at(q, &place.plus(&way));
            if !ball.iter().all(|&t| mesh.is_positive(mesh.tets[t as usize])) {
                mesh.put_at(q, &place);
            }
        }
    }

    #[test]
    fn points_between_which_no_double_is_come_apart() {
        let corners = (0..8).map(|i| Point::from([0, 1, 2].map(|k| f64::from(i >> k & 1))));
        let mut random = Random::new(1);
        let mut within = || 0.25 + 0.5 * random.unit();
        let points: Vec<Point> =
            corners.chain((0..40).map(|_| Point::new(within(), within(), within()))).collect();
        let constraints = Constraints::new(&[[0, 1, 7]]);
        let mut mesh = delaunay(&points, &[]);
        let inside: Vec<u32> = (8..points.len() as u32).collect();
        for &q in inside.iter().chain(&inside) {
            squeeze(&mut mesh, q, &Vector::new(0.9, 0.3, -0.2));
        }
        let caught = inside.iter().filter(|&&q| mesh.is_rounded(q)).count();
        assert!(caught > inside.len() / 2, "{caught}");
        assert!(!mesh.check().is_empty(), "with doubles some tets are flat or turned");

        relax(&mut mesh, &constraints, &inside, 0);
        assert!(!inside.iter().any(|&q| mesh.is_rounded(q)));
        assert_eq!(mesh.check(), Vec::<String>::new());
    }
}
