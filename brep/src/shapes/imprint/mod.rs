//! Imprints solids on each other where they touch on a common surface.
//!
//! The common parts of two such faces are bounded by edges of either face, so no surfaces have to
//! be intersected: edges are divided where those of the other face meet them, and each face is
//! divided along the edges of the others that lie inside of it. Afterwards common parts have the
//! same edges and become one face. Solids that touch in a line or a point alone stay apart.

mod contact;
mod cross;
mod order;
mod regions;

pub(super) use contact::{furthest, lies_on, whole};
pub(super) use cross::overlap;
pub(super) use regions::{Groups, is_clockwise};

use super::{Edges, Shapes, glue};
use cross::Pair;
use rayon::prelude::*;
use std::collections::{BTreeSet, HashMap};

/// How far two faces that touch may be apart (length): as far as corners that are one.
pub(super) fn room(shapes: &Shapes, faces: [usize; 2], size: f64) -> f64 {
    let own = faces.map(|face| glue::tolerance(shapes, shapes.faces[face].body, size, glue::OF_SOLIDS));
    own[0].max(own[1])
}

/// How often edges are divided at vertices, some of which are new for other edges.
const MOST_ROUNDS: usize = 8;

/// Divides faces of different solids that touch on a common surface, and their edges. Returns
/// whether there are any with different edges.
pub(super) fn imprint(shapes: &mut Shapes, size: f64) -> bool {
    let mut contacts = contact::contacts(shapes, false, size);
    // Faces that two solids share have the same edges.
    retain_different(shapes, &mut contacts);
    if contacts.is_empty() {
        return false;
    }
    divide(shapes, contacts, size);
    true
}

/// Divides faces that touch along each other's edges, and faces along the curves inside of them.
pub(super) fn divide(shapes: &mut Shapes, mut contacts: Vec<[usize; 2]>, size: f64) {
    glue::glue_edges(shapes, size, glue::OF_SOLIDS);
    retain_different(shapes, &mut contacts);
    let is_crossed = |face: &usize| !shapes.faces[*face].inner.is_empty();
    let crossed: Vec<usize> = (0..shapes.faces.len()).filter(is_crossed).collect();
    for face in contacts.iter().flatten().chain(&crossed).copied().collect::<BTreeSet<_>>() {
        drop_seams(shapes, face);
    }
    retain_different(shapes, &mut contacts);
    measure_gaps(shapes, &contacts);
    let groups = groups(shapes.faces.len(), &contacts);
    let touching = pairs(shapes, &groups).into_iter().map(Pair::Faces);
    divide_edges(shapes, &touching.chain(crossed.into_iter().map(Pair::Inside)).collect::<Vec<_>>(), size);
    divide_faces(shapes, &groups, size);
}

/// Divides curves where others meet them.
fn divide_edges(shapes: &mut Shapes, pairs: &[Pair], size: f64) {
    for _ in 0..MOST_ROUNDS {
        if !cross::divide_at_vertices(shapes, pairs, size) {
            break;
        }
    }
    glue::glue_edges(shapes, size, glue::OF_SOLIDS);
    cross::divide_at_crossings(shapes, pairs, size);
    glue::glue_edges(shapes, size, glue::OF_SOLIDS);
}

