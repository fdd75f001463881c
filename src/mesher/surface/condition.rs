//! Makes the first triangulation follow its surface, if vertices are wanted much closer than its
//! triangles are large.
//!
//! Swaps compare costs in space. If the surface turns far within a triangle, costs are unreliable
//! and swaps may stop with long needles, which the front keeps. So large triangles are split until
//! each is nearly parallel to the surface.

use super::sheet::{Kind, Node, Sheet, Stop};
use super::topology::{NONE, last, next};
use crate::ground::kernel::simplex::area_vector;
use crate::{Point, Vector};
use std::collections::VecDeque;

/// Cosine of 25°: triangles at a larger angle to the surface are split. With 60° fine tori kept
/// needles, with 45° none did.
const PARALLEL: f64 = 0.906;
/// Only triangles with an edge longer than this many times the least size at their corners are
/// split; the front refines the others anyway.
const LARGE: f64 = 2.5;
/// The most steps of a walk in the first triangulation, which is coarse.
const STEPS: usize = 1000;

/// Splits large triangles that do not follow the surface, by helper vertices that the front may
/// move; returns their number.
pub(super) fn condition(sheet: &mut Sheet, limit: usize) -> Result<usize, Stop> {
    let mut queue: VecDeque<(u32, [u32; 3])> = sheet.mesh.living().map(|t| (t, sheet.mesh.at(t).v)).collect();
    let mut inserted = 0;
    let mut ring = Vec::new();
    while let Some((t, v)) = queue.pop_front() {
        if sheet.mesh.at(t).v != v || sheet.nodes.len() >= limit {
            continue;
        }
        let Some(middle) = cut(sheet, t) else { continue };
        let Ok(node) = sheet.project(&middle) else { continue };
        let node = Node { kind: Kind::Helper, ..node };
        let Some(place) = sheet.walk(t, &node.site, STEPS) else { continue };
        let Some(v) = sheet.insert(node, place) else { continue };
        inserted += 1;
        sheet.mesh.around(v, &mut ring);
        queue.extend(ring.iter().map(|&t| (t, sheet.mesh.at(t).v)));
    }
    Ok(inserted)
}

/// The point at which to split a triangle, the midpoint of its longest edge that is not a segment;
/// `None` if it need not be split.
fn cut(sheet: &Sheet, t: u32) -> Option<Point> {
    let x = sheet.mesh.at(t);
    let corners = sheet.corners(t);
    let [a, b, c] = corners.map(|n| n.point);
    let area = area_vector(&a, &b, &c);
    let follows = |n: &&Node| n.normal == Vector::zeros() || area.dot(&n.normal) >= PARALLEL * area.norm();
    if corners.iter().all(follows) {
        return None;
    }
    let longest = (0..3)
        .filter(|&i| x.segment[i] == NONE)
        .map(|i| ((corners[last(i)].point - corners[next(i)].point).norm(), i))
        .max_by(|p, q| p.0.total_cmp(&q.0))?;
    let size = corners.iter().map(|n| n.size).fold(f64::INFINITY, f64::min);
    if longest.0 <= LARGE * size {
        return None;
    }
    // The projection of a long chord's midpoint may be anywhere; the chart's midpoint is between
    // the ends.
    sheet.chart.middle(&corners[next(longest.1)].site, &corners[last(longest.1)].site)
}
