//! Edges followed across a surface.

use super::{Chart, Parameters, Side};
use crate::model::{AWAY, EdgeCurve, On};
use crate::{BrepError, Point};
use nalgebra::{Matrix2, Vector2};

/// A loop in the parameters of its surface.
#[derive(Clone, Debug)]
pub(crate) struct Loop {
    pub sides: Vec<Side>,
    /// How often it goes around in each direction.
    pub drift: [i32; 2],
    /// The largest distance of its edges from the surface (length).
    pub gap: f64,
}

/// The first step, as a fraction of the edge.
const FIRST_STEP: f64 = 1.0 / 16.0;
/// Steps that may end at another foot of an edge than the one beside the last, as a fraction of it.
const LONG_STEP: f64 = 1.0 / 256.0;
/// The smallest step, as a fraction of the edge.
const SMALLEST_STEP: f64 = 1e-7;
/// The largest distance of the middle of a step from the edge, as a fraction of the step.
const OFF: f64 = 0.02;
/// The same, as a fraction of the diagonal: shorter distances are rounding.
const ROUNDING: f64 = 1e-9;

/// Each step of an edge is divided into so many parts where crossings count.
const BETWEEN: u32 = 16;
/// The most nodes of an edge.
const MOST_NODES: usize = 20_000;

/// Where an edge leaves its surface.
struct Lost {
    place: Point,
    /// Its distance there; `None` if it is on the surface, but its parameters jump.
    off: Option<f64>,
}

/// Nodes of an edge and their largest distance from it.
type Way = (Vec<(f64, Parameters)>, f64);

