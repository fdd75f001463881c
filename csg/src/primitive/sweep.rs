//! The surface swept by a line or an ellipse along an elliptic or circular path.
//!
//! At the angle θ of the path's normal, the perpendicular plane is spanned by the outward direction
//! e and the axis n. The section's y axis is the projection of the fixed vector `up` to that plane:
//! (cos ψ, sin ψ) in the directions n and e, with tan ψ = up·e / up·n. So (X, Y) = (q cos ψ - z sin
//! ψ, q sin ψ + z cos ψ), with q the distance from the path in its plane (see [`elliptic_path`])
//! and z the height. The implicit function is that of the section, g(X, Y). It is not smooth at
//! points with several nearest points on the path.

use super::quadric::{largest_curvature, reject};
use super::{Ellipse, Primitive, Section, Sweep, direction_range, elliptic_path, reject_range};
use crate::interval::{Cell, Interval, dot, middle, offset};
use crate::{Point, ProjectionFailed, Vector};
use nalgebra::{Isometry3, Matrix3, Matrix4, Vector4};

impl Section {
    fn value(&self, [x, y]: [f64; 2]) -> f64 {
        match self {
            Self::Line { normal, offset } => normal[0] * x + normal[1] * y - offset,
            Self::Ellipse(e) => e.value([x, y]),
        }
    }

    pub(crate) fn gradient(&self, at: [f64; 2]) -> [f64; 2] {
        match self {
            Self::Line { normal, .. } => *normal,
            Self::Ellipse(e) => e.gradient(at),
        }
    }

    /// The second derivatives (xx, xy, yy).
    pub(crate) fn hessian(&self) -> [f64; 3] {
        match self {
            Self::Line { .. } => [0.0; 3],
            Self::Ellipse(e) => e.hessian(),
        }
    }

    pub(crate) fn value_range(&self, [x, y]: [Interval; 2]) -> Interval {
        match self {
            Self::Line { normal, offset } => x * normal[0] + y * normal[1] - Interval::point(*offset),
            Self::Ellipse(e) => e.value_range([x, y]),
        }
    }

    fn gradient_range(&self, at: [Interval; 2]) -> [Interval; 2] {
        match self {
            Self::Line { normal, .. } => normal.map(Interval::point),
            Self::Ellipse(e) => e.gradient_range(at),
        }
    }

    fn nearest(&self, at: [f64; 2]) -> [f64; 2] {
        match self {
            Self::Line { normal, .. } => {
                let lack = self.value(at);
                [at[0] - normal[0] * lack, at[1] - normal[1] * lack]
            }
            Self::Ellipse(e) => e.nearest(at),
        }
    }
}

/// The plane perpendicular to the path through a point, and the coordinates of the point.
struct SectionFrame {
    /// Unit directions outward from and along the path.
    outward: Vector,
    along: Vector,
    /// Distance from the path's center of curvature, and the derivative of the radius of curvature
    /// with respect to θ.
    distance: f64,
    growth: f64,
    /// cos ψ, sin ψ, and the first two derivatives of ψ with respect to θ.
    cos: f64,
    sin: f64,
    turns: [f64; 2],
    /// The coordinates (X, Y) in the section.
    at: [f64; 2],
}

impl Sweep {
    /// Whether the path is a circle.
    pub fn is_round(&self) -> bool {
        self.radii[0] == self.radii[1]
    }

    /// The largest distance of the path from its center.
    pub(crate) fn reach(&self) -> f64 {
        self.radii[0].max(self.radii[1])
    }

    /// The path's least radius of curvature.
    pub(crate) fn least_curvature_radius(&self) -> f64 {
        elliptic_path::least_curvature_radius(self.radii)
    }

