//! Assembles a mesh from the content of a file: used vertices, orientation, bodies, boundary,
//! classes.

use super::raw::{Label, Raw};
use super::{VolumeMesh, boundary, classify, orient, periodic};
use crate::files::input::{Fault, counted};
use crate::ground::mesh::topology::{self, Faces};
use crate::ground::mesh::{self, BoundaryTriangle, FaceId, Mesh, TetId, VertexId};
use csg::{BodyId, PatchId};
use std::collections::BTreeMap;

/// The faces of all tets, with the tets on both sides.
pub(super) struct FaceTable {
    /// Sorted faces, and the faces of each tet.
    pub faces: Faces,
    /// The tets beside each face; `u32::MAX` if there is none.
    pub tets: Vec<[u32; 2]>,
}

/// Makes a mesh of a file's content.
pub(super) fn assemble(mut raw: Raw) -> Result<VolumeMesh, Fault> {
    check_corners(&raw)?;
    let mut edge_points = edge_points(&raw)?;
    drop_unused(&mut raw);
    let Raw { points, tets, tet_labels, .. } = &raw;
    let mut tets: Vec<[VertexId; 4]> = tets.iter().map(|t| t.map(VertexId)).collect();
    let faces = topology::faces(points.len(), &tets);
    let face_tets = topology::face_tets(faces.faces.len(), &faces.tet_faces)
        .map_err(|face| crowded(&raw, &faces, face))?;
    refuse_equal(&raw, &faces, &face_tets)?;
    let mut table = FaceTable { faces, tets: face_tets };
    let turned = orient::orient(points, &mut tets, &mut table);
    for ((edges, tet), of_file) in edge_points.iter_mut().zip(&tets).zip(&raw.tets) {
        if tet[0].0 != of_file[0] {
            // The first two corners are swapped.
            let [a, b, c, d, e, f] = *edges;
            *edges = [a, d, e, b, c, f];
        }
    }
    let (labels, body_of) = numbered(tet_labels);
    let bodies: Vec<BodyId> = body_of.into_iter().map(BodyId).collect();
    let mut notes = std::mem::take(&mut raw.notes);
    let found = boundary::find(&raw, &tets, &bodies, &table, &mut notes);
    let (patch_keys, patch_of) = numbered(&found.keys);
    let triangles: Vec<BoundaryTriangle> = found
        .triangles
        .iter()
        .zip(patch_of)
        .map(|(vertices, patch)| BoundaryTriangle { vertices: *vertices, patch: PatchId(patch) })
        .collect();
    if raw.higher_order > 0 {
        let measured = if edge_points.is_empty() { "" } else { ", though they are measured as they are" };
        notes.push(format!(
            "the mesh is of higher order: only the corners of {} are kept, so curved edges become straight{measured}",
            counted(raw.higher_order, "element")
        ));
    }
    if turned > 0 {
        let all = if turned == tets.len() { "all " } else { "" };
        let tets = counted(turned, "tet");
        notes.push(format!("{all}{tets} stored in negative orientation turned round"));
    }
    let patch_labels: Vec<Label> = patch_keys.iter().map(|key| key.label).collect();
    let names = crate::ground::mesh::Names {
        bodies: names_of(&labels, &raw.body_names, "body", &mut notes),
        patches: names_of(&patch_labels, &raw.patch_names, "boundary", &mut notes),
    };
    let mut mesh = Mesh { points: raw.points, tets, bodies, triangles, ..Mesh::default() };
    classify::classify(&mut mesh, &raw.edges, &raw.edge_labels, &mut notes);
    let inverted = orient::not_positive(&mesh.points, &mesh.tets).into_iter().map(TetId).collect();
    let links = periodic::links(&mesh, &raw.periodic, &mut notes);
    Ok(VolumeMesh { mesh, names, edge_points, turned, inverted, parts: Vec::new(), links, notes })
}

/// The coordinates of the nodes on the edges of all tets, if all are of second order.
fn edge_points(raw: &Raw) -> Result<Vec<[[f64; 3]; 6]>, Fault> {
    let point = |node: u32| raw.points.get(node as usize).map(|p| [p.x, p.y, p.z]);
    let of_tet = |(tet, nodes): (usize, &[u32; 6])| {
        if let Some(missing) = nodes.iter().find(|node| point(**node).is_none()) {
            return Err(Fault::file(format!(
                "tetrahedron {} names vertex {}, and the file has {}",
                raw.tet_number(tet),
                u64::from(*missing) + 1,
                raw.points.len()
            )));
        }
        Ok(nodes.map(|node| point(node).unwrap_or_default()))
    };
    let points = raw.edge_nodes.iter().enumerate().map(of_tet).collect::<Result<Vec<_>, _>>()?;
    Ok(if points.len() == raw.tets.len() { points } else { Vec::new() })
}

