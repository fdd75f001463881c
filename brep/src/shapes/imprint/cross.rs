//! Edges divided where edges of another face on the same surface meet them.

use super::super::Shapes;
use super::super::split::{divide_in, inner_parameter};
use super::room;
use crate::model::Corner;
use crate::nearest::nearest_on_curve;
use crate::shapes::glue::SAME;
use crate::{EdgeCurve, Point};
use std::collections::{BTreeMap, BTreeSet, HashMap};

/// Where curves are to be divided: parameters and corners.
type Divisions = BTreeMap<usize, Vec<(f64, usize)>>;

/// The faces that curves bound.
#[derive(Default)]
struct Bounded(HashMap<usize, Vec<usize>>);

impl Bounded {
    fn of(shapes: &Shapes) -> Self {
        let mut faces: HashMap<usize, Vec<usize>> = HashMap::new();
        for face in 0..shapes.faces.len() {
            shapes.curves_of(face).into_iter().for_each(|curve| faces.entry(curve).or_default().push(face));
        }
        Self(faces)
    }

    /// Whether two curves are sides of one face without a common end: no corner is on both, however
    /// narrow the face.
    fn are_apart(&self, shapes: &Shapes, [a, b]: [usize; 2]) -> bool {
        let [of_a, of_b] = [a, b].map(|curve| self.0.get(&curve).map_or(&[][..], Vec::as_slice));
        let ends = shapes.curves[b].ends;
        of_a.iter().any(|face| of_b.contains(face))
            && !shapes.curves[a].ends.iter().any(|end| ends.contains(end))
    }

    /// Whether a place so far from a curve is nearer to one of the others on the other side of a
    /// face.
    fn is_beside(
        &self,
        shapes: &Shapes,
        curve: usize,
        others: &[usize],
        (place, reach): (&Point, f64),
    ) -> bool {
        others.iter().any(|&other| {
            self.are_apart(shapes, [curve, other])
                && inner_parameter(&shapes.curves[other], place, reach, 0.0).is_some()
        })
    }
}

/// Crossings this close to another one on the same edge, in tolerances, are there.
const BESIDE: f64 = 3.0;
/// Crossings this close to an end, in tolerances, are there.
const AT_END: f64 = 2.0;

/// Which curves may divide each other.
#[derive(Clone, Copy)]
pub(super) enum Pair {
    /// Those of two faces on one surface.
    Faces([usize; 2]),
    /// The curves that are to divide a face, and its edges.
    Edges(usize),
    /// The curves that are to divide a face, and these and its edges.
    Inside(usize),
}

impl Pair {
    fn faces(self) -> [usize; 2] {
        match self {
            Self::Faces(faces) => faces,
            Self::Edges(face) | Self::Inside(face) => [face; 2],
        }
    }

    fn sides(self, shapes: &Shapes) -> [Vec<usize>; 2] {
        match self {
            Self::Faces(faces) => faces.map(|face| shapes.curves_on(face)),
            Self::Edges(face) => [shapes.faces[face].inner.clone(), shapes.curves_of(face)],
            Self::Inside(face) => [shapes.faces[face].inner.clone(), shapes.curves_on(face)],
        }
    }
}

/// Divides the edges of faces at the vertices of others. Returns whether any was divided.
pub(super) fn divide_at_vertices(shapes: &mut Shapes, pairs: &[Pair], size: f64) -> bool {
    let bounded = Bounded::of(shapes);
    // Each corner with the curves that it is to divide, and how far away these are.
    let mut found: BTreeMap<usize, Vec<(f64, usize, f64)>> = BTreeMap::new();
    let mut boxes = Boxes::default();
    for &pair in pairs {
        let own = room(shapes, pair.faces(), size);
        let [of_a, of_b] = pair.sides(shapes);
        let ends = |curves: &[usize]| curves.iter().flat_map(|&curve| shapes.curves[curve].ends).collect();
        let both: [(&[usize], BTreeSet<usize>); 2] = [(&of_b, ends(&of_a)), (&of_a, ends(&of_b))];
        for (&curve, corners) in both.iter().flat_map(|(curves, ends)| curves.iter().map(move |c| (c, ends)))
        {
            let edge = &shapes.curves[curve];
            let room = own + edge.tolerance;
            let [low, high] = boxes.of(shapes, curve, room);
            for &corner in corners.iter().filter(|corner| !edge.ends.contains(corner)) {
                let point = shapes.corners[corner].point;
                let is_near = (0..3).all(|axis| low[axis] <= point[axis] && point[axis] <= high[axis]);
                if let Some(at) = is_near.then(|| inner_parameter(edge, &point, room, room)).flatten() {
                    let away = (Point::from(edge.curve.point(at)) - point).norm();
                    found.entry(corner).or_default().push((away, curve, at));
                }
            }
        }
    }
    let mut divisions = Divisions::new();
    for (corner, mut curves) in found {
        curves.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut divided: Vec<usize> = Vec::new();
        for (_, curve, at) in curves {
            if !divided.iter().any(|&other| bounded.are_apart(shapes, [curve, other])) {
                divided.push(curve);
                divisions.entry(curve).or_default().push((at, corner));
            }
        }
    }
    let is_any = !divisions.is_empty();
    apply(shapes, divisions, size);
    is_any
}