    fn section_frame(&self, point: &Point) -> SectionFrame {
        let arm = point - self.center;
        let (outward, q, distance, growth);
        if self.is_round() {
            let across = reject(&arm, &self.axis);
            (distance, growth) = (across.norm(), 0.0);
            (outward, q) = (across.try_normalize(0.0).unwrap_or_default(), distance - self.radii[0]);
        } else {
            let side = self.axis.cross(&self.start);
            let seen = elliptic_path::foot(self.radii, [arm.dot(&self.start), arm.dot(&side)]);
            let [radius, change] = seen.curvature_radius;
            outward = self.start * seen.normal[0] + side * seen.normal[1];
            (q, distance, growth) = (seen.distance, radius + seen.distance, change);
        }
        let z = arm.dot(&self.axis);
        let mut found = self.frame(outward);
        (found.distance, found.growth) = (distance, growth);
        found.at = [found.cos * q - found.sin * z, found.sin * q + found.cos * z];
        found
    }

    fn frame(&self, outward: Vector) -> SectionFrame {
        let along = self.axis.cross(&outward);
        let [d, t, n] = [outward, along, self.axis].map(|v| self.up.dot(&v));
        let square = d * d + n * n;
        let length = square.sqrt();
        let turns = [t * n / square, -n * d * (square + 2.0 * t * t) / (square * square)];
        SectionFrame {
            outward,
            along,
            distance: 0.0,
            growth: 0.0,
            cos: n / length,
            sin: d / length,
            turns,
            at: [0.0; 2],
        }
    }

    /// The path parameter of the nearest path point, in [-π, π] from `start`, and the coordinates
    /// in the section.
    pub fn coordinates(&self, point: &Point) -> (f64, [f64; 2]) {
        let found = self.section_frame(point);
        let normal = [self.start, self.axis.cross(&self.start)].map(|v| found.outward.dot(&v));
        (elliptic_path::angle_of(self.radii, normal), found.at)
    }

    /// The point with the given path parameter and section coordinates.
    pub fn place(&self, angle: f64, [x, y]: [f64; 2]) -> Point {
        let side = self.axis.cross(&self.start);
        let along = |[p, q]: [f64; 2]| self.start * p + side * q;
        let outward = along(elliptic_path::normal_at(self.radii, angle));
        let (sin, cos) = angle.sin_cos();
        let frame = self.frame(outward);
        let [q, z] = [frame.cos * x + frame.sin * y, frame.cos * y - frame.sin * x];
        self.center + along([self.radii[0] * cos, self.radii[1] * sin]) + outward * q + self.axis * z
    }

    /// The ranges over a box of all quantities of a section frame, and of (q, z).
    fn ranges(&self, cell: &Cell) -> Ranges {
        let arm = offset(cell, &self.center);
        let (outward, distance, q) = if self.is_round() {
            let (outward, distance) = direction_range(&reject_range(&arm, &self.axis));
            (outward, distance, distance - Interval::point(self.radii[0]))
        } else {
            self.ranges_beside(cell)
        };
        let [a, b, c] = [self.axis.x, self.axis.y, self.axis.z];
        let [x, y, z] = outward;
        let along = [z * b - y * c, x * c - z * a, y * a - x * b];
        let n = Interval::point(self.up.dot(&self.axis));
        let (d, t) = (dot(&self.up, &outward), dot(&self.up, &along));
        let square = d.square() + n.square();
        let unit = Interval::new(-1.0, 1.0);
        let [cos, sin] = [n, d].map(|v| (v / square.sqrt()).intersect(unit));
        let z = dot(&self.axis, &arm);
        let at = [q * cos - z * sin, q * sin + z * cos];
        Ranges { outward, distance, along, cos, sin, turn: t * n / square, across: [q, z], at }
    }

