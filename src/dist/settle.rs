//! Ids and holders of edges and faces, settled between the ranks.
//!
//! Two ranks may both hold the ends of an edge, and only one of them the edge (figure 4.8 of the thesis "A parallel mesh generator
//! based on sequential NETGEN", where it takes rounds of repair). So holders of edges cannot be told from those of vertices. Instead each vertex has
//! a **home**, a rank told from its id alone, to which all that hold it say which edges and faces begin there:
//!
//! ```text
//!   holders of X ── edges (X, Y), faces (X, Y, Z) ──► home of X: sorts, drops repeats, numbers
//!   holders of X ◄── number and holders of each ───── home of X
//! ```
//! One exchange, one scan, one answer. Numbers are places in the lexicographic order of all edges (faces) by ascending global
//! vertices: those that [`distribute`](super::distribute()) gives, whatever the partition. Of a vertex that is not shared the home only hears how
//! many edges and faces begin there, so that messages are as large as interfaces, not as parts.

use super::bare::{BareMesh, Side};
use super::{BoundaryFace, DistMesh, Shared, Totals};
use crate::Point;
use crate::comm::pack::{put_ascending, put_varint, take_ascending, take_varint};
use crate::comm::{Agreed, CommError, Communicator};
use crate::mesh::topology::{self, Edges, Faces};
use crate::mesh::{Class, EdgeId, FaceId, GlobalId, Rank, VertexId};

/// Why the edges and faces of a part cannot be listed.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum SettleError {
    /// More tets than can be numbered.
    #[error(
        "{tets} tets on rank {rank} are more than {}, the most whose edges can be listed",
        topology::MAX_TETS
    )]
    TooManyTets {
        /// The rank.
        rank: Rank,
        /// Its tets.
        tets: usize,
    },
    /// The mesh is no mesh.
    #[error("face {vertices:?} is held by {holders} ranks")]
    FaceOfManyRanks {
        /// The global ids of its vertices.
        vertices: [GlobalId; 3],
        /// How many ranks hold it.
        holders: usize,
    },
    /// Another rank met an error.
    #[error("rank {rank}: {message}")]
    Elsewhere {
        /// Which.
        rank: Rank,
        /// What it says.
        message: String,
    },
    /// The ranks cannot talk.
    #[error(transparent)]
    Comm(#[from] CommError),
}

impl From<Agreed<Self>> for SettleError {
    fn from(agreed: Agreed<Self>) -> Self {
        agreed.into_error(|rank, message| Self::Elsewhere { rank, message })
    }
}

/// **Collective.** Finds the edges and faces of each part, their ids, classes and holders.
///
/// # Errors
/// Too many tets on a rank; a face that more than two ranks hold. The same rank's on all.
pub fn settle(comm: &dyn Communicator, bare: BareMesh) -> Result<DistMesh, SettleError> {
    let (rank, tets) = (bare.rank, bare.tets.len());
    let fits = tets <= topology::MAX_TETS;
    comm.agree(if fits { Ok(()) } else { Err(SettleError::TooManyTets { rank, tets }) })?;
    let edges = topology::edges(bare.points.len(), &bare.tets);
    let faces = topology::faces(bare.points.len(), &bare.tets);

    let questions = ask(&bare, &edges.edges, &faces.faces, comm.size());
    let asked: Vec<(Rank, Vec<u8>)> = comm.exchange_bytes(questions)?;
    let numbered = comm.agree(number(&asked))?;
    let counts = [numbered.edges, numbered.faces];
    let before = comm.exclusive_scan(counts)?;
    let [all_edges, all_faces] = comm.all_reduce_sum_u64(counts)?;
    let told = comm.exchange_bytes(numbered.answers(before))?;
    let [edge_numbers, face_numbers] = hear(&bare, &edges.edges, &faces.faces, comm.size(), &told);

    let totals = Totals {
        vertices: bare.totals.vertices,
        edges: all_edges,
        faces: all_faces,
        tets: bare.totals.tets,
        boundary: bare.totals.boundary,
    };
    Ok(assemble(bare, totals, (edges, edge_numbers), (faces, face_numbers)))
}

