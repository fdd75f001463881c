//! Clusters of adjacent vertices of a graph, and the smaller graph of these clusters.

use super::dual::Dual;
use super::weighted::Graph;
use crate::ground::kernel::buckets::{concat, map_each, ranges};
use std::ops::Range;

/// A graph with weights, as it is contracted and refined.
pub(super) trait Adjacency: Sync {
    /// The number of vertices.
    fn len(&self) -> usize;

    /// The weight of a vertex.
    fn weight(&self, vertex: u32) -> i64;

    /// The neighbours of a vertex, with the weights of the edges to them.
    fn edges(&self, vertex: u32) -> impl Iterator<Item = (u32, i64)>;
}

/// All vertices and edges have weight 1.
impl Adjacency for Dual {
    fn len(&self) -> usize {
        Dual::len(self)
    }

    fn weight(&self, _vertex: u32) -> i64 {
        1
    }

    fn edges(&self, vertex: u32) -> impl Iterator<Item = (u32, i64)> {
        self.of(vertex as usize).iter().map(|&other| (other, 1))
    }
}

/// A dual graph with weights of the tets.
#[derive(Clone, Copy)]
pub(super) struct WeightedDual<'a> {
    pub dual: &'a Dual,
    pub weights: &'a [i32],
}

impl Adjacency for WeightedDual<'_> {
    fn len(&self) -> usize {
        self.dual.len()
    }

    fn weight(&self, vertex: u32) -> i64 {
        self.weights[vertex as usize].into()
    }

    fn edges(&self, vertex: u32) -> impl Iterator<Item = (u32, i64)> {
        self.dual.edges(vertex)
    }
}

impl Adjacency for Graph {
    fn len(&self) -> usize {
        self.weights.len()
    }

    fn weight(&self, vertex: u32) -> i64 {
        self.weights[vertex as usize].into()
    }

    fn edges(&self, vertex: u32) -> impl Iterator<Item = (u32, i64)> {
        let [from, to] = [0, 1].map(|end| self.offsets[vertex as usize + end] as usize);
        let weights = self.edge_weights[from..to].iter().map(|&weight| i64::from(weight));
        self.neighbours[from..to].iter().map(|&other| other as u32).zip(weights)
    }
}

/// The number of vertices at which a cluster stops growing.
const FULL: usize = 8;

/// A cluster that ends with fewer vertices than this joins a neighbour.
const FEW: usize = 4;

/// Clusters are within blocks of this many consecutive vertices, which are independent. Tets that
/// are made here follow a space-filling curve, so few neighbours are in other blocks.
const BLOCK: usize = 1 << 16;

/// Blocks are of no use if their clusters have fewer vertices than this on average: tets of a file
/// may be in any order.
const SCATTERED: usize = 3;

/// Vertices in clusters.
pub(super) struct Clustering {
    /// The cluster of each vertex.
    pub of: Vec<u32>,
    pub count: usize,
}

/// Divides a graph into clusters of about [`FULL`] adjacent vertices, none heavier than `heaviest`
/// unless a single vertex is.
///
/// A cluster grows from the first free vertex by the neighbour with the largest weight of edges to
/// it, the one met first on ties: so it is round.
pub(super) fn cluster(graph: &impl Adjacency, heaviest: i64) -> Clustering {
    let blocks = graph.len().div_ceil(BLOCK);
    let range = |block: usize| block * BLOCK..((block + 1) * BLOCK).min(graph.len());
    let parts = map_each((0..blocks).map(range).collect(), |range| cluster_block(graph, range, heaviest));
    let count: usize = parts.iter().map(|part| part.count).sum();
    if blocks > 1 && SCATTERED * count > graph.len() {
        return cluster_block(graph, 0..graph.len(), heaviest);
    }
    let mut of = Vec::with_capacity(graph.len());
    let mut before = 0;
    for part in parts {
        of.extend(part.of.iter().map(|cluster| before + cluster));
        before += part.count as u32;
    }
    Clustering { of, count }
}

/// No cluster yet.
const NONE: u32 = u32::MAX;

