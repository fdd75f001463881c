//! Boundary recovery: every triangle of the surface becomes a face of the mesh.
//!
//! Edges first, then faces. Flips do nearly all of it: what crosses a missing edge or pierces a missing face
//! is flipped away (George, Hecht, Saltel 1991; with edge removal as in Shewchuk 2002). Where no flip is left,
//! a **Steiner point** is put where the missing edge crosses the mesh, or where an edge of the mesh pierces the missing
//! face: splitting there is always possible and brings the end nearer (George, Borouchaki, Saltel 2003,
//! section 4). These points lie on the surface for the time being; `relocate` takes them off it again.

use super::cavity::Cavity;
use super::constraints::{Constraints, Facet, edges};
use super::crossing::{Crossing, Piercing, crossings, piercing};
use super::flips::Flips;
use super::polygon::Shadow;
use super::tetrahedra::Tetrahedra;
use crate::kernel::random::mix;

/// How often flips may change what a missing edge or face meets before it is set aside: flips may go round in
/// circles, so there must be a bound. It was not tuned.
const ROUNDS: usize = 40;

/// How deep helping flips go, see [`Flips::remove_edge_with_help`].
pub(super) const DEEPEST: u32 = 2;

/// How many edges may be tried to help to recover one edge or facet. On the hinge of NETGEN's tutorials 30 leave 70
/// Steiner points for a while, 1000 leave 37 in the same time.
const HELP: u32 = 1000;

/// Steiner points come in **generations**: those on the edges and facets missing at first, those on the edges from these points to
/// the corners opposite, and so on. Where flips do their part each generation is much smaller than the one before (skins end after
/// 50 and 0, say). Where it is not the points make more work than they do: so a generation may only have this many points and a share of the
/// one before or of what is missing, the first one a share of what was missing at first. What is left waits for the next.
const LEAST_STEINER: usize = 10;

/// The share of the generation before, in eighths.
const EIGHTHS: usize = 4;

/// The share of what is missing, in eighths. With none at all 200 missing facets of prisms of 86 sides that are twisted nearly to their limit
/// wait for ten points a generation.
const EIGHTHS_OF_MISSING: usize = 2;

/// The share of what was missing at first, in eighths: attempts that end well have needed 1 to 5.
const FIRST_EIGHTHS: usize = 4;

/// How many points an edge of the surface may get in one generation: attempts that end well need up to 11. Where sheets come so near to each
/// other that rounding decides what an edge crosses it takes any number in vain.
const MOST_ON_EDGE: usize = 16;

/// How many points an edge inside a triangle may get in one generation: with one more on it there is mostly another way to cut the triangle. With
/// sixteen the generations of twisted prisms grow (450, 671, 890 where one gives 450, 130, 92).
const MOST_INSIDE: usize = 1;

/// How many generations may pass without fewer missing facets than ever before.
const PATIENCE: usize = 3;

/// How many points there may be for each edge that was missing at first. Attempts that end well need up to 2; those with more take tens of seconds,
/// where exact points take some (`conform`).
const MOST_FOR_EDGE: usize = 2;

/// What an edge must be shorter than the one it replaces by, so that rounding has no say.
const LESS: f64 = 1.0 - 1e-6;

/// How many generations an attempt may have, those with helping points counted: three or four is usual, twisted prisms need up to twenty.
const MOST_GENERATIONS: usize = 40;

/// Of more missing edges and facets only an eighth counts: where so many are missing most come back by themselves, or none does.
const MANY: usize = 2000;

/// How often helping points are tried where a recovery is stuck.
const HELPS: u32 = 3;

/// When an edge inside a triangle gives way to the other diagonal of the two facets beside it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Turn {
    Anyway,
    IfThere,
    IfThereOrShorter,
}

/// Counts of what the recovery met and did.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Counts {
    pub missing_edges: usize,
    pub missing_faces: usize,
    pub steiner: usize,
}

