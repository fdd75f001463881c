//! A way for a seam around the holes of a face.

use super::{Chart, Parameters};
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// Columns of the grid in each period, and rows between both ends.
const COLUMNS: i32 = 24;
const ROWS: i32 = 12;
/// Finer grids are tried where there is no way on one.
const FINER: [i32; 3] = [1, 2, 4];
/// Grid lines are this far from the ends (fraction of a step), because holes often have edges at
/// simple fractions.
const ASIDE: f64 = 0.37;
/// So much of a segment may be beyond a chain on which it ends.
const AT_VERTEX: f64 = 1e-6;
/// How far a way stays from holes (fraction of the grid's steps).
const CLEARANCE: f64 = 0.2;

/// Chains of parameters that a seam must not cross, at any multiple of the periods.
pub(super) struct Obstacles<'a> {
    chart: &'a Chart<'a>,
    chains: Vec<Chain>,
}

/// Parameters along lines, with the box around them. Closed chains repeat their first ones at the
/// end.
#[derive(Clone)]
struct Chain {
    nodes: Vec<Parameters>,
    low: Parameters,
    high: Parameters,
}

impl Chain {
    fn new(nodes: Vec<Parameters>) -> Self {
        let bound = |start: f64, pick: fn(f64, f64) -> f64| {
            [0, 1].map(|i| nodes.iter().map(|node| node[i]).fold(start, pick))
        };
        Self { low: bound(f64::INFINITY, f64::min), high: bound(f64::NEG_INFINITY, f64::max), nodes }
    }
}

impl<'a> Obstacles<'a> {
    pub fn new(chart: &'a Chart<'a>, chains: impl Iterator<Item = Vec<Parameters>>) -> Self {
        Self { chart, chains: chains.map(Chain::new).collect() }
    }

    /// Whether a segment crosses a chain.
    pub fn block(&self, [a, b]: [Parameters; 2]) -> bool {
        // The multiples of the period by which a chain may be moved onto the segment.
        let rounds = |chain: &Chain, i: usize| {
            let [low, high] = [a[i].min(b[i]) - chain.high[i], a[i].max(b[i]) - chain.low[i]];
            let [first, last] = match self.chart.periods[i] {
                Some(period) => [(low / period).ceil() as i32, (high / period).floor() as i32],
                None => [i32::from(low > 0.0), -i32::from(high < 0.0)],
            };
            first..=last
        };
        let crosses = |chain: &Chain, by: [i32; 2]| {
            let back = self.chart.shifted([0.0; 2], by);
            let segment = [a, b].map(|p| [p[0] - back[0], p[1] - back[1]]);
            chain.nodes.windows(2).any(|w| is_crossing(segment, [w[0], w[1]]))
        };
        self.chains
            .iter()
            .any(|chain| rounds(chain, 0).any(|i| rounds(chain, 1).any(|j| crosses(chain, [i, j]))))
    }

    /// Whether a segment between two vertices of chains, with a bit left out at both ends, crosses
    /// a chain.
    pub fn separate(&self, [a, b]: [Parameters; 2]) -> bool {
        let part = |share: f64| [0, 1].map(|i| a[i] + share * (b[i] - a[i]));
        self.block([part(AT_VERTEX), part(1.0 - AT_VERTEX)])
    }

    /// How far the middle of a segment is from chains (length).
    pub fn clearance(&self, [a, b]: [Parameters; 2]) -> f64 {
        let middle = [0, 1].map(|i| 0.5 * (a[i] + b[i]));
        let scale = self.scale(middle);
        let distance = |p: &Parameters| {
            let p = self.chart.unwrapped(*p, middle);
            (0..2).map(|i| (scale[i] * (p[i] - middle[i])).powi(2)).sum::<f64>().sqrt()
        };
        self.chains.iter().flat_map(|chain| &chain.nodes).map(distance).fold(f64::INFINITY, f64::min)
    }

