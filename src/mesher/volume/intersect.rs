//! All improper intersections of triangles, by exact predicates.
//!
//! Two triangles may share a corner or an edge and nothing else. A tree of boxes (`boxes`) leaves
//! few pairs to test. If two triangles intersect otherwise, an edge of one intersects the other
//! triangle, in a point or, if both are coplanar, in a segment. (Guigue, Devillers 2003 need fewer
//! signs; here most pairs are neighbours, which the first two signs decide.) Triangles with a
//! common edge are tested in `sectors`.

use super::boxes::{Box3, Tree};
use crate::Point;
use crate::ground::kernel::predicates::{Sign, orient2d, orient3d};

/// All pairs of triangles that intersect outside a common corner or edge, ascending, each with a
/// point of the intersection.
pub(crate) fn intersections(points: &[Point], triangles: &[[u32; 3]]) -> Vec<([u32; 2], Point)> {
    let boxes = triangles.iter().map(|t| Box3::of(t.map(|v| &points[v as usize]))).collect();
    let mut found = Tree::new(boxes).find_pairs(&|i, j| {
        let pair = [i.min(j), i.max(j)];
        let [one, other] = pair.map(|t| triangles[t as usize]);
        Some((pair, meeting(points, one, other)?))
    });
    found.sort_unstable_by_key(|f| f.0);
    found
}

/// The midpoints of the edges of all triangles in `pairs`, without duplicates.
///
/// Requesting smaller sizes there separates the triangles. Points inside the triangles would be
/// less effective: sizes grow with distance, so the vertices would be refined little.
pub(crate) fn middles_of_sides(
    points: &[Point],
    triangles: &[[u32; 3]],
    pairs: impl IntoIterator<Item = [u32; 2]>,
) -> Vec<Point> {
    let mut sides: Vec<[u32; 2]> = pairs
        .into_iter()
        .flatten()
        .flat_map(|t| {
            let [a, b, c] = triangles[t as usize];
            [[a, b], [b, c], [c, a]].map(|[v, w]| [v.min(w), v.max(w)])
        })
        .collect();
    sides.sort_unstable();
    sides.dedup();
    let middle = |[v, w]: [u32; 2]| nalgebra::center(&points[v as usize], &points[w as usize]);
    sides.into_iter().map(middle).collect()
}

/// A point where two triangles intersect, outside common corners and edges.
fn meeting(points: &[Point], one: [u32; 3], other: [u32; 3]) -> Option<Point> {
    let at = |triangle: [u32; 3]| triangle.map(|v| &points[v as usize]);
    let common = one.iter().position(|v| other.contains(v));
    let Some(i) = common else {
        let (here, there) = (at(one), at(other));
        let to_there = here.map(|p| side(there, p));
        let to_here = there.map(|p| side(here, p));
        if is_beside(&to_there) || is_beside(&to_here) {
            return None;
        }
        return (0..3).find_map(|k| {
            let l = (k + 1) % 3;
            segment_meets([here[k], here[l]], [to_there[k], to_there[l]], there)
                .or_else(|| segment_meets([there[k], there[l]], [to_here[k], to_here[l]], here))
        });
    };
    let [v, a, b] = [0, 1, 2].map(|k| one[(i + k) % 3]);
    if other.contains(&a) || other.contains(&b) {
        return None;
    }
    // If the triangles share more than the corner v, one of the edges opposite to v intersects the
    // other triangle.
    let j = other.iter().position(|&w| w == v).expect("a common corner");
    let [c, d] = [1, 2].map(|k| other[(j + k) % 3]);
    let (here, there) = (at([v, a, b]), at([v, c, d]));
    let to_there = [here[1], here[2]].map(|p| side(there, p));
    if is_beside(&to_there) {
        return None;
    }
    let to_here = [there[1], there[2]].map(|p| side(here, p));
    if is_beside(&to_here) {
        return None;
    }
    segment_meets([here[1], here[2]], to_there, there)
        .or_else(|| segment_meets([there[1], there[2]], to_here, here))
}

fn side([a, b, c]: [&Point; 3], p: &Point) -> Sign {
    orient3d(a, b, c, p)
}

/// Whether all signs are equal and not zero.
fn is_beside(signs: &[Sign]) -> bool {
    signs[0] != Sign::Zero && signs.iter().all(|&s| s == signs[0])
}

