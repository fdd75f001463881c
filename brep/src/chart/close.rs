//! Loops that go around a periodic surface, joined to one that bounds the face.
//!
//! A loop around a surface bounds no area in its parameters. Two of them, or one and a pole, are
//! joined by a seam. A surface that is closed in both directions is cut along seams, if no loop
//! bounds it from outside.

use super::route::Obstacles;
use super::trace::Loop;
use super::{Chart, Parameters, Side};
use crate::model::{Corner, EdgeCurve, Model, On};
use crate::straight::along_straight;
use crate::{BrepError, Curve};

const UNBOUNDED: &str = "its loops do not bound an area of its surface";

/// Segments of the curve of a seam, at least and at most.
const SEGMENTS: [usize; 2] = [64, 16_384];
/// The largest distance of the curve of a seam from its surface, as a fraction of the diagonal.
const SEAM_GAP: f64 = 1e-6;
/// Pairs of vertices that are tried for a seam.
const MOST_SEAMS: usize = 100;
/// Places that are tried for a seam.
const PLACES: usize = 12;

/// Joins the loops of a face with seams, which are added to the model.
///
/// # Errors
/// [`BrepError::Face`] for loops that bound no area.
pub(crate) fn close(
    chart: &Chart,
    face: usize,
    model: &mut Model,
    loops: Vec<Loop>,
) -> Result<Vec<Vec<Side>>, BrepError> {
    let (mut around, mut plain): (Vec<Loop>, Vec<Loop>) = loops.into_iter().partition(|l| l.drift != [0; 2]);
    let mut closing = Closing { chart, face, model };
    let closed = |l: &Loop| {
        let mut chain = outline(&l.sides);
        chain.extend(chain.first().copied());
        chain
    };
    let holes = Obstacles::new(chart, plain.iter().map(closed));
    let mut bounds: Vec<Vec<Side>> = Vec::new();
    if let Some(first) = around.first() {
        let Some(direction) = direction(first).filter(|&d| around.iter().all(|l| direction(l) == Some(d)))
        else {
            return Err(closing.error("its loops go around its surface in several directions"));
        };
        around.sort_by(|a, b| height(a, direction).total_cmp(&height(b, direction)));
        bounds = closing.join_all(around, direction, &holes)?;
    } else {
        let size = |k: &usize| area(&plain[*k].sides).abs();
        let outer = (0..plain.len()).max_by(|a, b| size(a).total_cmp(&size(b)));
        match outer.filter(|&k| area(&plain[k].sides) > 0.0) {
            Some(outer) => bounds.push(plain.swap_remove(outer).sides),
            // Only holes: they are in a whole closed surface, which no seam bounds.
            None if outer.is_none_or(|k| !has_seam(&plain[k].sides)) => {
                bounds.push(closing.whole(&holes)?);
            }
            None => return Err(closing.error("its loops are clockwise")),
        }
    }
    for mut hole in plain {
        move_inside(chart, &bounds, &mut hole.sides);
        bounds.push(hole.sides);
    }
    Ok(bounds)
}

/// Whether a loop follows an edge in both directions.
fn has_seam(sides: &[Side]) -> bool {
    let is_repeated = |(k, side): (usize, &Side)| sides[..k].iter().any(|other| other.on == side.on);
    sides.iter().enumerate().any(is_repeated)
}

/// The direction in which a loop goes around once.
fn direction(one: &Loop) -> Option<usize> {
    match one.drift {
        [1 | -1, 0] => Some(0),
        [0, 1 | -1] => Some(1),
        _ => None,
    }
}

/// The mean of the parameter across a direction.
fn height(one: &Loop, direction: usize) -> f64 {
    let all = outline(&one.sides);
    all.iter().map(|p| p[1 - direction]).sum::<f64>() / all.len() as f64
}

/// The nodes of a loop, each once.
fn outline(sides: &[Side]) -> Vec<Parameters> {
    sides.iter().flat_map(|side| side.nodes[..side.nodes.len() - 1].iter().map(|node| node.1)).collect()
}

/// The nodes of a loop from its start to its end, which differ by its drift.
fn chain(sides: &[Side]) -> Vec<Parameters> {
    let mut chain = outline(sides);
    chain.extend(sides.last().map(Side::end));
    chain
}

