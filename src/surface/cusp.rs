//! Curves that leave a corner in one direction.
//!
//! ```text
//!              ___----o------o
//!        __o---
//!   o====--o----------o------o      both have vertices at the same distances from the corner, so their chords
//!                                   leave it in the order of the curves, and stay in it
//! ```
//! Between a line and a circle, or two circles that touch from inside, there is less room than a chord strays from its curve, however short
//! the chords: cut independently, they may cross. Cut alike, they are apart by about as much as the curves are.

use super::SurfaceMesh;
use crate::Point;
use crate::mesh::{Segment, VertexId};
use csg::project::at_distance;
use csg::{CornerId, CurveId, Features, Projector};
use std::collections::BTreeMap;

/// At the first vertex of one of them two curves of a cusp are seen from the corner under less than this angle (radians). A line and a
/// circle cut as `very-coarse` asks for: 0.28.
const NARROW: f64 = 0.3;
/// Half as far away they are seen under less than this part of that angle: a half in a cusp, all of it between curves that leave at an angle.
const FALLING: f64 = 0.75;
/// Curves farther apart than this part of their segments are far enough for their chords, whatever they are.
const APART: f64 = 0.7;
/// Steps lead away from the corner by at least this part of their length: from the far side of a circle distances tell little.
const OUTWARD: f64 = 0.5;
/// A segment between the last vertex of the cusp and the next one is at least this part of the one before it.
const SHORTEST: f64 = 0.5;
/// Vertices this near to the same distance from a corner (a part of it) were put there together.
const SAME: f64 = 1e-6;

/// An end of a curve at a corner.
#[derive(Clone, Copy)]
struct End {
    curve: usize,
    /// Whether the curve ends there, and does not begin.
    reversed: bool,
}

/// Moves the vertices inside curves that leave a corner in one direction to the same distances from it; `inner` are those of each
/// curve, from its start to its end, and `is_free` tells whether a curve may be changed.
pub(super) fn align(
    features: &Features,
    projector: &Projector,
    is_free: &dyn Fn(usize) -> bool,
    inner: &mut [Vec<Point>],
) {
    let mut at_corner: BTreeMap<CornerId, Vec<End>> = BTreeMap::new();
    for (curve, of) in features.curves.iter().enumerate().filter(|(i, _)| is_free(*i)) {
        for (corner, reversed) in of.ends.into_iter().flatten().zip([false, true]) {
            at_corner.entry(corner).or_default().push(End { curve, reversed });
        }
    }
    for (corner, mut ends) in at_corner {
        let at = features.corner(corner).point;
        let first = |end: &End| (stations(features, inner, *end)[0] - at).norm();
        ends.sort_by(|x, y| first(x).total_cmp(&first(y)).then(x.curve.cmp(&y.curve)));
        for (i, &master) in ends.iter().enumerate() {
            for &slave in &ends[i + 1..] {
                follow(features, projector, at, [master, slave], inner);
            }
        }
    }
}

/// The vertices of a curve after one of its ends, with the other end.
fn stations(features: &Features, inner: &[Vec<Point>], end: End) -> Vec<Point> {
    let trace = &features.curves[end.curve].trace;
    let inner = inner[end.curve].iter().copied();
    if end.reversed {
        inner.rev().chain([trace[0]]).collect()
    } else {
        inner.chain([trace[trace.len() - 1]]).collect()
    }
}

/// Puts vertices on the second of two curves as far from their common corner as those of the first are, as long as the two are near each other.
fn follow(
    features: &Features,
    projector: &Projector,
    corner: Point,
    [master, slave]: [End; 2],
    inner: &mut [Vec<Point>],
) {
    let [of_master, of_slave] = [master, slave].map(|end| {
        let curve = &features.curves[end.curve];
        if end.reversed { curve.trace.iter().rev().copied().collect() } else { curve.trace.clone() }
    });
    let point_of = |end: End, trace: &[Point], distance: f64| {
        at_distance(trace, distance, |p| projector.project_curve(CurveId::new(end.curve), p))
    };
    let on_slave = |distance: f64| point_of(slave, &of_slave, distance);
    let on_master = |distance: f64| point_of(master, &of_master, distance);
    let leaders = stations(features, inner, master);
    let own = stations(features, inner, slave);
    let (mut placed, mut reached, mut travelled, mut step) = (Vec::new(), 0.0, 0.0, 0.0);
    for leader in &leaders {
        let distance = (leader - corner).norm();
        let Some(point) = on_slave(distance).filter(|_| distance > reached) else { break };
        let gap = (point - leader).norm();
        let is_cusp = || {
            let halfway = on_master(0.5 * distance).zip(on_slave(0.5 * distance));
            let halfway = halfway.map(|(p, q)| (p - q).norm());
            gap < NARROW * distance && halfway.is_some_and(|halfway| 2.0 * halfway < FALLING * gap)
        };
        let is_end = own.last().is_some_and(|end| (end - point).norm() <= SAME * distance);
        let before = *placed.last().unwrap_or(&corner);
        let is_outward = distance - reached > OUTWARD * (point - before).norm();
        let is_apart = gap >= APART * (distance - reached);
        if is_end || is_apart || !is_outward || (placed.is_empty() && !is_cusp()) {
            break;
        }
        step = (point - before).norm();
        placed.push(point);
        (travelled, reached) = (travelled + step, distance);
    }
    if placed.is_empty() {
        return;
    }
    let mut before = corner;
    let mut along = 0.0;
    let is_beyond = |p: &Point| {
        along += (p - before).norm();
        before = *p;
        along > travelled + SHORTEST * step
    };
    let beyond = own[..own.len() - 1].iter().position(is_beyond).unwrap_or(own.len() - 1);
    placed.extend(&own[beyond..own.len() - 1]);
    if slave.reversed {
        placed.reverse();
    }
    inner[slave.curve] = placed;
}

/// Whether two segments are of curves that leave a corner in one direction, and where they are cut alike.
pub(super) fn are_aligned(mesh: &SurfaceMesh, features: &Features, pair: [&Segment; 2]) -> bool {
    let ends = pair.map(|s| features.curve(s.curve).ends.into_iter().flatten().collect::<Vec<CornerId>>());
    let common = ends[0].iter().filter(|corner| ends[1].contains(corner));
    let place = |v: VertexId| mesh.points[v.index()];
    common.into_iter().any(|&corner| {
        let corner = features.corner(corner).point;
        let away = |v: VertexId| (place(v) - corner).norm();
        let has_at = |curve: CurveId, distance: f64| {
            let mut vertices = mesh.segments_of(curve).flat_map(|s| s.vertices);
            vertices.any(|v| (away(v) - distance).abs() <= SAME * distance)
        };
        let [s, t] = pair.map(|s| s.vertices.map(away).into_iter().fold(0.0, f64::max));
        pair[0].curve != pair[1].curve && has_at(pair[1].curve, s) && has_at(pair[0].curve, t)
    })
}
