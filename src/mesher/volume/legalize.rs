//! Restores the Delaunay property after boundary recovery, by Lawson flips.
//!
//! Recovery leaves tets whose circumspheres contain other vertices. Point placement assumes that
//! there are none: the circumcentre of such a tet may be next to a vertex and be rejected, which
//! leaves a large tet. Faces that are not locally Delaunay are flipped (2-3, 3-2, and 4-4 if four
//! points are coplanar), except locked ones. Each flip lowers the mesh lifted to the paraboloid, so
//! this terminates (Lawson 1977; Joe 1989). It may stop before the mesh is Delaunay if no flip is
//! possible.

use super::tetrahedra::Tetrahedra;
use crate::ground::kernel::predicates::Sign;
use crate::mesher::half_face::{NONE, Ring};

/// Flips faces that are not locally Delaunay as long as possible; returns the number of flips.
pub(super) fn legalize(mesh: &mut Tetrahedra) -> usize {
    let mut open: Vec<u32> = mesh.alive().collect();
    let mut flips = 0;
    let mut ring = Ring::default();
    while let Some(t) = open.pop() {
        if !mesh.is_alive(t) {
            continue;
        }
        if (4 * t..4 * t + 4).any(|h| is_illegal(mesh, h) && flip(mesh, h, &mut ring, &mut open)) {
            flips += 1;
        }
    }
    flips
}

/// Whether the vertex across a face is inside the circumsphere of the tet.
fn is_illegal(mesh: &mut Tetrahedra, half_face: u32) -> bool {
    let other = mesh.across(half_face);
    if other == NONE || mesh.is_locked(half_face) {
        return false;
    }
    let point = *mesh.point(mesh.apex(other));
    mesh.is_in_sphere(half_face >> 2, &point)
}

/// Replaces the tets at a face if possible; appends the new ones to `slots`.
///
/// Let p and q be the vertices opposite to the face. The line from p to q passes through the face
/// (2-3), beyond one of its edges (3-2, if the edge has three tets), or through the edge (4-4).
fn flip(mesh: &mut Tetrahedra, half_face: u32, ring: &mut Ring, slots: &mut Vec<u32>) -> bool {
    let (tet, other) = (half_face >> 2, mesh.across(half_face));
    let (p, q) = (mesh.apex(half_face), mesh.apex(other));
    let [a, b, c] = mesh.face(half_face);
    let body = mesh.bodies[tet as usize];
    let sides = [[a, b, c], [b, c, a], [c, a, b]].map(|corners| {
        let [u, v, _] = corners;
        (corners, mesh.side([u, v, p], q))
    });
    let mut beyond = sides.into_iter().filter(|(_, sign)| *sign != Sign::Positive);
    match (beyond.next(), beyond.next()) {
        (None, _) => {
            mesh.replace(&[tet, other >> 2], &[[a, b, p, q], [b, c, p, q], [c, a, p, q]], body, slots);
            true
        }
        (Some(([u, v, w], sign)), None) => {
            let tets = if sign == Sign::Negative { 3 } else { 4 };
            if !mesh.ring(tet, u, v, ring)
                || ring.tets.len() != tets
                || has_locked_face(mesh, ring, [u, v])
                || mesh.is_kept(u, v)
            {
                return false;
            }
            // The ring vertices other than p and q: w, and a second one in a ring of four.
            let others = ring.vertices.iter().copied().filter(|&r| r != p && r != q);
            let around = |r: u32| [u, v].map(|end| oriented(mesh, [p, q, r, end]));
            let new: Vec<Option<[u32; 4]>> = others.flat_map(around).collect();
            // The ends of the edge must be on different sides of each new face.
            let is_between = |r: u32| mesh.side([p, q, r], u) != mesh.side([p, q, r], v);
            debug_assert!(ring.vertices.contains(&w));
            let Some(new) = new.into_iter().collect::<Option<Vec<_>>>() else { return false };
            if !ring.vertices.iter().filter(|&&r| r != p && r != q).all(|&r| is_between(r)) {
                return false;
            }
            mesh.replace(&ring.tets, &new, body, slots);
            true
        }
        _ => false,
    }
}

/// A positively oriented tet of these vertices; `None` if it is flat.
fn oriented(mesh: &Tetrahedra, [a, b, c, d]: [u32; 4]) -> Option<[u32; 4]> {
    match mesh.side([a, b, c], d) {
        Sign::Positive => Some([a, b, c, d]),
        Sign::Negative => Some([b, a, c, d]),
        Sign::Zero => None,
    }
}

/// Whether a face at the edge of a ring is locked.
fn has_locked_face(mesh: &Tetrahedra, ring: &Ring, edge: [u32; 2]) -> bool {
    ring.tets.iter().any(|&t| (4 * t..4 * t + 4).any(|h| !edge.contains(&mesh.apex(h)) && mesh.is_locked(h)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Point;
    use crate::ground::kernel::random::Random;
    use crate::mesher::volume::delaunay::delaunay;

    #[test]
    fn flips_made_at_random_are_undone() {
        let mut random = Random::new(41);
        // A lattice, where coplanar quadruples are common, and random points.
        let lattice: Vec<Point> =
            (0..216).map(|i| Point::new(f64::from(i % 6), f64::from(i / 6 % 6), f64::from(i / 36))).collect();
        let anywhere: Vec<Point> =
            (0..200).map(|_| Point::new(random.unit(), random.unit(), random.unit())).collect();
        for points in [lattice, anywhere] {
            let mut mesh = delaunay(&points, &[]);
            let mut ring = Ring::default();
            let mut flipped = 0;
            for _ in 0..2000 {
                let half_face = (random.bits() % (4 * mesh.tets.len() as u64)) as u32;
                let inner = mesh.is_alive(half_face >> 2) && mesh.across(half_face) != NONE;
                flipped += usize::from(inner && flip(&mut mesh, half_face, &mut ring, &mut Vec::new()));
            }
            assert_eq!(mesh.check(), Vec::<String>::new());
            assert!(flipped > 100);
            let illegal = |mesh: &mut Tetrahedra| {
                let faces: Vec<u32> = mesh.alive().flat_map(|t| 4 * t..4 * t + 4).collect();
                faces.into_iter().filter(|&h| is_illegal(mesh, h)).count()
            };
            let before = illegal(&mut mesh);
            assert!(before > 100);
            assert!(legalize(&mut mesh) > 50);
            assert_eq!(mesh.check(), Vec::<String>::new());
            assert!(20 * illegal(&mut mesh) < before);
        }
    }
}
