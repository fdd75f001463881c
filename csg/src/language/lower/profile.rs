//! A closed plane curve of lines and elliptic arcs as a Boolean formula of half-planes and
//! ellipses.
//!
//! The polygon of the chords has a formula in which the half-plane of each edge occurs once
//! (Dobkin, Guibas, Hershberger, Snoeyink 1988, "An efficient algorithm for finding the CSG
//! representation of a simple polygon": a chain is cut at a vertex of its convex hull; its halves
//! are intersected if the vertex is convex, else united). For an arc that bulges outward, the edge
//! is replaced by (half-plane or ellipse); for one that bulges inward, by (half-plane without
//! ellipse). Parts of the caps that other edges cut off are added or removed at the end. So chords
//! are visible only at the ends of their arcs.
//!
//! This requires that control triangles of arcs and edges meet in common ends only; arcs are
//! bisected until they do.

use super::conic::{Arc, Piece, SpaceEllipse};
use crate::primitive::Ellipse;
use crate::{Solid, SurfaceId, Vector};
use std::f64::consts::PI;

/// One side of a line or an ellipse.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Literal {
    /// The line or ellipse.
    pub bound: Bound,
    /// The segment of the profile it comes from.
    pub segment: usize,
}

#[derive(Clone, Debug, PartialEq)]
pub(super) enum Bound {
    /// The half-plane to the left of the line through two points.
    Left([f64; 2], [f64; 2]),
    /// The inside of an ellipse.
    Inside(Ellipse),
}

/// The inside of a profile: a tree over the negative sides of its literals.
#[derive(Clone, Debug)]
pub(super) struct Profile {
    pub literals: Vec<Literal>,
    pub inside: Solid,
    /// An upper bound of the distance of the profile from the origin.
    pub reach: f64,
}

/// Why a profile is invalid.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum ProfileError {
    /// Two segments (by index) cross, touch, or continue each other backward.
    Crossing(usize, usize),
    /// The profile encloses no area.
    Empty,
    /// An arc does not meet the axis at a right angle.
    Slanted(usize),
}

/// An edge of the polygon: the chord of a line or an arc, counterclockwise around the inside.
#[derive(Clone, Debug)]
struct Edge {
    ends: [Vector; 2],
    /// Points whose convex hull contains the segment and its chord.
    hull: Vec<Vector>,
    arc: Option<(Arc, Ellipse)>,
    segment: usize,
    depth: u32,
}

/// Points closer than this fraction of the size coincide.
const SAME: f64 = 1e-9;
/// Largest number of bisections of an arc.
const DEEPEST: u32 = 8;

/// The formula of a profile; an open profile is closed by a line.
///
/// With `by_axis`, the part below y = 0 is ignored.
pub(super) fn formula(pieces: &[Piece], by_axis: bool) -> Result<Profile, ProfileError> {
    let size = pieces.iter().flat_map(Piece::control).map(|p| p.amax()).fold(0.0, f64::max);
    let cutter = Cutter { by_axis, tolerance: SAME * size };
    if let Some(ellipse) = cutter.whole_ellipse(pieces) {
        let literals = vec![Literal { bound: Bound::Inside(ellipse), segment: 0 }];
        let [x, y] = ellipse.center;
        let reach = x.hypot(y) + ellipse.radii[0].max(ellipse.radii[1]);
        return Ok(Profile { literals, inside: half(0), reach });
    }
    let mut edges = cutter.edges(pieces)?;
    while let Some([i, j]) = cutter.conflict(&edges) {
        let can_split = |k: &usize| edges[*k].arc.is_some() && edges[*k].depth < DEEPEST;
        // Process the later edge first, so that the index of the other stays valid.
        let split: Vec<usize> = [i.max(j), i.min(j)].into_iter().filter(can_split).collect();
        if split.is_empty() {
            return Err(ProfileError::Crossing(edges[i].segment, edges[j].segment));
        }
        for k in split {
            let parts = cutter.halved(&edges[k])?;
            edges.splice(k..=k, parts);
        }
    }
    cutter.extend_along_axis(&mut edges);
    Ok(Builder { literals: Vec::new(), edges: &edges, tolerance: cutter.tolerance }.build())
}

/// About twice the area enclosed by segments.
fn area(pieces: &[Piece]) -> f64 {
    let twice = |p: Vector, q: Vector| p.cross(&q).z;
    let each = pieces.iter().map(|piece| match *piece {
        Piece::Line([p, q]) => twice(p, q),
        Piece::Arc(arc) => arc.halves().iter().map(|half| twice(half.points[0], half.points[2])).sum(),
    });
    each.sum()
}

