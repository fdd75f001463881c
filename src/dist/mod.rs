//! A distributed mesh: one part per rank, and who else holds what.
//!
//! A **part** is an ordinary mesh with tables of what is **shared**: of each vertex, edge and face that
//! other ranks hold too, the list of all **holders**. Tets are never shared. From the holders and a sum of ids
//! every rank can tell the **owner** without asking (see [`owner`]).
//!
//! ```text
//!   rank 0 |\  rank 1       The edge between the two parts and its ends are shared: holders 0, 1.
//!          | \             Each rank has its own copy, with the same coordinates,
//!          |__\            the same global id and the same class.
//! ```
//!
//! [`distribute()`] makes it from a mesh on rank 0; [`DistMesh::check`] says whether the ranks agree. Of a part that came from
//! elsewhere only tets and vertices are known, a [`BareMesh`]: [`settle()`] finds its edges and faces.

mod bare;
mod check;
mod classify;
mod distribute;
mod piece;
mod settle;
mod shared;

pub use bare::{BareMesh, LaidEdge, Side};
pub use check::Faults;
pub use distribute::{DistError, distribute, from_serial};
pub use settle::{SettleError, settle};
pub use shared::owner;

use crate::Point;
use crate::mesh::{Class, EdgeId, FaceId, GlobalId, Rank, TET_FACES, TetId, VertexId};
use csg::{BodyId, PatchId};

/// Entities of one kind that more than one rank holds, with all holders: fewer than 2³² entries in all on a rank.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Shared {
    /// Local ids, ascending.
    pub ids: Vec<u32>,
    /// Where the holders of each begin in `holders`; one more entry than `ids`.
    pub offsets: Vec<u32>,
    /// The holders, ascending for each, this rank among them.
    pub holders: Vec<Rank>,
}

/// A boundary triangle of a part. Its direction follows from its parents: see [`DistMesh::boundary_vertices`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BoundaryFace {
    /// The face.
    pub face: FaceId,
    /// The patch it lies on.
    pub patch: PatchId,
    /// The tets of this part behind it (on the patch's inside) and in front of it. At least one.
    pub parents: [Option<TetId>; 2],
}

/// Counts of the whole mesh, the same on all ranks.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Totals {
    /// Vertices.
    pub vertices: u64,
    /// Edges.
    pub edges: u64,
    /// Faces.
    pub faces: u64,
    /// Tets.
    pub tets: u64,
    /// Triangles on patches.
    pub boundary: u64,
}

/// The part of a distributed mesh that one rank holds.
///
/// A **part** is an ordinary mesh plus, for each vertex, edge and face on an interface, the ranks that
/// also hold a copy. Tets are never shared. Local ids ascend with global ids, for each kind.
/// Edges and faces list their vertices by ascending global id.
///
/// Not kept here: ghost tets.
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
    /// What the vertices lie on.
    pub vertex_classes: Vec<Class>,
    /// The edges of the tets.
    pub edges: Vec<[VertexId; 2]>,
    /// Global ids of the edges, ascending.
    pub edge_ids: Vec<GlobalId>,
    /// What the edges lie on, also where the boundary triangle that says so is on another rank.
    pub edge_classes: Vec<Class>,
    /// The faces of the tets.
    pub faces: Vec<[VertexId; 3]>,
    /// Global ids of the faces, ascending.
    pub face_ids: Vec<GlobalId>,
    /// What the faces lie on.
    pub face_classes: Vec<Class>,
    /// The tets, positively oriented.
    pub tets: Vec<[VertexId; 4]>,
    /// Global ids of the tets, ascending.
    pub tet_ids: Vec<GlobalId>,
    /// The bodies of the tets.
    pub tet_bodies: Vec<BodyId>,
    /// The edges of each tet in the order of [`TET_EDGES`](crate::mesh::TET_EDGES).
    pub tet_edges: Vec<[EdgeId; 6]>,
    /// The faces of each tet in the order of [`TET_FACES`].
    pub tet_faces: Vec<[FaceId; 4]>,
    /// The triangles on patches that have a tet of this part beside them, by ascending face. One that lies
    /// between two parts is on both ranks, with one parent each.
    pub boundary: Vec<BoundaryFace>,

    /// Vertices on interfaces.
    pub shared_vertices: Shared,
    /// Edges on interfaces.
    pub shared_edges: Shared,
    /// Faces on interfaces.
    pub shared_faces: Shared,
}

/// The vertices of a tet's face as seen from outside, from the face's place in the tet.
fn outward(tet: &[VertexId; 4], face: usize) -> [VertexId; 3] {
    TET_FACES[face].map(|i| tet[i])
}

impl DistMesh {
    /// *Local.* The vertices of a boundary triangle, so that its normal by the right-hand rule points from
    /// the patch's inside to its outside.
    ///
    /// # Panics
    /// If it has no parent, or one that does not have the face.
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
