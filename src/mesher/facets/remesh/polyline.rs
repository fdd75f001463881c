//! A curve as a polyline with arc length: vertices on it are stored as positions.

use crate::Point;
use crate::mesher::facets::{FacetCurve, FacetModel};
use csg::CornerId;

/// A polyline with the length and the turning angle up to each of its points.
#[derive(Clone, Debug)]
pub(super) struct Polyline {
    points: Vec<Point>,
    lengths: Vec<f64>,
    /// The sum of the turning angles up to and including each point.
    turns: Vec<f64>,
    /// The corners at both ends; `None` if closed without a corner.
    pub ends: Option<[CornerId; 2]>,
}

/// Steps shorter than this many roundings have no reliable direction.
const SHORT_STEP: f64 = 50.0;

impl Polyline {
    pub fn new(model: &FacetModel, curve: &FacetCurve) -> Self {
        let points: Vec<Point> = curve.vertices.iter().map(|&v| model.points[v as usize]).collect();
        let mut lengths = vec![0.0];
        let mut turns = vec![0.0];
        let mut before = None;
        for (i, w) in points.windows(2).enumerate() {
            let step = w[1] - w[0];
            lengths.push(lengths[lengths.len() - 1] + step.norm());
            turns.push(turns[turns.len() - 1]);
            if step.norm() > SHORT_STEP * model.rounding && !curve.is_small(i) {
                let at = turns.len() - 2;
                turns[at] += before.map_or(0.0, |b: crate::Vector| b.angle(&step));
                turns[at + 1] = turns[at];
                before = Some(step);
            }
        }
        Self { points, lengths, turns, ends: curve.ends }
    }

    pub fn length(&self) -> f64 {
        self.lengths[self.lengths.len() - 1]
    }

    /// Whether its ends coincide, at a corner or not.
    pub fn is_loop(&self) -> bool {
        self.points[0] == self.points[self.points.len() - 1]
    }

    /// The length up to point `i` of the curve.
    pub fn place(&self, i: usize) -> f64 {
        self.lengths[i]
    }

    /// The point at a position; positions wrap around on a loop.
    pub fn at(&self, place: f64) -> Point {
        let place = self.wrapped(place);
        let after = self.lengths.partition_point(|l| *l <= place).clamp(1, self.lengths.len() - 1);
        let (low, high) = (self.lengths[after - 1], self.lengths[after]);
        let (a, b) = (self.points[after - 1], self.points[after]);
        if place <= low || high <= low { a } else { a + (b - a) * ((place - low) / (high - low)) }
    }

    /// A position normalised to 0 … length.
    pub fn wrapped(&self, place: f64) -> f64 {
        if self.is_loop() { place.rem_euclid(self.length()) } else { place.clamp(0.0, self.length()) }
    }

    /// The signed length from one position to another; on a loop the shorter way.
    pub fn way(&self, from: f64, to: f64) -> f64 {
        let way = to - from;
        if !self.is_loop() {
            return way;
        }
        let round = way.rem_euclid(self.length());
        if round > 0.5 * self.length() { round - self.length() } else { round }
    }

    /// The turning angle strictly inside the interval that starts at `from` and has signed length
    /// `way`.
    pub fn turn(&self, from: f64, way: f64) -> f64 {
        let (low, high) = if way < 0.0 { (from + way, from) } else { (from, from + way) };
        let total = self.turns[self.turns.len() - 1];
        let length = self.length();
        let up_to = |place: f64, inclusive: bool| {
            let rounds = if self.is_loop() { (place / length).floor() } else { 0.0 };
            let rest = place - rounds * length;
            let end = if inclusive {
                self.lengths.partition_point(|l| *l <= rest)
            } else {
                self.lengths.partition_point(|l| *l < rest)
            };
            rounds * total + if end == 0 { 0.0 } else { self.turns[end - 1] }
        };
        (up_to(high, false) - up_to(low, true)).max(0.0)
    }
}