/// Cuts segments into edges.
struct Cutter {
    by_axis: bool,
    /// A length.
    tolerance: f64,
}

impl Cutter {
    /// The ellipse that a profile of arcs forms, completely or as a half closed by the axis.
    fn whole_ellipse(&self, pieces: &[Piece]) -> Option<Ellipse> {
        /// Tolerance of the total turning angle, radians.
        const ANGLE: f64 = 1e-3;
        let mut found: Option<(Ellipse, f64)> = None;
        let mut turn = 0.0;
        for piece in pieces {
            let Piece::Arc(arc) = *piece else { return None };
            let ellipse = SpaceEllipse::of(&arc).flat();
            let [p, q, r] = arc.points;
            let angle = (q - p).angle(&(r - q)) * (q - p).cross(&(r - q)).z.signum();
            turn += angle;
            let (first, sign) = *found.get_or_insert((ellipse, angle));
            let on = |x: Vector| first.value([x.x, x.y]).abs() <= self.tolerance;
            let near = (0..2).all(|i| (first.center[i] - ellipse.center[i]).abs() <= self.tolerance);
            if !(near && on(p) && on(r) && on(arc.middle()) && sign * angle > 0.0) {
                return None;
            }
        }
        let (ellipse, _) = found?;
        let lowest = ellipse.center[1]
            - (ellipse.axis[1] * ellipse.radii[0]).hypot(ellipse.axis[0] * ellipse.radii[1]);
        let whole = (turn.abs() - 2.0 * PI).abs() < ANGLE && (!self.by_axis || lowest > self.tolerance);
        let half =
            self.by_axis && (turn.abs() - PI).abs() < ANGLE && ellipse.center[1].abs() <= self.tolerance;
        (whole || half).then_some(ellipse)
    }

    /// The edges of the polygon, counterclockwise; points near the axis are moved onto it.
    fn edges(&self, pieces: &[Piece]) -> Result<Vec<Edge>, ProfileError> {
        let on_axis = |mut p: Vector| {
            if self.by_axis && p.y <= self.tolerance {
                p.y = 0.0;
            }
            p
        };
        let is_long = |piece: &Piece| {
            let [p, q] = piece.ends();
            (p - q).norm() > self.tolerance
        };
        let settled = pieces.iter().map(|piece| match *piece {
            Piece::Line(ends) => Piece::Line(ends.map(on_axis)),
            Piece::Arc(Arc { points: [p, q, r], .. }) => Piece::new(&[on_axis(p), q, on_axis(r)]),
        });
        let mut all: Vec<(usize, Piece)> = settled.enumerate().filter(|(_, piece)| is_long(piece)).collect();
        let (Some(first), Some(last)) = (all.first(), all.last()) else { return Err(ProfileError::Empty) };
        let closing = Piece::Line([last.1.ends()[1], first.1.ends()[0]]);
        if is_long(&closing) {
            all.push((last.0, closing));
        }
        let area = area(&all.iter().map(|(_, piece)| *piece).collect::<Vec<_>>());
        if area.abs() <= self.tolerance * self.tolerance {
            return Err(ProfileError::Empty);
        }
        if area < 0.0 {
            all.reverse();
        }
        let mut edges = Vec::new();
        for (segment, piece) in all {
            let piece = if area < 0.0 { piece.reversed() } else { piece };
            let arc = match piece {
                Piece::Arc(arc) => Some((arc, SpaceEllipse::of(&arc).flat())),
                Piece::Line(_) => None,
            };
            edges.extend(self.edges_of(piece.ends(), arc, segment, 0)?);
        }
        Ok(edges)
    }

    /// The edge of a segment; two edges for an arc from the axis to the axis.
    ///
    /// The chord of an arc with one end on the axis is perpendicular to the axis and starts at the
    /// arc's other end; the axis closes the gap. So the chord never sweeps a cone with its apex on
    /// the surface.
    fn edges_of(
        &self,
        mut ends: [Vector; 2],
        arc: Option<(Arc, Ellipse)>,
        segment: usize,
        depth: u32,
    ) -> Result<Vec<Edge>, ProfileError> {
        /// Largest cosine of the angle between the arc and the axis.
        const SLANTED: f64 = 1e-6;
        let Some((arc, ellipse)) = arc else {
            return Ok(vec![Edge { ends, hull: ends.to_vec(), arc: None, segment, depth }]);
        };
        let [p, q, r] = arc.points;
        let mut hull = arc.points.to_vec();
        let touches = ends.map(|end| self.by_axis && end.y <= self.tolerance);
        for (end, touches) in ends.into_iter().zip(touches) {
            if touches && (q - end).x.abs() > SLANTED * (q - end).norm() {
                return Err(ProfileError::Slanted(segment));
            }
        }
        match touches {
            [true, true] => {
                let parts = arc
                    .halves()
                    .map(|half| self.edges_of(half.ends(), Some((half, ellipse)), segment, depth));
                let [first, second] = parts;
                return Ok([first?, second?].concat());
            }
            [true, false] => ends[0] = Vector::new(r.x, 0.0, 0.0),
            [false, true] => ends[1] = Vector::new(p.x, 0.0, 0.0),
            [false, false] => {}
        }
        hull.extend(ends);
        Ok(vec![Edge { ends, hull, arc: Some((arc, ellipse)), segment, depth }])
    }