/// Of curves that are to divide two faces each, leaves the parts that are inside of both.
///
/// Beyond a face they may be tangent to those of its neighbours, so this is done face by face.
pub(super) fn trim(shapes: &mut Shapes, crossed: &[[usize; 2]], size: f64) {
    let faces: BTreeSet<usize> = crossed.iter().flatten().copied().collect();
    faces.iter().for_each(|&face| drop_seams(shapes, face));
    divide_edges(shapes, &faces.iter().copied().map(Pair::Edges).collect::<Vec<_>>(), size);
    let outline = |&face: &usize| Some((face, regions::outline(shapes, face, size)?));
    let outlines: HashMap<usize, _> = faces.par_iter().filter_map(outline).collect();
    let common = |&[a, b]: &[usize; 2]| {
        let there: BTreeSet<usize> = shapes.faces[b].inner.iter().copied().collect();
        let common: Vec<usize> =
            shapes.faces[a].inner.iter().copied().filter(|c| there.contains(c)).collect();
        let inside = [a, b].map(|face| match outlines.get(&face) {
            Some(own) => regions::inside(shapes, face, own, &common, size),
            None => BTreeSet::new(),
        });
        let both: BTreeSet<usize> = inside[0].intersection(&inside[1]).copied().collect();
        (common, both)
    };
    let found: Vec<(Vec<usize>, BTreeSet<usize>)> = crossed.par_iter().map(common).collect();
    // Faces on one surface have the same curves, of which each has its own part.
    let (mut all, mut kept) = (BTreeSet::new(), BTreeSet::new());
    for (faces, (common, both)) in crossed.iter().zip(&found) {
        for &face in faces {
            all.extend(common.iter().map(|&curve| (face, curve)));
            kept.extend(both.iter().map(|&curve| (face, curve)));
        }
    }
    for (number, face) in shapes.faces.iter_mut().enumerate() {
        face.inner.retain(|&curve| !all.contains(&(number, curve)) || kept.contains(&(number, curve)));
    }
}

/// Pairs of faces of different solids on the same surface, whichever way they face.
pub(super) fn contacts(shapes: &Shapes, size: f64) -> Vec<[usize; 2]> {
    contact::contacts(shapes, true, size)
}

/// Leaves out pairs of faces with the same edges.
fn retain_different(shapes: &Shapes, contacts: &mut Vec<[usize; 2]>) {
    contacts.retain(|[a, b]| shapes.curves_of(*a) != shapes.curves_of(*b));
}

/// The distances of edges from the faces that they bound.
fn gaps(shapes: &Shapes, faces: BTreeSet<usize>) -> Vec<(usize, f64)> {
    let of = |face: usize| {
        let surface = &shapes.faces[face].surface;
        let gap = |curve: usize| (curve, contact::furthest(surface, &shapes.curves[curve]).0);
        shapes.curves_of(face).into_iter().map(gap).collect::<Vec<_>>()
    };
    faces.into_par_iter().flat_map_iter(of).collect()
}

/// Sets the tolerances of the edges of faces to their distances from the faces at least.
fn measure_gaps(shapes: &mut Shapes, contacts: &[[usize; 2]]) {
    let faces: BTreeSet<usize> = contacts.iter().flatten().copied().collect();
    for (curve, gap) in gaps(shapes, faces) {
        let edge = &mut shapes.curves[curve];
        edge.tolerance = edge.tolerance.max(gap);
    }
}

/// Sets the tolerances of edges to their measured distances from their faces: files state much
/// larger ones, within which other edges end.
pub(super) fn take_measured_gaps(shapes: &mut Shapes) {
    /// Between the places that are measured the distance may be larger.
    const BETWEEN: f64 = 2.0;
    shapes.curves.iter_mut().for_each(|edge| edge.tolerance = 0.0);
    for (curve, gap) in gaps(shapes, (0..shapes.faces.len()).collect()) {
        let edge = &mut shapes.curves[curve];
        edge.tolerance = edge.tolerance.max(BETWEEN * gap);
    }
}

/// For each face those that touch it.
fn groups(faces: usize, contacts: &[[usize; 2]]) -> Vec<Vec<usize>> {
    let mut groups = vec![Vec::new(); faces];
    for &[a, b] in contacts {
        groups[a].push(b);
        groups[b].push(a);
    }
    groups
}

/// Pairs of faces of different solids on one surface: those that touch each other, or a third one.
fn pairs(shapes: &Shapes, groups: &[Vec<usize>]) -> Vec<[usize; 2]> {
    let mut pairs = BTreeSet::new();
    for (face, others) in groups.iter().enumerate() {
        for (k, &a) in others.iter().enumerate() {
            pairs.insert([a.min(face), a.max(face)]);
            pairs.extend(others[..k].iter().map(|&b| [a.min(b), a.max(b)]));
        }
    }
    pairs.into_iter().filter(|[a, b]| shapes.faces[*a].body != shapes.faces[*b].body).collect()
}