/// The clusters of consecutive vertices, numbered from 0.
fn cluster_block(graph: &impl Adjacency, range: Range<usize>, heaviest: i64) -> Clustering {
    let first = range.start as u32;
    let mut of = vec![NONE; range.len()];
    // The number of vertices and the weight of each cluster.
    let mut sizes: Vec<(usize, i64)> = Vec::new();
    let (mut members, mut beside): (Vec<u32>, Vec<(u32, i64)>) = (Vec::new(), Vec::new());
    for seed in range.clone().map(|vertex| vertex as u32) {
        if of[(seed - first) as usize] != NONE {
            continue;
        }
        let cluster = sizes.len() as u32;
        members.clear();
        beside.clear();
        let (mut next, mut weight) = (seed, graph.weight(seed));
        loop {
            of[(next - first) as usize] = cluster;
            members.push(next);
            for (other, edge) in graph.edges(next).filter(|(other, _)| range.contains(&(*other as usize))) {
                if of[(other - first) as usize] == NONE {
                    add(&mut beside, other, edge);
                }
            }
            beside.retain(|&(other, _)| other != next && weight + graph.weight(other) <= heaviest);
            let Some(best) = strongest(&beside).filter(|_| members.len() < FULL) else { break };
            next = best;
            weight += graph.weight(best);
        }
        if members.len() < FEW {
            beside.clear();
            for (other, edge) in members.iter().flat_map(|&member| graph.edges(member)) {
                if range.contains(&(other as usize)) && of[(other - first) as usize] < cluster {
                    add(&mut beside, of[(other - first) as usize], edge);
                }
            }
            beside.retain(|&(other, _)| {
                let (count, other_weight) = sizes[other as usize];
                count + members.len() < 2 * FULL && other_weight + weight <= heaviest
            });
            if let Some(other) = strongest(&beside) {
                members.iter().for_each(|&member| of[(member - first) as usize] = other);
                let size = &mut sizes[other as usize];
                *size = (size.0 + members.len(), size.1 + weight);
                continue;
            }
        }
        sizes.push((members.len(), weight));
    }
    Clustering { of, count: sizes.len() }
}

/// Adds weight to an entry of a short list.
fn add(list: &mut Vec<(u32, i64)>, item: u32, weight: i64) {
    match list.iter_mut().find(|(known, _)| *known == item) {
        Some((_, sum)) => *sum += weight,
        None => list.push((item, weight)),
    }
}

/// The first item with the largest weight.
fn strongest(list: &[(u32, i64)]) -> Option<u32> {
    list.iter().rev().max_by_key(|(_, weight)| *weight).map(|&(item, _)| item)
}

/// The graph of `count` clusters, given that of each vertex: weights add, also those of edges
/// between the same two clusters.
pub(super) fn contract(graph: &impl Adjacency, of: &[u32], count: usize) -> Graph {
    let (starts, members) = members(of, count);
    let of_range = |range: Range<usize>| {
        let mut part = Graph::default();
        let mut beside: Vec<(u32, i64)> = Vec::new();
        for cluster in range {
            let members = &members[starts[cluster] as usize..starts[cluster + 1] as usize];
            let edges = members.iter().flat_map(|&member| graph.edges(member));
            let edges = edges.map(|(other, weight)| (of[other as usize], weight));
            beside.clear();
            beside.extend(edges.filter(|(other, _)| *other as usize != cluster));
            beside.sort_unstable_by_key(|(other, _)| *other);
            for run in beside.chunk_by(|a, b| a.0 == b.0) {
                part.neighbours.push(run[0].0 as i32);
                part.edge_weights.push(run.iter().map(|(_, weight)| *weight as i32).sum());
            }
            part.offsets.push(part.neighbours.len() as i32);
            part.weights.push(members.iter().map(|&member| graph.weight(member) as i32).sum());
        }
        part
    };
    let parts: Vec<Graph> = map_each(ranges(count), of_range);
    let mut offsets = Vec::with_capacity(count + 1);
    offsets.push(0);
    for part in &parts {
        let start = offsets[offsets.len() - 1];
        offsets.extend(part.offsets.iter().map(|end| start + end));
    }
    let (mut neighbours, mut edge_weights, mut weights) = (Vec::new(), Vec::new(), Vec::new());
    for part in parts {
        neighbours.push(part.neighbours);
        edge_weights.push(part.edge_weights);
        weights.push(part.weights);
    }
    Graph {
        offsets,
        neighbours: concat(neighbours),
        edge_weights: concat(edge_weights),
        weights: concat(weights),
    }
}

