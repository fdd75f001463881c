//! Boundary recovery: every triangle of the surface comes to consist of faces of the mesh.
//!
//! First by flips (`recover`), which do nearly all of it. Where they go no further the mesh is cut along the surface. A missing edge is split
//! where it crosses the mesh, by points exactly on it (`steiner`); a split takes one crossing away and brings it no new one, and edges that are there stay. When all
//! edges are there, edges of the mesh that go through a missing triangle are flipped away, and where that comes to a standstill split in the triangle: their pieces
//! and the edges from the new point to the ring around lie on one side, so what goes through becomes less by one. When nothing does, the triangle consists of faces
//! of the mesh, whichever these are (the first half of George, Borouchaki, Saltel 2003, with no demand on how the triangles are cut). As all signs are
//! exact it ends, if not for lack of points: what is bounded is their number.
//!
//! Each point takes in all tets that it sees of those that the edge or triangle crosses, and points of an edge whose ball one of their neighbours sees go again: the
//! fewer there are the fewer the next edge crosses. The others leave as any do (`relocate`).

use super::constraints::{Facet, edges};
use super::crossing::{Crossing, crossings, edges_of_tet, tets_around};
use super::flips::FLAT;
use super::recover::{DEEPEST, Recovery};
use super::steiner::middle_first;
use super::tetrahedra::{NONE, Ring, sorted};
use crate::kernel::predicates::Sign;
use std::collections::btree_map::Entry;
use std::collections::{BTreeMap, BTreeSet};

/// The most points for a surface, which bounds the time of a refusal. Prisms of some hundred sides and two layers take 2000, blocks with 35 crossing notches 3400.
const MOST_POINTS: usize = 15_000;

/// How often what was left is tried again.
const ROUNDS: u32 = 10;

/// The round in which flips may make flat tets, before triangles are split.
const FLAT_ROUND: u32 = DEEPEST + 1;

/// How often points are taken off the edges: each round may let others go, hardly any after the second.
const THINNINGS: usize = 4;

/// How often the edges through a triangle may be flipped away before they are split: flips may bring others.
const FLIPS: usize = 10;

/// How often flips and splits may take turns in one triangle before it is split to the end.
const STANDSTILLS: usize = 10;

/// How many edges through a triangle may be tried to be flipped until one is split, for each that there is at first.
const MOST_TRIES: usize = 30;

/// The same, beside those.
const LEAST_TRIES: usize = 100;

/// For how many edges and facets' worth other flips may help.
const HELPED: usize = 1000;

/// The missing triangles and what the mesh has of their edges.
#[derive(Clone, Debug, Default)]
struct Cut {
    /// Missing pieces of edges of the surface, each after its edge.
    missing: Vec<([u32; 2], [u32; 2])>,
    /// The points on each edge of the surface.
    on_edge: BTreeMap<[u32; 2], Vec<u32>>,
    /// How many edges were tried to be flipped.
    tries: usize,
    /// The points in each triangle.
    inside: BTreeMap<u32, Vec<u32>>,
}

