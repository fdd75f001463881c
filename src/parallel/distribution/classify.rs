//! Classification of the edges and faces of a mesh, from its segments and triangles.

use super::DistError;
use crate::ground::mesh::topology::{Edges, Faces, face_tets};
use crate::ground::mesh::{Class, FaceId, Mesh, VertexId};
use csg::PatchId;

/// A boundary triangle, by its face.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Triangle {
    pub face: FaceId,
    pub patch: PatchId,
    /// Whether its vertices are an odd permutation of the face's ascending vertices.
    pub odd: bool,
}

/// The classes of all edges and faces, and the triangles by ascending face.
pub(super) struct Classified {
    pub edge_classes: Vec<Class>,
    pub face_classes: Vec<Class>,
    pub triangles: Vec<Triangle>,
}

/// Whether sorting these vertices takes an odd number of swaps.
pub(super) fn is_odd([a, b, c]: [VertexId; 3]) -> bool {
    (a > b) ^ (b > c) ^ (a > c)
}

fn ascending<const N: usize>(mut vertices: [VertexId; N]) -> [VertexId; N] {
    vertices.sort_unstable();
    vertices
}

fn raw<const N: usize>(vertices: [VertexId; N]) -> [u32; N] {
    vertices.map(|v| v.0)
}

/// Classifies the edges and faces of `mesh`.
///
/// # Errors
/// A [`DistError`] that names the entity if a segment or triangle is not an edge or face of a tet,
/// or occurs twice; if an edge between two patches is on no curve; if a face between two regions is
/// on no patch; if a face has three tets.
pub(super) fn classify(mesh: &Mesh, edges: &Edges, faces: &Faces) -> Result<Classified, DistError> {
    let body = |tet: usize| Class::Body(mesh.bodies[tet]);
    let mut edge_classes = vec![Class::Body(csg::BodyId(0)); edges.edges.len()];
    let mut face_classes = vec![Class::Body(csg::BodyId(0)); faces.faces.len()];
    for (tet, (tet_edges, tet_faces)) in edges.tet_edges.iter().zip(&faces.tet_faces).enumerate() {
        tet_edges.iter().for_each(|edge| edge_classes[edge.index()] = body(tet));
        tet_faces.iter().for_each(|face| face_classes[face.index()] = body(tet));
    }

    let find_edge = |vertices: [VertexId; 2]| edges.edges.binary_search(&ascending(vertices)).ok();
    let mut triangles = Vec::with_capacity(mesh.triangles.len());
    for (index, triangle) in mesh.triangles.iter().enumerate() {
        let [a, b, c] = triangle.vertices;
        let face = faces
            .faces
            .binary_search(&ascending(triangle.vertices))
            .map_err(|_| DistError::TriangleNotAFace { triangle: index, vertices: raw(triangle.vertices) })?;
        if matches!(face_classes[face], Class::Patch(_)) {
            return Err(DistError::TriangleTwice { triangle: index, vertices: raw(triangle.vertices) });
        }
        face_classes[face] = Class::Patch(triangle.patch);
        triangles.push(Triangle {
            face: FaceId::new(face),
            patch: triangle.patch,
            odd: is_odd(triangle.vertices),
        });
        for edge in [[a, b], [b, c], [c, a]] {
            // The edges of a face are edges of its tet. An edge between two patches is resolved by
            // the segments below.
            let class = &mut edge_classes[find_edge(edge).expect("the edge of a listed face is listed")];
            *class = match *class {
                Class::Patch(other) if other != triangle.patch => Class::Corner(NOT_YET_ON_A_CURVE),
                Class::Corner(_) => *class,
                _ => Class::Patch(triangle.patch),
            };
        }
    }
    triangles.sort_unstable();

    for (index, segment) in mesh.segments.iter().enumerate() {
        let vertices = raw(segment.vertices);
        let edge =
            find_edge(segment.vertices).ok_or(DistError::SegmentNotAnEdge { segment: index, vertices })?;
        if matches!(edge_classes[edge], Class::Curve(_)) {
            return Err(DistError::SegmentTwice { segment: index, vertices });
        }
        edge_classes[edge] = Class::Curve(segment.curve);
    }
    if let Some(edge) = edge_classes.iter().position(|class| matches!(class, Class::Corner(_))) {
        return Err(DistError::EdgeOnTwoPatches { vertices: raw(edges.edges[edge]) });
    }
    expect_patches_between_regions(mesh, faces, &face_classes)?;
    Ok(Classified { edge_classes, face_classes, triangles })
}

/// Temporary mark of an edge between triangles of two patches.
const NOT_YET_ON_A_CURVE: csg::CornerId = csg::CornerId(u32::MAX);

/// Checks that each face with one tet, or between two bodies, is on a patch.
fn expect_patches_between_regions(mesh: &Mesh, faces: &Faces, classes: &[Class]) -> Result<(), DistError> {
    let vertices = |face: FaceId| raw(faces.faces[face.index()]);
    let sides = face_tets(faces.faces.len(), &faces.tet_faces)
        .map_err(|face| DistError::FaceOfThreeTets { vertices: vertices(face) })?;
    for (face, (class, [first, second])) in classes.iter().zip(sides).enumerate() {
        let inside = second != u32::MAX && mesh.bodies[first as usize] == mesh.bodies[second as usize];
        if !inside && !matches!(class, Class::Patch(_)) {
            return Err(DistError::FaceOnNoPatch { vertices: vertices(FaceId::new(face)) });
        }
    }
    Ok(())
}
