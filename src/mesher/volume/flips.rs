//! Flips: a face into an edge (2-3), an edge into a triangulation of its ring (3-2, 4-4, n-m).
//!
//! Every new tet is positive by exact sign, so the mesh stays valid. Edges and faces of the surface
//! are never flipped (see [`Constraints`]).

use super::constraints::Constraints;
use super::tetrahedra::Tetrahedra;
use crate::ground::kernel::quality::mean_ratio;
use crate::mesher::half_face::{NONE, Ring};

/// Longer rings are not triangulated: the search is cubic, and edges with long rings are better
/// removed after their neighbours. A typical ring has five or six tets.
const LONGEST_RING: usize = 16;

/// Least mean ratio of tets made by flips, unless nothing else helps.
///
/// Tets of surface vertices that are coplanar up to rounding have a mean ratio near 10⁻¹¹; between
/// sheets at a distance of 10⁻⁹ diagonals some have 10⁻⁶. In needle-shaped surfaces all tets are
/// flatter.
pub(super) const FLAT: f64 = 1e-9;

/// Why a flip was rejected.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Refused {
    /// The edge or face belongs to the surface or to the boundary of the mesh.
    Kept,
    /// No reconnection has only positive tets.
    Inverted,
}

/// Counters, limits and scratch memory of flips.
#[derive(Clone, Debug, Default)]
pub(super) struct Flips {
    /// The tets made by the last flip.
    pub made: Vec<u32>,
    /// The number of flips made.
    pub count: u64,
    /// Remaining attempts at auxiliary flips; see [`Flips::remove_edge_recursively`].
    pub budget: u32,
    /// Flips make no tet of a smaller mean ratio.
    pub least: f64,
    ring: Ring,
    new: Vec<[u32; 4]>,
    best: Vec<(f64, u32)>,
}

impl Flips {
    /// The mean ratio of a tet; minus infinity if it is not positive by exact sign or below
    /// `least`.
    fn quality(&self, mesh: &Tetrahedra, tet: [u32; 4]) -> f64 {
        if !mesh.is_positive(tet) {
            return f64::NEG_INFINITY;
        }
        let [a, b, c, d] = tet.map(|v| mesh.point(v));
        let quality = mean_ratio(a, b, c, d).max(0.0);
        if quality < self.least { f64::NEG_INFINITY } else { quality }
    }

    /// Replaces a face by the edge between the vertices opposite to it (2-3).
    ///
    /// # Errors
    /// The reason if the flip is rejected.
    pub fn remove_face(
        &mut self,
        mesh: &mut Tetrahedra,
        constraints: &Constraints,
        half_face: u32,
    ) -> Result<(), Refused> {
        let other = mesh.across(half_face);
        let [a, b, c] = mesh.face(half_face);
        if other == NONE || constraints.facet([a, b, c]).is_some() {
            return Err(Refused::Kept);
        }
        let (d, e) = (mesh.apex(half_face), mesh.apex(other));
        let new = [[d, e, a, b], [d, e, b, c], [d, e, c, a]];
        if new.iter().any(|&tet| self.quality(mesh, tet) < 0.0) {
            return Err(Refused::Inverted);
        }
        self.made.clear();
        self.count += 1;
        let body = mesh.bodies[(half_face >> 2) as usize];
        mesh.replace(&[half_face >> 2, other >> 2], &new, body, &mut self.made);
        Ok(())
    }

    /// Removes edge (a, b) of `tet` by the triangulation of its ring whose worst tet is best
    /// (Klincsek 1980; Shewchuk 2002).
    ///
    /// If `wanted` are two vertices of the ring, triangulations with an edge between them are
    /// preferred.
    ///
    /// # Errors
    /// The reason if the flip is rejected.
    pub fn remove_edge(
        &mut self,
        mesh: &mut Tetrahedra,
        constraints: &Constraints,
        tet: u32,
        [a, b]: [u32; 2],
        wanted: [u32; 2],
    ) -> Result<(), Refused> {
        if constraints.has_edge(a, b) || !mesh.ring(tet, a, b, &mut self.ring) {
            return Err(Refused::Kept);
        }
        let n = self.ring.vertices.len();
        if n > LONGEST_RING {
            return Err(Refused::Inverted);
        }
        self.new.clear();
        let chord = wanted.map(|v| self.ring.vertices.iter().position(|&r| r == v));
        let through_chord = match chord {
            [Some(i), Some(j)] if i.abs_diff(j) > 1 && i.abs_diff(j) < n - 1 => {
                let (i, j) = (i.min(j), i.max(j));
                self.fill_polygon(mesh, [a, b], i, j) && self.fill_polygon(mesh, [a, b], j, i + n)
            }
            _ => false,
        };
        if !through_chord {
            self.new.clear();
            if !self.fill_polygon(mesh, [a, b], 0, n - 1) {
                return Err(Refused::Inverted);
            }
        }
        self.made.clear();
        self.count += 1;
        let body = mesh.bodies[tet as usize];
        mesh.replace(&self.ring.tets, &self.new, body, &mut self.made);
        Ok(())
    }

