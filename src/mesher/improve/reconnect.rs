//! Reconnection: some tets are removed, and their cavity is filled with the best tets of its
//! vertices.
//!
//! Branch and bound over all fillings of a small polyhedron (Liu, Chen, Sun 2009, "Small polyhedron
//! reconnection for mesh improvement and its implementation based on advancing front technique";
//! Marot, Verhetsel, Remacle 2020, "Reviving the search for optimal tetrahedralizations"): a face
//! of the cavity is joined to each vertex that gives a tet better than the worst so far, and the
//! rest of the cavity is filled in the same way. It finds improvements that no sequence of
//! improving swaps reaches, and removes free vertices if that is better.
//!
//! No intersection tests are needed: all tets are positive, and their unmatched faces are those of
//! the cavity. So the number of tets that contain a point in general position is the winding number
//! of the cavity's surface: one inside, zero outside.

use crate::ground::kernel::simplex::from_lowest;
use crate::ground::mesh::TET_FACES;
use crate::mesher::improve::complex::Complex;
use crate::mesher::improve::objective::{INVERTED, Objective};
use crate::mesher::improve::swap::{commit, least_after};

/// The sizes of the cavities that are tried, in tets.
const CAVITY_SIZES: [usize; 3] = [10, 18, 28];

/// The most vertices of a cavity.
const MOST_VERTICES: usize = 20;

/// The most partial fillings visited in one search.
const PATIENCE: usize = 1500;

/// The number of sets of four vertices.
const QUADRUPLES: usize =
    MOST_VERTICES * (MOST_VERTICES - 1) * (MOST_VERTICES - 2) * (MOST_VERTICES - 3) / 24;

/// The cavity and the search in it, with scratch memory.
#[derive(Default)]
pub(super) struct Reconnector {
    cavity: Vec<u32>,
    /// The cavity's vertices; its faces and tets refer to positions in this list.
    vertices: Vec<u32>,
    scores: Scores,
    /// The faces of the unfilled part, outward, each with its lowest vertex first.
    front: Vec<[u8; 3]>,
    /// The tets of the current partial filling and of the best complete one.
    filling: Vec<([u8; 4], f64)>,
    best: Vec<([u8; 4], f64)>,
    /// Bound that the worst tet must exceed.
    least: f64,
    patience: usize,
}

/// A face, and the vertices to which it can be joined with the scores of the tets.
type Choice = ([u8; 3], Vec<(u8, f64)>);

/// Cached scores of tets of the cavity's vertices.
#[derive(Default)]
struct Scores {
    /// For each ascending quadruple, its score and whether that order is positive; NaN if not yet
    /// computed.
    known: Vec<(f64, bool)>,
}

fn other_side([a, b, c]: [u8; 3]) -> [u8; 3] {
    [a, c, b]
}

impl Scores {
    fn clear(&mut self) {
        self.known.clear();
        self.known.resize(QUADRUPLES, (f64::NAN, false));
    }

    /// The score of a tet; [`INVERTED`] if it is not positive.
    fn of(&mut self, complex: &Complex, objective: &Objective, vertices: &[u32], tet: [u8; 4]) -> f64 {
        let mut sorted = tet;
        let mut even = true;
        for [i, j] in [[0, 1], [2, 3], [0, 2], [1, 3], [1, 2]] {
            if sorted[i] > sorted[j] {
                sorted.swap(i, j);
                even = !even;
            }
        }
        let [a, b, c, d] = sorted.map(usize::from);
        // Combinatorial number system.
        let slot = a + b * (b - 1) / 2 + c * (c - 1) * (c - 2) / 6 + d * (d - 1) * (d - 2) * (d - 3) / 24;
        let known = &mut self.known[slot];
        if known.0.is_nan() {
            let [a, b, c, d] = sorted.map(|k| vertices[usize::from(k)]);
            *known = (objective.score(&complex.points, [a, b, c, d]), true);
            if known.0 == INVERTED {
                *known = (objective.score(&complex.points, [b, a, c, d]), false);
            }
        }
        if known.1 == even { known.0 } else { INVERTED }
    }
}

