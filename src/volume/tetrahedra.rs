//! The working mesh of the volume mesher: flat arrays of tets and of what lies across their faces.
//!
//! A **half-face** is a tet's view of one of its faces, written as one number: 4·tet + index of the
//! opposite vertex. `across` maps each half-face to the one on the other side, so a step through a
//! face also says where one arrives. A **locked** face belongs to the boundary and stays for ever.

use crate::Point;
use crate::kernel::fixed::Fixed;
use crate::kernel::predicates::{Sign, insphere, orient3d};
use crate::kernel::sphere::Circumsphere;
use crate::mesh::TET_FACES;

/// No tet, no vertex, nothing across.
pub(super) const NONE: u32 = u32::MAX;

/// Half-faces are `u32`: this many tets have one.
pub(super) const MAX_TETS: usize = (u32::MAX / 4) as usize;

/// The label of a tet whose body is not known yet.
pub(super) const NO_BODY: u32 = u32::MAX;

/// For a directed edge i→j of a tet the other two vertices, so that (i, j, k, l) is an even permutation.
#[rustfmt::skip]
pub(super) const OPPOSITE_EDGE: [[[usize; 2]; 4]; 4] = [
    [[0, 0], [2, 3], [3, 1], [1, 2]],
    [[3, 2], [0, 0], [0, 3], [2, 0]],
    [[1, 3], [3, 0], [0, 0], [0, 1]],
    [[2, 1], [0, 2], [1, 0], [0, 0]],
];

/// The tets around an edge a→b, in the sense of a right-handed turn about it.
///
/// Tet i is (a, b, `vertices[i]`, `vertices[i + 1]`).
#[derive(Clone, Debug, Default)]
pub(super) struct Ring {
    pub tets: Vec<u32>,
    pub vertices: Vec<u32>,
}

/// Tets, what is across their faces, which faces are locked, and the body of each.
#[derive(Clone, Debug, Default)]
pub(super) struct Tetrahedra {
    /// The places of the vertices; rounded for those that have an exact place beside it.
    pub points: Vec<Point>,
    /// The exact places of vertices whose coordinates are no doubles. Empty where there are none.
    pub(super) exact: Vec<Option<Box<Fixed>>>,
    /// Vertices, positively oriented; a freed slot has `NONE` first.
    pub tets: Vec<[u32; 4]>,
    /// The half-face across each face, or `NONE`.
    pub across: Vec<[u32; 4]>,
    /// Bit i: face i is locked.
    pub locked: Vec<u8>,
    /// The body of each tet, or `NO_BODY`.
    pub bodies: Vec<u32>,
    /// Some tet at each vertex, or `NONE`.
    pub at_vertex: Vec<u32>,
    /// The ranks of the vertices, by which a vertex on a circumsphere counts as inside or not: see [`ties`](super::ties). Without
    /// ranks it does not.
    pub ranks: Vec<u32>,
    /// The vertex that asks.
    pub newcomer: u32,
    /// Edges that stay although no locked face has them, sorted, the lower vertex first.
    kept: Vec<[u32; 2]>,
    free: Vec<u32>,
    /// The circumsphere of each tet, found when it is asked for first: points with tets must not move.
    spheres: Vec<Circumsphere>,
    marks: Vec<u32>,
    epoch: u32,
    scratch: Vec<([u32; 3], u32, bool)>,
}

impl Tetrahedra {
    /// Points and no tets yet.
    pub fn new(points: Vec<Point>) -> Self {
        let at_vertex = vec![NONE; points.len()];
        Self { points, at_vertex, ..Self::default() }
    }

