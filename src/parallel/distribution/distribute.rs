//! Distribution of a mesh on rank 0: one part to each rank.

use super::classify::{Classified, Tables, Triangle, classify};
use super::piece::{Entities, Piece};
use super::residence::Residence;
use super::{DistMesh, Shared, Totals};
use crate::ground::comm::{CommError, Communicator};
use crate::ground::error::{ErrorKind, HasKind};
use crate::ground::kernel::buckets::{Buckets, map_each, ranges, tabulate};
use crate::ground::mesh::topology::{self, MatchedFaces};
use crate::ground::mesh::{Class, EdgeId, FaceId, GlobalId, Mesh, Rank, VertexId};
use rayon::prelude::*;
use std::sync::atomic::AtomicBool;
use std::sync::atomic::Ordering::Relaxed;

/// Why a mesh cannot be distributed.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum DistError {
    /// Rank 0 passed no mesh.
    #[error("rank 0 gave no mesh to distribute")]
    NoMesh,
    /// The partition does not have one entry per tet.
    #[error("the partition has {parts} entries for {tets} tets")]
    PartsMismatch {
        /// The number of tets of the mesh.
        tets: usize,
        /// The number of entries of the partition.
        parts: usize,
    },
    /// The partition assigns a tet to a rank that does not exist.
    #[error("tet {tet} is assigned to rank {part}, but there are {ranks} ranks")]
    NoSuchRank {
        /// The tet.
        tet: usize,
        /// The tet.
        part: Rank,
        /// The number of ranks.
        ranks: u32,
    },
    /// Too many tets for 32-bit positions.
    #[error("the mesh has {tets} tets, but {} at most can be distributed", topology::MAX_TETS)]
    TooManyTets {
        /// The number of tets of the mesh.
        tets: usize,
    },
    /// A vertex is unused, so no rank would get it.
    #[error("vertex {vertex} belongs to no tet")]
    UnusedVertex {
        /// The vertex.
        vertex: usize,
    },
    /// A face has more than two tets, so the mesh is not a manifold.
    #[error("not a manifold: face {vertices:?} belongs to more than two tets")]
    FaceOfThreeTets {
        /// Its vertices.
        vertices: [u32; 3],
    },
    /// A face between two regions is on no patch: the boundary has a hole.
    #[error("face {vertices:?} is between two regions, but on no patch")]
    FaceOnNoPatch {
        /// Its vertices.
        vertices: [u32; 3],
    },
    /// A boundary triangle is not a face of a tet.
    #[error("boundary triangle {triangle} with vertices {vertices:?} is not a face of a tet")]
    TriangleNotAFace {
        /// Its index.
        triangle: usize,
        /// Its vertices.
        vertices: [u32; 3],
    },
    /// A boundary triangle repeats another.
    #[error("boundary triangle {triangle} with vertices {vertices:?} occurs twice")]
    TriangleTwice {
        /// Its index.
        triangle: usize,
        /// Its vertices.
        vertices: [u32; 3],
    },
    /// A segment is not an edge of a tet.
    #[error("segment {segment} with vertices {vertices:?} is not an edge of a tet")]
    SegmentNotAnEdge {
        /// Its index.
        segment: usize,
        /// Its vertices.
        vertices: [u32; 2],
    },
    /// A segment repeats another.
    #[error("segment {segment} with vertices {vertices:?} occurs twice")]
    SegmentTwice {
        /// Its index.
        segment: usize,
        /// Its vertices.
        vertices: [u32; 2],
    },
    /// An edge between two patches is on no curve.
    #[error("edge {vertices:?} is on two patches, but on no curve")]
    EdgeOnTwoPatches {
        /// Its vertices.
        vertices: [u32; 2],
    },
    /// Another rank met an error, or the ranks cannot communicate.
    #[error(transparent)]
    Comm(#[from] CommError),
}

impl HasKind for DistError {
    fn kind(&self) -> ErrorKind {
        match self {
            Self::TooManyTets { .. } => ErrorKind::Resources,
            Self::Comm(error) => error.kind(),
            _ => ErrorKind::NoMesh,
        }
    }

    fn is_elsewhere(&self) -> bool {
        matches!(self, Self::Comm(error) if error.is_elsewhere())
    }
}

/// **Collective.** Sends each rank the tets that `part` assigns to it. Rank 0 passes the mesh and
/// the rank of each tet; the argument is ignored on other ranks.
///
/// Global ids of vertices and tets are their positions in `mesh`; those of edges and faces their
/// positions in the lexicographic order by global vertices. A rank may get no tets.
///
/// # Errors
/// [`DistError`] if the mesh is not a manifold or not fully classified, or if the partition does
/// not fit it. All ranks return an error; the others one that names rank 0.
pub fn distribute(comm: &dyn Communicator, mesh: Option<(Mesh, Vec<Rank>)>) -> Result<DistMesh, DistError> {
    distribute_listed(comm, mesh.map(|(mesh, part)| (mesh, part, None)))
}

