//! Numbering of shared edges and faces: ids and holders, agreed on between the ranks.
//!
//! Two ranks may both have the two ends of an edge while only one of them has the edge (figure 4.8
//! of the thesis "A parallel mesh generator based on sequential NETGEN", which needs rounds of
//! repair for this case). So the holders of edges cannot be derived from those of vertices. Instead
//! each vertex has a **directory rank**, computed from its id alone, to which all holders send the
//! edges and faces that start there:
//!
//! ```text
//!     holders of X ── edges (X, Y), faces (X, Y, Z) ──► directory rank of X: sorts, drops repeats, numbers
//!     holders of X ◄── number and holders of each ───── directory rank of X
//! ```
//! This takes one exchange, one scan, and one exchange back. Numbers are positions in the
//! lexicographic order of all edges (faces) by ascending global vertices: the same as in
//! [`distribute`](super::distribute()), whatever the partition. For an unshared vertex only the
//! number of its edges and faces is sent, so messages are proportional to interfaces, not to parts.

use super::bare::{BareMesh, Side};
use super::{BoundaryFace, DistMesh, Shared, Totals};
use crate::Point;
use crate::ground::comm::pack::{put_ascending, put_varint, take_ascending, take_varint};
use crate::ground::comm::{CommError, Communicator};
use crate::ground::error::{ErrorKind, HasKind};
use crate::ground::kernel::buckets::tabulate;
use crate::ground::mesh::topology::{self, Edges, Faces};
use crate::ground::mesh::{Class, FaceId, GlobalId, Rank, VertexId};

/// Why the edges and faces of a part cannot be numbered.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum NumberError {
    /// Too many tets on a rank for 32-bit positions.
    #[error(
        "rank {rank} has {tets} tets, but a part can have {} at most: use more ranks",
        topology::MAX_TETS
    )]
    TooManyTets {
        /// The rank.
        rank: Rank,
        /// Its tets.
        tets: usize,
    },
    /// A face has more than two tets, so the mesh is not a manifold.
    #[error("not a manifold: face {vertices:?} has more than two tets")]
    FaceOfManyTets {
        /// The global ids of its vertices.
        vertices: [GlobalId; 3],
    },
    /// A face is shared by more than two ranks, so the mesh is not a manifold.
    #[error("not a manifold: face {vertices:?} is shared by {holders} ranks, at most 2 are possible")]
    FaceOfManyRanks {
        /// The global ids of its vertices.
        vertices: [GlobalId; 3],
        /// The number of ranks that have it.
        holders: usize,
    },
    /// Another rank met an error, or the ranks cannot communicate.
    #[error(transparent)]
    Comm(#[from] CommError),
}

impl HasKind for NumberError {
    fn kind(&self) -> ErrorKind {
        match self {
            Self::TooManyTets { .. } => ErrorKind::Resources,
            Self::FaceOfManyTets { .. } | Self::FaceOfManyRanks { .. } => ErrorKind::NoMesh,
            Self::Comm(error) => error.kind(),
        }
    }

    fn is_elsewhere(&self) -> bool {
        matches!(self, Self::Comm(error) if error.is_elsewhere())
    }
}

/// **Collective.** Constructs the edges and faces of each part, with their ids, classes and
/// holders.
///
/// # Errors
/// [`NumberError::TooManyTets`] if a rank has too many tets, [`NumberError::FaceOfManyRanks`] if
/// more than two ranks have the same face. All ranks return an error; the others one that names the
/// failed rank.
pub fn number_shared(comm: &dyn Communicator, bare: BareMesh) -> Result<DistMesh, NumberError> {
    let (rank, tets) = (bare.rank, bare.tets.len());
    let fits = tets <= topology::MAX_TETS;
    comm.agree(if fits { Ok(()) } else { Err(NumberError::TooManyTets { rank, tets }) })?;
    let (edges, edge_tets) = topology::edges_with_tets(bare.points.len(), &bare.tets);
    let faces = topology::faces(bare.points.len(), &bare.tets);

    let messages = request_messages(&bare, &edges.edges, &faces.faces, comm.size());
    let requests: Vec<(Rank, Vec<u8>)> = comm.exchange_bytes(messages)?;
    let numbered = comm.agree(number(&requests))?;
    let counts = [numbered.edges, numbered.faces];
    let before = comm.exclusive_scan(counts)?;
    let [all_edges, all_faces] = comm.all_reduce_sum_u64(counts)?;
    let replies = comm.exchange_bytes(numbered.replies(before))?;
    let [edge_numbers, face_numbers] = read_replies(&bare, &edges.edges, &faces.faces, comm.size(), &replies);

    let totals = Totals {
        vertices: bare.totals.vertices,
        edges: all_edges,
        faces: all_faces,
        tets: bare.totals.tets,
        boundary: bare.totals.boundary,
    };
    let body = |edge: usize| Class::Body(bare.tet_bodies[edge_tets[edge] as usize]);
    let edge_classes = tabulate(edge_tets.len(), body);
    drop(edge_tets);
    Ok(assemble(bare, totals, (edges, edge_numbers), edge_classes, (faces, face_numbers)))
}

