//! Ties between tets because of periodic faces.

use super::ties::{Ties, Touched};
use crate::ground::mesh::periodic::{Pair, PeriodicMap};
use crate::ground::mesh::topology::MatchedFaces;
use crate::ground::mesh::{Mesh, TET_EDGES};
use std::collections::BTreeMap;

/// A vertex (given twice), or an edge by its ascending vertices.
type Key = [u32; 2];

/// *Serial.* The ties of a coarse mesh with these faces, some of them periodic: between the tets of
/// a face and its periodic copy, and of tets that touch periodic faces in a vertex or edge.
pub fn periodic_ties(mesh: &Mesh, faces: &MatchedFaces, map: &PeriodicMap) -> Ties {
    let mut ties = Ties::default();
    if map.links.is_empty() {
        return ties;
    }
    let beside = |face: u64| faces.tets[face as usize].into_iter().filter(|&tet| tet != u32::MAX);
    for pairs in &map.pairs {
        let periodic = &pairs.0[2];
        for pair in periodic {
            let together: Vec<u32> = beside(pair.image).chain(beside(pair.of)).collect();
            ties.pairs.extend(together[1..].iter().map(|&tet| [together[0], tet]));
        }
        for side in [|pair: &Pair| pair.image, |pair: &Pair| pair.of] {
            let mut touched: BTreeMap<Key, Touched> = BTreeMap::new();
            for face in periodic.iter().map(side) {
                for key in keys_of_face(faces.listed.faces[face as usize].map(|v| v.0)) {
                    touched.entry(key).or_default().with_face.extend(beside(face));
                }
            }
            add_all_tets(mesh, &mut touched);
            ties.touched.extend(touched.into_values());
        }
    }
    ties
}

/// The vertices and edges of a face with ascending vertices.
fn keys_of_face([a, b, c]: [u32; 3]) -> [Key; 6] {
    [[a, a], [b, b], [c, c], [a, b], [a, c], [b, c]]
}

/// Lists for each vertex and edge all tets at it.
fn add_all_tets(mesh: &Mesh, touched: &mut BTreeMap<Key, Touched>) {
    let mut is_touched = vec![false; mesh.points.len()];
    touched.keys().for_each(|[a, _]| is_touched[*a as usize] = true);
    touched.keys().for_each(|[_, b]| is_touched[*b as usize] = true);
    for (tet, vertices) in (0..).zip(&mesh.tets) {
        let vertices = vertices.map(|v| v.0);
        if !vertices.iter().any(|&v| is_touched[v as usize]) {
            continue;
        }
        let edges = TET_EDGES.map(|edge| edge.map(|k| vertices[k])).map(|[a, b]| [a.min(b), a.max(b)]);
        for key in vertices.map(|v| [v, v]).into_iter().chain(edges) {
            if let Some(touched) = touched.get_mut(&key) {
                touched.all.push(tet);
            }
        }
    }
}
