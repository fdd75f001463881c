//! The edges and faces of a set of tets, computed on demand.
//!
//! They are listed lexicographically by their ascending vertices, so their order follows from that
//! of the vertices. A part whose vertices keep the order of the whole mesh has its edges and faces
//! in the order of the whole mesh too.

use super::{EdgeId, FaceId, TET_EDGES, TET_FACES, VertexId};
use rayon::prelude::*;

/// The maximum number of tets whose edges can be listed: positions in tets are `u32`.
pub const MAX_TETS: usize = (u32::MAX / 6) as usize;

/// The edges of a set of tets.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Edges {
    /// Each edge by its ascending vertices, in lexicographic order.
    pub edges: Vec<[VertexId; 2]>,
    /// The edges of each tet in the order of [`TET_EDGES`].
    pub tet_edges: Vec<[EdgeId; 6]>,
}

/// The faces of a set of tets.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Faces {
    /// Each face by its ascending vertices, in lexicographic order.
    pub faces: Vec<[VertexId; 3]>,
    /// The faces of each tet in the order of [`TET_FACES`].
    pub tet_faces: Vec<[FaceId; 4]>,
}

/// Lists the edges of tets on `vertices` vertices.
///
/// # Panics
/// With more than [`MAX_TETS`] tets, or if a tet refers to a vertex that does not exist.
pub fn edges(vertices: usize, tets: &[[VertexId; 4]]) -> Edges {
    let (edges, places) = list::<2, 1, 6>(vertices, tets, &TET_EDGES);
    Edges { edges, tet_edges: places.into_iter().map(|ids| ids.map(EdgeId)).collect() }
}

/// Lists the faces of tets on `vertices` vertices.
///
/// # Panics
/// With more than [`MAX_TETS`] tets, or if a tet refers to a vertex that does not exist.
pub fn faces(vertices: usize, tets: &[[VertexId; 4]]) -> Faces {
    let (faces, places) = list::<3, 2, 4>(vertices, tets, &TET_FACES);
    Faces { faces, tet_faces: places.into_iter().map(|ids| ids.map(FaceId)).collect() }
}

/// The one or two tets of each face, `u32::MAX` for a missing one.
///
/// # Errors
/// The first face that has more than two tets.
pub fn face_tets(faces: usize, tet_faces: &[[FaceId; 4]]) -> Result<Vec<[u32; 2]>, FaceId> {
    let mut tets = vec![[u32::MAX; 2]; faces];
    for (tet, ids) in (0..).zip(tet_faces) {
        for face in ids {
            let free = tets[face.index()].iter_mut().find(|side| **side == u32::MAX);
            *free.ok_or(*face)? = tet;
        }
    }
    Ok(tets)
}

/// A sub-entity of a tet: its vertices without the smallest, and its position, `K` × tet + index in
/// the tet.
type Entry<const REST: usize> = ([u32; REST], u32);

/// Lists the distinct sub-entities of V vertices, K of them in each tet, and the position in the
/// list of each tet's. `REST` is V − 1.
///
/// Entries are distributed to buckets by their smallest vertex, by counting; each bucket (a few
/// dozen entries) is sorted.
fn list<const V: usize, const REST: usize, const K: usize>(
    vertices: usize,
    tets: &[[VertexId; 4]],
    local: &[[usize; V]; K],
) -> (Vec<[VertexId; V]>, Vec<[u32; K]>) {
    assert!(
        tets.len() <= MAX_TETS,
        "{} tets are more than {MAX_TETS}, the most that can be listed",
        tets.len()
    );
    let sorted = |tet: &[VertexId; 4], k: usize| {
        let mut entity = local[k].map(|i| tet[i]);
        entity.sort_unstable();
        entity
    };
    let mut bucket_ends = vec![0u32; vertices + 1];
    for tet in tets {
        (0..K).for_each(|k| bucket_ends[sorted(tet, k)[0].index() + 1] += 1);
    }
    for v in 0..vertices {
        bucket_ends[v + 1] += bucket_ends[v];
    }
    // Here bucket_ends[v] is the start of bucket v; filling moves it to the end of the bucket.
    let mut entries: Vec<Entry<REST>> = vec![([0; REST], 0); tets.len() * K];
    for (t, tet) in tets.iter().enumerate() {
        for k in 0..K {
            let entity = sorted(tet, k);
            let at = &mut bucket_ends[entity[0].index()];
            let mut rest = [0; REST];
            rest.iter_mut().zip(&entity[1..]).for_each(|(r, v)| *r = v.0);
            entries[*at as usize] = (rest, (t * K + k) as u32);
            *at += 1;
        }
    }
    bucket_ends.truncate(vertices);
    sort_buckets(&mut entries, &bucket_ends);

    let mut listed: Vec<[VertexId; V]> = Vec::new();
    let mut places = vec![[0; K]; tets.len()];
    let mut begin = 0;
    for (v, &end) in bucket_ends.iter().enumerate() {
        let mut previous = None;
        for &(rest, place) in &entries[begin..end as usize] {
            if previous.replace(rest) != Some(rest) {
                let mut entity = [VertexId::new(v); V];
                entity[1..].iter_mut().zip(rest).for_each(|(e, r)| *e = VertexId(r));
                listed.push(entity);
            }
            places[place as usize / K][place as usize % K] = (listed.len() - 1) as u32;
        }
        begin = end as usize;
    }
    (listed, places)
}