impl Reconnector {
    /// Refills a cavity around `tet` if that raises its worst score.
    ///
    /// Each visited partial filling uses one of `steps`; the search ends when none is left.
    pub fn improve(
        &mut self,
        complex: &mut Complex,
        objective: &Objective,
        tet: u32,
        steps: &mut usize,
    ) -> bool {
        if *steps == 0 {
            return false;
        }
        self.cavity.clear();
        self.vertices.clear();
        self.take(complex, tet);
        for size in CAVITY_SIZES {
            if !self.grow(complex, size) {
                return false;
            }
            self.patience = PATIENCE.min(*steps);
            *steps -= self.patience;
            let found = self.search_cavity(complex, objective);
            *steps += self.patience;
            if found {
                let new: Vec<([u32; 4], f64)> = self.best.iter().map(|&(t, s)| (self.global(t), s)).collect();
                if commit(complex, &self.cavity, &new) {
                    return true;
                }
            }
        }
        false
    }

    fn global(&self, tet: [u8; 4]) -> [u32; 4] {
        tet.map(|k| self.vertices[usize::from(k)])
    }

    fn take(&mut self, complex: &Complex, tet: u32) {
        self.cavity.push(tet);
        for v in complex.tets[tet as usize] {
            if !self.vertices.contains(&v) {
                self.vertices.push(v);
            }
        }
    }

    /// Grows the cavity to `size` tets, first by tets without new vertices, then by the worst;
    /// false if it cannot grow.
    fn grow(&mut self, complex: &Complex, size: usize) -> bool {
        while self.cavity.len() < size {
            let mut best: Option<(bool, f64, u32)> = None;
            for &t in &self.cavity {
                for k in 0..4 {
                    let Some((next, opposite)) = complex.neighbour(t, k) else { continue };
                    if self.cavity.contains(&next) {
                        continue;
                    }
                    let is_new = !self.vertices.contains(&complex.tets[next as usize][opposite]);
                    if is_new && self.vertices.len() == MOST_VERTICES {
                        continue;
                    }
                    let score = complex.scores[next as usize];
                    if best.is_none_or(|b| (is_new, score) < (b.0, b.1)) {
                        best = Some((is_new, score, next));
                    }
                }
            }
            let Some((_, _, next)) = best else { return false };
            self.take(complex, next);
        }
        true
    }

    /// Stores the best filling of the cavity in `best`; false if none is better than the present
    /// one.
    fn search_cavity(&mut self, complex: &Complex, objective: &Objective) -> bool {
        self.front.clear();
        for &t in &self.cavity {
            let local = complex.tets[t as usize].map(|v| {
                let place = self.vertices.iter().position(|&w| w == v);
                place.expect("the cavity has its tets' vertices") as u8
            });
            for (k, corners) in TET_FACES.iter().enumerate() {
                let is_inside = complex.neighbour(t, k).is_some_and(|(next, _)| self.cavity.contains(&next));
                if !is_inside {
                    self.front.push(from_lowest(corners.map(|i| local[i])));
                }
            }
        }
        // Enclosed vertices may be removed only if free; and the two sides of a crack could not be
        // distinguished.
        let front = &self.front;
        let kept =
            |(k, &v): (usize, &u32)| complex.free[v as usize] || front.iter().any(|f| f.contains(&(k as u8)));
        let has_crack = front.iter().any(|&f| front.contains(&other_side(f)));
        if has_crack || !self.vertices.iter().enumerate().all(kept) {
            return false;
        }
        self.scores.clear();
        self.filling.clear();
        self.best.clear();
        self.least = least_after(complex.worst_of(&self.cavity));
        self.fill(complex, objective, f64::INFINITY);
        !self.best.is_empty()
    }

    /// Fills the rest recursively; `worst` is the least score so far.
    fn fill(&mut self, complex: &Complex, objective: &Objective, worst: f64) {
        if self.front.is_empty() {
            self.best.clone_from(&self.filling);
            self.least = worst;
            return;
        }
        if self.patience == 0 {
            return;
        }
        self.patience -= 1;
        let mut apexes = self.apexes_of_narrowest(complex, objective);
        apexes.1.sort_unstable_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
        let ([a, b, c], apexes) = apexes;
        for (apex, score) in apexes {
            // A better filling may have been found in the meantime.
            if worst.min(score) <= self.least {
                break;
            }
            let tet = [apex, a, b, c];
            let before = self.front.clone();
            self.filling.push((tet, score));
            for corners in TET_FACES {
                self.match_face(from_lowest(corners.map(|k| tet[k])));
            }
            self.fill(complex, objective, worst.min(score));
            self.filling.pop();
            self.front = before;
        }
    }

