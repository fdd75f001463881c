//! The mesh data structure of the improvement: tets with adjacency, in which any cavity can be
//! refilled.

use crate::Point;
use crate::ground::kernel::predicates::{Sign, orient3d, volume6_and_error};
use crate::ground::kernel::simplex::{OPPOSITE_EDGE, TET_EDGES, TET_FACES, ascending};
use crate::ground::mesh::VertexId;
use crate::mesher::half_face::{Marks, NONE, Ring};
use crate::mesher::improve::objective::{self, Objective};
use csg::BodyId;

/// Tets with adjacency.
///
/// A **locked** face is on the boundary of a body: it stays, and so do its vertices. All changes
/// use [`replace`](Self::replace), which removes tets and fills the cavity with others. Ids of tets
/// are slots: a removed tet is dead until its slot is reused.
///
/// Not stored are stars and edges. Rings and stars are traversed from a tet when needed.
pub(super) struct Complex {
    /// The coordinates of the vertices.
    pub points: Vec<Point>,
    /// Whether each vertex may be moved or removed.
    pub free: Vec<bool>,
    /// The vertices of each tet, positively oriented; all [`NONE`] in a dead slot.
    pub tets: Vec<[u32; 4]>,
    /// The score of each tet by the objective.
    pub scores: Vec<f64>,
    /// The body of each tet.
    pub bodies: Vec<BodyId>,
    /// Edges that must stay and need not be on a locked face: sorted, the lower vertex first.
    pub kept_edges: Vec<[u32; 2]>,
    /// The pass in which the tets of each vertex last changed.
    pub touched: Vec<u32>,
    /// The current pass.
    pub pass: u32,
    /// The half-face across the face opposite to each vertex (4·tet + index of the face), or
    /// [`NONE`].
    across: Vec<[u32; 4]>,
    /// Bit k: the face opposite to vertex k is locked.
    locked: Vec<u8>,
    /// One tet of each vertex, or [`NONE`].
    vertex_tet: Vec<u32>,
    /// Free slots; the last one is used first.
    dead: Vec<u32>,
    marks: Marks,
    /// Scratch memory: faces without a neighbour during a replacement.
    open: Vec<OpenFace>,
}

struct OpenFace {
    key: [u32; 3],
    across: u32,
    locked: bool,
}

#[inline(always)]
fn face_of(tet: [u32; 4], face: usize) -> [u32; 3] {
    let [a, b, c] = TET_FACES[face & 3];
    [tet[a], tet[b], tet[c]]
}

/// Whether the tet of these corners is positive by exact sign.
fn is_positive(p: &[Point; 4]) -> bool {
    let edge = |k: usize| [p[k].x - p[0].x, p[k].y - p[0].y, p[k].z - p[0].z];
    let (volume, error) = volume6_and_error([edge(1), edge(2), edge(3)]);
    volume > error || (volume >= -error && orient3d(&p[0], &p[1], &p[2], &p[3]) == Sign::Positive)
}

/// The index of `vertex` in a tet that contains it.
pub(super) fn place(tet: [u32; 4], vertex: u32) -> usize {
    tet.iter().position(|&v| v == vertex).unwrap_or_else(|| panic!("tet {tet:?} has no vertex {vertex}"))
}

