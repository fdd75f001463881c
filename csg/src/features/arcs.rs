//! Cuts traces at crossings into arcs and classifies the arcs.

use super::cross::{Crossing, crossings};
use super::neighborhood::{Neighborhood, Tolerances, neighborhood};
use super::octree::Octree;
use super::trace::{Trace, along, tangent_along};
use super::{FeatureError, Named, Place};
use crate::project::project_to_both;
use crate::{Geometry, Interval, Point, Surface, SurfaceId, Vector};
use nalgebra::Matrix3;
use std::collections::HashMap;

/// The end points of arcs. Points within the merge tolerance are one node.
#[derive(Debug, Default)]
pub(super) struct Nodes {
    /// Coordinates, and the largest volume spanned by three normals there (how well the node is
    /// determined).
    points: Vec<(Point, f64)>,
    /// The nodes in each cell of a grid with the merge tolerance as spacing.
    grid: HashMap<[i64; 3], Vec<usize>>,
}

impl Nodes {
    /// The node at a point; adds one if there is none.
    fn add(&mut self, point: &Point, volume: f64, tolerances: &Tolerances) -> usize {
        let size = tolerances.merge;
        let key = [0, 1, 2].map(|i| (point[i] / size).floor() as i64);
        for shift in 0..27 {
            let near = [key[0] + shift % 3 - 1, key[1] + shift / 3 % 3 - 1, key[2] + shift / 9 - 1];
            for &node in self.grid.get(&near).into_iter().flatten() {
                if (self.points[node].0 - point).norm() <= size {
                    if volume > self.points[node].1 {
                        self.points[node] = (*point, volume);
                    }
                    return node;
                }
            }
        }
        self.grid.entry(key).or_default().push(self.points.len());
        self.points.push((*point, volume));
        self.points.len() - 1
    }

    /// Moves nodes that are off some of their surfaces: merged nodes and nodes at tangencies.
    fn relax(&mut self, geometry: &Geometry, tree: &Octree, tolerances: &Tolerances) {
        for (point, _) in &mut self.points {
            let near = |x: f64| Interval::new(x - tolerances.merge, x + tolerances.merge);
            let surfaces: Vec<&Surface> = tree
                .surfaces_in(&[near(point.x), near(point.y), near(point.z)])
                .into_iter()
                .map(|s| &geometry.surfaces[s.index()])
                .filter(|s| s.distance(point) <= tolerances.merge)
                .collect();
            let distance = |p: &Point| surfaces.iter().map(|s| s.distance(p)).fold(0.0, f64::max);
            let mut best = distance(point);
            for _ in 0..RELAXATION_STEPS {
                let Some(step) = common_step(&surfaces, point).filter(|_| best > tolerances.exact) else {
                    break;
                };
                let next = *point + step;
                let at_next = distance(&next);
                if at_next >= best {
                    break;
                }
                (*point, best) = (next, at_next);
            }
        }
    }

    /// The coordinates of a node.
    pub fn point(&self, node: usize) -> Point {
        self.points[node].0
    }
}

/// At tangent surfaces a step only halves the distance: this many reduce 10⁻⁸ to rounding.
const RELAXATION_STEPS: usize = 30;

/// The shortest least-squares step to all surfaces, to first order.
fn common_step(surfaces: &[&Surface], at: &Point) -> Option<Vector> {
    /// Directions in which the surfaces hardly differ are ignored.
    const LEAST_SINGULAR: f64 = 1e-6;
    let mut normal_matrix = Matrix3::zeros();
    let mut right = Vector::zeros();
    for surface in surfaces {
        let gradient = surface.gradient(at);
        let length = gradient.norm();
        if length > 0.0 {
            normal_matrix += gradient * gradient.transpose() / (length * length);
            right += gradient * (surface.value(at) / (length * length));
        }
    }
    let inverse = normal_matrix.pseudo_inverse(LEAST_SINGULAR).ok()?;
    Some(-(inverse * right))
}

/// A piece of a trace between crossings, or a closed trace without crossings.
#[derive(Clone, Debug)]
pub(super) struct Arc {
    /// The surfaces whose intersection it is.
    pub pair: [SurfaceId; 2],
    /// Points on the arc.
    pub points: Vec<Point>,
    /// The nodes at its ends, `None` where the trace stopped; no ends at all if the arc is closed.
    pub ends: Option<[Option<usize>; 2]>,
    /// The surfaces and sheets around it.
    pub neighborhood: Neighborhood,
    /// A point in its interior.
    pub middle: Point,
    /// The sine of the angle between the two surfaces at `middle`.
    sine: f64,
}