    fn halved(&self, edge: &Edge) -> Result<Vec<Edge>, ProfileError> {
        let Some((arc, ellipse)) = edge.arc else { return Ok(vec![edge.clone()]) };
        let [first, second] = arc
            .halves()
            .map(|half| self.edges_of(half.ends(), Some((half, ellipse)), edge.segment, edge.depth + 1));
        Ok([first?, second?].concat())
    }

    /// Two edges whose hulls share more than the common vertex of consecutive edges.
    fn conflict(&self, edges: &[Edge]) -> Option<[usize; 2]> {
        let count = edges.len();
        for i in 0..count {
            for j in i + 1..count {
                let follows = [j == i + 1, i == 0 && j + 1 == count];
                let room = if follows.contains(&true) { -self.tolerance } else { self.tolerance };
                let folds = (follows[0] && folds_back(&edges[i], &edges[j]))
                    || (follows[1] && folds_back(&edges[j], &edges[i]));
                if (follows[0] && follows[1]) || folds || !separated(&edges[i].hull, &edges[j].hull, room) {
                    return Some([i, j]);
                }
            }
        }
        None
    }

    /// Extends lines along the axis to the adjacent chords; removes lines of zero length.
    fn extend_along_axis(&self, edges: &mut Vec<Edge>) {
        let count = edges.len();
        for i in 0..count {
            let (before, after) = (edges[(i + count - 1) % count].ends[1], edges[(i + 1) % count].ends[0]);
            if self.is_along_axis(&edges[i]) {
                edges[i].ends = [before, after];
            }
        }
        edges.retain(|e| !self.is_along_axis(e) || (e.ends[0] - e.ends[1]).norm() > self.tolerance);
    }

    fn is_along_axis(&self, edge: &Edge) -> bool {
        self.by_axis && edge.arc.is_none() && edge.ends.iter().all(|end| end.y == 0.0)
    }
}

/// Whether an edge runs back along the previous one.
fn folds_back(edge: &Edge, next: &Edge) -> bool {
    /// Largest sine of a zero angle.
    const NO_ANGLE: f64 = 1e-6;
    let [a, b] = [edge.ends[1] - edge.ends[0], next.ends[1] - next.ends[0]];
    // On the axis edges may run back, because they sweep nothing.
    edge.ends[1].y != 0.0 && a.dot(&b) < 0.0 && a.cross(&b).norm() <= NO_ANGLE * a.norm() * b.norm()
}

/// Whether a line separates two convex hulls with a gap of at least `room` (an overlap if
/// negative).
fn separated(first: &[Vector], second: &[Vector], room: f64) -> bool {
    let directions = |hull: &[Vector]| {
        let mut all = Vec::new();
        for (i, p) in hull.iter().enumerate() {
            for q in &hull[i + 1..] {
                let along = (q - p).try_normalize(0.0).unwrap_or_default();
                all.extend([along, Vector::new(along.y, -along.x, 0.0)]);
            }
        }
        all
    };
    let extent = |hull: &[Vector], n: &Vector| {
        hull.iter()
            .map(|p| n.dot(p))
            .fold([f64::INFINITY, f64::NEG_INFINITY], |[lo, hi], x| [lo.min(x), hi.max(x)])
    };
    directions(first).iter().chain(&directions(second)).any(|n| {
        let ([a, b], [c, d]) = (extent(first, n), extent(second, n));
        b + room <= c || d + room <= a
    })
}

fn half(index: usize) -> Solid {
    Solid::Half { surface: SurfaceId::new(index), positive: false }
}

fn not(solid: Solid) -> Solid {
    match solid {
        Solid::Half { surface, positive } => Solid::Half { surface, positive: !positive },
        other => Solid::Not(Box::new(other)),
    }
}

struct Builder<'a> {
    literals: Vec<Literal>,
    edges: &'a [Edge],
    /// A length.
    tolerance: f64,
}

