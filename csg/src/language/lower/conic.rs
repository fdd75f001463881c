//! Segments of curves: lines, and rational quadratic curves, which are arcs of ellipses.
//!
//! For the control points p, q, r, the weight of q (in the basis 2t(1 - t)) is
//! w = |pr| / √(2(|pq|² + |qr|²)). It is less than 1 unless the points are collinear with q in the
//! middle, so parabolas and hyperbolas do not occur.

use crate::Vector;
use crate::primitive::Ellipse;

/// A segment. In plane curves, z is zero.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Piece {
    Line([Vector; 2]),
    Arc(Arc),
}

/// An arc of an ellipse, less than half a turn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Arc {
    /// The end points, and between them the control point, where the end tangents intersect.
    pub points: [Vector; 3],
    /// The weight of the control point.
    weight: f64,
}

/// A control triangle whose height is below this fraction of its longest side is flat: the arc is a
/// line.
const FLAT: f64 = 1e-9;

impl Piece {
    /// The segment with the given control points.
    pub fn new(points: &[Vector]) -> Self {
        match *points {
            [p, q, r] => {
                let longest = (r - p).norm().max((q - p).norm()).max((r - q).norm());
                let is_flat = (q - p).cross(&(r - q)).norm() <= FLAT * longest * longest;
                // If the control point is beyond an end of the line, the curve would run back.
                let is_between = (q - p).dot(&(r - q)) >= 0.0;
                if is_flat && is_between { Self::Line([p, r]) } else { Self::Arc(Arc::new([p, q, r])) }
            }
            _ => Self::Line([points[0], points[points.len() - 1]]),
        }
    }

    pub fn ends(&self) -> [Vector; 2] {
        match *self {
            Self::Line(ends) => ends,
            Self::Arc(arc) => arc.ends(),
        }
    }

    pub fn reversed(&self) -> Self {
        match *self {
            Self::Line([p, q]) => Self::Line([q, p]),
            Self::Arc(arc) => Self::Arc(arc.reversed()),
        }
    }

    /// The directions at the start and the end, not normalized.
    pub fn tangents(&self) -> [Vector; 2] {
        match *self {
            Self::Line([p, q]) => [q - p; 2],
            Self::Arc(Arc { points: [p, q, r], .. }) => [q - p, r - q],
        }
    }

    /// The control points.
    pub fn control(&self) -> Vec<Vector> {
        match *self {
            Self::Line(ends) => ends.to_vec(),
            Self::Arc(arc) => arc.points.to_vec(),
        }
    }
}

impl Arc {
    fn new([p, q, r]: [Vector; 3]) -> Self {
        let weight = (r - p).norm() / (2.0 * ((q - p).norm_squared() + (r - q).norm_squared())).sqrt();
        Self { points: [p, q, r], weight }
    }

    pub fn ends(&self) -> [Vector; 2] {
        [self.points[0], self.points[2]]
    }

    pub fn reversed(&self) -> Self {
        let [p, q, r] = self.points;
        Self { points: [r, q, p], ..*self }
    }

    /// Splits the arc at t = 1/2 by De Casteljau's algorithm in homogeneous coordinates.
    pub fn halves(&self) -> [Self; 2] {
        let Self { points: [p, q, r], weight } = *self;
        let (a, b) = ((p + q * weight) / (1.0 + weight), (q * weight + r) / (1.0 + weight));
        let middle = (a + b) * 0.5;
        let weight = (0.5 * (1.0 + weight)).sqrt();
        [Self { points: [p, a, middle], weight }, Self { points: [middle, b, r], weight }]
    }

    /// The point at t = 1/2.
    pub fn middle(&self) -> Vector {
        let Self { points: [p, q, r], weight } = self;
        ((p + r) * 0.5 + q * *weight) / (1.0 + weight)
    }
}

/// An ellipse in space: its center and its two semi-axis vectors.
pub(super) struct SpaceEllipse {
    pub center: Vector,
    pub arms: [Vector; 2],
}

/// Largest relative difference of the semi-axes of a circle; coordinates have six digits or more.
const ROUND: f64 = 1e-6;