/// **Collective.** [`distribute()`] of a mesh whose faces are listed already.
///
/// # Errors
/// As [`distribute()`].
pub fn distribute_matched(
    comm: &dyn Communicator,
    mesh: Option<(Mesh, Vec<Rank>, MatchedFaces)>,
) -> Result<DistMesh, DistError> {
    distribute_listed(comm, mesh.map(|(mesh, part, faces)| (mesh, part, Some(faces))))
}

fn distribute_listed(
    comm: &dyn Communicator,
    mesh: Option<(Mesh, Vec<Rank>, Option<MatchedFaces>)>,
) -> Result<DistMesh, DistError> {
    let listed = match mesh {
        Some((mesh, part, faces)) if comm.rank() == 0 => {
            Listed::new(mesh, &part, comm.size(), faces).map(|listed| Some((listed, part)))
        }
        None if comm.rank() == 0 => Err(DistError::NoMesh),
        _ => Ok(None),
    };
    let listed = match (comm.agree(listed)?, comm.size()) {
        (Some((listed, _)), 1) => return Ok(listed.into_only_part()),
        (listed, _) => listed,
    };
    let plan = listed.map(|(listed, part)| Plan::new(listed, &part, comm.size()));
    let messages = plan.map(|plan| {
        let message = |scratch: &mut Vec<u32>, rank| plan.piece(rank, scratch).to_message();
        (0..comm.size()).into_par_iter().map_init(Vec::new, message).collect()
    });
    let piece = Piece::from_message(&comm.scatter_bytes(0, messages)?);
    Ok(piece.assemble(comm.rank(), comm.size()))
}

/// *Local.* Makes the whole mesh the only part of a single rank.
///
/// # Errors
/// As [`distribute`].
pub fn from_serial(mesh: Mesh) -> Result<DistMesh, DistError> {
    let part = vec![0; mesh.tets.len()];
    distribute(&crate::ground::comm::thread::alone(), Some((mesh, part)))
}

/// A mesh with its edges and faces, and their classification.
struct Listed {
    mesh: Mesh,
    tables: Tables,
    classified: Classified,
}

impl Listed {
    /// Enumerates and classifies the edges and faces (unless they are given); rejects a mesh that
    /// cannot be distributed.
    fn new(mesh: Mesh, part: &[Rank], ranks: u32, faces: Option<MatchedFaces>) -> Result<Self, DistError> {
        let tets = mesh.tets.len();
        if part.len() != tets {
            return Err(DistError::PartsMismatch { tets, parts: part.len() });
        }
        if tets > topology::MAX_TETS {
            return Err(DistError::TooManyTets { tets });
        }
        if let Some(tet) = part.iter().position(|&rank| rank >= ranks) {
            return Err(DistError::NoSuchRank { tet, part: part[tet], ranks });
        }
        if let Some(vertex) = unused_vertex(&mesh) {
            return Err(DistError::UnusedVertex { vertex });
        }
        let faces = match faces {
            Some(faces) => faces,
            None => topology::matched_faces(mesh.points.len(), &mesh.tets)
                .map_err(|vertices| DistError::FaceOfThreeTets { vertices: vertices.map(|v| v.0) })?,
        };
        let (edges, edge_tets) = topology::edges_with_tets(mesh.points.len(), &mesh.tets);
        let mut tables = Tables { edges, edge_tets, faces };
        let classified = classify(&mesh, &tables)?;
        tables.edge_tets = Vec::new();
        Ok(Self { mesh, tables, classified })
    }

    fn totals(&self) -> Totals {
        Totals {
            vertices: self.mesh.points.len() as u64,
            edges: self.classified.edge_classes.len() as u64,
            faces: self.classified.face_classes.len() as u64,
            tets: self.mesh.tets.len() as u64,
            boundary: self.classified.triangles.len() as u64,
        }
    }

    /// The whole mesh as the part of the only rank.
    fn into_only_part(self) -> DistMesh {
        let totals = self.totals();
        let Self { mesh, tables, classified } = self;
        let ids = |count: usize| tabulate(count, |id| id as GlobalId);
        let entities =
            |classes: Vec<Class>| Entities { ids: ids(classes.len()), classes, shared: Shared::default() };
        let piece = Piece {
            totals,
            points: mesh.points,
            vertices: entities(mesh.classes),
            edges: entities(classified.edge_classes),
            faces: entities(classified.face_classes),
            tet_ids: ids(mesh.tets.len()),
            tets: mesh.tets,
            bodies: mesh.bodies,
            triangles: classified.triangles,
        };
        piece.assemble_from(tables.edges, tables.faces, 0, 1)
    }
}

