//! The closest pair of surface triangles where recovery fails, which is nearly always the cause.

use crate::Point;
use crate::ground::kernel::simplex::squared_distance;
use std::fmt;

/// Least distance of facets for which recovery is designed, as a fraction of the surface's
/// diagonal.
///
/// Closer facets usually work too (sheets at 10⁻¹² do), but a Steiner point may have no position
/// between them in double precision.
pub(super) const NEAREST: f64 = 1e-9;

/// Two triangles of a surface without a common vertex, and their distance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NearPair {
    /// Indices of the triangles; the first is one that could not be recovered.
    pub triangles: [u32; 2],
    /// Their distance, as a fraction of the diagonal of the surface's bounding box.
    pub apart: f64,
}

impl fmt::Display for NearPair {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [one, other] = self.triangles;
        write!(f, "triangles {one} and {other} are {:.1e} of the diagonal apart", self.apart)?;
        if self.apart < NEAREST { write!(f, ", too near: {NEAREST:e} is needed") } else { Ok(()) }
    }
}

/// The closest pair of triangles without a common vertex, one of them in `of`; the first such pair
/// if there are several.
pub(super) fn nearest_pair(points: &[Point], triangles: &[[u32; 3]], of: &[u32]) -> Option<NearPair> {
    let (low, high) = extent(points.iter());
    let diagonal = (high - low).norm();
    let corners = |t: u32| triangles[t as usize].map(|v| &points[v as usize]);
    let boxes: Vec<(Point, Point)> =
        (0..triangles.len() as u32).map(|t| extent(corners(t).into_iter())).collect();
    let mut best: (f64, Option<[u32; 2]>) = (f64::INFINITY, None);
    for &one in of {
        let (low, high) = boxes[one as usize];
        for other in 0..triangles.len() as u32 {
            let gap = (boxes[other as usize].0 - high).sup(&(low - boxes[other as usize].1));
            let common = triangles[one as usize].iter().any(|v| triangles[other as usize].contains(v));
            if common || gap.map(|x| x.max(0.0)).norm_squared() >= best.0 {
                continue;
            }
            let squared = squared_between(corners(one), corners(other));
            if squared < best.0 {
                best = (squared, Some([one, other]));
            }
        }
    }
    best.1.map(|triangles| NearPair { triangles, apart: best.0.sqrt() / diagonal })
}

fn extent<'a>(mut points: impl Iterator<Item = &'a Point>) -> (Point, Point) {
    let first = *points.next().expect("a point");
    points.fold((first, first), |(low, high), p| (low.inf(p), high.sup(p)))
}

/// The squared distance of two disjoint triangles: attained at a corner of one, or between two
/// edges.
fn squared_between(one: [&Point; 3], other: [&Point; 3]) -> f64 {
    let sides = |[a, b, c]: [&'_ Point; 3]| [[*a, *b], [*b, *c], [*c, *a]];
    let corner = |p: &&Point, of: [&Point; 3]| squared_distance(p, of);
    let corners = one.iter().map(|p| corner(p, other)).chain(other.iter().map(|p| corner(p, one)));
    let edges = sides(one)
        .into_iter()
        .flat_map(|edge| sides(other).map(|across| squared_across(edge, across).unwrap_or(f64::INFINITY)));
    corners.chain(edges).fold(f64::INFINITY, f64::min)
}

/// The squared distance of two segments if their closest points are interior to both.
fn squared_across([a, b]: [Point; 2], [c, d]: [Point; 2]) -> Option<f64> {
    let (along, across, between) = (b - a, d - c, c - a);
    let normal = along.cross(&across);
    let area = normal.norm_squared();
    let inside = |x: f64| 0.0 < x && x < area;
    (inside(between.cross(&across).dot(&normal)) && inside(between.cross(&along).dot(&normal)))
        .then(|| between.dot(&normal).powi(2) / area)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distances_at_corners_and_edges_are_found_and_neighbours_skipped() {
        let points: Vec<Point> = [
            // Triangle 0, and 1 sharing an edge with it.
            [0.0, 0.0, 0.0],
            [4.0, 0.0, 0.0],
            [0.0, 4.0, 0.0],
            [4.0, 4.0, 0.0],
            // A corner above the interior of 0.
            [1.0, 1.0, 0.5],
            [1.0, 2.0, 3.0],
            [2.0, 1.0, 3.0],
            // An edge crossing that of 0 on the x axis, 0.25 below.
            [2.0, -1.0, -0.25],
            [2.0, 1.0, -0.25],
            [2.0, 0.0, -3.0],
        ]
        .map(Point::from)
        .to_vec();
        let triangles = [[0, 1, 2], [1, 3, 2], [4, 5, 6], [7, 8, 9]];
        let (low, high) = extent(points.iter());
        let diagonal = (high - low).norm();
        let pair = |of: &[u32], among: usize| nearest_pair(&points, &triangles[..among], of);
        assert_eq!(pair(&[0], 2), None);
        let corner = pair(&[0, 1], 3).unwrap();
        assert_eq!(corner.triangles, [0, 2]);
        assert!((corner.apart * diagonal - 0.5).abs() < 1e-12);
        let edge = pair(&[1, 0], 4).unwrap();
        assert_eq!(edge.triangles, [0, 3]);
        assert!((edge.apart * diagonal - 0.25).abs() < 1e-12);
        assert!(!edge.to_string().contains("too near"));
        assert!(NearPair { apart: 1e-10, ..edge }.to_string().contains("too near"));
    }
}
