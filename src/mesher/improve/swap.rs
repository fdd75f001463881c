//! Swaps: other tets of the same vertices.
//!
//! **Edge removal** replaces the tets around an edge by a triangulation of its ring, joined to both
//! ends; the best triangulation is found by dynamic programming (Klincsek 1980; for tets Shewchuk
//! 2002, "Two discrete optimization algorithms for the topological improvement of tetrahedral
//! meshes", section 2). It includes the flips 3-2 and 4-4. **Face removal** is its inverse: faces
//! sandwiched between two vertices are replaced by the edge between them (Shewchuk 2002, section 3;
//! with one face it is the flip 2-3).

use crate::ground::mesh::{TET_EDGES, TET_FACES};
use crate::mesher::half_face::Ring;
use crate::mesher::improve::complex::{Complex, place};
use crate::mesher::improve::objective::{INVERTED, Objective};

/// Longer rings are skipped: the work grows as n³, and long rings seldom have a better filling
/// (Freitag, Ollivier-Gooch 1997 stop at 7).
const LONGEST_RING: usize = 8;

/// The most faces in one face removal, because the new edge must not have too many tets either.
const MOST_FACES: usize = 6;

/// Least gain of the worst score by a change, to save work and to avoid cycles caused by rounding.
const LEAST_GAIN: f64 = 1e-4;

/// Relative least gain if scores are tiny: inside surfaces of needles tets have scores of 0.001,
/// and gains are small compared with [`LEAST_GAIN`].
const LEAST_PART: f64 = 0.1;

/// The score that the worst tet must exceed after a change, if it is `before` now.
#[inline]
pub(super) fn least_after(before: f64) -> f64 {
    before + LEAST_GAIN.min(LEAST_PART * before.abs())
}

/// A better filling of a cavity.
#[derive(Default)]
struct Swap {
    /// The tets to remove.
    old: Vec<u32>,
    /// The new tets with scores.
    new: Vec<([u32; 4], f64)>,
    /// The gain: the least new score minus the least old one.
    gain: f64,
}

/// Scratch memory of the search.
#[derive(Default)]
pub(super) struct Swapper {
    ring: Ring,
    table: Table,
    found: Swap,
    best: Swap,
}

/// Dynamic programming table: for the interval i..=j of the ring, the worst tet of its best
/// triangulation and its apex.
#[derive(Default)]
struct Table([[(f64, u8); LONGEST_RING]; LONGEST_RING]);

impl Swapper {
    /// Performs the best swap that removes `tet` as the worst of its cavity and raises the worst
    /// score; false if there is none.
    ///
    /// Cavities with a worse tet are skipped: they belong to that tet, which is visited earlier.
    pub fn improve(&mut self, complex: &mut Complex, objective: &Objective, tet: u32) -> bool {
        let own = complex.scores[tet as usize];
        self.find_above(complex, objective, tet, own) && self.commit(complex)
    }

    /// Finds the best swap that removes `tet` and raises the worst score of its cavity; false if
    /// there is none.
    pub fn find(&mut self, complex: &Complex, objective: &Objective, tet: u32) -> bool {
        self.find_above(complex, objective, tet, INVERTED)
    }

    /// [`find`](Self::find) among cavities without a tet worse than `least`.
    fn find_above(&mut self, complex: &Complex, objective: &Objective, tet: u32, least: f64) -> bool {
        self.best.gain = 0.0;
        let mut better = false;
        for [i, j] in TET_EDGES {
            if self.find_edge_removal(complex, objective, tet, [i, j], least)
                && self.found.gain > self.best.gain
            {
                std::mem::swap(&mut self.found, &mut self.best);
                better = true;
            }
        }
        for face in 0..4 {
            if self.find_face_removal(complex, objective, tet, face, least)
                && self.found.gain > self.best.gain
            {
                std::mem::swap(&mut self.found, &mut self.best);
                better = true;
            }
        }
        better
    }

    /// The least score of the new tets of the swap found.
    pub fn worst(&self) -> f64 {
        self.best.new.iter().map(|n| n.1).fold(f64::INFINITY, f64::min)
    }

    /// Performs the swap found, unless a new tet is not positive by exact sign.
    pub fn commit(&self, complex: &mut Complex) -> bool {
        commit(complex, &self.best.old, &self.best.new)
    }

