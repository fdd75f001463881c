//! Boundary recovery by flips: what crosses a missing edge or goes through a missing triangle is flipped away.
//!
//! George, Hecht, Saltel 1991; with edge removal as in Shewchuk 2002, helped by recursive removal of edges beside it as in Si 2015. It does nearly all of
//! the work; what it leaves is cut out by points (`conform`).

use super::cavity::Cavity;
use super::constraints::Constraints;
use super::crossing::{Crossing, crossings};
use super::flips::Flips;
use super::tetrahedra::Tetrahedra;
use crate::kernel::random::mix;

/// How often flips may change what a missing edge meets before it is set aside: flips may go round in
/// circles, so there must be a bound. It was not tuned.
const ROUNDS: usize = 40;

/// How deep helping flips go, see [`Flips::remove_edge_with_help`].
pub(super) const DEEPEST: u32 = 2;

/// How many edges may be tried to help to recover one edge or facet. On the hinge of NETGEN's tutorials 30 left twice as many Steiner points as
/// 1000 in the same time, when these were still rounded ones.
const HELP: u32 = 1000;

/// Counts of what the recovery met.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Counts {
    pub missing_edges: usize,
    pub missing_faces: usize,
}

/// The state of a recovery.
pub(super) struct Recovery<'a> {
    pub(super) mesh: &'a mut Tetrahedra,
    pub(super) constraints: &'a mut Constraints,
    /// Steiner points on the surface, in the order in which they were added.
    pub steiner: Vec<u32>,
    pub counts: Counts,
    pub(super) flips: Flips,
    pub(super) cavity: Cavity,
    pub(super) star: Vec<u32>,
    pub(super) found: Vec<Crossing>,
    pub(super) most_steiner: usize,
    /// How many edges may still be tried to help in all: where nothing goes on, the time must end.
    help_left: u64,
    attempt: u32,
}

impl<'a> Recovery<'a> {
    /// A recovery. Each `attempt` takes edges and facets in another order: one may end where another does not.
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
            help_left: 0,
            attempt,
        }
    }

    /// Sorts what is to be recovered into the order of this attempt, which is random: of edges that pass close by one another those of one
    /// side in turn would need many more points (2810 for 423 on a prism of 356 triangles).
    pub(super) fn shuffle<T>(&self, all: &mut [T], key: impl Fn(&T) -> u64) {
        all.sort_by_key(|one| mix(mix(u64::from(self.attempt)) ^ key(one)));
    }

    /// The facets that are no faces of the mesh, by one pass over it.
    pub(super) fn missing_facets(&self) -> Vec<u32> {
        let mut present = vec![false; self.constraints.facets.len()];
        for t in self.mesh.alive() {
            for half_face in 4 * t..4 * t + 4 {
                if half_face < self.mesh.across(half_face)
                    && let Some(facet) = self.constraints.facet(self.mesh.face(half_face))
                {
                    present[facet as usize] = true;
                }
            }
        }
        let mut missing: Vec<u32> = self.constraints.alive().filter(|&f| !present[f as usize]).collect();
        self.shuffle(&mut missing, |&f| u64::from(f));
        missing
    }

    /// Sees to it that at least so many edges and facets can be helped.
    pub(super) fn give_help(&mut self, edges: usize) {
        let more = (u64::from(HELP) * edges as u64).saturating_sub(self.help_left);
        self.help_left += more;
    }

    /// Gives the flips their share of the help that is left, and takes back what was not used of the last.
    pub(super) fn take_help(&mut self) {
        self.help_left += u64::from(self.flips.budget);
        self.flips.budget = self.help_left.min(u64::from(HELP)) as u32;
        self.help_left -= u64::from(self.flips.budget);
    }

    /// Makes a, b an edge of the mesh by flips alone.
    pub(super) fn recover_edge(&mut self, a: u32, b: u32, depth: u32) -> bool {
        self.take_help();
        let mut found = std::mem::take(&mut self.found);
        let mut stuck = 0;
        let mut done = false;
        for round in 0..ROUNDS {
            // From either end in turn: the flips at the end change most.
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

    /// Flips something of what the edge from `a` to `b` crosses.
    fn clear_one(&mut self, a: u32, b: u32, depth: u32, found: &mut Vec<Crossing>) -> bool {
        let (mut next, mut before) = (0, self.flips.count);
        while let Some(&crossing) = found.get(next) {
            if self.clear_crossing(a, b, crossing, depth) {
                return true;
            }
            next += 1;
            if self.flips.count != before {
                // Helping flips have changed the mesh in vain.
                before = self.flips.count;
                crossings(self.mesh, a, b, &mut self.star, found);
            }
        }
        found.is_empty()
    }

    /// Flips something of what the edge from `a` to `b` crosses there.
    fn clear_crossing(&mut self, a: u32, b: u32, crossing: Crossing, depth: u32) -> bool {
        match crossing {
            Crossing::Vertex(_) => false,
            Crossing::Edge(tet, edge) => self.remove_edge(tet, edge, [a, b], depth),
            Crossing::Face(half_face) => {
                let [x, y, z] = self.mesh.face(half_face);
                let (tet, other) = (half_face >> 2, self.mesh.across(half_face));
                let ends = [self.mesh.apex(half_face), self.mesh.apex(other)];
                // A flip at an end of the edge leaves one crossing less; elsewhere it may only move them.
                if (ends.contains(&a) || ends.contains(&b))
                    && self.flips.remove_face(self.mesh, self.constraints, half_face).is_ok()
                {
                    return true;
                }
                [[x, y], [y, z], [z, x]].into_iter().any(|edge| self.remove_edge(tet, edge, [a, b], depth))
            }
        }
    }

    /// Removes an edge in the way; helping flips may have changed its tets before.
    pub(super) fn remove_edge(&mut self, tet: u32, edge: [u32; 2], wanted: [u32; 2], depth: u32) -> bool {
        let still = self.mesh.is_alive(tet) && edge.iter().all(|v| self.mesh.tets[tet as usize].contains(v));
        let tet = if still { Some(tet) } else { self.mesh.tet_at_edge(edge[0], edge[1], &mut self.star) };
        tet.is_some_and(|tet| {
            self.flips.remove_edge_with_help(self.mesh, self.constraints, tet, edge, wanted, depth).is_ok()
        })
    }
}

/// Locks the faces that are facets; all of them must be there.
pub(super) fn lock_facets(mesh: &mut Tetrahedra, constraints: &Constraints) {
    let mut locked = 0;
    for half_face in (0..mesh.tets.len() as u32).flat_map(|t| 4 * t..4 * t + 4) {
        if mesh.is_alive(half_face >> 2)
            && half_face < mesh.across(half_face)
            && constraints.facet(mesh.face(half_face)).is_some()
        {
            mesh.lock(half_face);
            locked += 1;
        }
    }
    assert_eq!(locked, constraints.alive().count(), "a facet is no face of the mesh");
}
