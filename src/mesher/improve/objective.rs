//! Scores of tets: their shape, with illegal tets below all legal ones.

use crate::Point;
use crate::Vector;
use crate::ground::kernel::quality::{Diagonal, squared_lengths, worst_child_of};
use crate::ground::kernel::simplex::{area_vector, largest_cosine, volume6};
use crate::ground::mesh::TET_FACES;
use crate::mesher::half_face::NONE;
use crate::mesher::improve::legality::Legality;
use crate::mesher::improve::limits::TetLimits;

/// Shape measure of tets: at most 1, and positive for every positively oriented tet.
///
/// The mean ratio is preferred over angles because it is smooth where it is not zero, decreases for
/// every kind of bad tet (angles do not detect needles), and needs only six lengths and a volume.
/// Internally its power 3/2 is used, volume over cubed root-mean-square edge (Parthasarathy,
/// Graichen, Hathaway 1994): the same order of tets, with a square root instead of a cube root.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum Measure {
    /// The mean ratio of the tet.
    MeanRatio,
    /// The mean ratio of the worst descendant at any level of refinement, relative to the regular
    /// tet's 6/7.
    #[default]
    Refined,
}

/// The score of a tet that is not positively oriented, below all others.
pub(super) const INVERTED: f64 = f64::NEG_INFINITY;

/// Penalty of an illegal tet: larger than any shape.
const ILLEGAL: f64 = 1.0;

/// The step of a difference quotient, in units of an edge: half of the digits are left for the
/// difference.
const DIFFERENCE: f64 = 1e-7;

/// For a regular tet, the sum of squared edge lengths to the power 3/2, over six times its volume.
const OF_REGULAR: f64 = 20.784_609_690_826_528; // 12·√3

/// The sum of the worst child of a regular tet is 7/6 of its own; this is its power 3/2.
const REFINED_SUM: f64 = 1.260_144_024_690_417_4;

/// The corners of a tet.
#[inline(always)]
pub(super) fn corners(points: &[Point], [a, b, c, d]: [u32; 4]) -> [Point; 4] {
    // `map` is not always inlined here.
    [points[a as usize], points[b as usize], points[c as usize], points[d as usize]]
}

/// The score of a mean ratio.
pub(super) fn score_of_ratio(ratio: f64) -> f64 {
    ratio * ratio.max(0.0).sqrt()
}

/// The objective function. Scores of legal tets are positive, those of illegal tets negative.
#[derive(Clone, Copy)]
pub(super) struct Objective<'a> {
    /// The shape measure.
    pub measure: Measure,
    /// The legality of tets, if it is considered.
    pub legality: Option<&'a Legality>,
    /// Tets with a dihedral angle of a larger cosine count as inverted; 1 or more allows all
    /// angles.
    pub sharpest: f64,
}

