//! Collapse of a free vertex into a neighbour.
//!
//! In the tets of the vertex that do not contain the neighbour, the vertex is replaced by it. That
//! fills the star correctly if all these tets are positive, because then the whole surface of the
//! star is visible from the neighbour.

use crate::Point;
use crate::ground::size::SizeField;
use crate::mesher::improve::complex::{Complex, place};
use crate::mesher::improve::objective::Objective;
use crate::mesher::improve::swap::{commit, least_after};

/// Largest edge length after a collapse, in units of the wanted size at its midpoint.
const LONGEST_EDGE: f64 = 1.5;

/// Scratch memory of the search.
#[derive(Default)]
pub(super) struct Collapser {
    star: Vec<u32>,
    new: Vec<([u32; 4], f64)>,
    best: Vec<([u32; 4], f64)>,
}

impl Collapser {
    /// Merges a free vertex of `tet` into another vertex of the tet, if that raises the worst score
    /// of the star.
    ///
    /// The first free vertex for which this is possible is merged into the best of the others.
    pub fn improve(
        &mut self,
        complex: &mut Complex,
        objective: &Objective,
        size: &dyn SizeField,
        tet: u32,
    ) -> bool {
        let corners = complex.tets[tet as usize];
        for vertex in corners.into_iter().filter(|&v| complex.free[v as usize]).collect::<Vec<_>>() {
            complex.star(vertex, &mut self.star);
            let mut worst = least_after(complex.worst_of(&self.star));
            let mut found = false;
            for into in corners.into_iter().filter(|&v| v != vertex) {
                if let Some(value) = self.merged(complex, objective, vertex, into, worst)
                    && self.edges_fit(complex, size, into)
                {
                    worst = value;
                    found = true;
                    std::mem::swap(&mut self.new, &mut self.best);
                }
            }
            if found && commit(complex, &self.star, &self.best) {
                return true;
            }
        }
        false
    }

    /// Stores the tets after the merge in `new`; returns their worst score if it is above `least`.
    fn merged(
        &mut self,
        complex: &Complex,
        objective: &Objective,
        vertex: u32,
        into: u32,
        least: f64,
    ) -> Option<f64> {
        self.new.clear();
        let mut worst = f64::INFINITY;
        for &t in &self.star {
            let mut tet = complex.tets[t as usize];
            if tet.contains(&into) {
                continue;
            }
            tet[place(tet, vertex)] = into;
            let score = objective.score_above(&complex.points, tet, least);
            if score <= least {
                return None;
            }
            worst = worst.min(score);
            self.new.push((tet, score));
        }
        (!self.new.is_empty()).then_some(worst)
    }

    /// Whether the edges of the new tets at `into` are short enough.
    fn edges_fit(&self, complex: &Complex, size: &dyn SizeField, into: u32) -> bool {
        let at = complex.points[into as usize];
        let fits = |p: Point| (p - at).norm() <= LONGEST_EDGE * size.size_at(&nalgebra::center(&p, &at));
        self.new
            .iter()
            .flat_map(|(tet, _)| tet)
            .filter(|&&v| v != into)
            .all(|&v| fits(complex.points[v as usize]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ground::size::UniformSize;
    use crate::mesher::improve::blocks::whole;
    use crate::mesher::improve::objective::Measure;
    use crate::mesher::improve::samples::cube;

    const SHAPES: Objective = Objective { measure: Measure::MeanRatio, legality: None, sharpest: 1.0 };

    fn collapse_all(size: f64) -> (usize, usize) {
        let mut complex = whole(&cube(5, 3));
        complex.score_all(&SHAPES);
        let (before, mut done) = (complex.living().count(), 0);
        let mut collapser = Collapser::default();
        for tet in 0..complex.tets.len() as u32 {
            if complex.is_alive(tet) {
                done += usize::from(collapser.improve(&mut complex, &SHAPES, &UniformSize(size), tet));
            }
        }
        complex.check().unwrap();
        (done, before - complex.living().count())
    }

    #[test]
    fn collapses_remove_tets_and_keep_the_complex_valid() {
        let (done, fewer) = collapse_all(1.0);
        assert!(done > 0 && fewer > done);
    }

    #[test]
    fn no_collapse_makes_edges_too_long() {
        assert_eq!(collapse_all(0.1), (0, 0));
    }
}
