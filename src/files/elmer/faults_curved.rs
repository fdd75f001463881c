//! Faults of second order: elements that are not valid, and edges whose elements have different
//! nodes on them.

use super::faults::{FaultKind, Faults};
use super::faults_nodes::NodeTable;
use super::read::{Element, ElmerMesh};
use crate::files::node_order::VTK;
use crate::ground::kernel::jacobian;
use crate::ground::mesh::{TET_EDGES, TRIANGLE_EDGES};
use rayon::prelude::*;

/// The node that an element has on an edge.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct OnEdge {
    /// The ends, ascending.
    ends: [u32; 2],
    /// 0 if the element is of first order.
    node: u32,
    part: u32,
    is_boundary: bool,
    index: u32,
}

/// Checks the elements of second order, if there are any.
pub(super) fn check_curved(mesh: &ElmerMesh, tables: &[NodeTable], faults: &mut Faults) {
    let is_second = |element: &Element| element.edge_nodes.is_some();
    if mesh.parts.iter().any(|part| part.elements.iter().any(is_second)) {
        check_valid(mesh, tables, faults);
        check_edges(mesh, faults);
    }
}

fn check_valid(mesh: &ElmerMesh, tables: &[NodeTable], faults: &mut Faults) {
    for (part, table) in mesh.parts.iter().zip(tables) {
        let scaled = |element: &Element| {
            let mut nodes = [[0.0; 3]; 10];
            let edges = VTK.iter().zip(element.edge_nodes?).map(|(edge, id)| (4 + edge, id));
            for (place, id) in element.nodes.into_iter().enumerate().chain(edges) {
                let point = part.nodes[table.find(id)?].point;
                nodes[place] = [point.x, point.y, point.z];
            }
            let range = jacobian::range(&nodes);
            (!range.is_positive()).then(|| range.scaled())
        };
        let of_part: Vec<Option<f64>> = part.elements.par_iter().map(scaled).collect();
        for (k, scaled) in of_part.iter().enumerate() {
            if let Some(scaled) = scaled {
                let id = part.elements[k].id;
                let what = || format!("element {id} has a scaled Jacobian of {scaled:.3} or more");
                faults.add(FaultKind::NotValid, part.file("elements"), part.elements.line(k), what);
            }
        }
    }
}

fn check_edges(mesh: &ElmerMesh, faults: &mut Faults) {
    let mut all: Vec<OnEdge> = Vec::new();
    for (of_part, part) in mesh.parts.iter().zip(0..) {
        for (element, index) in of_part.elements.iter().zip(0..) {
            for (place, &edge) in VTK.iter().enumerate() {
                let [p, q] = TET_EDGES[edge].map(|corner| element.nodes[corner]);
                let node = element.edge_nodes.map_or(0, |nodes| nodes[place]);
                all.push(OnEdge { ends: [p.min(q), p.max(q)], node, part, is_boundary: false, index });
            }
        }
        for (element, index) in of_part.boundary.iter().zip(0..) {
            for (place, edge) in TRIANGLE_EDGES.into_iter().enumerate() {
                let [p, q] = edge.map(|corner| element.nodes[corner]);
                let node = element.edge_nodes.map_or(0, |nodes| nodes[place]);
                all.push(OnEdge { ends: [p.min(q), p.max(q)], node, part, is_boundary: true, index });
            }
        }
    }
    all.par_sort_unstable();
    for pair in all.windows(2).filter(|pair| pair[0].ends == pair[1].ends && pair[0].node != pair[1].node) {
        let [before, here] = [pair[0], pair[1]];
        let part = &mesh.parts[here.part as usize];
        let (kind, line) = match here.is_boundary {
            false => ("elements", part.elements.line(here.index as usize)),
            true => ("boundary", part.boundary.line(here.index as usize)),
        };
        let [p, q] = here.ends;
        let what =
            || format!("the edge of nodes {p} and {q} has the node {}, elsewhere {}", here.node, before.node);
        faults.add(FaultKind::EdgeNodesDiffer, part.file(kind), line, what);
    }
}
