//! Boundary recovery: makes every triangle of the surface a union of mesh faces.
//!
//! Flips (`recover`) recover nearly all triangles. The rest is recovered by Steiner points on the
//! surface:
//!
//! - A missing edge is split where it crosses the mesh, by points exactly on it (`steiner`). Each
//!   split removes one crossing and adds none, and existing edges stay.
//! - When all edges exist, mesh edges that pierce a missing triangle are removed by flips or, if
//!   flips stall, split at the triangle. The halves of a split edge and the edges from the new
//!   point to its ring lie on one side of the triangle, so the number of piercing edges decreases
//!   by one. When none is left, the triangle is a union of mesh faces, whichever these are.
//!
//! This is the first half of George, Borouchaki, Saltel (2003), without a prescribed subdivision of
//! the triangles. All predicates are exact, so it terminates; the number of points is bounded to
//! limit the time.
//!
//! Each inserted point replaces the crossed tets that are visible from it. A point is deleted again
//! if a neighbour on the edge sees its whole star; fewer points mean fewer crossings for the next
//! edge. The points that stay are moved off the surface later (`relocate`).

use super::constraints::{Facet, edges};
use super::crossing::{Crossing, crossings, edges_of_tet, tets_around};
use super::flips::FLAT;
use super::recover::{DEEPEST, Recovery};
use super::steiner::middle_first;
use crate::ground::kernel::predicates::Sign;
use crate::ground::kernel::simplex::ascending;
use crate::mesher::half_face::{NONE, Ring};
use std::collections::btree_map::Entry;
use std::collections::{BTreeMap, BTreeSet};

/// The most Steiner points on a surface, which bounds the time until failure. Blocks with 35
/// crossing notches need 3400.
const MOST_POINTS: usize = 15_000;

/// How often recovery of the missing triangles is repeated.
const ROUNDS: u32 = 10;

/// The round in which flips may make flat tets; rounds after it split edges that pierce triangles.
const FLAT_ROUND: u32 = DEEPEST + 1;

/// The most passes that remove points from edges. Each pass may enable others, but hardly any after
/// the second.
const UNSPLIT_PASSES: usize = 4;

/// Rounds of flips without progress on one triangle before its piercing edges are split: a flip may
/// create new piercing edges.
const FLIPS: usize = 10;

/// How often flips and single splits alternate in one triangle before all its piercing edges are
/// split.
const MOST_STALLS: usize = 10;

/// The most flip attempts in one triangle before splitting, per piercing edge found first.
const MOST_TRIES: usize = 30;

/// Flip attempts allowed in addition to those.
const LEAST_TRIES: usize = 100;

/// The budget of auxiliary flips, in edges and facets.
const BUDGET_EDGES: usize = 1000;

/// The state of splitting: missing edges and the Steiner points on edges and triangles.
#[derive(Clone, Debug, Default)]
struct Cut {
    /// Missing segments of surface edges, each after its edge.
    missing: Vec<([u32; 2], [u32; 2])>,
    /// The Steiner points on each surface edge.
    on_edge: BTreeMap<[u32; 2], Vec<u32>>,
    /// Number of attempts to flip an edge away.
    tries: usize,
    /// The Steiner points inside each triangle.
    inside: BTreeMap<u32, Vec<u32>>,
}

