//! The regions into which edges divide a face.
//!
//! Edges on a surface are a planar graph: around each corner they have an order, and to follow the
//! boundary of a region means to turn left at each corner as far as possible. A region may have
//! several boundaries. Those that no edges connect are matched along straight lines in the
//! parameters: what two crossings that follow each other on such a line have between them is one
//! region.

use super::super::{Edges, Shapes};
use super::contact::lies_on;
use crate::chart::{Chart, Parameters};
use crate::shapes::glue::OF_SOLIDS;
use std::collections::{BTreeMap, BTreeSet, HashMap};

/// An edge on the surface.
#[derive(Clone)]
pub(super) struct Strip {
    pub curve: usize,
    ends: [usize; 2],
    /// Parameters along it, and the box around them.
    pub nodes: Vec<Parameters>,
    bounds: [Parameters; 2],
    pub length: f64,
    /// Whether it bounds the face, with the face on the left of its direction.
    own: Option<bool>,
}

impl Strip {
    fn new(curve: usize, ends: [usize; 2], nodes: Vec<Parameters>, length: f64, own: Option<bool>) -> Self {
        let of = |i: usize, all: fn(f64, f64) -> f64| nodes.iter().map(|p| p[i]).reduce(all).unwrap_or(0.0);
        let bounds = [[of(0, f64::min), of(1, f64::min)], [of(0, f64::max), of(1, f64::max)]];
        Self { curve, ends, nodes, bounds, length, own }
    }

    /// Whether its box is on one side of a line.
    fn is_beside(&self, start: Parameters, way: Parameters) -> bool {
        let [low, high] = self.bounds;
        let side = |p: Parameters| cross(way, minus(p, start)) > 0.0;
        let corners = [low, [high[0], low[1]], high, [low[0], high[1]]].map(side);
        corners.iter().all(|side| *side == corners[0])
    }
}

/// A strip with a direction: twice its index, plus one against its curve.
pub(super) type Half = usize;

/// Where a line starts and ends on a strip: shares of its nodes, and of the segment between two.
const PLACE: [f64; 2] = [0.37, 0.41];
/// A line must not leave a strip in the direction of the strip (sine of the angle).
const ALONG: f64 = 1e-6;

/// The loops of each part of a face, divided by those of some curves that lie inside of it; `None`
/// if none does.
pub(super) fn divided(
    shapes: &Shapes,
    number: usize,
    curves: &[usize],
    size: f64,
) -> Option<Vec<Vec<Edges>>> {
    let chart = Chart::new(&shapes.faces[number].surface, size);
    let added = added(shapes, &chart, number, curves, size);
    if added.is_empty() {
        return None;
    }
    let mut strips = outline(shapes, number, size)?;
    strips.extend(added);
    loop {
        if strips.is_empty() {
            return None;
        }
        let sheet = Sheet { shapes, chart: &chart, strips: &strips };
        let regions = sheet.regions()?;
        let region = |half: Half| regions.of[half];
        let separates = |k: usize| {
            region(2 * k) != region(2 * k + 1)
                && (regions.is_inside[region(2 * k)] || strips[k].own.is_some())
        };
        let kept: Vec<bool> = (0..strips.len()).map(separates).collect();
        if kept.iter().all(|kept| *kept) {
            let is_divided = strips.iter().any(|strip| strip.own.is_none());
            return is_divided.then(|| regions.loops(&strips));
        }
        let mut kept = kept.into_iter();
        strips.retain(|_| kept.next().unwrap_or(false));
    }
}

/// Those of some curves that are inside of a face, of which the strips of its own edges are given,
/// whether or not they divide it.
pub(super) fn inside(
    shapes: &Shapes,
    number: usize,
    own: &[Strip],
    curves: &[usize],
    size: f64,
) -> BTreeSet<usize> {
    let chart = Chart::new(&shapes.faces[number].surface, size);
    let mut strips = added(shapes, &chart, number, curves, size);
    if strips.is_empty() {
        return BTreeSet::new();
    }
    strips.splice(0..0, own.iter().cloned());
    let sheet = Sheet { shapes, chart: &chart, strips: &strips };
    let Some(regions) = sheet.regions() else { return BTreeSet::new() };
    let is_inside =
        |(k, strip): &(usize, &Strip)| strip.own.is_none() && regions.is_inside[regions.of[2 * k]];
    strips.iter().enumerate().filter(is_inside).map(|(_, strip)| strip.curve).collect()
}

