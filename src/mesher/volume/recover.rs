//! Boundary recovery by flips: mesh edges and faces that cross a missing edge are flipped away.
//!
//! After George, Hecht, Saltel (1991), with edge removal as in Shewchuk (2002) and recursive
//! removal of neighbouring edges as in Si (2015). Flips do nearly all of the recovery; the rest is
//! done by Steiner points (`conform`).

use super::cavity::Cavity;
use super::constraints::Constraints;
use super::crossing::{Crossing, crossings};
use super::flips::Flips;
use super::tetrahedra::Tetrahedra;
use crate::ground::kernel::random::mix;

/// The most changes of a missing edge's crossings before it is given up: flips may cycle. Not
/// tuned.
const ROUNDS: usize = 40;

/// Recursion depth of auxiliary flips; see [`Flips::remove_edge_recursively`].
pub(super) const DEEPEST: u32 = 2;

/// The most auxiliary flip attempts per edge or facet. 30 leaves twice as many Steiner points on
/// the hinge of NETGEN's tutorials.
const BUDGET: u32 = 1000;

/// Numbers of missing entities at the start of recovery.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Counts {
    pub missing_edges: usize,
    pub missing_faces: usize,
}

/// State of boundary recovery.
pub(super) struct Recovery<'a> {
    pub(super) mesh: &'a mut Tetrahedra,
    pub(super) constraints: &'a mut Constraints,
    /// Steiner points on the surface, in the order of insertion.
    pub steiner: Vec<u32>,
    pub counts: Counts,
    pub(super) flips: Flips,
    pub(super) cavity: Cavity,
    pub(super) star: Vec<u32>,
    pub(super) found: Vec<Crossing>,
    pub(super) most_steiner: usize,
    /// Remaining auxiliary flip attempts in total, which bounds the time.
    budget_left: u64,
    attempt: u32,
}

impl<'a> Recovery<'a> {
    /// Starts a recovery. Each `attempt` uses another order of edges and facets, because success
    /// depends on it.
    pub fn new(mesh: &'a mut Tetrahedra, constraints: &'a mut Constraints, attempt: u32) -> Self {
        Self {
            mesh,
            constraints,
            steiner: Vec::new(),
            counts: Counts::default(),
            flips: Flips::default(),
            cavity: Cavity::default(),
            star: Vec::new(),
            found: Vec::new(),
            most_steiner: 0,
            budget_left: 0,
            attempt,
        }
    }

    /// Sorts edges or facets into the random order of this attempt.
    ///
    /// If edges of two close sets are recovered one set after the other, many more points are
    /// needed (2810 instead of 423 on a prism of 356 triangles).
    pub(super) fn shuffle<T>(&self, all: &mut [T], key: impl Fn(&T) -> u64) {
        all.sort_by_key(|one| mix(mix(u64::from(self.attempt)) ^ key(one)));
    }

    /// The facets that are not faces of the mesh, in the order of this attempt.
    pub(super) fn missing_facets(&self) -> Vec<u32> {
        let mut present = vec![false; self.constraints.facets.len()];
        for (_, facet) in self.constraints.faces_in(self.mesh) {
            present[facet as usize] = true;
        }
        let mut missing: Vec<u32> = self.constraints.alive().filter(|&f| !present[f as usize]).collect();
        self.shuffle(&mut missing, |&f| u64::from(f));
        missing
    }

    /// Raises the remaining budget of auxiliary flips to at least that of this many edges or
    /// facets.
    pub(super) fn raise_budget(&mut self, edges: usize) {
        let more = (u64::from(BUDGET) * edges as u64).saturating_sub(self.budget_left);
        self.budget_left += more;
    }

    /// Moves the budget for one edge from the total to `flips`, after returning what was not used.
    pub(super) fn take_budget(&mut self) {
        self.budget_left += u64::from(self.flips.budget);
        self.flips.budget = self.budget_left.min(u64::from(BUDGET)) as u32;
        self.budget_left -= u64::from(self.flips.budget);
    }

    /// Recovers edge (a, b) by flips alone; whether it exists then.
    pub(super) fn recover_edge(&mut self, a: u32, b: u32, depth: u32) -> bool {
        self.take_budget();
        let mut found = std::mem::take(&mut self.found);
        let mut stuck = 0;
        let mut done = false;
        for round in 0..ROUNDS {
            // From both ends in turn, because flips at the ends change most.
            let (from, to) = if round % 2 == 0 { (a, b) } else { (b, a) };
            crossings(self.mesh, from, to, &mut self.star, &mut found);
            done = found.is_empty();
            if done {
                break;
            }
            stuck = if self.clear_one(from, to, depth, &mut found) { 0 } else { stuck + 1 };
            if stuck == 2 {
                break;
            }
        }
        self.found = found;
        done || self.mesh.tet_at_edge(a, b, &mut self.star).is_some()
    }

    /// Flips away one crossing of the edge from `a` to `b`; whether that succeeded.
    fn clear_one(&mut self, a: u32, b: u32, depth: u32, found: &mut Vec<Crossing>) -> bool {
        let (mut next, mut before) = (0, self.flips.count);
        while let Some(&crossing) = found.get(next) {
            if self.clear_crossing(a, b, crossing, depth) {
                return true;
            }
            next += 1;
            if self.flips.count != before {
                // Auxiliary flips changed the mesh without success.
                before = self.flips.count;
                crossings(self.mesh, a, b, &mut self.star, found);
            }
        }
        found.is_empty()
    }

    /// Flips away one given crossing of the edge from `a` to `b`.
    fn clear_crossing(&mut self, a: u32, b: u32, crossing: Crossing, depth: u32) -> bool {
        match crossing {
            Crossing::Vertex(_) => false,
            Crossing::Edge(tet, edge) => self.remove_edge(tet, edge, [a, b], depth),
            Crossing::Face(half_face) => {
                let [x, y, z] = self.mesh.face(half_face);
                let (tet, other) = (half_face >> 2, self.mesh.across(half_face));
                let ends = [self.mesh.apex(half_face), self.mesh.apex(other)];
                // At an end of the edge a 2-3 flip removes a crossing; elsewhere it may only move
                // crossings.
                if (ends.contains(&a) || ends.contains(&b))
                    && self.flips.remove_face(self.mesh, self.constraints, half_face).is_ok()
                {
                    return true;
                }
                [[x, y], [y, z], [z, x]].into_iter().any(|edge| self.remove_edge(tet, edge, [a, b], depth))
            }
        }
    }

    /// Removes an edge; `tet` may be outdated, because auxiliary flips may have changed the tets
    /// around it.
    pub(super) fn remove_edge(&mut self, tet: u32, edge: [u32; 2], wanted: [u32; 2], depth: u32) -> bool {
        let still = self.mesh.is_alive(tet) && edge.iter().all(|v| self.mesh.tets[tet as usize].contains(v));
        let tet = if still { Some(tet) } else { self.mesh.tet_at_edge(edge[0], edge[1], &mut self.star) };
        tet.is_some_and(|tet| {
            self.flips.remove_edge_recursively(self.mesh, self.constraints, tet, edge, wanted, depth).is_ok()
        })
    }
}

/// Locks all faces that are facets; every facet must be a face.
pub(super) fn lock_facets(mesh: &mut Tetrahedra, constraints: &Constraints) {
    let faces = constraints.faces_in(mesh);
    assert_eq!(faces.len(), constraints.alive().count(), "a facet is not a face of the mesh");
    faces.into_iter().for_each(|(half_face, _)| mesh.lock(half_face));
}
