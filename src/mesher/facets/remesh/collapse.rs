//! Collapse of short edges: one end is merged into the other.

use super::polyline::Polyline;
use super::sheet::{Kind, NONE, Sheet, now, shape};
use crate::ground::ordered::in_order;
use rayon::prelude::*;

/// Largest turning angle of a curve along a segment (radians): a circle keeps at least six
/// segments.
pub(super) const MOST_TURN: f64 = std::f64::consts::FRAC_PI_3 * 1.001;

/// Largest edge length after a collapse, in units of the wanted size, unless the edge was longer
/// before.
const LONG: f64 = 1.4;

/// Least shape after a collapse, unless the triangles were worse before: that of an isosceles
/// triangle with an angle of 13°.
const POOR: f64 = 0.35;

/// Collapses edges shorter than `short`, in units of the wanted size, the shortest first; returns
/// their number.
pub(super) fn collapse_short(sheet: &mut Sheet, short: f64) -> usize {
    let mut collapsed = 0;
    loop {
        let edges = shorter(sheet, short);
        let before = collapsed;
        let began = sheet.changes.now();
        let decide = |sheet: &Sheet, [a, b]: [u32; 2]| {
            let both_live = !sheet.around[a as usize].is_empty() && !sheet.around[b as usize].is_empty();
            let is_tried = both_live && sheet.length(a, b) < short && !is_in_vain(sheet, a, b);
            if is_tried { possible(sheet, a, b, LONG) } else { None }
        };
        // All triangles that matter have one of the ends.
        let holds = |sheet: &Sheet, began, ends: [u32; 2], _: &_| !sheet.changes.is_since(began, &ends);
        in_order(sheet, &edges, now, decide, holds, |sheet, _, found| {
            if let Some([from, to]) = found {
                collapse(sheet, from, to);
                collapsed += 1;
            }
        });
        sheet.changes.all_collapses_since(began);
        if collapsed == before {
            return collapsed;
        }
    }
}

/// The edges shorter than `short`, the shortest first.
fn shorter(sheet: &Sheet, short: f64) -> Vec<[u32; 2]> {
    let mut edges: Vec<(f64, u32, u32)> = sheet.gather(|t, found| {
        for [a, b] in [[t.v[0], t.v[1]], [t.v[1], t.v[2]], [t.v[2], t.v[0]]] {
            let length = sheet.length(a, b);
            if length < short {
                found.push((length, a.min(b), a.max(b)));
            }
        }
    });
    edges.par_sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then((a.1, a.2).cmp(&(b.1, b.2))));
    edges.dedup();
    edges.into_iter().map(|(_, a, b)| [a, b]).collect()
}

/// Whether nothing has changed around an edge since its collapse was tried.
fn is_in_vain(sheet: &Sheet, a: u32, b: u32) -> bool {
    let around = [a, b].into_iter().flat_map(|end| &sheet.around[end as usize]);
    sheet.changes.is_collapse_in_vain(around.flat_map(|&t| sheet.at(t).v))
}

/// Merges one end of an edge into the other, if that is possible.
pub(super) fn collapse_either(sheet: &mut Sheet, a: u32, b: u32, long: f64) -> bool {
    let found = possible(sheet, a, b, long);
    if let Some([from, to]) = found {
        collapse(sheet, from, to);
    }
    found.is_some()
}

/// Which end of an edge can be merged into which; the end classified on the lower dimension stays.
fn possible(sheet: &Sheet, a: u32, b: u32, long: f64) -> Option<[u32; 2]> {
    [[a, b], [b, a]].into_iter().find(|&[from, to]| may_collapse(sheet, from, to, long))
}

/// Whether `from` can be merged into `to`.
fn may_collapse(sheet: &Sheet, from: u32, to: u32, long: f64) -> bool {
    let Some(first) = sheet.at_edge(from, to).next() else { return false };
    let triangle = sheet.at(first);
    let mark = triangle.side(from, to).map_or(NONE, |side| triangle.curve[side]);
    match sheet.kinds[from as usize] {
        Kind::Corner(_) => return false,
        Kind::Curve(curve, _) if mark != curve.0 => return false,
        Kind::Curve(..) if !may_shorten(sheet, from, to, mark) => return false,
        _ => {}
    }
    keeps_topology(sheet, from, to) && keeps_shape(sheet, from, to, long)
}

/// Whether a curve stays valid if its vertex `from` is merged into its neighbour `to`.
fn may_shorten(sheet: &Sheet, from: u32, to: u32, curve: u32) -> bool {
    let polyline: &Polyline = &sheet.polylines[curve as usize];
    let here = sheet.place_on(from, curve);
    let next = here + polyline.way(here, sheet.place_on(to, curve));
    let Some(other) = along_curve(sheet, from, curve).into_iter().find(|&w| w != to) else {
        return false;
    };
    let before = here + polyline.way(here, sheet.place_on(other, curve));
    // If both neighbours are on one side, the loop has only two segments and would vanish.
    if (next - here) * (before - here) >= 0.0 {
        return false;
    }
    polyline.turn(before, next - before) <= MOST_TURN
        && (!polyline.is_loop() || (next - before).abs() < 0.4 * polyline.length())
}

