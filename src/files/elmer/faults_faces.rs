//! Faults of elements and boundary elements: ids, orientation, neighbours across each face.

use super::faults::{FaultKind, Faults};
use super::faults_nodes::NodeTable;
use super::read::{BoundaryElement, Element, ElmerMesh, ElmerPart};
use crate::ground::kernel::predicates::{Sign, orient3d};
use crate::ground::mesh::TET_FACES;
use rayon::prelude::*;

/// Node ids of a face, ascending.
type Key = [u32; 3];

/// An element or boundary element: part, and index in its file.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Place {
    part: u32,
    index: u32,
}

/// A face of one element, or of one boundary element.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Side {
    key: Key,
    place: Place,
    /// Whether the face, seen with its normal out of the element (or as the boundary element has
    /// it), is an even permutation of its key.
    even: bool,
}

pub(super) fn check_elements_and_boundary(mesh: &ElmerMesh, tables: &[NodeTable], faults: &mut Faults) {
    check_element_ids(mesh, faults);
    let signs = check_orientation(mesh, tables, faults);
    let halo = halo_ids(mesh);
    let judge = Judge { mesh, sides: element_sides(mesh, &signs), boundary: boundary_sides(mesh), halo };
    judge.check_faces(faults);
    judge.check_boundary(faults);
}

fn check_element_ids(mesh: &ElmerMesh, faults: &mut Faults) {
    let mut ids: Vec<(u32, Place)> = Vec::new();
    for (part, p) in mesh.parts.iter().zip(0..) {
        ids.extend(part.elements.iter().zip(0..).map(|(e, index)| (e.id, Place { part: p, index })));
    }
    ids.par_sort_unstable();
    for pair in ids.windows(2).filter(|pair| pair[0].0 == pair[1].0) {
        let (before, here) = (pair[0].1, pair[1].1);
        let line = |at: Place| mesh.parts[at.part as usize].elements.line(at.index as usize);
        let what =
            || format!("element {} is also in part {}, line {}", pair[1].0, before.part + 1, line(before));
        let file = mesh.parts[here.part as usize].file("elements");
        faults.add(FaultKind::ElementTwice, file, line(here), what);
    }
}

/// The exact orientation of each element, by part; `Zero` if a node is missing.
fn check_orientation(mesh: &ElmerMesh, tables: &[NodeTable], faults: &mut Faults) -> Vec<Vec<Sign>> {
    let mut signs = Vec::new();
    for (part, table) in mesh.parts.iter().zip(tables) {
        let sign = |element: &Element| {
            let [a, b, c, d] = element.nodes.map(|id| table.find(id).map(|k| &part.nodes[k].point));
            Some(orient3d(a?, b?, c?, d?))
        };
        let of_part: Vec<Option<Sign>> = part.elements.par_iter().map(sign).collect();
        for (k, sign) in of_part.iter().enumerate() {
            let Some(sign @ (Sign::Negative | Sign::Zero)) = sign else { continue };
            let state = if *sign == Sign::Zero { "flat" } else { "inverted" };
            let what = || format!("element {} is {state}", part.elements[k].id);
            faults.add(FaultKind::Inverted, part.file("elements"), part.elements.line(k), what);
        }
        signs.push(of_part.into_iter().map(|sign| sign.unwrap_or(Sign::Zero)).collect());
    }
    signs
}

/// Sorts a face; true if the permutation is even.
fn sorted(mut face: Key) -> (Key, bool) {
    let mut even = true;
    for (a, b) in [(0, 1), (1, 2), (0, 1)] {
        if face[a] > face[b] {
            face.swap(a, b);
            even = !even;
        }
    }
    (face, even)
}

fn element_sides(mesh: &ElmerMesh, signs: &[Vec<Sign>]) -> Vec<Side> {
    let mut sides = Vec::with_capacity(4 * mesh.parts.iter().map(|p| p.elements.len()).sum::<usize>());
    for ((part, p), signs) in mesh.parts.iter().zip(0..).zip(signs) {
        for ((element, index), sign) in part.elements.iter().zip(0..).zip(signs) {
            for face in TET_FACES {
                let (key, even) = sorted(face.map(|k| element.nodes[k]));
                let inverted = *sign == Sign::Negative;
                sides.push(Side { key, place: Place { part: p, index }, even: even != inverted });
            }
        }
    }
    sides.par_sort_unstable();
    sides
}

