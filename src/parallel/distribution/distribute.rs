//! Distribution of a mesh on rank 0: one part to each rank.

use super::classify::{Classified, Triangle, classify};
use super::piece::{Entities, Piece};
use super::{DistMesh, Shared, Totals};
use crate::ground::comm::{CommError, Communicator};
use crate::ground::error::{ErrorKind, HasKind};
use crate::ground::mesh::topology::{self, Edges, Faces};
use crate::ground::mesh::{Class, EdgeId, FaceId, GlobalId, Mesh, Rank, VertexId};
use rayon::prelude::*;

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
    let listed = match mesh {
        Some((mesh, part)) if comm.rank() == 0 => {
            Listed::new(mesh, &part, comm.size()).map(|listed| Some((listed, part)))
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
    edges: Edges,
    faces: Faces,
    classified: Classified,
}

impl Listed {
    /// Enumerates and classifies the edges and faces; rejects a mesh that cannot be distributed.
    fn new(mesh: Mesh, part: &[Rank], ranks: u32) -> Result<Self, DistError> {
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
        let mut used = vec![false; mesh.points.len()];
        mesh.tets.iter().flatten().for_each(|v| used[v.index()] = true);
        if let Some(vertex) = used.iter().position(|used| !used) {
            return Err(DistError::UnusedVertex { vertex });
        }
        let edges = topology::edges(mesh.points.len(), &mesh.tets);
        let faces = topology::faces(mesh.points.len(), &mesh.tets);
        let classified = classify(&mesh, &edges, &faces)?;
        Ok(Self { mesh, edges, faces, classified })
    }

    fn totals(&self) -> Totals {
        Totals {
            vertices: self.mesh.points.len() as u64,
            edges: self.edges.edges.len() as u64,
            faces: self.faces.faces.len() as u64,
            tets: self.mesh.tets.len() as u64,
            boundary: self.classified.triangles.len() as u64,
        }
    }

    /// The whole mesh as the part of the only rank.
    fn into_only_part(self) -> DistMesh {
        let totals = self.totals();
        let Self { mesh, edges, faces, classified } = self;
        let entities = |classes: Vec<Class>| Entities {
            ids: (0..classes.len() as GlobalId).collect(),
            classes,
            shared: Shared::default(),
        };
        let piece = Piece {
            totals,
            points: mesh.points,
            vertices: entities(mesh.classes),
            edges: entities(classified.edge_classes),
            faces: entities(classified.face_classes),
            tet_ids: (0..mesh.tets.len() as GlobalId).collect(),
            tets: mesh.tets,
            bodies: mesh.bodies,
            triangles: classified.triangles,
        };
        piece.assemble_from(edges, faces, 0, 1)
    }
}

/// Lists of numbers in compressed row storage.
struct Rows {
    offsets: Vec<u32>,
    items: Vec<u32>,
}

impl Rows {
    /// Builds the rows from (row, item) pairs; items keep the order of `pairs`, which is called
    /// twice.
    fn collect(rows: usize, pairs: impl Fn(&mut dyn FnMut(u32, u32))) -> Self {
        let mut offsets = vec![0; rows + 1];
        pairs(&mut |row, _| offsets[row as usize + 1] += 1);
        for row in 0..rows {
            offsets[row + 1] += offsets[row];
        }
        let mut items = vec![0; offsets[rows] as usize];
        let mut ends = offsets.clone();
        pairs(&mut |row, item| {
            let end = &mut ends[row as usize];
            items[*end as usize] = item;
            *end += 1;
        });
        Self { offsets, items }
    }

    fn len(&self) -> usize {
        self.offsets.len() - 1
    }

    fn row(&self, row: usize) -> &[u32] {
        &self.items[self.offsets[row] as usize..self.offsets[row + 1] as usize]
    }

    /// The transpose: for each item the rows that contain it, ascending.
    fn transposed(&self, items: usize) -> Self {
        Self::collect(items, |pair| {
            for row in 0..self.len() {
                self.row(row).iter().for_each(|&item| pair(item, row as u32));
            }
        })
    }
}

/// The holders of each entity of one kind, and the entities of each rank, both ascending.
struct Residence {
    holders: Rows,
    by_rank: Rows,
}

/// Finds the holders of the entities that `of_tet` lists for each tet.
fn residence<const K: usize>(
    entities: usize,
    tets_by_rank: &Rows,
    of_tet: impl Fn(u32) -> [u32; K],
) -> Residence {
    let holders = Rows::collect(entities, |pair| {
        let mut last_holder = vec![Rank::MAX; entities];
        for rank in 0..tets_by_rank.len() {
            for &tet in tets_by_rank.row(rank) {
                for entity in of_tet(tet) {
                    if std::mem::replace(&mut last_holder[entity as usize], rank as Rank) != rank as Rank {
                        pair(entity, rank as Rank);
                    }
                }
            }
        }
    });
    let by_rank = holders.transposed(tets_by_rank.len());
    Residence { holders, by_rank }
}

impl Residence {
    /// The entities of `rank`.
    fn entities(&self, rank: Rank, classes: &[Class]) -> Entities {
        let ids = self.by_rank.row(rank as usize);
        let mut shared = Shared::default();
        for (local, &id) in (0..).zip(ids) {
            let holders = self.holders.row(id as usize);
            if holders.len() > 1 {
                shared.push(local, holders.iter().copied());
            }
        }
        Entities {
            ids: ids.iter().map(|&id| GlobalId::from(id)).collect(),
            classes: ids.iter().map(|&id| classes[id as usize]).collect(),
            shared,
        }
    }
}

/// The data from which rank 0 builds the message for each rank.
struct Plan {
    totals: Totals,
    mesh: Mesh,
    edge_classes: Vec<Class>,
    face_classes: Vec<Class>,
    triangles: Vec<Triangle>,
    /// Indices into `triangles`.
    triangles_by_rank: Rows,
    tets_by_rank: Rows,
    vertices: Residence,
    edges: Residence,
    faces: Residence,
}

impl Plan {
    /// Finds the holders of all entities.
    fn new(listed: Listed, part: &[Rank], ranks: u32) -> Self {
        let totals = listed.totals();
        let Listed { mesh, edges, faces, classified } = listed;
        let Classified { edge_classes, face_classes, triangles } = classified;
        let tets_by_rank =
            Rows::collect(ranks as usize, |pair| (0..).zip(part).for_each(|(tet, &r)| pair(r, tet)));
        let vertices = residence(mesh.points.len(), &tets_by_rank, |t| mesh.tets[t as usize].map(|v| v.0));
        let edge_ids = |t: u32| edges.tet_edges[t as usize].map(|EdgeId(id)| id);
        let face_ids = |t: u32| faces.tet_faces[t as usize].map(|FaceId(id)| id);
        let edges = residence(edge_classes.len(), &tets_by_rank, edge_ids);
        let faces = residence(face_classes.len(), &tets_by_rank, face_ids);
        let triangles_by_rank = Rows::collect(ranks as usize, |pair| {
            for (index, triangle) in (0..).zip(&triangles) {
                faces.holders.row(triangle.face.index()).iter().for_each(|&rank| pair(rank, index));
            }
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

    /// The message for `rank`. `local` is scratch: the local ids of this rank's vertices and faces,
    /// by global id.
    fn piece(&self, rank: Rank, local: &mut Vec<u32>) -> Piece {
        local.resize(self.mesh.points.len().max(self.face_classes.len()), 0);
        let vertices = self.vertices.by_rank.row(rank as usize);
        let tets = self.tets_by_rank.row(rank as usize);
        (0..).zip(vertices).for_each(|(index, &v)| local[v as usize] = index);
        let local_tets =
            tets.iter().map(|&t| self.mesh.tets[t as usize].map(|v| VertexId(local[v.index()]))).collect();
        (0..).zip(self.faces.by_rank.row(rank as usize)).for_each(|(index, &f)| local[f as usize] = index);
        let triangles = self.triangles_by_rank.row(rank as usize).iter().map(|&t| {
            let triangle = self.triangles[t as usize];
            Triangle { face: FaceId(local[triangle.face.index()]), ..triangle }
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