    /// The ranges of the outward direction, the distance from the center of curvature, and q, for
    /// an elliptic path.
    fn ranges_beside(&self, cell: &Cell) -> (Cell, Interval, Interval) {
        let side = self.axis.cross(&self.start);
        let center = middle(cell);
        let arm = center - self.center;
        let at = [arm.dot(&self.start), arm.dot(&side)];
        let reach = 0.5 * cell.iter().map(|side| side.width().powi(2)).sum::<f64>().sqrt();
        let ([c, s], distance) = elliptic_path::ranges(self.radii, at, reach);
        let outward = [0, 1, 2].map(|i| c * self.start[i] + s * side[i]);
        // The gradient of the distance from the path is the normal.
        let rounding = 16.0 * f64::EPSILON * (self.reach() + arm.norm() + reach);
        let seen = elliptic_path::foot(self.radii, at).distance;
        let seen = Interval::new(seen - rounding, seen + rounding);
        let way = offset(cell, &center);
        let q = seen + c * dot(&self.start, &way) + s * dot(&side, &way);
        (outward, distance, q.intersect(seen + Interval::new(-reach, reach)))
    }

    /// Whether another sweep has the same path and the same frame.
    pub(crate) fn is_along(&self, other: &Self) -> bool {
        self.center == other.center
            && self.axis == other.axis
            && self.radii == other.radii
            && (self.is_round() || self.start == other.start)
            && self.up == other.up
    }

    /// The ranges over a box of (X, Y) and of ∇X × ∇Y; the latter is `None` if the box may contain
    /// a center of curvature.
    ///
    /// ∇X × ∇Y is opposite to the direction in which points of the section move.
    pub(crate) fn plane_ranges(&self, cell: &Cell) -> ([Interval; 2], Option<Cell>) {
        let r = self.ranges(cell);
        let [q, z] = r.across;
        // The derivative of a point of the section with respect to θ: along the path, plus the
        // rotation of the section.
        let moved = |i: usize| r.along[i] * r.distance + (r.outward[i] * z - q * self.axis[i]) * r.turn;
        (r.at, (r.distance.lo > 0.0).then(|| [0, 1, 2].map(|i| -moved(i))))
    }
}

/// The ranges of the quantities of a [`SectionFrame`] over a box.
struct Ranges {
    outward: Cell,
    distance: Interval,
    along: Cell,
    cos: Interval,
    sin: Interval,
    turn: Interval,
    /// The distance q from the path in its plane, and the height z.
    across: [Interval; 2],
    at: [Interval; 2],
}

impl Primitive for Sweep {
    fn value(&self, point: &Point) -> f64 {
        self.section.value(self.section_frame(point).at)
    }

    fn gradient(&self, point: &Point) -> Vector {
        let a = self.section_frame(point);
        let [gx, gy] = self.section.gradient(a.at);
        let round =
            if a.distance > 0.0 { a.turns[0] * (gy * a.at[0] - gx * a.at[1]) / a.distance } else { 0.0 };
        a.outward * (gx * a.cos + gy * a.sin) + self.axis * (gy * a.cos - gx * a.sin) + a.along * round
    }

    /// The Hessian by the chain rule in coordinates along the path.
    fn hessian(&self, point: &Point) -> Matrix3<f64> {
        let SectionFrame { outward, along, distance, growth, cos, sin, turns: [turn, bend], at: [x, y] } =
            self.section_frame(point);
        if distance == 0.0 {
            return Matrix3::zeros();
        }
        let ([gx, gy], [xx, xy, yy]) = (self.section.gradient([x, y]), self.section.hessian());
        let form = |[a, b]: [f64; 2], [c, d]: [f64; 2]| xx * a * c + xy * (a * d + b * c) + yy * b * d;
        // Derivatives of (X, Y) with respect to q, z and θ.
        let (by_q, by_z, by_t) = ([cos, sin], [-sin, cos], [-turn * y, turn * x]);
        let slope = |[a, b]: [f64; 2]| gx * a + gy * b;
        let (qq, qz, zz) = (form(by_q, by_q), form(by_q, by_z), form(by_z, by_z));
        let qt = form(by_q, by_t) + turn * slope([-sin, cos]);
        let zt = form(by_z, by_t) - turn * slope([cos, sin]);
        let tt = form(by_t, by_t) + bend * slope([-y, x]) - turn * turn * slope([x, y]);
        let (q, t) = (slope(by_q), slope(by_t));
        let [rt, nt] = [qt / distance - t / (distance * distance), zt / distance];
        let round = tt / (distance * distance) + q / distance - t * growth / distance.powi(3);
        let frame = Matrix3::from_columns(&[outward, along, self.axis]);
        frame * Matrix3::new(qq, rt, qz, rt, round, nt, qz, nt, zz) * frame.transpose()
    }