impl Recovery<'_> {
    /// Recovers all facets, or returns those that it cannot.
    pub fn conform(&mut self) -> Result<(), Vec<u32>> {
        let missing = self.missing_facets();
        self.counts.missing_faces = missing.len();
        self.most_steiner = if self.mesh.fits_exact() { MOST_POINTS } else { 0 };
        self.give_help(HELPED);
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
        self.cut_edges(DEEPEST, &mut cut);
        self.thin_edges(&mut cut);
        let left = self.cut_triangles(missing, &mut cut);
        for [a, b] in self.constraints.kept_edges() {
            self.constraints.forget_edge(a, b);
        }
        if left.is_empty() { Ok(()) } else { Err(left) }
    }

    /// Splits missing edges until their pieces are there, as far as that goes.
    fn cut_edges(&mut self, depth: u32, cut: &mut Cut) {
        for (edge, piece) in std::mem::take(&mut cut.missing) {
            let mut pieces = vec![piece];
            while let Some([a, b]) = pieces.pop() {
                if self.recover_edge(a, b, depth) {
                    continue;
                }
                match self.cut_edge(edge, [a, b]) {
                    Some(p) => {
                        cut.on_edge.entry(edge).or_default().push(p);
                        pieces.extend([[a, p], [p, b]]);
                    }
                    None => cut.missing.push((edge, [a, b])),
                }
            }
            if cut.missing.last().is_none_or(|last| last.0 != edge) {
                self.thin_edge(edge, cut);
            }
        }
    }

    /// The points on an edge of the surface, from its first end on.
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

    /// Takes points off the edges of the surface as long as that goes on.
    fn thin_edges(&mut self, cut: &mut Cut) {
        let whole = |edge: &[u32; 2]| cut.missing.iter().all(|(missing, _)| missing != edge);
        let edges: Vec<[u32; 2]> = cut.on_edge.keys().copied().filter(whole).collect();
        for _ in 0..THINNINGS {
            if edges.iter().map(|&edge| self.thin_edge(edge, cut)).sum::<usize>() == 0 {
                break;
            }
        }
    }

    /// Takes points off an edge of the surface that are not needed any more, as the mesh has changed since.
    fn thin_edge(&mut self, edge: [u32; 2], cut: &mut Cut) -> usize {
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

    /// Makes one edge of two pieces of an edge of the surface if one of their ends sees all of the ball of the point between.
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

    /// Splits a piece of an edge of the surface where it crosses the mesh.
    fn cut_edge(&mut self, edge: [u32; 2], [a, b]: [u32; 2]) -> Option<u32> {
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

    /// Makes triangles consist of faces; returns those for which that failed.
    fn cut_triangles(&mut self, triangles: Vec<u32>, cut: &mut Cut) -> Vec<u32> {
        let mut left = triangles;
        for round in 0..ROUNDS {
            let before = left.len();
            self.cut_edges(DEEPEST, cut);
            self.flips.least = if round == FLAT_ROUND { 0.0 } else { FLAT };
            let split = round > FLAT_ROUND;
            left.retain(|&t| !self.cut_triangle(t, round.min(DEEPEST), split, cut));
            if left.is_empty() || (split && left.len() == before && self.steiner.len() >= self.most_steiner) {
                break;
            }
        }
        left
    }

    /// Makes a triangle consist of faces, by flips of this depth, and by points where these come to a standstill; false where it does not.
    fn cut_triangle(&mut self, t: u32, depth: u32, split: bool, cut: &mut Cut) -> bool {
        let vertices = self.constraints.facets[t as usize].vertices;
        let Some(outline) = self.outline(vertices, cut) else { return false };
        let mut on: BTreeSet<u32> = outline.iter().map(|side| side.0[0]).collect();
        on.extend(cut.inside.get(&t).into_iter().flatten());
        let facet = Facet { vertices, triangle: t, gone: false };
        let (mut fewest, mut in_vain, mut standstills, mut most) = (usize::MAX, 0, 0, 0);
        let faces = loop {
            let Some(trace) = self.trace_triangle(vertices, &outline, &on) else { return false };
            if trace.through.is_empty() {
                break trace.faces;
            }
            if fewest == usize::MAX {
                most = cut.tries + LEAST_TRIES + MOST_TRIES * trace.through.len();
            }
            in_vain = if trace.through.len() < fewest { 0 } else { in_vain + 1 };
            fewest = fewest.min(trace.through.len());
            let flips = in_vain < FLIPS && standstills <= STANDSTILLS && cut.tries < most;
            if flips && self.flip_through(&trace, depth, cut) {
                continue;
            }
            if !split || !self.split_through(&trace, facet, &mut on, cut, standstills < STANDSTILLS) {
                return false;
            }
            standstills += 1;
            (fewest, in_vain) = (usize::MAX, 0);
        };
        for face in faces.into_values() {
            self.constraints.add(face, t);
        }
        true
    }

    /// Flips away what edges it can that go through a triangle; whether any.
    fn flip_through(&mut self, trace: &Trace, depth: u32, cut: &mut Cut) -> bool {
        cut.tries += trace.through.len();
        let mut any = false;
        for &(tet, edge) in &trace.through {
            self.take_help();
            any |= self.remove_edge(tet, edge, [NONE; 2], depth);
        }
        any
    }

    /// Splits the edges that go through a triangle there; whether any.
    fn split_through(
        &mut self,
        trace: &Trace,
        facet: Facet,
        on: &mut BTreeSet<u32>,
        cut: &mut Cut,
        one: bool,
    ) -> bool {
        let mut any = false;
        // Flips in vain may have changed the tets since.
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

    /// The pieces of a triangle's edges, in its sense, each with the corner opposite; `None` where one is missing.
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

    /// What of the mesh is in a triangle whose outline is there, from its outline on; `on` are the vertices on it. `None` where rounding
    /// hides which way it goes.
    ///
    /// All other vertices count as above or below its plane, by exact sign. So it is a piece of surface through the mesh whatever lies in one
    /// plane with it up to rounding, and its outline ends it.
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
            // At points added later there are fewer tets.
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

    /// Finds what of a triangle is at a piece of its outline; false where rounding hides it.
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
        // Right-handed about the edge one comes from below through the triangle, from above outside of it.
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

/// What of the mesh is in a triangle.
#[derive(Clone, Debug, Default)]
struct Trace {
    /// All edges that were met.
    seen: BTreeSet<[u32; 2]>,
    /// The edges that go through it, each with a tet.
    through: Vec<(u32, [u32; 2])>,
    /// The faces in it, in its sense if it consists of them.
    faces: BTreeMap<[u32; 3], [u32; 3]>,
    /// Edges in it, each with a tet, that were not looked at yet.
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

    /// Adds the faces from an edge to the vertices on the triangle in its ring; returns how many there are.
    fn add_faces(&mut self, [x, y]: [u32; 2], ring: &Ring, on: &BTreeSet<u32>) -> usize {
        let mut count = 0;
        for (tet, [r, _]) in pairs(ring) {
            if on.contains(&r) {
                count += 1;
                if let Entry::Vacant(new) = self.faces.entry(sorted([x, y, r])) {
                    new.insert([x, y, r]);
                    // What is on the other side of an edge goes along it the other way.
                    self.add_side(tet, [r, y]);
                    self.add_side(tet, [x, r]);
                }
            }
        }
        count
    }

    /// Whether each edge of the faces is one of two of them, or of one if it is in the outline, along which that goes the same way.
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
