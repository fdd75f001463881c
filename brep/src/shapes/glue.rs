//! Faces that solids share.
//!
//! STEP files repeat a common face in each of its solids. Corners of different solids at one place
//! are made one, then edges between the same corners along the same curve, and in the end faces
//! with the same edges on the same surface.

use super::Shapes;
use crate::model::{Fin, Model, On, Patch};
use crate::nearest::{nearest_on_curve, nearest_on_surface};
use crate::project::project_to_surface;
use crate::{Curve, EdgeCurve, Point, Surface};
use nalgebra::Vector2;
use std::collections::{BTreeMap, HashMap, HashSet};

/// Corners of different solids at most this far apart are one (fraction of the diagonal) ...
pub(super) const SAME: f64 = 1e-7;
/// ... or at most this many times the accuracy that the file states, ...
const ROOM: f64 = 10.0;
/// ... but not further apart than this (fraction of the shortest edge there), ...
const SHORT: f64 = 0.05;
/// ... and those of closed solids not further than this (fraction of the diagonal): some programs
/// state an accuracy of 0.01 in all files.
pub(super) const OF_SOLIDS: f64 = 1e-5;
/// Corners of loose faces are as far apart as the file is accurate.
pub(super) const OF_LOOSE_FACES: f64 = f64::INFINITY;
/// Edges of one solid between the same corners are one if they are at most this far apart (fraction
/// of the diagonal): the solid touches itself there.
const SAME_IN_SOLID: f64 = 1e-9;

/// Makes one of the corners and curves that solids share; faces use them afterwards.
///
/// They are `most` apart, as a fraction of the diagonal.
pub(super) fn glue_edges(shapes: &mut Shapes, diagonal: f64, most: f64) {
    let to = corners(shapes, diagonal, most);
    for curve in &mut shapes.curves {
        curve.ends = curve.ends.map(|end| to[end]);
    }
    let pairs = pairs(shapes);
    // Curves by their ends.
    let mut between: BTreeMap<[usize; 2], Vec<usize>> = BTreeMap::new();
    let mut as_curve: Vec<(usize, bool)> = Vec::with_capacity(shapes.curves.len());
    for number in 0..shapes.curves.len() {
        let curve = &shapes.curves[number];
        let [a, b] = curve.ends;
        let known = between.entry([a.min(b), a.max(b)]).or_default();
        let tolerance = tolerance(shapes, shapes.body_of_curve[number], diagonal, most);
        let same = known.iter().find_map(|&other| {
            let is_own = shapes.body_of_curve[other] == shapes.body_of_curve[number];
            // Both sides of a narrow face of one solid are not one.
            if is_own && pairs.contains(&[other.min(number), other.max(number)]) {
                return None;
            }
            let room = if is_own { tolerance.min(SAME_IN_SOLID * diagonal) } else { tolerance };
            Some((other, runs_along(curve, &shapes.curves[other], room)?))
        });
        as_curve.push(same.unwrap_or((number, true)));
        if same.is_none() {
            known.push(number);
        }
    }
    for edge in shapes.faces.iter_mut().flat_map(|face| face.loops.iter_mut().flatten()) {
        let (curve, is_along) = as_curve[edge.0];
        *edge = (curve, edge.1 == is_along);
    }
    for inner in shapes.faces.iter_mut().map(|face| &mut face.inner) {
        inner.iter_mut().for_each(|curve| *curve = as_curve[*curve].0);
        inner.sort_unstable();
        inner.dedup();
    }
}

/// The pairs of curves that bound a face alone.
fn pairs(shapes: &Shapes) -> HashSet<[usize; 2]> {
    let loops = shapes.faces.iter().flat_map(|face| &face.loops);
    let pair = |edges: &Vec<(usize, bool)>| match edges[..] {
        [(a, _), (b, _)] => Some([a.min(b), a.max(b)]),
        _ => None,
    };
    loops.filter_map(pair).collect()
}

/// Places of a body this far apart are one, but not further than `most` (fraction of the diagonal).
pub(super) fn tolerance(shapes: &Shapes, body: usize, diagonal: f64, most: f64) -> f64 {
    (ROOM * shapes.accuracy[body]).min(most * diagonal).max(SAME * diagonal)
}