impl SpaceEllipse {
    /// The ellipse of an arc; an exact circle if the semi-axes agree up to rounded decimals.
    pub fn of(arc: &Arc) -> Self {
        let Arc { points: [p, q, r], weight } = *arc;
        let square = weight * weight;
        let center = (p + r - q * (2.0 * square)) / (2.0 * (1.0 - square));
        // Conjugate semi-diameters: to the shoulder of the arc, and along its chord.
        let (u, v) = (arc.middle() - center, (r - p) * (0.5 / (1.0 - square).sqrt()));
        let (mixed, difference) = (2.0 * u.dot(&v), u.norm_squared() - v.norm_squared());
        if mixed.hypot(difference) <= ROUND * (u.norm_squared() + v.norm_squared()) {
            let radius = 0.5 * ((p - center).norm() + (r - center).norm());
            let first = u.normalize();
            let second = (v - first * first.dot(&v)).normalize();
            return Self { center, arms: [first * radius, second * radius] };
        }
        let (sin, cos) = (0.5 * mixed.atan2(difference)).sin_cos();
        Self { center, arms: [u * cos + v * sin, v * cos - u * sin] }
    }

    /// The radius if it is a circle.
    pub fn radius(&self) -> Option<f64> {
        let [a, b] = self.arms.map(|arm| arm.norm());
        ((a - b).abs() <= ROUND * a.max(b)).then_some(a)
    }

    /// The same ellipse in the xy-plane.
    pub fn flat(&self) -> Ellipse {
        let [a, b] = self.arms;
        let length = a.norm();
        let radii = if self.radius().is_some() { [length; 2] } else { [length, b.norm()] };
        Ellipse { center: [self.center.x, self.center.y], axis: [a.x / length, a.y / length], radii }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn v(x: f64, y: f64) -> Vector {
        Vector::new(x, y, 0.0)
    }

    #[test]
    fn points_of_the_rational_curve_are_on_its_ellipse() {
        for points in [
            [v(0., 0.), v(1., 3.), v(4., 1.)],
            [v(1., 0.), v(1., 1.), v(0., 1.)],
            [v(0., 0.), v(1., 0.1), v(2., 0.)],
        ] {
            let arc = Arc::new(points);
            let ellipse = SpaceEllipse::of(&arc).flat();
            let ([p, q, r], weight) = (arc.points, arc.weight);
            for i in 0..=10 {
                let t = f64::from(i) / 10.0;
                let [b, c, d] = [(1.0 - t) * (1.0 - t), 2.0 * weight * t * (1.0 - t), t * t];
                let x = (p * b + q * c + r * d) / (b + c + d);
                assert!(ellipse.value([x.x, x.y]).abs() < 1e-12, "{points:?} at {t}");
            }
            let [first, second] = arc.halves();
            assert_eq!(first.points[2], second.points[0]);
            let parts = [first, second].map(|half| SpaceEllipse::of(&half).flat());
            for part in &parts {
                assert!(
                    (part.center[0] - ellipse.center[0]).hypot(part.center[1] - ellipse.center[1]) < 1e-12
                );
            }
            let first = first.points;
            assert!(ellipse.value([first[2].x, first[2].y]).abs() < 1e-12);
            // Check the tangent at the point where the halves meet.
            let [gx, gy] = ellipse.gradient([first[2].x, first[2].y]);
            assert!(v(gx, gy).dot(&(first[1] - first[2])).abs() < 1e-12);
        }
    }

    #[test]
    fn end_tangents_of_equal_length_give_a_circle() {
        let arc = SpaceEllipse::of(&Arc::new([
            Vector::zeros(),
            Vector::new(10., 0., 5.),
            Vector::new(10., 10., 10.),
        ]));
        assert!(arc.radius().is_some_and(|r| (r - (arc.center).norm()).abs() < 1e-9));
        assert!(SpaceEllipse::of(&Arc::new([v(0., 0.), v(1., 0.), v(1., 2.)])).radius().is_none());
    }
}