impl Recovery<'_> {
    /// Recovers all facets.
    ///
    /// # Errors
    /// The facets that could not be recovered.
    pub fn conform(&mut self) -> Result<(), Vec<u32>> {
        let missing = self.missing_facets();
        self.counts.missing_faces = missing.len();
        self.most_steiner = if self.mesh.fits_exact() { MOST_POINTS } else { 0 };
        self.raise_budget(BUDGET_EDGES);
        let sides = |f: &u32| edges(self.constraints.facets[*f as usize].vertices);
        let mut wanted: Vec<[u32; 2]> = missing.iter().flat_map(sides).collect();
        wanted.sort_unstable();
        wanted.dedup();
        self.shuffle(&mut wanted, |&[a, b]| u64::from(a) << 32 | u64::from(b));
        for &[a, b] in &wanted {
            self.constraints.keep_edge(a, b);
        }
        for &f in &missing {
            self.constraints.remove(f);
        }
        wanted.retain(|&[a, b]| self.mesh.tet_at_edge(a, b, &mut self.star).is_none());
        self.counts.missing_edges = wanted.len();
        let mut cut = Cut::default();
        cut.missing.extend(wanted.into_iter().map(|edge| (edge, edge)));
        for least in [FLAT, 0.0] {
            self.flips.least = least;
            for depth in 0..=DEEPEST {
                cut.missing.retain(|&(_, [a, b])| !self.recover_edge(a, b, depth));
            }
        }
        self.flips.least = FLAT;
        self.split_edges(DEEPEST, &mut cut);
        self.unsplit_edges(&mut cut);
        let left = self.recover_triangles(missing, &mut cut);
        for [a, b] in self.constraints.kept_edges() {
            self.constraints.forget_edge(a, b);
        }
        if left.is_empty() { Ok(()) } else { Err(left) }
    }

    /// Splits missing edges until their segments exist; failures stay in `cut.missing`.
    fn split_edges(&mut self, depth: u32, cut: &mut Cut) {
        for (edge, piece) in std::mem::take(&mut cut.missing) {
            let mut pieces = vec![piece];
            while let Some([a, b]) = pieces.pop() {
                if self.recover_edge(a, b, depth) {
                    continue;
                }
                match self.split_edge(edge, [a, b]) {
                    Some(p) => {
                        cut.on_edge.entry(edge).or_default().push(p);
                        pieces.extend([[a, p], [p, b]]);
                    }
                    None => cut.missing.push((edge, [a, b])),
                }
            }
            if cut.missing.last().is_none_or(|last| last.0 != edge) {
                self.unsplit_edge(edge, cut);
            }
        }
    }

    /// The Steiner points on a surface edge, ordered from `from` to `to`.
    fn points_on(&self, [from, to]: [u32; 2], cut: &Cut) -> Vec<u32> {
        let along = self.mesh.point(to) - self.mesh.point(from);
        let axis = along.iamax();
        let mut points = cut.on_edge.get(&[from.min(to), from.max(to)]).cloned().unwrap_or_default();
        points.sort_by_cached_key(|&v| self.mesh.place(v).key(axis));
        if along[axis] < 0.0 {
            points.reverse();
        }
        points
    }

    /// Removes Steiner points from complete surface edges until nothing changes, in at most
    /// [`UNSPLIT_PASSES`] passes.
    fn unsplit_edges(&mut self, cut: &mut Cut) {
        let whole = |edge: &[u32; 2]| cut.missing.iter().all(|(missing, _)| missing != edge);
        let edges: Vec<[u32; 2]> = cut.on_edge.keys().copied().filter(whole).collect();
        for _ in 0..UNSPLIT_PASSES {
            if edges.iter().map(|&edge| self.unsplit_edge(edge, cut)).sum::<usize>() == 0 {
                break;
            }
        }
    }

    /// Removes the Steiner points of one surface edge that are no longer needed; returns their
    /// number.
    fn unsplit_edge(&mut self, edge: [u32; 2], cut: &mut Cut) -> usize {
        let points = self.points_on(edge, cut);
        let mut left = vec![edge[0]];
        for (i, &p) in points.iter().enumerate() {
            let u = *left.last().expect("an end");
            let w = points.get(i + 1).copied().unwrap_or(edge[1]);
            if !self.merge_pieces(u, p, w) {
                left.push(p);
            }
        }
        left.remove(0);
        let gone = points.len() - left.len();
        cut.on_edge.insert(edge, left);
        gone
    }

    /// Deletes point p between segments (u, p) and (p, w) if u or w sees the whole star of p; false
    /// if not.
    fn merge_pieces(&mut self, u: u32, p: u32, w: u32) -> bool {
        self.mesh.star(p, &mut self.star);
        let skin: Vec<[u32; 3]> = self
            .star
            .iter()
            .map(|&t| self.mesh.face(4 * t + self.mesh.index_of(t, p).expect("a tet at p") as u32))
            .collect();
        let sees = |v: &u32| {
            skin.iter().filter(|f| !f.contains(v)).all(|&f| self.mesh.side(f, *v) == Sign::Negative)
        };
        let Some(apex) = [u, w].into_iter().find(sees) else { return false };
        let tets: Vec<[u32; 4]> =
            skin.iter().filter(|f| !f.contains(&apex)).map(|&[a, b, c]| [apex, a, b, c]).collect();
        let star = std::mem::take(&mut self.star);
        let body = self.mesh.bodies[star[0] as usize];
        self.mesh.replace(&star, &tets, body, &mut self.flips.made);
        self.star = star;
        self.mesh.at_vertex[p as usize] = NONE;
        self.constraints.forget_edge(u, p);
        self.constraints.forget_edge(p, w);
        self.constraints.keep_edge(u, w);
        self.constraints.forget_place(p);
        self.steiner.retain(|&q| q != p);
        true
    }

    /// Splits a segment of a surface edge where it crosses the mesh; returns the new vertex.
    fn split_edge(&mut self, edge: [u32; 2], [a, b]: [u32; 2]) -> Option<u32> {
        let mut found = std::mem::take(&mut self.found);
        crossings(self.mesh, a, b, &mut self.star, &mut found);
        let added =
            middle_first(&found).find_map(|crossing| self.split_exactly(edge, [a, b], crossing, &found));
        self.found = found;
        let p = added?;
        self.constraints.forget_edge(a, b);
        self.constraints.keep_edge(a, p);
        self.constraints.keep_edge(p, b);
        Some(p)
    }

    /// Makes triangles unions of mesh faces; returns those that failed.
    fn recover_triangles(&mut self, triangles: Vec<u32>, cut: &mut Cut) -> Vec<u32> {
        let mut left = triangles;
        for round in 0..ROUNDS {
            let before = left.len();
            self.split_edges(DEEPEST, cut);
            self.flips.least = if round == FLAT_ROUND { 0.0 } else { FLAT };
            let split = round > FLAT_ROUND;
            left.retain(|&t| !self.recover_triangle(t, round.min(DEEPEST), split, cut));
            if left.is_empty() || (split && left.len() == before && self.steiner.len() >= self.most_steiner) {
                break;
            }
        }
        left
    }

    /// Makes a triangle a union of mesh faces, by flips of this depth and, if `split`, by Steiner
    /// points; false if that fails.
    fn recover_triangle(&mut self, t: u32, depth: u32, split: bool, cut: &mut Cut) -> bool {
        let vertices = self.constraints.facets[t as usize].vertices;
        let Some(outline) = self.outline(vertices, cut) else { return false };
        let mut on: BTreeSet<u32> = outline.iter().map(|side| side.0[0]).collect();
        on.extend(cut.inside.get(&t).into_iter().flatten());
        let facet = Facet { vertices, triangle: t, gone: false };
        let (mut fewest, mut failures, mut stalls, mut most) = (usize::MAX, 0, 0, 0);
        let faces = loop {
            let Some(trace) = self.trace_triangle(vertices, &outline, &on) else { return false };
            if trace.through.is_empty() {
                break trace.faces;
            }
            if fewest == usize::MAX {
                most = cut.tries + LEAST_TRIES + MOST_TRIES * trace.through.len();
            }
            failures = if trace.through.len() < fewest { 0 } else { failures + 1 };
            fewest = fewest.min(trace.through.len());
            let flips = failures < FLIPS && stalls <= MOST_STALLS && cut.tries < most;
            if flips && self.flip_through(&trace, depth, cut) {
                continue;
            }
            if !split || !self.split_through(&trace, facet, &mut on, cut, stalls < MOST_STALLS) {
                return false;
            }
            stalls += 1;
            (fewest, failures) = (usize::MAX, 0);
        };
        for face in faces.into_values() {
            self.constraints.add(face, t);
        }
        true
    }

    /// Tries to flip away the edges that pierce a triangle; whether any flip succeeded.
    fn flip_through(&mut self, trace: &Trace, depth: u32, cut: &mut Cut) -> bool {
        cut.tries += trace.through.len();
        let mut any = false;
        for &(tet, edge) in &trace.through {
            self.take_budget();
            any |= self.remove_edge(tet, edge, [NONE; 2], depth);
        }
        any
    }

    /// Splits edges that pierce a triangle at the triangle, at most one if `one`; whether any was
    /// split.
    fn split_through(
        &mut self,
        trace: &Trace,
        facet: Facet,
        on: &mut BTreeSet<u32>,
        cut: &mut Cut,
        one: bool,
    ) -> bool {
        let mut any = false;
        // Failed flips may have changed the tets stored in the trace.
        let mut more = BTreeSet::new();
        for &(_, [u, v]) in &trace.through {
            if let Some(tet) = self.mesh.tet_at_edge(u, v, &mut self.star) {
                more.extend(tets_around(self.mesh, Crossing::Edge(tet, [u, v])));
            }
        }
        for &(_, [u, v]) in &trace.through {
            let Some(tet) = self.mesh.tet_at_edge(u, v, &mut self.star) else { continue };
            if let Some(p) = self.pierce_exactly(facet, tet, [u, v], &more) {
                on.insert(p);
                cut.inside.entry(facet.triangle).or_default().push(p);
                any = true;
                if one {
                    break;
                }
            }
        }
        any
    }

    /// The segments of a triangle's edges in its orientation, each with the opposite corner; `None`
    /// if one is missing.
    fn outline(&mut self, [a, b, c]: [u32; 3], cut: &Cut) -> Option<Vec<([u32; 2], u32)>> {
        let mut outline = Vec::new();
        for [from, to, opposite] in [[a, b, c], [b, c, a], [c, a, b]] {
            let mut points = self.points_on([from, to], cut);
            points.insert(0, from);
            points.push(to);
            outline.extend(points.windows(2).map(|piece| ([piece[0], piece[1]], opposite)));
        }
        let is_there = |&([u, v], _): &([u32; 2], u32)| self.mesh.tet_at_edge(u, v, &mut self.star).is_some();
        outline.iter().all(is_there).then_some(outline)
    }

    /// Traces a triangle through the mesh, starting from its outline, whose segments must exist;
    /// `on` are the vertices on the triangle. `None` if rounding makes the trace ambiguous.
    ///
    /// All other vertices count as above or below the plane by exact sign. So the trace is a
    /// surface through the mesh, bounded by the outline, even if more vertices are coplanar with
    /// the triangle up to rounding.
    fn trace_triangle(
        &mut self,
        plane: [u32; 3],
        outline: &[([u32; 2], u32)],
        on: &BTreeSet<u32>,
    ) -> Option<Trace> {
        let mut trace = Trace::default();
        trace.seen.extend(outline.iter().map(|&([p, q], _)| [p.min(q), p.max(q)]));
        let mut ring = Ring::default();
        for &(piece, opposite) in outline {
            // The vertex added last has fewer tets, so its star is searched.
            let (p, q) = (piece[0].max(piece[1]), piece[0].min(piece[1]));
            let tet = self.mesh.tet_at_edge(p, q, &mut self.star)?;
            if !self.enter(&mut trace, &mut ring, tet, plane, (piece, opposite), on) {
                return None;
            }
        }
        let mesh = &*self.mesh;
        let above = |v: u32| mesh.side(plane, v) != Sign::Negative;
        let mut next = 0;
        loop {
            if let Some(&(tet, [u, v])) = trace.through.get(next) {
                next += 1;
                if !mesh.ring(tet, u, v, &mut ring) {
                    return None;
                }
                for &t in &ring.tets {
                    for [x, y] in edges_of_tet(mesh.tets[t as usize]) {
                        match [x, y].map(|v| on.contains(&v)) {
                            [true, true] => trace.add_side(t, [x, y]),
                            [false, false] if above(x) != above(y) => trace.add_through(t, [x, y]),
                            _ => {}
                        }
                    }
                }
            } else if let Some((tet, [x, y])) = trace.open.pop() {
                if !mesh.ring(tet, x, y, &mut ring) {
                    return None;
                }
                if trace.add_faces([x, y], &ring, on) < 2 {
                    for (t, [r, s]) in pairs(&ring) {
                        if ![r, s].iter().any(|v| on.contains(v)) && above(r) != above(s) {
                            trace.add_through(t, [r, s]);
                        }
                    }
                }
            } else {
                break;
            }
        }
        (!trace.through.is_empty() || trace.is_disc(outline)).then_some(trace)
    }

    /// Adds the faces or the piercing edge next to one segment of the outline; false if they are
    /// ambiguous.
    fn enter(
        &self,
        trace: &mut Trace,
        ring: &mut Ring,
        tet: u32,
        plane: [u32; 3],
        ([p, q], opposite): ([u32; 2], u32),
        on: &BTreeSet<u32>,
    ) -> bool {
        if !self.mesh.ring(tet, p, q, ring) {
            return false;
        }
        if trace.add_faces([p, q], ring, on) > 0 {
            return true;
        }
        // Right-handed about (p, q), the ring passes the triangle from below to above, and its
        // outside from above to below.
        let above = |v: u32| self.mesh.side(plane, v) != Sign::Negative;
        let mut into: Vec<(u32, [u32; 2])> =
            pairs(ring).filter(|&(_, [r, s])| !above(r) && above(s)).collect();
        if into.len() > 1 {
            into.retain(|&(_, [r, s])| {
                self.mesh.side([p, q, r], opposite) == Sign::Positive
                    && self.mesh.side([p, q, s], opposite) == Sign::Negative
            });
        }
        into.iter().for_each(|&(t, edge)| trace.add_through(t, edge));
        into.len() == 1
    }
}