fn boundary_sides(mesh: &ElmerMesh) -> Vec<Side> {
    let mut sides = Vec::new();
    for (part, p) in mesh.parts.iter().zip(0..) {
        for (element, index) in part.boundary.iter().zip(0..) {
            let (key, even) = sorted(element.nodes);
            sides.push(Side { key, place: Place { part: p, index }, even });
        }
    }
    sides.par_sort_unstable();
    sides
}

/// The ids of each part's halo elements, sorted.
fn halo_ids(mesh: &ElmerMesh) -> Vec<Vec<u32>> {
    let of_part = |part: &ElmerPart| {
        let mut ids: Vec<u32> = part.halo.iter().map(|(element, _)| element.id).collect();
        ids.sort_unstable();
        ids
    };
    mesh.parts.iter().map(of_part).collect()
}

/// The entries of one face in a sorted list.
fn of_face(sides: &[Side], key: Key) -> &[Side] {
    let start = sides.partition_point(|side| side.key < key);
    let end = start + sides[start..].iter().take_while(|side| side.key == key).count();
    &sides[start..end]
}

/// All element and boundary sides, sorted by face.
struct Judge<'a> {
    mesh: &'a ElmerMesh,
    sides: Vec<Side>,
    boundary: Vec<Side>,
    halo: Vec<Vec<u32>>,
}

