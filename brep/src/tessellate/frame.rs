//! The plane in which a patch is triangulated.

use super::chain::Sides;
use super::face::Tolerances;
use crate::Surface;
use crate::model::{On, Patch};
use spade::{HasPosition, Point2};

/// A vertex of the triangulation in parameters.
#[derive(Clone, Copy, Debug)]
pub(super) struct Node {
    /// The parameters in units of length.
    pub scaled: Point2<f64>,
    pub parameters: [f64; 2],
    /// The vertex of the tessellation.
    pub vertex: u32,
}

impl HasPosition for Node {
    type Scalar = f64;

    fn position(&self) -> Point2<f64> {
        self.scaled
    }
}

/// Parameters in units of length. A patch that is far narrower than long is widened: its sides are
/// divided by the turn along them, and it may turn as much across. It is not widened more than its
/// turn across needs, so that the triangles of long spirals join opposite points of their sides.
///
/// At a **pole** the derivative in one direction vanishes, and a side of the patch is one point.
/// Lengths in that direction are then taken at each value of the other parameter, as in the
/// sinusoidal projection of a globe: the side becomes one point here too.
pub(super) struct Frame {
    origin: [f64; 2],
    scale: [f64; 2],
    pole: Option<Pole>,
}

/// Lengths of the derivative in the direction that vanishes at a pole.
struct Pole {
    direction: usize,
    /// The range of the other parameter.
    range: [f64; 2],
    /// Mean lengths at equal steps of the other parameter, and 0 at the pole itself.
    rates: Vec<f64>,
}

/// The most times that a patch is as long as wide in the plane.
const NARROWEST: f64 = 10.0;

/// Steps between the values of [`Pole::rates`].
const STEPS: usize = 256;

impl Pole {
    /// The mean length at a value of the other parameter.
    fn rate(&self, other: f64) -> f64 {
        let [low, high] = self.range;
        let at = ((other - low) / (high - low) * STEPS as f64).clamp(0.0, STEPS as f64);
        let k = (at as usize).min(STEPS - 1);
        let share = at - k as f64;
        self.rates[k] * (1.0 - share) + self.rates[k + 1] * share
    }
}

impl Frame {
    /// Scales parameters by the mean length of the derivatives.
    pub fn of(surface: &Surface, chains: &[Sides], pole: Option<usize>, tolerances: &Tolerances) -> Self {
        let diagonal = tolerances.diagonal;
        let all = || chains.iter().flatten().flatten().map(|node| node.0);
        let bound = |i: usize, start: f64, pick: fn(f64, f64) -> f64| all().map(|p| p[i]).fold(start, pick);
        let low = [0, 1].map(|i| bound(i, f64::INFINITY, f64::min));
        let high = [0, 1].map(|i| bound(i, f64::NEG_INFINITY, f64::max));
        let at = |i: usize, share: f64| low[i] + (high[i] - low[i]) * share;
        let mut sums = [0.0; 2];
        for k in 0..25 {
            let [u, v] = [at(0, 0.1 + 0.2 * f64::from(k % 5)), at(1, 0.1 + 0.2 * f64::from(k / 5))];
            let jet = surface.jet(u, v, 1);
            sums[0] += jet.d[1][0].norm();
            sums[1] += jet.d[0][1].norm();
        }
        let mut scale = sums.map(|sum| if sum > 0.0 { sum / 25.0 } else { 1.0 });
        let extents = [0, 1].map(|i| (high[i] - low[i]) * scale[i]);
        let nodes = all().count() as f64;
        for i in 0..2 {
            let widest = extents[1 - i] / NARROWEST;
            if extents[i] < widest {
                let turn = turn_across(surface, i, low, high);
                // The mean step along both sides.
                let step = 2.0 * extents[1 - i] / nodes;
                let needed = step * (turn / tolerances.angle).max(1.0);
                scale[i] *= (widest.min(needed) / extents[i].max(f64::MIN_POSITIVE)).max(1.0);
            }
        }
        let mut origin = low;
        let pole = pole.map(|direction| {
            origin[direction] = at(direction, 0.5);
            let length = |share: f64, other: f64| {
                let own = at(direction, share);
                let [u, v] = if direction == 0 { [own, other] } else { [other, own] };
                let d = surface.jet(u, v, 1).d;
                if direction == 0 { d[1][0].norm() } else { d[0][1].norm() }
            };
            let mean = |k: usize| {
                let other = at(1 - direction, k as f64 / STEPS as f64);
                let mean =
                    [0.125, 0.375, 0.625, 0.875].map(|share| length(share, other)).iter().sum::<f64>() / 4.0;
                if mean < AT_REST * diagonal { 0.0 } else { mean }
            };
            let other = 1 - direction;
            Pole { direction, range: [low[other], high[other]], rates: (0..=STEPS).map(mean).collect() }
        });
        Self { origin, scale, pole }
    }