/// Divides the edges of faces where they cross each other.
pub(super) fn divide_at_crossings(shapes: &mut Shapes, pairs: &[Pair], size: f64) {
    let mut crossed = Crossed { bounded: Bounded::of(shapes), ..Crossed::default() };
    let mut boxes = Boxes::default();
    for &pair in pairs {
        let own = room(shapes, pair.faces(), size);
        let body = shapes.faces[pair.faces()[0]].body;
        let sides = pair.sides(shapes);
        let row = Row::new(shapes, &mut boxes, &sides[1]);
        for &p in &sides[0] {
            let reach = 2.0 * (own + shapes.curves[p].tolerance + row.tolerance);
            let beside = row.beside(&boxes.of(shapes, p, reach));
            for q in beside.into_iter().map(|k| sides[1][k]).filter(|&q| q != p) {
                let room = own + shapes.curves[p].tolerance + shapes.curves[q].tolerance;
                if !overlap(&boxes.of(shapes, p, room), &boxes.of(shapes, q, room)) {
                    continue;
                }
                for (at, points) in crossings(&shapes.curves[p], &shapes.curves[q], room) {
                    let reach = (points[1] - points[0]).norm();
                    let is_beside = |k: usize| {
                        let place = (&points[1 - k], reach);
                        crossed.bounded.is_beside(shapes, [p, q][k], &sides[k], place)
                    };
                    if reach <= own || !(0..2).any(is_beside) {
                        let point = nalgebra::center(&points[0], &points[1]);
                        crossed.add(shapes, body, ([p, q], at), Corner { point, tolerance: room });
                    }
                }
            }
        }
    }
    apply(shapes, crossed.divisions, size);
}

/// Where curves cross.
#[derive(Default)]
struct Crossed {
    bounded: Bounded,
    divisions: Divisions,
    /// The corners, each with the curves that it is to divide.
    corners: BTreeMap<usize, Vec<usize>>,
}

impl Crossed {
    /// Adds a place where two curves cross: as a corner, or at one that is there.
    fn add(&mut self, shapes: &mut Shapes, body: usize, (pair, at): ([usize; 2], [f64; 2]), place: Corner) {
        let away = |corner: usize| (shapes.corners[corner].point - place.point).norm();
        // Curves of two faces meet their edge where each face is.
        let there = pair.iter().filter_map(|curve| self.divisions.get(curve)).flatten();
        let beside = there.map(|known| known.1).filter(|&corner| away(corner) <= BESIDE * place.tolerance);
        let near = self.corners.keys().copied().filter(|&corner| away(corner) <= place.tolerance);
        let may_divide = |corner: &usize| {
            let divided = self.corners.get(corner).into_iter().flatten();
            let mut pairs = divided.flat_map(|&other| pair.map(|curve| [curve, other]));
            !pairs.any(|pair| self.bounded.are_apart(shapes, pair))
        };
        let known = beside.chain(near).filter(may_divide);
        let known = known.min_by(|&a, &b| away(a).total_cmp(&away(b)));
        let corner = known.unwrap_or_else(|| shapes.add_corner(place, body));
        self.corners.entry(corner).or_default().extend(pair);
        for (curve, at) in pair.into_iter().zip(at) {
            self.divisions.entry(curve).or_default().push((at, corner));
        }
    }
}

