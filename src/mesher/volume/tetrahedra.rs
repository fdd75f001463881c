//! The mesh data structure of the volume mesher: flat arrays of tets and their adjacency.
//!
//! `across` maps each half-face to the one on the other side, so a step through a face also gives
//! the entry face of the next tet. A **locked** face belongs to the boundary and stays.

use crate::Point;
use crate::ground::kernel::fixed::Fixed;
use crate::ground::kernel::predicates::{Sign, insphere, orient3d};
use crate::ground::kernel::simplex::{OPPOSITE_EDGE, TET_FACES, ascending};
use crate::ground::kernel::sphere::Circumsphere;
use crate::mesher::half_face::{Marks, NONE, Ring};
use rayon::prelude::*;

/// The most tets, because half-faces are `u32`.
pub(super) const MAX_TETS: usize = (u32::MAX / 4) as usize;

/// The label of a tet without a known body.
pub(super) const NO_BODY: u32 = u32::MAX;

/// Tets with adjacency, locked faces and bodies.
#[derive(Clone, Debug, Default)]
pub(super) struct Tetrahedra {
    /// The positions of the vertices, rounded for those in `exact`.
    pub points: Vec<Point>,
    /// The exact positions of vertices that doubles do not represent. Empty if there are none.
    pub(super) exact: Vec<Option<Box<Fixed>>>,
    /// The vertices of each tet, positively oriented; a free slot has `NONE` first.
    pub tets: Vec<[u32; 4]>,
    /// The half-face across each face, or `NONE`.
    pub across: Vec<[u32; 4]>,
    /// Bit i: face i is locked.
    pub locked: Vec<u8>,
    /// The body of each tet, or `NO_BODY`.
    pub bodies: Vec<u32>,
    /// One tet at each vertex, or `NONE`.
    pub at_vertex: Vec<u32>,
    /// The ranks of the vertices, which decide whether a vertex on a circumsphere counts as inside;
    /// see [`ties`](super::ties). Without ranks it is outside.
    pub ranks: Vec<u32>,
    /// The vertex being inserted.
    pub inserted: u32,
    /// Edges that stay without a locked face, sorted, the lower vertex first.
    kept: Vec<[u32; 2]>,
    /// The slots without a tet.
    pub(super) free: Vec<u32>,
    /// The circumsphere of each tet, computed on first use: vertices of tets must not move.
    pub(super) spheres: Vec<Circumsphere>,
    marks: Marks,
    scratch: Vec<([u32; 3], u32, bool)>,
}

/// Removes the values of slots without a number.
fn keep<T>(values: &mut Vec<T>, slots: &[u32]) {
    let mut slots = slots.iter();
    values.retain(|_| slots.next() != Some(&NONE));
    values.shrink_to_fit();
}

impl Tetrahedra {
    /// A mesh of points without tets.
    pub fn new(points: Vec<Point>) -> Self {
        let at_vertex = vec![NONE; points.len()];
        Self { points, at_vertex, ..Self::default() }
    }

