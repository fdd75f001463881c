//! Imprints solids on each other where they touch on a common surface.
//!
//! The common parts of two such faces are bounded by edges of either face, so no surfaces have to
//! be intersected: edges are divided where those of the other face meet them, and each face is
//! divided along the edges of the others that lie inside of it. Afterwards common parts have the
//! same edges and become one face. Solids that touch in a line or a point alone stay apart.

mod contact;
mod cross;
mod regions;

pub(super) use contact::whole;

use super::{Edges, Shapes, glue};
use rayon::prelude::*;
use std::collections::{BTreeSet, HashMap};

/// Faces this far apart touch (fraction of the diagonal) ...
const SAME: f64 = 1e-7;
/// ... or as far as the file is accurate, but not further than this.
const FARTHEST: f64 = 1e-5;

/// How far two faces that touch may be apart (length).
fn room(shapes: &Shapes, faces: [usize; 2], size: f64) -> f64 {
    let accuracy = faces.map(|face| glue::tolerance(shapes, shapes.faces[face].body, size));
    accuracy[0].max(accuracy[1]).clamp(SAME * size, FARTHEST * size)
}

/// How often edges are divided at vertices, some of which are new for other edges.
const MOST_ROUNDS: usize = 8;

/// Divides faces of different solids that touch on a common surface, and their edges. Returns
/// whether there are any with different edges.
pub(super) fn imprint(shapes: &mut Shapes, size: f64) -> bool {
    let mut contacts = contact::contacts(shapes, size);
    // Faces that two solids share have the same edges.
    retain_different(shapes, &mut contacts);
    if contacts.is_empty() {
        return false;
    }
    glue::glue_edges(shapes, size);
    retain_different(shapes, &mut contacts);
    for face in contacts.iter().flatten().copied().collect::<BTreeSet<_>>() {
        drop_seams(shapes, face);
    }
    retain_different(shapes, &mut contacts);
    measure_gaps(shapes, &contacts);
    let groups = groups(shapes.faces.len(), &contacts);
    let pairs = pairs(shapes, &groups);
    for _ in 0..MOST_ROUNDS {
        if !cross::divide_at_vertices(shapes, &pairs, size) {
            break;
        }
    }
    glue::glue_edges(shapes, size);
    cross::divide_at_crossings(shapes, &pairs, size);
    glue::glue_edges(shapes, size);
    divide_faces(shapes, &groups, size);
    true
}

/// Leaves out pairs of faces with the same edges.
fn retain_different(shapes: &Shapes, contacts: &mut Vec<[usize; 2]>) {
    contacts.retain(|[a, b]| shapes.curves_of(*a) != shapes.curves_of(*b));
}

/// Sets the tolerances of the edges of faces to their distances from the faces at least.
fn measure_gaps(shapes: &mut Shapes, contacts: &[[usize; 2]]) {
    let faces: BTreeSet<usize> = contacts.iter().flatten().copied().collect();
    let of = |face: usize| {
        let surface = &shapes.faces[face].surface;
        let gap = |curve: usize| (curve, contact::gap(surface, &shapes.curves[curve]));
        shapes.curves_of(face).into_iter().map(gap).collect::<Vec<_>>()
    };
    let gaps: Vec<(usize, f64)> = faces.into_par_iter().flat_map_iter(of).collect();
    for (curve, gap) in gaps {
        let edge = &mut shapes.curves[curve];
        edge.tolerance = edge.tolerance.max(gap);
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

/// Divides faces along the edges of those that touch them.
fn divide_faces(shapes: &mut Shapes, groups: &[Vec<usize>], size: f64) {
    let divided = |face: usize| {
        let mut added: Vec<usize> = groups[face].iter().flat_map(|&other| shapes.curves_of(other)).collect();
        added.sort_unstable();
        added.dedup();
        regions::divided(shapes, face, &added, size)
    };
    let divided: Vec<_> = (0..shapes.faces.len()).into_par_iter().map(divided).collect();
    let faces = std::mem::take(&mut shapes.faces);
    for (face, parts) in faces.into_iter().zip(divided) {
        match parts {
            Some(parts) => {
                shapes.faces.extend(parts.into_iter().map(|loops| super::Face { loops, ..face.clone() }));
            }
            None => shapes.faces.push(face),
        }
    }
}