/// The point where a segment meets a triangle; `sides` are the sides of its ends relative to the
/// triangle's plane.
pub(super) fn segment_meets([p, q]: [&Point; 2], sides: [Sign; 2], [a, b, c]: [&Point; 3]) -> Option<Point> {
    if sides == [Sign::Zero; 2] {
        return meets_in_plane([p, q], [a, b, c]);
    }
    if sides[0] == sides[1] {
        return None;
    }
    let turns = [[a, b], [b, c], [c, a]].map(|[s, t]| orient3d(p, q, s, t));
    if turns.contains(&Sign::Positive) && turns.contains(&Sign::Negative) {
        return None;
    }
    // Rounded: used in messages only.
    let normal = (b - a).cross(&(c - a));
    let (from, to) = ((p - a).dot(&normal), (q - a).dot(&normal));
    let fraction = from / (from - to);
    Some(if fraction.is_finite() { p + (q - p) * fraction.clamp(0.0, 1.0) } else { nalgebra::center(p, q) })
}

/// A point where a segment meets a coplanar triangle.
///
/// Two convex sets are disjoint if the line of a side of one separates them; signs are exact on a
/// coordinate plane, so both are projected.
fn meets_in_plane([p, q]: [&Point; 2], triangle: [&Point; 3]) -> Option<Point> {
    let projections = [[0, 1], [1, 2], [2, 0]];
    let on = |[i, j]: [usize; 2], p: &Point| [p[i], p[j]];
    let (projection, sense) = projections.into_iter().find_map(|s| {
        let [a, b, c] = triangle.map(|p| on(s, p));
        let sign = orient2d(a, b, c);
        (sign != Sign::Zero).then_some((s, sign))
    })?;
    let [from, to] = [p, q].map(|p| on(projection, p));
    let corners = triangle.map(|p| on(projection, p));
    let outside = |[s, t]: [[f64; 2]; 2], x| orient2d(s, t, x) == sense.flipped();
    let edges = [0, 1, 2].map(|k| [corners[k], corners[(k + 1) % 3]]);
    if edges.iter().any(|&edge| outside(edge, from) && outside(edge, to))
        || is_beside(&corners.map(|x| orient2d(from, to, x)))
    {
        return None;
    }
    // The middle of the segment clipped by the triangle's sides, rounded.
    let (mut first, mut last) = (0.0f64, 1.0f64);
    for [s, t] in edges {
        let away = |x: [f64; 2]| {
            let area = (t[0] - s[0]) * (x[1] - s[1]) - (t[1] - s[1]) * (x[0] - s[0]);
            if sense == Sign::Positive { area } else { -area }
        };
        let (d, e) = (away(from), away(to));
        if d < 0.0 && e > d {
            first = first.max(d / (d - e));
        }
        if e < 0.0 && d > e {
            last = last.min(d / (d - e));
        }
    }
    Some(p + (q - p) * (0.5 * (first + last)).clamp(0.0, 1.0))
}

#[cfg(test)]
mod tests {
    use super::super::samples::{INSIDE, Soup};
    use super::*;
    use crate::ground::kernel::random::Random;

    fn triangle(corners: [[f64; 3]; 3]) -> [Point; 3] {
        corners.map(Point::from)
    }

    /// Whether two triangles intersect, checked for all orders of corners; corners at equal
    /// positions are shared.
    fn meet(one: [[f64; 3]; 3], other: [[f64; 3]; 3]) -> bool {
        let mut points: Vec<Point> = triangle(one).to_vec();
        let other = triangle(other).map(|p| {
            points.iter().position(|q| *q == p).unwrap_or_else(|| {
                points.push(p);
                points.len() - 1
            }) as u32
        });
        let orders = |[a, b, c]: [u32; 3]| [[a, b, c], [b, c, a], [c, a, b], [a, c, b], [c, b, a], [b, a, c]];
        let mut answers = Vec::new();
        for a in orders([0, 1, 2]) {
            for b in orders(other) {
                answers.push(meeting(&points, a, b).is_some());
                answers.push(meeting(&points, b, a).is_some());
            }
        }
        assert!(answers.iter().all(|&a| a == answers[0]), "the order of corners matters: {one:?}");
        answers[0]
    }

    const FLAT: [[f64; 3]; 3] = [[0., 0., 0.], [4., 0., 0.], [0., 4., 0.]];