/// Cuts all traces into arcs and returns the arcs of features without duplicates, and their end
/// nodes.
///
/// # Errors
/// [`FeatureError::LooseCurve`] or [`FeatureError::Tangent`] if the neighborhood changes along an
/// arc, or an arc ends without a node; errors of [`neighborhood`].
pub(super) fn feature_arcs(
    geometry: &Geometry,
    tree: &Octree,
    traces: &[Trace],
    tolerances: &Tolerances,
) -> Result<(Vec<Arc>, Nodes), FeatureError> {
    let mut nodes = Nodes::default();
    let mut cuts: Vec<_> =
        traces.iter().map(|trace| cuts(geometry, tree, trace, &mut nodes, tolerances)).collect();
    nodes.relax(geometry, tree, tolerances);
    for (trace, cuts) in traces.iter().zip(&mut cuts) {
        cut_at_known_nodes(geometry, trace, &nodes, cuts, tolerances);
    }
    let mut arcs = Vec::new();
    for (trace, cuts) in traces.iter().zip(&cuts) {
        for (points, ends) in pieces(trace, cuts, &nodes, tolerances) {
            if let Some(arc) = classify(geometry, tree, trace.pair, points, ends, tolerances)? {
                arcs.push(arc);
            }
        }
    }
    Ok((without_duplicates(geometry, arcs, tolerances)?, nodes))
}

/// The positions on a trace at which it is cut, ascending, with their nodes.
fn cuts(
    geometry: &Geometry,
    tree: &Octree,
    trace: &Trace,
    nodes: &mut Nodes,
    tolerances: &Tolerances,
) -> Vec<(f64, usize)> {
    let last = trace.points.len() - 1;
    let mut all: Vec<Crossing> = crossings(geometry, tree, trace, tolerances);
    let end =
        |position: usize| Crossing { position: position as f64, point: trace.points[position], volume: 0.0 };
    if trace.branches[0] {
        all.insert(0, end(0));
    }
    if trace.branches[1] {
        all.push(end(last));
    }
    let mut cuts: Vec<(f64, usize)> = Vec::new();
    for crossing in all {
        let node = nodes.add(&crossing.point, crossing.volume, tolerances);
        let again = cuts.last().is_some_and(|&(position, known)| {
            known == node && length(trace, position, crossing.position) <= 4.0 * tolerances.merge
        });
        if !again {
            cuts.push((crossing.position, node));
        }
    }
    // On a closed trace the same crossing may appear at both ends.
    if let (true, [first, .., end]) = (trace.closed, &cuts[..]) {
        let around = length(trace, end.0, last as f64) + length(trace, 0.0, first.0);
        if first.1 == end.1 && around <= 4.0 * tolerances.merge {
            cuts.pop();
        }
    }
    cuts
}

/// Cuts a trace also at nodes found on other traces.
///
/// Two traces may cover the same piece of a curve, and the longer steps of only one of them may
/// have met an irrelevant surface. Cut at the same nodes, the pieces are recognized as equal.
fn cut_at_known_nodes(
    geometry: &Geometry,
    trace: &Trace,
    nodes: &Nodes,
    cuts: &mut Vec<(f64, usize)>,
    tolerances: &Tolerances,
) {
    let lowest = trace.points.iter().fold(trace.points[0], |m, p| m.inf(p));
    let highest = trace.points.iter().fold(trace.points[0], |m, p| m.sup(p));
    let room = 0.1 * (highest - lowest).norm();
    for (node, (point, _)) in nodes.points.iter().enumerate() {
        let is_near = (0..3).all(|i| lowest[i] - room <= point[i] && point[i] <= highest[i] + room);
        let is_on = |s: &SurfaceId| geometry.surfaces[s.index()].distance(point) <= tolerances.on_surface;
        if !is_near || cuts.iter().any(|c| c.1 == node) || !trace.pair.iter().all(is_on) {
            continue;
        }
        let steps = trace.points.windows(2).enumerate();
        let position = steps.filter_map(|(i, ends)| along(ends, point).map(|part| i as f64 + part)).next();
        cuts.extend(position.map(|position| (position, node)));
    }
    cuts.sort_by(|x, y| x.0.total_cmp(&y.0));
}

/// The length of a trace between two positions.
fn length(trace: &Trace, from: f64, to: f64) -> f64 {
    let stops = (from as usize + 1..=to as usize).map(|i| trace.points[i]);
    let (mut sum, mut last) = (0.0, trace.at(from));
    for stop in stops.chain([trace.at(to)]) {
        sum += (stop - last).norm();
        last = stop;
    }
    sum
}

/// The points and end nodes of an arc.
type Piece = (Vec<Point>, Option<[Option<usize>; 2]>);

