//! Repair after the rounds: triangles too far from their facets, bad triangles, and triangles that
//! would flatten in refinement.

use super::report::{RemeshReport, least_angle};
use super::sheet::{Kind, NONE, Sheet};
use super::{collapse, flip, smooth, split};
use crate::Vector;

/// Triangles with angles below this (degrees) are repaired.
const WANTED_ANGLE: f64 = 30.0;

/// Rounds over the bad triangles.
const ROUNDS: usize = 6;

/// Repairs triangles that do not follow their facets, then those with small angles, then those with
/// two sides on one smooth curve.
pub(super) fn repair(sheet: &mut Sheet, report: &mut RemeshReport) {
    for _ in 0..ROUNDS {
        let off: Vec<(u32, [u32; 3])> = sheet.misfits().into_iter().map(|t| (t, sheet.at(t).v)).collect();
        let splits = off.iter().filter(|(t, v)| sheet.at(*t).v == *v && split_misfit(sheet, *t)).count();
        if splits == 0 {
            break;
        }
        report.splits += splits;
        report.flips += flip::flip_all(sheet);
    }
    for _ in 0..ROUNDS {
        let bad: Vec<(u32, [u32; 3])> = sheet
            .living()
            .filter(|&t| {
                least_angle(&sheet.corners(sheet.at(t).v)) < WANTED_ANGLE || sheet.flattens(sheet.at(t).curve)
            })
            .map(|t| (t, sheet.at(t).v))
            .collect();
        for (t, v) in bad {
            if sheet.at(t).v == v {
                repair_triangle(sheet, t, report);
            }
        }
        report.flips += flip::flip_all(sheet);
    }
    for _ in 0..ROUNDS {
        let flat: Vec<u32> = sheet.living().filter(|&t| sheet.flattens(sheet.at(t).curve)).collect();
        for t in flat {
            if sheet.at(t).lives() && sheet.flattens(sheet.at(t).curve) {
                open_flattening(sheet, t, report);
            }
        }
    }
}

/// Largest edge length after the repair of a bad triangle, in units of the wanted size.
const LONG: f64 = 1.7;
/// Least shape of the triangles at the midpoint of a split side, relative to the worst before, if a
/// triangle is too far from its facets.
const WORSE: f64 = 0.4;
/// Largest length of a side of a bad triangle that is collapsed, in units of the wanted size.
const COLLAPSIBLE: f64 = 1.1;

/// Improves a bad triangle: moves its vertices and their neighbours, collapses a side, the shortest
/// first, or splits its longest side.
fn repair_triangle(sheet: &mut Sheet, t: u32, report: &mut RemeshReport) {
    let v = sheet.at(t).v;
    let mut near = Vec::new();
    for w in v {
        sheet.neighbours(w, &mut near);
        near.iter().for_each(|&n| report.moves += usize::from(smooth::smooth(sheet, n)));
        report.moves += usize::from(smooth::smooth(sheet, w)) + usize::from(probe(sheet, w));
    }
    if least_angle(&sheet.corners(v)) >= WANTED_ANGLE {
        return;
    }
    let p = sheet.corners(v);
    let length = |k: usize| (p[(k + 2) % 3] - p[(k + 1) % 3]).norm();
    let mut sides = [0, 1, 2];
    sides.sort_by(|&i, &j| length(i).total_cmp(&length(j)));
    let ends = |k: usize| (v[(k + 1) % 3], v[(k + 2) % 3]);
    for (a, b) in sides.map(ends) {
        if sheet.length(a, b) < COLLAPSIBLE && collapse::collapse_either(sheet, a, b, LONG) {
            report.collapses += 1;
            return;
        }
    }
    let (a, b) = ends(sides[2]);
    if sheet.length(a, b) > 1.0 && sheet.at(t).curve[sides[2]] == NONE {
        report.splits += usize::from(split_if(sheet, a, b, |before, after| after > before));
    }
}

/// Moves a vertex on a patch slightly in one of four directions, if that is an improvement.
fn probe(sheet: &mut Sheet, v: u32) -> bool {
    let Kind::Patch(patch) = sheet.kinds[v as usize] else { return false };
    if sheet.around[v as usize].is_empty() {
        return false;
    }
    let here = sheet.points[v as usize];
    let normal = sheet.model.projector.normal(patch, &here);
    let across = Vector::ith(normal.iamin(), 1.0).cross(&normal).normalize();
    let up = normal.cross(&across);
    let step = 0.1 * sheet.sizes[v as usize];
    let trials = [across, up, -across, -up].map(|direction| here + direction * step);
    let found = smooth::better_place(sheet, v, patch, trials);
    found.inspect(|place| smooth::place(sheet, v, place)).is_some()
}

/// Splits the longest side of a triangle that is too far from its facets, unless it is on a curve;
/// whether it was split.
fn split_misfit(sheet: &mut Sheet, t: u32) -> bool {
    let triangle = *sheet.at(t);
    let p = sheet.corners(triangle.v);
    let length = |k: usize| (p[(k + 2) % 3] - p[(k + 1) % 3]).norm();
    let k = (0..3).fold(0, |best, k| if length(k) > length(best) { k } else { best });
    let (a, b) = (triangle.v[(k + 1) % 3], triangle.v[(k + 2) % 3]);
    triangle.curve[k] == NONE && split_if(sheet, a, b, |before, after| after > WORSE * before)
}

/// Splits an edge inside a patch if the new triangles follow their facets and `passes` accepts the
/// worst shapes before and after.
fn split_if(sheet: &mut Sheet, a: u32, b: u32, passes: impl Fn(f64, f64) -> bool) -> bool {
    let Some(pair) = sheet.pair(a, b) else { return false };
    let before = pair.iter().map(|&t| sheet.value_at(t)).fold(1.0, f64::min);
    let middle = split::middle(sheet, a, b);
    let mut after = 1.0_f64;
    for t in pair {
        let triangle = *sheet.at(t);
        for end in [a, b] {
            let Some(k) = triangle.corner(end) else { return false };
            let mut p = sheet.corners(triangle.v);
            p[k] = middle.point;
            after = after.min(super::sheet::shape(&p));
            if !sheet.fits(triangle.patch, &p, sheet.mean_size(triangle.v)) {
                return false;
            }
        }
    }
    if !passes(before, after) {
        return false;
    }
    let v = split::split(sheet, a, b, &middle);
    smooth::smooth(sheet, v);
    true
}

/// Flips or splits the third side of a triangle with two sides on one smooth curve.
fn open_flattening(sheet: &mut Sheet, t: u32, report: &mut RemeshReport) {
    let triangle = *sheet.at(t);
    let Some(k) = (0..3).find(|&k| {
        let [i, j] = [(k + 1) % 3, (k + 2) % 3].map(|i| triangle.curve[i]);
        i != NONE && i == j
    }) else {
        return;
    };
    let (a, b) = (triangle.v[(k + 1) % 3], triangle.v[(k + 2) % 3]);
    if flip::flip(sheet, a, b).is_some() {
        report.flips += 1;
        return;
    }
    if triangle.curve[k] == NONE && sheet.pair(a, b).is_some() {
        let middle = split::middle(sheet, a, b);
        let v = split::split(sheet, a, b, &middle);
        smooth::smooth(sheet, v);
        report.splits += 1;
    }
}
