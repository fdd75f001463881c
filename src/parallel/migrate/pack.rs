//! The message with the tets for one rank. It refers to vertices by their positions in its own
//! list.
//!
//! ```text
//!     counts | vertices: ids, classes, coordinates | tets: ids, bodies, corners, nodes | sides | edges
//! ```
//! Ids ascend and are sent as differences, one byte each for consecutive ids; bodies as runs;
//! corners in as many bytes as the number of vertices requires. A compact set of tets takes some 20
//! bytes per tet, of which coordinates are 5.

use super::MigrateError;
use super::rebuild::Room;
use crate::ground::comm::pack::{put_ascending, put_varint, take_ascending, take_varint};
use crate::ground::mesh::{Class, GlobalId, Rank, TET_EDGES, TetId, VertexId};
use crate::parallel::distribution::{BareMesh, ClassifiedEdge, Side};
use csg::{BodyId, PatchId};

/// Vertex flags: used by a tet that stays.
const STAYS: u8 = 1;
const LEAVES: u8 = 2;
/// End of an edge on a curve or patch that belongs to a leaving tet.
const AT_LEAVING_EDGE: u8 = 4;

/// The kind byte of messages with tets.
const TETS: u8 = 0;

/// The entities of a part that stay.
pub(super) struct Kept {
    /// For each tet, whether it stays.
    pub tets: Vec<bool>,
    /// For each vertex, whether a staying tet uses it.
    pub vertices: Vec<bool>,
    /// For each edge on a curve or patch, whether a staying tet uses it.
    pub edges: Vec<bool>,
    /// The sides of the staying tets, with tet ids of the old part.
    pub sides: Vec<Side>,
}

/// The messages with leaving tets, and the entities that stay.
pub(super) struct Leaving {
    /// One message for each rank that gets tets, by ascending rank.
    pub messages: Vec<(Rank, Vec<u8>)>,
    /// The vertices in each message, ascending.
    pub vertices: Vec<(Rank, Vec<u32>)>,
    pub kept: Kept,
    leaving_tets: u64,
}

impl Leaving {
    /// The number of leaving tets.
    pub fn tets(&self) -> u64 {
        self.leaving_tets
    }
}

/// Packs the leaving tets.
///
/// # Errors
/// [`MigrateError::OutOfMemory`] if a message does not fit.
pub(super) fn pack(mesh: &BareMesh, destination: &[Rank], room: Room) -> Result<Leaving, MigrateError> {
    let mut counts = vec![0usize; mesh.ranks as usize];
    destination.iter().for_each(|&to| counts[to as usize] += 1);
    let stays: Vec<bool> = destination.iter().map(|&to| to == mesh.rank).collect();
    counts[mesh.rank as usize] = 0;
    let mut tets_to: Vec<Vec<u32>> = counts.iter().map(|&count| Vec::with_capacity(count)).collect();
    let leave = (0..).zip(destination).filter(|(_, to)| **to != mesh.rank);
    leave.for_each(|(tet, &to)| tets_to[to as usize].push(tet));
    let mut sides_to = vec![Vec::new(); mesh.ranks as usize];
    mesh.sides.iter().for_each(|side| sides_to[destination[side.tet.index()] as usize].push(*side));

    let mut flags = vec![0u8; mesh.points.len()];
    let mut place = vec![u32::MAX; mesh.points.len()];
    let (mut messages, mut vertices) = (Vec::new(), Vec::new());
    let mut leaving_edges = Vec::new();
    let mut leaving_tets = 0;
    for to in (0..mesh.ranks).filter(|&to| counts[to as usize] > 0) {
        let tets = std::mem::take(&mut tets_to[to as usize]);
        leaving_tets += tets.len() as u64;
        let used = used_vertices(mesh, &tets, &mut place);
        let edges = classified_edges(mesh, &tets);
        let message = message(mesh, &tets, &used, &place, &sides_to[to as usize], &edges, room)?;
        for &v in &used {
            place[v as usize] = u32::MAX;
            flags[v as usize] |= LEAVES;
        }
        leaving_edges.extend(edges);
        messages.push((to, message));
        vertices.push((to, used));
    }
    leaving_edges.sort_unstable();
    leaving_edges.dedup();
    for &edge in &leaving_edges {
        mesh.edges[edge as usize].vertices.iter().for_each(|v| flags[v.index()] |= AT_LEAVING_EDGE);
    }
    let edges = kept_edges(mesh, &stays, &mut flags, &leaving_edges);
    let kept = Kept {
        tets: stays,
        vertices: flags.iter().map(|flags| flags & STAYS != 0).collect(),
        edges,
        sides: std::mem::take(&mut sides_to[mesh.rank as usize]),
    };
    Ok(Leaving { messages, vertices, kept, leaving_tets })
}

