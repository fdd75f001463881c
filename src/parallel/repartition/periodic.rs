//! Periodic faces of meshes whose parts were filled separately.
//!
//! Elmer eliminates the nodes of a periodic copy part by part. So a part with such a node needs a
//! face there, and a part with a face needs its copy. The coarse parts have this property
//! ([`ties`](crate::parallel::partition::ties)), and so have the parts that fill them, until tets
//! move: those that touch a periodic face do not.

use crate::Point;
use crate::ground::comm::{CommError, Communicator};
use crate::ground::mesh::periodic::{Link, PeriodicFace, PeriodicFaces, is_linked};
use crate::ground::mesh::{TET_FACES, VertexId};
use crate::parallel::distribution::{BareMesh, BoundaryFace, DistMesh};
use csg::PatchId;
use std::collections::BTreeSet;

/// **Collective.** Gathers the triangles on periodic patches, with their vertices, on rank 0: their
/// number grows as the surface, not as the mesh.
///
/// # Errors
/// [`CommError`] if another rank fails.
pub fn gather_faces(
    comm: &dyn Communicator,
    mesh: &DistMesh,
    links: &[Link],
) -> Result<PeriodicFaces, CommError> {
    let linked = || mesh.boundary.iter().filter(|triangle| is_linked(links, triangle.patch));
    let faces: Vec<[u64; 8]> = linked().map(|triangle| words(mesh, triangle)).collect();
    let vertices: BTreeSet<VertexId> =
        linked().flat_map(|triangle| mesh.faces[triangle.face.index()]).collect();
    let points: Vec<[u64; 4]> = vertices
        .into_iter()
        .map(|v| {
            let [x, y, z] = mesh.points[v.index()].coords.into();
            [mesh.vertex_ids[v.index()], f64::to_bits(x), f64::to_bits(y), f64::to_bits(z)]
        })
        .collect();
    let faces: BTreeSet<[u64; 8]> = comm.gather(0, &faces)?.into_iter().flatten().collect();
    let face = |[patch, a, b, c, face, d, e, f]: [u64; 8]| PeriodicFace {
        patch: PatchId(patch as u32),
        vertices: [a, b, c],
        face,
        edges: [d, e, f],
    };
    let point = |[id, x, y, z]: [u64; 4]| (id, Point::from([x, y, z].map(f64::from_bits)));
    Ok(PeriodicFaces {
        // A face between two parts comes from both.
        faces: faces.into_iter().map(face).collect(),
        points: comm.gather(0, &points)?.into_iter().flatten().map(point).collect(),
    })
}

/// A triangle as its patch, vertices, face and edges.
fn words(mesh: &DistMesh, triangle: &BoundaryFace) -> [u64; 8] {
    let [a, b, c] = mesh.faces[triangle.face.index()];
    let edge = |ends: [VertexId; 2]| {
        mesh.edge_ids[mesh.edges.binary_search(&ends).expect("an edge of a face of a tet")]
    };
    let [x, y, z] = [a, b, c].map(|v| mesh.vertex_ids[v.index()]);
    let face = mesh.face_ids[triangle.face.index()];
    [u64::from(triangle.patch.0), x, y, z, face, edge([a, b]), edge([a, c]), edge([b, c])]
}

/// **Collective.** For each tet, whether it touches a periodic patch: such tets must stay where
/// they are.
///
/// # Errors
/// [`CommError`] if another rank fails.
pub fn touching(comm: &dyn Communicator, mesh: &BareMesh, links: &[Link]) -> Result<Vec<bool>, CommError> {
    if links.is_empty() {
        return Ok(vec![false; mesh.tets.len()]);
    }
    let mut on_patch = vec![false; mesh.points.len()];
    for side in mesh.sides.iter().filter(|side| is_linked(links, side.patch)) {
        let tet = mesh.tets[side.tet.index()];
        TET_FACES[usize::from(side.face)].iter().for_each(|&i| on_patch[tet[i].index()] = true);
    }
    // Of a tet that touches a patch by an edge or vertex, the face may be on another rank.
    mesh.shared.any(comm, &mut on_patch)?;
    Ok(mesh.tets.iter().map(|tet| tet.iter().any(|v| on_patch[v.index()])).collect())
}