/// Divides curves, each at one corner only where several are close.
fn apply(shapes: &mut Shapes, divisions: Divisions, size: f64) {
    if divisions.is_empty() {
        return;
    }
    let mut faces_of: HashMap<usize, Vec<usize>> = HashMap::new();
    for face in 0..shapes.faces.len() {
        for curve in shapes.curves_on(face).into_iter().filter(|curve| divisions.contains_key(curve)) {
            let faces = faces_of.entry(curve).or_default();
            // A curve of the face may also be one that is to divide it.
            if faces.last() != Some(&face) {
                faces.push(face);
            }
        }
    }
    for (curve, mut places) in divisions {
        let faces = faces_of.remove(&curve).unwrap_or_default();
        places.sort_by(|a, b| a.0.total_cmp(&b.0));
        let room = AT_END * SAME * size;
        let is_apart = |a: usize, b: usize| (shapes.corners[a].point - shapes.corners[b].point).norm() > room;
        // Corners further apart may have the same place on a curve beside both.
        let on = |at: f64| Point::from(shapes.curves[curve].curve.point(at));
        places.dedup_by(|a, b| !is_apart(a.1, b.1) || (on(a.0) - on(b.0)).norm() <= room);
        // From the end: the first part keeps the index.
        for (at, corner) in places.into_iter().rev() {
            let on = Point::from(shapes.curves[curve].curve.point(at));
            let own = &mut shapes.corners[corner];
            own.tolerance = own.tolerance.max((on - own.point).norm());
            divide_in(shapes, &faces, curve, at, corner);
        }
    }
}

/// Boxes of curves, computed once each.
#[derive(Default)]
struct Boxes(BTreeMap<usize, [Point; 2]>);

impl Boxes {
    fn of(&mut self, shapes: &Shapes, curve: usize, room: f64) -> [Point; 2] {
        let own = self.0.entry(curve).or_insert_with(|| bounds(&polyline(&shapes.curves[curve]), 0.0));
        [own[0].map(|x| x - room), own[1].map(|x| x + room)]
    }
}

/// Curves in the order of the lower ends of their boxes along the first axis.
struct Row {
    /// Lower and upper end, and the place among the curves.
    ends: Vec<([f64; 2], usize)>,
    /// The length of the longest box.
    longest: f64,
    /// The largest tolerance.
    tolerance: f64,
}

impl Row {
    fn new(shapes: &Shapes, boxes: &mut Boxes, curves: &[usize]) -> Self {
        let mut ends: Vec<([f64; 2], usize)> = Vec::with_capacity(curves.len());
        for (place, &curve) in curves.iter().enumerate() {
            let [low, high] = boxes.of(shapes, curve, 0.0);
            ends.push(([low.x, high.x], place));
        }
        ends.sort_by(|a, b| a.0[0].total_cmp(&b.0[0]));
        let longest = ends.iter().map(|([low, high], _)| high - low).fold(0.0, f64::max);
        let tolerance = curves.iter().map(|&curve| shapes.curves[curve].tolerance).fold(0.0, f64::max);
        Self { ends, longest, tolerance }
    }

    /// The places of the curves whose boxes overlap another one along the axis, ascending.
    fn beside(&self, [low, high]: &[Point; 2]) -> Vec<usize> {
        let first = self.ends.partition_point(|(ends, _)| ends[0] + self.longest < low.x);
        let beside = self.ends[first..].iter().take_while(|(ends, _)| ends[0] <= high.x);
        let mut places: Vec<usize> =
            beside.filter(|(ends, _)| ends[1] >= low.x).map(|(_, place)| *place).collect();
        places.sort_unstable();
        places
    }
}

/// Whether two boxes overlap.
pub(in super::super) fn overlap(a: &[Point; 2], b: &[Point; 2]) -> bool {
    (0..3).all(|axis| a[0][axis] <= b[1][axis] && b[0][axis] <= a[1][axis])
}

/// A curve between two parameters, and the largest distance of its middle from the chord.
struct Piece {
    range: [f64; 2],
    ends: [Point; 2],
    sag: f64,
}

fn bounds(pieces: &[Piece], room: f64) -> [Point; 2] {
    let mut out = [pieces[0].ends[0]; 2];
    for piece in pieces {
        let room = room + 2.0 * piece.sag;
        for end in piece.ends {
            out = [out[0].inf(&end.map(|x| x - room)), out[1].sup(&end.map(|x| x + room))];
        }
    }
    out
}

/// Pieces of a curve without large bends.
fn polyline(edge: &EdgeCurve) -> Vec<Piece> {
    /// Pieces of a curve between its breaks.
    const PIECES: usize = 16;
    let at = |t: f64| Point::from(edge.curve.point(t));
    let stops = edge.stops();
    let count = match edge.curve {
        crate::Curve::Line { .. } => 1,
        _ => PIECES.div_ceil(stops.len() - 1).max(4),
    };
    let piece = |w: &[f64], k: usize| {
        let range = [k, k + 1].map(|k| w[0] + (w[1] - w[0]) * k as f64 / count as f64);
        let ends = range.map(at);
        let sag = (at(0.5 * (range[0] + range[1])) - nalgebra::center(&ends[0], &ends[1])).norm();
        Piece { range, ends, sag }
    };
    stops.windows(2).flat_map(|w| (0..count).map(move |k| piece(w, k))).collect()
}