/// Checks that element vertices exist, and that the four corners of a tet differ.
fn check_corners(raw: &Raw) -> Result<(), Fault> {
    let count = raw.points.len();
    if u32::try_from(count).is_err() || raw.tets.len() > topology::MAX_TETS {
        return Err(Fault::file(format!(
            "{count} vertices and {} tets are too many to be read",
            raw.tets.len()
        )));
    }
    if raw.tets.is_empty() {
        return Err(Fault::file("the mesh has no tetrahedra"));
    }
    fn check<const N: usize>(kind: &str, elements: &[[u32; N]], count: usize) -> Result<(), Fault> {
        let bad = elements.iter().enumerate().find(|(_, e)| e.iter().any(|&v| v as usize >= count));
        bad.map_or(Ok(()), |(k, element)| {
            let vertex = element.iter().max().expect("an element has vertices");
            Err(Fault::file(format!(
                "{kind} {} names vertex {}, and the file has {count}",
                k + 1,
                u64::from(*vertex) + 1
            )))
        })
    }
    check("tetrahedron", &raw.tets, count)?;
    check("triangle", &raw.triangles, count)?;
    check("edge", &raw.edges, count)?;
    raw.periodic.iter().try_for_each(|periodic| check("periodic pair", &periodic.pairs, count))?;
    let twice = |t: &[u32; 4]| (0..4).any(|i| t[..i].contains(&t[i]));
    match raw.tets.iter().position(twice) {
        Some(k) => {
            let number = raw.tet_number(k);
            Err(Fault::file(format!("tetrahedron {number} has the same vertex twice: {:?}", raw.tets[k])))
        }
        None => Ok(()),
    }
}

/// The fault of a face with more than two tets.
fn crowded(raw: &Raw, faces: &Faces, face: FaceId) -> Fault {
    let tets: Vec<usize> = (0..raw.tets.len()).filter(|&tet| faces.tet_faces[tet].contains(&face)).collect();
    for (k, &first) in tets.iter().enumerate() {
        if let Some(&second) = tets[k + 1..].iter().find(|&&t| is_same(faces, first, t)) {
            return equal(raw, [first, second]);
        }
    }
    let [a, b, c] = faces.faces[face.index()].map(|v| raw.points[v.index()]);
    let numbers: Vec<String> = tets.iter().take(3).map(|&tet| raw.tet_number(tet).to_string()).collect();
    Fault::file(format!(
        "more than two tetrahedra have the same face, with corners {a}, {b}, {c}: numbers {}{}",
        numbers.join(", "),
        if tets.len() > numbers.len() { " and more" } else { "" }
    ))
}

/// Refuses two tets with the same vertices that share all faces with each other only.
fn refuse_equal(raw: &Raw, faces: &Faces, face_tets: &[[u32; 2]]) -> Result<(), Fault> {
    let twice = faces.tet_faces.iter().zip(0_u32..).find_map(|([face, ..], tet)| {
        let [first, second] = face_tets[face.index()];
        let is_twice = first == tet && second != u32::MAX && is_same(faces, first as usize, second as usize);
        is_twice.then_some([first as usize, second as usize])
    });
    twice.map_or(Ok(()), |tets| Err(equal(raw, tets)))
}

/// Whether two tets have the same vertices, and so the same faces.
fn is_same(faces: &Faces, first: usize, second: usize) -> bool {
    faces.tet_faces[first].iter().all(|face| faces.tet_faces[second].contains(face))
}

fn equal(raw: &Raw, [first, second]: [usize; 2]) -> Fault {
    let [a, b] = [first, second].map(|tet| raw.tet_number(tet));
    let at = raw.points[raw.tets[first][0] as usize];
    Fault::file(format!(
        "the tetrahedra {a} and {b} have the same four vertices, the first of them at {at}: remove one of them"
    ))
}