    #[test]
    fn triangles_in_two_planes_intersect_if_one_is_cut_or_touched() {
        for (other, expected) in [
            ([[1., 1., -1.], [1., 1., 1.], [9., 9., 1.]], true),
            // One end of its edge on the face, an edge, a corner; then off the triangle.
            ([[1., 1., 0.], [1., 1., 1.], [9., 9., 1.]], true),
            ([[2., 2., 0.], [2., 2., 1.], [9., 9., 1.]], true),
            ([[2., -1., 0.], [2., 1., 0.], [2., 0., 3.]], true),
            ([[3., 3., 0.], [3., 3., 1.], [9., 9., 1.]], false),
            // Crosses an edge of the other; then passes it.
            ([[2., -1., -1.], [2., 1., 1.], [2., -1., 1.]], true),
            ([[2., -1., -1.], [2., 0.9, 1.], [2., -1., 1.]], false),
            // A shared corner, with and without further contact.
            ([[0., 0., 0.], [2., 2., 1.], [2., 2., -1.]], true),
            ([[0., 0., 0.], [1., 1., 0.], [1., 1., 2.]], true),
            ([[0., 0., 0.], [2., 2., 1.], [-4., 2., -1.]], false),
            ([[0., 0., 0.], [2., 0., 0.], [2., 0., 2.]], true),
            // A shared edge is allowed.
            ([[0., 0., 0.], [4., 0., 0.], [1., 1., 2.]], false),
        ] {
            assert_eq!(meet(FLAT, other), expected, "{other:?}");
        }
    }

    #[test]
    fn coplanar_triangles_intersect_if_they_overlap_or_touch() {
        for (other, expected) in [
            ([[1., 1., 0.], [1.5, 1., 0.], [1., 1.5, 0.]], true),
            ([[-9., -9., 0.], [90., -9., 0.], [-9., 90., 0.]], true),
            ([[2., 2., 0.], [4., 4., 0.], [4., 3., 0.]], true),
            ([[2., 2.5, 0.], [4., 4., 0.], [4., 3., 0.]], false),
            ([[-1., 1., 0.], [5., 1., 0.], [5., 1.5, 0.]], true),
            ([[-1., 0., 0.], [-2., 0., 0.], [-1., 3., 0.]], false),
            // A shared corner: apart, overlapping, along an edge, surrounding.
            ([[0., 0., 0.], [-1., 0., 0.], [0., -1., 0.]], false),
            ([[0., 0., 0.], [1., 2., 0.], [2., 1., 0.]], true),
            ([[0., 0., 0.], [2., 0., 0.], [2., -1., 0.]], true),
            ([[0., 0., 0.], [9., -1., 0.], [-1., 9., 0.]], true),
            ([[0., 0., 0.], [5., -1., 0.], [5., -2., 0.]], false),
        ] {
            assert_eq!(meet(FLAT, other), expected, "{other:?}");
            // The same in a slanted plane, with exact coordinates.
            let slant = |t: [[f64; 3]; 3]| t.map(|[x, y, _]| [x + y, y - x, 2.0 * x + y]);
            assert_eq!(meet(slant(FLAT), slant(other)), expected, "{other:?} slanted");
        }
    }

    #[test]
    fn all_intersections_of_crossing_surfaces_are_found_and_none_of_valid_ones() {
        let mut random = Random::new(4);
        for shift in [5.0, 0.3, 1.0] {
            let mut soup = Soup::default();
            soup.torus([1.0, 0.4], [24, 12], INSIDE);
            let mut other = Soup::default();
            other.sphere(Point::new(shift, 0.1 * random.unit(), 0.0), 0.5, 2, INSIDE);
            for t in &other.triangles {
                soup.add(t.map(|v| other.points[v as usize]), INSIDE);
            }
            let found = intersections(&soup.points, &soup.triangles);
            let n = soup.triangles.len();
            let all: Vec<[u32; 2]> = (0..n)
                .flat_map(|i| (i + 1..n).map(move |j| [i, j]))
                .filter(|p| meeting(&soup.points, soup.triangles[p[0]], soup.triangles[p[1]]).is_some())
                .map(|p| p.map(|i| i as u32))
                .collect();
            assert_eq!(found.iter().map(|f| f.0).collect::<Vec<_>>(), all);
            assert_eq!(found.is_empty(), shift == 5.0);
            for ([i, j], place) in found {
                // The place is on both triangles, up to rounding.
                for t in [i, j] {
                    let [a, b, c] = soup.triangles[t as usize].map(|v| soup.points[v as usize]);
                    let normal = (b - a).cross(&(c - a)).normalize();
                    assert!((place - a).dot(&normal).abs() < 1e-12, "triangles {i} and {j} at {place}");
                }
            }
        }
    }
}