    fn curvature(&self, point: &Point) -> f64 {
        largest_curvature(&self.gradient(point), &self.hessian(point))
    }

    /// The nearest point if `point` is near the surface; otherwise the nearest one in the
    /// perpendicular plane.
    ///
    /// Starts at the nearest point in the plane perpendicular to the path, and applies Newton's
    /// method to the point x and the multiplier λ in x + λ ∇f(x) = p, f(x) = 0.
    fn project(&self, point: &Point) -> Result<Point, ProjectionFailed> {
        const STEPS: usize = 20;
        /// Largest residual of a solution, relative to the radius.
        const SOLVED: f64 = 1e-10;
        let (angle, at) = self.coordinates(point);
        let across = self.place(angle, self.section.nearest(at));
        let mut foot = across;
        let gradient = self.gradient(&foot);
        let mut factor = (point - foot).dot(&gradient) / gradient.norm_squared();
        let mut best = f64::INFINITY;
        for _ in 0..STEPS {
            let (gradient, hessian) = (self.gradient(&foot), self.hessian(&foot));
            let lack = point - foot - gradient * factor;
            let rest = lack.norm().max(self.value(&foot).abs());
            if rest.is_nan() || rest >= 0.5 * best {
                break;
            }
            best = rest;
            let mut matrix = Matrix4::zeros();
            matrix.fixed_view_mut::<3, 3>(0, 0).copy_from(&(Matrix3::identity() + hessian * factor));
            matrix.fixed_view_mut::<3, 1>(0, 3).copy_from(&gradient);
            matrix.fixed_view_mut::<1, 3>(3, 0).copy_from(&gradient.transpose());
            let right = Vector4::new(lack.x, lack.y, lack.z, -self.value(&foot));
            let Some(step) = matrix.lu().solve(&right) else { break };
            foot += step.xyz();
            factor += step.w;
        }
        let is_better = (point - foot).norm() <= (point - across).norm() && best <= SOLVED * self.reach();
        Ok(if is_better { foot } else { across })
    }

    fn natural_range(&self, cell: &Cell) -> Interval {
        let r = self.ranges(cell);
        // A circle about the path is invariant under rotation of the section. Where the section
        // rotates fast, the range of (X, Y) would be wide.
        let is_tube = |e: &Ellipse| e.center == [0.0; 2] && e.radii[0] == e.radii[1];
        match &self.section {
            Section::Ellipse(e) if is_tube(e) => e.value_range(r.across),
            section => section.value_range(r.at),
        }
    }

    fn gradient_range(&self, cell: &Cell) -> Cell {
        let r = self.ranges(cell);
        if r.distance.lo <= 0.0 {
            return [Interval::new(f64::NEG_INFINITY, f64::INFINITY); 3];
        }
        let [gx, gy] = self.section.gradient_range(r.at);
        let out = gx * r.cos + gy * r.sin;
        let up = gy * r.cos - gx * r.sin;
        let round = r.turn * (gy * r.at[0] - gx * r.at[1]) / r.distance;
        [0, 1, 2].map(|i| r.outward[i] * out + up * self.axis[i] + r.along[i] * round)
    }

    fn transformed(&self, motion: &Isometry3<f64>) -> Self {
        let [axis, start, up] = [self.axis, self.start, self.up].map(|v| (motion * v).normalize());
        Self { center: motion * self.center, axis, start, up, ..*self }
    }
}