    /// Stores the best filling without the edge between local vertices `i` and `j` in `found`;
    /// false if it is no improvement.
    fn find_edge_removal(
        &mut self,
        complex: &Complex,
        objective: &Objective,
        tet: u32,
        [i, j]: [usize; 2],
        least: f64,
    ) -> bool {
        if !complex.ring(tet, i, j, LONGEST_RING, &mut self.ring) {
            return false;
        }
        let [low, high] = [i, j].map(|k| complex.tets[tet as usize][k]);
        let before = complex.worst_of(&self.ring.tets);
        if before < least {
            return false;
        }
        let ring = &self.ring.vertices;
        let worst = self.table.fill(ring.len(), before, |a, b, c, least| {
            let [a, b, c] = [ring[a], ring[b], ring[c]];
            let score = |tet| objective.score_above(&complex.points, tet, least);
            let upper = score([a, b, c, high]);
            if upper <= least { upper } else { upper.min(score([a, c, b, low])) }
        });
        if worst <= least_after(before) {
            return false;
        }
        self.found.gain = worst - before;
        self.found.old.clone_from(&self.ring.tets);
        self.found.new.clear();
        let new = &mut self.found.new;
        self.table.triangles(0, ring.len() - 1, &mut |a, b, c| {
            let [a, b, c] = [ring[a], ring[b], ring[c]];
            for tet in [[a, b, c, high], [a, c, b, low]] {
                new.push((tet, objective.score(&complex.points, tet)));
            }
        });
        true
    }

    /// Stores the best filling without the face opposite to local vertex `face`, and possibly
    /// without adjacent faces, in `found`; false if it is no improvement.
    fn find_face_removal(
        &mut self,
        complex: &Complex,
        objective: &Objective,
        tet: u32,
        face: usize,
        least: f64,
    ) -> bool {
        let Some((other, far)) = complex.neighbour(tet, face) else { return false };
        if complex.scores[other as usize] < least {
            return false;
        }
        let low = complex.tets[tet as usize][face];
        let high = complex.tets[other as usize][far];
        let mut sandwich = Sandwich { complex, objective, low, high, old: vec![tet, other], new: Vec::new() };
        let [a, b, c] = TET_FACES[face].map(|k| complex.tets[tet as usize][k]);
        let mut worst = f64::INFINITY;
        let mut before = complex.worst_of(&[tet, other]);
        for [u, v, w] in [[a, b, c], [b, c, a], [c, a, b]] {
            let side = sandwich.best_side([tet, other], [u, v], w, before);
            worst = worst.min(side.new);
            before = before.min(side.old);
            if worst <= least_after(before) {
                return false;
            }
        }
        self.found.gain = worst - before;
        self.found.old = sandwich.old;
        self.found.new = sandwich.new;
        true
    }
}

impl Table {
    /// Computes the best triangulation of a ring of `n` vertices.
    ///
    /// `quality(a, b, c, least)` returns the worst tet of a triangle, or any value up to `least` if
    /// it is not above that.
    fn fill(&mut self, n: usize, least: f64, quality: impl Fn(usize, usize, usize, f64) -> f64) -> f64 {
        for i in 0..n - 1 {
            self.0[i][i + 1] = (f64::INFINITY, 0);
        }
        for length in 2..n {
            for i in 0..n - length {
                let j = i + length;
                let mut best = (INVERTED, 0);
                for k in i + 1..j {
                    let sides = self.0[i][k].0.min(self.0[k][j].0);
                    let needed = best.0.max(least);
                    if sides > needed {
                        let worst = sides.min(quality(i, k, j, needed));
                        if worst > needed {
                            best = (worst, k as u8);
                        }
                    }
                }
                self.0[i][j] = best;
            }
        }
        self.0[0][n - 1].0
    }

    fn triangles(&self, i: usize, j: usize, take: &mut impl FnMut(usize, usize, usize)) {
        if j > i + 1 {
            let k = self.0[i][j].1 as usize;
            take(i, k, j);
            self.triangles(i, k, take);
            self.triangles(k, j, take);
        }
    }
}

/// Faces between two vertices that are removed together.
struct Sandwich<'a> {
    complex: &'a Complex,
    objective: &'a Objective<'a>,
    low: u32,
    high: u32,
    old: Vec<u32>,
    new: Vec<([u32; 4], f64)>,
}

/// The worst new tet beyond an edge of a sandwiched face, and the worst tet removed there.
struct Side {
    new: f64,
    old: f64,
}

