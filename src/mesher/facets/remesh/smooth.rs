//! Moves of vertices on patches and along curves.

use super::collapse::{MOST_TURN, along_curve};
use super::sheet::{Kind, Sheet, shape};
use crate::ground::size::SizeField;
use crate::{Point, Vector};
use csg::PatchId;

/// Fractions of a move that are tried, in order.
const STEPS: [f64; 3] = [1.0, 0.5, 0.2];

/// On curves, equal segment lengths have priority as long as shapes are above this.
const TOLERABLE: f64 = 0.6;

/// Moves all vertices once; returns the number of moves.
pub(super) fn smooth_all(sheet: &mut Sheet) -> usize {
    (0..sheet.points.len() as u32).filter(|&v| smooth(sheet, v)).count()
}

/// Moves a vertex if that improves the triangles around it.
pub(super) fn smooth(sheet: &mut Sheet, v: u32) -> bool {
    if sheet.around[v as usize].is_empty() {
        return false;
    }
    let vertices = sheet.around[v as usize].iter().flat_map(|&t| sheet.at(t).v);
    if sheet.changes.is_move_in_vain(v, vertices) {
        return false;
    }
    let has_moved = match sheet.kinds[v as usize] {
        Kind::Corner(_) => false,
        Kind::Curve(curve, place) => slide(sheet, v, curve.0, place),
        Kind::Patch(_) if is_good(sheet, v) => false,
        Kind::Patch(patch) => {
            let wanted = ideal_place(sheet, v, patch);
            let from = sheet.points[v as usize];
            STEPS.iter().any(|&part| try_place(sheet, v, patch, from + (wanted - from) * part))
        }
    };
    if !has_moved {
        sheet.changes.move_was_in_vain(v);
    }
    has_moved
}

/// Vertices whose triangles all have a better shape are not moved.
const GOOD: f64 = 0.93;

/// Least relative decrease of the energy by a move.
const GAIN: f64 = 5e-3;

fn is_good(sheet: &Sheet, v: u32) -> bool {
    sheet.around[v as usize].iter().all(|&t| shape(&sheet.corners(sheet.at(t).v)) > GOOD)
}

/// Moves a vertex on a patch to the projection of a point if that lowers the energy around it.
pub(super) fn try_place(sheet: &mut Sheet, v: u32, patch: PatchId, to: Point) -> bool {
    let projector = &sheet.model.projector;
    let to = if projector.flat_normal(patch).is_some() { to } else { projector.project_patch(patch, &to) };
    let before = energy(sheet, v);
    let from = std::mem::replace(&mut sheet.points[v as usize], to);
    if energy(sheet, v) < (1.0 - GAIN) * before && around_fits(sheet, v) {
        sheet.sizes[v as usize] = sheet.size.size_at(&to);
        sheet.changes.change(v);
        return true;
    }
    sheet.points[v as usize] = from;
    false
}

/// Moves a vertex along its curve so that its two segments have equal lengths in units of the size.
fn slide(sheet: &mut Sheet, v: u32, curve: u32, place: f64) -> bool {
    let ends = along_curve(sheet, v, curve);
    let &[p, q] = &ends[..] else { return false };
    let polyline = &sheet.polylines[curve as usize];
    let [to_p, to_q] = [p, q].map(|w| polyline.way(place, sheet.place_on(w, curve)));
    if to_p * to_q >= 0.0 {
        return false;
    }
    let metric = |w: u32, way: f64| 2.0 * way.abs() / (sheet.sizes[w as usize] + sheet.sizes[v as usize]);
    let (lp, lq) = (metric(p, to_p), metric(q, to_q));
    // Towards the longer segment, by half the difference.
    let share = 0.5 * (lq - lp) / (lp + lq);
    // A smaller shift is not worth the projections.
    if share.abs() < 1e-3 {
        return false;
    }
    let shift = if share > 0.0 { share * to_q } else { -share * to_p };
    let new = polyline.wrapped(place + shift);
    let (before, after) = (place + to_p, place + to_q);
    let at = place + shift;
    if polyline.turn(before, at - before).max(polyline.turn(at, after - at)) > MOST_TURN {
        return false;
    }
    let to = polyline.at(new);
    let least =
        |sheet: &Sheet| sheet.around[v as usize].iter().map(|&t| sheet.value_at(t)).fold(1.0, f64::min);
    let worst = least(sheet).min(TOLERABLE);
    let from = std::mem::replace(&mut sheet.points[v as usize], to);
    if least(sheet) >= worst && around_fits(sheet, v) {
        sheet.kinds[v as usize] = Kind::Curve(csg::CurveId(curve), new);
        sheet.sizes[v as usize] = sheet.size.size_at(&to);
        sheet.changes.change(v);
        return true;
    }
    sheet.points[v as usize] = from;
    false
}

/// The sum of 1/shape² around a vertex, dominated by the worst triangles. Shapes below 10⁻⁶ count
/// as that, so that sums with several of them can still be compared.
pub(super) fn energy(sheet: &Sheet, v: u32) -> f64 {
    let price = |&t: &u32| 1.0 / shape(&sheet.corners(sheet.at(t).v)).max(1e-6).powi(2);
    sheet.around[v as usize].iter().map(price).sum()
}

pub(super) fn around_fits(sheet: &Sheet, v: u32) -> bool {
    sheet.around[v as usize].iter().all(|&t| sheet.fits_at(t))
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
