//! Curves that leave a corner in the same direction (cusps).
//!
//! ```text
//!              ___----o------o
//!        __o---
//!   o====--o----------o------o      Both have vertices at the same distances from the corner, so their
//!                                   chords leave it in the order of the curves and keep that order.
//! ```
//! Between a line and a circle, or two internally tangent circles, there is less space than the
//! sagitta of a chord, however short the chords are. Chords of curves divided independently may
//! therefore cross. If they are divided alike, the chords are about as far apart as the curves.

use super::SurfaceMesh;
use crate::Point;
use crate::ground::mesh::{Segment, VertexId};
use csg::project::at_distance;
use csg::{CornerId, CurveId, Features, Projector};
use std::collections::BTreeMap;

/// Two curves form a cusp if they are seen from the corner under less than this angle (radians) at
/// the first vertex. A line and a circle at the size `very-coarse`: 0.28.
const NARROW: f64 = 0.3;
/// At half the distance a cusp is seen under less than this fraction of that angle: half in a cusp,
/// but the same angle for curves with different directions.
const FALLING: f64 = 0.75;
/// Curves farther apart than this fraction of their segments need no alignment.
const APART: f64 = 0.7;
/// Each step must increase the distance from the corner by at least this fraction of its length: on
/// the far side of a circle distances are ambiguous.
const OUTWARD: f64 = 0.5;
/// The segment after the last aligned vertex has at least this fraction of the length of the one
/// before it.
const SHORTEST: f64 = 0.5;
/// Vertices whose distances from a corner differ by less than this fraction were aligned.
const SAME: f64 = 1e-6;

/// An end of a curve at a corner.
#[derive(Clone, Copy)]
struct End {
    curve: usize,
    /// Whether the curve ends at the corner instead of starting there.
    reversed: bool,
}

/// Moves interior vertices of curves that form a cusp to equal distances from the corner.
///
/// `inner` are the interior vertices of each curve from start to end; `is_free` tells whether a
/// curve may be changed.
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

/// The vertices of a curve after one of its ends, including the other end.
fn stations(features: &Features, inner: &[Vec<Point>], end: End) -> Vec<Point> {
    let trace = &features.curves[end.curve].trace;
    let inner = inner[end.curve].iter().copied();
    if end.reversed {
        inner.rev().chain([trace[0]]).collect()
    } else {
        inner.chain([trace[trace.len() - 1]]).collect()
    }
}

/// Places vertices on the slave curve at the same distances from the corner as those of the master,
/// as long as the curves are close.
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

/// Whether two segments belong to a cusp and its curves are aligned there.
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
