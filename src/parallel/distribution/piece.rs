//! The message from rank 0 with one rank's part: the minimum from which the rank can assemble it.
//!
//! Neither the edges and faces themselves are sent, nor those of each tet: the rank enumerates them
//! from its tets. Its vertices keep their global order, so its edges and faces do too, and the sent
//! global ids and classes match the enumeration.

use super::classify::{Triangle, is_odd};
use super::{BoundaryFace, DistMesh, Shared, Totals, outward};
use crate::Point;
use crate::ground::comm::pack::{put, take};
use crate::ground::kernel::buckets::tabulate;
use crate::ground::mesh::topology::{self, Edges, Faces, MatchedFaces};
use crate::ground::mesh::{Class, FaceId, GlobalId, Rank, TetId, VertexId};
use csg::{BodyId, PatchId};

/// Entities of one kind: global ids ascending, classes, and the holders of the shared ones.
#[derive(Default)]
pub(super) struct Entities {
    pub ids: Vec<GlobalId>,
    pub classes: Vec<Class>,
    pub shared: Shared,
}

/// The content of the message for one rank.
#[derive(Default)]
pub(super) struct Piece {
    pub totals: Totals,
    pub points: Vec<Point>,
    pub vertices: Entities,
    pub edges: Entities,
    pub faces: Entities,
    pub tet_ids: Vec<GlobalId>,
    /// By local vertices.
    pub tets: Vec<[VertexId; 4]>,
    pub bodies: Vec<BodyId>,
    /// By local faces.
    pub triangles: Vec<Triangle>,
}

impl Entities {
    fn put(&self, message: &mut Vec<u8>) {
        put(message, &self.ids);
        put(message, &self.classes.iter().map(|&class| class.code()).collect::<Vec<_>>());
        put(message, &self.shared.ids);
        put(message, &self.shared.offsets);
        put(message, &self.shared.holders);
    }

    fn take(message: &mut &[u8]) -> Self {
        Self {
            ids: take(message),
            classes: take(message).into_iter().map(Class::decode).collect(),
            shared: Shared { ids: take(message), offsets: take(message), holders: take(message) },
        }
    }
}

impl Piece {
    pub fn to_message(&self) -> Vec<u8> {
        let Totals { vertices, edges, faces, tets, boundary } = self.totals;
        let mut message = Vec::new();
        put(&mut message, &[vertices, edges, faces, tets, boundary]);
        put(&mut message, &self.points.iter().map(|p| [p.x, p.y, p.z]).collect::<Vec<_>>());
        self.vertices.put(&mut message);
        self.edges.put(&mut message);
        self.faces.put(&mut message);
        put(&mut message, &self.tet_ids);
        put(&mut message, &self.tets.iter().map(|tet| tet.map(|v| v.0)).collect::<Vec<_>>());
        put(&mut message, &self.bodies.iter().map(|body| body.0).collect::<Vec<_>>());
        put(
            &mut message,
            &self.triangles.iter().map(|t| [t.face.0, t.patch.0, u32::from(t.odd)]).collect::<Vec<_>>(),
        );
        message
    }

    pub fn from_message(mut message: &[u8]) -> Self {
        let m = &mut message;
        let totals: Vec<u64> = take(m);
        let [vertices, edges, faces, tets, boundary] = totals[..] else {
            panic!("expected five totals, got {totals:?}")
        };
        Self {
            totals: Totals { vertices, edges, faces, tets, boundary },
            points: take::<[f64; 3]>(m).into_iter().map(Point::from).collect(),
            vertices: Entities::take(m),
            edges: Entities::take(m),
            faces: Entities::take(m),
            tet_ids: take(m),
            tets: take::<[u32; 4]>(m).into_iter().map(|tet| tet.map(VertexId)).collect(),
            bodies: take(m).into_iter().map(BodyId).collect(),
            triangles: take(m).into_iter().map(triangle).collect(),
        }
    }

    /// Assembles the part of `rank`.
    pub fn assemble(self, rank: Rank, ranks: u32) -> DistMesh {
        let edges = topology::edges(self.points.len(), &self.tets);
        let faces = topology::matched_faces(self.points.len(), &self.tets)
            .unwrap_or_else(|face| panic!("face {face:?} on rank {rank} has more than two tets"));
        self.assemble_from(edges, faces, rank, ranks)
    }

    /// Assembles the part if the edges and faces of the tets are enumerated already.
    pub fn assemble_from(self, edges: Edges, faces: MatchedFaces, rank: Rank, ranks: u32) -> DistMesh {
        let Edges { edges, tet_edges } = edges;
        let MatchedFaces { listed: Faces { faces, tet_faces }, tets: face_tets } = faces;
        assert_eq!(
            edges.len(),
            self.edges.ids.len(),
            "rank {rank}: edge ids received and edges of the tets differ in number"
        );
        assert_eq!(
            faces.len(),
            self.faces.ids.len(),
            "rank {rank}: face ids received and faces of the tets differ in number"
        );
        let mut part = DistMesh {
            edge_nodes: Vec::new(),
            rank,
            ranks,
            totals: self.totals,
            points: self.points,
            vertex_ids: self.vertices.ids,
            vertex_classes: self.vertices.classes,
            edges,
            edge_ids: self.edges.ids,
            edge_classes: self.edges.classes,
            faces,
            face_ids: self.faces.ids,
            face_classes: self.faces.classes,
            tets: self.tets,
            tet_ids: self.tet_ids,
            tet_bodies: self.bodies,
            tet_edges,
            tet_faces,
            boundary: Vec::new(),
            shared_vertices: self.vertices.shared,
            shared_edges: self.edges.shared,
            shared_faces: self.faces.shared,
        };
        part.boundary = boundary(&part, &face_tets, &self.triangles);
        part
    }
}

fn triangle([face, patch, odd]: [u32; 3]) -> Triangle {
    Triangle { face: FaceId(face), patch: PatchId(patch), odd: odd != 0 }
}

/// Finds the parents of the triangles. A tet is behind a triangle if its outward face has the
/// triangle's orientation.
fn boundary(part: &DistMesh, face_tets: &[[u32; 2]], triangles: &[Triangle]) -> Vec<BoundaryFace> {
    let find = |triangle: &Triangle| {
        let mut parents = [None; 2];
        let tets = face_tets[triangle.face.index()].into_iter().filter(|&tet| tet != u32::MAX);
        for tet in tets.map(TetId) {
            let place = part.tet_faces[tet.index()].iter().position(|&face| face == triangle.face);
            let seen = outward(&part.tets[tet.index()], place.expect("a tet beside a face has it"));
            parents[usize::from(is_odd(seen) != triangle.odd)] = Some(tet);
        }
        BoundaryFace { face: triangle.face, patch: triangle.patch, parents }
    };
    tabulate(triangles.len(), |index| find(&triangles[index]))
}
