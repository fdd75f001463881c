//! Moves of vertices on patches and along curves.

use super::collapse::{MOST_TURN, along_curve};
use super::sheet::{Kind, Sheet, shape};
use crate::ground::ordered::over_vertices;
use crate::ground::size::SizeField;
use crate::{Point, Vector};
use csg::PatchId;

/// Fractions of a move that are tried, in order.
const STEPS: [f64; 3] = [1.0, 0.5, 0.2];

/// On curves, equal segment lengths have priority as long as shapes are above this.
const TOLERABLE: f64 = 0.6;

/// Moves all vertices once, in their order; returns the number of moves.
pub(super) fn smooth_all(sheet: &mut Sheet) -> usize {
    let vertices: Vec<u32> = (0..sheet.points.len() as u32).collect();
    let neighbours = |sheet: &Sheet, v: u32, near: &mut Vec<u32>| {
        near.extend(sheet.around[v as usize].iter().flat_map(|&t| sheet.at(t).v));
    };
    let mut moves = 0;
    over_vertices(sheet, &vertices, neighbours, try_move, |sheet, v, trial| {
        moves += usize::from(make(sheet, v, &trial));
    });
    moves
}

/// What the trial of a move found.
enum Trial {
    /// Nothing has changed since the last trial.
    Known,
    /// No place that is better.
    Vain,
    Better(Place),
}

/// A better place of a vertex.
pub(super) struct Place {
    point: Point,
    kind: Kind,
    /// The wanted size there.
    size: f64,
}

/// Moves a vertex if that improves the triangles around it.
pub(super) fn smooth(sheet: &mut Sheet, v: u32) -> bool {
    let trial = try_move(sheet, v);
    make(sheet, v, &trial)
}

/// Moves a vertex as its trial found; whether it moves.
fn make(sheet: &mut Sheet, v: u32, trial: &Trial) -> bool {
    match trial {
        Trial::Known => {}
        Trial::Vain => sheet.changes.move_was_in_vain(v),
        Trial::Better(to) => place(sheet, v, to),
    }
    matches!(trial, Trial::Better(_))
}

/// Moves a vertex.
pub(super) fn place(sheet: &mut Sheet, v: u32, to: &Place) {
    sheet.points[v as usize] = to.point;
    sheet.kinds[v as usize] = to.kind;
    sheet.sizes[v as usize] = to.size;
    sheet.changes.change(v);
}

/// Tries to find a better place of a vertex.
fn try_move(sheet: &Sheet, v: u32) -> Trial {
    let around = &sheet.around[v as usize];
    if around.is_empty() || sheet.changes.is_move_in_vain(v, around.iter().flat_map(|&t| sheet.at(t).v)) {
        return Trial::Known;
    }
    let found = match sheet.kinds[v as usize] {
        Kind::Corner(_) => None,
        Kind::Curve(curve, place) => slide(sheet, v, curve.0, place),
        Kind::Patch(_) if is_good(sheet, v) => None,
        Kind::Patch(patch) => {
            let wanted = ideal_place(sheet, v, patch);
            let from = sheet.points[v as usize];
            better_place(sheet, v, patch, STEPS.map(|part| from + (wanted - from) * part))
        }
    };
    found.map_or(Trial::Vain, Trial::Better)
}

/// Vertices whose triangles all have a better shape are not moved.
const GOOD: f64 = 0.93;

/// Least relative decrease of the energy by a move.
const GAIN: f64 = 5e-3;

fn is_good(sheet: &Sheet, v: u32) -> bool {
    sheet.around[v as usize].iter().all(|&t| shape(&sheet.corners(sheet.at(t).v)) > GOOD)
}

/// The first of some points, projected onto the patch of a vertex, where the energy around the
/// vertex is lower.
pub(super) fn better_place<const N: usize>(
    sheet: &Sheet,
    v: u32,
    patch: PatchId,
    trials: [Point; N],
) -> Option<Place> {
    let projector = &sheet.model.projector;
    let is_flat = projector.flat_normal(patch).is_some();
    let most = (1.0 - GAIN) * energy(sheet, v, &sheet.points[v as usize]);
    let mut trials = trials.into_iter().map(|p| if is_flat { p } else { projector.project_patch(patch, &p) });
    let point = trials.find(|p| energy(sheet, v, p) < most && around_fits(sheet, v, p))?;
    Some(Place { point, kind: Kind::Patch(patch), size: sheet.size.size_at(&point) })
}