/// Ids of entities of one kind, ascending, and the holders of the shared ones.
#[derive(Default)]
struct Numbers {
    ids: Vec<GlobalId>,
    shared: Shared,
}

/// The home of a vertex: ranks have blocks of ids, as equal as can be.
fn home(id: GlobalId, vertices: u64, ranks: u32) -> Rank {
    (u128::from(id) * u128::from(ranks) / u128::from(vertices)) as Rank
}

/// How many of the entities, sorted by their first vertex, begin at `vertex`.
fn beginning<const N: usize>(entities: &[[VertexId; N]], vertex: u32) -> usize {
    entities.iter().take_while(|entity| entity[0].0 == vertex).count()
}

/// For each vertex in turn, by home: its id, how many edges and faces begin there; and if it is shared, their other vertices.
fn ask(
    bare: &BareMesh,
    mut edges: &[[VertexId; 2]],
    mut faces: &[[VertexId; 3]],
    ranks: u32,
) -> Vec<(Rank, Vec<u8>)> {
    let mut questions: Vec<(Rank, Vec<u8>)> = Vec::new();
    let mut previous = 0;
    let mut shared = bare.shared.ids.iter().peekable();
    let global = |v: VertexId| bare.vertex_ids[v.index()];
    for (v, &id) in (0..).zip(&bare.vertex_ids) {
        let to = home(id, bare.totals.vertices, ranks);
        if questions.last().is_none_or(|(rank, _)| *rank != to) {
            questions.push((to, Vec::new()));
            previous = 0;
        }
        let (_, message) = questions.last_mut().expect("there is one now");
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
    questions
}

/// One vertex in one question: the place of its sender among the senders, and what begins there.
struct Record {
    vertex: GlobalId,
    sender: usize,
    shared: bool,
    edges: usize,
    faces: usize,
    /// Where its edges and faces begin in the lists of all.
    first: [usize; 2],
}

/// What a home has made of the questions.
struct Numbered {
    /// How many edges and faces begin at the vertices that are at home here.
    edges: u64,
    faces: u64,
    /// For each sender the numbers it asked for, those of this home beginning at 0.
    to: Vec<(Rank, Vec<u8>)>,
}

impl Numbered {
    /// The answers, with how many edges and faces there are before those of this home.
    fn answers(self, before: [u64; 2]) -> Vec<(Rank, Vec<u8>)> {
        let with_start = |(to, numbers): (Rank, Vec<u8>)| {
            let mut message = Vec::with_capacity(numbers.len() + 20);
            before.into_iter().for_each(|count| put_varint(&mut message, count));
            message.extend(numbers);
            (to, message)
        };
        self.to.into_iter().map(with_start).collect()
    }
}

/// Numbers the edges and faces in the order of their vertices, and writes for each sender the numbers in the order of its question.
fn number(asked: &[(Rank, Vec<u8>)]) -> Result<Numbered, SettleError> {
    let (mut records, mut edges, mut faces) =
        (Vec::new(), Vec::<GlobalId>::new(), Vec::<[GlobalId; 2]>::new());
    for (sender, (_, question)) in asked.iter().enumerate() {
        let rest = &mut &question[..];
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
    // Stable: the records of one vertex stay in the order of ranks.
    records.sort_by_key(|record| record.vertex);
    let mut numbered =
        Numbered { edges: 0, faces: 0, to: asked.iter().map(|(from, _)| (*from, Vec::new())).collect() };
    let mut last_base = vec![[0; 2]; asked.len()];
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
        numbered.edges += answer(&mut edges_here, &mut numbered.to);
        numbered.faces += answer(&mut faces_here, &mut numbered.to);
        let crowded = faces_here.chunk_by(|a, b| a.0 == b.0).find(|run| run.len() > 2);
        if let Some(run) = crowded {
            let (vertices, holders) = ([group[0].vertex, run[0].0[0], run[0].0[1]], run.len());
            return Err(SettleError::FaceOfManyRanks { vertices, holders });
        }
    }
    Ok(numbered)
}

/// Sorts entities with their senders, and tells each sender their places among the distinct ones (the difference to its last) and
/// their holders if there are several. Returns how many there are.
fn answer<K: Ord>(entities: &mut [(K, usize)], to: &mut [(Rank, Vec<u8>)]) -> u64 {
    entities.sort_unstable();
    let mut last_place = std::collections::BTreeMap::new();
    let mut count = 0;
    for (place, run) in (0u64..).zip(entities.chunk_by(|a, b| a.0 == b.0)) {
        for (_, sender) in run {
            let last = last_place.insert(*sender, place).unwrap_or(0);
            let ranks: Vec<u64> = match run.len() {
                1 => Vec::new(),
                _ => run.iter().map(|(_, holder)| u64::from(to[*holder].0)).collect(),
            };
            let message = &mut to[*sender].1;
            put_varint(message, place - last);
            put_varint(message, ranks.len() as u64);
            put_ascending(message, ranks);
        }
        count = place + 1;
    }
    count
}

/// Reads the answers in the order of the questions.
fn hear(
    bare: &BareMesh,
    mut edges: &[[VertexId; 2]],
    mut faces: &[[VertexId; 3]],
    ranks: u32,
    told: &[(Rank, Vec<u8>)],
) -> [Numbers; 2] {
    let mut numbers = [Numbers::default(), Numbers::default()];
    numbers[0].ids.reserve_exact(edges.len());
    numbers[1].ids.reserve_exact(faces.len());
    let mut told = told.iter();
    let (mut from, mut rest, mut bases): (Option<Rank>, &[u8], _) = (None, &[], [0; 2]);
    let mut shared = bare.shared.ids.iter().peekable();
    for (v, &id) in (0..).zip(&bare.vertex_ids) {
        let home = home(id, bare.totals.vertices, ranks);
        if from != Some(home) {
            let (rank, message) = told.next().expect("each home answers");
            assert_eq!(*rank, home, "rank {} hears of vertex {id} from rank {rank}", bare.rank);
            (from, rest) = (Some(home), message);
            bases = [take_varint(&mut rest), take_varint(&mut rest)];
        }
        let counts = [beginning(edges, v), beginning(faces, v)];
        edges = &edges[counts[0]..];
        faces = &faces[counts[1]..];
        bases = bases.map(|base| base + take_varint(&mut rest));
        let is_shared = shared.next_if_eq(&&v).is_some();
        for ((base, count), numbers) in bases.into_iter().zip(counts).zip(&mut numbers) {
            if is_shared {
                numbers.hear(base, count, &mut rest);
            } else {
                numbers.ids.extend(base..base + count as u64);
            }
        }
    }
    numbers
}

impl Numbers {
    /// Reads the places, after `base`, and the holders of the next `count` entities.
    fn hear(&mut self, base: GlobalId, count: usize, message: &mut &[u8]) {
        let mut place = 0;
        for _ in 0..count {
            place += take_varint(message);
            let holders = take_varint(message) as usize;
            if holders > 0 {
                let local = self.ids.len() as u32;
                self.shared.push(local, take_ascending(message, holders).map(|rank| rank as Rank));
            }
            self.ids.push(base + place);
        }
    }
}

/// Puts the part together.
fn assemble(
    bare: BareMesh,
    totals: Totals,
    (Edges { edges, tet_edges }, edge_numbers): (Edges, Numbers),
    (Faces { faces, tet_faces }, face_numbers): (Faces, Numbers),
) -> DistMesh {
    let mut edge_classes = vec![Class::Body(csg::BodyId(0)); edges.len()];
    let mut face_classes = vec![Class::Body(csg::BodyId(0)); faces.len()];
    for ((tet_edges, tet_faces), body) in tet_edges.iter().zip(&tet_faces).zip(&bare.tet_bodies) {
        tet_edges.iter().for_each(|edge: &EdgeId| edge_classes[edge.index()] = Class::Body(*body));
        tet_faces.iter().for_each(|face: &FaceId| face_classes[face.index()] = Class::Body(*body));
    }
    for laid in &bare.edges {
        let edge = edges
            .binary_search(&laid.vertices)
            .unwrap_or_else(|_| panic!("edge {:?} on rank {} belongs to no tet", laid.vertices, bare.rank));
        edge_classes[edge] = laid.class;
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

/// The boundary triangles by face, from the sides of tets.
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
#[path = "settle_tests.rs"]
mod tests;
