//! Repair of illegal tets: each is removed by a swap or a split, whichever leaves the best worst
//! tet.
//!
//! Repair always succeeds up to rounding. A tet with three edges on one patch at a vertex is
//! repaired by a new vertex at its centroid: each of the four new tets has three of the old
//! vertices, and at each of these an interior edge. A tet with two edges on one curve has a face
//! with both; unless that is a boundary triangle, a new vertex in the face separates them. Every
//! new tet contains the new vertex, so it can be illegal only because of an old face with two such
//! edges, and their number decreases.
//! ever fewer of these.

use crate::Point;
use crate::ground::mesh::{TET_EDGES, TET_FACES};
use crate::mesher::half_face::Ring;
use crate::mesher::improve::complex::Complex;
use crate::mesher::improve::insert::Inserter;
use crate::mesher::improve::objective::Objective;
use crate::mesher::improve::smooth::Smoother;
use crate::mesher::improve::swap::Swapper;

/// The most rounds over the illegal tets. One round repairs all but those with several faults.
const ROUNDS: usize = 8;

/// A swap is preferred to the best split if its worst score is at least this fraction of the
/// split's, because it adds no vertex.
const SWAP_PREFERRED: f64 = 0.5;

/// Numbers of repairs.
#[derive(Default)]
pub(super) struct Repairs {
    pub swaps: usize,
    pub splits: usize,
}

/// A position for a new vertex, and the tets that it replaces at least.
pub(super) struct Candidate {
    /// The tets.
    pub seeds: Vec<u32>,
    /// The position, in their interior.
    pub point: Point,
}

/// Repairs illegal tets where possible. The scores must be those of `objective`.
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

/// The centroids of the tet and of its interior faces, and the midpoints of its interior edges.
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