/// Drops vertices that no tet uses, with the triangles, edges and periodic pairs on them.
fn drop_unused(raw: &mut Raw) {
    const UNUSED: u32 = u32::MAX;
    let mut to_kept = vec![UNUSED; raw.points.len()];
    raw.tets.iter().flatten().for_each(|&v| to_kept[v as usize] = 0);
    if !to_kept.contains(&UNUSED) {
        return;
    }
    let mut on_edges = vec![false; raw.points.len()];
    for &node in raw.edge_nodes.iter().flatten() {
        on_edges[node as usize] = true;
    }
    let unused =
        to_kept.iter().zip(on_edges).filter(|(place, on_edge)| **place == UNUSED && !on_edge).count();
    for (kept, place) in (0..).zip(to_kept.iter_mut().filter(|place| **place != UNUSED)) {
        *place = kept;
    }
    let mut places = to_kept.iter();
    raw.points.retain(|_| places.next() != Some(&UNUSED));
    raw.tets.iter_mut().flatten().for_each(|v| *v = to_kept[*v as usize]);
    let before = raw.triangles.len() + raw.edges.len();
    drop_hanging(&mut raw.triangles, &mut raw.triangle_labels, &to_kept, UNUSED);
    drop_hanging(&mut raw.edges, &mut raw.edge_labels, &to_kept, UNUSED);
    for periodic in &mut raw.periodic {
        periodic.pairs.iter_mut().flatten().for_each(|v| *v = to_kept[*v as usize]);
        periodic.pairs.retain(|pair| !pair.contains(&UNUSED));
    }
    let hanging = before - raw.triangles.len() - raw.edges.len();
    if unused + hanging == 0 {
        return;
    }
    let mut note = format!("{} that no tet uses left out", counted(unused, "vertex"));
    if hanging > 0 {
        note += &format!(", with {} on them", counted(hanging, "triangle or edge"));
    }
    raw.notes.push(note);
}

fn drop_hanging<const N: usize, L: Copy>(
    elements: &mut Vec<[u32; N]>,
    labels: &mut Vec<L>,
    to_kept: &[u32],
    unused: u32,
) {
    let mut kept = 0;
    for k in 0..elements.len() {
        let element = elements[k].map(|v| to_kept[v as usize]);
        if element.iter().all(|&v| v != unused) {
            elements[kept] = element;
            labels[kept] = labels[k];
            kept += 1;
        }
    }
    elements.truncate(kept);
    labels.truncate(kept);
}

/// Returns the distinct keys, sorted, and for each item the index of its key.
pub(super) fn numbered<K: Ord + Copy>(keys: &[K]) -> (Vec<K>, Vec<u32>) {
    let mut places: BTreeMap<K, u32> = BTreeMap::new();
    let mut last = None;
    for key in keys {
        if last.replace(key) != Some(key) {
            places.insert(*key, 0);
        }
    }
    for (k, place) in (0..).zip(places.values_mut()) {
        *place = k;
    }
    let of_item = keys.iter().map(|key| places[key]).collect();
    (places.into_keys().collect(), of_item)
}

/// The largest number that the writers support.
const MOST: i64 = i32::MAX as i64;

/// Assigns a number from 1 and names to each label. Labels without a valid number get numbers above
/// the largest one, a different one for each entity.
fn names_of(
    labels: &[Label],
    given: &BTreeMap<i64, Vec<String>>,
    kind: &str,
    notes: &mut Vec<String>,
) -> Vec<mesh::Label> {
    let valid = |number: i64| (1..=MOST).contains(&number);
    let mut next = labels.iter().map(|l| l.number).filter(|&n| valid(n)).max().unwrap_or(0) + 1;
    let mut replaced: BTreeMap<[i64; 2], i64> = BTreeMap::new();
    let mut names = Vec::with_capacity(labels.len());
    for label in labels {
        let number = if valid(label.number) {
            label.number
        } else {
            let entity = if label.number == 0 { label.entity } else { 0 };
            *replaced.entry([label.number, entity]).or_insert_with(|| {
                let number = next;
                next += 1;
                if label.number != 0 && given.get(&label.number).is_none() {
                    notes.push(format!("{kind} number {} of the file is {number} here", label.number));
                }
                number
            })
        };
        let mut own = given.get(&label.number).cloned().unwrap_or_default();
        own.retain(|name| !name.is_empty());
        // More labels than free numbers do not fit in memory.
        names.push(mesh::Label { number: number.min(MOST) as u32, names: own });
    }
    let in_no_group: Vec<i64> = (replaced.iter())
        .filter(|([number, entity], _)| *number == 0 && *entity != 0)
        .map(|(_, number)| *number)
        .collect();
    if let (Some(first), Some(last)) = (in_no_group.iter().min(), in_no_group.iter().max()) {
        let range = if first == last { format!("{first}") } else { format!("{first} to {last}") };
        notes.push(format!("{kind} without number in the file: {range} here"));
    }
    names
}