impl Objective<'_> {
    /// The score of a tet.
    pub fn score(&self, points: &[Point], tet: [u32; 4]) -> f64 {
        self.score_above(points, tet, INVERTED)
    }

    /// The score of a tet if it is above `least`, else any value that is not.
    pub fn score_above(&self, points: &[Point], tet: [u32; 4], least: f64) -> f64 {
        let p = corners(points, tet);
        let shape = self.shape(&p);
        if shape <= least || shape <= 0.0 {
            // Legality and limits can only lower it.
            return if shape > 0.0 { shape } else { INVERTED };
        }
        let Some(legality) = self.legality else { return shape };
        let (illegal, limits) = legality.evaluate(tet);
        shape * limits.map_or(1.0, |l| l.factor(&p)) - if illegal { ILLEGAL } else { 0.0 }
    }

    /// The limits of the edges of a tet, if any changes direction and legality is considered.
    pub fn limits(&self, tet: [u32; 4]) -> Option<TetLimits> {
        self.legality.and_then(|l| l.evaluate(tet).1)
    }

    /// The score of the tet of a point inside a body and an outward face.
    pub fn score_with_point(&self, points: &[Point], point: &Point, face: [u32; 3]) -> f64 {
        let [a, b, c] = face.map(|v| points[v as usize]);
        let p = [*point, a, b, c];
        let shape = self.shape(&p);
        if shape <= 0.0 {
            return INVERTED;
        }
        let Some(legality) = self.legality else { return shape };
        // No edge at the point is on the boundary, so only the face can make the tet illegal.
        let (illegal, limits) = legality.evaluate([NONE, face[0], face[1], face[2]]);
        shape * limits.map_or(1.0, |l| l.factor(&p)) - if illegal { ILLEGAL } else { 0.0 }
    }

    /// The shape that belongs to a score, whether the tet is legal or not.
    pub fn shape_of_score(score: f64) -> f64 {
        if score > 0.0 { score } else { score + ILLEGAL }
    }

    /// The shape of a tet, with the penalty of its limits, and its gradient with respect to the
    /// first vertex.
    ///
    /// If the result is above `enough`, the gradient of the penalty is neglected.
    pub fn gradient(&self, p: &[Point; 4], limits: Option<&TetLimits>, enough: f64) -> (f64, Vector) {
        let (shape, gradient) = self.shape_and_gradient(p);
        let Some(limits) = limits.filter(|_| shape > 0.0) else { return (shape, gradient) };
        let factor = limits.factor(p);
        if shape * factor > enough {
            return (shape * factor, gradient * factor);
        }
        let step = DIFFERENCE * (p[1] - p[0]).norm();
        let ahead = Vector::from_fn(|axis, _| {
            let mut q = *p;
            q[0][axis] += step;
            limits.factor(&q)
        });
        (shape * factor, gradient * factor + ahead.add_scalar(-factor) * (shape / step))
    }

    /// The shape with the penalty, as in [`gradient`](Self::gradient), if it is above `least`, else
    /// any value that is not.
    pub fn shape_above(&self, p: &[Point; 4], limits: Option<&TetLimits>, least: f64) -> f64 {
        let shape = self.shape(p);
        match limits {
            Some(limits) if shape > least => shape * limits.factor(p),
            _ => shape,
        }
    }

    /// The shape of a tet without penalty; not positive if the tet is not.
    #[inline]
    fn shape(&self, p: &[Point; 4]) -> f64 {
        let v6 = volume6(&p[0], &p[1], &p[2], &p[3]);
        if v6.is_nan() || v6 <= 0.0 {
            return 0.0;
        }
        if self.sharpest < 1.0 && largest_cosine(p) > self.sharpest {
            return 0.0;
        }
        let (sum, scale, _) = self.denominator(&squared_lengths(p));
        scale * v6 / (sum * sum.sqrt())
    }

    /// The shape without penalty, and its gradient with respect to the first vertex.
    fn shape_and_gradient(&self, p: &[Point; 4]) -> (f64, Vector) {
        let v6 = volume6(&p[0], &p[1], &p[2], &p[3]);
        if v6.is_nan() || v6 <= 0.0 {
            return (0.0, Vector::zeros());
        }
        let squares = squared_lengths(p);
        let (sum, scale, diagonal) = self.denominator(&squares);
        // Derivatives of the sum by the first three squares.
        let mut weights = [1.0; 3];
        if let Some(k) = diagonal {
            // 2S − 2(a+b) − min(a,b): see `worst_child_squares`.
            weights = [2.0; 3];
            weights[k] = if squares[k] < squares[5 - k] { -1.0 } else { 0.0 };
        }
        let shape = scale * v6 / (sum * sum.sqrt());
        let [a, b, c] = TET_FACES[0];
        let volume_part = area_vector(&p[a], &p[b], &p[c]) * (-1.0 / v6);
        let [u, v, w] = [p[0] - p[1], p[0] - p[2], p[0] - p[3]];
        let length_part = (u * weights[0] + v * weights[1] + w * weights[2]) * (3.0 / sum);
        (shape, (volume_part - length_part) * shape)
    }

    /// The sum in the denominator of the shape, the constant factor, and the diagonal that
    /// determines the sum, unless it is the tet's own sum.
    #[inline(always)]
    fn denominator(&self, squares: &[f64; 6]) -> (f64, f64, Option<usize>) {
        let own = (squares[0] + squares[1]) + (squares[2] + squares[3]) + (squares[4] + squares[5]);
        if self.measure == Measure::MeanRatio {
            return (own, OF_REGULAR, None);
        }
        let worst = |d: Diagonal| worst_child_of(own, squares, d);
        let mut best = (worst(Diagonal::Mid01To23), 0);
        for (k, d) in [(1, Diagonal::Mid02To13), (2, Diagonal::Mid03To12)] {
            let sum = worst(d);
            if sum < best.0 {
                best = (sum, k);
            }
        }
        (best.0, OF_REGULAR * REFINED_SUM, (best.0 > own).then_some(best.1))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ground::kernel::quality::refined_quality;
    use proptest::prelude::*;
    use proptest::test_runner::RngSeed;

    fn any_tet() -> impl Strategy<Value = [Point; 4]> {
        prop::array::uniform4(prop::array::uniform3(-1.0..1.0f64)).prop_map(|p| p.map(Point::from))
    }

    proptest! {
        #![proptest_config(ProptestConfig { rng_seed: RngSeed::Fixed(1), ..ProptestConfig::default() })]

        #[test]
        fn the_gradient_is_the_difference_quotient(p in any_tet(), x in -1.0..1.0f64, y in -1.0..1.0f64) {
            for measure in [Measure::MeanRatio, Measure::Refined] {
                let objective = Objective { measure, legality: None, sharpest: 1.0 };
                let shape = objective.shape(&p);
                prop_assume!(shape > 0.05);
                let (same, gradient) = objective.shape_and_gradient(&p);
                prop_assert_eq!(shape, same);
                let step = Vector::new(x, y, 0.5) * 1e-6;
                let ahead = objective.shape(&[p[0] + step, p[1], p[2], p[3]]);
                let back = objective.shape(&[p[0] - step, p[1], p[2], p[3]]);
                // Away from kinks, at which another child becomes the worst.
                let (left, right) = (shape - back, ahead - shape);
                prop_assume!((left - right).abs() < 1e-8);
                prop_assert!((gradient.dot(&step) - 0.5 * (left + right)).abs() < 1e-7);
            }
        }

        #[test]
        fn a_tet_with_a_too_sharp_angle_counts_as_inverted(p in any_tet(), sharpest in 0.5..1.0f64) {
            let objective = Objective { measure: Measure::Refined, legality: None, sharpest };
            let free = Objective { sharpest: 1.0, ..objective };
            let scores = [objective, free].map(|objective| objective.score(&p, [0, 1, 2, 3]));
            prop_assert_eq!(scores[0], if largest_cosine(&p) > sharpest { INVERTED } else { scores[1] });
        }

        #[test]
        fn the_refined_measure_is_the_refined_quality(p in any_tet()) {
            let objective = Objective { measure: Measure::Refined, legality: None, sharpest: 1.0 };
            let quality = refined_quality(&p).0;
            prop_assume!(quality > 0.0);
            prop_assert!((objective.shape(&p) - score_of_ratio(quality * 7.0 / 6.0)).abs() < 1e-12);
        }
    }
}