/// For each corner the first one at its place of another solid, or itself.
fn corners(shapes: &Shapes, diagonal: f64, most: f64) -> Vec<usize> {
    let mut shortest = vec![f64::INFINITY; shapes.corners.len()];
    for curve in shapes.curves.iter().filter(|curve| curve.ends[0] != curve.ends[1]) {
        let [a, b] = curve.ends.map(|end| shapes.corners[end].point);
        curve.ends.iter().for_each(|&end| shortest[end] = shortest[end].min((b - a).norm()));
    }
    let reach = |corner: usize| {
        tolerance(shapes, shapes.body_of_corner[corner], diagonal, most).min(SHORT * shortest[corner])
    };
    let size =
        (0..shapes.accuracy.len()).map(|body| tolerance(shapes, body, diagonal, most)).fold(0.0, f64::max);
    let cell = |p: &Point| p.coords.map(|x| (x / size).floor() as i64);
    let mut cells: HashMap<[i64; 3], Vec<usize>> = HashMap::new();
    let mut to: Vec<usize> = Vec::with_capacity(shapes.corners.len());
    for (number, corner) in shapes.corners.iter().enumerate() {
        let own = cell(&corner.point);
        let beside = |at: i64, step: i64| at.saturating_add(step % 3 - 1);
        let around = (0..27).map(|k| [beside(own.x, k), beside(own.y, k / 3), beside(own.z, k / 9)]);
        let distance = |&other: &usize| (shapes.corners[other].point - corner.point).norm();
        let same = around
            .filter_map(|cell| cells.get(&cell))
            .flatten()
            .copied()
            .filter(|&other| shapes.body_of_corner[other] != shapes.body_of_corner[number])
            .filter(|other| distance(other) <= reach(*other).min(reach(number)))
            .min_by(|a, b| distance(a).total_cmp(&distance(b)));
        to.push(same.unwrap_or(number));
        if same.is_none() {
            cells.entry(own.into()).or_default().push(number);
        }
    }
    to
}

/// Whether a curve runs along another one, if both are at the same place.
fn runs_along(one: &EdgeCurve, other: &EdgeCurve, tolerance: f64) -> Option<bool> {
    let [low, high] = one.range;
    let at = |share: f64| Point::from(one.curve.point(low + share * (high - low)));
    let feet = [0.25, 0.5, 0.75].map(|share| (at(share), nearest_on_curve(&other.curve, &at(share))));
    if feet.iter().any(|(point, foot)| (foot.point - point).norm() > tolerance) {
        return None;
    }
    let [from, to] = other.range;
    // The parameters within the range of the other edge.
    let parameters = feet.map(|(_, foot)| match other.curve.period() {
        Some(period) => from + (foot.parameter - from).rem_euclid(period),
        None => foot.parameter,
    });
    if parameters.iter().any(|t| *t > to || *t < from) {
        return None;
    }
    let [a, b, c] = parameters;
    if a < b && b < c {
        Some(true)
    } else if a > b && b > c {
        Some(false)
    } else {
        None
    }
}

/// Makes one patch of two that solids share, and removes what no patch uses any more. Returns the
/// index of each patch afterwards.
pub(super) fn glue_patches(model: &mut Model, tolerance: f64) -> Vec<usize> {
    let mut by_curves: BTreeMap<Vec<usize>, Vec<usize>> = BTreeMap::new();
    let mut kept: Vec<Patch> = Vec::new();
    let mut to = Vec::new();
    for patch in std::mem::take(&mut model.patches) {
        let known = by_curves.entry(bounds(&patch)).or_default();
        let own = patch.bodies.iter().flatten().next().copied();
        let same = known.iter().copied().find(|&other: &usize| {
            let is_free = kept[other].bodies.contains(&None) && !kept[other].bodies.contains(&own);
            is_free
                && is_same_surface(model, &kept[other], &patch, tolerance)
                && !are_on_one_side(model, [&kept[other], &patch])
        });
        match same {
            Some(other) => {
                let free = kept[other].bodies.iter().position(Option::is_none).expect("a free side");
                kept[other].bodies[free] = own;
                to.push(other);
            }
            None => {
                known.push(kept.len());
                to.push(kept.len());
                kept.push(patch);
            }
        }
    }
    model.patches = kept;
    model.drop_unused();
    to
}