/// The neighbours of a vertex along a curve, ascending.
pub(super) fn along_curve(sheet: &Sheet, v: u32, curve: u32) -> Vec<u32> {
    let mut found = Vec::new();
    for &t in &sheet.around[v as usize] {
        let triangle = sheet.at(t);
        for side in 0..3 {
            let w = triangle.v[side];
            if triangle.curve[side] == curve && w != v {
                let other = triangle.v.into_iter().find(|&x| x != v && x != w);
                found.extend(other);
            }
        }
    }
    found.sort_unstable();
    found.dedup();
    found
}

/// Whether the triangles stay a surface (the link condition: Dey, Edelsbrunner, Guha, Nekhayev
/// 1999) and curves stay distinct.
fn keeps_topology(sheet: &Sheet, from: u32, to: u32) -> bool {
    let (mut near, mut far) = (Vec::new(), Vec::new());
    sheet.neighbours(from, &mut near);
    sheet.neighbours(to, &mut far);
    let common = near.iter().filter(|v| far.binary_search(v).is_ok()).count();
    let mut apexes = Vec::new();
    for t in sheet.at_edge(from, to) {
        let triangle = sheet.at(t);
        let (i, j) = (triangle.corner(from), triangle.corner(to));
        let (Some(i), Some(j)) = (i, j) else { return false };
        // The side at `from` is merged into that at `to`, so a curve on it moves there. It may do
        // so if it goes on along the collapsed edge: the triangle is an ear of its patch. Only thin
        // ones are cut off, which no flip improves.
        let is_ear = || {
            triangle.curve[i] == NONE
                && triangle.curve[j] == triangle.curve[3 - i - j]
                && shape(&sheet.corners(triangle.v)) < POOR
        };
        if triangle.curve[j] != NONE && !is_ear() {
            return false;
        }
        apexes.push(triangle.v[3 - i - j]);
    }
    apexes.sort_unstable();
    let different = apexes.len();
    apexes.dedup();
    // The changed triangles must not exist already, as they do if a closed component has four
    // triangles left.
    let is_new = |&t: &u32| {
        let v = sheet.at(t).v;
        v.contains(&to)
            || !sheet.around[to as usize]
                .iter()
                .any(|&s| sheet.at(s).v.iter().all(|w| *w == to || (*w != from && v.contains(w))))
    };
    let is_taken = |&v: &u32| far.binary_search(&v).is_err() && sheet.constraints.is_taken(to, v);
    if near.iter().any(is_taken) {
        return false;
    }
    common == different && apexes.len() == different && sheet.around[from as usize].iter().all(is_new)
}

/// Whether the triangles around `from` stay valid if it moves to `to`.
fn keeps_shape(sheet: &Sheet, from: u32, to: u32, long: f64) -> bool {
    let mut worst = 1.0_f64;
    let mut before = 1.0_f64;
    for &t in &sheet.around[from as usize] {
        let triangle = sheet.at(t);
        before = before.min(sheet.value_at(t));
        if triangle.v.contains(&to) {
            continue;
        }
        let v = triangle.v.map(|w| if w == from { to } else { w });
        let p = sheet.corners(v);
        for w in triangle.v.into_iter().filter(|&w| w != from) {
            if sheet.length(to, w) > long.max(1.05 * sheet.length(from, w)) {
                return false;
            }
        }
        worst = worst.min(sheet.value(v, triangle.curve));
        if worst < POOR.min(before) || !sheet.fits(triangle.patch, &p, sheet.mean_size(v)) {
            return false;
        }
    }
    worst >= POOR.min(before)
}

/// Merges `from` into `to`.
fn collapse(sheet: &mut Sheet, from: u32, to: u32) {
    sheet.change_around(from);
    let mut kept: Vec<(u32, u32)> = Vec::new();
    for t in std::mem::take(&mut sheet.around[from as usize]) {
        let triangle = sheet.at(t);
        if let (Some(i), Some(j)) = (triangle.corner(from), triangle.corner(to)) {
            // The side at `from` is merged into the side at `to`; one of them may be on a curve.
            let curve = [i, j].into_iter().map(|side| triangle.curve[side]).find(|curve| *curve != NONE);
            kept.push((triangle.v[3 - i - j], curve.unwrap_or(NONE)));
            sheet.remove_triangle(t);
        } else if let Some(k) = triangle.corner(from) {
            sheet.triangles[t as usize].v[k] = to;
            sheet.around[to as usize].push(t);
        }
    }
    for (apex, curve) in kept {
        let beside: Vec<u32> = sheet.at_edge(to, apex).collect();
        for t in beside {
            if let Some(side) = sheet.at(t).side(to, apex) {
                sheet.triangles[t as usize].curve[side] = curve;
            }
        }
    }
    sheet.change_around(to);
}