    /// The slots that hold a tet.
    pub fn alive(&self) -> impl Iterator<Item = u32> + '_ {
        (0..self.tets.len() as u32).filter(|&t| self.is_alive(t))
    }

    /// The number of tets.
    pub fn len(&self) -> usize {
        self.tets.len() - self.free.len()
    }

    #[inline]
    pub fn is_alive(&self, tet: u32) -> bool {
        self.tets[tet as usize][0] != NONE
    }

    #[inline]
    pub fn point(&self, vertex: u32) -> &Point {
        &self.points[vertex as usize]
    }

    /// Adds a vertex without tets.
    pub fn add_point(&mut self, point: Point) -> u32 {
        self.points.push(point);
        self.at_vertex.push(NONE);
        (self.points.len() - 1) as u32
    }

    /// Takes the last points away again, down to `count` of them; none may have tets.
    pub fn forget_points(&mut self, count: usize) {
        self.exact.truncate(count);
        self.points.truncate(count);
        self.at_vertex.truncate(count);
    }

    /// The corners of a tet.
    #[inline]
    pub fn corners(&self, tet: u32) -> [&Point; 4] {
        let [a, b, c, d] = self.tets[tet as usize];
        [self.point(a), self.point(b), self.point(c), self.point(d)]
    }

    /// The vertices of a half-face, outward from its tet.
    #[inline]
    pub fn face(&self, half_face: u32) -> [u32; 3] {
        let tet = &self.tets[(half_face >> 2) as usize];
        let [i, j, k] = TET_FACES[(half_face & 3) as usize];
        [tet[i], tet[j], tet[k]]
    }

    /// The corners of a half-face, outward from its tet.
    #[inline]
    pub fn face_points(&self, half_face: u32) -> [&Point; 3] {
        let [a, b, c] = self.face(half_face);
        [self.point(a), self.point(b), self.point(c)]
    }

    /// The vertex of the tet that is opposite to a half-face.
    #[inline]
    pub fn apex(&self, half_face: u32) -> u32 {
        self.tets[(half_face >> 2) as usize][(half_face & 3) as usize]
    }

    /// The half-face on the other side, or `NONE`.
    #[inline]
    pub fn across(&self, half_face: u32) -> u32 {
        self.across[(half_face >> 2) as usize][(half_face & 3) as usize]
    }

    #[inline]
    pub fn is_locked(&self, half_face: u32) -> bool {
        self.locked[(half_face >> 2) as usize] >> (half_face & 3) & 1 == 1
    }

    /// Makes these the edges that stay although no locked face has them: sorted, the lower vertex first.
    pub fn keep_edges(&mut self, edges: Vec<[u32; 2]>) {
        self.kept = edges;
    }

    /// Whether an edge is one of those.
    pub fn is_kept(&self, a: u32, b: u32) -> bool {
        !self.kept.is_empty() && self.kept.binary_search(&[a.min(b), a.max(b)]).is_ok()
    }

    /// Whether there are any.
    pub fn has_kept_edges(&self) -> bool {
        !self.kept.is_empty()
    }

    /// Locks a face on both sides.
    pub fn lock(&mut self, half_face: u32) {
        self.locked[(half_face >> 2) as usize] |= 1 << (half_face & 3);
        let other = self.across(half_face);
        if other != NONE {
            self.locked[(other >> 2) as usize] |= 1 << (other & 3);
        }
    }

    /// Whether four vertices make a positive tet.
    #[inline]
    pub fn is_positive(&self, [a, b, c, d]: [u32; 4]) -> bool {
        self.side([a, b, c], d) == Sign::Positive
    }

    /// The sign of the volume between a face and a vertex.
    #[inline]
    pub fn side(&self, [a, b, c]: [u32; 3], d: u32) -> Sign {
        if self.exact.is_empty() {
            orient3d(self.point(a), self.point(b), self.point(c), self.point(d))
        } else {
            self.exact_side([a, b, c, d])
        }
    }

    /// The circumsphere of a tet.
    #[inline]
    pub fn sphere(&self, tet: u32) -> Circumsphere {
        let kept = self.spheres[tet as usize];
        if kept.is_known() { kept } else { Circumsphere::of(self.corners(tet)) }
    }

    /// The circumsphere of a tet, kept from now on.
    #[inline]
    pub fn keep_sphere(&mut self, tet: u32) -> Circumsphere {
        let sphere = self.sphere(tet);
        self.spheres[tet as usize] = sphere;
        sphere
    }

    /// Whether a point lies inside the circumsphere of a tet; exact. With [`ranks`](Self::ranks) it must be that of the newcomer.
    #[inline]
    pub fn is_in_sphere(&mut self, tet: u32, point: &Point) -> bool {
        self.spheres[tet as usize].holds(point).unwrap_or_else(|| self.settle(tet, point))
    }

    /// As [`Tetrahedra::is_in_sphere`], where the sphere that is kept does not know.
    #[inline(never)]
    fn settle(&mut self, tet: u32, point: &Point) -> bool {
        self.keep_sphere(tet).holds(point).unwrap_or_else(|| {
            let [a, b, c, d] = self.corners(tet);
            match insphere(a, b, c, d, point) {
                Sign::Zero => !self.ranks.is_empty() && super::ties::is_inside(self, tet, self.newcomer),
                sign => sign == Sign::Positive,
            }
        })
    }

    /// The index of `vertex` in `tet`.
    #[inline]
    pub fn index_of(&self, tet: u32, vertex: u32) -> Option<usize> {
        self.tets[tet as usize].iter().position(|&v| v == vertex)
    }

    /// Begins a new set of marked tets: none is marked.
    pub fn clear_marks(&mut self) {
        self.marks.resize(self.tets.len(), 0);
        if self.epoch == u32::MAX {
            self.marks.fill(0);
            self.epoch = 0;
        }
        self.epoch += 1;
    }

    /// Marks a tet; false if it was marked before.
    #[inline]
    pub fn mark(&mut self, tet: u32) -> bool {
        let mark = &mut self.marks[tet as usize];
        let fresh = *mark != self.epoch;
        *mark = self.epoch;
        fresh
    }

    #[inline]
    pub fn unmark(&mut self, tet: u32) {
        self.marks[tet as usize] = 0;
    }

    #[inline]
    pub fn is_marked(&self, tet: u32) -> bool {
        self.marks[tet as usize] == self.epoch
    }

    /// A slot for a new tet, nothing across yet.
    pub fn add_tet(&mut self, tet: [u32; 4], body: u32) -> u32 {
        let slot = self.free_slot();
        self.write_tet(slot, tet, body);
        self.across[slot as usize] = [NONE; 4];
        self.locked[slot as usize] = 0;
        slot
    }

    /// A slot without a tet, which the caller fills at once.
    #[inline]
    pub fn free_slot(&mut self) -> u32 {
        self.free.pop().unwrap_or_else(|| {
            self.tets.push([NONE; 4]);
            self.across.push([NONE; 4]);
            self.locked.push(0);
            self.bodies.push(NO_BODY);
            self.spheres.push(Circumsphere::UNKNOWN);
            self.marks.push(0);
            (self.tets.len() - 1) as u32
        })
    }

    /// Puts a tet in a slot; what is across its faces, and which are locked, is left to the caller.
    #[inline]
    pub fn write_tet(&mut self, slot: u32, tet: [u32; 4], body: u32) {
        let i = slot as usize;
        self.tets[i] = tet;
        self.bodies[i] = body;
        self.spheres[i] = Circumsphere::UNKNOWN;
        for v in tet {
            self.at_vertex[v as usize] = slot;
        }
    }

    /// Frees the slot of a tet. What was across it still points to it: the caller links anew.
    #[inline]
    pub fn remove_tet(&mut self, tet: u32) {
        self.tets[tet as usize][0] = NONE;
        self.free.push(tet);
    }

    /// Makes two half-faces see each other.
    #[inline]
    pub fn link(&mut self, one: u32, other: u32) {
        self.across[(one >> 2) as usize][(one & 3) as usize] = other;
        if other != NONE {
            self.across[(other >> 2) as usize][(other & 3) as usize] = one;
        }
    }

    /// All tets at a vertex, in an order that depends on the mesh alone. Uses the marks.
    pub fn star(&mut self, vertex: u32, tets: &mut Vec<u32>) {
        tets.clear();
        let first = self.at_vertex[vertex as usize];
        if first == NONE {
            return;
        }
        self.clear_marks();
        self.mark(first);
        tets.push(first);
        let mut next = 0;
        while let Some(&t) = tets.get(next) {
            next += 1;
            for i in 0..4 {
                let other = self.across[t as usize][i];
                if self.tets[t as usize][i] != vertex && other != NONE && self.mark(other >> 2) {
                    tets.push(other >> 2);
                }
            }
        }
    }

    /// The vertices that share a tet with this one, ascending. Uses the marks and `tets`.
    pub fn neighbours(&mut self, vertex: u32, tets: &mut Vec<u32>) -> Vec<u32> {
        self.star(vertex, tets);
        let mut beside: Vec<u32> = tets.iter().flat_map(|&t| self.tets[t as usize]).collect();
        beside.sort_unstable();
        beside.dedup();
        beside.retain(|&v| v != vertex);
        beside
    }

    /// Some tet with the edge a, b, if it is an edge of the mesh. Uses the marks and `tets`.
    pub fn tet_at_edge(&mut self, a: u32, b: u32, tets: &mut Vec<u32>) -> Option<u32> {
        self.star(a, tets);
        tets.iter().copied().find(|&t| self.tets[t as usize].contains(&b))
    }

    /// The ring around the edge a→b of `tet`; false where it is open, that is on the outside.
    pub fn ring(&self, tet: u32, a: u32, b: u32, ring: &mut Ring) -> bool {
        ring.tets.clear();
        ring.vertices.clear();
        let mut t = tet;
        loop {
            let (Some(i), Some(j)) = (self.index_of(t, a), self.index_of(t, b)) else {
                panic!("tet {t} has lost the edge {a} {b}");
            };
            let [k, _] = OPPOSITE_EDGE[i][j];
            ring.tets.push(t);
            ring.vertices.push(self.tets[t as usize][k]);
            let next = self.across[t as usize][k];
            if next == NONE {
                return false;
            }
            t = next >> 2;
            if t == tet {
                return true;
            }
        }
    }

    /// Replaces tets by others that fill the same polyhedron; the faces on its surface keep their
    /// neighbours and locks. New tets get the body `body`; their slots are appended to `slots`.
    ///
    /// # Panics
    /// Where the new tets do not have the surface of the old ones.
    pub fn replace(&mut self, old: &[u32], new: &[[u32; 4]], body: u32, slots: &mut Vec<u32>) {
        let mut faces = std::mem::take(&mut self.scratch);
        faces.clear();
        self.clear_marks();
        for &t in old {
            self.mark(t);
        }
        for &t in old {
            for i in 0..4 {
                let half_face = 4 * t + i;
                let other = self.across(half_face);
                if other == NONE || !self.is_marked(other >> 2) {
                    faces.push((sorted(self.face(half_face)), other, self.is_locked(half_face)));
                } else {
                    assert!(!self.is_locked(half_face), "locked face {:?} removed", self.face(half_face));
                }
            }
        }
        let outer = faces.len();
        for &t in old {
            self.remove_tet(t);
        }
        for &tet in new {
            let t = self.add_tet(tet, body);
            slots.push(t);
            faces.extend((0..4).map(|i| (sorted(self.face(4 * t + i)), 4 * t + i, false)));
        }
        self.match_faces(&mut faces, outer);
        self.scratch = faces;
    }

    /// Links half-faces with equal vertices; the first `outer` are seen from outside.
    fn match_faces(&mut self, faces: &mut [([u32; 3], u32, bool)], outer: usize) {
        // An outer face may be `NONE` and then cannot tell by itself that it is new: sort positions.
        let mut order: Vec<u32> = (0..faces.len() as u32).collect();
        order.sort_unstable_by_key(|&i| (faces[i as usize].0, i));
        let pairs = order.chunks_exact(2);
        assert!(pairs.remainder().is_empty(), "the surface of a cavity changed");
        for pair in pairs {
            let (one, other) = (faces[pair[0] as usize], faces[pair[1] as usize]);
            assert!(one.0 == other.0 && pair[1] as usize >= outer, "face {:?} left alone", one.0);
            self.link(other.1, one.1);
            if one.2 {
                self.lock(other.1);
            }
        }
    }

    /// Replaces tets by others, each with its body, where the outside and the facets among them change too.
    ///
    /// Faces of facets are locked; a new face that is alone must be one, and borders the outside then. Where the
    /// new tets do not fit so, nothing is changed and the answer is false. The slots of the new tets are appended to `slots`.
    pub fn rebuild(
        &mut self,
        old: &[u32],
        new: &[([u32; 4], u32)],
        is_facet: &dyn Fn([u32; 3]) -> bool,
        slots: &mut Vec<u32>,
    ) -> bool {
        let mut faces = Vec::new();
        self.clear_marks();
        for &t in old {
            self.mark(t);
        }
        for half_face in old.iter().flat_map(|&t| 4 * t..4 * t + 4) {
            let other = self.across(half_face);
            if other != NONE && !self.is_marked(other >> 2) {
                faces.push((sorted(self.face(half_face)), Some(other)));
            }
        }
        let outer = faces.len();
        for (tet, _) in new {
            faces.extend(TET_FACES.map(|face| (sorted(face.map(|i| tet[i])), None)));
        }
        let mut keys: Vec<[u32; 3]> = faces.iter().map(|f| f.0).collect();
        keys.sort_unstable();
        let fits = |same: &[[u32; 3]]| same.len() == 2 || (same.len() == 1 && is_facet(same[0]));
        if !keys.chunk_by(|a, b| a == b).all(fits) {
            return false;
        }
        for &t in old {
            self.remove_tet(t);
        }
        for (i, &(tet, body)) in new.iter().enumerate() {
            let t = self.add_tet(tet, body);
            slots.push(t);
            for k in 0..4 {
                faces[outer + 4 * i + k].1 = Some(4 * t + k as u32);
            }
        }
        faces.sort_unstable();
        for same in faces.chunk_by(|a, b| a.0 == b.0) {
            let one = same[0].1.expect("new tets have slots");
            self.link(one, same.get(1).and_then(|f| f.1).unwrap_or(NONE));
            if is_facet(same[0].0) {
                self.lock(one);
            }
        }
        true
    }

    /// Every broken promise of the structure, as sentences; empty when all is well.
    #[cfg(test)]
    pub fn check(&self) -> Vec<String> {
        let mut faults = Vec::new();
        for t in self.alive() {
            let [a, b, c, d] = self.corners(t);
            if orient3d(a, b, c, d) != Sign::Positive {
                faults.push(format!("tet {t} {:?} is not positive", self.tets[t as usize]));
            }
            for half_face in 4 * t..4 * t + 4 {
                let other = self.across(half_face);
                if other == NONE {
                    continue;
                }
                if !self.is_alive(other >> 2) || self.across(other) != half_face {
                    faults.push(format!("half-face {half_face} sees {other}, not the other way"));
                } else if sorted(self.face(half_face)) != sorted(self.face(other)) {
                    faults.push(format!("half-faces {half_face} and {other} have other vertices"));
                } else if self.is_locked(half_face) != self.is_locked(other) {
                    faults.push(format!("half-face {half_face} is locked from one side"));
                }
            }
        }
        for (v, &t) in self.at_vertex.iter().enumerate() {
            if t != NONE && !(self.is_alive(t) && self.tets[t as usize].contains(&(v as u32))) {
                faults.push(format!("vertex {v} is not in its tet {t}"));
            }
        }
        faults
    }
}

/// The vertices of a face, ascending.
#[inline]
pub(super) fn sorted([a, b, c]: [u32; 3]) -> [u32; 3] {
    let (a, b) = if a < b { (a, b) } else { (b, a) };
    let (b, c) = if b < c { (b, c) } else { (c, b) };
    let (a, b) = if a < b { (a, b) } else { (b, a) };
    [a, b, c]
}
