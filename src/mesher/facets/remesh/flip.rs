//! Edge flips inside patches, if they improve the worse of the two triangles.

use super::sheet::{NONE, Sheet, Triangle};
use crate::ground::kernel::hash::WordHash;
use std::collections::{HashSet, VecDeque};

/// Least gain of a flip, so that rounding cannot cause cycles.
const GAIN: f64 = 1e-6;

/// The most flips per edge, on average.
const MOST_FLIPS: usize = 12;

/// Flips edges until nothing improves; returns the number of flips.
pub(super) fn flip_all(sheet: &mut Sheet) -> usize {
    let mut queue = changed_edges(sheet);
    let most = MOST_FLIPS * 3 * sheet.triangles.len() / 2;
    let began = sheet.changes.now();
    let mut flips = 0;
    while let Some([a, b]) = queue.pop_front() {
        if flips < most
            && let Some([p, q]) = flip(sheet, a, b)
        {
            flips += 1;
            queue.extend([[a, p], [p, b], [b, q], [q, a]]);
        }
    }
    if flips < most {
        sheet.changes.all_flips_since(began);
    }
    flips
}

/// The edges whose flips may not be in vain: a vertex of their triangles has changed since the
/// flips of all edges were tried.
fn changed_edges(sheet: &Sheet) -> VecDeque<[u32; 2]> {
    let is_changed = |vertices: &[u32]| sheet.changes.is_since_flips(vertices);
    let sides = |v: [u32; 3]| [[v[0], v[1]], [v[1], v[2]], [v[2], v[0]]];
    // Each edge is taken from the triangle that has it in ascending order. The other one may be the
    // only one that has changed, at its third vertex.
    let mut from_other: HashSet<[u32; 2], WordHash> = HashSet::default();
    for v in sheet.living().map(|t| sheet.at(t).v).filter(|v| is_changed(v)) {
        from_other
            .extend(sides(v).iter().filter(|[a, b]| a > b && !is_changed(&[*a, *b])).map(|&[a, b]| [b, a]));
    }
    let mut edges = VecDeque::new();
    for v in sheet.living().map(|t| sheet.at(t).v) {
        let all = is_changed(&v);
        edges.extend(
            sides(v).into_iter().filter(|side| side[0] < side[1] && (all || from_other.contains(side))),
        );
    }
    edges
}

/// Flips an edge if that is an improvement; returns the ends of the new edge.
pub(super) fn flip(sheet: &mut Sheet, a: u32, b: u32) -> Option<[u32; 2]> {
    let [s, t] = sheet.pair(a, b)?;
    // s is directed from a to b, with apex p; t from b to a, with apex q.
    let [s, t] = if runs(sheet.at(s), a, b) { [s, t] } else { [t, s] };
    let (first, second) = (*sheet.at(s), *sheet.at(t));
    if !runs(&first, a, b) || !runs(&second, b, a) {
        return None;
    }
    let (i, j) = (first.side(a, b)?, second.side(a, b)?);
    let (p, q) = (first.v[i], second.v[j]);
    if p == q || sheet.changes.is_flip_in_vain([a, b, p, q]) || sheet.at_edge(p, q).next().is_some() {
        return None;
    }
    let mark = |t: &Triangle, x: u32, y: u32| t.side(x, y).map_or(NONE, |side| t.curve[side]);
    // Curves opposite to each vertex: of p, a, q and of q, b, p.
    let left =
        Triangle { v: [p, a, q], patch: first.patch, curve: [mark(&second, a, q), NONE, mark(&first, p, a)] };
    let right =
        Triangle { v: [q, b, p], patch: first.patch, curve: [mark(&first, b, p), NONE, mark(&second, q, b)] };
    let before = sheet.value_at(s).min(sheet.value_at(t));
    let after = sheet.value(left.v, left.curve).min(sheet.value(right.v, right.curve));
    if after <= before + GAIN {
        return None;
    }
    for new in [&left, &right] {
        if !sheet.fits(new.patch, &sheet.corners(new.v), sheet.mean_size(new.v)) {
            return None;
        }
    }
    for (old, new) in [(s, left), (t, right)] {
        for v in sheet.at(old).v {
            sheet.around[v as usize].retain(|&x| x != old);
        }
        new.v.iter().for_each(|&v| sheet.around[v as usize].push(old));
        sheet.triangles[old as usize] = new;
    }
    [a, b, p, q].into_iter().for_each(|v| sheet.changes.change(v));
    Some([p, q])
}

/// Whether a triangle has the directed edge (a, b).
fn runs(t: &Triangle, a: u32, b: u32) -> bool {
    (0..3).any(|k| t.v[k] == a && t.v[(k + 1) % 3] == b)
}
