//! What stands in the way of a missing edge or face: the faces and edges of the mesh that it crosses.

use super::tetrahedra::{NONE, Ring, Tetrahedra};
use crate::kernel::predicates::{Sign, orient2d};

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

/// What a missing face meets.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Piercing {
    /// Edges of the mesh, each with a tet, that go through its interior.
    Edges(Vec<(u32, [u32; 2])>),
    /// A vertex in its plane lies on it.
    Vertex,
}

/// The edges of the mesh that pierce a missing face whose own edges are all in the mesh.
///
/// From the tet at edge a, b into which the face runs, through all tets that it cuts: as its outline consists of
/// mesh edges, a tet that it cuts is cut right through.
pub(super) fn piercing(mesh: &mut Tetrahedra, [a, b, c]: [u32; 3], star: &mut Vec<u32>) -> Piercing {
    let at_edge = mesh.tet_at_edge(a, b, star).expect("the face's edges are in the mesh");
    let mut ring = Ring::default();
    assert!(mesh.ring(at_edge, a, b, &mut ring), "edge {a} {b} lies outside");
    let n = ring.tets.len();
    let mut first = None;
    for i in 0..n {
        let (r, s) = (ring.vertices[i], ring.vertices[(i + 1) % n]);
        match (mesh.side([a, b, r], c), mesh.side([a, b, s], c)) {
            (Sign::Positive, Sign::Negative) => first = Some((ring.tets[i], [r, s])),
            (Sign::Zero, _) if same_side(mesh, a, b, r, c) => return Piercing::Vertex,
            _ => {}
        }
    }
    // A facet whose corners lie on one line, by the rounding of a Steiner point, leads nowhere.
    let Some(first) = first else { return Piercing::Edges(Vec::new()) };
    let mut edges = vec![first];
    let mut next = 0;
    while let Some(&(tet, [r, s])) = edges.get(next) {
        next += 1;
        if !mesh.ring(tet, r, s, &mut ring) {
            continue;
        }
        for &t in &ring.tets {
            let signs = mesh.tets[t as usize]
                .map(|v| if [a, b, c].contains(&v) { Sign::Zero } else { mesh.side([a, b, c], v) });
            for i in 0..4 {
                for j in i + 1..4 {
                    let (u, v) = (mesh.tets[t as usize][i], mesh.tets[t as usize][j]);
                    let cut = signs[i] != Sign::Zero && signs[i] == signs[j].flipped();
                    if cut && !edges.iter().any(|&(_, e)| e == [u, v] || e == [v, u]) {
                        edges.push((t, [u, v]));
                    }
                }
                let v = mesh.tets[t as usize][i];
                if signs[i] == Sign::Zero && ![a, b, c].contains(&v) {
                    return Piercing::Vertex;
                }
            }
        }
    }
    Piercing::Edges(edges)
}

/// Whether c and d, in one plane with the line through a and b, lie on the same side of it.
fn same_side(mesh: &Tetrahedra, a: u32, b: u32, c: u32, d: u32) -> bool {
    let [a, b, c, d] = [a, b, c, d].map(|v| mesh.point(v));
    [[0, 1], [1, 2], [2, 0]].iter().any(|&[i, j]| {
        let side = |p: &crate::Point| orient2d([a[i], a[j]], [b[i], b[j]], [p[i], p[j]]);
        side(c) != Sign::Zero && side(c) == side(d)
    })
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