    pub fn scaled(&self, p: [f64; 2]) -> Point2<f64> {
        let mut scale = self.scale;
        if let Some(pole) = &self.pole {
            scale[pole.direction] = pole.rate(p[1 - pole.direction]);
        }
        // Differences below the range of the predicates are zero.
        let [x, y] = [0, 1].map(|i| (p[i] - self.origin[i]) * scale[i]);
        let flushed = |x: f64| if x.abs() < 1e-30 { 0.0 } else { x };
        Point2::new(flushed(x), flushed(y))
    }

    /// The inverse of [`scaled`](Self::scaled).
    pub fn parameters(&self, p: Point2<f64>) -> [f64; 2] {
        let p = [p.x, p.y];
        let mut out = [0, 1].map(|i| self.origin[i] + p[i] / self.scale[i]);
        if let Some(pole) = &self.pole {
            let i = pole.direction;
            let rate = pole.rate(out[1 - i]);
            out[i] = if rate > 0.0 { self.origin[i] + p[i] / rate } else { self.origin[i] };
        }
        out
    }

    /// The parameters of the corners of a triangle. A corner at a pole has any parameter in the
    /// direction of the pole: that between the other two suits the triangle.
    pub fn corners(&self, triangle: &[(usize, Node); 3]) -> [[f64; 2]; 3] {
        let mut out = triangle.map(|(_, node)| node.parameters);
        if let Some(pole) = &self.pole {
            let i = pole.direction;
            for k in 0..3 {
                if pole.rate(out[k][1 - i]) == 0.0 {
                    out[k][i] = 0.5 * (out[(k + 1) % 3][i] + out[(k + 2) % 3][i]);
                }
            }
        }
        out
    }
}

/// The largest turn of the normal across a patch in one direction.
fn turn_across(surface: &Surface, direction: usize, low: [f64; 2], high: [f64; 2]) -> f64 {
    let normal = |along: u32, across: u32| {
        let mut shares = [0.1 + 0.2 * f64::from(along); 2];
        shares[direction] = 0.25 * f64::from(across);
        let [u, v] = [0, 1].map(|i| low[i] + (high[i] - low[i]) * shares[i]);
        surface.jet(u, v, 1).normal()
    };
    let step = |along, across| {
        normal(along, across).zip(normal(along, across + 1)).map_or(0.0, |(a, b)| a.angle(&b))
    };
    (0..5).map(|along| (0..4).map(|across| step(along, across)).sum::<f64>()).fold(0.0, f64::max)
}

/// Derivatives shorter than this (fraction of the diagonal of the model) are those of a pole.
const AT_REST: f64 = 1e-7;

/// The direction whose derivative vanishes at a side without length.
pub(super) fn pole(patch: &Patch, diagonal: f64) -> Option<usize> {
    let fins = patch.loops.iter().flatten().filter(|fin| matches!(fin.on, On::Corner(_)));
    fins.filter_map(|fin| fin.curve.as_ref().map(|curve| curve.point(fin.range[0]))).find_map(|p| {
        let d = patch.surface.jet(p[0], p[1], 1).d;
        [d[1][0], d[0][1]].iter().position(|d| d.norm() < AT_REST * diagonal)
    })
}

impl Frame {
    /// 1 if the patch is to the left of its loops, else −1.
    pub fn turn(&self, chains: &[Sides]) -> f64 {
        let double_area = |sides: &Sides| -> f64 {
            let points: Vec<Point2<f64>> = sides.iter().flatten().map(|node| self.scaled(node.0)).collect();
            let next = points.iter().cycle().skip(1);
            points.iter().zip(next).map(|(p, q)| p.x * q.y - p.y * q.x).sum()
        };
        chains.iter().map(double_area).sum::<f64>().signum()
    }
}
