//! A part without its edges and faces: what moves between ranks.

use super::{DistMesh, Shared};
use crate::mesh::stream::Counts;
use crate::mesh::{Class, GlobalId, Rank, TetId, VertexId};
use csg::{BodyId, PatchId};

/// A face of a tet that lies on a patch. A triangle between two tets is there twice, once for each.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Side {
    /// The tet.
    pub tet: TetId,
    /// The face of the tet: its place in [`TET_FACES`](crate::mesh::TET_FACES).
    pub face: u8,
    /// The patch.
    pub patch: PatchId,
    /// Whether the tet lies behind the patch, on its inside.
    pub behind: bool,
}

/// An edge on a curve or a patch.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct LaidEdge {
    /// Its vertices, ascending.
    pub vertices: [VertexId; 2],
    /// What it lies on: a curve or a patch.
    pub class: Class,
}

impl LaidEdge {
    /// The edge between two vertices, in any order.
    pub fn new([a, b]: [VertexId; 2], class: Class) -> Self {
        Self { vertices: [a.min(b), a.max(b)], class }
    }

    /// The edges of a triangle on a patch.
    pub fn round([a, b, c]: [VertexId; 3], patch: PatchId) -> [Self; 3] {
        [[a, b], [b, c], [c, a]].map(|ends| Self::new(ends, Class::Patch(patch)))
    }

    /// Sorts edges, each once: of one that is there several times the class that comes first holds, that of the curve if it is on one.
    pub fn sort(edges: &mut Vec<Self>) {
        edges.sort_unstable();
        edges.dedup_by_key(|edge| edge.vertices);
    }
}

/// A part with its tets, its vertices and what cannot be told from these: a third of a [`DistMesh`] in memory.
///
/// It has no edges and faces but those that lie on something: the others follow from the tets, and so do the ids and holders of
/// all ([`settle`](super::settle())). Migration and writers need no more. Local ids ascend with global ids.
///
/// ```text
///   DistMesh ── forget edges and faces ──► BareMesh ── migrate ──► BareMesh ── settle ──► DistMesh
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BareMesh {
    /// This rank.
    pub rank: Rank,
    /// The number of ranks.
    pub ranks: u32,
    /// Counts of the whole mesh, the same on all ranks.
    pub totals: Counts,
    /// Coordinates of the vertices.
    pub points: Vec<[f64; 3]>,
    /// Global ids of the vertices, ascending.
    pub vertex_ids: Vec<GlobalId>,
    /// What the vertices lie on.
    pub vertex_classes: Vec<Class>,
    /// Vertices on interfaces and their holders.
    pub shared: Shared,
    /// The tets, positively oriented.
    pub tets: Vec<[VertexId; 4]>,
    /// Global ids of the tets, ascending.
    pub tet_ids: Vec<GlobalId>,
    /// The bodies of the tets.
    pub tet_bodies: Vec<BodyId>,
    /// The faces of the tets that lie on patches, ascending.
    pub sides: Vec<Side>,
    /// The edges of the tets that lie on curves and patches, ascending, also where the triangle that says so is on another rank.
    pub edges: Vec<LaidEdge>,
}

impl From<DistMesh> for BareMesh {
    /// *Local.* Forgets the edges and faces.
    fn from(mesh: DistMesh) -> Self {
        let side = |triangle: &super::BoundaryFace, tet: Option<TetId>, behind| {
            let tet = tet?;
            let face = mesh.tet_faces[tet.index()].iter().position(|&face| face == triangle.face);
            let face = face.expect("a parent has the face") as u8;
            Some(Side { tet, face, patch: triangle.patch, behind })
        };
        let both = |t: &super::BoundaryFace| [side(t, t.parents[0], true), side(t, t.parents[1], false)];
        let mut sides: Vec<Side> = mesh.boundary.iter().flat_map(both).flatten().collect();
        sides.sort_unstable();
        let laid = |(&vertices, &class): (&[VertexId; 2], &Class)| {
            (!matches!(class, Class::Body(_))).then_some(LaidEdge { vertices, class })
        };
        Self {
            rank: mesh.rank,
            ranks: mesh.ranks,
            totals: Counts {
                vertices: mesh.totals.vertices,
                tets: mesh.totals.tets,
                boundary: mesh.totals.boundary,
            },
            edges: mesh.edges.iter().zip(&mesh.edge_classes).filter_map(laid).collect(),
            sides,
            points: mesh.points.into_iter().map(|p| [p.x, p.y, p.z]).collect(),
            vertex_ids: mesh.vertex_ids,
            vertex_classes: mesh.vertex_classes,
            shared: mesh.shared_vertices,
            tets: mesh.tets,
            tet_ids: mesh.tet_ids,
            tet_bodies: mesh.tet_bodies,
        }
    }
}

impl BareMesh {
    /// *Local.* The ranks that hold a vertex, ascending: this one alone if it is not shared.
    pub fn vertex_holders(&self, vertex: VertexId) -> &[Rank] {
        self.shared.holders_of(vertex.0).unwrap_or(std::slice::from_ref(&self.rank))
    }

    /// *Local.* Bytes that the arrays of this part take.
    pub fn bytes(&self) -> u64 {
        let Shared { ids, offsets, holders } = &self.shared;
        let vertices =
            size_of_val(&*self.points) + size_of_val(&*self.vertex_ids) + size_of_val(&*self.vertex_classes);
        let tets = size_of_val(&*self.tets) + size_of_val(&*self.tet_ids) + size_of_val(&*self.tet_bodies);
        let laid = size_of_val(&*self.sides) + size_of_val(&*self.edges);
        let shared = size_of_val(&**ids) + size_of_val(&**offsets) + size_of_val(&**holders);
        (vertices + tets + laid + shared) as u64
    }
}
