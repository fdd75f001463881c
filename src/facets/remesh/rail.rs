//! A curve as a rail: vertices on it are numbers, and never leave it.

use crate::Point;
use crate::facets::{FacetCurve, FacetModel};
use csg::CornerId;

/// A polyline with the length and the turning up to each of its points.
#[derive(Clone, Debug)]
pub(super) struct Rail {
    points: Vec<Point>,
    lengths: Vec<f64>,
    /// The sum of the angles by which it turns at the points up to this one, this one's included.
    turns: Vec<f64>,
    /// The corners at both ends; `None` if closed.
    pub ends: Option<[CornerId; 2]>,
}

/// A step on a curve shorter than this many roundings says nothing of how it turns.
const SHORT_STEP: f64 = 50.0;

impl Rail {
    pub fn new(model: &FacetModel, curve: &FacetCurve) -> Self {
        let points: Vec<Point> = curve.vertices.iter().map(|&v| model.points[v as usize]).collect();
        let mut lengths = vec![0.0];
        let mut turns = vec![0.0];
        let mut before = None;
        for w in points.windows(2) {
            let step = w[1] - w[0];
            lengths.push(lengths[lengths.len() - 1] + step.norm());
            turns.push(turns[turns.len() - 1]);
            if step.norm() > SHORT_STEP * model.rounding {
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

    /// Whether its end is its beginning, a corner or not.
    pub fn is_loop(&self) -> bool {
        self.points[0] == self.points[self.points.len() - 1]
    }

    /// The length up to point `i` of the curve.
    pub fn place(&self, i: usize) -> f64 {
        self.lengths[i]
    }

    /// The point at a place, taken round a loop.
    pub fn at(&self, place: f64) -> Point {
        let place = self.wrapped(place);
        let after = self.lengths.partition_point(|l| *l <= place).clamp(1, self.lengths.len() - 1);
        let (low, high) = (self.lengths[after - 1], self.lengths[after]);
        let (a, b) = (self.points[after - 1], self.points[after]);
        if place <= low || high <= low { a } else { a + (b - a) * ((place - low) / (high - low)) }
    }

    /// A place between 0 and the length.
    pub fn wrapped(&self, place: f64) -> f64 {
        if self.is_loop() { place.rem_euclid(self.length()) } else { place.clamp(0.0, self.length()) }
    }

    /// The way from one place to another, negative if backward: on a loop the shorter one.
    pub fn way(&self, from: f64, to: f64) -> f64 {
        let way = to - from;
        if !self.is_loop() {
            return way;
        }
        let round = way.rem_euclid(self.length());
        if round > 0.5 * self.length() { round - self.length() } else { round }
    }

    /// By how much it turns strictly inside the piece that begins at `from` and is `way` long.
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
