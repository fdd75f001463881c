//! Local reconnection: one face by an edge (2-3), one edge by a triangulation of its ring (3-2, 4-4, n-m).
//!
//! Every new tet is positive by exact sign, so the mesh stays a mesh. What belongs to the surface is never
//! flipped away (see [`Constraints`]).

use super::constraints::Constraints;
use super::tetrahedra::{NONE, Ring, Tetrahedra};
use crate::kernel::quality::mean_ratio;

/// Rings with more tets are left alone: the search is cubic, and long rings belong to edges that
/// are better removed after their neighbours. A usual ring has five or six tets.
const LONGEST_RING: usize = 16;

/// Where vertices of the surface lie in one plane up to rounding, tets of them have a mean ratio of 10⁻¹¹ or so; between sheets that are 10⁻⁹ of the
/// diagonal apart some have 10⁻⁶. Flatter tets are made where nothing else helps: among needles
/// all are.
pub(super) const FLAT: f64 = 1e-9;

/// Why a flip was not made.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Refused {
    /// The edge or face belongs to the surface, or to the outside of the mesh.
    Kept,
    /// No reconnection has positive tets only.
    Inverted,
}

/// Scratch memory of the flips.
#[derive(Clone, Debug, Default)]
pub(super) struct Flips {
    /// The tets that the last flip made.
    pub made: Vec<u32>,
    /// How many flips were made.
    pub count: u64,
    /// How many more edges may be tried in order to help: see [`Flips::remove_edge_with_help`].
    pub budget: u32,
    /// No tet of a smaller mean ratio is made.
    pub least: f64,
    ring: Ring,
    new: Vec<[u32; 4]>,
    best: Vec<(f64, u32)>,
}

impl Flips {
    /// The mean ratio of a tet that is positive by exact sign; below every quality for any that must not be made.
    fn quality(&self, mesh: &Tetrahedra, tet: [u32; 4]) -> f64 {
        if !mesh.is_positive(tet) {
            return f64::NEG_INFINITY;
        }
        let [a, b, c, d] = tet.map(|v| mesh.point(v));
        let quality = mean_ratio(a, b, c, d).max(0.0);
        if quality < self.least { f64::NEG_INFINITY } else { quality }
    }

    /// Replaces a face by the edge between the two vertices opposite to it (2-3).
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

    /// Removes the edge a, b of `tet`, filling its ring with the triangulation whose worst tet is best (Klincsek 1980;
    /// Shewchuk 2002). Where `wanted` are two vertices of the ring, only triangulations with an edge between them count,
    /// if there are any valid ones.
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

    /// As [`Flips::remove_edge`]; where that is refused, edges from its ends to its ring are removed first, and
    /// theirs before, `depth` deep (recursive edge removal, as in Si 2015, section 4.2; we do not undo helping
    /// flips that were in vain), until the budget is spent.
    pub fn remove_edge_with_help(
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
        // While edges at its ring are removed its tets change, and help for these may remove the edge itself.
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
                    self.remove_edge_with_help(mesh, constraints, tet, [end, r], wanted, depth - 1).is_ok()
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

    /// Triangulates the ring's vertices from `first` to `last` (counted on round the ring) and appends the tets
    /// on both sides to `new`; false where some tet would not be positive.
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
        // best[i][j]: the worst quality of the best triangulation of i..=j, and the apex over i, j in it.
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
