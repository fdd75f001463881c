//! Triangles of a surface that meet where they must not, by exact signs.

use super::tree::{Tree, bounds};
use crate::Point;
use crate::kernel::predicates::{Sign, orient3d};
use crate::mesh::BoundaryTriangle;
use rayon::prelude::*;

/// A place in each pair of triangles of which an edge of one goes through or touches the other, away from common vertices.
pub(super) fn crossings(points: &[Point], triangles: &[BoundaryTriangle]) -> Vec<Point> {
    let corners: Vec<[u32; 3]> = triangles.iter().map(|t| t.vertices.map(|v| v.0)).collect();
    let boxes: Vec<_> = corners.iter().map(|t| bounds(&t.map(|v| points[v as usize]))).collect();
    let tree = Tree::new(&boxes);
    let of = |t: usize| {
        let mut near = Vec::new();
        tree.meeting(&boxes[t], &mut |u| near.extend((u as usize > t).then_some(u as usize)));
        near.sort_unstable();
        near.into_iter()
            .filter_map(|u| {
                meets(points, corners[t], corners[u]).or_else(|| meets(points, corners[u], corners[t]))
            })
            .collect::<Vec<Point>>()
    };
    (0..corners.len()).into_par_iter().map(of).collect::<Vec<_>>().concat()
}

/// Where an edge of `one` goes through `other`, or touches it, with no common vertex. Edges in its plane are left to the
/// triangles beside.
fn meets(points: &[Point], one: [u32; 3], other: [u32; 3]) -> Option<Point> {
    let [a, b, c] = other.map(|v| &points[v as usize]);
    let [x, y, z] = one;
    [[x, y], [y, z], [z, x]].into_iter().find_map(|[u, v]| {
        if other.contains(&u) || other.contains(&v) {
            return None;
        }
        let [p, q] = [u, v].map(|v| &points[v as usize]);
        let (from, to) = (orient3d(a, b, c, p), orient3d(a, b, c, q));
        if from == to {
            return None;
        }
        let turns = [[a, b], [b, c], [c, a]].map(|[s, t]| orient3d(p, q, s, t));
        let passes_by = turns.contains(&Sign::Positive) && turns.contains(&Sign::Negative);
        (!passes_by).then(|| nalgebra::center(p, q))
    })
}