    /// Ways from a place around the surface in u and in v that meet there alone, if there are any:
    /// straight ones, or with bends. The last bend of each is the place.
    pub fn around(&self, at: Parameters, may_bend: bool) -> Option<(Parameters, [Vec<Parameters>; 2])> {
        let ends = [[1, 0], [0, 1]].map(|by| self.chart.shifted(at, by));
        if !may_bend {
            let is_free = |end: &Parameters| !self.block([at, *end]);
            return ends.iter().all(is_free).then(|| (at, ends.map(|end| vec![end])));
        }
        let along_u = self.shortest(&Grid::around(at, 0, self.chart.periods)?)?;
        let first = std::iter::once(at).chain(along_u.iter().copied()).collect();
        let along_v = self.and([first]).shortest(&Grid::around(at, 1, self.chart.periods)?)?;
        Some((at, [along_u, along_v]))
    }

    /// These chains and others.
    pub fn and<const N: usize>(&self, beside: [Vec<Parameters>; N]) -> Self {
        let beside = beside.into_iter().map(Chain::new);
        Self { chart: self.chart, chains: self.chains.iter().cloned().chain(beside).collect() }
    }

    /// The bends of a short way from a vertex of a loop around the surface to another vertex, or to
    /// a multiple of the period beside it, that crosses no chain; the last of them is the end.
    /// `None` if there is none on a grid.
    pub fn way(&self, ends: [Parameters; 2], direction: usize) -> Option<Vec<Parameters>> {
        let period = self.chart.periods[direction]?;
        FINER.into_iter().find_map(|finer| self.shortest(&Grid::new(ends, direction, period, finer)))
    }

    /// The shortest way on a grid (Dijkstra 1959), without the bends that can be left out.
    fn shortest(&self, grid: &Grid) -> Option<Vec<Parameters>> {
        let scale = self.scale(grid.nodes[grid.first_end / 2]);
        let mut best = vec![(f64::INFINITY, 0); grid.nodes.len()];
        best[0].0 = 0.0;
        let mut queue = BinaryHeap::from([(Reverse(0_u64), 0_usize)]);
        let mut is_done = vec![false; grid.nodes.len()];
        // Bits of nonnegative numbers are in the order of the numbers.
        while let Some((_, node)) = queue.pop() {
            if std::mem::replace(&mut is_done[node], true) {
                continue;
            }
            if node >= grid.first_end {
                return Some(self.shortened(grid, &best, node));
            }
            for other in (0..grid.nodes.len()).filter(|&other| grid.are_near(node, other)) {
                let reached = best[node].0 + grid.length(node, other, scale);
                let ends = [node == 0, other >= grid.first_end];
                if !is_done[other]
                    && reached < best[other].0
                    && !self.block_around([grid.nodes[node], grid.nodes[other]], ends, grid.steps)
                {
                    best[other] = (reached, node);
                    queue.push((Reverse(reached.to_bits()), other));
                }
            }
        }
        None
    }

    /// The bends of a way without those that can be left out.
    fn shortened(&self, grid: &Grid, best: &[(f64, usize)], end: usize) -> Vec<Parameters> {
        let mut way = vec![grid.nodes[end]];
        let mut node = end;
        while node != 0 {
            node = best[node].1;
            way.push(grid.nodes[node]);
        }
        way.reverse();
        let mut kept = Vec::new();
        let mut at = 0;
        while at + 1 < way.len() {
            let are_ends = |to: usize| [at == 0, to + 1 == way.len()];
            let seen = |to: &usize| !self.block_around([way[at], way[*to]], are_ends(*to), grid.steps);
            at = (at + 2..way.len()).rev().find(seen).unwrap_or(at + 1);
            kept.push(way[at]);
        }
        kept
    }