/// The parameters where two curves cross or touch away from their ends, and the points of both.
fn crossings(one: &EdgeCurve, other: &EdgeCurve, room: f64) -> Vec<([f64; 2], [Point; 2])> {
    let [a, b] = [polyline(one), polyline(other)];
    let b: Vec<_> = b.iter().map(|piece| (piece, bounds(std::slice::from_ref(piece), 0.0))).collect();
    let is_at_end = |point: &Point| {
        [one, other].into_iter().any(|edge| {
            edge.range.iter().any(|&t| (Point::from(edge.curve.point(t)) - point).norm() <= AT_END * room)
        })
    };
    let mut found: Vec<([f64; 2], [Point; 2])> = Vec::new();
    for p in &a {
        let own = bounds(std::slice::from_ref(p), room);
        for (q, _) in b.iter().filter(|(_, there)| overlap(&own, there)) {
            let start = [p.range, q.range].map(|[low, high]| 0.5 * (low + high));
            let (at, points) = nearest_pair([one, other], start);
            let middle = nalgebra::center(&points[0], &points[1]);
            // Curves that touch are within the tolerance along a stretch.
            let joins = |known: f64| {
                let between = Point::from(one.curve.point(0.5 * (known + at[0])));
                (nearest_on_curve(&other.curve, &between).point - between).norm() <= room
            };
            let is_new = found.iter().all(|(known, [a, b])| {
                (nalgebra::center(a, b) - middle).norm() > AT_END * room && !joins(known[0])
            });
            if (points[1] - points[0]).norm() <= room && !is_at_end(&middle) && is_new {
                found.push((at, points));
            }
        }
    }
    found
}

/// The parameters at which two curves are nearest to each other, near given ones, and the points.
/// Gauss-Newton steps within the ranges of both edges.
fn nearest_pair(edges: [&EdgeCurve; 2], mut at: [f64; 2]) -> ([f64; 2], [Point; 2]) {
    const STEPS: usize = 60;
    /// Added to the matrix, as a fraction of its diagonal: parallel tangents make it singular.
    const DAMPING: f64 = 1e-15;
    for _ in 0..STEPS {
        let jets = [0, 1].map(|k| edges[k].curve.jet(at[k]));
        let way = jets[1][0] - jets[0][0];
        let [p, q] = [jets[0][1], jets[1][1]];
        let (pp, qq, pq) =
            (p.norm_squared() * (1.0 + DAMPING), q.norm_squared() * (1.0 + DAMPING), p.dot(&q));
        let determinant = pp * qq - pq * pq;
        let step = [
            (qq * way.dot(&p) - pq * way.dot(&q)) / determinant,
            (pq * way.dot(&p) - pp * way.dot(&q)) / determinant,
        ];
        let next = [0, 1].map(|k| (at[k] + step[k]).clamp(edges[k].range[0], edges[k].range[1]));
        let has_moved =
            (0..2).any(|k| (next[k] - at[k]).abs() > 1e-15 * (edges[k].range[1] - edges[k].range[0]));
        if !has_moved || next.iter().any(|t| !t.is_finite()) {
            break;
        }
        at = next;
    }
    (at, [0, 1].map(|k| Point::from(edges[k].curve.point(at[k]))))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shapes::tests::{Solids, Y};

    #[test]
    fn corners_at_one_place_of_a_curve_divide_it_once() {
        let mut solids = Solids::default();
        solids.block([0.0; 3], [1.0; 3]);
        let mut shapes = solids.into_shapes();
        let (curve, count) = (0, shapes.curves.len());
        let on = Point::from(shapes.curves[curve].curve.point(0.3));
        let corners =
            [0.0, 1e-3].map(|by| shapes.add_corner(Corner { point: on + Y * by, tolerance: 1e-3 }, 0));
        let places = [(0.3, corners[0]), (0.3, corners[1])];
        apply(&mut shapes, Divisions::from([(curve, places.to_vec())]), 1.0);
        assert_eq!(shapes.curves.len(), count + 1);
        assert!(shapes.curves.iter().all(|edge| edge.range[0] < edge.range[1]));
    }
}