/// The vertices of the given tets, ascending; sets `place` to their positions in this list.
fn used_vertices(mesh: &BareMesh, tets: &[u32], place: &mut [u32]) -> Vec<u32> {
    let mut used = Vec::with_capacity(tets.len() / 2 + 4);
    for &tet in tets {
        for v in nodes_of(mesh, tet as usize) {
            if place[v.index()] == u32::MAX {
                place[v.index()] = 0;
                used.push(v.0);
            }
        }
    }
    used.sort_unstable();
    (0..).zip(&used).for_each(|(at, &v)| place[v as usize] = at);
    used
}

/// The corners of a tet, and the nodes on its edges if it is of second order.
fn nodes_of(mesh: &BareMesh, tet: usize) -> impl Iterator<Item = VertexId> + '_ {
    mesh.tets[tet].iter().chain(mesh.edge_nodes.get(tet).into_iter().flatten()).copied()
}

/// The edges of a tet (as ascending vertices) whose two ends both satisfy `may`.
fn edges_between(tet: &[VertexId; 4], may: impl Fn(VertexId) -> bool) -> impl Iterator<Item = [VertexId; 2]> {
    let may = tet.map(may);
    TET_EDGES.into_iter().filter(move |[i, j]| may[*i] && may[*j]).map(|[i, j]| {
        let (a, b) = (tet[i], tet[j]);
        [a.min(b), a.max(b)]
    })
}

fn find_edge(mesh: &BareMesh, ends: &[VertexId; 2]) -> Option<u32> {
    mesh.edges.binary_search_by(|edge| edge.vertices.cmp(ends)).ok().map(|index| index as u32)
}

/// The edges of the given tets that are on curves and patches, ascending.
fn classified_edges(mesh: &BareMesh, tets: &[u32]) -> Vec<u32> {
    let on_boundary = |v: VertexId| !matches!(mesh.vertex_classes[v.index()], Class::Body(_));
    let ends = tets.iter().flat_map(|&tet| edges_between(&mesh.tets[tet as usize], on_boundary));
    let mut edges: Vec<u32> = ends.filter_map(|ends| find_edge(mesh, &ends)).collect();
    edges.sort_unstable();
    edges.dedup();
    edges
}

/// Marks the vertices of staying tets, and returns for each edge on a curve or patch whether a
/// staying tet uses it. Only edges of leaving tets need a search.
fn kept_edges(mesh: &BareMesh, stays: &[bool], flags: &mut [u8], leaving: &[u32]) -> Vec<bool> {
    let mut kept = vec![true; mesh.edges.len()];
    leaving.iter().for_each(|&edge| kept[edge as usize] = false);
    for (index, (tet, _)) in mesh.tets.iter().zip(stays).enumerate().filter(|(_, (_, stays))| **stays) {
        let edge_nodes = mesh.edge_nodes.get(index).into_iter().flatten();
        edge_nodes.for_each(|node| flags[node.index()] |= STAYS);
        let mut at_leaving = 0;
        for v in tet {
            let flags = &mut flags[v.index()];
            *flags |= STAYS;
            at_leaving += *flags & AT_LEAVING_EDGE;
        }
        if at_leaving >= 2 * AT_LEAVING_EDGE {
            let may = |v: VertexId| flags[v.index()] & AT_LEAVING_EDGE != 0;
            for edge in edges_between(tet, may).filter_map(|ends| find_edge(mesh, &ends)) {
                kept[edge as usize] = true;
            }
        }
    }
    kept
}

/// A class as one number.
fn code(class: Class) -> u64 {
    let [kind, id] = class.code();
    u64::from(id) << 2 | u64::from(kind)
}

/// The inverse of [`code`].
fn class(code: u64) -> Class {
    Class::decode([(code & 3) as u32, (code >> 2) as u32])
}

/// The number of bytes of a position among `vertices`.
fn width(vertices: usize) -> usize {
    match vertices {
        0..=0x100 => 1,
        0x101..=0x1_0000 => 2,
        0x1_0001..=0x100_0000 => 3,
        _ => 4,
    }
}