/// The edges of a ring, each with its tet.
fn pairs(ring: &Ring) -> impl Iterator<Item = (u32, [u32; 2])> + '_ {
    let n = ring.vertices.len();
    (0..n).map(move |i| (ring.tets[i], [ring.vertices[i], ring.vertices[(i + 1) % n]]))
}

/// The faces in a triangle and the mesh edges that pierce it.
#[derive(Clone, Debug, Default)]
struct Trace {
    /// All edges visited.
    seen: BTreeSet<[u32; 2]>,
    /// The edges that pierce the triangle, each with a tet.
    through: Vec<(u32, [u32; 2])>,
    /// The faces in the triangle, oriented as the triangle if it is a union of them.
    faces: BTreeMap<[u32; 3], [u32; 3]>,
    /// Edges in the triangle, each with a tet, still to be visited.
    open: Vec<(u32, [u32; 2])>,
}

impl Trace {
    fn add_through(&mut self, tet: u32, [u, v]: [u32; 2]) {
        if self.seen.insert([u.min(v), u.max(v)]) {
            self.through.push((tet, [u, v]));
        }
    }

    fn add_side(&mut self, tet: u32, [x, y]: [u32; 2]) {
        if self.seen.insert([x.min(y), x.max(y)]) {
            self.open.push((tet, [x, y]));
        }
    }