/// The state of a recovery.
pub(super) struct Recovery<'a> {
    pub(super) mesh: &'a mut Tetrahedra,
    pub(super) constraints: &'a mut Constraints,
    /// Steiner points on the surface, in the order in which they were added.
    pub steiner: Vec<u32>,
    /// Helping points off the surface.
    pub helping: Vec<u32>,
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
        let flips = Flips::new(mesh.points.len() as u32);
        Self {
            mesh,
            constraints,
            steiner: Vec::new(),
            helping: Vec::new(),
            counts: Counts::default(),
            flips,
            cavity: Cavity::default(),
            star: Vec::new(),
            found: Vec::new(),
            most_steiner: 0,
            help_left: 0,
            attempt,
        }
    }

    /// Recovers all facets, or returns those that it cannot.
    pub fn run(&mut self) -> Result<(), Vec<u32>> {
        self.recover()?;
        if !self.steiner.is_empty() {
            self.remove_flat_tets();
        }
        Ok(())
    }

    fn recover(&mut self) -> Result<(), Vec<u32>> {
        let mut missing = self.missing_facets();
        self.counts.missing_faces = missing.len();
        if missing.is_empty() {
            return Ok(());
        }
        let (mut helps, mut generation) = (0, 0);
        let (mut fewest, mut in_vain) = (usize::MAX, 0);
        for round in 0..MOST_GENERATIONS {
            let before = self.steiner.len();
            if round > 0 {
                let share = (generation * EIGHTHS).max(missing.len() * EIGHTHS_OF_MISSING) / 8;
                self.most_steiner = before + LEAST_STEINER + share;
                self.give_help(missing.len().min(MANY) / 2);
            }
            self.recover_edges(&missing, round == 0);
            if self.turn_missing_edges() {
                missing = self.missing_facets();
            }
            if self.steiner.len() < self.most_steiner {
                self.recover_facets(&missing);
            }
            missing = self.missing_facets();
            if missing.is_empty() {
                return Ok(());
            }
            generation = self.steiner.len() - before;
            in_vain = if missing.len() < fewest { 0 } else { in_vain + 1 };
            fewest = fewest.min(missing.len());
            if in_vain == PATIENCE
                || self.steiner.len() > LEAST_STEINER + MOST_FOR_EDGE * self.counts.missing_edges
            {
                break;
            }
            if generation == 0 {
                let few = missing.len() <= LEAST_STEINER + self.counts.missing_faces / 4;
                if helps == HELPS || !few || !self.add_helping_points(&missing, helps) {
                    break;
                }
                helps += 1;
            }
        }
        Err(missing)
    }

    /// Makes facets faces of the mesh, with Steiner points where flips fail.
    fn recover_facets(&mut self, facets: &[u32]) {
        let mut left: Vec<u32> = facets.iter().copied().filter(|&f| !self.recover_facet(f, 0)).collect();
        // The neighbourhood has changed: what failed at first may work now.
        for depth in 1..=DEEPEST {
            left.retain(|&f| !self.recover_facet(f, depth));
        }
        left.retain(|&f| !self.split_facet(f));
    }

    /// Locks those facets that are faces of the mesh.
    pub(super) fn lock_present_facets(&mut self) {
        lock_present(self.mesh, self.constraints);
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
        if self.attempt > 0 {
            missing.sort_by_key(|&f| mix(mix(u64::from(self.attempt)) ^ u64::from(f)));
        }
        missing
    }

    /// Makes the edges of these facets edges of the mesh, with Steiner points where flips fail.
    fn recover_edges(&mut self, facets: &[u32], count: bool) {
        let mut wanted: Vec<[u32; 2]> =
            facets.iter().flat_map(|&f| edges(self.constraints.facets[f as usize].vertices)).collect();
        wanted.sort_unstable();
        wanted.dedup();
        if self.attempt > 0 {
            wanted.sort_by_key(|&[a, b]| mix(mix(u64::from(self.attempt ^ a)) ^ u64::from(b)));
        }
        wanted.retain(|&[a, b]| self.mesh.tet_at_edge(a, b, &mut self.star).is_none());
        if count {
            self.counts.missing_edges = wanted.len();
            // Each Steiner point brings an end nearer, but rounding may spoil that.
            let missing = wanted.len() + self.counts.missing_faces;
            let missing = missing.min(MANY) + missing.saturating_sub(MANY) / 8;
            self.give_help(20 + missing / 2);
            self.most_steiner = LEAST_STEINER + missing * FIRST_EIGHTHS / 8;
        }
        wanted.retain(|&[a, b]| !self.recover_edge(a, b, 0));
        for depth in 1..=DEEPEST {
            wanted.retain(|&[a, b]| !self.recover_edge(a, b, depth));
        }
        for edge in wanted.into_iter().rev() {
            if self.steiner.len() >= self.most_steiner {
                return;
            }
            self.split_until_there(edge);
        }
    }

    /// Puts Steiner points on a missing edge until its pieces are there.
    fn split_until_there(&mut self, edge: [u32; 2]) {
        let inside = self.constraints.edge_of(edge[0], edge[1]).is_none();
        let most = if inside { MOST_INSIDE } else { MOST_ON_EDGE };
        let most = self.most_steiner.min(self.steiner.len() + most);
        let mut pieces = vec![edge];
        while let Some([a, b]) = pieces.pop() {
            let is_there = !self.constraints.has_edge(a, b) || self.recover_edge(a, b, DEEPEST);
            if is_there || self.turn_edge(a, b, Turn::IfThere).is_some() {
                continue;
            }
            if self.steiner.len() >= most {
                return;
            }
            match self.split_edge(a, b) {
                Some(p) => pieces.extend([[a, p], [p, b]]),
                None => drop(self.turn_edge(a, b, Turn::Anyway)),
            }
        }
    }

    /// Replaces an edge between two facets of one triangle by the other diagonal of the two, which is returned. Which diagonals
    /// facets of one triangle have is free, and where the edge cannot be had or split the other one may.
    fn turn_edge(&mut self, a: u32, b: u32, turn: Turn) -> Option<[u32; 2]> {
        let at = self.constraints.facets_at_edge(a, b);
        let [one, other] = at[..] else { return None };
        let [one, other] = [one, other].map(|f| self.constraints.facets[f as usize]);
        if one.triangle != other.triangle {
            return None;
        }
        let apex = |f: Facet| f.vertices.into_iter().find(|v| ![a, b].contains(v)).expect("a third corner");
        let (c, d) = (apex(one), apex(other));
        let length = |a, b| (self.mesh.point(a) - self.mesh.point(b)).norm();
        let is_wanted = turn == Turn::Anyway
            || (turn == Turn::IfThereOrShorter && length(c, d) < LESS * length(a, b))
            || self.mesh.tet_at_edge(c, d, &mut self.star).is_some();
        if !is_wanted {
            return None;
        }
        // In the first facet `b` becomes `d`, in the other one `a` becomes `c`.
        let turned = [(one, b, d), (other, a, c)]
            .map(|(f, from, to)| f.vertices.map(|v| if v == from { to } else { v }));
        // The first facets are the triangles of the surface.
        let triangle = self.constraints.facets[one.triangle as usize].vertices;
        let shadow = Shadow::of(triangle.map(|v| self.mesh.point(v)));
        let is_turned_over = |face: &[u32; 3]| {
            self.constraints.on_one_edge(*face) || !shadow.is_left(face.map(|v| self.mesh.point(v)))
        };
        if turned.iter().any(is_turned_over) {
            return None;
        }
        for f in at {
            self.constraints.remove(f);
        }
        for vertices in turned {
            self.constraints.add(vertices, one.triangle);
        }
        Some([c, d])
    }

    /// Turns missing edges inside triangles whose other diagonal is there or is shorter: the fewer edges are missing the fewer points the next
    /// generation needs. Whether any was turned.
    fn turn_missing_edges(&mut self) -> bool {
        let mut sides: Vec<(u32, [u32; 2])> = self
            .constraints
            .alive()
            .map(|f| self.constraints.facets[f as usize])
            .filter(|f| f.vertices != self.constraints.facets[f.triangle as usize].vertices)
            .flat_map(|f| edges(f.vertices).map(|edge| (f.triangle, edge)))
            .collect();
        sides.sort_unstable();
        let inside = sides.windows(2).filter(|pair| pair[0] == pair[1]).map(|pair| pair[0].1);
        let mut inside: Vec<[u32; 2]> = inside.collect();
        let mut any = false;
        // Each turn leaves fewer missing edges or shorter ones.
        loop {
            let mut turned = false;
            for edge in &mut inside {
                if self.mesh.tet_at_edge(edge[0], edge[1], &mut self.star).is_none()
                    && let Some(other) = self.turn_edge(edge[0], edge[1], Turn::IfThereOrShorter)
                {
                    *edge = other;
                    turned = true;
                }
            }
            if !turned {
                return any;
            }
            any = true;
        }
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

    /// Makes a facet a face of the mesh by flips alone; its edges may still be missing.
    pub(super) fn recover_facet(&mut self, f: u32, depth: u32) -> bool {
        let facet = self.constraints.facets[f as usize];
        if facet.gone {
            return true;
        }
        self.take_help();
        for _ in 0..ROUNDS {
            let Some(edges) = self.obstacles(f) else {
                return self.mesh.find_face(facet.vertices, &mut self.star).is_some();
            };
            // Ends of piercing edges are never corners of the facet: no chord is wanted.
            let [a, _, c] = facet.vertices;
            let flipped = edges.iter().any(|&(tet, edge)| self.remove_edge(tet, edge, [a, c], depth));
            if !flipped {
                return false;
            }
        }
        false
    }

    /// The edges that pierce a facet; `None` where it is there, or an edge of it is missing, or the rounding of
    /// Steiner points makes it meet another part of the surface.
    pub(super) fn obstacles(&mut self, f: u32) -> Option<Vec<(u32, [u32; 2])>> {
        let vertices = self.constraints.facets[f as usize].vertices;
        if self.mesh.find_face(vertices, &mut self.star).is_some() {
            return None;
        }
        for [a, b] in edges(vertices) {
            self.mesh.tet_at_edge(a, b, &mut self.star)?;
        }
        match piercing(self.mesh, vertices, &mut self.star) {
            Piercing::Vertex => None,
            Piercing::Edges(edges) => {
                let kept = edges.iter().any(|&(_, [u, v])| self.constraints.has_edge(u, v));
                (!kept).then_some(edges)
            }
        }
    }
}

/// Locks the faces that are facets; all of them must be there.
pub(super) fn lock_facets(mesh: &mut Tetrahedra, constraints: &Constraints) {
    let locked = lock_present(mesh, constraints);
    assert_eq!(locked, constraints.alive().count(), "a facet is no face of the mesh");
}

/// Locks the faces that are facets; returns how many.
fn lock_present(mesh: &mut Tetrahedra, constraints: &Constraints) -> usize {
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
    locked
}
