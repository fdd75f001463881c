//! The faces, edges and vertices of the mesh that a missing edge crosses.

use super::tetrahedra::Tetrahedra;
use crate::ground::kernel::predicates::Sign;
use crate::mesher::half_face::{NONE, Ring};

/// An entity of the mesh that a missing edge crosses.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Crossing {
    /// The interior of a face, given by the half-face on the side where the edge begins.
    Face(u32),
    /// The interior of an edge of a tet.
    Edge(u32, [u32; 2]),
    /// A vertex.
    Vertex(u32),
}

/// Finds all crossings between a and b, starting at a, up to the first edge or vertex.
///
/// `found` is empty if (a, b) is an edge of the mesh. `star` is scratch.
pub(super) fn crossings(
    mesh: &mut Tetrahedra,
    a: u32,
    b: u32,
    star: &mut Vec<u32>,
    found: &mut Vec<Crossing>,
) {
    assert!(trace(mesh, a, b, star, found), "no tet at vertex {a} faces vertex {b}");
}

/// Like [`crossings`], but stops at the boundary of the mesh; false if the segment leaves the mesh
/// at a.
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
        // If the boundary separates the tets at a vertex, a walk through faces misses some of them.
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

/// The crossing where segment ab leaves tet t at vertex a; `None` if the segment does not enter t.
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

/// The crossing where segment ab leaves the tet behind a crossed face; `None` if it ends there.
fn leaves_tet(mesh: &Tetrahedra, half_face: u32, a: u32, b: u32) -> Option<Crossing> {
    let other = mesh.across(half_face);
    let [x, y, z] = mesh.face(half_face);
    let apex = mesh.apex(other);
    if apex == b {
        return None;
    }
    // Seen along the segment, x, y, z turn right-handed around it. It leaves through the face
    // between those two that the apex has on its left and right.
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

/// All tets around an edge or on both sides of a face: the cavity of a point inserted there.
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