impl Chart<'_> {
    /// Follows the edges of a loop, each with whether it is used forward.
    ///
    /// # Errors
    /// [`BrepError::Face`] with the place of an edge that is not on the surface, or that does not
    /// lead back to the start.
    pub fn follow(
        &self,
        face: usize,
        curves: &[EdgeCurve],
        edges: &[(usize, bool)],
    ) -> Result<Loop, BrepError> {
        let count = edges.len();
        // The two sides of a seam cannot be told apart at the start.
        let is_seam = |k: usize| edges.iter().filter(|edge| edge.0 == edges[k].0).count() > 1;
        let first = (0..count).find(|&k| !is_seam(k)).unwrap_or(0);
        let mut sides: Vec<Side> = Vec::new();
        let mut gap: f64 = 0.0;
        let mut at: Option<Parameters> = None;
        for k in 0..count {
            let (number, is_forward) = edges[(first + k) % count];
            let edge = &curves[number];
            let ends = if is_forward { edge.range } else { [edge.range[1], edge.range[0]] };
            let pole = at.and_then(|p| self.pole_at(p)).filter(|_| k > 0);
            let (nodes, off) = match at {
                Some(at) if pole.is_none() => self.walk(edge, ends, self.near(&point(edge, ends[0]), at)),
                _ => self.walk_both_ways(edge, ends),
            }
            .map_err(|Lost { place, off }| {
                let what = match off {
                    Some(off) => format!("edge {} is {off:.3e} away from it", number + 1),
                    None => format!("edge {} cannot be followed in its parameters", number + 1),
                };
                BrepError::face(face, what, Some(place))
            })?;
            gap = gap.max(off);
            let mut side = Side { on: On::Curve(number), is_forward, nodes };
            if let (Some(at), Some(direction)) = (at, pole) {
                side.shift(self.across_pole(direction, &sides[sides.len() - 1], side.start()));
                let corner = edge.ends[usize::from(!is_forward)];
                sides.push(Side::at_corner(corner, at, side.start()));
            }
            at = Some(side.end());
            sides.push(side);
        }
        self.closed(face, curves, sides, gap)
    }

    /// Parameters along an edge on the surface, closer than a straight line in them needs; `None`
    /// if it leaves the surface, or passes through a pole.
    pub fn along(&self, edge: &EdgeCurve) -> Option<Vec<Parameters>> {
        let (nodes, _) = self.walk_both_ways(edge, edge.range).ok()?;
        let mut out = vec![nodes[0].1];
        for w in nodes.windows(2) {
            let [(t, p), (u, q)] = [w[0], w[1]];
            for k in 1..BETWEEN {
                let share = f64::from(k) / f64::from(BETWEEN);
                let guess = [0, 1].map(|i| p[i] + share * (q[i] - p[i]));
                out.push(self.near(&point(edge, t + share * (u - t)), guess));
            }
            out.push(q);
        }
        out.iter().all(|&p| self.pole_at(p).is_none()).then_some(out)
    }

    /// Closes a loop at its start.
    fn closed(
        &self,
        face: usize,
        curves: &[EdgeCurve],
        mut sides: Vec<Side>,
        gap: f64,
    ) -> Result<Loop, BrepError> {
        let last = &sides[sides.len() - 1];
        let (end, start) = (last.end(), sides[0].start());
        let is_edge =
            sides.len() > 1 || matches!(last.on, On::Curve(c) if curves[c].ends[0] == curves[c].ends[1]);
        if let Some(direction) = self.pole_at(end).filter(|_| is_edge)
            && (end[direction] - start[direction]).abs() > 1e-9
        {
            let by = self.across_pole(direction, last, start);
            let to = [start[0] + by[0], start[1] + by[1]];
            if let On::Curve(curve) = last.on {
                let corner = curves[curve].ends[usize::from(last.is_forward)];
                sides.push(Side::at_corner(corner, end, to));
            }
        }
        let end = sides[sides.len() - 1].end();
        let drift = [0, 1].map(|i| match self.periods[i] {
            Some(period) => ((end[i] - start[i]) / period).round() as i32,
            None => 0,
        });
        let back = self.shifted(start, drift);
        let [from, to] = [end, back].map(|p| self.surface.point(p));
        if (to - from).norm() > AWAY * self.diagonal {
            return Err(BrepError::face(face, "its edges do not form closed loops", Some(from)));
        }
        Ok(Loop { sides, drift, gap })
    }

    /// Parameters moved by multiples of the periods.
    pub fn shifted(&self, p: Parameters, by: [i32; 2]) -> Parameters {
        [0, 1].map(|i| p[i] + f64::from(by[i]) * self.periods[i].unwrap_or(0.0))
    }

    /// The multiple of the period to add to `next`, so that a loop counterclockwise around its face
    /// goes the right way from the end of `last` along a pole.
    fn across_pole(&self, direction: usize, last: &Side, next: Parameters) -> Parameters {
        let mut by = [0.0; 2];
        let Some(period) = self.periods[direction] else { return by };
        let end = last.end();
        let before = last.nodes[last.nodes.len().saturating_sub(2)].1;
        let is_upper = before[1 - direction] < end[1 - direction];
        // With the face to the left, the upper side is followed down in u, the right one up in v.
        let sign = if is_upper == (direction == 0) { -1.0 } else { 1.0 };
        let way = ((next[direction] - end[direction]) * sign).rem_euclid(period);
        // The same angle: all the way around.
        let way = if way < 1e-6 * period { period } else { way };
        by[direction] = end[direction] + sign * way - next[direction];
        by
    }

    /// Follows an edge from its middle to both ends.
    fn walk_both_ways(&self, edge: &EdgeCurve, [first, last]: [f64; 2]) -> Result<Way, Lost> {
        let middle = 0.5 * (first + last);
        let at = self.anywhere(&point(edge, middle));
        let (mut nodes, before) = self.walk(edge, [middle, first], at)?;
        let (after, off) = self.walk(edge, [middle, last], at)?;
        nodes.reverse();
        nodes.extend(after.into_iter().skip(1));
        Ok((nodes, before.max(off)))
    }

    /// Follows an edge between two parameters.
    ///
    /// # Errors
    /// The place where the edge leaves the surface, and its distance there.
    fn walk(&self, edge: &EdgeCurve, [from, to]: [f64; 2], start: Parameters) -> Result<Way, Lost> {
        let whole = to - from;
        let mut nodes = vec![(from, start)];
        let mut gap = (self.surface.point(start) - point(edge, from)).norm();
        let (mut t, mut at, mut step) = (from, start, FIRST_STEP);
        while t != to {
            let next = if (to - t).abs() <= 1.001 * step * whole.abs() { to } else { t + step * whole };
            let place = point(edge, next);
            let found = self.near(&place, self.ahead(edge, t, at, next - t));
            let off = (self.surface.point(found) - place).norm();
            let chord = (place - point(edge, t)).norm();
            let middle = self.surface.point([0, 1].map(|i| 0.5 * (at[i] + found[i])));
            let bend = (middle - point(edge, 0.5 * (t + next))).norm();
            let little = OFF * chord + ROUNDING * self.diagonal;
            // Beyond their knots splines continue, and a long step may end at a foot there. After a
            // short one the foot is beside the one before, and further off only as the edge is.
            let is_near = || step < LONG_STEP || off <= gap + little || off <= 2.0 * self.distance(&place);
            let is_good = bend <= off.max(gap) + little && is_near();
            if is_good || step < SMALLEST_STEP {
                if off > AWAY * self.diagonal {
                    return Err(Lost { place, off: Some(off) });
                }
                if nodes.len() > MOST_NODES {
                    return Err(Lost { place, off: None });
                }
                gap = gap.max(off);
                nodes.push((next, found));
                (t, at) = (next, found);
                step *= 1.7;
            } else {
                step *= 0.5;
            }
        }
        if gap > AWAY * self.diagonal {
            return Err(Lost { place: point(edge, from), off: Some(gap) });
        }
        if let Some(last) = nodes.last_mut() {
            last.1 = self.on_pole(last.1);
        }
        Ok((nodes, gap))
    }

    /// Parameters at a pole, without rounding: all sides that end there have the same point.
    fn on_pole(&self, mut at: Parameters) -> Parameters {
        if let Some(direction) = self.pole_at(at) {
            let across = 1 - direction;
            let poles = [false, true].map(|is_upper| self.surface.pole(across, is_upper, self.least()));
            let nearest = poles
                .into_iter()
                .flatten()
                .min_by(|a, b| (a - at[across]).abs().total_cmp(&(b - at[across]).abs()));
            at[across] = nearest.unwrap_or(at[across]);
        }
        at
    }

    /// The parameters after a step, by the tangent of the edge in the tangent plane.
    fn ahead(&self, edge: &EdgeCurve, t: f64, at: Parameters, step: f64) -> Parameters {
        let d = self.surface.jet(at[0], at[1], 1).d;
        let (a, b) = (d[1][0], d[0][1]);
        let tangent = edge.curve.jet(t)[1] * step;
        let form = Matrix2::new(a.dot(&a), a.dot(&b), a.dot(&b), b.dot(&b));
        let is_regular = form.determinant() > 1e-12 * form[(0, 0)] * form[(1, 1)];
        let moved = form.try_inverse().filter(|_| is_regular).map(|inverse| {
            let way = inverse * Vector2::new(a.dot(&tangent), b.dot(&tangent));
            [at[0] + way.x, at[1] + way.y]
        });
        moved.filter(|p| p.iter().all(|x| x.is_finite())).unwrap_or(at)
    }
}