    /// Adds an outward face of a new tet: it is removed from the front if it is there, else its
    /// opposite is added.
    fn match_face(&mut self, outward: [u8; 3]) {
        match self.front.iter().position(|&f| f == outward) {
            Some(k) => {
                self.front.swap_remove(k);
            }
            None => self.front.push(other_side(outward)),
        }
    }

    /// The face of the front that can be joined to the fewest vertices, and these vertices with
    /// scores.
    fn apexes_of_narrowest(&mut self, complex: &Complex, objective: &Objective) -> Choice {
        let mut best: Option<Choice> = None;
        let mut apexes = Vec::with_capacity(MOST_VERTICES);
        for &[a, b, c] in &self.front {
            apexes.clear();
            let fewest = best.as_ref().map_or(usize::MAX, |b| b.1.len());
            for apex in 0..self.vertices.len() as u8 {
                if apex == a || apex == b || apex == c {
                    continue;
                }
                let score = self.scores.of(complex, objective, &self.vertices, [apex, a, b, c]);
                // The new faces must not be in the front already.
                let sides = [[a, b, apex], [b, c, apex], [c, a, apex]];
                if score > self.least && !sides.iter().any(|&s| self.front.contains(&from_lowest(s))) {
                    apexes.push((apex, score));
                    if apexes.len() >= fewest {
                        break;
                    }
                }
            }
            if apexes.len() < fewest {
                best = Some(([a, b, c], apexes.clone()));
                if apexes.is_empty() {
                    break;
                }
            }
        }
        best.expect("the front has a face")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesher::improve::blocks::whole;
    use crate::mesher::improve::objective::Measure;
    use crate::mesher::improve::samples::{cube, fan};
    use crate::mesher::improve::swap::Swapper;

    const SHAPES: Objective = Objective { measure: Measure::MeanRatio, legality: None, sharpest: 1.0 };

    #[test]
    fn reconnection_improves_meshes_that_swaps_cannot() {
        let mut done = 0;
        for seed in 0..4 {
            let mut complex = whole(&cube(4, seed));
            complex.score_all(&SHAPES);
            let (mut swapper, mut reconnector) = (Swapper::default(), Reconnector::default());
            while (0..complex.tets.len() as u32)
                .any(|t| complex.is_alive(t) && swapper.improve(&mut complex, &SHAPES, t))
            {}
            let worst =
                |complex: &Complex| complex.living().map(|t| complex.scores[t as usize]).fold(1.0, f64::min);
            let before = worst(&complex);
            for tet in 0..complex.tets.len() as u32 {
                if complex.is_alive(tet) && complex.scores[tet as usize] < 0.3 {
                    let found = reconnector.improve(&mut complex, &SHAPES, tet, &mut 10_000);
                    done += usize::from(found);
                }
            }
            assert!(worst(&complex) >= before);
            complex.check().unwrap();
        }
        assert!(done > 0);
    }

    #[test]
    fn the_best_filling_of_a_fan_is_found_at_once() {
        for (ring, tets) in [(3, 2), (4, 4), (5, 6), (6, 8)] {
            let mut complex = whole(&fan(ring, 4.0));
            complex.score_all(&SHAPES);
            let mut reconnector = Reconnector::default();
            reconnector.take(&complex, 0);
            assert!(!reconnector.grow(&complex, 10), "the fan has fewer tets");
            assert_eq!(reconnector.cavity.len(), ring);
            reconnector.patience = PATIENCE;
            assert!(reconnector.search_cavity(&complex, &SHAPES));
            assert_eq!(reconnector.best.len(), tets);
        }
    }

    #[test]
    fn without_steps_nothing_is_done() {
        let mut complex = whole(&cube(4, 1));
        complex.score_all(&SHAPES);
        let mut reconnector = Reconnector::default();
        assert!((0..40).all(|tet| !reconnector.improve(&mut complex, &SHAPES, tet, &mut 0)));
    }
}
