//! The boundary of a mesh: the file's triangles that are faces of tets, and the faces that want one.

use super::assemble::FaceTable;
use super::orient::is_even;
use super::raw::{Label, Raw};
use crate::io::input::counted;
use crate::mesh::{FaceId, TET_FACES, VertexId};
use csg::BodyId;

/// What one patch has in common.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct PatchKey {
    /// What the file says.
    pub label: Label,
    inside: BodyId,
    outside: Option<BodyId>,
}

/// Triangles on patches.
pub(super) struct Boundary {
    /// Their vertices, outward from the body inside.
    pub triangles: Vec<[VertexId; 3]>,
    /// The patch of each.
    pub keys: Vec<PatchKey>,
}

const NONE: u32 = u32::MAX;

/// Entities of faces that the file has no triangle for: behind all that files name, outer ones first.
const DERIVED: [i64; 2] = [i64::MAX - 1, i64::MAX];

/// Finds the boundary.
pub(super) fn find(
    raw: &Raw,
    tets: &[[VertexId; 4]],
    bodies: &[BodyId],
    table: &FaceTable,
    notes: &mut Vec<String>,
) -> Boundary {
    let faces = &table.faces.faces;
    let mut found = Boundary { triangles: Vec::new(), keys: Vec::new() };
    let mut has_triangle = vec![false; faces.len()];
    let (mut hanging, mut twice) = (0, 0);
    for (triangle, label) in raw.triangles.iter().zip(&raw.triangle_labels) {
        let vertices = triangle.map(VertexId);
        let mut ascending = vertices;
        ascending.sort_unstable();
        let Ok(face) = faces.binary_search(&ascending) else {
            hanging += 1;
            continue;
        };
        let sides = Sides::of(table, tets, bodies, face);
        let is_inner = sides.outside == Some(sides.inside);
        if is_inner && label.number == 0 {
            // Formats that list every face mark those inside a body so.
            continue;
        }
        if std::mem::replace(&mut has_triangle[face], true) {
            twice += 1;
            continue;
        }
        let vertices = if is_inner { vertices } else { sides.outward(vertices) };
        found.triangles.push(vertices);
        found.keys.push(PatchKey { label: *label, inside: sides.inside, outside: sides.outside });
    }
    let derived = derive(&mut found, tets, bodies, table, &has_triangle);
    let mut note = |count: usize, what: &str, done: &str| {
        if count > 0 {
            notes.push(format!("{} {done}", counted(count, what)));
        }
    };
    note(hanging, "triangle", "that are no faces of tets left out");
    note(twice, "triangle", "given before left out");
    note(derived[0], "face", "on the outside without triangle in the file are a boundary of their own");
    note(derived[1], "face", "between bodies without triangle in the file are a boundary of their own");
    found
}

/// Adds the faces on the outside and between bodies that have no triangle; returns how many of each.
fn derive(
    found: &mut Boundary,
    tets: &[[VertexId; 4]],
    bodies: &[BodyId],
    table: &FaceTable,
    has_triangle: &[bool],
) -> [usize; 2] {
    let largest = found.keys.iter().map(|key| key.label.number).max().unwrap_or(0).max(0);
    let mut counts = [0; 2];
    for face in (0..table.tets.len()).filter(|&face| !has_triangle[face]) {
        let sides = Sides::of(table, tets, bodies, face);
        if sides.outside == Some(sides.inside) {
            continue;
        }
        let kind = usize::from(sides.outside.is_some());
        counts[kind] += 1;
        let label = Label { entity: DERIVED[kind], number: largest + 1 + kind as i64 };
        found.triangles.push(sides.face);
        found.keys.push(PatchKey { label, inside: sides.inside, outside: sides.outside });
    }
    counts
}

/// What is on both sides of a face.
struct Sides {
    inside: BodyId,
    outside: Option<BodyId>,
    /// The face, outward from the tet inside.
    face: [VertexId; 3],
}

impl Sides {
    /// Inside is the body of the lower id.
    fn of(table: &FaceTable, tets: &[[VertexId; 4]], bodies: &[BodyId], face: usize) -> Self {
        let mut sides = table.tets[face];
        let body = |t: u32| bodies[t as usize];
        if sides[1] != NONE && body(sides[1]) < body(sides[0]) {
            sides.swap(0, 1);
        }
        let [inside, outside] = sides;
        let of_tet = &table.faces.tet_faces[inside as usize];
        let place = of_tet.iter().position(|f| *f == FaceId::new(face)).expect("a face of its tet");
        Self {
            inside: body(inside),
            outside: (outside != NONE).then(|| body(outside)),
            face: TET_FACES[place].map(|k| tets[inside as usize][k]),
        }
    }

    /// The vertices of the face in this order, or in the other one where that is outward.
    fn outward(&self, [a, b, c]: [VertexId; 3]) -> [VertexId; 3] {
        if is_even([a, b, c]) == is_even(self.face) { [a, b, c] } else { [a, c, b] }
    }
}
