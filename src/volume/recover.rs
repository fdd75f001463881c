//! Boundary recovery: every triangle of the surface becomes a face of the mesh.
//!
//! Edges first, then faces. Flips do nearly all of it: what crosses a missing edge or pierces a missing face
//! is flipped away (George, Hecht, Saltel 1991; with edge removal as in Shewchuk 2002). Where no flip is left,
//! a **Steiner point** is put where the missing edge crosses the mesh, or where an edge of the mesh pierces the missing
//! face: splitting there is always possible and brings the end nearer (George, Borouchaki, Saltel 2003,
//! section 4). These points lie on the surface for the time being; `relocate` takes them off it again.

use super::cavity::Cavity;
use super::constraints::{Constraints, edges};
use super::crossing::{Crossing, Piercing, crossings, piercing, tets_around};
use super::flips::Flips;
use super::tetrahedra::{NO_BODY, NONE, Tetrahedra, sorted};
use crate::Point;
use crate::kernel::predicates::{Sign, orient3d};
use crate::kernel::random::mix;
use crate::kernel::simplex::volume6;

/// How often flips may change what a missing edge or face meets before it is set aside. Of the
/// real surfaces tried, an edge that succeeds at all does so within 12.
const ROUNDS: usize = 40;

/// How deep helping flips go, see [`Flips::remove_edge_with_help`].
const DEEPEST: u32 = 2;

/// Where two parts of the surface meet that must not.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Intersection {
    /// A facet, or one with the edge that is in the way.
    pub facet: u32,
    /// The facet, edge end or vertex that it meets.
    pub place: Point,
}

/// What is left undone.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Unrecovered {
    pub facets: Vec<u32>,
    pub intersections: Vec<Intersection>,
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
    mesh: &'a mut Tetrahedra,
    constraints: &'a mut Constraints,
    /// Steiner points on the surface, in the order in which they were added.
    pub steiner: Vec<u32>,
    pub counts: Counts,
    flips: Flips,
    cavity: Cavity,
    star: Vec<u32>,
    found: Vec<Crossing>,
    intersections: Vec<Intersection>,
    most_steiner: usize,
    attempt: u64,
}

impl<'a> Recovery<'a> {
    /// A recovery that gives up beyond `most_steiner` Steiner points. Each `attempt` takes edges and facets in another
    /// order: one may end where another does not.
    pub fn new(
        mesh: &'a mut Tetrahedra,
        constraints: &'a mut Constraints,
        most_steiner: usize,
        attempt: u64,
    ) -> Self {
        Self {
            mesh,
            constraints,
            steiner: Vec::new(),
            counts: Counts::default(),
            flips: Flips::default(),
            cavity: Cavity::default(),
            star: Vec::new(),
            found: Vec::new(),
            intersections: Vec::new(),
            most_steiner,
            attempt,
        }
    }

    /// Recovers all facets. What it cannot is listed with the intersections of the surface that were met.
    pub fn run(&mut self) -> Result<(), Unrecovered> {
        let mut missing = self.missing_facets();
        self.counts.missing_faces = missing.len();
        let mut first = true;
        while !missing.is_empty() {
            let before = self.steiner.len();
            self.recover_edges(&missing, first);
            first = false;
            let intersects = !self.intersections.is_empty();
            let mut left: Vec<u32> = missing.iter().copied().filter(|&f| !self.recover_facet(f, 0)).collect();
            if !intersects && self.intersections.is_empty() {
                // The neighbourhood has changed: what failed at first may work now.
                for depth in 1..=DEEPEST {
                    left.retain(|&f| !self.recover_facet(f, depth));
                }
                left.retain(|&f| !self.split_facet(f));
            }
            missing = self.missing_facets();
            let progress = self.steiner.len() > before;
            if !missing.is_empty() && (!progress || !self.intersections.is_empty()) {
                let intersections = std::mem::take(&mut self.intersections);
                return Err(Unrecovered { facets: missing, intersections });
            }
        }
        Ok(())
    }

