//! What stands in the way of a missing edge or face: the faces and edges of the mesh that it crosses.

use super::tetrahedra::{NONE, Ring, Tetrahedra};
use crate::kernel::predicates::Sign;

/// What a missing edge meets.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Crossing {
    /// The interior of a face; the half-face is outward on the side where the edge begins.
    Face(u32),
    /// The interior of an edge of a tet.
    Edge(u32, [u32; 2]),
    /// A vertex.
    Vertex(u32),
}

/// All that lies between a and b, from a on, up to the first edge or vertex in the way.
///
/// Empty where a, b is an edge of the mesh. `star` is scratch.
pub(super) fn crossings(
    mesh: &mut Tetrahedra,
    a: u32,
    b: u32,
    star: &mut Vec<u32>,
    found: &mut Vec<Crossing>,
) {
    assert!(trace(mesh, a, b, star, found), "no tet at vertex {a} faces vertex {b}");
}

/// As [`crossings`], also up to the outside of the mesh; false where the way from a to b is outside from the start.
pub(super) fn trace(
    mesh: &mut Tetrahedra,
    a: u32,
    b: u32,
    star: &mut Vec<u32>,
    found: &mut Vec<Crossing>,
) -> bool {
    found.clear();
    mesh.star(a, star);
    let faces = |star: &[u32]| star.iter().find_map(|&t| leaves_star(mesh, t, a, b));
    let ends = |star: &[u32]| star.iter().any(|&t| mesh.tets[t as usize].contains(&b));
    let mut first = faces(star);
    if first.is_none() && !ends(star) {
        // Where the outside parts the tets at a vertex a walk through faces misses some.
        star.clear();
        star.extend(mesh.alive().filter(|&t| mesh.tets[t as usize].contains(&a)));
        first = faces(star);
    }
    if ends(star) {
        return true;
    }
    let Some(first) = first else { return false };
    found.push(first);
    while let Some(&Crossing::Face(half_face)) = found.last() {
        if mesh.across(half_face) == NONE {
            break;
        }
        match leaves_tet(mesh, half_face, a, b) {
            Some(next) => found.push(next),
            None => break,
        }
    }
    true
}

/// Where the edge from a to b leaves the tet t at a, if it goes through t.
fn leaves_star(mesh: &Tetrahedra, t: u32, a: u32, b: u32) -> Option<Crossing> {
    let half_face = 4 * t + mesh.index_of(t, a)? as u32;
    let [x, y, z] = mesh.face(half_face);
    let mut touched = [false; 3];
    for (k, [u, v]) in [[x, y], [y, z], [z, x]].into_iter().enumerate() {
        match mesh.side([a, u, v], b) {
            Sign::Negative => return None,
            Sign::Zero => touched[k] = true,
            Sign::Positive => {}
        }
    }
    Some(match touched {
        [false, false, false] => Crossing::Face(half_face),
        [true, false, false] => Crossing::Edge(t, [x, y]),
        [false, true, false] => Crossing::Edge(t, [y, z]),
        [false, false, true] => Crossing::Edge(t, [z, x]),
        [true, true, _] => Crossing::Vertex(y),
        [_, true, true] => Crossing::Vertex(z),
        [true, _, true] => Crossing::Vertex(x),
    })
}

/// Where the edge from a to b, having crossed a face, leaves the tet behind it; `None` if it ends there.
fn leaves_tet(mesh: &Tetrahedra, half_face: u32, a: u32, b: u32) -> Option<Crossing> {
    let other = mesh.across(half_face);
    let [x, y, z] = mesh.face(half_face);
    let apex = mesh.apex(other);
    if apex == b {
        return None;
    }
    // Seen along the edge, x, y, z go round it in the right-handed sense. The edge leaves between the two
    // of them that the apex has on its left and on its right.
    let turn = [x, y, z].map(|v| mesh.side([a, b, apex], v));
    let t = other >> 2;
    for (i, j) in [(0, 1), (1, 2), (2, 0)] {
        if turn[i] == Sign::Positive && turn[j] == Sign::Negative {
            let opposite = [z, x, y][i];
            return Some(Crossing::Face(4 * t + mesh.index_of(t, opposite)? as u32));
        }
    }
    let flat = (0..3).filter(|&i| turn[i] == Sign::Zero).collect::<Vec<_>>();
    match flat[..] {
        [i] => Some(Crossing::Edge(t, [apex, [x, y, z][i]])),
        _ => Some(Crossing::Vertex(apex)),
    }
}

/// The edges of a tet.
pub(super) fn edges_of_tet([a, b, c, d]: [u32; 4]) -> [[u32; 2]; 6] {
    [[a, b], [a, c], [a, d], [b, c], [b, d], [c, d]]
}

/// All tets around an edge or on both sides of a face: what a point on it has to be starred into.
pub(super) fn tets_around(mesh: &Tetrahedra, crossing: Crossing) -> Vec<u32> {
    match crossing {
        Crossing::Face(half_face) => vec![half_face >> 2, mesh.across(half_face) >> 2],
        Crossing::Edge(tet, [a, b]) => {
            let mut ring = Ring::default();
            if mesh.ring(tet, a, b, &mut ring) { ring.tets } else { Vec::new() }
        }
        Crossing::Vertex(_) => Vec::new(),
    }
}
