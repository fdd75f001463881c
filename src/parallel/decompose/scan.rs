//! The samples of a piece, sorted along a direction: finds the samples behind a plane, and those it
//! cuts, by bisection.

use super::cuts::{CutPlane, Spot};
use super::plan::SAME;
use super::statistics::Sample;
use crate::{Point, Vector};

/// The number of positions tried for a plane in one direction.
const PLACES: i32 = 9;

/// Samples, sorted along a direction.
pub(super) struct Scan<'a> {
    /// A unit vector.
    pub normal: Vector,
    /// The coordinate of each sample along the direction, ascending.
    order: Vec<(f64, &'a Sample)>,
    /// Half of the largest sample width.
    reach: f64,
}

impl<'a> Scan<'a> {
    pub fn new(samples: &[&'a Sample], normal: Vector) -> Self {
        let mut order: Vec<(f64, &Sample)> =
            samples.iter().map(|&sample| (sample.point.coords.dot(&normal), sample)).collect();
        order.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
        let reach = samples.iter().map(|sample| 0.5 * sample.width).fold(0.0, f64::max);
        Self { normal, order, reach }
    }

    /// Planes with about this share of the samples behind them, the exact share first. The share
    /// may be off by the fraction `allowance`.
    pub fn places(&self, share: f64, allowance: f64) -> Vec<CutPlane> {
        // 0, 1, -1, 2, -2, …
        let steps = (0..PLACES).map(|k| if k % 2 == 0 { -k / 2 } else { (k + 1) / 2 });
        let place = |step: i32| {
            let off = f64::from(step) / f64::from(PLACES / 2) * allowance * share;
            let at = ((share + off) * self.order.len() as f64).round() as usize;
            let at = at.clamp(1, self.order.len() - 1);
            let offset = 0.5 * (self.order[at - 1].0 + self.order[at].0);
            CutPlane { point: Point::from(self.normal * offset), normal: self.normal }
        };
        steps.map(place).collect()
    }

    /// Distinct planes through `spots` with about this share of the samples behind them.
    pub fn through(&self, spots: &[&Spot], share: f64, allowance: f64) -> Vec<CutPlane> {
        let mut found: Vec<(f64, &Spot)> =
            spots.iter().map(|&spot| (spot.point.coords.dot(&self.normal), spot)).collect();
        found.retain(|(along, _)| self.shares(*along, share, allowance));
        found.sort_by(|a, b| a.0.total_cmp(&b.0));
        found.dedup_by(|b, a| b.0 - a.0 <= SAME * a.1.near);
        found.into_iter().map(|(_, spot)| CutPlane { point: spot.point, normal: self.normal }).collect()
    }

    /// Whether about this share of the samples is at or below a coordinate.
    pub fn shares(&self, along: f64, share: f64, allowance: f64) -> bool {
        let behind = self.order.partition_point(|entry| entry.0 <= along) as f64;
        (behind / self.order.len() as f64 - share).abs() <= allowance * share
    }

    /// The samples that a plane across this direction cuts.
    pub fn met_by(&self, plane: &CutPlane) -> Vec<&'a Sample> {
        let along = plane.point.coords.dot(&self.normal);
        let first = self.order.partition_point(|entry| entry.0 < along - self.reach);
        let near = self.order[first..].iter().take_while(|entry| entry.0 <= along + self.reach);
        near.map(|entry| entry.1).filter(|sample| is_met(plane, sample)).collect()
    }
}

/// Whether a plane cuts the region that a sample represents.
pub(super) fn is_met(plane: &CutPlane, sample: &Sample) -> bool {
    plane.value(&sample.point).abs() < 0.5 * sample.width
}
