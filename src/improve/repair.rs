//! Repair of illegal tets: each is swapped away or split, by whatever leaves the best worst tet.
//!
//! It always succeeds but for rounding. A tet with three edges
//! on one patch at a vertex is mended by a new vertex at its centroid: each of the four tets then has
//! three of the old vertices, and at each of these an edge that runs inside. One with two edges on one curve
//! has a face with both; a new vertex in that face, if it is not a boundary triangle, parts them. Every new tet has
//! the new vertex, so that it can only be illegal by an old face that had two such edges before: there are
//! ever fewer of these.

use crate::Point;
use crate::improve::complex::{Complex, Ring};
use crate::improve::insert::Inserter;
use crate::improve::objective::Objective;
use crate::improve::smooth::Smoother;
use crate::improve::swap::Swapper;
use crate::mesh::{TET_EDGES, TET_FACES};

/// Rounds over the illegal tets. One round mends all but those with several faults at once.
const ROUNDS: usize = 8;

/// A swap is taken if its worst tet is this fraction of what the best split would give: it costs no vertex.
const SWAP_PREFERRED: f64 = 0.5;

/// How often what was done.
#[derive(Default)]
pub(super) struct Repairs {
    pub swaps: usize,
    pub splits: usize,
}

/// A place for a new vertex, and the tets that surely go.
pub(super) struct Candidate {
    /// The tets.
    pub seeds: Vec<u32>,
    /// The place, inside them.
    pub point: Point,
}

/// Mends what can be mended. Scores must be those of `objective`.
pub(super) fn repair(
    complex: &mut Complex,
    objective: &Objective,
    swapper: &mut Swapper,
    inserter: &mut Inserter,
    smoother: &mut Smoother,
) -> Repairs {
    let mut repairs = Repairs::default();
    for _ in 0..ROUNDS {
        let illegal: Vec<u32> = complex.living().filter(|&t| complex.scores[t as usize] <= 0.0).collect();
        if illegal.is_empty() {
            break;
        }
        for tet in illegal {
            if !complex.is_alive(tet) || complex.scores[tet as usize] > 0.0 {
                continue;
            }
            let mut best: Option<(f64, Candidate)> = None;
            for candidate in candidates(complex, tet) {
                if inserter.find(complex, objective, smoother, &candidate.seeds, candidate.point)
                    && best.as_ref().is_none_or(|b| inserter.worst() > b.0)
                {
                    best = Some((inserter.worst(), candidate));
                }
            }
            let split = best.as_ref().map_or(0.0, |b| b.0);
            if swapper.find(complex, objective, tet)
                && swapper.worst() > SWAP_PREFERRED * split
                && swapper.commit(complex)
            {
                repairs.swaps += 1;
            } else if let Some((_, candidate)) = best
                && inserter.find(complex, objective, smoother, &candidate.seeds, candidate.point)
                && inserter.commit(complex)
            {
                repairs.splits += 1;
            }
        }
    }
    repairs
}

/// The middles of the tet, of its faces and of its edges, as far as they are not on the boundary.
pub(super) fn candidates(complex: &Complex, tet: u32) -> Vec<Candidate> {
    let corners = complex.tets[tet as usize];
    let middle = |vertices: &[u32]| {
        let sum: crate::Vector = vertices.iter().map(|&v| complex.points[v as usize].coords).sum();
        Point::from(sum / vertices.len() as f64)
    };
    let mut candidates = vec![Candidate { seeds: vec![tet], point: middle(&corners) }];
    for (k, face) in TET_FACES.iter().enumerate() {
        if let Some((beyond, _)) = complex.neighbour(tet, k) {
            candidates.push(Candidate { seeds: vec![tet, beyond], point: middle(&face.map(|i| corners[i])) });
        }
    }
    let mut ring = Ring::default();
    for [i, j] in TET_EDGES {
        if complex.ring(tet, i, j, usize::MAX, &mut ring) {
            candidates.push(Candidate { seeds: ring.tets.clone(), point: middle(&[corners[i], corners[j]]) });
        }
    }
    candidates
}