    /// Adds the faces between an edge and the ring vertices on the triangle; returns their number.
    fn add_faces(&mut self, [x, y]: [u32; 2], ring: &Ring, on: &BTreeSet<u32>) -> usize {
        let mut count = 0;
        for (tet, [r, _]) in pairs(ring) {
            if on.contains(&r) {
                count += 1;
                if let Entry::Vacant(new) = self.faces.entry(ascending([x, y, r])) {
                    new.insert([x, y, r]);
                    // The neighbouring face has the edge in the opposite direction.
                    self.add_side(tet, [r, y]);
                    self.add_side(tet, [x, r]);
                }
            }
        }
        count
    }

    /// Whether the faces form an oriented surface bounded by the outline: each edge has two faces
    /// in opposite directions, or one face in the direction of the outline.
    fn is_disc(&self, outline: &[([u32; 2], u32)]) -> bool {
        let mut sides: Vec<([u32; 2], bool)> = Vec::new();
        let mut add = |[u, v]: [u32; 2]| sides.push(([u.min(v), u.max(v)], u < v));
        for &[a, b, c] in self.faces.values() {
            [[a, b], [b, c], [c, a]].into_iter().for_each(&mut add);
        }
        outline.iter().for_each(|&([u, v], _)| add([v, u]));
        sides.sort_unstable();
        sides.chunk_by(|one, other| one.0 == other.0).all(|same| same.len() == 2 && same[0].1 != same[1].1)
    }
}