/// The area in the parameters, positive if counterclockwise.
fn area(sides: &[Side]) -> f64 {
    let all = outline(sides);
    let next = all.iter().cycle().skip(1);
    0.5 * all.iter().zip(next).map(|(p, q)| p[0] * q[1] - p[1] * q[0]).sum::<f64>()
}

/// Moves a hole by multiples of the periods to where the outer loops contain it.
fn move_inside(chart: &Chart, bounds: &[Vec<Side>], hole: &mut [Side]) {
    let outlines: Vec<Vec<Parameters>> = bounds.iter().map(|sides| outline(sides)).collect();
    let own = hole[0].nodes[hole[0].nodes.len() / 2].1;
    let moves = |i: usize| if chart.periods[i].is_some() { vec![0, -1, 1, -2, 2] } else { vec![0] };
    for i in moves(0) {
        for j in moves(1) {
            let p = chart.shifted(own, [i, j]);
            let crossings = outlines.iter().map(|outline| crossings(outline, p)).sum::<usize>();
            if crossings % 2 == 1 {
                hole.iter_mut().for_each(|side| side.shift([p[0] - own[0], p[1] - own[1]]));
                return;
            }
        }
    }
}

/// How often a line from a point to the right crosses a polygon.
fn crossings(outline: &[Parameters], p: Parameters) -> usize {
    let next = outline.iter().cycle().skip(1);
    let crosses = |a: &Parameters, b: &Parameters| {
        (a[1] > p[1]) != (b[1] > p[1]) && p[0] < a[0] + (p[1] - a[1]) / (b[1] - a[1]) * (b[0] - a[0])
    };
    outline.iter().zip(next).filter(|(a, b)| crosses(a, b)).count()
}

struct Closing<'a> {
    chart: &'a Chart<'a>,
    face: usize,
    model: &'a mut Model,
}