/// The place of a vertex on its curve where its two segments have equal lengths in units of the
/// size, or nearer to that.
fn slide(sheet: &Sheet, v: u32, curve: u32, place: f64) -> Option<Place> {
    let ends = along_curve(sheet, v, curve);
    let &[p, q] = &ends[..] else { return None };
    let polyline = &sheet.polylines[curve as usize];
    let [to_p, to_q] = [p, q].map(|w| polyline.way(place, sheet.place_on(w, curve)));
    if to_p * to_q >= 0.0 {
        return None;
    }
    let metric = |w: u32, way: f64| 2.0 * way.abs() / (sheet.sizes[w as usize] + sheet.sizes[v as usize]);
    let (lp, lq) = (metric(p, to_p), metric(q, to_q));
    // Towards the longer segment, by half the difference.
    let share = 0.5 * (lq - lp) / (lp + lq);
    // A smaller shift is not worth the projections.
    if share.abs() < 1e-3 {
        return None;
    }
    let shift = if share > 0.0 { share * to_q } else { -share * to_p };
    let new = polyline.wrapped(place + shift);
    let (before, after) = (place + to_p, place + to_q);
    let at = place + shift;
    if polyline.turn(before, at - before).max(polyline.turn(at, after - at)) > MOST_TURN {
        return None;
    }
    let to = polyline.at(new);
    let least = |at: &Point| {
        let values = sheet.around[v as usize]
            .iter()
            .map(|&t| sheet.value_of(&sheet.corners_with(t, v, at), sheet.at(t).curve));
        values.fold(1.0, f64::min)
    };
    let worst = least(&sheet.points[v as usize]).min(TOLERABLE);
    let is_better = least(&to) >= worst && around_fits(sheet, v, &to);
    let kind = Kind::Curve(csg::CurveId(curve), new);
    is_better.then(|| Place { point: to, kind, size: sheet.size.size_at(&to) })
}

/// The sum of 1/shape² around a vertex at a place, dominated by the worst triangles. Shapes below
/// 10⁻⁶ count as that, so that sums with several of them can still be compared.
fn energy(sheet: &Sheet, v: u32, at: &Point) -> f64 {
    let price = |&t: &u32| 1.0 / shape(&sheet.corners_with(t, v, at)).max(1e-6).powi(2);
    sheet.around[v as usize].iter().map(price).sum()
}

/// Whether the triangles around a vertex follow their patches if it is at a place.
fn around_fits(sheet: &Sheet, v: u32, at: &Point) -> bool {
    let fits = |&t: &u32| {
        let triangle = sheet.at(t);
        sheet.fits(triangle.patch, &sheet.corners_with(t, v, at), sheet.mean_size(triangle.v))
    };
    sheet.around[v as usize].iter().all(fits)
}

/// The mean of the positions that make each triangle around the vertex isosceles, with sides of the
/// wanted size as far as the opposite edge allows.
fn ideal_place(sheet: &Sheet, v: u32, patch: PatchId) -> Point {
    let here = sheet.points[v as usize];
    let projector = &sheet.model.projector;
    let normal = projector.flat_normal(patch).unwrap_or_else(|| projector.foot(patch, &here).normal);
    let mut sum = Vector::zeros();
    let around = &sheet.around[v as usize];
    for &t in around {
        let triangle = sheet.at(t);
        let k = triangle.corner(v).unwrap_or(0);
        let (a, b) = (triangle.v[(k + 1) % 3], triangle.v[(k + 2) % 3]);
        let (p, q) = (sheet.points[a as usize], sheet.points[b as usize]);
        let along = q - p;
        let length = along.norm();
        let wanted =
            0.25 * (sheet.sizes[a as usize] + sheet.sizes[b as usize]) + 0.5 * sheet.sizes[v as usize];
        let side = wanted.clamp(0.7 * length, 1.4 * length);
        let height = (side * side - 0.25 * length * length).max(0.0).sqrt();
        let inward = normal.cross(&along).try_normalize(0.0).unwrap_or_else(Vector::zeros);
        sum += nalgebra::center(&p, &q) - here + inward * height;
    }
    here + sum / around.len() as f64
}
