//! The message with the tets that become ghosts on another rank.

use super::interface::Interface;
use super::leaving::Tet;
use crate::ground::comm::pack::{put, take};
use crate::ground::mesh::ghosts::{GhostTet, GhostVertex};
use crate::ground::mesh::stream::vertex_block_of;
use crate::ground::mesh::{GlobalId, Rank};
use csg::BodyId;
use std::collections::BTreeMap;

/// A ghost tet whose nodes are given by global ids.
pub(super) struct Named {
    pub tet: GhostTet,
    pub vertices: [GlobalId; 4],
    pub edge_nodes: Option<[GlobalId; 6]>,
}

/// The content of a message.
pub(super) struct Message {
    /// Vertices that the receiver does not have, with their holders.
    pub vertices: Vec<(GhostVertex, Vec<Rank>)>,
    pub tets: Vec<Named>,
}

/// The vertices of the tets that rank `to` does not have: local indices, ascending.
pub(super) fn unknown(interface: &Interface, to: Rank, tets: &[Tet]) -> Vec<u32> {
    let is_unknown = |vertex: &u32| interface.holders(*vertex).binary_search(&to).is_err();
    let mut vertices: Vec<u32> = tets.iter().flat_map(Tet::nodes).filter(is_unknown).collect();
    vertices.sort_unstable();
    vertices.dedup();
    vertices
}

/// The message with the given tets and the given vertices of them (local indices, ascending).
pub(super) fn write(
    interface: &Interface,
    origins: &BTreeMap<u32, GlobalId>,
    vertices: &[u32],
    tets: &[Tet],
) -> Vec<u8> {
    let part = interface.part;
    let id = |&vertex: &u32| part.vertex_id(vertex);
    let ids: Vec<GlobalId> = vertices.iter().map(id).collect();
    let origin = |vertex: &u32| origins.get(vertex).copied().unwrap_or_else(|| id(vertex));
    let holders = vertices.iter().map(|&vertex| interface.holders(vertex));
    let (points, on_boundary) = places(interface, vertices);
    let mut message = Vec::new();
    put(&mut message, &ids);
    put(&mut message, &points);
    put(&mut message, &on_boundary);
    put(&mut message, &vertices.iter().map(origin).collect::<Vec<GlobalId>>());
    put(&mut message, &holders.clone().map(|holders| holders.len() as u32).collect::<Vec<u32>>());
    put(&mut message, &holders.flatten().copied().collect::<Vec<Rank>>());
    put(&mut message, &tets.iter().map(|tet| [tet.id, tet.index]).collect::<Vec<[u64; 2]>>());
    put(&mut message, &tets.iter().map(|tet| tet.body.0).collect::<Vec<u32>>());
    let named = tets.iter().map(|tet| tet.vertices.map(|vertex| id(&vertex)));
    put(&mut message, &named.collect::<Vec<[GlobalId; 4]>>());
    let edges = tets.iter().filter_map(|tet| Some(tet.edge_nodes?.map(|node| id(&node))));
    put(&mut message, &edges.collect::<Vec<[GlobalId; 6]>>());
    message
}

/// Coordinates, and 1 for boundary vertices. Each computed block is evaluated once.
fn places(interface: &Interface, vertices: &[u32]) -> (Vec<[f64; 3]>, Vec<u8>) {
    let part = interface.part;
    let (mut points, mut on_boundary) = (Vec::new(), Vec::new());
    let mut rest = vertices;
    while let Some(&first) = rest.first() {
        let index = vertex_block_of(part, first);
        let block = part.vertex_block(index);
        let (here, after) = rest.split_at(rest.partition_point(|vertex| *vertex < block.local.end));
        let of_block = part.vertex_points(index);
        points.extend(here.iter().map(|vertex| of_block[(vertex - block.local.start) as usize]));
        on_boundary.resize(points.len(), u8::from(block.on_boundary));
        rest = after;
    }
    (points, on_boundary)
}

/// Reads a message of rank `from`; the tets' `vertices` and `edge_nodes` are not set
/// yet.
pub(super) fn read(from: Rank, message: &[u8]) -> Message {
    let rest = &mut &message[..];
    let ids: Vec<GlobalId> = take(rest);
    let points: Vec<[f64; 3]> = take(rest);
    let on_boundary: Vec<u8> = take(rest);
    let origins: Vec<GlobalId> = take(rest);
    let counts: Vec<u32> = take(rest);
    let holders: Vec<Rank> = take(rest);
    let mut holders = &holders[..];
    let mut vertices = Vec::with_capacity(ids.len());
    for (k, &id) in ids.iter().enumerate() {
        let (of_vertex, others) = holders.split_at(counts[k] as usize);
        holders = others;
        let (point, origin) = (points[k], origins[k]);
        vertices
            .push((GhostVertex { id, point, on_boundary: on_boundary[k] == 1, origin }, of_vertex.to_vec()));
    }
    let ids: Vec<[u64; 2]> = take(rest);
    let bodies: Vec<u32> = take(rest);
    let named: Vec<[GlobalId; 4]> = take(rest);
    let edges: Vec<[GlobalId; 6]> = take(rest);
    let tet = |(k, (&[id, index], &body)): (usize, (&[u64; 2], &u32))| Named {
        tet: GhostTet { id, owner: from, index, body: BodyId(body), vertices: [0; 4], edge_nodes: None },
        vertices: named[k],
        edge_nodes: edges.get(k).copied(),
    };
    Message { vertices, tets: ids.iter().zip(&bodies).enumerate().map(tet).collect() }
}