/// The strips of the edges of a face; `None` if it has seams, or edges that cannot be followed.
pub(super) fn outline(shapes: &Shapes, number: usize, size: f64) -> Option<Vec<Strip>> {
    let face = &shapes.faces[number];
    let chart = Chart::new(&face.surface, size);
    let own: Edges = face.loops.iter().flatten().copied().collect();
    if own.len() > shapes.curves_of(number).len() {
        return None;
    }
    let strips: Option<Vec<Strip>> = own
        .iter()
        .map(|&(curve, is_forward)| strip(shapes, &chart, number, curve, Some(is_forward)))
        .collect();
    let mut strips = strips?;
    if face.surface.is_plane() && area(&strips) < 0.0 {
        strips.iter_mut().for_each(|strip| strip.own = strip.own.map(|is_forward| !is_forward));
    }
    Some(strips)
}

/// The strips of those of some curves that lie on the surface of a face and are no edges of it.
fn added(shapes: &Shapes, chart: &Chart, number: usize, curves: &[usize], size: f64) -> Vec<Strip> {
    let face = &shapes.faces[number];
    let own = shapes.curves_of(number);
    let may_divide = |curve: &&usize| {
        let edge = &shapes.curves[**curve];
        own.binary_search(curve).is_err() && lies_on(&face.surface, edge, OF_SOLIDS * size + edge.tolerance)
    };
    curves.iter().filter(may_divide).filter_map(|&curve| strip(shapes, chart, number, curve, None)).collect()
}

/// The strip of a curve on the surface of a face; `None` if it cannot be followed.
fn strip(shapes: &Shapes, chart: &Chart, number: usize, curve: usize, own: Option<bool>) -> Option<Strip> {
    let (edge, surface) = (&shapes.curves[curve], &shapes.faces[number].surface);
    let nodes = chart.along(edge)?;
    let length = nodes.windows(2).map(|w| (surface.point(w[1]) - surface.point(w[0])).norm()).sum();
    Some(Strip::new(curve, edge.ends, nodes, length, own))
}

/// Whether the loops of a plane face are clockwise around its normal.
pub(in super::super) fn is_clockwise(shapes: &Shapes, number: usize, size: f64) -> bool {
    let face = &shapes.faces[number];
    if !face.surface.is_plane() {
        return false;
    }
    let chart = Chart::new(&face.surface, size);
    let strip = |&(curve, is_forward): &(usize, bool)| {
        let nodes = chart.along(&shapes.curves[curve])?;
        Some(Strip::new(curve, [0; 2], nodes, 0.0, Some(is_forward)))
    };
    let strips: Option<Vec<Strip>> = face.loops.iter().flatten().map(strip).collect();
    strips.is_some_and(|strips| area(&strips) < 0.0)
}

/// Twice the area in the plane inside of the loops that strips of a face make.
fn area(strips: &[Strip]) -> f64 {
    let of = |strip: &Strip| {
        let sum: f64 = strip.nodes.windows(2).map(|w| cross(w[0], w[1])).sum();
        if strip.own == Some(true) { sum } else { -sum }
    };
    strips.iter().map(of).sum()
}

fn cross(a: Parameters, b: Parameters) -> f64 {
    a[0] * b[1] - a[1] * b[0]
}

fn size(a: Parameters) -> f64 {
    a[0].hypot(a[1])
}

fn minus(a: Parameters, b: Parameters) -> Parameters {
    [a[0] - b[0], a[1] - b[1]]
}

/// Regions of a surface between strips.
struct Regions {
    /// The half-edges of each cycle.
    cycles: Vec<Vec<Half>>,
    /// The region to the left of each half-edge, named by one of its cycles.
    of: Vec<usize>,
    /// Whether a region is a part of the face.
    is_inside: Vec<bool>,
}

impl Regions {
    /// The loops of each part of the face.
    fn loops(&self, strips: &[Strip]) -> Vec<Vec<Edges>> {
        let mut parts: BTreeMap<usize, Vec<Edges>> = BTreeMap::new();
        for cycle in &self.cycles {
            let region = self.of[cycle[0]];
            if self.is_inside[region] {
                let edges = cycle.iter().map(|half| (strips[half / 2].curve, half % 2 == 0));
                parts.entry(region).or_default().push(edges.collect());
            }
        }
        parts.into_values().collect()
    }
}

pub(super) struct Sheet<'a> {
    pub shapes: &'a Shapes,
    pub chart: &'a Chart<'a>,
    pub strips: &'a [Strip],
}

