//! Helpers of the curved primitives: curvature from derivatives, and nearest points on quadrics in
//! their principal axes.

use crate::{Point, Vector};
use nalgebra::Matrix3;

/// The largest absolute principal curvature of the level set with the given gradient and Hessian,
/// 1/length.
///
/// Infinite where the gradient vanishes. The shape operator is the Hessian restricted to the
/// tangent plane, divided by the length of the gradient (Goldman 2005, Curvature formulas for
/// implicit curves and surfaces, section 4).
pub fn largest_curvature(gradient: &Vector, hessian: &Matrix3<f64>) -> f64 {
    let length = gradient.norm();
    if length == 0.0 {
        return f64::INFINITY;
    }
    let [least, most] = extremes(hessian, &(gradient / length));
    least.abs().max(most.abs()) / length
}

/// Two unit vectors u, v that form a right-handed orthogonal frame (u, v, `normal`).
pub fn tangents(normal: &Vector) -> (Vector, Vector) {
    let least = normal.iamin();
    let mut axis = Vector::zeros();
    axis[least] = 1.0;
    let u = normal.cross(&axis).normalize();
    (u, normal.cross(&u))
}

/// The least and the largest value of a quadratic form on unit vectors orthogonal to a unit normal.
pub fn extremes(form: &Matrix3<f64>, normal: &Vector) -> [f64; 2] {
    let (u, v) = tangents(normal);
    let (uu, uv, vv) = (u.dot(&(form * u)), u.dot(&(form * v)), v.dot(&(form * v)));
    let mean = 0.5 * (uu + vv);
    let spread = (0.5 * (uu - vv)).hypot(uv);
    [mean - spread, mean + spread]
}

/// The component of `vector` orthogonal to the unit vector `axis`.
#[inline]
pub fn reject(vector: &Vector, axis: &Vector) -> Vector {
    vector - axis * vector.dot(axis)
}

/// Refines a point by Newton steps along the gradient while the value decreases.
///
/// The point must be on the surface up to rounding of a closed formula; the result is accurate up
/// to rounding of its coordinates.
#[inline]
pub fn polish(mut point: Point, value: impl Fn(&Point) -> f64, gradient: impl Fn(&Point) -> Vector) -> Point {
    /// One step removes the rounding error of a closed formula; a second confirms it.
    const STEPS: usize = 3;
    let mut best = value(&point);
    for _ in 0..STEPS {
        let g = gradient(&point);
        let square = g.norm_squared();
        if best == 0.0 || square == 0.0 {
            break;
        }
        let next = point - g * (best / square);
        let at_next = value(&next);
        if at_next.abs() >= best.abs() {
            break;
        }
        (point, best) = (next, at_next);
    }
    point
}

/// Limit for bracketed Newton iterations, which need about ten steps.
const ITERATIONS: usize = 100;

