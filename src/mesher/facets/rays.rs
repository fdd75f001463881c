//! Intersections of rays with facets, by exact predicates.

use super::join::Joined;
use super::regions::normal;
use crate::ground::kernel::predicates::{Sign, orient3d};
use crate::ground::kernel::random::Random;
use crate::ground::kernel::simplex::volume6;
use crate::ground::kernel::tree::{Tree, bounds};
use crate::{Point, Vector};
use csg::Aabb;

/// The intersection of a ray with a triangle.
pub(super) struct Hit {
    pub at: f64,
    pub triangle: u32,
    /// Whether the ray crosses from behind to the front.
    pub along: bool,
}

/// A tree of all triangles, for the rays.
pub(super) fn tree_of(joined: &Joined) -> Tree {
    let corners = |t: &[u32; 3]| t.map(|v| joined.points[v as usize]);
    Tree::new(&joined.triangles.iter().map(|t| bounds(&corners(t))).collect::<Vec<Aabb>>())
}

/// The most rays tried from a triangle: a ray is degenerate only by chance, if it meets an edge or
/// two triangles at nearly the same point.
const RAYS: usize = 64;

/// Intersections closer than this fraction of the ray's length cannot be ordered in floating point.
const APART: f64 = 1e-13;

/// The triangles along a ray from the centroid of `start`, which is the first, in order; `None` if
/// all rays are degenerate.
pub(super) fn shoot_from_triangle(joined: &Joined, tree: &Tree, start: u32) -> Option<Vec<Hit>> {
    let [a, b, c] = joined.triangles[start as usize].map(|v| joined.points[v as usize].coords);
    let up = normal(joined, start).try_normalize(0.0)?;
    shoot(joined, tree, Point::from((a + b + c) / 3.0), up, Some(start))
}

/// The triangles along a ray from a point, in order; `None` if all rays are degenerate, for example
/// if the point is on a triangle.
pub(super) fn shoot_from_point(joined: &Joined, tree: &Tree, from: Point) -> Option<Vec<Hit>> {
    shoot(joined, tree, from, Vector::z(), None)
}

fn shoot(joined: &Joined, tree: &Tree, from: Point, up: Vector, start: Option<u32>) -> Option<Vec<Hit>> {
    let corners = |t: u32| joined.triangles[t as usize].map(|v| &joined.points[v as usize]);
    let reach = joined.points.iter().map(|p| (p - from).norm()).fold(0.0, f64::max);
    let mut random = Random::new(u64::from(start.unwrap_or(0)));
    (0..RAYS).find_map(|_| {
        let aside = Vector::from_fn(|_, _| random.unit() - 0.5);
        let to = from + (up + aside).normalize() * (2.0 * reach);
        let mut hits: Vec<Hit> =
            start.map(|triangle| Hit { at: 0.0, triangle, along: true }).into_iter().collect();
        let mut degenerate = false;
        tree.along(&from, &to, |t| {
            if Some(t) != start {
                match meet(&from, &to, corners(t), t) {
                    Some(hit) => hits.extend(hit),
                    None => degenerate = true,
                }
            }
            !degenerate
        });
        if degenerate {
            return None;
        }
        hits.sort_by(|g, h| g.at.total_cmp(&h.at));
        hits.windows(2).all(|w| w[1].at - w[0].at > APART).then_some(hits)
    })
}

/// The intersection of a ray with a triangle, `Some(None)` if there is none; `None` if it is
/// degenerate.
fn meet(from: &Point, to: &Point, [a, b, c]: [&Point; 3], triangle: u32) -> Option<Option<Hit>> {
    let (low, high) = (a.inf(b).inf(c), a.sup(b).sup(c));
    if (0..3).any(|k| from[k].max(to[k]) < low[k] || from[k].min(to[k]) > high[k]) {
        return Some(None);
    }
    let turns = [[a, b], [b, c], [c, a]].map(|[p, q]| orient3d(from, to, p, q));
    if turns.contains(&Sign::Positive) && turns.contains(&Sign::Negative) {
        return Some(None);
    }
    if turns.contains(&Sign::Zero) {
        return None;
    }
    let ends = [orient3d(a, b, c, from), orient3d(a, b, c, to)];
    if ends.contains(&Sign::Zero) {
        return None;
    }
    if ends[0] == ends[1] {
        return Some(None);
    }
    let [near, far] = [from, to].map(|p| volume6(a, b, c, p).abs());
    Some(Some(Hit { at: near / (near + far), triangle, along: ends[1] == Sign::Positive }))
}