impl Judge<'_> {
    fn element(&self, side: &Side) -> &Element {
        &self.mesh.parts[side.place.part as usize].elements[side.place.index as usize]
    }

    fn boundary_element(&self, side: &Side) -> &BoundaryElement {
        &self.mesh.parts[side.place.part as usize].boundary[side.place.index as usize]
    }

    fn add_at(
        &self,
        faults: &mut Faults,
        kind: FaultKind,
        file: &str,
        at: &Side,
        what: impl FnOnce() -> String,
    ) {
        let part = &self.mesh.parts[at.place.part as usize];
        let index = at.place.index as usize;
        let line = if file == "boundary" { part.boundary.line(index) } else { part.elements.line(index) };
        faults.add(kind, part.file(file), line, what);
    }

    /// Checks what lies on both sides of each face.
    fn check_faces(&self, faults: &mut Faults) {
        for sides in self.sides.chunk_by(|a, b| a.key == b.key) {
            let key = sides[0].key;
            match sides {
                [one] => self.check_bounded(one, faults),
                [a, b] => {
                    if a.even == b.even {
                        self.check_overlap(a, b, faults);
                    }
                    if a.place.part != b.place.part {
                        self.check_between_parts(a, b, faults);
                    }
                }
                [.., last] => {
                    let ids: Vec<u32> = sides.iter().map(|side| self.element(side).id).collect();
                    let what = || format!("face {key:?} belongs to elements {ids:?}");
                    self.add_at(faults, FaultKind::CrowdedFace, "elements", last, what);
                }
                [] => {}
            }
        }
    }

    /// Checks the boundary element between two parts. With halos both parts have it and Elmer
    /// halves its contributions; else only the part of the body with the higher number has it.
    fn check_between_parts(&self, a: &Side, b: &Side, faults: &mut Faults) {
        let bounded = of_face(&self.boundary, a.key);
        let knows = |part: &Side, other: &Side| {
            self.halo[part.place.part as usize].binary_search(&self.element(other).id).is_ok()
        };
        match bounded {
            [] => {}
            _ if knows(a, b) || knows(b, a) => {
                self.check_bounded(a, faults);
                self.check_bounded(b, faults);
            }
            [one] => {
                let (there, other) = if one.place.part == a.place.part { (a, b) } else { (b, a) };
                let bodies = [there, other].map(|side| self.element(side).body);
                if one.place.part == there.place.part && bodies[0] < bodies[1] {
                    let what = || {
                        format!(
                            "face {:?} of body {} belongs to part {}, which has body {}",
                            one.key,
                            bodies[0],
                            other.place.part + 1,
                            bodies[1]
                        )
                    };
                    self.add_at(faults, FaultKind::NormalTurned, "boundary", one, what);
                }
            }
            [first, second, ..] => {
                let what = || {
                    let before = self.boundary_element(first).id;
                    format!(
                        "face {:?} is boundary element {before} of part {} too",
                        first.key,
                        first.place.part + 1
                    )
                };
                if first.place.part != second.place.part {
                    self.add_at(faults, FaultKind::BoundaryInTwoParts, "boundary", second, what);
                }
            }
        }
    }

    /// The part of this element must have a boundary element here.
    fn check_bounded(&self, side: &Side, faults: &mut Faults) {
        if !of_face(&self.boundary, side.key).iter().any(|b| b.place.part == side.place.part) {
            let what = || format!("face {:?} of element {} has none here", side.key, self.element(side).id);
            self.add_at(faults, FaultKind::NoBoundary, "elements", side, what);
        }
    }

    fn check_overlap(&self, a: &Side, b: &Side, faults: &mut Faults) {
        let nodes = |side: &Side| {
            let mut nodes = self.element(side).nodes;
            nodes.sort_unstable();
            nodes
        };
        let same = nodes(a) == nodes(b);
        let kind = if same { FaultKind::SameElement } else { FaultKind::Overlap };
        let (before, here) = (self.element(a).id, self.element(b).id);
        let what = || format!("elements {before} and {here}, at face {:?}", a.key);
        // Elements with the same nodes meet at four faces: count them once.
        if !same || a.key == nodes(a)[..3] {
            self.add_at(faults, kind, "elements", b, what);
        }
    }

    fn check_boundary(&self, faults: &mut Faults) {
        for bounded in self.boundary.chunk_by(|a, b| a.key == b.key) {
            for pair in bounded.windows(2) {
                let [before, here] = [0, 1].map(|k| self.boundary_element(&pair[k]));
                if pair[0].place.part == pair[1].place.part {
                    let what = || format!("face {:?} is boundary element {} too", pair[0].key, before.id);
                    self.add_at(faults, FaultKind::BoundaryTwice, "boundary", &pair[1], what);
                } else if before.boundary != here.boundary {
                    let numbers = (before.boundary, here.boundary);
                    let what = || format!("face {:?} has numbers {numbers:?}", pair[0].key);
                    self.add_at(faults, FaultKind::NumbersDiffer, "boundary", &pair[1], what);
                }
            }
            let beside = of_face(&self.sides, bounded[0].key);
            for boundary in bounded {
                self.check_beside(boundary, beside, faults);
            }
        }
    }

    /// Checks a boundary element against the elements that have its face.
    fn check_beside(&self, boundary: &Side, beside: &[Side], faults: &mut Faults) {
        let element = self.boundary_element(boundary);
        let here = |side: &&Side| side.place.part == boundary.place.part;
        if !beside.iter().any(|side| here(&side)) {
            let what = || format!("boundary element {}, face {:?}", element.id, boundary.key);
            return self.add_at(faults, FaultKind::NoFace, "boundary", boundary, what);
        }
        let parents = element.parents;
        let mut wrong = parents.iter().filter(|&&parent| {
            // A parent in another part is accepted: Elmer's own writer names such parents.
            parent != 0 && !beside.iter().any(|side| self.element(side).id == parent)
        });
        if let Some(parent) = wrong.next() {
            let what = || format!("element {parent} is not beside boundary element {}", element.id);
            self.add_at(faults, FaultKind::WrongParent, "boundary", boundary, what);
        }
        for id in
            beside.iter().filter(here).map(|side| self.element(side).id).filter(|id| !parents.contains(id))
        {
            let what = || format!("boundary element {} does not name its parent {id}", element.id);
            self.add_at(faults, FaultKind::WrongParent, "boundary", boundary, what);
        }
        if let [one] = beside
            && one.even != boundary.even
        {
            let what = || format!("boundary element {}, parent {}", element.id, self.element(one).id);
            self.add_at(faults, FaultKind::Inward, "boundary", boundary, what);
        }
    }
}
