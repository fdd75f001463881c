//! Division of curves.

use super::measure::from_segment;
use crate::{Corner, EdgeCurve, Fin, Point, Surface, Vector};

/// The most vertices on a curve.
const MOST: usize = 100_000;
/// A closed curve, or one that bends, has at least this many segments between jumps.
const FEWEST: usize = 2;

/// Vertices on a curve are this far from its ends, and breaks from each other (fraction of the
/// diagonal).
const BENT: f64 = 1e-6;

/// Vertices on a curve are so many times as far from its corner as its end is.
const FAR: f64 = 4.0;

/// Where a curve goes back for at most this share of its length, and of the diagonal, that is a
/// hook and no shape: edges of chamfers and offsets have them at bends sharper than they are wide.
const HOOK: [f64; 2] = [5e-3, 1e-3];
/// The cosine of the angle by which a curve turns at both ends of a hook, at most.
const BACK: f64 = -0.2;
/// Hooks are at least this far from other turns, in their own lengths: teeth are no hooks.
const APART: f64 = 4.0;

/// The middle of a side, straight in the parameters, is at most this far from its curve, in lengths
/// of the side.
const STRAY: f64 = 0.04;
/// Shorter sides, in lengths of the shortest, are not divided for that.
const LONG: f64 = 300.0;

/// A side of a patch with its surface.
pub(super) type Beside<'a> = (&'a Surface, &'a Fin);

/// The parameters that divide a curve so that each segment is within `chord` of it, and its
/// tangents and the normals of the patches beside it differ by at most `angle`.
pub(super) fn divide(
    edge: &EdgeCurve,
    beside: &[Beside],
    (chord, angle): (f64, f64),
    diagonal: f64,
) -> Result<Vec<f64>, String> {
    // Planes have one normal.
    let beside: Vec<Beside> =
        beside.iter().copied().filter(|(surface, fin)| !surface.is_plane() && fin.curve.is_some()).collect();
    let curve = &edge.curve;
    let [low, high] = edge.range;
    let is_line = matches!(curve, crate::Curve::Line { .. });
    if is_line && beside.is_empty() {
        return Ok(vec![low, high]);
    }
    let mut breaks = vec![low];
    // A range may end beside a knot by rounding.
    let is_near = |a: f64, b: f64| {
        b - a <= 1e-9 * (high - low) || (curve.point(b) - curve.point(a)).norm() <= BENT * diagonal
    };
    for t in curve.breaks(edge.range) {
        if !is_near(breaks[breaks.len() - 1], t) && !is_near(t, high) {
            breaks.push(t);
        }
    }
    breaks.push(high);
    let is_closed = edge.ends[0] == edge.ends[1];
    let pieces = if is_line {
        1
    } else if is_closed {
        4
    } else {
        FEWEST
    };
    let mut out = vec![low];
    // Shorter segments are not divided for their angle: curves may have kinks.
    let shortest = 1e-5 * diagonal;
    for span in breaks.windows(2) {
        // Many spans need no more division each.
        let pieces = if breaks.len() > 8 { 1 } else { pieces };
        let at = |k: usize| span[0] + (span[1] - span[0]) * (k as f64 / pieces as f64);
        for k in 0..pieces {
            let end = if k + 1 == pieces { span[1] } else { at(k + 1) };
            let mut stack = vec![(at(k), end)];
            while let Some((a, b)) = stack.pop() {
                let middle = 0.5 * (a + b);
                if !(a < middle && middle < b) || is_fine(edge, &beside, [a, b], (chord, angle), shortest) {
                    out.push(b);
                } else {
                    stack.extend([(middle, b), (a, middle)]);
                }
                if out.len() + stack.len() > MOST {
                    return Err(format!("more than {MOST} vertices are needed on it"));
                }
            }
        }
    }
    // Files bend the ends of curves to their vertices, which may make hooks.
    out.retain(|&t| is_closed || t == low || t == high || !(is_near(low, t) || is_near(t, high)));
    Ok(without_hooks(edge, out, diagonal))
}

/// The parameters without those beside corners that are off the ends of a curve: from there it
/// would turn sharply to the corner. All stay if none would between the ends: two curves may have
/// the same corners.
pub(super) fn away_from_ends(edge: &EdgeCurve, ends: [Point; 2], at: Vec<f64>, diagonal: f64) -> Vec<f64> {
    let mut far = at.clone();
    for (corner, t) in ends.into_iter().zip(edge.range) {
        let away = |t: f64| (edge.curve.point(t) - corner.coords).norm();
        let gap = away(t);
        if gap > BENT * diagonal {
            far.retain(|&t| edge.range.contains(&t) || away(t) >= FAR * gap);
        }
    }
    if far.len() > 2 { far } else { at }
}