    /// The facets that are no faces of the mesh, by one pass over it.
    fn missing_facets(&self) -> Vec<u32> {
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
            missing.sort_by_key(|&f| mix(mix(self.attempt) ^ u64::from(f)));
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
            wanted.sort_by_key(|&[a, b]| mix(mix(self.attempt ^ u64::from(a)) ^ u64::from(b)));
        }
        wanted.retain(|&[a, b]| self.mesh.tet_at_edge(a, b, &mut self.star).is_none());
        if count {
            self.counts.missing_edges = wanted.len();
        }
        wanted.retain(|&[a, b]| !self.recover_edge(a, b, 0));
        if !self.intersections.is_empty() {
            return;
        }
        for depth in 1..=DEEPEST {
            wanted.retain(|&[a, b]| !self.recover_edge(a, b, depth));
        }
        while let Some([a, b]) = wanted.pop() {
            if self.recover_edge(a, b, DEEPEST) || self.steiner.len() >= self.most_steiner {
                continue;
            }
            if let Some(p) = self.split_edge(a, b) {
                wanted.extend([[a, p], [p, b]]);
            }
        }
    }

    /// Makes a, b an edge of the mesh by flips alone.
    fn recover_edge(&mut self, a: u32, b: u32, depth: u32) -> bool {
        let mut found = std::mem::take(&mut self.found);
        let mut stuck = 0;
        let mut done = false;
        for round in 0..ROUNDS {
            // From either end in turn: the flips at the end change most.
            let (from, to) = if round % 2 == 0 { (a, b) } else { (b, a) };
            crossings(self.mesh, from, to, &mut self.star, &mut found);
            done = found.is_empty();
            if done || self.note_intersection([a, b], &found) {
                break;
            }
            stuck = if self.clear_one(from, to, depth, &mut found) { 0 } else { stuck + 1 };
            if stuck == 2 {
                break;
            }
        }
        self.found = found;
        done
    }

    /// Flips something of what the edge from `a` to `b` crosses.
    fn clear_one(&mut self, a: u32, b: u32, depth: u32, found: &mut Vec<Crossing>) -> bool {
        let mut next = 0;
        while let Some(&crossing) = found.get(next) {
            if self.clear_crossing(a, b, crossing, depth) {
                return true;
            }
            next += 1;
            if depth > 0 {
                // Helping flips may have changed the mesh in vain.
                crossings(self.mesh, a, b, &mut self.star, found);
            }
        }
        found.is_empty()
    }

    /// Notes where an edge of the surface meets another part of it.
    fn note_intersection(&mut self, [a, b]: [u32; 2], found: &[Crossing]) -> bool {
        for &crossing in found {
            let meets = match crossing {
                Crossing::Face(half_face) => {
                    self.constraints.facet(self.mesh.face(half_face)).map(|_| self.mesh.face(half_face)[0])
                }
                Crossing::Edge(_, [u, v]) => self.constraints.has_edge(u, v).then_some(u),
                Crossing::Vertex(v) => Some(v),
            };
            if meets.is_some() {
                let place = self.crossing_point(a, b, crossing);
                let facet = self.facet_with_edge(a, b);
                self.intersections.push(Intersection { facet, place });
                return true;
            }
        }
        false
    }

    fn facet_with_edge(&self, a: u32, b: u32) -> u32 {
        let has = |f: &u32| {
            let vertices = self.constraints.facets[*f as usize].vertices;
            vertices.contains(&a) && vertices.contains(&b)
        };
        self.constraints.alive().find(has).unwrap_or_else(|| panic!("edge {a} {b} has no facet"))
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
    fn remove_edge(&mut self, tet: u32, edge: [u32; 2], wanted: [u32; 2], depth: u32) -> bool {
        let still = self.mesh.is_alive(tet) && edge.iter().all(|v| self.mesh.tets[tet as usize].contains(v));
        let tet = if still { Some(tet) } else { self.mesh.tet_at_edge(edge[0], edge[1], &mut self.star) };
        tet.is_some_and(|tet| {
            self.flips.remove_edge_with_help(self.mesh, self.constraints, tet, edge, wanted, depth).is_ok()
        })
    }

    /// The point of the edge a, b at a crossing, rounded.
    fn crossing_point(&self, a: u32, b: u32, crossing: Crossing) -> Point {
        let [p, q] = [a, b].map(|v| *self.mesh.point(v));
        let fraction = match crossing {
            Crossing::Face(half_face) => {
                let [x, y, z] = self.mesh.face(half_face).map(|v| self.mesh.point(v));
                let (below, above) = (volume6(x, y, z, &p), volume6(x, y, z, &q));
                below / (below - above)
            }
            Crossing::Edge(_, [u, v]) => {
                // Where the plane through u, v and across both edges cuts a, b.
                let [u, v] = [u, v].map(|v| *self.mesh.point(v));
                let normal = (v - u).cross(&(v - u).cross(&(q - p)));
                (u - p).dot(&normal) / (q - p).dot(&normal)
            }
            Crossing::Vertex(v) => (self.mesh.point(v) - p).norm() / (q - p).norm(),
        };
        p + (q - p) * fraction.clamp(0.0, 1.0)
    }

    /// Puts a Steiner point on a missing edge where it crosses the mesh, the crossing in the middle first.
    fn split_edge(&mut self, a: u32, b: u32) -> Option<u32> {
        let mut found = std::mem::take(&mut self.found);
        crossings(self.mesh, a, b, &mut self.star, &mut found);
        let mut order: Vec<usize> = (0..found.len()).collect();
        order.sort_by_key(|&i| (2 * i + 1).abs_diff(found.len()));
        let added = order.into_iter().find_map(|i| {
            let point = self.crossing_point(a, b, found[i]);
            let tets = tets_around(self.mesh, found[i]);
            self.add_steiner(&tets, point)
        });
        self.found = found;
        let p = added?;
        let split: Vec<u32> = self
            .constraints
            .facets_at(a)
            .into_iter()
            .filter(|&f| self.constraints.facets[f as usize].vertices.contains(&b))
            .collect();
        for f in split {
            let facet = self.constraints.facets[f as usize];
            self.constraints.remove(f);
            for end in [a, b] {
                let half = facet.vertices.map(|v| if v == end { p } else { v });
                self.constraints.add(half, facet.triangle);
            }
        }
        Some(p)
    }

    /// Stars tets from a new point. Tets behind faces that do not see it are taken in first: near slivers the
    /// point may be, by rounding, on the wrong side of some.
    fn add_steiner(&mut self, tets: &[u32], point: Point) -> Option<u32> {
        /// More than a split of an edge with its usual ring needs, by far.
        const MOST_TETS: usize = 64;
        let mut tets = tets.to_vec();
        if tets.is_empty() || self.steiner.len() >= self.most_steiner {
            return None;
        }
        loop {
            self.cavity.take(self.mesh, &tets);
            if self.cavity.make_star_shaped(self.mesh, tets[0], &point)
                && self.cavity.tets.len() == tets.len()
            {
                break;
            }
            let grown = self.behind_unseen(&tets, &point)?;
            tets.extend(grown);
            if tets.len() > MOST_TETS {
                return None;
            }
        }
        if !self.keeps_edges(&tets) {
            return None;
        }
        let p = self.mesh.add_point(point);
        self.cavity.fill(self.mesh, p, NO_BODY);
        self.steiner.push(p);
        self.counts.steiner += 1;
        Some(p)
    }

    /// The tets behind those faces around `tets` that do not see a point; `None` if there are none, or one of the
    /// faces must stay.
    fn behind_unseen(&self, tets: &[u32], point: &Point) -> Option<Vec<u32>> {
        let mut behind = Vec::new();
        for half_face in tets.iter().flat_map(|&t| 4 * t..4 * t + 4) {
            let other = self.mesh.across(half_face);
            let [a, b, c] = self.mesh.face(half_face).map(|v| self.mesh.point(v));
            if (other != NONE && tets.contains(&(other >> 2))) || orient3d(a, b, c, point) == Sign::Negative {
                continue;
            }
            if other == NONE || self.constraints.facet(self.mesh.face(half_face)).is_some() {
                return None;
            }
            behind.push(other >> 2);
        }
        behind.sort_unstable();
        behind.dedup();
        (!behind.is_empty()).then_some(behind)
    }

    /// Whether the facets and their edges among some tets are all on the surface of the cavity they make.
    fn keeps_edges(&self, tets: &[u32]) -> bool {
        let outer = |h: &u32| {
            let other = self.mesh.across(*h);
            other == NONE || !tets.contains(&(other >> 2))
        };
        let half_faces = || tets.iter().flat_map(|&t| 4 * t..4 * t + 4);
        let kept: Vec<[u32; 2]> = half_faces().filter(outer).flat_map(|h| edges(self.mesh.face(h))).collect();
        half_faces().filter(|h| !outer(h)).all(|h| {
            let face = self.mesh.face(h);
            self.constraints.facet(face).is_none()
                && edges(face).iter().all(|e| !self.constraints.has_edge(e[0], e[1]) || kept.contains(e))
        })
    }

    /// Makes a facet a face of the mesh by flips alone; its edges may still be missing.
    fn recover_facet(&mut self, f: u32, depth: u32) -> bool {
        let facet = self.constraints.facets[f as usize];
        if facet.gone {
            return true;
        }
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

    /// The edges that pierce a facet; `None` where it is there, or an edge of it is missing, or it
    /// meets another part of the surface (which is noted).
    fn obstacles(&mut self, f: u32) -> Option<Vec<(u32, [u32; 2])>> {
        let vertices = self.constraints.facets[f as usize].vertices;
        if self.mesh.find_face(vertices, &mut self.star).is_some() {
            return None;
        }
        for [a, b] in edges(vertices) {
            self.mesh.tet_at_edge(a, b, &mut self.star)?;
        }
        match piercing(self.mesh, vertices, &mut self.star) {
            Piercing::Vertex(v) => {
                self.intersections.push(Intersection { facet: f, place: *self.mesh.point(v) });
                None
            }
            Piercing::Edges(edges) => {
                for &(_, [u, v]) in &edges {
                    if self.constraints.has_edge(u, v) {
                        let place = self.piercing_point(vertices, [u, v]);
                        self.intersections.push(Intersection { facet: f, place });
                        return None;
                    }
                }
                Some(edges)
            }
        }
    }

    /// Where an edge pierces a face, rounded.
    fn piercing_point(&self, face: [u32; 3], [u, v]: [u32; 2]) -> Point {
        let [x, y, z] = face.map(|v| self.mesh.point(v));
        let [p, q] = [u, v].map(|v| self.mesh.point(v));
        let (below, above) = (volume6(x, y, z, p), volume6(x, y, z, q));
        p + (q - p) * (below / (below - above)).clamp(0.0, 1.0)
    }

    /// Puts a Steiner point on a missing facet where an edge pierces it. True where nothing is left to do now.
    fn split_facet(&mut self, f: u32) -> bool {
        if self.recover_facet(f, DEEPEST) {
            return true;
        }
        let Some(edges) = self.obstacles(f) else { return false };
        let facet = self.constraints.facets[f as usize];
        for (tet, edge) in edges {
            let point = self.piercing_point(facet.vertices, edge);
            let tets = tets_around(self.mesh, Crossing::Edge(tet, edge));
            if let Some(p) = self.add_steiner(&tets, point) {
                self.constraints.remove(f);
                let [a, b, c] = facet.vertices;
                for part in [[a, b, p], [b, c, p], [c, a, p]] {
                    self.constraints.add(part, facet.triangle);
                }
                return true;
            }
        }
        false
    }
}

/// Locks the faces that are facets; all of them must be there.
pub(super) fn lock_facets(mesh: &mut Tetrahedra, constraints: &Constraints) {
    let mut locked = 0;
    for t in 0..mesh.tets.len() as u32 {
        if !mesh.is_alive(t) {
            continue;
        }
        for half_face in 4 * t..4 * t + 4 {
            let face = mesh.face(half_face);
            if half_face < mesh.across(half_face) && constraints.facet(sorted(face)).is_some() {
                mesh.lock(half_face);
                locked += 1;
            }
        }
    }
    assert_eq!(locked, constraints.alive().count(), "a facet is no face of the mesh");
}
