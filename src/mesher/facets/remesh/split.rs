//! Splits of long edges at their midpoints.

use super::collapse::MOST_TURN;
use super::sheet::{Kind, NONE, Sheet, Triangle};
use crate::Point;
use crate::ground::ordered::independent;
use crate::ground::size::SizeField;
use rayon::prelude::*;
use std::collections::HashSet;

/// Splits edges longer than `long`, in units of the wanted size, and segments along which a curve
/// turns too far, the longest first; returns the number of splits in one pass.
pub(super) fn split_long(sheet: &mut Sheet, long: f64) -> usize {
    let edges = longer(sheet, long);
    let later = later(sheet, &edges, long);
    let ends = edges.into_iter().rev().map(|(_, a, b)| [a, b]);
    let edges: Vec<[u32; 2]> = ends.filter(|ends| !later.contains(ends)).collect();
    let mut splits = 0;
    let decide = |sheet: &Sheet, [a, b]: [u32; 2]| {
        let middle = middle(sheet, a, b);
        shortens(sheet, a, b, &middle).then_some(middle)
    };
    // The midpoint of an edge does not depend on the splits of others.
    independent(sheet, &edges, decide, |sheet, [a, b], middle| {
        if let Some(middle) = middle {
            split(sheet, a, b, &middle);
            splits += 1;
        }
    });
    splits
}

/// The edges that are longer than `long`, or along which a curve turns too far, the shortest first.
fn longer(sheet: &Sheet, long: f64) -> Vec<(f64, u32, u32)> {
    let mut edges: Vec<(f64, u32, u32)> = sheet.gather(|t, found| {
        for side in 0..3 {
            let (a, b) = (t.v[(side + 1) % 3], t.v[(side + 2) % 3]);
            let length = sheet.length(a, b);
            if sheet.constraints.is_fixed(t.curve[side]) {
                continue;
            }
            if length > long || turns_far(sheet, a, b, t.curve[side]) {
                found.push((length, a.min(b), a.max(b)));
            }
        }
    });
    edges.par_sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then((b.1, b.2).cmp(&(a.1, a.2))));
    edges.dedup();
    edges
}

/// The halves of an edge across a patch are at most this fraction of its length.
///
/// Between merged faces the midpoint may be projected to an end of the edge: split again and again,
/// the edge would get thousands of triangles around that end.
const SHORTER: f64 = 0.75;

/// Whether a split leaves shorter edges. Edges on curves are split at half their arc length.
fn shortens(sheet: &Sheet, a: u32, b: u32, middle: &Middle) -> bool {
    let [a, b] = [a, b].map(|end| &sheet.points[end as usize]);
    let longest = (middle.point - a).norm().max((middle.point - b).norm());
    !matches!(middle.kind, Kind::Patch(_)) || longest <= SHORTER * (b - a).norm()
}

/// In a triangle whose long sides are this many times its short one, only the shorter of the long
/// sides is split.
///
/// If both are split, one of the parts is as thin and half as wide: a face of 4096 × 1 gets
/// millions of triangles that are collapsed again. Flips remove the longest side. With 3 or less,
/// parts of such a triangle may be such triangles again and again, and their splits do not end.
const NEEDLE: f64 = 8.0;

/// The edges to be split in a later pass; `edges` is ascending.
fn later(sheet: &Sheet, edges: &[(f64, u32, u32)], long: f64) -> HashSet<[u32; 2]> {
    let mut later = HashSet::new();
    for &(_, a, b) in edges {
        let waits = sheet.at_edge(a, b).any(|t| {
            let v = sheet.at(t).v;
            let sides = [[v[0], v[1]], [v[1], v[2]], [v[2], v[0]]].map(|[a, b]| [a.min(b), a.max(b)]);
            let mut sides = sides.map(|[a, b]| (sheet.length(a, b), a, b));
            // Equal lengths in the order of the edges.
            sides.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then((b.1, b.2).cmp(&(a.1, a.2))));
            let [short, second, first] = sides;
            (first.1, first.2) == (a, b)
                && second.0 > long.max(NEEDLE * short.0)
                && !later.contains(&[second.1, second.2])
        });
        if waits {
            later.insert([a, b]);
        }
    }
    later
}

fn turns_far(sheet: &Sheet, a: u32, b: u32, curve: u32) -> bool {
    if curve == NONE {
        return false;
    }
    let polyline = &sheet.polylines[curve as usize];
    let from = sheet.place_on(a, curve);
    polyline.turn(from, polyline.way(from, sheet.place_on(b, curve))) > MOST_TURN
}

/// The midpoint of an edge on its curve or patch.
pub(super) struct Middle {
    pub point: Point,
    kind: Kind,
    /// The wanted size there.
    size: f64,
}

/// The midpoint of an edge.
pub(super) fn middle(sheet: &Sheet, a: u32, b: u32) -> Middle {
    let t = sheet.at_edge(a, b).next().map(|t| sheet.at(t)).expect("an edge has a triangle");
    let side = t.side(a, b).expect("the triangle has both ends");
    let mean = nalgebra::center(&sheet.points[a as usize], &sheet.points[b as usize]);
    if t.curve[side] == NONE {
        let point = match sheet.model.projector.flat_normal(t.patch) {
            Some(_) => mean,
            None => sheet.model.projector.project_patch(t.patch, &mean),
        };
        return Middle { point, kind: Kind::Patch(t.patch), size: sheet.size.size_at(&point) };
    }
    let polyline = &sheet.polylines[t.curve[side] as usize];
    let from = sheet.place_on(a, t.curve[side]);
    let place = polyline.wrapped(from + 0.5 * polyline.way(from, sheet.place_on(b, t.curve[side])));
    let point = polyline.at(place);
    let kind = Kind::Curve(csg::CurveId(t.curve[side]), place);
    Middle { point, kind, size: sheet.size.size_at(&point) }
}

/// Inserts a vertex on an edge: each triangle at the edge becomes two.
pub(super) fn split(sheet: &mut Sheet, a: u32, b: u32, middle: &Middle) -> u32 {
    let v = sheet.add_vertex(middle.point, middle.kind, middle.size);
    let at: Vec<u32> = sheet.at_edge(a, b).collect();
    for t in at {
        let old = *sheet.at(t);
        let (Some(i), Some(j)) = (old.corner(a), old.corner(b)) else { continue };
        let apex = 3 - i - j;
        // The first triangle gets v in place of b, the second in place of a.
        let (mut first, mut second): (Triangle, Triangle) = (old, old);
        first.v[j] = v;
        first.curve[i] = NONE;
        second.v[i] = v;
        second.curve[j] = NONE;
        first.curve[apex] = old.curve[apex];
        sheet.triangles[t as usize] = first;
        sheet.around[b as usize].retain(|&s| s != t);
        sheet.around[v as usize].push(t);
        sheet.add_triangle(second);
    }
    sheet.change_around(v);
    v
}
