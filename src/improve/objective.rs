//! What a tet is worth: its shape, and below every shape the illegal ones.

use crate::Point;
use crate::improve::complex::NONE;
use crate::improve::legality::Legality;
use crate::improve::limits::TetLimits;
use crate::kernel::quality::{Diagonal, squared_lengths, worst_child_of};
use crate::kernel::simplex::{area_vector, largest_cosine, volume6};
use crate::{Vector, mesh::TET_FACES};

/// How the shape of a tet is measured: 1 at most, more than 0 for every positively oriented tet.
///
/// The mean ratio is chosen over angles because it is smooth where it is not zero, falls for every kind of
/// bad tet (an angle measure does not see needles), and costs six lengths and a volume. Inside, its power 3/2 is used,
/// volume over root-mean-square edge cubed (Parthasarathy, Graichen, Hathaway 1994): the same order of tets, but
/// one square root in place of a cube root.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum Measure {
    /// The mean ratio of the tet.
    MeanRatio,
    /// The mean ratio of the worst child at any level of refinement, see
    /// [`refined_quality`](crate::kernel::quality::refined_quality), in units of the regular tet's 6/7.
    #[default]
    Refined,
}

/// The score of a tet that does not stand positively: below all others.
pub(super) const INVERTED: f64 = f64::NEG_INFINITY;

/// What is taken off the score of an illegal tet: more than any shape can make up for.
const ILLEGAL: f64 = 1.0;

/// The step of a difference quotient, in units of an edge: half the digits for the step, half for the difference.
const DIFFERENCE: f64 = 1e-7;

/// The sum s of squared edge lengths of a regular tet, to the power 3/2, over six times its volume.
const OF_REGULAR: f64 = 20.784_609_690_826_528; // 12·√3

/// The sum of the worst child of the regular tet is 7/6 of its own: that to the power 3/2.
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

/// Scores tets. Every score of a legal tet is positive, of an illegal one negative.
#[derive(Clone, Copy)]
pub(super) struct Objective<'a> {
    /// How shapes are measured.
    pub measure: Measure,
    /// Which tets are illegal, if that matters.
    pub legality: Option<&'a Legality>,
    /// Tets with a dihedral angle whose cosine is larger count as inverted; 1 or more where all may be.
    pub sharpest: f64,
}

impl Objective<'_> {
    /// The score of a tet.
    pub fn score(&self, points: &[Point], tet: [u32; 4]) -> f64 {
        self.score_above(points, tet, INVERTED)
    }

    /// The score of a tet if it is above `least`, else something that is not.
    pub fn score_above(&self, points: &[Point], tet: [u32; 4], least: f64) -> f64 {
        let p = corners(points, tet);
        let shape = self.shape(&p);
        if shape <= least || shape <= 0.0 {
            // Legality and limits only ever lower it.
            return if shape > 0.0 { shape } else { INVERTED };
        }
        let Some(legality) = self.legality else { return shape };
        let (illegal, limits) = legality.judge(tet);
        shape * limits.map_or(1.0, |l| l.factor(&p)) - if illegal { ILLEGAL } else { 0.0 }
    }

    /// Where the edges of a tet tend to, if any bends and legality matters.
    pub fn limits(&self, tet: [u32; 4]) -> Option<TetLimits> {
        self.legality.and_then(|l| l.judge(tet).1)
    }

    /// The score of the tet of a point inside a body and then a face, outward.
    pub fn score_with_point(&self, points: &[Point], point: &Point, face: [u32; 3]) -> f64 {
        let [a, b, c] = face.map(|v| points[v as usize]);
        let p = [*point, a, b, c];
        let shape = self.shape(&p);
        if shape <= 0.0 {
            return INVERTED;
        }
        let Some(legality) = self.legality else { return shape };
        // No edge at the point lies on the boundary, so that only the face can make the tet illegal.
        let (illegal, limits) = legality.judge([NONE, face[0], face[1], face[2]]);
        shape * limits.map_or(1.0, |l| l.factor(&p)) - if illegal { ILLEGAL } else { 0.0 }
    }

    /// The shape that a score stands for, whether the tet is legal or not.
    pub fn shape_of_score(score: f64) -> f64 {
        if score > 0.0 { score } else { score + ILLEGAL }
    }

    /// The shape of a tet and how it changes as the first vertex moves, both less what its corners lose in
    /// the limit of refinement. Of a tet better than `enough` only the straight shape's change is taken.
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

    /// What [`gradient`](Self::gradient) calls shape, if above `least`, else something that is not.
    pub fn shape_above(&self, p: &[Point; 4], limits: Option<&TetLimits>, least: f64) -> f64 {
        let shape = self.shape(p);
        match limits {
            Some(limits) if shape > least => shape * limits.factor(p),
            _ => shape,
        }
    }

    /// The shape of a tet, not positive if it does not stand positively.
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

    /// The shape, and how it changes as the first vertex moves.
    fn shape_and_gradient(&self, p: &[Point; 4]) -> (f64, Vector) {
        let v6 = volume6(&p[0], &p[1], &p[2], &p[3]);
        if v6.is_nan() || v6 <= 0.0 {
            return (0.0, Vector::zeros());
        }
        let squares = squared_lengths(p);
        let (sum, scale, diagonal) = self.denominator(&squares);
        // How the sum grows with the first three squares.
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

    /// The sum that the volume is compared with, the factor before, and which diagonal makes it, if the tet's own sum does not.
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
    use crate::kernel::quality::refined_quality;
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
                // Off the kinks, where another child becomes the worst.
                let (left, right) = (shape - back, ahead - shape);
                prop_assume!((left - right).abs() < 1e-8);
                prop_assert!((gradient.dot(&step) - 0.5 * (left + right)).abs() < 1e-7);
            }
        }

        #[test]
        fn what_is_sharper_than_allowed_counts_as_inverted(p in any_tet(), sharpest in 0.5..1.0f64) {
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