impl Sandwich<'_> {
    /// The better choice at edge (`u`, `v`) of the face (u, v, `w`) between the `pair` of tets
    /// below and above: end with the tet (low, high, u, v), or remove the next face too.
    fn best_side(&mut self, pair: [u32; 2], [u, v]: [u32; 2], w: u32, before: f64) -> Side {
        let tet = [self.low, self.high, u, v];
        let ending = Side { new: self.objective.score(&self.complex.points, tet), old: f64::INFINITY };
        let (olds, news) = (self.old.len(), self.new.len());
        if ending.new <= least_after(before)
            && let Some((next, beyond)) = self.across(pair, w)
            && olds + 2 <= 2 * MOST_FACES
        {
            self.old.extend(next);
            let gone = self.complex.worst_of(&next);
            let least = before.min(gone);
            let left = self.best_side(next, [u, beyond], v, least);
            let right = self.best_side(next, [beyond, v], u, least);
            let wider = Side { new: left.new.min(right.new), old: gone.min(left.old).min(right.old) };
            if wider.new > ending.new {
                return wider;
            }
            self.old.truncate(olds);
            self.new.truncate(news);
        }
        self.new.push((tet, ending.new));
        ending
    }

    /// The tets below and above the face beyond the edge opposite to `w`, and its third vertex, if
    /// that face is between the two ends too.
    fn across(&self, [below, above]: [u32; 2], w: u32) -> Option<([u32; 2], u32)> {
        let step = |tet: u32| {
            let corners = self.complex.tets[tet as usize];
            let (next, face) = self.complex.neighbour(tet, place(corners, w))?;
            Some((next, self.complex.tets[next as usize][face]))
        };
        let (lower, beyond) = step(below)?;
        let (upper, same) = step(above)?;
        let corners = self.complex.tets[lower as usize];
        let face = corners.iter().position(|&c| c == self.low)?;
        let joined = beyond == same && self.complex.neighbour(lower, face).map(|n| n.0) == Some(upper);
        (joined && !self.old.contains(&lower) && !self.old.contains(&upper))
            .then_some(([lower, upper], beyond))
    }
}

/// Refills a cavity if all new tets are positive by exact sign and nothing that must stay is lost;
/// else changes nothing.
pub(super) fn commit(complex: &mut Complex, old: &[u32], new: &[([u32; 4], f64)]) -> bool {
    let allowed = new.iter().all(|&(tet, _)| complex.is_positive(tet)) && complex.may_replace(old, new);
    if allowed {
        complex.replace(old, new);
    }
    allowed
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesher::improve::blocks::whole;
    use crate::mesher::improve::objective::Measure;
    use crate::mesher::improve::samples::{cube, fan};

    const SHAPES: Objective = Objective { measure: Measure::MeanRatio, legality: None, sharpest: 1.0 };

    /// Performs all improving swaps; checks that each improves the worst tet involved.
    fn swap_all(complex: &mut Complex) -> usize {
        complex.score_all(&SHAPES);
        let mut swapper = Swapper::default();
        let mut swaps = 0;
        for tet in 0..complex.tets.len() as u32 {
            if complex.is_alive(tet) && swapper.find(complex, &SHAPES, tet) {
                let before = complex.worst_of(&swapper.best.old);
                assert!(before <= complex.scores[tet as usize]);
                assert!(swapper.worst() > before);
                assert!((swapper.worst() - before - swapper.best.gain).abs() < 1e-12);
                swaps += usize::from(swapper.commit(complex));
            }
        }
        complex.check().unwrap();
        swaps
    }

    #[test]
    fn an_edge_with_flat_tets_around_it_is_removed() {
        // Rings of 3, 4, … vertices around an edge that is much too long: 3-2, 4-4, 5-6, …
        for (ring, tets) in [(3, 2), (4, 4), (5, 6), (6, 8), (7, 10)] {
            let mut complex = whole(&fan(ring, 4.0));
            assert!(swap_all(&mut complex) > 0);
            assert_eq!(complex.living().count(), tets);
        }
    }

    #[test]
    fn faces_between_two_near_vertices_are_removed() {
        // A ring of n leaves n − 2 faces between the ends; one is the flip 2-3.
        for ring in [3, 4, 5, 6] {
            let mut complex = whole(&fan(ring, 4.0));
            swap_all(&mut complex);
            // The ends of the edge approach each other, so the edge is an improvement.
            complex.points[0].z = 0.35;
            complex.points[1].z = -0.35;
            assert!(swap_all(&mut complex) > 0);
            assert_eq!(complex.living().count(), ring, "the fan is back");
        }
    }

    #[test]
    fn good_tets_are_left_alone() {
        let mut complex = whole(&fan(5, 0.6));
        assert_eq!(swap_all(&mut complex), 0);
    }

    #[test]
    fn swaps_in_bad_cubes_keep_the_complex_valid() {
        for seed in 0..8 {
            let mut complex = whole(&cube(4, seed));
            assert!(swap_all(&mut complex) > 10);
        }
    }
}