impl Builder<'_> {
    fn build(mut self) -> Profile {
        let count = self.edges.len();
        let corner = |i: &usize| self.edges[*i].ends[0];
        let order = |i: &usize, j: &usize| {
            let (p, q) = (corner(i), corner(j));
            p.x.total_cmp(&q.x).then(p.y.total_cmp(&q.y))
        };
        let (low, high) = ((0..count).min_by(order).unwrap_or(0), (0..count).max_by(order).unwrap_or(0));
        let run = |from: usize, to: usize| -> Vec<usize> {
            (0..(to + count - from) % count).map(|k| (from + k) % count).collect()
        };
        let (mut added, mut removed) = (Vec::new(), Vec::new());
        let leaves: Vec<Solid> = (0..count).map(|i| self.leaf(i, &mut added, &mut removed)).collect();
        let chains = [run(low, high), run(high, low)].map(|chain| self.chain(&chain, &leaves));
        let [first, second] = chains;
        let mut inside = join(true, first, second);
        if !added.is_empty() {
            added.insert(0, inside);
            inside = Solid::Or(added);
        }
        if !removed.is_empty() {
            removed.insert(0, inside);
            inside = Solid::And(removed);
        }
        // The hulls contain the arcs.
        let reach = self.edges.iter().flat_map(|e| &e.hull).map(|p| p.norm()).fold(0.0, f64::max);
        Profile { literals: self.literals, inside, reach }
    }

    fn literal(&mut self, bound: Bound, segment: usize) -> Solid {
        let known = self.literals.iter().position(|l| l.bound == bound);
        half(known.unwrap_or_else(|| {
            self.literals.push(Literal { bound, segment });
            self.literals.len() - 1
        }))
    }

    /// The part of an edge in the polygon's formula; caps to add or remove are appended to the
    /// lists.
    fn leaf(&mut self, index: usize, added: &mut Vec<Solid>, removed: &mut Vec<Solid>) -> Solid {
        let Edge { ends: [p, q], arc, segment, .. } = self.edges[index].clone();
        let line = self.literal(Bound::Left([p.x, p.y], [q.x, q.y]), segment);
        let Some((arc, ellipse)) = arc else { return line };
        let ellipse = self.literal(Bound::Inside(ellipse), segment);
        if (q - p).cross(&(arc.middle() - p)).z < 0.0 {
            added.push(Solid::And(vec![ellipse.clone(), not(line.clone())]));
            Solid::Or(vec![line, ellipse])
        } else {
            removed.push(Solid::Or(vec![not(ellipse.clone()), not(line.clone())]));
            Solid::And(vec![line, not(ellipse)])
        }
    }

    /// The formula of a chain of edges whose first and last edge extend to infinity.
    fn chain(&self, edges: &[usize], leaves: &[Solid]) -> Solid {
        let [.., last] = edges else { return Solid::And(Vec::new()) };
        if edges.len() == 1 {
            return leaves[*last].clone();
        }
        let direction = |i: usize| {
            let [p, q] = self.edges[i].ends;
            (q - p).normalize()
        };
        let (first, end) = (direction(edges[0]), direction(*last));
        // The direction away from both end rays, in which the hull has a vertex.
        let mut away = first - end;
        if away.norm() < SAME {
            away = Vector::new(end.y, -end.x, 0.0);
        }
        let corner = |k: &usize| self.edges[edges[*k]].ends[0];
        let farthest = (1..edges.len()).map(|k| away.dot(&corner(&k))).fold(f64::NEG_INFINITY, f64::max);
        // Of several farthest points, take one with an angle; points between on a line have none.
        let turn = |k: &usize| direction(edges[k - 1]).cross(&direction(edges[*k])).z;
        let candidates = (1..edges.len()).filter(|k| away.dot(&corner(k)) >= farthest - self.tolerance);
        let cut = candidates.max_by(|i, j| turn(i).abs().total_cmp(&turn(j).abs())).unwrap_or(1);
        let is_convex = turn(&cut) > 0.0;
        join(is_convex, self.chain(&edges[..cut], leaves), self.chain(&edges[cut..], leaves))
    }
}

/// The intersection (`meet`) or union of two trees, flattened with members of the same kind.
fn join(meet: bool, first: Solid, second: Solid) -> Solid {
    let mut members = Vec::new();
    for part in [first, second] {
        match (part, meet) {
            (Solid::And(more), true) | (Solid::Or(more), false) => members.extend(more),
            (other, _) => members.push(other),
        }
    }
    if meet { Solid::And(members) } else { Solid::Or(members) }
}