/// Global ids of the entities of one kind, ascending, and the holders of the shared ones.
#[derive(Default)]
struct Numbers {
    ids: Vec<GlobalId>,
    shared: Shared,
}

/// The directory rank of a vertex: each rank is responsible for a block of ids, all nearly equal in
/// size.
pub(crate) fn directory_rank(id: GlobalId, vertices: u64, ranks: u32) -> Rank {
    (u128::from(id) * u128::from(ranks) / u128::from(vertices)) as Rank
}

/// The number of entities, sorted by their first vertex, that start at `vertex`.
fn beginning<const N: usize>(entities: &[[VertexId; N]], vertex: u32) -> usize {
    entities.iter().take_while(|entity| entity[0].0 == vertex).count()
}

/// The request messages, one per directory rank: for each vertex its id and the number of edges and
/// faces that start there, and for a shared vertex also their other vertices.
fn request_messages(
    bare: &BareMesh,
    mut edges: &[[VertexId; 2]],
    mut faces: &[[VertexId; 3]],
    ranks: u32,
) -> Vec<(Rank, Vec<u8>)> {
    let mut messages: Vec<(Rank, Vec<u8>)> = Vec::new();
    let mut previous = 0;
    let mut shared = bare.shared.ids.iter().peekable();
    let global = |v: VertexId| bare.vertex_ids[v.index()];
    for (v, &id) in (0..).zip(&bare.vertex_ids) {
        let to = directory_rank(id, bare.totals.vertices, ranks);
        if messages.last().is_none_or(|(rank, _)| *rank != to) {
            messages.push((to, Vec::new()));
            previous = 0;
        }
        let (_, message) = messages.last_mut().expect("a message was pushed above");
        let (edge_count, face_count) = (beginning(edges, v), beginning(faces, v));
        let (own_edges, own_faces);
        (own_edges, edges) = edges.split_at(edge_count);
        (own_faces, faces) = faces.split_at(face_count);
        let is_shared = shared.next_if_eq(&&v).is_some();
        put_varint(message, id - previous);
        previous = id;
        put_varint(message, (edge_count as u64) << 1 | u64::from(is_shared));
        put_varint(message, face_count as u64);
        if is_shared {
            put_ascending(message, own_edges.iter().map(|edge| global(edge[1])));
            put_ascending(message, own_faces.iter().map(|face| global(face[1])));
            own_faces.iter().for_each(|face| put_varint(message, global(face[2]) - global(face[1])));
        }
    }
    messages
}

/// One vertex of a request.
struct Record {
    vertex: GlobalId,
    sender: usize,
    shared: bool,
    edges: usize,
    faces: usize,
    /// The start of its edges and faces in the lists of all.
    first: [usize; 2],
}

/// The numbers that a directory rank assigned.
struct Numbered {
    /// The number of edges and faces that start at the vertices of this directory rank.
    edges: u64,
    faces: u64,
    /// For each sender the requested numbers, relative to the first of this directory rank.
    to: Vec<(Rank, Vec<u8>)>,
}

impl Numbered {
    /// The replies, each starting with the number of edges and faces of the lower directory ranks.
    fn replies(self, before: [u64; 2]) -> Vec<(Rank, Vec<u8>)> {
        let with_start = |(to, numbers): (Rank, Vec<u8>)| {
            let mut message = Vec::with_capacity(numbers.len() + 20);
            before.into_iter().for_each(|count| put_varint(&mut message, count));
            message.extend(numbers);
            (to, message)
        };
        self.to.into_iter().map(with_start).collect()
    }
}