/// The parameters without those on hooks of a curve, where it turns back and soon once more.
///
/// On both sides of a hook as much is left out as it is long: the curve crosses itself there.
fn without_hooks(edge: &EdgeCurve, mut at: Vec<f64>, diagonal: f64) -> Vec<f64> {
    let points: Vec<Vector> = at.iter().map(|&t| edge.curve.point(t)).collect();
    let mut along = vec![0.0];
    for w in points.windows(2) {
        along.push(along[along.len() - 1] + (w[1] - w[0]).norm());
    }
    let length = along[along.len() - 1];
    let turns_back = |w: &[Vector]| {
        let [a, b] = [w[1] - w[0], w[2] - w[1]];
        a.dot(&b) < BACK * a.norm() * b.norm()
    };
    let turns = (1..).zip(points.windows(3)).filter(|(_, w)| turns_back(w)).map(|(k, _)| along[k]);
    let turns: Vec<f64> = turns.collect();
    let hook = |k: usize| {
        let [from, to] = [turns[k], turns[k + 1]];
        let own = to - from;
        let before = if k > 0 { turns[k - 1] } else { 0.0 };
        let after = turns.get(k + 2).copied().unwrap_or(length);
        let is_short = own <= (HOOK[0] * length).min(HOOK[1] * diagonal);
        let is_apart = (from - before).min(after - to) >= APART * own;
        (is_short && is_apart).then_some([from - own, to + own])
    };
    let hooks: Vec<[f64; 2]> = (1..turns.len()).filter_map(|k| hook(k - 1)).collect();
    let mut along = along.into_iter();
    at.retain(|_| {
        let place = along.next().expect("one for each parameter");
        hooks.iter().all(|[from, to]| place <= *from || *to <= place)
    });
    at
}

fn is_fine(
    edge: &EdgeCurve,
    beside: &[Beside],
    [a, b]: [f64; 2],
    (chord, angle): (f64, f64),
    shortest: f64,
) -> bool {
    let [first, last] = [a, b].map(|t| edge.curve.jet(t));
    let along = last[0] - first[0];
    let off = |share: f64| {
        let on = Point::from(edge.curve.point(a + share * (b - a)));
        from_segment(&on, [first[0].into(), last[0].into()])
    };
    let middle = edge.curve.jet(0.5 * (a + b))[1];
    let turn = first[1].angle(&middle) + middle.angle(&last[1]);
    let is_short = along.norm() < shortest;
    let is_straight = is_short || turn <= angle;
    let is_flat = |beside: &Beside| {
        // Poles have no normal.
        let normals = [a, 0.5 * (a + b), b].into_iter().filter_map(|t| normal(edge, *beside, t));
        let normals: Vec<Vector> = normals.collect();
        normals.windows(2).map(|n| n[0].angle(&n[1])).sum::<f64>() <= angle
    };
    // Beside poles, straight lines in the parameters bend in space: vertices inside of a patch
    // would be beyond the edge.
    let follows = |&(surface, fin): &Beside| {
        let Some(own) = fin.curve.as_ref().filter(|_| along.norm() > LONG * shortest) else { return true };
        let [p, q] = [a, b].map(|t| own.point(fin.parameter(t, edge.range)));
        let between = surface.point((0.5 * (p + q)).into());
        (between.coords - edge.curve.point(0.5 * (a + b))).norm() <= STRAY * along.norm()
    };
    is_straight
        && (is_short || beside.iter().all(|beside| is_flat(beside) && follows(beside)))
        && [0.25, 0.5, 0.75].into_iter().all(|share| off(share) <= chord)
}

/// The normal of a surface at a point of one of its sides, if it has one there.
fn normal(edge: &EdgeCurve, (surface, fin): Beside, t: f64) -> Option<Vector> {
    let [u, v]: [f64; 2] = fin.curve.as_ref()?.point(fin.parameter(t, edge.range)).into();
    surface.jet(u, v, 1).normal()
}