impl Sheet<'_> {
    /// The regions; `None` if there is no order around a corner, or if the boundary of the face has
    /// the face on both sides.
    fn regions(&self) -> Option<Regions> {
        let next = self.next()?;
        let mut cycle_of = vec![usize::MAX; next.len()];
        let mut cycles: Vec<Vec<Half>> = Vec::new();
        for first in 0..next.len() {
            let mut half = first;
            let mut cycle = Vec::new();
            while cycle_of[half] == usize::MAX {
                cycle_of[half] = cycles.len();
                cycle.push(half);
                half = next[half];
            }
            if !cycle.is_empty() {
                cycles.push(cycle);
            }
        }
        let mut region = Groups::new(cycles.len());
        for hits in self.lines() {
            for w in hits.windows(2) {
                region.join(cycle_of[w[0].after], cycle_of[w[1].before]);
            }
        }
        let of: Vec<usize> = cycle_of.iter().map(|&cycle| region.root(cycle)).collect();
        let mut is_inside = vec![self.strips.iter().all(|strip| strip.own.is_none()); cycles.len()];
        let sides = |is_left: bool| {
            let own = self.strips.iter().enumerate().filter_map(|(k, strip)| Some((k, strip.own?)));
            own.map(move |(k, is_forward)| 2 * k + usize::from(is_forward != is_left))
        };
        let mut reached: Vec<usize> = sides(true).map(|half| of[half]).collect();
        // What is across an added strip is inside, too.
        while let Some(region) = reached.pop() {
            if !std::mem::replace(&mut is_inside[region], true) {
                let across =
                    (0..of.len()).filter(|half| self.strips[half / 2].own.is_none() && of[*half] == region);
                reached.extend(across.map(|half| of[half ^ 1]));
            }
        }
        let is_sound = sides(false).all(|half| !is_inside[of[half]]);
        is_sound.then_some(Regions { cycles, of, is_inside })
    }

    fn origin(&self, half: Half) -> usize {
        self.strips[half / 2].ends[half % 2]
    }

    /// The half-edge after each one along the boundary of the region on its left.
    fn next(&self) -> Option<Vec<Half>> {
        let mut around: BTreeMap<usize, Vec<Half>> = BTreeMap::new();
        for half in 0..2 * self.strips.len() {
            around.entry(self.origin(half)).or_default().push(half);
        }
        let mut next = vec![0; 2 * self.strips.len()];
        for (corner, halves) in around {
            let sorted = self.sorted(corner, halves)?;
            for (k, half) in sorted.iter().enumerate() {
                // What arrives as the twin goes on clockwise from there.
                next[half ^ 1] = sorted[(k + sorted.len() - 1) % sorted.len()];
            }
        }
        Some(next)
    }

    /// Lines from a strip of each component to one of the first component, as what they cross.
    fn lines(&self) -> Vec<Vec<Hit>> {
        let mut component = Groups::new(self.strips.len());
        let mut at: HashMap<usize, usize> = HashMap::new();
        for half in 0..2 * self.strips.len() {
            let known = *at.entry(self.origin(half)).or_insert(half / 2);
            component.join(known, half / 2);
        }
        let mut members: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
        for k in 0..self.strips.len() {
            members.entry(component.root(k)).or_default().push(k);
        }
        let first = component.root(0);
        let mut lines = Vec::new();
        for (&root, own) in &members {
            let rounds: &[[i32; 2]] = match [0, 1].map(|i| self.chart.period(i)) {
                // Two regions of a torus may have the same two boundaries.
                [Some(_), Some(_)] => &[[0, 0], [1, 0], [-1, 0], [0, 1], [0, -1]],
                _ => &[[0, 0]],
            };
            let rounds = rounds.iter().filter(|rounds| root != first || **rounds != [0, 0]);
            lines.extend(rounds.filter_map(|&rounds| self.clearest([own, &members[&first]], rounds)));
        }
        lines.into_iter().map(|line| self.hits(&line)).collect()
    }

    /// The line from one of some strips to one of others that is furthest from the directions of
    /// both: the edges of equal holes in a row are on lines between them.
    fn clearest(&self, [from, to]: [&[usize]; 2], rounds: [i32; 2]) -> Option<Line> {
        /// At most so many strips of each are tried.
        const TRIED: usize = 16;
        let tried = |strips: &[usize]| -> Vec<usize> {
            strips.iter().copied().step_by(strips.len().div_ceil(TRIED).max(1)).collect()
        };
        let (from, to) = (tried(from), tried(to));
        let lines =
            from.iter().flat_map(|&a| to.iter().map(move |&b| [a, b])).map(|ends| self.line(ends, rounds));
        // A line without length has no direction.
        lines.filter(|line| line.sine > ALONG).max_by(|a, b| a.sine.total_cmp(&b.sine))
    }

    /// The line from one strip to another. It goes around the surface by `rounds`.
    fn line(&self, strips: [usize; 2], rounds: [i32; 2]) -> Line {
        let place = |strip: &Strip| {
            let last = strip.nodes.len() - 1;
            let k = ((last as f64 * PLACE[0]) as usize).min(last - 1);
            let [p, q] = [strip.nodes[k], strip.nodes[k + 1]];
            (k, [0, 1].map(|i| p[i] + PLACE[1] * (q[i] - p[i])), minus(q, p))
        };
        let [(first, start, along), (last, end, back)] = strips.map(|k| place(&self.strips[k]));
        let end = self.chart.shifted(self.chart.unwrapped(end, start), rounds);
        let way = minus(end, start);
        let sine = |side| cross(side, way).abs() / (size(side) * size(way));
        let sine = sine(along).min(sine(back));
        Line { strips, segments: [first, last], start, end, along, back, sine }
    }

    /// What a line crosses, in its order, with both ends.
    fn hits(&self, line: &Line) -> Vec<Hit> {
        let Line { strips: [from, to], segments: [first, last], start, end, along, back, .. } = *line;
        let way = minus(end, start);
        let half = |k: usize, is_left: bool| 2 * k + usize::from(!is_left);
        let mut hits = vec![Hit { at: 0.0, before: 0, after: half(from, cross(along, way) > 0.0) }];
        hits.push(Hit { at: 1.0, before: half(to, cross(back, way) < 0.0), after: 0 });
        for (k, strip) in self.strips.iter().enumerate() {
            for by in self.rounds(strip, start, end) {
                if strip.is_beside(minus(start, by), way) {
                    continue;
                }
                for (segment, w) in strip.nodes.windows(2).enumerate() {
                    let [p, q] = [0, 1].map(|i| [w[i][0] + by[0], w[i][1] + by[1]]);
                    let [a, b] = [p, q].map(|p| cross(way, minus(p, start)));
                    if (a > 0.0) == (b > 0.0) {
                        continue;
                    }
                    let share = a / (a - b);
                    let hit = [0, 1].map(|i| p[i] + share * (q[i] - p[i]));
                    let longest = usize::from(way[0].abs() < way[1].abs());
                    let at = (hit[longest] - start[longest]) / way[longest];
                    // The ends of the line are on strips.
                    let is_end = (k == from && segment == first && at.abs() < 1e-6)
                        || (k == to && segment == last && (at - 1.0).abs() < 1e-6);
                    if 0.0 < at && at < 1.0 && !is_end {
                        let is_from_left = cross(minus(q, p), way) < 0.0;
                        hits.push(Hit { at, before: half(k, is_from_left), after: half(k, !is_from_left) });
                    }
                }
            }
        }
        hits.sort_by(|a, b| a.at.total_cmp(&b.at));
        hits
    }

    /// The multiples of the periods at which a strip may cross a line.
    fn rounds(&self, strip: &Strip, start: Parameters, end: Parameters) -> Vec<Parameters> {
        let range = |i: usize| {
            let Some(period) = self.chart.period(i) else { return vec![0.0] };
            let [low, high] = strip.bounds.map(|corner| corner[i]);
            let first = ((start[i].min(end[i]) - high) / period).ceil() as i64;
            let last = ((start[i].max(end[i]) - low) / period).floor() as i64;
            (first..=last).map(|k| period * k as f64).collect()
        };
        let (in_u, in_v) = (range(0), range(1));
        in_u.iter().flat_map(|&u| in_v.iter().map(move |&v| [u, v])).collect()
    }
}

/// A line in the parameters from one strip to another.
struct Line {
    strips: [usize; 2],
    /// The segments of both on which it starts and ends.
    segments: [usize; 2],
    start: Parameters,
    end: Parameters,
    /// The directions of both there.
    along: Parameters,
    back: Parameters,
    /// The sine of the smaller angle with these.
    sine: f64,
}

/// Where a line crosses a strip: its share of the line, and the halves whose left sides are before
/// and after.
struct Hit {
    at: f64,
    before: Half,
    after: Half,
}

/// Disjoint sets, each with its least member as root.
pub(in crate::shapes) struct Groups(Vec<usize>);

impl Groups {
    pub fn new(count: usize) -> Self {
        Self((0..count).collect())
    }

    pub fn root(&mut self, mut item: usize) -> usize {
        while self.0[item] != item {
            self.0[item] = self.0[self.0[item]];
            item = self.0[item];
        }
        item
    }

    pub fn join(&mut self, a: usize, b: usize) {
        let (a, b) = (self.root(a), self.root(b));
        self.0[a.max(b)] = a.min(b);
    }
}
