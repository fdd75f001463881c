//! The point deepest inside a set of half-spaces, by linear programming.
//!
//! All faces of a polyhedron are visible from a common point if the half-spaces behind them
//! intersect. The best such point is the centre of the largest inscribed ball: four unknowns
//! (centre and radius) and one inequality per face. The program is solved incrementally (Seidel
//! 1991): if the current optimum violates the next inequality, the new optimum lies on its plane,
//! which leaves a problem with one unknown less.

use crate::ground::kernel::random::mix;
use crate::ground::kernel::simplex::area_vector;
use crate::{Point, Vector};

/// Centre and radius.
const UNKNOWNS: usize = 4;

/// Inequalities violated by less than this count as satisfied: coefficients are near 1 and carry
/// the rounding errors of some tens of operations.
const SLACK: f64 = 1e-15;

/// `coefficients · unknowns ≤ bound`.
#[derive(Clone, Copy, Debug)]
struct Row {
    coefficients: [f64; UNKNOWNS],
    bound: f64,
}

impl Row {
    fn at(&self, unknowns: &[f64; UNKNOWNS]) -> f64 {
        (0..UNKNOWNS).map(|k| self.coefficients[k] * unknowns[k]).sum()
    }

    /// Eliminates unknown k, which the row `on` determines with equality.
    fn without(&self, k: usize, on: &Row) -> Row {
        let share = self.coefficients[k] / on.coefficients[k];
        let mut row = *self;
        for j in 0..UNKNOWNS {
            row.coefficients[j] -= share * on.coefficients[j];
        }
        row.coefficients[k] = 0.0;
        row.bound -= share * on.bound;
        row
    }
}

/// A plane: its outward unit normal and a point on it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Plane {
    normal: Vector,
    foot: Point,
}

impl Plane {
    /// The plane through `foot` with an outward normal direction; `None` if that is zero.
    pub fn across(outward: &Vector, foot: &Point) -> Option<Self> {
        Some(Self { normal: outward.try_normalize(0.0)?, foot: *foot })
    }

    /// The plane of an outward face; `None` if the face is degenerate.
    pub fn of([a, b, c]: [&Point; 3]) -> Option<Self> {
        Self::across(&area_vector(a, b, c), a)
    }
}

/// The point whose least signed distance to the planes is largest, and that distance.
///
/// Distances are positive on the inner side, so the result is negative if no point is inside all
/// planes. The search covers `origin` plus -1 to 1 times each of one to three `axes`. The result is
/// rounded: verify it with exact predicates before use.
pub(super) fn deepest_point(origin: &Point, axes: &[Vector], planes: &[Plane]) -> (Point, f64) {
    let reach = axes.iter().map(Vector::norm).fold(0.0, f64::max);
    let mut rows: Vec<(u64, Row)> = (0u64..)
        .zip(planes)
        .map(|(i, plane)| {
            let mut coefficients = [0.0, 0.0, 0.0, 1.0];
            for (k, axis) in axes.iter().enumerate() {
                coefficients[k] = plane.normal.dot(axis) / reach;
            }
            (mix(i), Row { coefficients, bound: plane.normal.dot(&(plane.foot - origin)) / reach })
        })
        .collect();
    // Random order gives linear expected time; a fixed seed keeps it reproducible.
    rows.sort_unstable_by_key(|row| row.0);
    let rows: Vec<Row> = rows.into_iter().map(|row| row.1).collect();
    let mut free = [false, false, false, true];
    free[..axes.len()].fill(true);
    let best = largest([0.0, 0.0, 0.0, 1.0], free, &rows);
    let place = axes.iter().zip(best).fold(*origin, |place, (axis, part)| place + axis * part);
    (place, best[3] * reach)
}

/// Maximises `goal` over unknowns in [-1, 1] subject to `rows`; unknowns that are not `free` are
/// zero.
///
/// The radius has no lower bound that matters, so the program is feasible up to rounding.
fn largest(goal: [f64; UNKNOWNS], free: [bool; UNKNOWNS], rows: &[Row]) -> [f64; UNKNOWNS] {
    if free.iter().filter(|f| **f).count() == 1 {
        return largest_on_line(goal, free, rows);
    }
    let mut best = [0.0; UNKNOWNS];
    for k in (0..UNKNOWNS).filter(|&k| free[k]) {
        best[k] = if goal[k] < 0.0 { -1.0 } else { 1.0 };
    }
    for (i, row) in rows.iter().enumerate() {
        if row.at(&best) <= row.bound + SLACK {
            continue;
        }
        let size = |k: &usize| row.coefficients[*k].abs();
        let k = (0..UNKNOWNS).filter(|&k| free[k]).max_by(|a, b| size(a).total_cmp(&size(b)));
        let k = k.expect("two free unknowns or more");
        if row.coefficients[k] == 0.0 {
            continue;
        }
        let mut below: Vec<Row> = rows[..i].iter().map(|r| r.without(k, row)).collect();
        for sign in [1.0, -1.0] {
            let mut side = Row { coefficients: [0.0; UNKNOWNS], bound: 1.0 };
            side.coefficients[k] = sign;
            below.push(side.without(k, row));
        }
        let goal = Row { coefficients: goal, bound: 0.0 }.without(k, row).coefficients;
        let mut free = free;
        free[k] = false;
        best = largest(goal, free, &below);
        best[k] = (row.bound - row.at(&best)) / row.coefficients[k];
    }
    best
}