/// The diagonal of the box around corners, samples of curves and other points; not 0.
///
/// Corners so far from all else that no part of the model reaches there are faults of the file.
pub(crate) fn diagonal(corners: &[Corner], curves: &[EdgeCurve], others: Vec<Point>) -> f64 {
    let mut points = others;
    for edge in curves {
        let [low, high] = edge.range;
        points.extend((1..8).map(|k| Point::from(edge.curve.point(low + (high - low) * f64::from(k) / 8.0))));
    }
    let extents = |points: &[Point]| {
        let of_axis = |axis: usize| {
            let widen = |[low, high]: [f64; 2], p: &Point| [low.min(p[axis]), high.max(p[axis])];
            points.iter().fold([f64::INFINITY, f64::NEG_INFINITY], widen)
        };
        [0, 1, 2].map(of_axis)
    };
    let length = |extents: &[[f64; 2]; 3]| {
        extents.iter().map(|[low, high]| (high - low) * (high - low)).sum::<f64>().sqrt()
    };
    let around = extents(&points);
    let (is_first, reach) = (points.is_empty(), length(&around));
    let is_near = |p: &Point| {
        (0..3).all(|axis| around[axis][0] - reach <= p[axis] && p[axis] <= around[axis][1] + reach)
    };
    points.extend(corners.iter().map(|corner| corner.point).filter(|p| is_first || is_near(p)));
    length(&extents(&points)).max(f64::MIN_POSITIVE)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bspline::{Basis, SplineCurve};
    use crate::{Curve, Surface};

    /// A polyline over [0, 1].
    fn polyline(points: &[[f64; 2]]) -> EdgeCurve {
        let last = points.len() - 1;
        let knots: Vec<f64> = (0..=last).map(|k| k as f64 / last as f64).collect();
        let basis = Basis::clamped(1, &knots, 1).unwrap();
        let poles = points.iter().map(|&[x, y]| Vector::new(x, y, 0.0)).collect();
        let curve = Curve::Spline(SplineCurve { basis, poles, weights: Vec::new() });
        EdgeCurve { curve, range: [0.0, 1.0], ends: [0, 1], tolerance: 1e-9 }
    }

    #[test]
    fn no_vertices_are_beside_corners_off_the_ends_of_a_curve() {
        let edge = polyline(&[[0.0, 0.0], [0.03, 0.0], [0.05, 0.0], [1.0, 0.0], [1.97, 0.0], [2.0, 0.0]]);
        let off = |gap: f64| {
            let ends = [Point::new(0.0, gap, 0.0), Point::new(2.0, 0.0, 0.0)];
            away_from_ends(&edge, ends, (0..=5).map(|k| f64::from(k) / 5.0).collect(), 2.0)
        };
        assert_eq!(off(0.01), [0.0, 0.4, 0.6, 0.8, 1.0]);
        // So little is rounding, and so much leaves none.
        assert_eq!([1e-6, 1.0].map(|gap| off(gap).len()), [6, 6]);
    }

    #[test]
    fn no_vertices_are_beside_the_ends_of_a_curve_with_hooks() {
        let hooked = [
            [0.0, 0.0],
            [-5e-7, 3e-7],
            [1e-7, 8e-7],
            [1.0, 0.0],
            [2.0, 1.0],
            [2.0 + 4e-7, 1.0],
            [2.0, 1.0 - 4e-7],
        ];
        let plane = Surface::Plane { origin: Vector::zeros(), axes: [Vector::x(), Vector::y()] };
        let edge = polyline(&hooked);
        let fin = Fin { on: crate::On::Curve(0), curve: None, range: edge.range, is_forward: true };
        let found = divide(&edge, &[(&plane, &fin)], (1e-9, 0.1), 2.0).unwrap();
        let inner = &found[1..found.len() - 1];
        assert!(inner.iter().any(|t| (t - 0.5).abs() < 1e-12), "{found:?}");
        let end = |t: f64| [0.0, 1.0].map(|e| (edge.curve.point(t) - edge.curve.point(e)).norm());
        assert!(inner.iter().all(|&t| end(t).iter().all(|off| *off > 2e-6)), "{found:?}");
    }

    #[test]
    fn no_vertices_are_on_hooks_of_a_curve_but_on_teeth_and_wide_bends() {
        let plane = Surface::Plane { origin: Vector::zeros(), axes: [Vector::x(), Vector::y()] };
        let found = |points: &[[f64; 2]]| {
            let edge = polyline(points);
            let fin = Fin { on: crate::On::Curve(0), curve: None, range: edge.range, is_forward: true };
            divide(&edge, &[(&plane, &fin)], (1e-9, 0.1), 2.0).unwrap()
        };
        let bent = |by: f64| [[0.0, 0.0], [1.0, 0.0], [1.0 - by, by], [2.0, by]];
        // Its ends, and no other corner of the polyline.
        let is_corner = |t: &&f64| [1.0 / 3.0, 2.0 / 3.0].iter().any(|corner| (*t - corner).abs() < 1e-12);
        let corners = |by: f64| found(&bent(by)).iter().filter(is_corner).count();
        assert_eq!([1e-3, 1e-2, 0.1].map(corners), [0, 2, 2]);

        let tooth = |k: usize| [2e-3 * k as f64, if k.is_multiple_of(2) { 0.0 } else { 5e-3 }];
        let teeth: Vec<[f64; 2]> = (0..=400).map(tooth).collect();
        assert!(found(&teeth).len() > 400);
    }
}
