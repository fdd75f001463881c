//! Classification of the edges and faces of a mesh, from its segments and triangles.

use super::DistError;
use crate::ground::kernel::buckets::{first, tabulate};
use crate::ground::mesh::topology::{Edges, MatchedFaces};
use crate::ground::mesh::{Class, EDGE_BETWEEN, EdgeId, FaceId, Mesh, VertexId};
use csg::PatchId;
use rayon::prelude::*;

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

/// The edges and faces of a mesh.
pub(super) struct Tables {
    pub edges: Edges,
    /// A tet of each edge, the last.
    pub edge_tets: Vec<u32>,
    pub faces: MatchedFaces,
}

impl Tables {
    /// The edges and faces of each tet.
    pub fn into_tets(self) -> (Vec<[EdgeId; 6]>, Vec<[FaceId; 4]>) {
        (self.edges.tet_edges, self.faces.listed.tet_faces)
    }
}

/// Classifies the edges and faces of `mesh`.
///
/// # Errors
/// A [`DistError`] that names the entity if a segment or triangle is not an edge or face of a tet,
/// or occurs twice; if an edge between two patches is on no curve; if a face between two regions is
/// on no patch.
pub(super) fn classify(mesh: &Mesh, tables: &Tables) -> Result<Classified, DistError> {
    let Tables { edges, edge_tets, faces } = tables;
    let body = |tet: u32| Class::Body(mesh.bodies[tet as usize]);
    let mut edge_classes = tabulate(edge_tets.len(), |edge| body(edge_tets[edge]));
    let of_face = |[first, second]: [u32; 2]| body(if second == u32::MAX { first } else { second });
    let mut face_classes = tabulate(faces.tets.len(), |face| of_face(faces.tets[face]));

    let found = tabulate(mesh.triangles.len(), |index| find(mesh, tables, mesh.triangles[index].vertices));
    let mut triangles = Vec::with_capacity(mesh.triangles.len());
    let mut between_patches = Vec::new();
    for (index, (triangle, found)) in mesh.triangles.iter().zip(found).enumerate() {
        let vertices = raw(triangle.vertices);
        let (face, face_edges) = found.ok_or(DistError::TriangleNotAFace { triangle: index, vertices })?;
        if matches!(face_classes[face.index()], Class::Patch(_)) {
            return Err(DistError::TriangleTwice { triangle: index, vertices });
        }
        face_classes[face.index()] = Class::Patch(triangle.patch);
        triangles.push(Triangle { face, patch: triangle.patch, odd: is_odd(triangle.vertices) });
        for edge in face_edges {
            // An edge between two patches is resolved by the segments below.
            let class = &mut edge_classes[edge.index()];
            *class = match *class {
                Class::Patch(other) if other != triangle.patch => {
                    between_patches.push(edge);
                    Class::Corner(NOT_YET_ON_A_CURVE)
                }
                Class::Corner(_) => *class,
                _ => Class::Patch(triangle.patch),
            };
        }
    }
    triangles.par_sort_unstable();

    for (index, segment) in mesh.segments.iter().enumerate() {
        let vertices = raw(segment.vertices);
        let edge = edges
            .edges
            .binary_search(&ascending(segment.vertices))
            .map_err(|_| DistError::SegmentNotAnEdge { segment: index, vertices })?;
        if matches!(edge_classes[edge], Class::Curve(_)) {
            return Err(DistError::SegmentTwice { segment: index, vertices });
        }
        edge_classes[edge] = Class::Curve(segment.curve);
    }
    between_patches.retain(|edge| matches!(edge_classes[edge.index()], Class::Corner(_)));
    if let Some(edge) = between_patches.into_iter().min() {
        return Err(DistError::EdgeOnTwoPatches { vertices: raw(edges.edges[edge.index()]) });
    }
    expect_patches_between_regions(mesh, faces, &face_classes)?;
    Ok(Classified { edge_classes, face_classes, triangles })
}

/// The face with these vertices, and its edges.
fn find(mesh: &Mesh, tables: &Tables, vertices: [VertexId; 3]) -> Option<(FaceId, [EdgeId; 3])> {
    let MatchedFaces { listed, tets } = &tables.faces;
    let face = listed.faces.binary_search(&ascending(vertices)).ok()?;
    // The edges of a face are edges of its tets.
    let tet = tets[face][0] as usize;
    let corner = |vertex| mesh.tets[tet].iter().position(|&v| v == vertex).expect("a vertex of the face");
    let [a, b, c] = vertices.map(corner);
    let edges = [[a, b], [b, c], [c, a]].map(|[p, q]| tables.edges.tet_edges[tet][EDGE_BETWEEN[p][q]]);
    Some((FaceId::new(face), edges))
}

/// Temporary mark of an edge between triangles of two patches.
const NOT_YET_ON_A_CURVE: csg::CornerId = csg::CornerId(u32::MAX);

/// Checks that each face with one tet, or between two bodies, is on a patch.
fn expect_patches_between_regions(
    mesh: &Mesh,
    faces: &MatchedFaces,
    classes: &[Class],
) -> Result<(), DistError> {
    let is_bare = |face: usize| {
        let [one, other] = faces.tets[face];
        let inside = other != u32::MAX && mesh.bodies[one as usize] == mesh.bodies[other as usize];
        !inside && !matches!(classes[face], Class::Patch(_))
    };
    match first(classes.len(), is_bare) {
        Some(face) => Err(DistError::FaceOnNoPatch { vertices: raw(faces.listed.faces[face]) }),
        None => Ok(()),
    }
}
