//! The edges and faces of a set of tets, computed on demand.
//!
//! They are listed lexicographically by their ascending vertices, so their order follows from that
//! of the vertices. A part whose vertices keep the order of the whole mesh has its edges and faces
//! in the order of the whole mesh too.

mod list;

use super::{EdgeId, FaceId, TET_EDGES, TET_FACES, VertexId};
use crate::ground::kernel::buckets::first;
use list::{Entry, Listed, list};

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

/// The faces of a set of tets, with the tets of each.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct MatchedFaces {
    /// The faces.
    pub listed: Faces,
    /// The one or two tets of each face, ascending; `u32::MAX` for a missing second one.
    pub tets: Vec<[u32; 2]>,
}

/// Lists the edges of tets on `vertices` vertices.
///
/// # Panics
/// With more than [`MAX_TETS`] tets, or if a tet refers to a vertex that does not exist.
pub fn edges(vertices: usize, tets: &[[VertexId; 4]]) -> Edges {
    edges_of(list(vertices, tets, &TET_EDGES, |_| ()))
}

/// [`edges()`], with the last tet of each edge.
///
/// # Panics
/// As [`edges()`].
pub fn edges_with_tets(vertices: usize, tets: &[[VertexId; 4]]) -> (Edges, Vec<u32>) {
    let last = |entries: &[Entry]| entries.iter().map(|entry| entry.tet).max().unwrap_or_default();
    let mut listed = list(vertices, tets, &TET_EDGES, last);
    let tets = std::mem::take(&mut listed.values);
    (edges_of(listed), tets)
}

/// Lists the faces of tets on `vertices` vertices.
///
/// # Panics
/// With more than [`MAX_TETS`] tets, or if a tet refers to a vertex that does not exist.
pub fn faces(vertices: usize, tets: &[[VertexId; 4]]) -> Faces {
    faces_of(list(vertices, tets, &TET_FACES, |_| ()))
}

/// [`faces()`], with the tets of each face.
///
/// # Errors
/// The vertices of the first face that has more than two tets.
///
/// # Panics
/// As [`faces()`].
pub fn matched_faces(vertices: usize, tets: &[[VertexId; 4]]) -> Result<MatchedFaces, [VertexId; 3]> {
    /// Marks a face of more than two tets; no tet has this index.
    const TOO_MANY: [u32; 2] = [u32::MAX; 2];
    let sides = |entries: &[Entry]| match *entries {
        [one] => [one.tet, u32::MAX],
        [one, other] => [one.tet.min(other.tet), one.tet.max(other.tet)],
        _ => TOO_MANY,
    };
    let mut listed = list(vertices, tets, &TET_FACES, sides);
    let tets = std::mem::take(&mut listed.values);
    let listed = faces_of(listed);
    if first(tets.len(), |face| tets[face] == TOO_MANY).is_some() {
        let face = face_tets(listed.faces.len(), &listed.tet_faces).expect_err("a face has three tets");
        return Err(listed.faces[face.index()]);
    }
    Ok(MatchedFaces { listed, tets })
}

/// For each tet the tet across each face, in the order of [`TET_FACES`]; `u32::MAX` if there is
/// none. It takes a fifth of the memory of [`matched_faces`].
///
/// # Errors
/// The vertices of a face that has more than two tets.
///
/// # Panics
/// As [`edges()`].
pub fn neighbours(vertices: usize, tets: &[[VertexId; 4]]) -> Result<Vec<[u32; 4]>, [VertexId; 3]> {
    list::neighbours(vertices, tets)
}

fn edges_of<T>(listed: Listed<2, 6, T>) -> Edges {
    let tet_edges = listed.of_tets.into_iter().map(|ids| ids.map(EdgeId)).collect();
    Edges { edges: listed.entities, tet_edges }
}

fn faces_of<T>(listed: Listed<3, 4, T>) -> Faces {
    let tet_faces = listed.of_tets.into_iter().map(|ids| ids.map(FaceId)).collect();
    Faces { faces: listed.entities, tet_faces }
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
        assert_eq!(matched_faces(6, &tets), Err([0, 1, 2].map(VertexId)));
        assert_eq!(neighbours(6, &tets), Err([0, 1, 2].map(VertexId)));
    }

    #[test]
    fn lists_agree_with_sets_and_each_tet_finds_its_own() {
        // Of several buckets.
        let mesh = lattice_cube(24);
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
        let matched = matched_faces(mesh.points.len(), &mesh.tets).unwrap();
        assert_eq!(matched.tets, face_tets(f.faces.len(), &f.tet_faces).unwrap());
        assert_eq!(matched.listed, f);
        let across = |tet: usize, face: &FaceId| {
            let [one, other] = matched.tets[face.index()];
            if one as usize == tet { other } else { one }
        };
        for (tet, beside) in neighbours(mesh.points.len(), &mesh.tets).unwrap().into_iter().enumerate() {
            assert!(f.tet_faces[tet].iter().map(|face| across(tet, face)).eq(beside));
        }
        let (again, last_tets) = edges_with_tets(mesh.points.len(), &mesh.tets);
        for (t, edges) in (0..).zip(&e.tet_edges) {
            assert!(edges.iter().all(|edge| last_tets[edge.index()] >= t));
        }
        for (edge, &tet) in last_tets.iter().enumerate() {
            assert!(e.tet_edges[tet as usize].contains(&EdgeId::new(edge)));
        }
        assert_eq!(again, e);
    }
}