/// Cuts a trace at the given positions.
fn pieces(trace: &Trace, cuts: &[(f64, usize)], nodes: &Nodes, tolerances: &Tolerances) -> Vec<Piece> {
    let last = trace.points.len() - 1;
    if cuts.is_empty() {
        let ends = if trace.closed { None } else { Some([None, None]) };
        return vec![(trace.points.clone(), ends)];
    }
    let mut pieces = Vec::new();
    for two in cuts.windows(2) {
        let inner = inner_points(trace, two[0].0, two[1].0);
        pieces.push((inner, Some([Some(two[0].1), Some(two[1].1)])));
    }
    let (first, end) = (cuts[0], cuts[cuts.len() - 1]);
    if trace.closed {
        let mut inner = inner_points(trace, end.0, last as f64);
        inner.extend((end.0 < last as f64).then_some(trace.points[last]));
        inner.extend(inner_points(trace, 0.0, first.0));
        pieces.push((inner, Some([Some(end.1), Some(first.1)])));
    } else {
        if first.0 > 0.0 {
            let inner = [&trace.points[..1], &inner_points(trace, 0.0, first.0)].concat();
            pieces.push((inner, Some([None, Some(first.1)])));
        }
        if end.0 < last as f64 {
            let mut inner = inner_points(trace, end.0, last as f64);
            inner.push(trace.points[last]);
            pieces.push((inner, Some([Some(end.1), None])));
        }
    }
    for (points, ends) in &mut pieces {
        let [start, end] = ends.expect("a cut trace has no closed pieces").map(|e| e.map(|n| nodes.point(n)));
        // A trace point close to a node would make a step of nearly zero length.
        let beside =
            |p: &Point| [start, end].iter().flatten().any(|n| (n - p).norm() <= 4.0 * tolerances.merge);
        points.retain(|p| !beside(p));
        points.splice(0..0, start);
        points.extend(end);
    }
    pieces
        .retain(|(points, ends)| points.len() > 2 || ends.is_some_and(|[a, b]| a != b && points.len() == 2));
    pieces
}

/// The points of a trace strictly between two positions.
fn inner_points(trace: &Trace, from: f64, to: f64) -> Vec<Point> {
    let (first, last) = (from.floor() as usize + 1, to.ceil() as usize);
    trace.points[first.min(last)..last].to_vec()
}

/// The point at a fraction of the length of a polyline, projected to both surfaces, and the
/// direction there.
fn sample(
    geometry: &Geometry,
    pair: [SurfaceId; 2],
    points: &[Point],
    part: f64,
    tolerances: &Tolerances,
) -> (Point, Vector) {
    let total: f64 = points.windows(2).map(|w| (w[1] - w[0]).norm()).sum();
    let mut left = part * total;
    let mut ends = &points[..2];
    for step in points.windows(2) {
        ends = step;
        let length = (step[1] - step[0]).norm();
        if left <= length {
            break;
        }
        left -= length;
    }
    let chord = ends[1] - ends[0];
    let start = ends[0] + chord * (left / chord.norm()).min(1.0);
    let [a, b] = pair.map(|s| &geometry.surfaces[s.index()]);
    (project_to_both(a, b, &start, tolerances.exact).unwrap_or(start), chord)
}

/// Makes an arc of the given points if it belongs to a feature, else `None`.
fn classify(
    geometry: &Geometry,
    tree: &Octree,
    pair: [SurfaceId; 2],
    points: Vec<Point>,
    ends: Option<[Option<usize>; 2]>,
    tolerances: &Tolerances,
) -> Result<Option<Arc>, FeatureError> {
    /// Other fractions of the length at which the neighborhood is compared with that in the middle.
    /// If a surface separates from the curve with a high power of the distance from an end, it
    /// counts as passing through the curve for some length: then the next fraction, further inside,
    /// is used.
    const OTHER_PARTS: [[f64; 3]; 2] = [[0.27, 0.37, 0.46], [0.81, 0.69, 0.58]];
    let neighborhood_at = |part: f64| {
        let (at, forward) = sample(geometry, pair, &points, part, tolerances);
        let found = neighborhood(geometry, tree, pair, &at, &forward, tolerances);
        found.map(|found| (at, found)).map_err(|error| error.along(&points))
    };
    // If the pair is not relevant, a feature here belongs to other surfaces through the curve.
    let (middle, Some(found)) = neighborhood_at(0.52)? else { return Ok(None) };
    let sheets = |at: &Neighborhood| if at.is_feature() { at.sheets.clone() } else { Vec::new() };
    let mut surfaces = found.surfaces.clone();
    // The curve is unknown beyond the point where the trace stopped: then only the middle counts.
    let whole = ends.is_none_or(|ends| ends.iter().all(Option::is_some));
    for parts in if whole { &OTHER_PARTS[..] } else { &[] } {
        let mut parts = parts.iter();
        let other = loop {
            let part = parts.next().expect("the last of the parts is taken as it is");
            let (at, Some(other)) = neighborhood_at(*part)? else { return Ok(None) };
            if sheets(&other) == sheets(&found) {
                break other;
            }
            if parts.as_slice().is_empty() || other.surfaces == found.surfaces {
                return Err(loose_curve(geometry, pair, &at));
            }
        };
        surfaces.extend(other.surfaces);
    }
    if !found.is_feature() {
        return Ok(None);
    }
    surfaces.sort_unstable();
    surfaces.dedup();
    let [a, b] = pair.map(|s| &geometry.surfaces[s.index()]);
    let sine = a.normal(&middle).cross(&b.normal(&middle)).norm();
    let neighborhood = Neighborhood { surfaces, ..found };
    Ok(Some(Arc { pair, points, ends, neighborhood, middle, sine }))
}