/// The first vertex that belongs to no tet.
fn unused_vertex(mesh: &Mesh) -> Option<usize> {
    let used = tabulate(mesh.points.len(), |_| AtomicBool::new(false));
    map_each(ranges(mesh.tets.len()), |range| {
        for vertex in mesh.tets[range].iter().flatten().map(|v| &used[v.index()]) {
            // Nearly all are set already; threads share what none of them writes.
            if !vertex.load(Relaxed) {
                vertex.store(true, Relaxed);
            }
        }
    });
    used.iter().position(|used| !used.load(Relaxed))
}

/// The data from which rank 0 builds the message for each rank.
struct Plan {
    totals: Totals,
    mesh: Mesh,
    edge_classes: Vec<Class>,
    face_classes: Vec<Class>,
    triangles: Vec<Triangle>,
    /// Indices into `triangles`.
    triangles_by_rank: Buckets,
    tets_by_rank: Buckets,
    vertices: Residence,
    edges: Residence,
    faces: Residence,
}

impl Plan {
    /// Finds the holders of all entities.
    fn new(listed: Listed, part: &[Rank], ranks: u32) -> Self {
        let totals = listed.totals();
        let Listed { mesh, tables, classified } = listed;
        let Classified { edge_classes, face_classes, triangles } = classified;
        // The ranks list edges and faces again: free all that is not needed here.
        let (tet_edges, tet_faces) = tables.into_tets();
        let tets = ranges(mesh.tets.len());
        let tets_by_rank = Buckets::collect(&tets, ranks as usize, |range| {
            range.map(|tet| (part[tet] as usize, tet as u32))
        });
        let vertex_ids = |tet: usize| mesh.tets[tet].map(|v| v.0);
        let edge_ids = |tet: usize| tet_edges[tet].map(|EdgeId(id)| id);
        let face_ids = |tet: usize| tet_faces[tet].map(|FaceId(id)| id);
        let vertices = Residence::new(mesh.points.len(), part, ranks, vertex_ids);
        let edges = Residence::new(edge_classes.len(), part, ranks, edge_ids);
        let faces = Residence::new(face_classes.len(), part, ranks, face_ids);
        let triangles_by_rank = Buckets::collect(&ranges(triangles.len()), ranks as usize, |range| {
            let holders = |index: usize| faces.holders(triangles[index].face.0);
            range.flat_map(move |index| holders(index).iter().map(move |&rank| (rank as usize, index as u32)))
        });
        Self {
            totals,
            mesh,
            edge_classes,
            face_classes,
            triangles,
            triangles_by_rank,
            tets_by_rank,
            vertices,
            edges,
            faces,
        }
    }

    /// The message for `rank`. `local` is scratch: the local ids of this rank's vertices, by global
    /// id.
    fn piece(&self, rank: Rank, local: &mut Vec<u32>) -> Piece {
        local.resize(self.mesh.points.len(), 0);
        let vertices = self.vertices.of_rank(rank);
        let tets = self.tets_by_rank.of(rank as usize);
        (0..).zip(vertices).for_each(|(index, &v)| local[v as usize] = index);
        let local_tets =
            tets.iter().map(|&t| self.mesh.tets[t as usize].map(|v| VertexId(local[v.index()]))).collect();
        let faces = self.faces.of_rank(rank);
        let triangles = self.triangles_by_rank.of(rank as usize).iter().map(|&t| {
            let triangle = self.triangles[t as usize];
            let face = faces.binary_search(&triangle.face.0).expect("the rank has the face");
            Triangle { face: FaceId::new(face), ..triangle }
        });
        Piece {
            totals: self.totals,
            points: vertices.iter().map(|&v| self.mesh.points[v as usize]).collect(),
            vertices: self.vertices.entities(rank, &self.mesh.classes),
            edges: self.edges.entities(rank, &self.edge_classes),
            faces: self.faces.entities(rank, &self.face_classes),
            tet_ids: tets.iter().map(|&t| GlobalId::from(t)).collect(),
            tets: local_tets,
            bodies: tets.iter().map(|&t| self.mesh.bodies[t as usize]).collect(),
            triangles: triangles.collect(),
        }
    }
}

#[cfg(test)]
#[path = "distribute_tests.rs"]
mod tests;
