//! A distributed mesh: one part per rank, and tables of shared entities.
//!
//! A **part** is an ordinary mesh with tables of what is **shared**: for each vertex, edge and face
//! that other ranks have too, the list of all sharing ranks, its **holders**. Tets are never
//! shared. Every rank can compute the **owner** of a shared entity from its holders and its id,
//! without messages (see [`owner`]).
//!
//! ```text
//!     rank 0 |\  rank 1        The edge between the two parts and its ends are shared: holders 0, 1.
//!            | \               Each rank has its own copy, with the same coordinates,
//!            |__\              the same global id and the same class.
//! ```
//!
//! [`distribute()`] makes it from a mesh on rank 0; [`DistMesh::check`] verifies that the ranks
//! agree. A part read from files or moved between ranks has only tets and vertices, a [`BareMesh`]:
//! [`number_shared()`] constructs its edges and faces.

mod bare;
mod check;
mod classify;
mod distribute;
mod number_shared;
mod piece;
mod residence;
mod shared;

pub use bare::{BareMesh, ClassifiedEdge, Side};
pub use check::{CheckError, Faults};
pub use distribute::{DistError, distribute, distribute_matched, from_serial};
pub(crate) use number_shared::directory_rank;
pub use number_shared::{NumberError, number_shared};
pub use shared::owner;

use crate::Point;
use crate::ground::mesh::{Class, EdgeId, FaceId, GlobalId, Rank, TET_FACES, TetId, VertexId};
use csg::{BodyId, PatchId};

/// Shared entities of one kind (vertices, edges or faces) with their holders.
///
/// A rank has fewer than 2³² entries in all.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Shared {
    /// Local ids, ascending.
    pub ids: Vec<u32>,
    /// The start of each entity's holders in `holders`; one more entry than `ids`.
    pub offsets: Vec<u32>,
    /// The holders of each entity, ascending, this rank among them.
    pub holders: Vec<Rank>,
}

/// A boundary triangle of a part. Its orientation follows from its parents: see
/// [`DistMesh::boundary_vertices`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BoundaryFace {
    /// The face.
    pub face: FaceId,
    /// The patch it is classified on.
    pub patch: PatchId,
    /// The tets of this part behind it (on the patch's inside) and in front of it; at least one.
    pub parents: [Option<TetId>; 2],
}

/// Counts of the whole mesh, the same on all ranks.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Totals {
    /// The number of vertices.
    pub vertices: u64,
    /// The number of edges.
    pub edges: u64,
    /// The number of faces.
    pub faces: u64,
    /// The number of tets.
    pub tets: u64,
    /// The number of triangles on patches.
    pub boundary: u64,
}

/// The part of a distributed mesh on one rank.
///
/// A **part** is an ordinary mesh plus, for each vertex, edge and face on an interface, the ranks
/// that share it. Tets are never shared. Local ids ascend with global ids, for each kind. Edges and
/// faces list their vertices by ascending global id.
///
/// The global ids of each kind are 0 to the number of such entities of the whole mesh, without gaps
/// ([`totals`](Self::totals)), and do not depend on the partition: they can number unknowns. The
/// local ids of vertices and tets agree with those of [`Arrays`](crate::mesh::Arrays) of the same
/// part, and the owners of vertices with those of [`Sharing`](crate::mesh::Sharing).
///
/// Ghost tets are not stored here.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct DistMesh {
    /// This rank.
    pub rank: Rank,
    /// The number of ranks.
    pub ranks: u32,
    /// Counts of the whole mesh.
    pub totals: Totals,

    /// Coordinates of the vertices.
    pub points: Vec<Point>,
    /// Global ids of the vertices, ascending.
    pub vertex_ids: Vec<GlobalId>,
    /// The geometric entities the vertices are classified on.
    pub vertex_classes: Vec<Class>,
    /// The edges of the tets.
    pub edges: Vec<[VertexId; 2]>,
    /// Global ids of the edges, ascending.
    pub edge_ids: Vec<GlobalId>,
    /// The geometric entities the edges are classified on, also if the boundary triangle that
    /// determines it is on another rank.
    pub edge_classes: Vec<Class>,
    /// The faces of the tets.
    pub faces: Vec<[VertexId; 3]>,
    /// Global ids of the faces, ascending.
    pub face_ids: Vec<GlobalId>,
    /// The geometric entities the faces are classified on.
    pub face_classes: Vec<Class>,
    /// The tets, positively oriented.
    pub tets: Vec<[VertexId; 4]>,
    /// For second order, the nodes on the edges of each tet, in the order of
    /// [`TET_EDGES`](crate::ground::mesh::TET_EDGES); otherwise empty. They are vertices like the
    /// corners; [`edges`](Self::edges) and [`faces`](Self::faces) are those of the corners.
    pub edge_nodes: Vec<[VertexId; 6]>,
    /// Global ids of the tets, ascending.
    pub tet_ids: Vec<GlobalId>,
    /// The bodies of the tets.
    pub tet_bodies: Vec<BodyId>,
    /// The edges of each tet in the order of [`TET_EDGES`](crate::ground::mesh::TET_EDGES).
    pub tet_edges: Vec<[EdgeId; 6]>,
    /// The faces of each tet in the order of [`TET_FACES`].
    pub tet_faces: Vec<[FaceId; 4]>,
    /// The triangles on patches next to a tet of this part, by ascending face. A triangle between
    /// two parts is on both ranks, with one parent each.
    pub boundary: Vec<BoundaryFace>,

    /// Vertices on interfaces.
    pub shared_vertices: Shared,
    /// Edges on interfaces.
    pub shared_edges: Shared,
    /// Faces on interfaces.
    pub shared_faces: Shared,
}

/// The vertices of the face with local number `face` of a tet, oriented outward.
fn outward(tet: &[VertexId; 4], face: usize) -> [VertexId; 3] {
    TET_FACES[face].map(|i| tet[i])
}

impl DistMesh {
    /// *Local.* The vertices of a boundary triangle, ordered so that its right-hand normal points
    /// from the patch's inside to its outside.
    ///
    /// # Panics
    /// If it has no parent, or a parent does not have the face.
    pub fn boundary_vertices(&self, triangle: &BoundaryFace) -> [VertexId; 3] {
        let outward_from = |tet: TetId| {
            let faces = &self.tet_faces[tet.index()];
            let place = faces.iter().position(|&face| face == triangle.face);
            outward(&self.tets[tet.index()], place.expect("a parent has the face"))
        };
        match triangle.parents {
            [Some(behind), _] => outward_from(behind),
            [None, Some(front)] => {
                let [a, b, c] = outward_from(front);
                [a, c, b]
            }
            [None, None] => panic!("{triangle:?} on rank {} has no parent", self.rank),
        }
    }
}