/// Removes duplicate arcs, found from several pairs of surfaces through one curve or by two traces.
///
/// Of equal arcs, keeps the one whose surfaces cross at the largest angle.
fn without_duplicates(
    geometry: &Geometry,
    arcs: Vec<Arc>,
    tolerances: &Tolerances,
) -> Result<Vec<Arc>, FeatureError> {
    let mut order: Vec<usize> = (0..arcs.len()).collect();
    order.sort_by(|&x, &y| arcs[y].sine.total_cmp(&arcs[x].sine).then(x.cmp(&y)));
    let key = |arc: &Arc| arc.ends.map(|[a, b]| (a.min(b), a.max(b)));
    let (whole, open): (Vec<_>, Vec<_>) =
        order.into_iter().partition(|&i| arcs[i].ends.is_none_or(|ends| ends.iter().all(Option::is_some)));
    let mut kept: Vec<usize> = Vec::new();
    let mut between: HashMap<_, Vec<usize>> = HashMap::new();
    for i in whole {
        let known = between.entry(key(&arcs[i])).or_default();
        if !known.iter().any(|&k| arcs[k].passes(geometry, &arcs[i].middle, tolerances)) {
            known.push(i);
            kept.push(i);
        }
    }
    for i in open {
        if !kept.iter().any(|&k| arcs[k].passes(geometry, &arcs[i].middle, tolerances)) {
            return Err(loose_curve(geometry, arcs[i].pair, &arcs[i].middle));
        }
    }
    kept.sort_unstable();
    Ok(kept.into_iter().map(|i| arcs[i].clone()).collect())
}

/// The error for a curve with a loose end: a tangency if its surfaces are nearly tangent there.
pub(super) fn loose_curve(geometry: &Geometry, pair: [SurfaceId; 2], at: &Point) -> FeatureError {
    /// From this sine of the angle on, tracing is reliable.
    const STEEP: f64 = 1e-2;
    let [a, b] = pair.map(|s| geometry.surfaces[s.index()].normal(at));
    if a.cross(&b).norm() < STEEP {
        return FeatureError::tangent(geometry, pair, *at, None);
    }
    let [first, second] = pair.map(|s| Named::surface(geometry, s));
    FeatureError::LooseCurve { first, second, place: Place(*at) }
}

impl Arc {
    /// Whether a point lies on the arc.
    pub fn passes(&self, geometry: &Geometry, point: &Point, tolerances: &Tolerances) -> bool {
        let on = |s: &SurfaceId| geometry.surfaces[s.index()].distance(point) <= tolerances.on_surface;
        self.pair.iter().all(on) && self.points.windows(2).any(|ends| along(ends, point).is_some())
    }

    /// The same arc in the opposite direction.
    pub fn reversed(mut self) -> Self {
        self.points.reverse();
        self.ends = self.ends.map(|[a, b]| [b, a]);
        for (_, left) in &mut self.neighborhood.sheets {
            *left = !*left;
        }
        self.neighborhood.sheets.sort_unstable();
        self
    }

    /// Whether the arc and `next`, which starts at its end, may be one curve.
    pub fn continues_in(&self, geometry: &Geometry, next: &Self) -> bool {
        /// Arcs on the same surfaces form a corner if the cosine of their angle is at most this;
        /// two trace steps turn less.
        const STRAIGHT: f64 = 0.9;
        let same = self.pair == next.pair || self.neighborhood.surfaces == next.neighborhood.surfaces;
        let direction = |arc: &Self, at: &Point, chord: Vector| {
            let [a, b] = arc.pair.map(|s| &geometry.surfaces[s.index()]);
            tangent_along(a, b, at, &chord)
        };
        let n = self.points.len();
        let end = direction(self, &self.points[n - 1], self.points[n - 1] - self.points[n - 2]);
        let start = direction(next, &next.points[0], next.points[1] - next.points[0]);
        same && self.neighborhood.sheets == next.neighborhood.sheets && end.dot(&start) > STRAIGHT
    }
}