/// The curves that bound a patch, in ascending order, without seams, which each program puts
/// elsewhere.
pub(crate) fn bounds(patch: &Patch) -> Vec<usize> {
    let mut all: Vec<usize> = patch.loops.iter().flatten().filter_map(curve_of).collect();
    all.sort_unstable();
    all.chunk_by(|a, b| a == b).filter(|uses| uses.len() == 1).flatten().copied().collect()
}

fn curve_of(fin: &Fin) -> Option<usize> {
    match fin.on {
        On::Curve(curve) => Some(curve),
        On::Corner(_) => None,
    }
}

/// How far beside an edge two surfaces are compared (fraction of its length) ...
const BESIDE: f64 = 0.02;
/// ... but not further than this (fraction of a period).
const AROUND: f64 = 0.05;

/// Whether two patches between the same curves have the same surface there.
pub(crate) fn is_same_surface(model: &Model, one: &Patch, other: &Patch, tolerance: f64) -> bool {
    if one.surface.is_plane() || other.surface.is_plane() {
        return one.surface.is_plane() && other.surface.is_plane();
    }
    // Points of one patch beside the middle of each of its curves must be on the other one.
    one.loops.iter().flatten().filter_map(|fin| Some((fin, curve_of(fin)?))).all(|(fin, curve)| {
        let Some(point) = beside(&model.curves[curve], &one.surface, fin) else { return true };
        let is_near = |foot: &Point| (foot - point).norm() <= 10.0 * tolerance;
        let there: Vec<&Fin> =
            other.loops.iter().flatten().filter(|fin| fin.on == On::Curve(curve)).collect();
        let [fin @ Fin { curve: Some(start), .. }] = there[..] else {
            // A seam.
            return is_near(&nearest_on_surface(&other.surface, &point).point);
        };
        let t = middle(fin.range);
        let foot = project_to_surface(&other.surface, &point, start.point(t).into());
        // The other patch may be on the other side of the curve.
        let way = Vector2::from(foot.parameters) - start.point(t);
        is_near(&foot.point) && way.dot(&inward(start, fin)) > 0.0
    })
}

/// Whether the bodies of two patches with the same surface and edges are on the same side: these
/// overlap.
fn are_on_one_side(model: &Model, patches: [&Patch; 2]) -> bool {
    let Some(curve) = patches[0].loops.iter().flatten().find_map(curve_of) else { return false };
    let edge = &model.curves[curve];
    let place = Point::from(edge.curve.point(middle(edge.range)));
    let [a, b] = patches.map(|patch| {
        let normal = nearest_on_surface(&patch.surface, &place).normal;
        if patch.bodies[0].is_some() { normal } else { -normal }
    });
    a.dot(&b) > 0.0
}

/// A point of a patch beside the middle of a side.
fn beside(edge: &EdgeCurve, surface: &Surface, fin: &Fin) -> Option<Point> {
    let own = fin.curve.as_ref()?;
    let way = inward(own, fin).try_normalize(0.0)?;
    let at = own.point(middle(fin.range));
    let d = surface.jet(at.x, at.y, 1).d;
    let length = edge.curve.jet(middle(edge.range))[1].norm() * (edge.range[1] - edge.range[0]);
    let speed = (d[1][0] * way.x + d[0][1] * way.y).norm().max(f64::MIN_POSITIVE);
    let most = |i: usize| surface.periods()[i].map_or(f64::INFINITY, |period| AROUND * period / way[i].abs());
    let step = (BESIDE * length / speed).min(most(0)).min(most(1));
    Some(surface.point((at + way * step).into()))
}

fn middle(range: [f64; 2]) -> f64 {
    0.5 * (range[0] + range[1])
}

/// The direction to the left of a side at its middle, in the parameters.
fn inward(side: &Curve<2>, fin: &Fin) -> Vector2<f64> {
    let along = side.jet(middle(fin.range))[1];
    Vector2::new(-along.y, along.x) * if fin.is_forward { 1.0 } else { -1.0 }
}
