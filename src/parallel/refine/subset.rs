//! Some tets of a coarse mesh as a part of their own.

use crate::ground::mesh::{EdgeId, FaceId, TetId, VertexId};
use crate::parallel::distribution::{BoundaryFace, DistMesh};

/// A subset of the tets (ascending) as a part with its boundary triangles, without neighbours.
/// Global ids and totals are those of the mesh, so refining the subset gives the same vertices and
/// tets as refining the mesh.
pub fn subset(mesh: &DistMesh, tets: &[u32]) -> DistMesh {
    let faces = used(tets, |tet| mesh.tet_faces[tet].map(|f| f.0));
    let here = |tet: TetId| tets.binary_search(&tet.0).ok().map(TetId::new);
    let triangle = |triangle: &BoundaryFace| {
        let parents = triangle.parents.map(|tet| tet.and_then(here));
        // The search is for triangles with a tet here only.
        let is_here = parents.iter().any(Option::is_some);
        is_here.then(|| BoundaryFace {
            face: FaceId(renumber(&faces, triangle.face.0)),
            parents,
            ..*triangle
        })
    };
    let boundary = mesh.boundary.iter().filter_map(triangle).collect();
    DistMesh { boundary, ..extract(mesh, tets) }
}

/// A subset of the tets (ascending) as a part without boundary and neighbours.
pub(super) fn extract(mesh: &DistMesh, tets: &[u32]) -> DistMesh {
    let vertices = used(tets, |tet| mesh.tets[tet].map(|v| v.0));
    let edges = used(tets, |tet| mesh.tet_edges[tet].map(|e| e.0));
    let faces = used(tets, |tet| mesh.tet_faces[tet].map(|f| f.0));
    let vertex = |v: VertexId| VertexId(renumber(&vertices, v.0));
    let tet_ids = tets.iter().map(|&t| TetId(t));
    DistMesh {
        rank: mesh.rank,
        ranks: mesh.ranks,
        totals: mesh.totals,
        points: pick(&mesh.points, &vertices),
        vertex_ids: pick(&mesh.vertex_ids, &vertices),
        vertex_classes: pick(&mesh.vertex_classes, &vertices),
        edges: edges.iter().map(|&e| mesh.edges[e as usize].map(vertex)).collect(),
        edge_ids: pick(&mesh.edge_ids, &edges),
        edge_classes: pick(&mesh.edge_classes, &edges),
        faces: faces.iter().map(|&f| mesh.faces[f as usize].map(vertex)).collect(),
        face_ids: pick(&mesh.face_ids, &faces),
        face_classes: pick(&mesh.face_classes, &faces),
        tets: tet_ids.clone().map(|t| mesh.tets[t.index()].map(vertex)).collect(),
        tet_ids: pick(&mesh.tet_ids, tets),
        tet_bodies: pick(&mesh.tet_bodies, tets),
        tet_edges: tet_ids
            .clone()
            .map(|t| mesh.tet_edges[t.index()].map(|e| EdgeId(renumber(&edges, e.0))))
            .collect(),
        tet_faces: tet_ids
            .map(|t| mesh.tet_faces[t.index()].map(|f| FaceId(renumber(&faces, f.0))))
            .collect(),
        ..DistMesh::default()
    }
}

/// The entities used by the given tets, ascending.
fn used<const N: usize>(tets: &[u32], of: impl Fn(usize) -> [u32; N]) -> Vec<u32> {
    let mut used: Vec<u32> = tets.iter().flat_map(|&tet| of(tet as usize)).collect();
    used.sort_unstable();
    used.dedup();
    used
}

fn renumber(used: &[u32], id: u32) -> u32 {
    used.binary_search(&id).expect("an entity of the extracted tets") as u32
}

fn pick<T: Clone>(all: &[T], ids: &[u32]) -> Vec<T> {
    ids.iter().map(|&id| all[id as usize].clone()).collect()
}
