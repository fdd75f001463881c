//! Smoothing: a vertex is moved so that the worst tet of its star improves.
//!
//! First Laplacian smoothing, the mean of the neighbours, used only if it is an improvement. Then
//! ascent for the worst tet (Freitag, Ollivier-Gooch 1997, "Tetrahedral mesh improvement using
//! swapping and smoothing", section 3): the minimum of several smooth functions rises fastest along
//! the shortest vector in the convex hull of the gradients of the least ones; the step ends where,
//! by the gradients, another tet becomes the worst.

use crate::mesher::half_face::NONE;
use crate::mesher::improve::complex::{Complex, place};
use crate::mesher::improve::limits::TetLimits;
use crate::mesher::improve::objective::Objective;
use crate::mesher::improve::swap::least_after;
use crate::{Point, Vector};

/// Tets this close to the worst of the star determine the direction. Smaller bands zigzag between
/// two tets, larger ones follow irrelevant tets.
const ACTIVE_BAND: f64 = 0.03;

/// The most ascent steps per visit: neighbours move too, so convergence is not needed.
const STEPS: usize = 5;

/// The most halvings of a step.
const HALVINGS: usize = 4;

/// The longest step, as a fraction of the mean distance to the neighbours.
const LONGEST_STEP: f64 = 0.3;

/// A step that gains less ends the visit.
const SMALL_STEP_GAIN: f64 = 2e-3;

/// The most iterations for the shortest vector, which only needs to be a direction of ascent.
const HULL_ROUNDS: usize = 24;

/// Even permutations that move each vertex to the front.
const TO_FRONT: [[usize; 4]; 4] = [[0, 1, 2, 3], [1, 0, 3, 2], [2, 3, 0, 1], [3, 2, 1, 0]];

/// The star of the vertex being moved, and scratch memory.
#[derive(Default)]
pub(super) struct Smoother {
    star: Vec<u32>,
    others: Vec<[Point; 3]>,
    /// For each tet the index of its limits in `limits`, or [`NONE`].
    limit_of: Vec<u32>,
    limits: Vec<TetLimits>,
    values: Vec<f64>,
    gradients: Vec<Vector>,
    active: Vec<Vector>,
    weights: Vec<f64>,
}

impl Smoother {
    /// Moves a free vertex if that improves the worst shape of its star, unless that is at least
    /// `enough`. (Legality does not depend on positions.)
    pub fn improve(
        &mut self,
        complex: &mut Complex,
        objective: &Objective,
        vertex: u32,
        enough: f64,
    ) -> bool {
        if !complex.free[vertex as usize] {
            return false;
        }
        complex.star(vertex, &mut self.star);
        if self.star.is_empty() {
            return false;
        }
        let shape = |t: &u32| Objective::shape_of_score(complex.scores[*t as usize]);
        let before = self.star.iter().map(shape).fold(f64::INFINITY, f64::min);
        if before >= enough {
            return false;
        }
        self.clear();
        for k in 0..self.star.len() {
            let tet = complex.tets[self.star[k] as usize];
            let [_, a, b, c] = TO_FRONT[place(tet, vertex)].map(|k| tet[k]);
            self.push(complex, objective, vertex, [a, b, c]);
        }
        let start = complex.points[vertex as usize];
        let (mut at, mut worst) = (start, before);
        let middle = self.middle();
        let value = self.worst_above(objective, &middle, least_after(worst));
        if let Some(value) = value {
            (at, worst) = (middle, value);
        }
        let (at, worst) = self.ascend(objective, at, worst);
        worst > least_after(before) && self.commit(complex, objective, vertex, at)
    }

    /// The position in the cavity bounded by `faces` at which the worst tet of a vertex is best;
    /// all faces must be visible from `start`.
    pub fn best_place(
        &mut self,
        complex: &Complex,
        objective: &Objective,
        faces: impl Iterator<Item = [u32; 3]>,
        start: Point,
    ) -> Point {
        self.clear();
        for face in faces {
            self.push(complex, objective, NONE, face);
        }
        match self.worst_above(objective, &start, 0.0) {
            Some(worst) => self.ascend(objective, start, worst).0,
            None => start,
        }
    }

    fn clear(&mut self) {
        self.others.clear();
        self.limit_of.clear();
        self.limits.clear();
    }

    /// Adds the tet of the moving vertex, [`NONE`] for a new one, and three others.
    fn push(&mut self, complex: &Complex, objective: &Objective, vertex: u32, others: [u32; 3]) {
        self.others.push(others.map(|v| complex.points[v as usize]));
        let limits = objective.limits([vertex, others[0], others[1], others[2]]);
        self.limit_of.push(if limits.is_some() { self.limits.len() as u32 } else { NONE });
        self.limits.extend(limits);
    }

    /// The tets with the moving vertex at `at`: their corners and the limits of their edges.
    fn tets(&self, at: Point) -> impl Iterator<Item = ([Point; 4], Option<&TetLimits>)> {
        let limits = self.limit_of.iter().map(|&k| self.limits.get(k as usize));
        self.others.iter().zip(limits).map(move |(&[a, b, c], limits)| ([at, a, b, c], limits))
    }