/// Numbers the edges and faces in lexicographic order, and writes the reply to each sender in the
/// order of its request.
fn number(requests: &[(Rank, Vec<u8>)]) -> Result<Numbered, NumberError> {
    let (mut records, mut edges, mut faces) =
        (Vec::new(), Vec::<GlobalId>::new(), Vec::<[GlobalId; 2]>::new());
    for (sender, (_, request)) in requests.iter().enumerate() {
        let rest = &mut &request[..];
        let mut vertex = 0;
        while !rest.is_empty() {
            vertex += take_varint(rest);
            let (edge_count, face_count) = (take_varint(rest), take_varint(rest) as usize);
            let (edge_count, shared) = ((edge_count >> 1) as usize, edge_count & 1 == 1);
            let first = [edges.len(), faces.len()];
            records.push(Record { vertex, sender, shared, edges: edge_count, faces: face_count, first });
            if shared {
                edges.extend(take_ascending(rest, edge_count));
                faces.extend(take_ascending(rest, face_count).map(|y| [y, 0]));
                faces[first[1]..].iter_mut().for_each(|[y, z]| *z = *y + take_varint(rest));
            }
        }
    }
    // The sort is stable: the records of one vertex stay in rank order.
    records.sort_by_key(|record| record.vertex);
    let mut numbered =
        Numbered { edges: 0, faces: 0, to: requests.iter().map(|(from, _)| (*from, Vec::new())).collect() };
    let mut last_base = vec![[0; 2]; requests.len()];
    let (mut edges_here, mut faces_here) = (Vec::new(), Vec::new());
    for group in records.chunk_by(|a, b| a.vertex == b.vertex) {
        for record in group {
            let message = &mut numbered.to[record.sender].1;
            let base = [numbered.edges, numbered.faces];
            let last = std::mem::replace(&mut last_base[record.sender], base);
            put_varint(message, base[0] - last[0]);
            put_varint(message, base[1] - last[1]);
        }
        if !group[0].shared {
            numbered.edges += group[0].edges as u64;
            numbered.faces += group[0].faces as u64;
            continue;
        }
        edges_here.clear();
        faces_here.clear();
        for record in group {
            let [edge, face] = record.first;
            edges_here.extend(edges[edge..][..record.edges].iter().map(|y| (*y, record.sender)));
            faces_here.extend(faces[face..][..record.faces].iter().map(|yz| (*yz, record.sender)));
        }
        numbered.edges += append_replies(&mut edges_here, &mut numbered.to);
        numbered.faces += append_replies(&mut faces_here, &mut numbered.to);
        let non_manifold = faces_here.chunk_by(|a, b| a.0 == b.0).find(|run| run.len() > 2);
        if let Some(run) = non_manifold {
            let (vertices, holders) = ([group[0].vertex, run[0].0[0], run[0].0[1]], run.len());
            return Err(NumberError::FaceOfManyRanks { vertices, holders });
        }
    }
    Ok(numbered)
}

/// Sorts entities with their senders, and appends to each sender's reply their positions among the
/// distinct ones (as differences) and their holders if there are several. Returns the number of
/// distinct entities.
fn append_replies<K: Ord>(entities: &mut [(K, usize)], to: &mut [(Rank, Vec<u8>)]) -> u64 {
    entities.sort_unstable();
    let mut last_position = std::collections::BTreeMap::new();
    let mut count = 0;
    for (position, run) in (0u64..).zip(entities.chunk_by(|a, b| a.0 == b.0)) {
        for (_, sender) in run {
            let last = last_position.insert(*sender, position).unwrap_or(0);
            let ranks: Vec<u64> = match run.len() {
                1 => Vec::new(),
                _ => run.iter().map(|(_, holder)| u64::from(to[*holder].0)).collect(),
            };
            let message = &mut to[*sender].1;
            put_varint(message, position - last);
            put_varint(message, ranks.len() as u64);
            put_ascending(message, ranks);
        }
        count = position + 1;
    }
    count
}