fn point(edge: &EdgeCurve, t: f64) -> Point {
    Point::from(edge.curve.point(t))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bspline::{Basis, SplineCurve};
    use crate::project::project_to_surface;
    use crate::{Curve, Surface, Vector};
    use std::f64::consts::TAU;

    /// A spline over [0, 1] with these knots and poles.
    fn spline(degree: usize, knots: &[f64], poles: Vec<Vector>) -> Curve<3> {
        let basis = Basis::clamped(degree, knots, 1).unwrap();
        Curve::Spline(SplineCurve { basis, poles, weights: Vec::new() })
    }

    /// The wall above a part of a circle: above most of it, its extrapolation passes its start.
    fn wall(share: f64) -> (Curve<3>, Surface) {
        let pole = |k: usize| {
            let (sine, cosine) = (share * TAU * k as f64 / 9.0).sin_cos();
            Vector::new(cosine, sine, 0.0)
        };
        let knots: Vec<f64> = (0..8).map(|k| f64::from(k) / 7.0).collect();
        let curve = spline(3, &knots, (0..10).map(pole).collect());
        (curve.clone(), Surface::Extrusion { curve, direction: Vector::z() })
    }

    #[test]
    fn fast_edges_at_the_end_of_an_open_surface_are_followed_inside_of_it() {
        let (around, wall) = wall(0.9);
        // The edge runs along the wall, ever faster toward its ends.
        const STEPS: usize = 400;
        let shares: Vec<f64> = (0..=STEPS).map(|k| k as f64 / STEPS as f64).collect();
        let points: Vec<Vector> = shares.iter().map(|&u| around.point(u)).collect();
        let slow = |u: f64| {
            0.5 + 0.5 * (2.0 * u - 1.0).signum() * (1.0 - (1.0 - (2.0 * u - 1.0).abs()).powf(0.25)).powi(4)
        };
        let mut knots: Vec<f64> = shares.iter().map(|&u| slow(u)).collect();
        knots.dedup();
        assert_eq!(knots.len(), points.len());
        let edge =
            EdgeCurve { curve: spline(1, &knots, points), range: [0.0, 1.0], ends: [0, 1], tolerance: 0.0 };
        let chart = Chart::new(&wall, 2.0);
        for range in [[0.0, 1.0], [1.0, 0.0]] {
            let start = if range[0] == 0.0 { [0.0, 0.0] } else { [1.0, 0.0] };
            let Ok((nodes, gap)) = chart.walk(&edge, range, start) else { panic!("lost from {start:?}") };
            assert!(gap < 1e-3, "{gap}");
            assert!(nodes.iter().all(|node| (-0.01..=1.01).contains(&node.1[0])), "{nodes:?}");
        }
    }

    #[test]
    fn an_edge_beyond_the_end_of_a_small_surface_is_followed_along_that() {
        // From inside to a tenth of the surface beyond its end.
        let (around, wall) = wall(0.25);
        let at = |k: u32| {
            let share = f64::from(k) / 16.0;
            around.point(0.9 + 0.2 * share) + Vector::z() * share
        };
        let points: Vec<Vector> = (0..=16).map(at).collect();
        let knots: Vec<f64> = (0..=16).map(|k| f64::from(k) / 16.0).collect();
        let edge =
            EdgeCurve { curve: spline(1, &knots, points), range: [0.0, 1.0], ends: [0, 1], tolerance: 0.0 };
        // So little is the accuracy of a large model.
        let Ok((nodes, gap)) = Chart::new(&wall, 1e4).walk(&edge, [0.0, 1.0], [0.9, 0.0]) else {
            panic!("lost")
        };
        let beyond = (point(&edge, 1.0).coords - around.point(1.0) - Vector::z()).norm();
        assert!(gap <= 1.01 * beyond, "{gap}, {beyond}");
        assert!(nodes.len() < 2_000 && nodes[nodes.len() - 1].1[0] >= 1.0, "{}", nodes.len());
    }

    #[test]
    fn a_point_at_the_end_of_a_surface_is_not_found_across_a_slit() {
        let (around, wall) = wall(0.9999);
        let end = Point::from(around.point(1.0) + 0.5 * Vector::z());
        let across = project_to_surface(&wall, &end, [-1e-4, 0.5]);
        assert!(across.parameters[0] < 0.0 && (across.point - end).norm() < 1e-3, "{across:?}");
        // Beside a large model that is nothing.
        let [u, _] = Chart::new(&wall, 1e3).anywhere(&across.point);
        assert!((0.99..=1.0).contains(&u), "{u}");
    }
}