    /// Whether a segment, or one beside it, crosses a chain. Ends of the way are on chains.
    fn block_around(
        &self,
        [a, b]: [Parameters; 2],
        [is_start, is_end]: [bool; 2],
        steps: Parameters,
    ) -> bool {
        let part = |share: f64| [0, 1].map(|i| a[i] + share * (b[i] - a[i]));
        let [a, b] =
            [part(if is_start { AT_VERTEX } else { 0.0 }), part(if is_end { 1.0 - AT_VERTEX } else { 1.0 })];
        let off = [0, 1].map(|i| CLEARANCE * steps[i].abs());
        let moved = |p: Parameters, x: f64, y: f64| [p[0] + x * off[0], p[1] + y * off[1]];
        let middle = part(0.5);
        self.block([a, b])
            || [(1.0, 1.0), (-1.0, 1.0), (1.0, -1.0), (-1.0, -1.0)].into_iter().any(|(x, y)| {
                let beside = moved(middle, x, y);
                self.block([a, beside]) || self.block([beside, b])
            })
    }

    /// The lengths of both derivatives.
    fn scale(&self, at: Parameters) -> [f64; 2] {
        let d = self.chart.surface.jet(at[0], at[1], 1).d;
        [d[1][0].norm(), d[0][1].norm()]
    }
}

/// Places for the bends of a way.
struct Grid {
    /// The start, those between, and the end at three multiples of the period.
    nodes: Vec<Parameters>,
    /// The first of the ends.
    first_end: usize,
    steps: Parameters,
    /// The end sees nodes within so many steps in each direction.
    sight: [f64; 2],
}

impl Grid {
    fn new([from, to]: [Parameters; 2], direction: usize, period: f64, finer: i32) -> Self {
        let across = 1 - direction;
        let (columns, rows) = (COLUMNS * finer, ROWS * finer);
        let mut steps = [period / f64::from(columns); 2];
        steps[across] = (to[across] - from[across]) / f64::from(rows);
        let mut nodes = vec![from];
        for row in 0..rows {
            for column in -columns..=columns {
                let mut node = from;
                node[direction] += steps[direction] * (f64::from(column) + ASIDE);
                node[across] += steps[across] * (f64::from(row) + ASIDE);
                nodes.push(node);
            }
        }
        let first_end = nodes.len();
        for round in -1..=1 {
            let mut end = to;
            end[direction] += period * f64::from(round);
            nodes.push(end);
        }
        // An end may be the tip of a channel that is narrower than the steps for a while.
        Self { nodes, first_end, steps, sight: [f64::INFINITY; 2] }
    }

    /// Places for a way around a surface that is periodic in both directions, back to its start.
    fn around(from: Parameters, direction: usize, periods: [Option<f64>; 2]) -> Option<Self> {
        let [Some(in_u), Some(in_v)] = periods else { return None };
        let steps = [in_u, in_v].map(|period| period / f64::from(COLUMNS));
        let mut nodes = vec![from];
        let across = 1 - direction;
        for row in -COLUMNS..COLUMNS {
            for column in -COLUMNS / 2..COLUMNS * 3 / 2 {
                let mut node = from;
                node[direction] += steps[direction] * (f64::from(column) + ASIDE);
                node[across] += steps[across] * (f64::from(row) + ASIDE);
                nodes.push(node);
            }
        }
        let first_end = nodes.len();
        let mut end = from;
        end[direction] += [in_u, in_v][direction];
        nodes.push(end);
        Some(Self { nodes, first_end, steps, sight: [2.5; 2] })
    }

    /// Ends see the nodes beside them, other nodes their neighbours.
    fn are_near(&self, a: usize, b: usize) -> bool {
        let apart = [0, 1].map(|i| (self.nodes[a][i] - self.nodes[b][i]).abs() / self.steps[i].abs());
        let is_end = |k: usize| k == 0 || k >= self.first_end;
        let sight = if is_end(a) || is_end(b) { self.sight } else { [1.5; 2] };
        apart[0] < sight[0] && apart[1] < sight[1]
    }

    fn length(&self, a: usize, b: usize, scale: [f64; 2]) -> f64 {
        (0..2).map(|i| (scale[i] * (self.nodes[a][i] - self.nodes[b][i])).powi(2)).sum::<f64>().sqrt()
    }
}