/// The nearest point to `y` on Σ (xᵢ/rᵢ)² = 1.
///
/// It is xᵢ = rᵢ²yᵢ/(t + rᵢ²), with t the largest root of Σ (rᵢyᵢ/(t + rᵢ²))² = 1 (Eberly 2013,
/// Distance from a point to an ellipse, an ellipsoid or a hyperellipsoid). The left side is
/// decreasing and convex, so Newton's method started left of the root increases monotonically to
/// it. If y lies in the plane perpendicular to the shortest axis and near the center, there is no
/// such root greater than -r²; then two points are equally near, and the one with positive
/// coordinate is returned.
pub fn nearest_on_ellipsoid<const N: usize>(y: [f64; N], radii: [f64; N]) -> [f64; N] {
    let shortest = (0..N).fold(0, |best, i| if radii[i] < radii[best] { i } else { best });
    let pole = -radii[shortest] * radii[shortest];
    let mut t = (0..N).fold(pole, |t, i| f64::max(t, radii[i] * y[i].abs() - radii[i] * radii[i]));
    let excess = |t: f64| {
        let (mut sum, mut slope) = (-1.0, 0.0);
        for i in 0..N {
            let denominator = t + radii[i] * radii[i];
            if y[i] != 0.0 && denominator > 0.0 {
                let q = radii[i] * y[i] / denominator;
                sum += q * q;
                slope -= 2.0 * q * q / denominator;
            }
        }
        (sum, slope)
    };
    let mut x = [0.0; N];
    if t == pole && excess(t).0 < 0.0 {
        let mut rest = 1.0;
        for i in 0..N {
            let denominator = pole + radii[i] * radii[i];
            if i != shortest && denominator > 0.0 {
                x[i] = radii[i] * radii[i] * y[i] / denominator;
                rest -= (x[i] / radii[i]).powi(2);
            }
        }
        x[shortest] = radii[shortest] * rest.max(0.0).sqrt();
        return x;
    }
    for _ in 0..ITERATIONS {
        let (sum, slope) = excess(t);
        let next = t - sum / slope;
        if !(sum > 0.0 && next > t) {
            break;
        }
        t = next;
    }
    for i in 0..N {
        x[i] = radii[i] * radii[i] * y[i] / (t + radii[i] * radii[i]);
    }
    x
}

/// The nearest point to `y` on the cone (x₀/a)² + (x₁/b)² = (x₂/c)²; `radii` is `[a, b, c]`.
///
/// It is xᵢ = rᵢ²yᵢ/(rᵢ² ± t) with + for the first two, where t is the root of (a y₀/(a²+t))² + (b
/// y₁/(b²+t))² - (c y₂/(c²-t))² between -min(a, b)² and c². In this interval the left side is
/// decreasing and the second-order condition for a minimum holds. If an end of the interval has no
/// pole because a coordinate is zero, the root may be beyond it: then t is that end, and the
/// coordinate follows from the equation of the cone, positive.
pub fn nearest_on_cone(y: [f64; 3], radii: [f64; 3]) -> [f64; 3] {
    let [a2, b2, c2] = radii.map(|r| r * r);
    let shortest = if radii[0] <= radii[1] { 0 } else { 1 };
    let denominators = |t: f64| [a2 + t, b2 + t, c2 - t];
    let term = |i: usize, t: f64| {
        let d = denominators(t)[i];
        if y[i] == 0.0 { (0.0, 0.0) } else { ((radii[i] * y[i] / d).powi(2), d) }
    };
    let excess = |t: f64| {
        let [(p, dp), (q, dq), (s, ds)] = [0, 1, 2].map(|i| term(i, t));
        let slope =
            [(p, dp), (q, dq), (s, ds)].iter().filter(|x| x.1 != 0.0).map(|(v, d)| -2.0 * v / d).sum::<f64>();
        (p + q - s, slope)
    };
    let (mut low, mut high) = (-a2.min(b2), c2);
    let place = |t: f64| {
        let d = denominators(t);
        [0, 1, 2].map(|i| if y[i] == 0.0 { 0.0 } else { radii[i] * radii[i] * y[i] / d[i] })
    };
    if y[shortest] == 0.0 && excess(low).0 < 0.0 {
        let mut x = place(low);
        let other = 1 - shortest;
        let rest = (x[2] / radii[2]).powi(2) - (x[other] / radii[other]).powi(2);
        x[shortest] = radii[shortest] * rest.max(0.0).sqrt();
        return x;
    }
    if y[2] == 0.0 && excess(high).0 > 0.0 {
        let mut x = place(high);
        x[2] = radii[2] * (x[0] / radii[0]).hypot(x[1] / radii[1]);
        return x;
    }
    let mut t = 0.0;
    for _ in 0..ITERATIONS {
        let (sum, slope) = excess(t);
        if sum > 0.0 {
            low = t;
        } else {
            high = t;
        }
        let newton = t - sum / slope;
        let next = if newton > low && newton < high { newton } else { 0.5 * (low + high) };
        if sum == 0.0 || next == t {
            break;
        }
        t = next;
    }
    place(t)
}
