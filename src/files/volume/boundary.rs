//! The boundary of a mesh: triangles of the file that are faces of tets, and boundary faces without
//! triangle.

use super::assemble::FaceTable;
use super::orient::is_even;
use super::raw::{Label, Raw};
use crate::files::input::counted;
use crate::ground::mesh::{FaceId, TET_FACES, VertexId};
use csg::BodyId;

/// The common properties of one patch's triangles.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct PatchKey {
    /// The label in the file.
    pub label: Label,
    inside: BodyId,
    outside: Option<BodyId>,
}

/// The boundary triangles.
pub(super) struct Boundary {
    /// Their vertices, oriented outward from the body inside.
    pub triangles: Vec<[VertexId; 3]>,
    /// The patch key of each.
    pub keys: Vec<PatchKey>,
}

const NONE: u32 = u32::MAX;

/// Entities of faces without triangle in the file, outer ones first; they sort after all entities
/// of files.
const DERIVED: [i64; 2] = [i64::MAX - 1, i64::MAX];

/// Finds the boundary triangles.
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
            // Formats that list all faces mark those inside a body this way.
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
    note(hanging, "triangle", "that are not faces of tets left out");
    note(twice, "triangle", "listed before left out");
    note(derived[0], "face", "on the outside without triangle in the file are a boundary of their own");
    note(derived[1], "face", "between bodies without triangle in the file are a boundary of their own");
    found
}

/// Adds outer faces and faces between bodies that have no triangle; returns the number of each.
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
        let label = Label { entity: DERIVED[kind], number: largest.saturating_add(1 + kind as i64) };
        found.triangles.push(sides.face);
        found.keys.push(PatchKey { label, inside: sides.inside, outside: sides.outside });
    }
    counts
}

/// Both sides of a face.
struct Sides {
    inside: BodyId,
    outside: Option<BodyId>,
    /// The vertices of the face, oriented outward from the tet inside.
    face: [VertexId; 3],
}

impl Sides {
    /// Finds the sides of a face; the body with the lower id is inside.
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

    /// The vertices of the face, reversed if their order is not outward.
    fn outward(&self, [a, b, c]: [VertexId; 3]) -> [VertexId; 3] {
        if is_even([a, b, c]) == is_even(self.face) { [a, b, c] } else { [a, c, b] }
    }
}
