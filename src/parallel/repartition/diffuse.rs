//! Diffusive load balancing: parts that are too large give tets to their neighbours.
//!
//! The number of tets to move between neighbouring parts is the flow of least cost on the graph of
//! parts that makes all equal (Hu and Blake 1999): x solves the graph Laplace equation with the
//! loads on the right-hand side, and the flow from i to j is w (x_i − x_j). The weight w is the
//! number of faces that two parts share, so the layers moved are equally thick on wide and narrow
//! borders. Each rank then assigns its tets next to the border to the neighbour, layer by layer.
//! Messages are as few as parts have neighbours; [`repartition`](super::repartition()) instead
//! partitions from scratch.

use super::neighbours::{NONE, Neighbours};
use crate::ground::comm::{CommError, Communicator};
use crate::ground::mesh::Rank;

/// A rank keeps at least this fraction of its tets; tets that only pass through move on in the next
/// call.
const KEPT: f64 = 0.2;

/// Relative residual at which the equation counts as solved.
const SOLVED: f64 = 1e-6;

/// **Collective.** A rank for each tet of this part, so that parts are as even as one move to
/// neighbours can make them.
///
/// Parts without neighbours keep their tets.
///
/// # Errors
/// [`CommError`] if another rank fails.
pub fn diffuse(comm: &dyn Communicator, neighbours: &Neighbours) -> Result<Vec<Rank>, CommError> {
    let border = |(rank, ghosts): &(Rank, Vec<u32>)| [u64::from(*rank), ghosts.len() as u64];
    let mine: Vec<[u64; 2]> = neighbours.with.iter().map(border).collect();
    let graph = Graph { neighbours: comm.all_gather(&mine)? };
    let loads = comm.all_gather_one(neighbours.tets() as f64)?;
    let potential = graph.potential(&loads);
    let me = neighbours.rank as usize;
    let flow = |[rank, faces]: &[u64; 2]| *faces as f64 * (potential[me] - potential[*rank as usize]);
    let wanted: f64 = mine.iter().map(flow).filter(|flow| *flow > 0.0).sum();
    let scale = f64::min(1.0, (1.0 - KEPT) * loads[me] / wanted.max(1.0));
    let quotas: Vec<usize> = mine.iter().map(|link| (scale * flow(link)).max(0.0).round() as usize).collect();
    Ok(assign_layers(neighbours, quotas))
}

/// The graph of parts, weighted by the number of shared faces.
struct Graph {
    /// For each part its neighbours, ascending, and the number of shared faces.
    neighbours: Vec<Vec<[u64; 2]>>,
}

impl Graph {
    /// The Laplacian of the graph times a vector.
    fn apply(&self, x: &[f64]) -> Vec<f64> {
        let row = |(i, neighbours): (usize, &Vec<[u64; 2]>)| {
            neighbours.iter().map(|&[j, faces]| faces as f64 * (x[i] - x[j as usize])).sum()
        };
        self.neighbours.iter().enumerate().map(row).collect()
    }

    /// For each part the first part of its connected component.
    fn components(&self) -> Vec<usize> {
        let mut first = vec![usize::MAX; self.neighbours.len()];
        for start in 0..first.len() {
            let mut waiting = vec![start];
            while let Some(part) = waiting.pop() {
                if first[part] == usize::MAX {
                    first[part] = start;
                    waiting.extend(self.neighbours[part].iter().map(|link| link[0] as usize));
                }
            }
        }
        first
    }

    /// The potential whose flow makes the loads equal within each connected component; by conjugate
    /// gradients, bitwise the same on all ranks.
    fn potential(&self, loads: &[f64]) -> Vec<f64> {
        let component = self.components();
        let mut sums = vec![(0.0, 0.0); loads.len()];
        for (part, load) in loads.iter().enumerate() {
            let sum = &mut sums[component[part]];
            *sum = (sum.0 + load, sum.1 + 1.0);
        }
        let excess = |(part, load): (usize, &f64)| load - sums[component[part]].0 / sums[component[part]].1;
        let mut residual: Vec<f64> = loads.iter().enumerate().map(excess).collect();
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let mut x = vec![0.0; loads.len()];
        let mut way = residual.clone();
        let mut norm = dot(&residual, &residual);
        let goal = SOLVED * SOLVED * norm;
        for _ in 0..4 * loads.len() {
            if norm <= goal {
                break;
            }
            let image = self.apply(&way);
            let step = norm / dot(&way, &image);
            x.iter_mut().zip(&way).for_each(|(x, way)| *x += step * way);
            residual.iter_mut().zip(&image).for_each(|(r, image)| *r -= step * image);
            let next = dot(&residual, &residual);
            way.iter_mut().zip(&residual).for_each(|(way, r)| *way = r + next / norm * *way);
            norm = next;
        }
        x
    }
}

/// A destination for each tet: fills the quota of each neighbour from the border inward, one layer
/// per neighbour in turn.
fn assign_layers(neighbours: &Neighbours, mut quotas: Vec<usize>) -> Vec<Rank> {
    let mut to = vec![neighbours.rank; neighbours.tets()];
    let at_border = |ghosts: &Vec<u32>| ghosts.iter().map(|&ghost| neighbours.own(ghost)).collect();
    let mut layers: Vec<Vec<u32>> = neighbours.with.iter().map(|(_, ghosts)| at_border(ghosts)).collect();
    while quotas.iter().zip(&layers).any(|(quota, layer)| *quota > 0 && !layer.is_empty()) {
        for ((&(rank, _), quota), layer) in neighbours.with.iter().zip(&mut quotas).zip(&mut layers) {
            let mut next = Vec::new();
            for tet in std::mem::take(layer) {
                if *quota == 0 {
                    break;
                }
                if to[tet as usize] != neighbours.rank {
                    continue;
                }
                to[tet as usize] = rank;
                *quota -= 1;
                let local = |other: &u32| *other != NONE && (*other as usize) < neighbours.tets();
                let beside = neighbours.beside[tet as usize].iter().copied().filter(local);
                next.extend(beside.filter(|&other| to[other as usize] == neighbours.rank));
            }
            *layer = next;
        }
    }
    to
}
