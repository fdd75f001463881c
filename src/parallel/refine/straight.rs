//! Edges of second order that stay straight, off the geometry, where the tets beside them would not
//! be valid otherwise.
//!
//! The node on an edge is the mean of the ends of the edge before it is snapped, and no other point
//! depends on it. So an edge is made straight by setting its node to that mean, on all ranks that
//! have it.

use super::numbering::{Entity, Numbering};
use super::snap::Coordinates;
use super::{RefineError, RefinedMesh, Settings, refine_reporting, tet};
use crate::ground::comm::{CommError, Communicator};
use crate::ground::kernel::jacobian::{self, Nodes};
use crate::ground::mesh::stream::{LocalBlock, MeshStream};
use crate::ground::mesh::{GlobalId, TET_EDGES};
use crate::ground::progress::Work;
use crate::ground::projector::Projector;
use crate::parallel::distribution::DistMesh;
use std::collections::BTreeSet;

/// Sets the nodes with these global ids to the means of the ends of their edges.
pub(super) fn straighten(
    mesh: &DistMesh,
    numbering: &Numbering,
    nodes: &[GlobalId],
    points: &mut [Coordinates],
) {
    for &node in nodes {
        if let Some((entity, within)) = numbering.find(mesh, node)
            && let Some(ends) = ends_of(mesh, numbering, entity, within)
        {
            let [p, q] = ends.map(|end| points[end as usize]);
            let at = numbering.inside(entity).start + within;
            points[at as usize] = [0, 1, 2].map(|x| 0.5 * (p[x] + q[x]));
        }
    }
}

/// The ends of the fine edge with this node in its middle, by local id; `None` if the vertex is no
/// such node on a coarse edge or face.
fn ends_of(mesh: &DistMesh, numbering: &Numbering, entity: Entity, within: u32) -> Option<[u32; 2]> {
    let lattice = numbering.lattice();
    let inside = numbering.inside(entity);
    match entity.dimension {
        1 => {
            let [first, last] = mesh.edges[entity.id as usize].map(|vertex| vertex.0);
            let at = |k: u32| match k {
                0 => first,
                k if k == lattice.n() => last,
                k => inside.start + k - 1,
            };
            let k = within + 1;
            (k % 2 == 1).then(|| [at(k - 1), at(k + 1)])
        }
        2 => {
            let (j, k) = lattice.face_interior().nth(within as usize)?;
            let [p, q] = match (j % 2, k % 2) {
                (0, 0) => return None,
                (1, 0) => [[j - 1, k], [j + 1, k]],
                (0, _) => [[j, k - 1], [j, k + 1]],
                _ => [[j + 1, k - 1], [j - 1, k + 1]],
            };
            let ids = numbering.ids_of_face(mesh, entity.id)?;
            Some([p, q].map(|[j, k]| ids[(j + (lattice.n() + 1) * k) as usize]))
        }
        _ => None,
    }
}

/// The nodes of coarse tets to be set to the middle of their edges, so that the children are proved
/// valid.
fn needed(refined: &RefinedMesh, bad: &[tet::BadTet]) -> BTreeSet<GlobalId> {
    // Only nodes on coarse edges and faces are snapped.
    let [.., inside] = refined.numbering().bases();
    let mut needed = BTreeSet::new();
    let (mut block, mut points) = (LocalBlock::default(), Vec::new());
    for tet in bad {
        let Ok(index) = refined.coarse().tet_ids.binary_search(&tet.tet) else { continue };
        refined.local_block(index, &mut block);
        refined.block_points(&block, &mut points);
        let children = block.tets.tets.iter().zip(&block.tets.edge_nodes);
        for (corners, edges) in children {
            let nodes = jacobian::nodes(*corners, *edges, |k| points[k as usize]);
            let node_of = |edge: usize| block.vertices[edges[edge] as usize];
            let edges = straight_edges(nodes, |edge| (node_of(edge) as usize) < inside);
            needed.extend(edges.into_iter().map(|edge| refined.vertex_id(node_of(edge))));
        }
    }
    needed
}

/// The edges that must be straight for a tet to be valid, one by one those that help most; only
/// those that `may`.
fn straight_edges(mut nodes: Nodes, may: impl Fn(usize) -> bool) -> Vec<usize> {
    let mut chosen = Vec::new();
    let mut range = jacobian::range(&nodes);
    while !range.is_positive() {
        let straightened = |edge: usize| {
            let [p, q] = TET_EDGES[edge].map(|corner| nodes[corner]);
            let mut other = nodes;
            other[4 + edge] = [0, 1, 2].map(|x| 0.5 * (p[x] + q[x]));
            (other != nodes).then(|| (edge, other, jacobian::range(&other)))
        };
        let tried = (0..6).filter(|&edge| may(edge)).filter_map(straightened);
        let best = tried.max_by(|a, b| a.2.least.total_cmp(&b.2.least));
        let Some((edge, other, of_other)) = best else { break };
        (nodes, range) = (other, of_other);
        chosen.push(edge);
    }
    chosen
}

/// Rounds of making edges straight; each may make tets beside the edges invalid.
const ROUNDS: usize = 16;

/// **Collective.** [`refine()`](super::refine()) that leaves edges straight where tets of second
/// order would not be valid otherwise. Also returns their nodes: global ids, ascending, the same on
/// all ranks.
///
/// # Errors
/// [`CommError`] if another rank fails. The errors of refinement are in the result, which may
/// differ between ranks.
pub fn refine_straightening(
    comm: &dyn Communicator,
    mesh: &DistMesh,
    projector: &Projector,
    n: u32,
    settings: &Settings,
    work: &Work,
) -> Result<(Result<RefinedMesh, RefineError>, Vec<GlobalId>), CommError> {
    let mut settings = settings.clone();
    for round in 0.. {
        let made = refine_reporting(mesh.clone(), projector, n, &settings, work);
        let mine: Vec<GlobalId> = match &made {
            Ok((refined, bad)) if round < ROUNDS => needed(refined, bad).into_iter().collect(),
            _ => Vec::new(),
        };
        let before = settings.straight.len();
        let mut all = settings.straight.clone();
        all.extend(comm.all_gather(&mine)?.concat());
        all.sort_unstable();
        all.dedup();
        if all.len() == before {
            let made = made.and_then(|(refined, bad)| {
                if bad.is_empty() { Ok(refined) } else { Err(tet::inverted(&bad, settings.described)) }
            });
            return Ok((made, settings.straight));
        }
        settings.straight = all;
    }
    unreachable!("the loop ends when no more edges need to be straight")
}