/// Whether two segments cross.
fn is_crossing([a, b]: [Parameters; 2], [c, d]: [Parameters; 2]) -> bool {
    let side = |p: Parameters, q: Parameters, r: Parameters| {
        (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0]) > 0.0
    };
    side(a, b, c) != side(a, b, d) && side(c, d, a) != side(c, d, b)
}

#[cfg(test)]
mod tests {
    use super::super::tests::torus;
    use super::*;
    use crate::surface::Profile;
    use crate::{Surface, Vector};
    use std::f64::consts::TAU;

    #[test]
    fn seams_of_a_torus_go_around_a_hole_across_all_straight_ones() {
        let torus = torus();
        let chart = Chart::new(&torus, 6.0);
        // A narrow hole along the diagonal of the parameters, except for a short piece.
        let (low, high) = (0.3, TAU - 0.3);
        let hole = [[low, low + 0.05], [low + 0.05, low], [high, high - 0.05], [high - 0.05, high]];
        let closed = hole.into_iter().chain([hole[0]]).collect();
        let obstacles = Obstacles::new(&chart, std::iter::once(closed));
        let at = [3.0, 1.0];
        assert!(obstacles.around(at, false).is_none());
        let (place, ways) = obstacles.around(at, true).expect("a way around both ends of the hole");
        assert_eq!(place, at);
        for (way, end) in ways.iter().zip([[at[0] + TAU, at[1]], [at[0], at[1] + TAU]]) {
            let nodes: Vec<Parameters> = std::iter::once(at).chain(way.iter().copied()).collect();
            assert!(nodes.len() > 2 && nodes[nodes.len() - 1] == end, "{nodes:?}");
            assert!(nodes.windows(2).all(|w| !obstacles.block([w[0], w[1]])), "{nodes:?}");
        }
    }

    /// Asserts that there is a way between two places on a cylinder that crosses no chain, and not
    /// the straight one.
    fn assert_bent_way(chains: Vec<Vec<Parameters>>, ends: [Parameters; 2]) {
        let axes = [Vector::x(), Vector::y(), Vector::z()];
        let profile = Profile::Line { radius: 6.0, slope: [0.0, 1.0] };
        let cylinder = Surface::Round { origin: Vector::zeros(), axes, profile };
        let chart = Chart::new(&cylinder, 20.0);
        let obstacles = Obstacles::new(&chart, chains.into_iter());
        assert!(obstacles.separate(ends));
        let way = obstacles.way(ends, 0).expect("a way with bends");
        let nodes: Vec<Parameters> = std::iter::once(ends[0]).chain(way).collect();
        assert!(nodes.windows(2).all(|w| !obstacles.separate([w[0], w[1]])), "{nodes:?}");
    }

    #[test]
    fn seams_reach_tips_of_channels_that_are_narrower_than_the_grid() {
        // The chamfer of a hexagonal nut, and a place below the middle of one of its sides.
        let arc = |k: i32| {
            let u = f64::from(k) * TAU / 360.0;
            [u, 6.5 / ((u + TAU / 12.0).rem_euclid(TAU / 6.0) - TAU / 12.0).cos() - 6.3]
        };
        let (start, tip) = ([TAU / 2.0, 0.0], arc(150));
        let circle = (0..=360).map(|k| [f64::from(k) * TAU / 360.0, 0.0]).collect();
        assert_bent_way(vec![(0..=360).map(arc).collect(), circle], [start, tip]);
    }

    #[test]
    fn seams_go_between_slots_that_are_closer_than_rows_of_the_grid() {
        let slot = |k: i32| {
            let (left, low) = (f64::from(k % 2) * TAU / 2.0 - 0.1, 1.5 * f64::from(k));
            let (right, high) = (left + TAU / 2.0 + 0.2, low + 0.6);
            vec![[left, low], [right, low], [right, high], [left, high], [left, low]]
        };
        assert_bent_way((0..14).map(slot).collect(), [[TAU / 4.0, -1.0], [TAU / 4.0, 21.0]]);
    }
}