    /// The slots that hold a tet.
    pub fn alive(&self) -> impl Iterator<Item = u32> + '_ {
        (0..self.tets.len() as u32).filter(|&t| self.is_alive(t))
    }

    /// The half-faces of all tets, in ascending order if collected.
    pub fn half_faces(&self) -> impl ParallelIterator<Item = u32> + '_ {
        let slots = (0..self.tets.len() as u32).into_par_iter();
        slots.filter(|&t| self.is_alive(t)).flat_map_iter(|t| 4 * t..4 * t + 4)
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

    /// Removes the last points, down to `count`; they must have no tets.
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

    /// The mean of the corners of a tet.
    pub fn centroid(&self, tet: u32) -> Point {
        let [a, b, c, d] = self.corners(tet);
        Point::from((a.coords + b.coords + c.coords + d.coords) * 0.25)
    }

    /// The vertices of a half-face, oriented outward from its tet.
    #[inline]
    pub fn face(&self, half_face: u32) -> [u32; 3] {
        let tet = &self.tets[(half_face >> 2) as usize];
        let [i, j, k] = TET_FACES[(half_face & 3) as usize];
        [tet[i], tet[j], tet[k]]
    }

    /// The corners of a half-face, oriented outward from its tet.
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

    /// Whether a face is on the seam of a block: its neighbour is not in this mesh; see
    /// [`blocks`](super::blocks).
    #[inline]
    pub fn is_seam(&self, half_face: u32) -> bool {
        self.across(half_face) == NONE && !self.is_locked(half_face)
    }

    /// Sets the edges that stay without a locked face: sorted, the lower vertex first.
    pub fn keep_edges(&mut self, edges: Vec<[u32; 2]>) {
        self.kept = edges;
    }

    /// The edges set by [`keep_edges`](Self::keep_edges).
    pub fn kept_edges(&self) -> &[[u32; 2]] {
        &self.kept
    }

    /// Whether an edge was set by [`keep_edges`](Self::keep_edges).
    pub fn is_kept(&self, a: u32, b: u32) -> bool {
        !self.kept.is_empty() && self.kept.binary_search(&[a.min(b), a.max(b)]).is_ok()
    }

    /// Whether any edges were set by [`keep_edges`](Self::keep_edges).
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

    /// Whether four vertices form a positive tet, by exact sign.
    #[inline]
    pub fn is_positive(&self, [a, b, c, d]: [u32; 4]) -> bool {
        self.side([a, b, c], d) == Sign::Positive
    }

    /// The exact sign of the volume of the tet of a face and a vertex.
    #[inline]
    pub fn side(&self, [a, b, c]: [u32; 3], d: u32) -> Sign {
        if self.exact.is_empty() {
            orient3d(self.point(a), self.point(b), self.point(c), self.point(d))
        } else {
            self.exact_side([a, b, c, d])
        }
    }

    /// The circumsphere of a tet, stored or computed.
    #[inline]
    pub fn sphere(&self, tet: u32) -> Circumsphere {
        let kept = self.spheres[tet as usize];
        if kept.is_known() { kept } else { Circumsphere::of(self.corners(tet)) }
    }

    /// The circumsphere of a tet, computed if necessary and stored.
    #[inline]
    pub fn keep_sphere(&mut self, tet: u32) -> Circumsphere {
        let sphere = self.sphere(tet);
        self.spheres[tet as usize] = sphere;
        sphere
    }

    /// Stores the circumspheres of all tets.
    pub fn keep_spheres(&mut self) {
        let mut spheres = std::mem::take(&mut self.spheres);
        spheres.par_iter_mut().zip(&self.tets).for_each(|(sphere, tet)| {
            if !sphere.is_known() && tet[0] != NONE {
                *sphere = Circumsphere::of(tet.each_ref().map(|&v| self.point(v)));
            }
        });
        self.spheres = spheres;
    }

    /// Whether a point is strictly inside the circumsphere of a tet, exactly. With
    /// [`ranks`](Self::ranks) it must be the vertex being inserted.
    #[inline]
    pub fn is_in_sphere(&mut self, tet: u32, point: &Point) -> bool {
        self.spheres[tet as usize].contains(point).unwrap_or_else(|| self.is_in_sphere_slow(tet, point))
    }

    /// The slow path of [`Tetrahedra::is_in_sphere`], if the stored sphere does not decide.
    #[inline(never)]
    fn is_in_sphere_slow(&mut self, tet: u32, point: &Point) -> bool {
        self.keep_sphere(tet).contains(point).unwrap_or_else(|| {
            let [a, b, c, d] = self.corners(tet);
            match insphere(a, b, c, d, point) {
                Sign::Zero => !self.ranks.is_empty() && super::ties::is_inside(self, tet, self.inserted),
                sign => sign == Sign::Positive,
            }
        })
    }

    /// The index of `vertex` in `tet`.
    #[inline]
    pub fn index_of(&self, tet: u32, vertex: u32) -> Option<usize> {
        self.tets[tet as usize].iter().position(|&v| v == vertex)
    }

    /// Clears all marks.
    pub fn clear_marks(&mut self) {
        self.marks.clear(self.tets.len());
    }

    /// Marks a tet; false if it was marked already.
    #[inline]
    pub fn mark(&mut self, tet: u32) -> bool {
        self.marks.add(tet)
    }

    #[inline]
    pub fn unmark(&mut self, tet: u32) {
        self.marks.remove(tet);
    }

    #[inline]
    pub fn is_marked(&self, tet: u32) -> bool {
        self.marks.contains(tet)
    }

    /// Adds a tet without neighbours; returns its slot.
    pub fn add_tet(&mut self, tet: [u32; 4], body: u32) -> u32 {
        let slot = self.free_slot();
        self.write_tet(slot, tet, body);
        self.across[slot as usize] = [NONE; 4];
        self.locked[slot as usize] = 0;
        slot
    }

    /// A slot without a tet, which the caller must fill at once.
    #[inline]
    pub fn free_slot(&mut self) -> u32 {
        self.free.pop().unwrap_or_else(|| {
            self.tets.push([NONE; 4]);
            self.across.push([NONE; 4]);
            self.locked.push(0);
            self.bodies.push(NO_BODY);
            self.spheres.push(Circumsphere::UNKNOWN);
            self.marks.push();
            (self.tets.len() - 1) as u32
        })
    }

    /// Removes all slots without a tet; the others keep their order.
    pub fn remove_free_slots(&mut self) {
        let mut slots = Vec::with_capacity(self.tets.len());
        let mut next = 0;
        for tet in &self.tets {
            slots.push(if tet[0] == NONE { NONE } else { next });
            next += u32::from(tet[0] != NONE);
        }
        let number = |slot: u32| if slot == NONE { NONE } else { slots[slot as usize] };
        let half_face = |h: u32| if h == NONE { NONE } else { 4 * number(h >> 2) + (h & 3) };
        keep(&mut self.across, &slots);
        self.across.par_iter_mut().for_each(|across| *across = across.map(half_face));
        self.at_vertex.iter_mut().for_each(|slot| *slot = number(*slot));
        keep(&mut self.tets, &slots);
        keep(&mut self.locked, &slots);
        keep(&mut self.bodies, &slots);
        keep(&mut self.spheres, &slots);
        self.free = Vec::new();
        self.clear_marks();
    }

    /// The points, the vertices and bodies of the slots, and one tet of each vertex. All else is
    /// freed.
    pub fn into_parts(self) -> (Vec<Point>, Vec<[u32; 4]>, Vec<u32>, Vec<u32>) {
        (self.points, self.tets, self.bodies, self.at_vertex)
    }

    /// Writes a tet into a slot; the caller sets its neighbours and locks.
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

    /// Frees the slot of a tet. Its neighbours still refer to it: the caller must relink them.
    #[inline]
    pub fn remove_tet(&mut self, tet: u32) {
        self.tets[tet as usize][0] = NONE;
        self.free.push(tet);
    }

    /// Links two half-faces.
    #[inline]
    pub fn link(&mut self, one: u32, other: u32) {
        self.across[(one >> 2) as usize][(one & 3) as usize] = other;
        if other != NONE {
            self.across[(other >> 2) as usize][(other & 3) as usize] = one;
        }
    }

    /// All tets at a vertex that are connected through faces, in a deterministic order. Uses the
    /// marks.
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

    /// The vertices that share a tet with this one, ascending. Uses the marks; `tets` is scratch.
    pub fn neighbours(&mut self, vertex: u32, tets: &mut Vec<u32>) -> Vec<u32> {
        self.star(vertex, tets);
        let mut beside: Vec<u32> = tets.iter().flat_map(|&t| self.tets[t as usize]).collect();
        beside.sort_unstable();
        beside.dedup();
        beside.retain(|&v| v != vertex);
        beside
    }

    /// One tet with edge (a, b), if it is an edge of the mesh. Uses the marks; `tets` is scratch.
    pub fn tet_at_edge(&mut self, a: u32, b: u32, tets: &mut Vec<u32>) -> Option<u32> {
        self.star(a, tets);
        tets.iter().copied().find(|&t| self.tets[t as usize].contains(&b))
    }

    /// The ring around edge a→b of `tet`; false if the edge is on the boundary of the mesh.
    pub fn ring(&self, tet: u32, a: u32, b: u32, ring: &mut Ring) -> bool {
        ring.clear();
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

    /// Replaces tets by others that fill the same polyhedron.
    ///
    /// Boundary faces keep their neighbours and locks. New tets get the body `body`; their slots
    /// are appended to `slots`.
    ///
    /// # Panics
    /// If the new tets do not have the same boundary as the old ones, or a locked face would be
    /// removed.
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
                    faces.push((ascending(self.face(half_face)), other, self.is_locked(half_face)));
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
            faces.extend((0..4).map(|i| (ascending(self.face(4 * t + i)), 4 * t + i, false)));
        }
        self.match_faces(&mut faces, outer);
        self.scratch = faces;
    }

    /// Links half-faces with equal vertices; the first `outer` belong to the surrounding tets.
    fn match_faces(&mut self, faces: &mut [([u32; 3], u32, bool)], outer: usize) {
        // An outer half-face may be `NONE`, so outer and new faces are told apart by position.
        let mut order: Vec<u32> = (0..faces.len() as u32).collect();
        order.sort_unstable_by_key(|&i| (faces[i as usize].0, i));
        let pairs = order.chunks_exact(2);
        assert!(pairs.remainder().is_empty(), "the surface of a cavity changed");
        for pair in pairs {
            let (one, other) = (faces[pair[0] as usize], faces[pair[1] as usize]);
            assert!(one.0 == other.0 && pair[1] as usize >= outer, "face {:?} has no partner", one.0);
            self.link(other.1, one.1);
            if one.2 {
                self.lock(other.1);
            }
        }
    }

    /// Replaces tets by others, each with its body, when the boundary and the facets among them may
    /// change.
    ///
    /// Faces that are facets are locked; a new face without a partner must be a facet and becomes a
    /// boundary face. Returns false without a change if the new tets do not fit. The slots of the
    /// new tets are appended to `slots`.
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
                faces.push((ascending(self.face(half_face)), Some(other)));
            }
        }
        let outer = faces.len();
        for (tet, _) in new {
            faces.extend(TET_FACES.map(|face| (ascending(face.map(|i| tet[i])), None)));
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

    /// All violated invariants as sentences.
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
                } else if ascending(self.face(half_face)) != ascending(self.face(other)) {
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
