//! Edge flips inside patches, if they improve the worse of the two triangles.

use super::sheet::{NONE, Sheet, Triangle, now};
use crate::ground::ordered::in_order;
use rayon::prelude::*;

/// Least gain of a flip, so that rounding cannot cause cycles.
const GAIN: f64 = 1e-6;

/// The most flips per edge, on average.
const MOST_FLIPS: usize = 12;

/// Flips edges until nothing improves; returns the number of flips.
pub(super) fn flip_all(sheet: &mut Sheet) -> usize {
    let mut edges = changed_edges(sheet);
    let most = MOST_FLIPS * 3 * sheet.triangles.len() / 2;
    let began = sheet.changes.now();
    let mut flips = 0;
    while !edges.is_empty() && flips < most {
        let mut next = Vec::new();
        let holds = |sheet: &Sheet, began, [a, b]: [u32; 2], trial: &Trial| {
            !sheet.changes.is_since(began, &[a, b]) && !sheet.changes.is_since(began, &trial.apexes)
        };
        let make = |sheet: &mut Sheet, [a, b]: [u32; 2], trial: Trial| {
            if flips < most
                && let Some(flip) = trial.flip
            {
                apply(sheet, &flip);
                flips += 1;
                let [p, q] = flip.apexes;
                next.extend([[a, p], [p, b], [b, q], [q, a]]);
            }
        };
        in_order(sheet, &edges, now, |sheet, [a, b]| try_flip(sheet, a, b), holds, make);
        edges = next;
    }
    if flips < most {
        sheet.changes.all_flips_since(began);
    }
    flips
}

/// The edges whose flips may not be in vain: a vertex of their triangles has changed since the
/// flips of all edges were tried.
fn changed_edges(sheet: &Sheet) -> Vec<[u32; 2]> {
    let is_changed = |vertices: &[u32]| sheet.changes.is_since_flips(vertices);
    let sides = |v: [u32; 3]| [[v[0], v[1]], [v[1], v[2]], [v[2], v[0]]];
    // Each edge is taken from the triangle that has it in ascending order. The other one may be the
    // only one that has changed, at its third vertex.
    let mut from_other: Vec<[u32; 2]> = sheet.gather(|t, found| {
        if is_changed(&t.v) {
            let descending = sides(t.v).into_iter().filter(|[a, b]| a > b && !is_changed(&[*a, *b]));
            found.extend(descending.map(|[a, b]| [b, a]));
        }
    });
    from_other.par_sort_unstable();
    sheet.gather(|t, found| {
        let all = is_changed(&t.v);
        let is_tried = |side: &[u32; 2]| all || from_other.binary_search(side).is_ok();
        found.extend(sides(t.v).into_iter().filter(|side| side[0] < side[1] && is_tried(side)));
    })
}

/// Two triangles with a common edge, and those that take their place.
struct Flip {
    old: [u32; 2],
    new: [Triangle; 2],
    /// The ends of the new edge.
    apexes: [u32; 2],
}

/// What the trial of a flip found.
struct Trial {
    /// The flip, if it is an improvement.
    flip: Option<Flip>,
    /// The vertices beside the edge, on which the result depends as on its ends; its first end if
    /// it depends on no others.
    apexes: [u32; 2],
}

/// Flips an edge if that is an improvement; returns the ends of the new edge.
pub(super) fn flip(sheet: &mut Sheet, a: u32, b: u32) -> Option<[u32; 2]> {
    let flip = try_flip(sheet, a, b).flip?;
    apply(sheet, &flip);
    Some(flip.apexes)
}

/// Tries the flip of an edge.
fn try_flip(sheet: &Sheet, a: u32, b: u32) -> Trial {
    let Some(flip) = pair_at(sheet, a, b) else { return Trial { flip: None, apexes: [a; 2] } };
    let apexes = flip.apexes;
    Trial { flip: improves(sheet, [a, b], &flip).then_some(flip), apexes }
}

/// The flip of an edge, which need not be possible; `None` if it is not between two triangles of a
/// patch.
fn pair_at(sheet: &Sheet, a: u32, b: u32) -> Option<Flip> {
    let [s, t] = sheet.pair(a, b)?;
    // s is directed from a to b, with apex p; t from b to a, with apex q.
    let [s, t] = if runs(sheet.at(s), a, b) { [s, t] } else { [t, s] };
    let (first, second) = (*sheet.at(s), *sheet.at(t));
    if !runs(&first, a, b) || !runs(&second, b, a) {
        return None;
    }
    let (i, j) = (first.side(a, b)?, second.side(a, b)?);
    let (p, q) = (first.v[i], second.v[j]);
    let mark = |t: &Triangle, x: u32, y: u32| t.side(x, y).map_or(NONE, |side| t.curve[side]);
    // Curves opposite to each vertex: of p, a, q and of q, b, p.
    let left =
        Triangle { v: [p, a, q], patch: first.patch, curve: [mark(&second, a, q), NONE, mark(&first, p, a)] };
    let right =
        Triangle { v: [q, b, p], patch: first.patch, curve: [mark(&first, b, p), NONE, mark(&second, q, b)] };
    Some(Flip { old: [s, t], new: [left, right], apexes: [p, q] })
}

/// Whether a flip is possible and an improvement.
fn improves(sheet: &Sheet, [a, b]: [u32; 2], flip: &Flip) -> bool {
    let ([p, q], [s, t], [left, right]) = (flip.apexes, flip.old, &flip.new);
    let is_vain = p == q || sheet.changes.is_flip_in_vain([a, b, p, q]);
    if is_vain || sheet.at_edge(p, q).next().is_some() || sheet.constraints.is_taken(p, q) {
        return false;
    }
    let before = sheet.value_at(s).min(sheet.value_at(t));
    let after = sheet.value(left.v, left.curve).min(sheet.value(right.v, right.curve));
    let fits = |new: &Triangle| sheet.fits(new.patch, &sheet.corners(new.v), sheet.mean_size(new.v));
    after > before + GAIN && fits(left) && fits(right)
}

/// Replaces the two triangles.
fn apply(sheet: &mut Sheet, flip: &Flip) {
    for (old, new) in flip.old.into_iter().zip(flip.new) {
        for v in sheet.at(old).v {
            sheet.around[v as usize].retain(|&x| x != old);
        }
        new.v.iter().for_each(|&v| sheet.around[v as usize].push(old));
        sheet.triangles[old as usize] = new;
    }
    let [[p, a, q], [_, b, _]] = flip.new.map(|t| t.v);
    [a, b, p, q].into_iter().for_each(|v| sheet.changes.change(v));
}

/// Whether a triangle has the directed edge (a, b).
fn runs(t: &Triangle, a: u32, b: u32) -> bool {
    (0..3).any(|k| t.v[k] == a && t.v[(k + 1) % 3] == b)
}