/// Sorts each bucket, runs of many buckets in parallel.
fn sort_buckets<const REST: usize>(entries: &mut [Entry<REST>], ends: &[u32]) {
    /// Buckets per task: enough that a task costs much more than its start.
    const RUN: usize = 4096;
    let mut runs = Vec::new();
    let (mut rest, mut begin) = (entries, 0);
    for ends in ends.chunks(RUN) {
        let end = ends[ends.len() - 1];
        let (run, after) = rest.split_at_mut((end - begin) as usize);
        runs.push((run, begin, ends));
        (rest, begin) = (after, end);
    }
    runs.into_par_iter().for_each(|(run, first, ends)| {
        let mut begin = first;
        for &end in ends {
            run[(begin - first) as usize..(end - first) as usize].sort_unstable();
            begin = end;
        }
    });
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ground::mesh::fixtures::lattice_cube;
    use std::collections::BTreeSet;

    #[test]
    fn two_tets_share_a_face_and_its_edges() {
        let tets = [[0, 1, 2, 3], [1, 2, 3, 4]].map(|tet: [u32; 4]| tet.map(VertexId));
        let e = edges(5, &tets);
        let f = faces(5, &tets);
        let expected = [[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [1, 4], [2, 3], [2, 4], [3, 4]];
        assert_eq!(e.edges, expected.map(|edge: [u32; 2]| edge.map(VertexId)));
        assert_eq!(e.tet_edges[1], [3, 4, 5, 6, 7, 8].map(EdgeId));
        assert_eq!(f.faces[3], [1, 2, 3].map(VertexId));
        assert_eq!(f.tet_faces, [[3, 2, 1, 0], [6, 5, 4, 3]].map(|ids| ids.map(FaceId)));
        assert_eq!(face_tets(7, &f.tet_faces).unwrap()[3], [0, 1]);
        assert_eq!(face_tets(7, &f.tet_faces).unwrap()[6], [1, u32::MAX]);
    }

    #[test]
    fn a_face_of_three_tets_is_found() {
        let tets = [[0, 1, 2, 3], [0, 1, 2, 4], [0, 1, 2, 5]].map(|tet: [u32; 4]| tet.map(VertexId));
        let f = faces(6, &tets);
        assert_eq!(face_tets(f.faces.len(), &f.tet_faces), Err(FaceId(0)));
    }

    #[test]
    fn lists_agree_with_sets_and_each_tet_finds_its_own() {
        let mesh = lattice_cube(5);
        let e = edges(mesh.points.len(), &mesh.tets);
        let f = faces(mesh.points.len(), &mesh.tets);
        let mut edge_set = BTreeSet::new();
        let mut face_set = BTreeSet::new();
        for (t, tet) in mesh.tets.iter().enumerate() {
            for (k, ends) in TET_EDGES.iter().enumerate() {
                let mut edge = ends.map(|i| tet[i]);
                edge.sort_unstable();
                assert_eq!(e.edges[e.tet_edges[t][k].index()], edge);
                edge_set.insert(edge);
            }
            for (k, corners) in TET_FACES.iter().enumerate() {
                let mut face = corners.map(|i| tet[i]);
                face.sort_unstable();
                assert_eq!(f.faces[f.tet_faces[t][k].index()], face);
                face_set.insert(face);
            }
        }
        assert!(e.edges.iter().eq(&edge_set));
        assert!(f.faces.iter().eq(&face_set));
    }
}