impl Complex {
    /// Builds a complex of tets; they need not be all tets of a mesh. Scores are zero.
    ///
    /// Faces are locked if they have one tet, separate two bodies, or if `is_kept` is true for
    /// their sorted vertices. `free` vertices may be moved unless one of their faces is locked.
    ///
    /// # Panics
    /// If a tet is not positively oriented or a face has three tets.
    pub fn new(
        points: Vec<Point>,
        free: Vec<bool>,
        tets: Vec<[u32; 4]>,
        bodies: Vec<BodyId>,
        is_kept: impl FnMut([u32; 3]) -> bool,
    ) -> Self {
        assert!(tets.len() < (1 << 30), "{} tets, but at most 2^30 are supported", tets.len());
        let count = points.len();
        let mut complex = Self {
            points,
            free,
            scores: vec![0.0; tets.len()],
            bodies,
            kept_edges: Vec::new(),
            touched: vec![0; count],
            pass: 0,
            across: vec![[NONE; 4]; tets.len()],
            locked: vec![0; tets.len()],
            vertex_tet: vec![NONE; count],
            dead: Vec::new(),
            marks: Marks::default(),
            open: Vec::new(),
            tets,
        };
        for (t, tet) in complex.tets.iter().enumerate() {
            let p = complex.corners(*tet);
            assert!(is_positive(&p), "tet {t} of vertices {tet:?} at {} is not positively oriented", p[0]);
            for &v in tet {
                complex.vertex_tet[v as usize] = t as u32;
            }
        }
        complex.link_neighbours(is_kept);
        complex
    }

    /// Finds the neighbour across each face, and locks faces.
    fn link_neighbours(&mut self, mut is_kept: impl FnMut([u32; 3]) -> bool) {
        // Faces sorted by lowest vertex v (counting sort): `faces[starts[v]..starts[v + 1]]` has
        // the other two vertices and the half-face of each.
        let mut starts = vec![0_u32; self.points.len() + 1];
        for &tet in &self.tets {
            for face in 0..4 {
                starts[ascending(face_of(tet, face))[0] as usize + 1] += 1;
            }
        }
        for v in 0..self.points.len() {
            starts[v + 1] += starts[v];
        }
        let mut faces = vec![(0_u64, NONE); 4 * self.tets.len()];
        let mut next = starts.clone();
        for (t, &tet) in self.tets.iter().enumerate() {
            for face in 0..4 {
                let [low, middle, high] = ascending(face_of(tet, face));
                let slot = &mut next[low as usize];
                faces[*slot as usize] =
                    (u64::from(middle) << 32 | u64::from(high), 4 * t as u32 + face as u32);
                *slot += 1;
            }
        }
        for v in 0..self.points.len() {
            // There are a few dozen: linear search is faster than sorting.
            let mut here = &mut faces[starts[v] as usize..starts[v + 1] as usize];
            while let Some((&mut (key, first), rest)) = here.split_first_mut() {
                let vertices = [v as u32, (key >> 32) as u32, key as u32];
                let second = rest.iter().position(|f| f.0 == key);
                if let Some(k) = second {
                    let third = rest[k + 1..].iter().find(|f| f.0 == key);
                    assert!(third.is_none(), "not a manifold: face {vertices:?} has three tets");
                    self.join(first, rest[k].1, vertices, is_kept(vertices));
                    rest.swap(0, k);
                    here = &mut rest[1..];
                } else {
                    is_kept(vertices);
                    self.lock(first, vertices);
                    here = rest;
                }
            }
        }
    }

    fn join(&mut self, one: u32, other: u32, vertices: [u32; 3], is_kept: bool) {
        self.across[one as usize / 4][one as usize % 4] = other;
        self.across[other as usize / 4][other as usize % 4] = one;
        if is_kept || self.bodies[one as usize / 4] != self.bodies[other as usize / 4] {
            self.lock(one, vertices);
            self.lock(other, vertices);
        }
    }

    fn lock(&mut self, half_face: u32, vertices: [u32; 3]) {
        self.locked[half_face as usize / 4] |= 1 << (half_face % 4);
        vertices.into_iter().for_each(|v| self.free[v as usize] = false);
    }

    /// Whether the vertex has tets.
    pub fn is_used(&self, vertex: u32) -> bool {
        self.vertex_tet[vertex as usize] != NONE
    }

    /// Whether the slot holds a tet.
    pub fn is_alive(&self, tet: u32) -> bool {
        self.tets[tet as usize][0] != NONE
    }

