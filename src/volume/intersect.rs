//! Triangles that meet where they must not: asked only where the recovery fails, to say why.

use crate::Point;
use crate::kernel::predicates::{Sign, orient3d};

/// Those of `suspects` that meet another triangle, or another meets them, away from common corners; each with the middle of
/// the edge that does.
pub(super) fn intersections(points: &[Point], triangles: &[[u32; 3]], suspects: &[u32]) -> Vec<(u32, Point)> {
    let mut found = Vec::new();
    for &suspect in suspects {
        let one = triangles[suspect as usize];
        let place = triangles
            .iter()
            .filter(|other| boxes_meet(points, one, **other))
            .find_map(|other| meets(points, one, *other).or_else(|| meets(points, *other, one)));
        found.extend(place.map(|place| (suspect, place)));
    }
    found
}

fn boxes_meet(points: &[Point], one: [u32; 3], other: [u32; 3]) -> bool {
    let bounds = |triangle: [u32; 3]| {
        let [a, b, c] = triangle.map(|v| &points[v as usize]);
        (a.inf(b).inf(c), a.sup(b).sup(c))
    };
    let ((low, high), (low2, high2)) = (bounds(one), bounds(other));
    (0..3).all(|k| low[k] <= high2[k] && low2[k] <= high[k])
}

/// Where an edge of `one` goes through or touches `other` without a common corner; edges in its plane are left to
/// the triangles beside.
fn meets(points: &[Point], one: [u32; 3], other: [u32; 3]) -> Option<Point> {
    let [a, b, c] = other.map(|v| &points[v as usize]);
    let [x, y, z] = one;
    [[x, y], [y, z], [z, x]].into_iter().find_map(|[u, v]| {
        if other.contains(&u) || other.contains(&v) {
            return None;
        }
        let [p, q] = [u, v].map(|v| &points[v as usize]);
        let (from, to) = (orient3d(a, b, c, p), orient3d(a, b, c, q));
        // Two different signs: on both sides of the plane, or one on it.
        if from == to {
            return None;
        }
        let turns = [[a, b], [b, c], [c, a]].map(|[s, t]| orient3d(p, q, s, t));
        let passes_by = turns.contains(&Sign::Positive) && turns.contains(&Sign::Negative);
        (!passes_by).then(|| nalgebra::center(p, q))
    })
}