/// The message with the given tets.
fn message(
    mesh: &BareMesh,
    tets: &[u32],
    vertices: &[u32],
    place: &[u32],
    sides: &[Side],
    edges: &[u32],
    room: Room,
) -> Result<Vec<u8>, MigrateError> {
    let width = width(vertices.len());
    let nodes = if mesh.edge_nodes.is_empty() { 4 } else { 10 };
    let mut m: Vec<u8> =
        room.make(64 + vertices.len() * 28 + tets.len() * (2 + nodes * width) + sides.len() * 6)?;
    m.push(TETS);
    for count in [vertices.len(), tets.len(), nodes, sides.len(), edges.len()] {
        put_varint(&mut m, count as u64);
    }
    put_ascending(&mut m, vertices.iter().map(|&v| mesh.vertex_ids[v as usize]));
    vertices.iter().for_each(|&v| put_varint(&mut m, code(mesh.vertex_classes[v as usize])));
    vertices.iter().for_each(|&v| m.extend_from_slice(bytemuck::bytes_of(&mesh.points[v as usize])));
    put_ascending(&mut m, tets.iter().map(|&t| mesh.tet_ids[t as usize]));
    let body = |t: &u32| mesh.tet_bodies[*t as usize];
    for run in tets.chunk_by(|a, b| body(a) == body(b)) {
        put_varint(&mut m, u64::from(body(&run[0]).0));
        put_varint(&mut m, run.len() as u64);
    }
    for &t in tets {
        for v in nodes_of(mesh, t as usize) {
            m.extend_from_slice(&place[v.index()].to_le_bytes()[..width]);
        }
    }
    let mut at = 0;
    let mut keys = Vec::with_capacity(sides.len());
    for side in sides {
        at += tets[at..].partition_point(|&t| t < side.tet.0);
        keys.push(((at as u64) << 2 | u64::from(side.face)) << 1 | u64::from(side.behind));
    }
    put_ascending(&mut m, keys);
    sides.iter().for_each(|side| put_varint(&mut m, u64::from(side.patch.0)));
    let edge = |&edge: &u32| mesh.edges[edge as usize];
    put_ascending(&mut m, edges.iter().map(|e| u64::from(place[edge(e).vertices[0].index()])));
    for ClassifiedEdge { vertices, class } in edges.iter().map(edge) {
        put_varint(&mut m, u64::from(place[vertices[1].index()]));
        put_varint(&mut m, code(class));
    }
    Ok(m)
}

/// A received message: a small mesh whose tets, sides and edges refer to its own lists.
#[derive(Debug, Default, PartialEq)]
pub(super) struct Message {
    pub vertex_ids: Vec<GlobalId>,
    pub vertex_classes: Vec<Class>,
    pub points: Vec<[f64; 3]>,
    pub tet_ids: Vec<GlobalId>,
    pub tet_bodies: Vec<BodyId>,
    pub tets: Vec<[u32; 4]>,
    /// Empty for first order.
    pub edge_nodes: Vec<[u32; 6]>,
    pub sides: Vec<Side>,
    pub edges: Vec<ClassifiedEdge>,
}

/// Reads a message.
pub(super) fn unpack(mut message: &[u8]) -> Message {
    let m = &mut message;
    let [vertices, tets, nodes, sides, edges] = [(); 5].map(|()| take_varint(m) as usize);
    let vertex_ids = take_ascending(m, vertices).collect();
    let vertex_classes = (0..vertices).map(|_| class(take_varint(m))).collect();
    let (coordinates, rest) = m.split_at(vertices * size_of::<[f64; 3]>());
    *m = rest;
    let tet_ids = take_ascending(m, tets).collect();
    let mut tet_bodies = Vec::with_capacity(tets);
    while tet_bodies.len() < tets {
        let body = BodyId(take_varint(m) as u32);
        let end = tet_bodies.len() + take_varint(m) as usize;
        tet_bodies.resize(end, body);
    }
    let width = width(vertices);
    let (places, rest) = m.split_at(nodes * width * tets);
    *m = rest;
    let place = |bytes: &[u8], k: usize| {
        let mut number = [0; 4];
        number[..width].copy_from_slice(&bytes[k * width..(k + 1) * width]);
        u32::from_le_bytes(number)
    };
    let keys: Vec<u64> = take_ascending(m, sides).collect();
    let sides = keys.into_iter().map(|key| Side {
        tet: TetId((key >> 3) as u32),
        face: (key >> 1 & 3) as u8,
        behind: key & 1 == 1,
        patch: PatchId(take_varint(m) as u32),
    });
    let sides = sides.collect();
    let first_ends: Vec<u64> = take_ascending(m, edges).collect();
    let edges = first_ends.into_iter().map(|first| ClassifiedEdge {
        vertices: [VertexId(first as u32), VertexId(take_varint(m) as u32)],
        class: class(take_varint(m)),
    });
    Message {
        vertex_ids,
        vertex_classes,
        points: crate::ground::comm::pack::numbers(coordinates),
        tet_ids,
        tet_bodies,
        tets: places.chunks_exact(nodes * width).map(|p| [0, 1, 2, 3].map(|k| place(p, k))).collect(),
        edge_nodes: (nodes == 10)
            .then(|| places.chunks_exact(nodes * width).map(|p| [4, 5, 6, 7, 8, 9].map(|k| place(p, k))))
            .into_iter()
            .flatten()
            .collect(),
        sides,
        edges: edges.collect(),
    }
}