impl Closing<'_> {
    fn error(&self, what: &str) -> BrepError {
        BrepError::face(self.face, what, None)
    }

    /// Joins loops around a surface in pairs, from the lowest to the highest.
    fn join_all(
        &mut self,
        loops: Vec<Loop>,
        direction: usize,
        holes: &Obstacles,
    ) -> Result<Vec<Vec<Side>>, BrepError> {
        // With the face to the left, a lower loop goes up in u, a left one down in v.
        let is_lower = |l: &Loop| (l.drift[direction] > 0) == (direction == 0);
        let mut bounds = Vec::new();
        let mut open: Option<Loop> = None;
        let mut first: Option<Loop> = None;
        for next in loops {
            match (open.take(), is_lower(&next)) {
                (None, true) => open = Some(next),
                (Some(lower), false) => bounds.push(self.join(lower, next, direction, holes)?),
                // On a surface closed across, the face of the highest may end at the lowest.
                (None, false) if first.is_none() && bounds.is_empty() => first = Some(next),
                _ => return Err(self.error(UNBOUNDED)),
            }
        }
        match (open, first) {
            (Some(mut lower), Some(upper)) if self.chart.periods[1 - direction].is_some() => {
                let mut down = [0; 2];
                down[1 - direction] = -1;
                let by = self.chart.shifted([0.0; 2], down);
                lower.sides.iter_mut().for_each(|side| side.shift(by));
                bounds.push(self.join(lower, upper, direction, holes)?);
            }
            (lower, upper) => {
                for (one, is_upper) in [(lower, true), (upper, false)] {
                    if let Some(one) = one {
                        bounds.push(self.join_pole(one, direction, is_upper, holes)?);
                    }
                }
            }
        }
        Ok(bounds)
    }

    /// A loop that starts at its k-th side, moved by the multiples of the periods.
    fn started(&self, one: &Loop, k: usize, by: [i32; 2]) -> Vec<Side> {
        let mut sides = one.sides.clone();
        sides.rotate_left(k);
        let moved = sides.len() - k;
        let drift = self.chart.shifted([0.0; 2], one.drift);
        sides[moved..].iter_mut().for_each(|side| side.shift(drift));
        let by = self.chart.shifted([0.0; 2], by);
        sides.iter_mut().for_each(|side| side.shift(by));
        sides
    }

    /// Joins a lower and an upper loop by a seam between two of their vertices.
    fn join(
        &mut self,
        lower: Loop,
        upper: Loop,
        direction: usize,
        holes: &Obstacles,
    ) -> Result<Vec<Side>, BrepError> {
        let period = self.chart.periods[direction].expect("loops go around");
        let moved = |rounds: i32| {
            let mut by = [0; 2];
            by[direction] = rounds;
            by
        };
        // All pairs of vertices, those that are nearest to each other around the surface first.
        let mut pairs = Vec::new();
        for a in 0..lower.sides.len() {
            let from = self.chart.shifted(lower.sides[a].start(), lower.drift);
            for b in 0..upper.sides.len() {
                let to = upper.sides[b].start();
                let rounds = ((from[direction] - to[direction]) / period).round() as i32;
                let to = self.chart.shifted(to, moved(rounds));
                pairs.push(((to[direction] - from[direction]).abs(), a, b, rounds, [from, to]));
            }
        }
        pairs.sort_by(|p, q| p.0.total_cmp(&q.0));
        let all = holes.and([&lower, &upper].map(|one| chain(&one.sides)));
        let free = pairs.iter().take(MOST_SEAMS).find(|pair| !all.separate(pair.4));
        let Some(&(_, a, b, mut rounds, ends)) = free.or(pairs.first()) else {
            return Err(self.error("its loops have no vertices"));
        };
        let mut way = vec![ends[1]];
        if free.is_none()
            && let Some(found) = all.way(ends, direction)
        {
            rounds += ((found[found.len() - 1][direction] - ends[1][direction]) / period).round() as i32;
            way = found;
        }
        let first = self.started(&lower, a, [0; 2]);
        let from = first[first.len() - 1].end();
        let by = moved(rounds);
        let second = self.started(&upper, b, by);
        let ends = [self.corner_before(&first[0]), self.corner_before(&second[0])];
        let last = second[second.len() - 1].end();
        let (forth, back) = self.seams(from, way, ends, last);
        Ok(first.into_iter().chain(forth).chain(second).chain(back).collect())
    }

    /// The sides of a seam along bends, and those back: moved so that they begin at `back_from`.
    fn seams(
        &mut self,
        from: Parameters,
        way: Vec<Parameters>,
        ends: [usize; 2],
        back_from: Parameters,
    ) -> (Vec<Side>, Vec<Side>) {
        let last = way[way.len() - 1];
        let by = [0, 1].map(|i| back_from[i] - last[i]);
        let moved = |p: Parameters| [p[0] + by[0], p[1] + by[1]];
        let (mut forth, mut back) = (Vec::new(), Vec::new());
        let (mut at, mut corner) = (from, ends[0]);
        for (k, &to) in way.iter().enumerate() {
            let next = if k + 1 == way.len() { ends[1] } else { self.corner(to) };
            let seam = self.seam(at, to, [corner, next]);
            forth.push(Side::straight(seam, true, at, to));
            back.push(Side::straight(seam, false, moved(to), moved(at)));
            (at, corner) = (to, next);
        }
        back.reverse();
        (forth, back)
    }

    /// Joins a loop to a pole.
    fn join_pole(
        &mut self,
        one: Loop,
        direction: usize,
        is_upper: bool,
        holes: &Obstacles,
    ) -> Result<Vec<Side>, BrepError> {
        let Some(height) = self.chart.surface.pole(1 - direction, is_upper, self.chart.least()) else {
            return Err(self.error(UNBOUNDED));
        };
        let top = |p: Parameters| {
            let mut top = p;
            top[1 - direction] = height;
            top
        };
        let all = holes.and([chain(&one.sides)]);
        let is_free = |&k: &usize| {
            let from = self.chart.shifted(one.sides[k].start(), one.drift);
            !all.separate([from, top(from)])
        };
        let clearance = |k: &usize| all.clearance([one.sides[*k].start(), top(one.sides[*k].start())]);
        let free = (0..one.sides.len()).filter(is_free).max_by(|a, b| clearance(a).total_cmp(&clearance(b)));
        let mut out = self.started(&one, free.unwrap_or(0), [0; 2]);
        let (start, end) = (out[0].start(), out[out.len() - 1].end());
        let mut way = vec![top(end)];
        if free.is_none() {
            way = all.way([end, top(end)], direction).unwrap_or(way);
        }
        let tip = way[way.len() - 1];
        let drift = [0, 1].map(|i| start[i] - end[i]);
        let back_from = [tip[0] + drift[0], tip[1] + drift[1]];
        let pole = self.corner(tip);
        let ends = [self.corner_before(&out[0]), pole];
        let (forth, back) = self.seams(end, way, ends, back_from);
        out.extend(forth);
        out.push(Side::at_corner(pole, tip, back_from));
        out.extend(back);
        Ok(out)
    }

    /// The boundary of a whole closed surface in its parameters, with a seam that crosses no hole.
    fn whole(&mut self, holes: &Obstacles) -> Result<Vec<Side>, BrepError> {
        let chart = self.chart;
        let Some(period) = chart.periods[0] else { return Err(self.error(UNBOUNDED)) };
        if let Some(other) = chart.periods[1] {
            let place = |k: usize| {
                let share = |k: usize| (k as f64 + 0.37) / PLACES as f64;
                [period * share(k % PLACES), other * share(k / PLACES)]
            };
            let places = (0..PLACES * PLACES).map(place);
            let ways = places.clone().find_map(|at| holes.around(at, false));
            let ways = ways.or_else(|| places.step_by(7).find_map(|at| holes.around(at, true)));
            let Some(([u, v], [along_u, along_v])) = ways else { return Err(self.error(UNBOUNDED)) };
            let corner = self.corner([u, v]);
            let (east, north) = (u + period, v + other);
            let along_v = along_v.into_iter().map(|[u, v]| [u + period, v]).collect();
            let (low, high) = self.seams([u, v], along_u, [corner; 2], [east, north]);
            let (right, left) = self.seams([east, v], along_v, [corner; 2], [u, north]);
            return Ok(low.into_iter().chain(right).chain(high).chain(left).collect());
        }
        let poles = [false, true].map(|is_upper| chart.surface.pole(1, is_upper, self.chart.least()));
        let [Some(low), Some(high)] = poles else { return Err(self.error(UNBOUNDED)) };
        let place = |k: usize| period * (k as f64 + 0.37) / PLACES as f64;
        let is_free = |u: &f64| !holes.block([[*u, low], [*u, high]]);
        let u = (0..PLACES).map(place).find(is_free).unwrap_or(place(0));
        let ends = [self.corner([u, low]), self.corner([u, high])];
        let seam = self.seam([u, low], [u, high], ends);
        let east = u + period;
        Ok(vec![
            Side::at_corner(ends[0], [u, low], [east, low]),
            Side::straight(seam, true, [east, low], [east, high]),
            Side::at_corner(ends[1], [east, high], [u, high]),
            Side::straight(seam, false, [u, high], [u, low]),
        ])
    }

    /// The corner at the start of a side.
    fn corner_before(&self, side: &Side) -> usize {
        match side.on {
            On::Corner(corner) => corner,
            On::Curve(curve) => self.model.curves[curve].ends[usize::from(!side.is_forward)],
        }
    }

    /// Adds a corner.
    fn corner(&mut self, at: Parameters) -> usize {
        let tolerance = 1e-12 * self.chart.diagonal;
        self.model.corners.push(Corner { point: self.chart.surface.point(at), tolerance });
        self.model.corners.len() - 1
    }

    /// Adds a curve along a straight line in the parameters.
    fn seam(&mut self, from: Parameters, to: Parameters, ends: [usize; 2]) -> usize {
        let room = SEAM_GAP * self.chart.diagonal;
        let (spline, gap) = along_straight(self.chart.surface, [from, to], SEGMENTS, room);
        let curve = Curve::Spline(spline);
        // Corners of the file need not be on the surface.
        let off = |end: usize, at: f64| (self.model.corners[end].point.coords - curve.point(at)).norm();
        let tolerance = off(ends[0], 0.0).max(off(ends[1], 1.0)).max(gap);
        for end in ends {
            let corner = &mut self.model.corners[end];
            corner.tolerance = corner.tolerance.max(tolerance);
        }
        self.model.curves.push(EdgeCurve { curve, range: [0.0, 1.0], ends, tolerance });
        self.model.curves.len() - 1
    }
}