    /// Like [`Flips::remove_edge`]; if that is rejected, first removes edges between the ring and
    /// the ends, recursively to `depth`.
    ///
    /// This is recursive edge removal (Si 2015, section 4.2), except that unsuccessful auxiliary
    /// flips are not undone. It stops when the budget is used up.
    ///
    /// # Errors
    /// The reason if the edge is still there and cannot be removed.
    pub fn remove_edge_recursively(
        &mut self,
        mesh: &mut Tetrahedra,
        constraints: &Constraints,
        tet: u32,
        [a, b]: [u32; 2],
        wanted: [u32; 2],
        depth: u32,
    ) -> Result<(), Refused> {
        let refused = match self.remove_edge(mesh, constraints, tet, [a, b], wanted) {
            Err(Refused::Inverted) if depth > 0 => Refused::Inverted,
            other => return other,
        };
        // Removing edges at the ring changes its tets and may remove the edge itself.
        for (r, beside) in std::iter::zip(self.ring.vertices.clone(), self.ring.tets.clone()) {
            for end in [a, b] {
                if self.budget == 0 {
                    return Err(refused);
                }
                self.budget -= 1;
                let mut star = Vec::new();
                let still =
                    mesh.is_alive(beside) && [end, r].iter().all(|v| mesh.tets[beside as usize].contains(v));
                let at = if still { Some(beside) } else { mesh.tet_at_edge(end, r, &mut star) };
                let helped = at.is_some_and(|tet| {
                    self.remove_edge_recursively(mesh, constraints, tet, [end, r], wanted, depth - 1).is_ok()
                });
                if helped {
                    let Some(tet) = mesh.tet_at_edge(a, b, &mut star) else { return Ok(()) };
                    if self.remove_edge(mesh, constraints, tet, [a, b], wanted).is_ok() {
                        return Ok(());
                    }
                }
            }
        }
        Err(refused)
    }

    /// Triangulates the ring from vertex `first` to `last` (indices modulo the ring length) and
    /// appends the tets on both sides to `new`; false if some tet would not be positive.
    fn fill_polygon(&mut self, mesh: &Tetrahedra, edge: [u32; 2], first: usize, last: usize) -> bool {
        let n = last - first + 1;
        if n < 3 {
            return true;
        }
        let ring = &self.ring.vertices;
        let vertex = |i: usize| ring[(first + i) % ring.len()];
        let tets = |i: usize, k: usize, j: usize| {
            let [p, q, r] = [vertex(i), vertex(k), vertex(j)];
            [[p, q, r, edge[1]], [q, p, r, edge[0]]]
        };
        // best[i][j]: worst quality in the best triangulation of i..=j, and the apex of the
        // triangle at edge (i, j).
        self.best.clear();
        self.best.resize(n * n, (f64::INFINITY, NONE));
        for span in 2..n {
            for i in 0..n - span {
                let j = i + span;
                let mut best = (f64::NEG_INFINITY, NONE);
                for k in i + 1..j {
                    let sides = self.best[i * n + k].0.min(self.best[k * n + j].0);
                    if sides <= best.0 {
                        continue;
                    }
                    let worst = tets(i, k, j).iter().fold(sides, |q, &tet| q.min(self.quality(mesh, tet)));
                    if worst > best.0 {
                        best = (worst, k as u32);
                    }
                }
                self.best[i * n + j] = best;
            }
        }
        if self.best[n - 1].0 < 0.0 {
            return false;
        }
        let mut open = vec![(0, n - 1)];
        while let Some((i, j)) = open.pop() {
            if j - i < 2 {
                continue;
            }
            let k = self.best[i * n + j].1 as usize;
            self.new.extend(tets(i, k, j));
            open.extend([(i, k), (k, j)]);
        }
        true
    }
}