/// The vertices of each cluster one after the other, and where each cluster starts.
fn members(of: &[u32], count: usize) -> (Vec<u32>, Vec<u32>) {
    let mut starts = vec![0u32; count + 1];
    of.iter().for_each(|&cluster| starts[cluster as usize + 1] += 1);
    (0..count).for_each(|cluster| starts[cluster + 1] += starts[cluster]);
    let mut next = starts.clone();
    let mut members = vec![0; of.len()];
    for (vertex, &cluster) in (0..).zip(of) {
        members[next[cluster as usize] as usize] = vertex;
        next[cluster as usize] += 1;
    }
    (starts, members)
}

#[cfg(test)]
mod tests {
    use super::super::{dual, matched_faces};
    use super::*;
    use crate::ground::kernel::random::mix;
    use crate::ground::mesh::fixtures::lattice_cube;

    /// 82,944 tets: two blocks.
    fn graph() -> Dual {
        dual::dual(&matched_faces(&lattice_cube(24)).unwrap())
    }

    #[test]
    fn clusters_are_connected_and_neither_small_nor_large() {
        let graph = graph();
        let clusters = cluster(&graph, 1000);
        let (starts, members) = members(&clusters.of, clusters.count);
        assert!(Adjacency::len(&graph) > BLOCK && members.len() == Adjacency::len(&graph));
        assert!(6 * clusters.count < members.len(), "{} clusters", clusters.count);
        for ends in starts.windows(2) {
            let members = &members[ends[0] as usize..ends[1] as usize];
            assert!((1..2 * FULL).contains(&members.len()));
            let mut met = vec![members[0]];
            let mut next = 0;
            while let Some(&member) = met.get(next) {
                next += 1;
                for (other, _) in graph.edges(member) {
                    if members.contains(&other) && !met.contains(&other) {
                        met.push(other);
                    }
                }
            }
            assert_eq!(met.len(), members.len());
        }
    }

    #[test]
    fn vertices_in_any_order_are_clustered_as_well() {
        let mut mesh = lattice_cube(36);
        let count = mesh.tets.len() as u64;
        mesh.tets.sort_by_key(|tet| mix(tet.iter().fold(count, |key, v| mix(key ^ u64::from(v.0)))));
        let graph = dual::dual(&matched_faces(&mesh).unwrap());
        let clusters = cluster(&graph, 1000);
        assert!(5 * clusters.count < graph.len(), "{} clusters", clusters.count);
    }

    #[test]
    fn no_cluster_is_heavier_than_asked_unless_a_vertex_is() {
        let dual = graph();
        let weights: Vec<i32> = (0..dual.len()).map(|tet| if tet % 5 == 0 { 7 } else { 1 }).collect();
        let graph = WeightedDual { dual: &dual, weights: &weights };
        let clusters = cluster(&graph, 5);
        let coarse = contract(&graph, &clusters.of, clusters.count);
        assert!(coarse.weights.iter().all(|&weight| weight <= 5 || weight == 7));
        assert!(2 * clusters.count < dual.len(), "{} clusters", clusters.count);
    }

    #[test]
    fn a_contracted_graph_has_all_weight_and_each_edge_in_both_rows() {
        let graph = graph();
        let clusters = cluster(&graph, 1000);
        let coarse = contract(&graph, &clusters.of, clusters.count);
        assert_eq!(coarse.weights.iter().sum::<i32>() as usize, graph.len());
        let twice = |vertex: u32| {
            let here = clusters.of[vertex as usize];
            graph.edges(vertex).filter(|(other, _)| clusters.of[*other as usize] != here).count() as i64
        };
        let faces: i64 = (0..graph.len() as u32).map(twice).sum();
        assert_eq!(coarse.edge_weights.iter().map(|&weight| i64::from(weight)).sum::<i64>(), faces);
        for cluster in 0..coarse.weights.len() as u32 {
            for (other, weight) in coarse.edges(cluster) {
                assert!(coarse.edges(other).any(|edge| edge == (cluster, weight)));
            }
        }
    }
}