/// Reads the replies, in the order of the requests.
fn read_replies(
    bare: &BareMesh,
    mut edges: &[[VertexId; 2]],
    mut faces: &[[VertexId; 3]],
    ranks: u32,
    replies: &[(Rank, Vec<u8>)],
) -> [Numbers; 2] {
    let mut numbers = [Numbers::default(), Numbers::default()];
    numbers[0].ids.reserve_exact(edges.len());
    numbers[1].ids.reserve_exact(faces.len());
    let mut replies = replies.iter();
    let (mut from, mut rest, mut bases): (Option<Rank>, &[u8], _) = (None, &[], [0; 2]);
    let mut shared = bare.shared.ids.iter().peekable();
    for (v, &id) in (0..).zip(&bare.vertex_ids) {
        let directory_rank = directory_rank(id, bare.totals.vertices, ranks);
        if from != Some(directory_rank) {
            let (rank, message) = replies.next().expect("each directory rank replies");
            assert_eq!(
                *rank, directory_rank,
                "rank {} got a reply about vertex {id} from rank {rank}",
                bare.rank
            );
            (from, rest) = (Some(directory_rank), message);
            bases = [take_varint(&mut rest), take_varint(&mut rest)];
        }
        let counts = [beginning(edges, v), beginning(faces, v)];
        edges = &edges[counts[0]..];
        faces = &faces[counts[1]..];
        bases = bases.map(|base| base + take_varint(&mut rest));
        let is_shared = shared.next_if_eq(&&v).is_some();
        for ((base, count), numbers) in bases.into_iter().zip(counts).zip(&mut numbers) {
            if is_shared {
                numbers.read(base, count, &mut rest);
            } else {
                numbers.ids.extend(base..base + count as u64);
            }
        }
    }
    numbers
}

impl Numbers {
    /// Reads the positions (relative to `base`) and the holders of the next `count` entities.
    fn read(&mut self, base: GlobalId, count: usize, message: &mut &[u8]) {
        let mut position = 0;
        for _ in 0..count {
            position += take_varint(message);
            let holders = take_varint(message) as usize;
            if holders > 0 {
                let local = self.ids.len() as u32;
                self.shared.push(local, take_ascending(message, holders).map(|rank| rank as Rank));
            }
            self.ids.push(base + position);
        }
    }
}

/// Assembles the part. `edge_classes` are the bodies of the edges.
fn assemble(
    bare: BareMesh,
    totals: Totals,
    (Edges { edges, tet_edges }, edge_numbers): (Edges, Numbers),
    mut edge_classes: Vec<Class>,
    (Faces { faces, tet_faces }, face_numbers): (Faces, Numbers),
) -> DistMesh {
    let mut face_classes = vec![Class::Body(csg::BodyId(0)); faces.len()];
    for (tet_faces, body) in tet_faces.iter().zip(&bare.tet_bodies) {
        tet_faces.iter().for_each(|face| face_classes[face.index()] = Class::Body(*body));
    }
    for classified in &bare.edges {
        let edge = edges.binary_search(&classified.vertices).unwrap_or_else(|_| {
            panic!("edge {:?} on rank {} is not an edge of a tet", classified.vertices, bare.rank)
        });
        edge_classes[edge] = classified.class;
    }
    let boundary = boundary(&bare.sides, &tet_faces);
    boundary.iter().for_each(|triangle| face_classes[triangle.face.index()] = Class::Patch(triangle.patch));
    DistMesh {
        rank: bare.rank,
        ranks: bare.ranks,
        totals,
        points: bare.points.into_iter().map(Point::from).collect(),
        vertex_ids: bare.vertex_ids,
        vertex_classes: bare.vertex_classes,
        edges,
        edge_ids: edge_numbers.ids,
        edge_classes,
        faces,
        face_ids: face_numbers.ids,
        face_classes,
        tets: bare.tets,
        edge_nodes: bare.edge_nodes,
        tet_ids: bare.tet_ids,
        tet_bodies: bare.tet_bodies,
        tet_edges,
        tet_faces,
        boundary,
        shared_vertices: bare.shared,
        shared_edges: edge_numbers.shared,
        shared_faces: face_numbers.shared,
    }
}

/// The boundary triangles by ascending face, from the sides of tets.
fn boundary(sides: &[Side], tet_faces: &[[FaceId; 4]]) -> Vec<BoundaryFace> {
    let face = |side: &Side| tet_faces[side.tet.index()][usize::from(side.face)];
    let mut by_face: Vec<(FaceId, Side)> = sides.iter().map(|side| (face(side), *side)).collect();
    by_face.sort_unstable();
    let triangle = |of_face: &[(FaceId, Side)]| {
        let mut parents = [None; 2];
        of_face.iter().for_each(|(_, side)| parents[usize::from(!side.behind)] = Some(side.tet));
        BoundaryFace { face: of_face[0].0, patch: of_face[0].1.patch, parents }
    };
    by_face.chunk_by(|a, b| a.0 == b.0).map(triangle).collect()
}

#[cfg(test)]
#[path = "number_tests.rs"]
mod tests;