fn largest_on_line(goal: [f64; UNKNOWNS], free: [bool; UNKNOWNS], rows: &[Row]) -> [f64; UNKNOWNS] {
    let k = free.iter().position(|f| *f).expect("one free unknown");
    let (mut low, mut high) = (-1.0f64, 1.0f64);
    for row in rows {
        let end = row.bound / row.coefficients[k];
        if row.coefficients[k] > 0.0 {
            high = high.min(end);
        } else if row.coefficients[k] < 0.0 {
            low = low.max(end);
        }
    }
    let mut best = [0.0; UNKNOWNS];
    // If rounding makes the interval empty, its middle violates both ends least.
    best[k] = if low > high {
        0.5 * (low + high)
    } else if goal[k] < 0.0 {
        low
    } else {
        high
    };
    best
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ground::kernel::random::Random;

    fn axes(reach: f64) -> [Vector; 3] {
        [Vector::x() * reach, Vector::y() * reach, Vector::z() * reach]
    }

    fn of_corners(points: &[Point], faces: &[[usize; 3]]) -> (Point, f64) {
        let planes: Vec<Plane> = faces.iter().filter_map(|f| Plane::of(f.map(|v| &points[v]))).collect();
        deepest_point(&points[0], &axes(10.0), &planes)
    }

    #[test]
    fn the_centre_of_a_tets_inscribed_ball_is_found() {
        let points = [[0., 0., 0.], [1., 0., 0.], [0., 1., 0.], [0., 0., 1.]].map(Point::from);
        let (place, distance) = of_corners(&points, &crate::ground::mesh::TET_FACES);
        let expected = 1.0 / (3.0 + 3f64.sqrt());
        assert!(
            (distance - expected).abs() < 1e-14 && (place - Point::new(1., 1., 1.) * expected).norm() < 1e-13
        );
    }

    #[test]
    fn half_spaces_without_intersection_give_a_negative_distance() {
        // Two parallel planes at distance 1 and a third: facing outward, then inward.
        let points = [
            [0., 0., 0.],
            [1., 0., 0.],
            [0., 1., 0.],
            [0., 0., 1.],
            [0., 1., 1.],
            [1., 0., 1.],
            [1., 1., 1.],
        ]
        .map(Point::from);
        let (_, distance) = of_corners(&points, &[[0, 2, 1], [3, 5, 4], [0, 1, 3]]);
        assert!((distance - 0.5).abs() < 1e-13, "{distance}");
        let (_, distance) = of_corners(&points, &[[0, 1, 2], [3, 4, 5], [0, 1, 3]]);
        assert!((distance + 0.5).abs() < 1e-13, "{distance}");
    }

    #[test]
    fn no_random_point_is_deeper_than_the_optimum() {
        let mut random = Random::new(5);
        let mut unit = || Vector::from_fn(|_, _| 2.0 * random.unit() - 1.0);
        for _ in 0..50 {
            // Planes tangent to the unit sphere, facing outward.
            let planes: Vec<Plane> = (0..30)
                .filter_map(|_| {
                    let normal = unit().normalize();
                    Plane::across(&normal, &Point::from(normal))
                })
                .collect();
            let distance_at =
                |p: &Point| planes.iter().map(|q| q.normal.dot(&(q.foot - p))).fold(f64::INFINITY, f64::min);
            let (place, distance) = deepest_point(&Point::new(0.3, 0.2, 0.1), &axes(4.0), &planes);
            assert!((distance_at(&place) - distance).abs() < 1e-12 && distance > 0.999);
            // Restricted to a line and to a plane, which may miss the overall optimum.
            for k in 1..3 {
                let (place, distance) = deepest_point(&Point::origin(), &axes(4.0)[..k], &planes);
                assert!((distance_at(&place) - distance).abs() < 1e-12 && distance > 0.999);
                for _ in 0..20 {
                    let mut other = place + 0.1 * unit();
                    other.coords.iter_mut().skip(k).for_each(|x| *x = 0.0);
                    assert!(distance_at(&other) <= distance + 1e-12);
                }
            }
            for _ in 0..200 {
                assert!(distance_at(&(place + unit())) <= distance + 1e-12);
            }
        }
    }
}
