//! Element-only part: tets and vertices without the tables of edges and faces. This is what
//! migrates between ranks.

use super::{DistMesh, Shared};
use crate::ground::mesh::stream::Counts;
use crate::ground::mesh::{Class, GlobalId, Rank, TetId, VertexId};
use csg::{BodyId, PatchId};

/// A face of a tet on a patch. A triangle between two tets appears twice, once for each.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Side {
    /// The tet.
    pub tet: TetId,
    /// The local number of the face in the tet, as in
    /// [`TET_FACES`](crate::ground::mesh::TET_FACES).
    pub face: u8,
    /// The patch.
    pub patch: PatchId,
    /// Whether the tet is behind the patch, on its inside.
    pub behind: bool,
}

/// An edge that is classified on a curve or a patch.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct ClassifiedEdge {
    /// Its vertices, ascending.
    pub vertices: [VertexId; 2],
    /// The curve or patch it is classified on.
    pub class: Class,
}

impl ClassifiedEdge {
    /// The edge between two vertices, given in any order.
    pub fn new([a, b]: [VertexId; 2], class: Class) -> Self {
        Self { vertices: [a.min(b), a.max(b)], class }
    }

    /// The edges of a triangle on a patch.
    pub fn of_triangle([a, b, c]: [VertexId; 3], patch: PatchId) -> [Self; 3] {
        [[a, b], [b, c], [c, a]].map(|ends| Self::new(ends, Class::Patch(patch)))
    }

    /// Sorts edges and removes duplicates. Of duplicates the smallest class wins: the curve if the
    /// edge is on one.
    pub fn sort(edges: &mut Vec<Self>) {
        edges.sort_unstable();
        edges.dedup_by_key(|edge| edge.vertices);
    }
}

/// A part with only tets, vertices and classification: a third of a [`DistMesh`] in memory.
///
/// The only edges and faces are those classified on curves and patches. The others follow from the
/// tets, as do the ids and holders of all edges and faces
/// ([`number_shared`](super::number_shared())). Migration and writers need no more. Local ids
/// ascend with global ids.
///
/// ```text
///     DistMesh ── drop edges and faces ──► BareMesh ── migrate ──► BareMesh ── number_shared ──► DistMesh
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
    /// The geometric entities the vertices are classified on.
    pub vertex_classes: Vec<Class>,
    /// Vertices on interfaces and their holders.
    pub shared: Shared,
    /// The tets, positively oriented.
    pub tets: Vec<[VertexId; 4]>,
    /// For second order, the nodes on the edges of each tet, in the order of
    /// [`TET_EDGES`](crate::ground::mesh::TET_EDGES); otherwise empty. They are vertices like the
    /// corners.
    pub edge_nodes: Vec<[VertexId; 6]>,
    /// Global ids of the tets, ascending.
    pub tet_ids: Vec<GlobalId>,
    /// The bodies of the tets.
    pub tet_bodies: Vec<BodyId>,
    /// The faces of the tets that lie on patches, ascending.
    pub sides: Vec<Side>,
    /// The edges on curves and patches, ascending, also if the triangle that determines the class
    /// is on another rank.
    pub edges: Vec<ClassifiedEdge>,
}

impl From<DistMesh> for BareMesh {
    /// *Local.* Drops the tables of edges and faces.
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
        let classified = |(&vertices, &class): (&[VertexId; 2], &Class)| {
            (!matches!(class, Class::Body(_))).then_some(ClassifiedEdge { vertices, class })
        };
        Self {
            rank: mesh.rank,
            ranks: mesh.ranks,
            totals: Counts {
                vertices: mesh.totals.vertices,
                tets: mesh.totals.tets,
                boundary: mesh.totals.boundary,
            },
            edges: mesh.edges.iter().zip(&mesh.edge_classes).filter_map(classified).collect(),
            sides,
            points: mesh.points.into_iter().map(|p| [p.x, p.y, p.z]).collect(),
            vertex_ids: mesh.vertex_ids,
            vertex_classes: mesh.vertex_classes,
            shared: mesh.shared_vertices,
            tets: mesh.tets,
            edge_nodes: mesh.edge_nodes,
            tet_ids: mesh.tet_ids,
            tet_bodies: mesh.tet_bodies,
        }
    }
}

impl BareMesh {
    /// *Local.* The ranks that share a vertex, ascending: only this one if it is not shared.
    pub fn vertex_holders(&self, vertex: VertexId) -> &[Rank] {
        self.shared.holders_of(vertex.0).unwrap_or(std::slice::from_ref(&self.rank))
    }

    /// *Local.* The bytes of this part's arrays.
    pub fn bytes(&self) -> u64 {
        let Shared { ids, offsets, holders } = &self.shared;
        let vertices =
            size_of_val(&*self.points) + size_of_val(&*self.vertex_ids) + size_of_val(&*self.vertex_classes);
        let tets = size_of_val(&*self.edge_nodes)
            + size_of_val(&*self.tets)
            + size_of_val(&*self.tet_ids)
            + size_of_val(&*self.tet_bodies);
        let classified = size_of_val(&*self.sides) + size_of_val(&*self.edges);
        let shared = size_of_val(&**ids) + size_of_val(&**offsets) + size_of_val(&**holders);
        (vertices + tets + classified + shared) as u64
    }
}