/// Leaves out the seams of a face: another program, or another part, has them elsewhere.
fn drop_seams(shapes: &mut Shapes, face: usize) {
    let loops = &mut shapes.faces[face].loops;
    while let Some([(i, k), (j, m)]) = seam(loops) {
        if i == j {
            // Between both uses and after them are two loops.
            let mut edges = loops.swap_remove(i);
            let mut rest = edges.split_off(m);
            let between = edges.split_off(k + 1);
            edges.pop();
            rest.remove(0);
            rest.extend(edges);
            loops.extend([between, rest]);
        } else {
            // The ends of both loops meet where the seam was.
            let mut second = loops.swap_remove(j);
            second.rotate_left(m);
            loops[i].rotate_left(k);
            loops[i].remove(0);
            loops[i].extend(second.into_iter().skip(1));
        }
        loops.retain(|edges| !edges.is_empty());
    }
}

/// The places, as loops and positions, of an edge that a face uses in both directions.
fn seam(loops: &[Edges]) -> Option<[(usize, usize); 2]> {
    let mut known = HashMap::new();
    let all = loops
        .iter()
        .enumerate()
        .flat_map(|(i, edges)| edges.iter().enumerate().map(move |(k, edge)| ((i, k), edge)));
    for (place, &(curve, is_forward)) in all {
        if let Some(first) = known.get(&(curve, !is_forward)) {
            return Some([*first, place]);
        }
        known.insert((curve, is_forward), place);
    }
    None
}

/// Drops the curves inside of faces that do not divide them, or that no face of another solid
/// has. Returns the faces that had such curves.
fn drop_unmatched(shapes: &mut Shapes, divided: &[Option<Vec<Vec<Edges>>>]) -> Vec<usize> {
    let mut bodies: HashMap<usize, BTreeSet<usize>> = HashMap::new();
    let mut used: Vec<BTreeSet<usize>> = Vec::new();
    for (face, parts) in shapes.faces.iter().zip(divided) {
        let curves: BTreeSet<usize> = match parts {
            Some(parts) => parts.iter().flatten().flatten().map(|edge| edge.0).collect(),
            None => face.loops.iter().flatten().map(|edge| edge.0).collect(),
        };
        curves.iter().for_each(|&curve| {
            bodies.entry(curve).or_default().insert(face.body);
        });
        used.push(curves);
    }
    let mut changed = Vec::new();
    for (number, face) in shapes.faces.iter_mut().enumerate() {
        let count = face.inner.len();
        face.inner.retain(|curve| {
            used[number].contains(curve) && bodies[curve].iter().any(|&body| body != face.body)
        });
        if face.inner.len() < count {
            changed.push(number);
        }
    }
    changed
}

/// Divides faces along the edges of those that touch them, and along the curves inside of them that
/// also divide or bound a face of another solid.
fn divide_faces(shapes: &mut Shapes, groups: &[Vec<usize>], size: f64) {
    let mut divided = vec![None; shapes.faces.len()];
    let mut changed: Vec<usize> = (0..shapes.faces.len()).collect();
    while !changed.is_empty() {
        let parts = |&face: &usize| {
            let mut added: Vec<usize> =
                groups[face].iter().flat_map(|&other| shapes.curves_of(other)).collect();
            added.extend(&shapes.faces[face].inner);
            added.sort_unstable();
            added.dedup();
            regions::divided(shapes, face, &added, size)
        };
        let parts: Vec<_> = changed.par_iter().map(parts).collect();
        changed.into_iter().zip(parts).for_each(|(face, parts)| divided[face] = parts);
        changed = drop_unmatched(shapes, &divided);
    }
    let faces = std::mem::take(&mut shapes.faces);
    for (mut face, parts) in faces.into_iter().zip(divided) {
        face.inner.clear();
        match parts {
            Some(parts) => {
                shapes.faces.extend(parts.into_iter().map(|loops| super::Face { loops, ..face.clone() }));
            }
            None => shapes.faces.push(face),
        }
    }
}