    /// The ids of all tets, ascending.
    pub fn living(&self) -> impl Iterator<Item = u32> + '_ {
        (0..self.tets.len() as u32).filter(|&t| self.is_alive(t))
    }

    /// The corners of a tet.
    pub fn corners(&self, tet: [u32; 4]) -> [Point; 4] {
        objective::corners(&self.points, tet)
    }

    /// Whether the face opposite to vertex `face` of `tet` must stay.
    pub fn is_locked(&self, tet: u32, face: usize) -> bool {
        self.locked[tet as usize] & (1 << face) != 0
    }

    /// The tet across a face, and the index of the face in that tet; `None` if the face is locked.
    pub fn neighbour(&self, tet: u32, face: usize) -> Option<(u32, usize)> {
        if self.is_locked(tet, face) {
            return None;
        }
        let across = self.across[tet as usize][face];
        Some((across / 4, across as usize % 4))
    }

    /// The least score of some tets.
    pub fn worst_of(&self, tets: &[u32]) -> f64 {
        tets.iter().map(|&t| self.scores[t as usize]).fold(f64::INFINITY, f64::min)
    }

    /// Computes all scores.
    pub fn score_all(&mut self, objective: &Objective) {
        for (score, tet) in self.scores.iter_mut().zip(&self.tets).filter(|(_, tet)| tet[0] != NONE) {
            *score = objective.score(&self.points, *tet);
        }
    }

    /// Whether a tet, which need not be in the complex, is positive by exact sign.
    pub fn is_positive(&self, tet: [u32; 4]) -> bool {
        is_positive(&self.corners(tet))
    }

    /// Traverses the ring around the edge between local vertices `i` and `j` of `tet`.
    ///
    /// Collects its tets and the ring vertices r₀, r₁, …, such that tet k is (i, j, rₖ, rₖ₊₁) up to
    /// an even permutation. False, with an incomplete ring, if the edge is on a locked face or the
    /// ring has more than `limit` tets.
    pub fn ring(&self, tet: u32, i: usize, j: usize, limit: usize, ring: &mut Ring) -> bool {
        ring.clear();
        let [k, l] = OPPOSITE_EDGE[i][j];
        let (mut t, mut leave, mut behind) = (tet, k, self.tets[tet as usize][k]);
        let mut ahead = self.tets[tet as usize][l];
        loop {
            if ring.tets.len() == limit {
                return false;
            }
            ring.tets.push(t);
            ring.vertices.push(behind);
            let Some((next, face)) = self.neighbour(t, leave) else { return false };
            if next == tet {
                return true;
            }
            behind = ahead;
            ahead = self.tets[next as usize][face];
            leave = place(self.tets[next as usize], behind);
            t = next;
        }
    }

    /// Collects the tets of a vertex that are connected without crossing locked faces: all tets of
    /// a free vertex.
    pub fn star(&mut self, vertex: u32, star: &mut Vec<u32>) {
        star.clear();
        let first = self.vertex_tet[vertex as usize];
        if first == NONE {
            return;
        }
        self.marks.clear(self.tets.len());
        self.marks.add(first);
        star.push(first);
        let mut done = 0;
        while let Some(&t) = star.get(done) {
            done += 1;
            for face in 0..4 {
                if self.tets[t as usize][face] == vertex {
                    continue;
                }
                if let Some((next, _)) = self.neighbour(t, face)
                    && self.marks.add(next)
                {
                    star.push(next);
                }
            }
        }
    }

    /// Adds a free vertex without tets; returns its number.
    pub fn add_vertex(&mut self, point: Point) -> u32 {
        let id = VertexId::new(self.points.len()).0;
        self.points.push(point);
        self.free.push(true);
        self.touched.push(self.pass);
        self.vertex_tet.push(NONE);
        id
    }

    /// Removes the last vertex, which must have no tets.
    pub fn pop_vertex(&mut self) {
        assert_eq!(self.vertex_tet.pop(), Some(NONE), "the last vertex has a tet");
        self.points.pop();
        self.free.pop();
        self.touched.pop();
    }

    /// Whether tets may be replaced by others that fill the same cavity.
    ///
    /// Not if a kept edge would be lost, or if a locked face has both sides in the cavity, as one
    /// inside a body can: its sides could not be distinguished.
    pub fn may_replace(&self, old: &[u32], new: &[([u32; 4], f64)]) -> bool {
        let has_both_sides = |t: u32| {
            let across = self.across[t as usize];
            (0..4).any(|k| self.is_locked(t, k) && across[k] != NONE && old.contains(&(across[k] / 4)))
        };
        if old.iter().any(|&t| self.locked[t as usize] != 0 && has_both_sides(t)) {
            return false;
        }
        let is_kept = |[a, b]: [u32; 2]| self.kept_edges.binary_search(&[a.min(b), a.max(b)]).is_ok();
        self.kept_edges.is_empty()
            || old.iter().map(|&t| self.tets[t as usize]).all(|tet| {
                let edges = TET_EDGES.map(|edge| edge.map(|i| tet[i]));
                // Kept edges on the cavity's surface are in new tets too.
                let mut kept = edges.into_iter().filter(|&edge| is_kept(edge));
                kept.all(|edge| new.iter().any(|(tet, _)| edge.iter().all(|v| tet.contains(v))))
            })
    }

    /// Replaces the tets `old` by `new` ones with scores, which must fill the same cavity.
    ///
    /// # Panics
    /// If the new tets do not have each face of the cavity exactly once.
    pub fn replace(&mut self, old: &[u32], new: &[([u32; 4], f64)]) {
        let body = self.bodies[old[0] as usize];
        self.remove_tets(old);
        let mut waiting = std::mem::take(&mut self.open);
        for &(tet, score) in new {
            let slot = self.new_slot();
            self.tets[slot as usize] = tet;
            self.scores[slot as usize] = score;
            self.bodies[slot as usize] = body;
            self.locked[slot as usize] = 0;
            for v in tet {
                self.vertex_tet[v as usize] = slot;
                self.touched[v as usize] = self.pass;
            }
            for face in 0..4 {
                self.match_face(&mut waiting, slot, face);
            }
        }
        assert!(waiting.is_empty(), "new tets {new:?} leave the face {:?} open", waiting[0].key);
        self.open = waiting;
    }

    /// Frees the slots of `old` and collects the faces of their cavity in `open`.
    fn remove_tets(&mut self, old: &[u32]) {
        self.marks.clear(self.tets.len());
        for &t in old {
            self.marks.add(t);
        }
        self.open.clear();
        for &t in old {
            let tet = self.tets[t as usize];
            for face in 0..4 {
                let across = self.across[t as usize][face];
                let locked = self.is_locked(t, face);
                if locked || !self.marks.contains(across / 4) {
                    self.open.push(OpenFace { key: ascending(face_of(tet, face)), across, locked });
                }
            }
        }
        for &t in old {
            for v in self.tets[t as usize] {
                self.touched[v as usize] = self.pass;
                self.vertex_tet[v as usize] = NONE;
            }
            self.tets[t as usize] = [NONE; 4];
        }
        self.dead.extend_from_slice(old);
    }

    fn new_slot(&mut self) -> u32 {
        if let Some(slot) = self.dead.pop() {
            return slot;
        }
        assert!(self.tets.len() < (1 << 30) - 1, "more than 2^30 tets");
        self.tets.push([NONE; 4]);
        self.across.push([NONE; 4]);
        self.locked.push(0);
        self.scores.push(0.0);
        self.bodies.push(BodyId(0));
        self.marks.push();
        self.tets.len() as u32 - 1
    }

    /// Links a face of a new tet to its partner if that is in `waiting`, else adds it there.
    fn match_face(&mut self, waiting: &mut Vec<OpenFace>, slot: u32, face: usize) {
        let key = ascending(face_of(self.tets[slot as usize], face));
        let here = 4 * slot + face as u32;
        let Some(k) = waiting.iter().position(|open| open.key == key) else {
            waiting.push(OpenFace { key, across: here, locked: false });
            return;
        };
        let partner = waiting.swap_remove(k);
        self.across[slot as usize][face] = partner.across;
        if partner.locked {
            self.locked[slot as usize] |= 1 << face;
        }
        if partner.across != NONE {
            self.across[partner.across as usize / 4][partner.across as usize % 4] = here;
        }
    }

    /// Checks all invariants; returns the first violation.
    #[cfg(test)]
    pub fn check(&self) -> Result<(), String> {
        for t in self.living() {
            let tet = self.tets[t as usize];
            if !self.is_positive(tet) {
                return Err(format!("tet {t} {tet:?} is not positive"));
            }
            for face in 0..4 {
                let across = self.across[t as usize][face];
                if across == NONE {
                    if !self.is_locked(t, face) {
                        return Err(format!("tet {t} has an open face {face}"));
                    }
                    continue;
                }
                let (n, g) = (across / 4, across as usize % 4);
                if !self.is_alive(n) || self.across[n as usize][g] != 4 * t + face as u32 {
                    return Err(format!("tets {t} and {n} disagree on being neighbours"));
                }
                if ascending(face_of(tet, face)) != ascending(face_of(self.tets[n as usize], g)) {
                    return Err(format!("tets {t} and {n} disagree on their face"));
                }
                if self.is_locked(t, face) != self.is_locked(n, g) {
                    return Err(format!("tets {t} and {n} disagree on a lock"));
                }
            }
        }
        for (v, &t) in self.vertex_tet.iter().enumerate() {
            if t != NONE && !self.tets[t as usize].contains(&(v as u32)) {
                return Err(format!("vertex {v} is not in its tet {t}"));
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesher::improve::blocks::whole;
    use crate::mesher::improve::samples::{cube, two_boxes};

    #[test]
    fn the_tets_of_a_ring_follow_its_vertices() {
        let complex = whole(&cube(3, 1));
        let (mut ring, mut closed) = (Ring::default(), 0);
        for tet in complex.living() {
            for [i, j] in TET_EDGES {
                if !complex.ring(tet, i, j, usize::MAX, &mut ring) {
                    continue;
                }
                closed += 1;
                let [a, b] = [i, j].map(|k| complex.tets[tet as usize][k]);
                assert_eq!(ring.tets.len(), ring.vertices.len());
                for (k, &t) in ring.tets.iter().enumerate() {
                    let next = ring.vertices[(k + 1) % ring.vertices.len()];
                    let expected = [a, b, ring.vertices[k], next];
                    assert!(complex.is_positive(expected));
                    assert!(expected.iter().all(|v| complex.tets[t as usize].contains(v)));
                }
            }
        }
        assert!(closed > 0);
        assert!(!complex.ring(0, 0, 1, usize::MAX, &mut ring), "an edge of the cube has no closed ring");
    }

    #[test]
    fn faces_between_bodies_and_of_the_hull_are_locked() {
        let mesh = two_boxes(4, 1);
        let complex = whole(&mesh);
        let faces = complex.living().flat_map(|t| (0..4).map(move |k| (t, k)));
        let locked = faces.filter(|&(t, k)| complex.is_locked(t, k)).count();
        let between = mesh.triangles.iter().filter(|t| t.patch.0 == 6).count();
        assert_eq!(locked, mesh.triangles.len() + between);
    }

    #[test]
    #[should_panic(expected = "leave the face")]
    fn a_filling_with_other_faces_than_the_cavity_is_rejected() {
        let mut complex = whole(&cube(2, 1));
        let tet = complex.tets[0];
        complex.replace(&[0, 1], &[(tet, 0.5)]);
    }
}
