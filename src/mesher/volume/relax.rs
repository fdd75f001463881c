//! Exact smoothing of interior points whose positions are not representable as doubles.
//!
//! A point moved off the surface may lie extremely close to it, and points moved later may lie in
//! between: layers thinner than double precision resolves, in which no single point can be rounded.
//! Beyond the last layer there is room; when the point there has moved away, the next can follow.
//! So the points move in turn, each to the centre of the largest ball in the visibility kernel of
//! its star, however thin that is. Distances to the walls are exact volumes over areas, accurate in
//! all digits, and the linear program is solved in boxes around the point that grow from the
//! distance of the nearest wall. (Smoothing in rational coordinates before rounding: Hu et al.
//! 2018, "Tetrahedral meshing in the wild", section 3.)

use super::clearance::{Plane, deepest_point};
use super::constraints::Constraints;
use super::tetrahedra::Tetrahedra;
use crate::ground::kernel::fixed::{Fixed, rounded_volume, volume};
use crate::{Point, Vector};
use std::collections::BTreeSet;

/// The most passes over all points.
const SWEEPS: usize = 10;

/// Growth factor of the boxes.
const GROWTH: f64 = 8.0;

/// A point moves if that increases the distance to its nearest wall by this factor.
const WORTH: f64 = 1.05;

/// A point farther than this from its walls is rounded to doubles at once, because coordinates are
/// below 1 and rounding moves it by a hundredth of that. Closer points would get stuck between
/// their walls.
const ROOM_FOR_DOUBLES: f64 = 1e-14;

/// Moves interior points, and those within `rings` rings of tets around them, until all of `of` are
/// doubles or nothing moves.
pub(super) fn relax(mesh: &mut Tetrahedra, constraints: &Constraints, of: &[u32], rings: usize) {
    let near = near(mesh, constraints, of, rings);
    for _ in 0..SWEEPS {
        let moved = near.iter().filter(|&&q| centre(mesh, q)).count();
        if moved == 0 || !of.iter().any(|&q| mesh.is_rounded(q)) {
            break;
        }
    }
}

/// Interior points `of` and all interior vertices within some rings of tets around them.
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

/// Moves a point to the centre of the kernel of its star; false if it does not improve.
fn centre(mesh: &mut Tetrahedra, q: u32) -> bool {
    let mut star = Vec::new();
    mesh.star(q, &mut star);
    let across = |&t: &u32| (4 * t..4 * t + 4).find(|h| mesh.tets[t as usize][(h & 3) as usize] == q);
    let walls: Vec<[u32; 3]> = star.iter().filter_map(across).map(|h| mesh.face(h)).collect();
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

/// A position with more clearance than `place`, and its clearance. `reach` is the extent of the
/// walls.
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

/// Displacements with a clearance above `enough`, from linear programs in boxes of size `nearest`
/// to `reach`, by ascending box.
fn ways(planes: &[Plane], enough: f64, nearest: f64, reach: f64) -> Vec<Point> {
    let (mut ways, mut size) = (Vec::new(), GROWTH * nearest);
    loop {
        let axes = [Vector::x(), Vector::y(), Vector::z()].map(|axis| axis * size.min(reach));
        let (way, room) = deepest_point(&Point::origin(), &axes, planes);
        if room > enough {
            ways.push(way);
        }
        // A larger box would give the same optimum.
        if size >= reach || way.coords.amax() < 0.5 * size {
            return ways;
        }
        size *= GROWTH;
    }
}

/// The distance of a position from the nearest wall; not positive if a wall is not visible.
pub(super) fn room(mesh: &Tetrahedra, walls: &[[u32; 3]], place: &Fixed) -> f64 {
    walls.iter().map(|&wall| distance(mesh, wall, place)).fold(f64::INFINITY, f64::min)
}

/// The distance of a position from the plane of an outward wall, positive inside. The sign is exact
/// and the value accurate to a few units in the last place.
pub(super) fn distance(mesh: &Tetrahedra, wall: [u32; 3], place: &Fixed) -> f64 {
    let [a, b, c] = wall.map(|v| mesh.place(v));
    let volume = -rounded_volume(volume([&a, &b, &c, place]));
    // A degenerate face has neither volume nor area.
    if volume == 0.0 { 0.0 } else { volume / normal(mesh, wall).norm() }
}

/// Twice the outward area vector of a face, from exact differences.
fn normal(mesh: &Tetrahedra, wall: [u32; 3]) -> Vector {
    let [a, b, c] = wall.map(|v| mesh.place(v));
    b.minus(&a).rounded().coords.cross(&c.minus(&a).rounded().coords)
}

#[cfg(test)]
mod tests {
    use super::super::delaunay::delaunay;
    use super::*;
    use crate::ground::kernel::random::Random;

    /// Moves a point in a direction as far as its tets stay positive, up to a relative error of
    /// 2⁻¹⁵⁰.
    fn squeeze(mesh: &mut Tetrahedra, q: u32, way: &Vector) {
        let mut star = Vec::new();
        mesh.star(q, &mut star);
        let mut way = Fixed::of(&Point::from(*way)).unwrap();
        for _ in 0..150 {
            way = way.nearly_halved().unwrap();
            let place = mesh.place(q);
            mesh.put_at(q, &place.plus(&way));
            if !star.iter().all(|&t| mesh.is_positive(mesh.tets[t as usize])) {
                mesh.put_at(q, &place);
            }
        }
    }

    #[test]
    fn points_in_layers_thinner_than_double_precision_separate() {
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
        assert!(!mesh.check().is_empty(), "rounded, some tets are flat or inverted");

        relax(&mut mesh, &constraints, &inside, 0);
        assert!(!inside.iter().any(|&q| mesh.is_rounded(q)));
        assert_eq!(mesh.check(), Vec::<String>::new());
    }
}