    /// The mean of the neighbours, weighted by their number of tets in the star.
    fn middle(&self) -> Point {
        let sum: Vector = self.others.iter().flatten().map(|p| p.coords).sum();
        Point::from(sum / (3 * self.others.len()) as f64)
    }

    /// The worst shape of the star with its vertex at `at`, if it is above `least`.
    fn worst_above(&self, objective: &Objective, at: &Point, least: f64) -> Option<f64> {
        let mut worst = f64::INFINITY;
        for (p, limits) in self.tets(*at) {
            worst = worst.min(objective.shape_above(&p, limits, least));
            if worst <= least {
                return None;
            }
        }
        Some(worst)
    }

    fn ascend(&mut self, objective: &Objective, mut at: Point, mut worst: f64) -> (Point, f64) {
        let reach = self.others.iter().flatten().map(|p| (p - at).norm()).sum::<f64>()
            / (3 * self.others.len()) as f64;
        for _ in 0..STEPS {
            let mut values = std::mem::take(&mut self.values);
            let mut gradients = std::mem::take(&mut self.gradients);
            values.clear();
            gradients.clear();
            for (p, limits) in self.tets(at) {
                let (value, gradient) = objective.gradient(&p, limits, worst + 2.0 * ACTIVE_BAND);
                values.push(value);
                gradients.push(gradient);
            }
            (self.values, self.gradients) = (values, gradients);
            self.active.clear();
            let band = self.values.iter().zip(&self.gradients).filter(|(v, _)| **v <= worst + ACTIVE_BAND);
            self.active.extend(band.map(|(_, g)| *g));
            // Empty if the worst tet counts as inverted because of its angles only.
            if self.active.is_empty() {
                break;
            }
            let direction = shortest_in_hull(&self.active, &mut self.weights);
            let slope = direction.norm_squared();
            if slope.sqrt() * reach < SMALL_STEP_GAIN {
                break;
            }
            // The step at which another tet becomes the worst, by the gradients.
            let mut step = LONGEST_STEP * reach / slope.sqrt();
            for (value, gradient) in self.values.iter().zip(&self.gradients) {
                let rise = gradient.dot(&direction);
                if *value > worst + ACTIVE_BAND && rise < slope {
                    step = step.min((value - worst) / (slope - rise));
                }
            }
            let mut next = None;
            for _ in 0..HALVINGS {
                let there = at + direction * step;
                if let Some(value) = self.worst_above(objective, &there, least_after(worst)) {
                    next = Some((there, value));
                    break;
                }
                step *= 0.5;
            }
            let Some((there, value)) = next else { break };
            let gain = value - worst;
            (at, worst) = (there, value);
            if gain < SMALL_STEP_GAIN {
                break;
            }
        }
        (at, worst)
    }

    /// Moves the vertex if all tets of its star stay positive by exact sign.
    fn commit(&self, complex: &mut Complex, objective: &Objective, vertex: u32, to: Point) -> bool {
        let from = std::mem::replace(&mut complex.points[vertex as usize], to);
        if !self.star.iter().all(|&t| complex.is_positive(complex.tets[t as usize])) {
            complex.points[vertex as usize] = from;
            return false;
        }
        for &t in &self.star {
            let tet = complex.tets[t as usize];
            complex.scores[t as usize] = objective.score(&complex.points, tet);
            for v in tet {
                complex.touched[v as usize] = complex.pass;
            }
        }
        true
    }
}

/// The shortest vector in the convex hull of vectors (Mitchell, Demyanov, Malozemov 1974).
///
/// Weight moves from the vector with the largest component along the current one to the vector with
/// the least.
fn shortest_in_hull(vectors: &[Vector], weights: &mut Vec<f64>) -> Vector {
    weights.clear();
    weights.resize(vectors.len(), 0.0);
    weights[0] = 1.0;
    let mut shortest = vectors[0];
    for _ in 0..HULL_ROUNDS {
        let (mut least, mut most) = (0, None);
        for (k, v) in vectors.iter().enumerate() {
            if v.dot(&shortest) < vectors[least].dot(&shortest) {
                least = k;
            }
            if weights[k] > 0.0 && most.is_none_or(|m: usize| v.dot(&shortest) > vectors[m].dot(&shortest)) {
                most = Some(k);
            }
        }
        let most = most.expect("the weights sum to one");
        let across = vectors[most] - vectors[least];
        let excess = across.dot(&shortest);
        // The direction is only a start for a line search: a thousandth is exact enough.
        if excess <= 1e-3 * shortest.norm_squared() {
            break;
        }
        let moved = (excess / across.norm_squared()).min(weights[most]);
        weights[most] -= moved;
        weights[least] += moved;
        shortest -= across * moved;
    }
    shortest
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_shortest_vector_of_a_hull_is_found() {
        let mut weights = Vec::new();
        let v = [Vector::new(1., 2., 0.), Vector::new(1., -1., 0.), Vector::new(3., 0., 0.)];
        assert!((shortest_in_hull(&v, &mut weights) - Vector::new(1., 0., 0.)).norm() < 1e-3);
        let around = [
            Vector::new(1., 0., 0.),
            Vector::new(-1., 1., 0.),
            Vector::new(-1., -1., 0.),
            Vector::new(2., 0., 1.),
        ];
        assert!(shortest_in_hull(&around, &mut weights).norm() < 0.05, "the origin is inside");
    }
}
