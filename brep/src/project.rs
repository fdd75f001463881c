//! Nearest points on curves and surfaces, from a start value.

use crate::curve::Curve;
use crate::surface::{Jet, Surface};
use crate::{Point, Vector};

/// The foot of a projection to a curve.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CurveFoot {
    /// The parameter.
    pub parameter: f64,
    /// The point of that parameter.
    pub point: Point,
    /// The unit tangent, or zero where the curve has none.
    pub tangent: Vector,
    /// Whether the way to the point is orthogonal to the curve, or the foot is an end or a kink.
    pub is_converged: bool,
}

/// The foot of a projection to a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfaceFoot {
    /// The parameters.
    pub parameters: [f64; 2],
    /// The point of these parameters.
    pub point: Point,
    /// The unit normal along the cross product of the derivatives, or zero at poles.
    pub normal: Vector,
    /// Whether the way to the point is orthogonal to the surface, or the foot is a pole or a kink.
    pub is_converged: bool,
}

/// The most steps: a few suffice from a near start.
const STEPS: usize = 100;
/// Halvings of a step that does not decrease the distance.
const HALVINGS: usize = 30;
/// The most searches along parameters that are followed by Newton's steps.
const CREASES: usize = 4;
/// The most searches along both parameters: one finds a crease, the next one the place on it.
const TURNS: usize = 20;
/// The most doublings of a first step along a parameter.
const DOUBLINGS: usize = 20;
/// The most halvings of an interval of a parameter.
const BISECTIONS: usize = 60;
/// The cosine of the angle between the surface and the way to a point beyond which a foot is not
/// converged; distances below rounding have no direction.
const ORTHOGONAL: f64 = 1e-6;

/// Rounding errors of feet, relative to the coordinates.
const ROUNDING: f64 = 1e-13;

/// Whether a way is not longer than another one, up to the rounding of coordinates of this size:
/// otherwise points almost on the surface would stop short of their feet.
fn is_nearer(new: &Vector, old: &Vector, scale: f64) -> bool {
    let rounding = 2.0 * f64::EPSILON * scale;
    new.norm() <= old.norm() + rounding
}

/// The point of a curve, within a range of parameters, at which the distance from `point` has a
/// minimum near the parameter `start`.
///
/// Newton's method on the derivative of the squared distance; Gauss-Newton where that is not
/// convex.
pub fn project_to_curve(curve: &Curve<3>, range: [f64; 2], point: &Point, start: f64) -> CurveFoot {
    let clamp = |t: f64| t.clamp(range[0], range[1]);
    let mut t = clamp(start);
    let mut jet = curve.jet(t);
    let scale = point.coords.amax().max(jet[0].amax()).max(curve.largest_term(t));
    for _ in 0..STEPS {
        let way = jet[0] - point.coords;
        let slope = way.dot(&jet[1]);
        let square = jet[1].norm_squared();
        let step = along_one(slope, square, way.dot(&jet[2]));
        if !step.is_finite() {
            break;
        }
        let mut share = 1.0;
        let mut next = None;
        for _ in 0..HALVINGS {
            let to = clamp(t + share * step);
            let there = curve.jet(to);
            if is_nearer(&(there[0] - point.coords), &way, scale) {
                next = Some((to, there));
                break;
            }
            share *= 0.5;
        }
        let Some((to, there)) = next else { break };
        let moved = (to - t).abs();
        (t, jet) = (to, there);
        if moved <= 2.0 * f64::EPSILON * (1.0 + t.abs()) {
            break;
        }
    }
    let way = jet[0] - point.coords;
    let tangent = jet[1].try_normalize(0.0).unwrap_or_else(Vector::zeros);
    // The parameter has rounding errors too; some programs start lines far from the part.
    let rounding = ROUNDING * scale + 4.0 * f64::EPSILON * t.abs() * jet[1].norm();
    let is_end = t == range[0] || t == range[1];
    let along = way.dot(&tangent).abs();
    // At a kink the nearest point is where the distance grows in both directions.
    let grows = |h: f64| is_nearer(&way, &(curve.point(clamp(t + h)) - point.coords), scale);
    let step = along / jet[1].norm().max(f64::MIN_POSITIVE);
    let is_kink = || [-step, step, -0.1 * step, 0.1 * step].into_iter().all(grows);
    let is_converged = is_end || along <= ORTHOGONAL * way.norm() + rounding || is_kink();
    CurveFoot { parameter: t, point: Point::from(jet[0]), tangent, is_converged }
}

/// The point of a surface at which the distance from `point` has a minimum near the parameters
/// `start`.
///
/// Newton's method on the gradient of the squared distance, with a multiple of the first
/// fundamental form added until the matrix is positive definite. Parameters are not bounded: beyond
/// their knots, splines continue by their last polynomials.
pub fn project_to_surface(surface: &Surface, point: &Point, start: [f64; 2]) -> SurfaceFoot {
    let [u, v] = start;
    if let Surface::Plane { origin, axes: [x, y] } = surface {
        // The axes are orthogonal.
        let way = point.coords - origin;
        let [u, v] = [x, y].map(|a| way.dot(a) / a.norm_squared());
        let foot = Point::from(origin + x * u + y * v);
        let normal = x.cross(y).normalize();
        return SurfaceFoot { parameters: [u, v], point: foot, normal, is_converged: true };
    }
    let jet = surface.jet(u, v, 2);
    let scale = point.coords.amax().max(jet.d[0][0].amax()).max(surface.largest_term(v));
    let mut at = descend(surface, [None; 2], point, [u, v], jet, scale);
    let mut foot = foot_at(surface, point, at, scale);
    // Newton's steps end at a crease, an isoparametric line across which the normal jumps, short of
    // the nearest point on it.
    for _ in 0..CREASES {
        if foot.is_converged {
            return foot;
        }
        at = descend_by_axes(surface, point, at, scale);
        at = descend(surface, [None; 2], point, at, surface.jet(at[0], at[1], 2), scale);
        let before = std::mem::replace(&mut foot, foot_at(surface, point, at, scale));
        if (foot.point - before.point).norm() <= ROUNDING * scale {
            break;
        }
    }
    let is_converged = foot.is_converged || is_kink(surface, point, &foot, scale);
    SurfaceFoot { is_converged, ..foot }
}

/// The parameters at which the distance from `point` has a minimum in a domain, near `start`.
pub(crate) fn project_within(surface: &Surface, domain: Domain, point: &Point, start: [f64; 2]) -> [f64; 2] {
    let at = clamped(start, domain);
    let jet = surface.jet(at[0], at[1], 2);
    let scale = point.coords.amax().max(jet.d[0][0].amax()).max(surface.largest_term(at[1]));
    descend(surface, domain, point, at, jet, scale)
}

/// The bounds of both parameters.
pub(crate) type Domain = [Option<[f64; 2]>; 2];

fn clamped(at: [f64; 2], domain: Domain) -> [f64; 2] {
    [0, 1].map(|i| domain[i].map_or(at[i], |[low, high]| at[i].clamp(low, high)))
}

/// The parameters at which Newton's steps end.
fn descend(
    surface: &Surface,
    domain: Domain,
    point: &Point,
    [mut u, mut v]: [f64; 2],
    mut jet: Jet,
    scale: f64,
) -> [f64; 2] {
    for _ in 0..STEPS {
        let d = &jet.d;
        let way = d[0][0] - point.coords;
        let gradient = [way.dot(&d[1][0]), way.dot(&d[0][1])];
        let form = [d[1][0].norm_squared(), d[1][0].dot(&d[0][1]), d[0][1].norm_squared()];
        let bend = [way.dot(&d[2][0]), way.dot(&d[1][1]), way.dot(&d[0][2])];
        // At a bound the other parameter alone is moved, if the distance decreases beyond.
        let is_held = [0, 1].map(|i| {
            let at = [u, v][i];
            domain[i].is_some_and(|[low, high]| {
                (at <= low && gradient[i] > 0.0) || (at >= high && gradient[i] < 0.0)
            })
        });
        let step = match is_held {
            [false, false] => newton_step(gradient, form, bend),
            _ => Some(
                [0, 1]
                    .map(|i| if is_held[i] { 0.0 } else { along_one(gradient[i], form[2 * i], bend[2 * i]) }),
            ),
        };
        let Some(step) = step else { break };
        let mut share = 1.0;
        let mut next = None;
        for _ in 0..HALVINGS {
            let to = clamped([u + share * step[0], v + share * step[1]], domain);
            let there = surface.jet(to[0], to[1], 2);
            if is_nearer(&(there.d[0][0] - point.coords), &way, scale) {
                next = Some((to, there));
                break;
            }
            share *= 0.5;
        }
        let Some((to, there)) = next else { break };
        let moved = (there.d[0][0] - jet.d[0][0]).norm();
        ([u, v], jet) = (to, there);
        if moved <= f64::EPSILON * scale {
            break;
        }
    }
    [u, v]
}

/// The parameters of a minimum of the distance along both parameters in turn.
///
/// Along each the place is where the derivative changes its sign, which may be a jump: so the
/// search goes to a crease and then along it.
fn descend_by_axes(surface: &Surface, point: &Point, start: [f64; 2], scale: f64) -> [f64; 2] {
    let slope = |at: [f64; 2], axis: usize| {
        let jet = surface.jet(at[0], at[1], 1);
        let along = if axis == 0 { jet.d[1][0] } else { jet.d[0][1] };
        ((jet.d[0][0] - point.coords).dot(&along), along.norm_squared())
    };
    let mut at = start;
    for _ in 0..TURNS {
        let before = surface.point(at);
        for axis in [0, 1] {
            let (first, square) = slope(at, axis);
            let step = -first / square;
            if !step.is_finite() || step == 0.0 {
                continue;
            }
            let shifted = |by: f64| [0, 1].map(|k| if k == axis { at[k] + by } else { at[k] });
            let to = shifted(end_of(step, |by| slope(shifted(by), axis).0 * first > 0.0));
            if is_nearer(&(surface.point(to) - point), &(surface.point(at) - point), scale) {
                at = to;
            }
        }
        if (surface.point(at) - before).norm() <= f64::EPSILON * scale {
            break;
        }
    }
    at
}

/// About how far a condition holds in the direction of a step, which is doubled while it does.
fn end_of(mut step: f64, holds: impl Fn(f64) -> bool) -> f64 {
    let mut low = 0.0;
    for _ in 0..DOUBLINGS {
        if !holds(step) {
            break;
        }
        (low, step) = (step, 2.0 * step);
    }
    let mut high = step;
    for _ in 0..BISECTIONS {
        let middle = 0.5 * (low + high);
        if middle == low || middle == high {
            break;
        }
        if holds(middle) { low = middle } else { high = middle }
    }
    low
}

/// The foot with these parameters; it is converged if the way to it is orthogonal to the surface.
fn foot_at(surface: &Surface, point: &Point, parameters: [f64; 2], scale: f64) -> SurfaceFoot {
    let jet = surface.jet(parameters[0], parameters[1], 2);
    let foot = jet.point();
    let way = foot - point;
    let normal = jet.normal().unwrap_or_else(Vector::zeros);
    let along = (way - normal * normal.dot(&way)).norm();
    let is_converged = normal == Vector::zeros() || along <= ORTHOGONAL * way.norm() + ROUNDING * scale;
    SurfaceFoot { parameters, point: foot, normal, is_converged }
}

/// Whether the distance grows in all directions from a place, though the way to it is not
/// orthogonal: it is on a crease.
fn is_kink(surface: &Surface, point: &Point, foot: &SurfaceFoot, scale: f64) -> bool {
    let [u, v] = foot.parameters;
    let jet = surface.jet(u, v, 1);
    let way = foot.point - point;
    let along = (way - foot.normal * foot.normal.dot(&way)).norm();
    let grows = |[a, b]: [f64; 2]| is_nearer(&way, &(surface.point([u + a, v + b]) - point), scale);
    let [a, b] =
        [jet.d[1][0], jet.d[0][1]].map(|d| along / d.norm().max(f64::MIN_POSITIVE)).map(|h| h.min(1.0));
    let around = [[-a, 0.0], [a, 0.0], [0.0, -b], [0.0, b], [-a, -b], [a, b], [-a, b], [a, -b]];
    around.into_iter().all(|step| grows(step) && grows(step.map(|h| 0.1 * h)))
}

/// The Newton step of one parameter; Gauss-Newton where the squared distance is not convex.
fn along_one(gradient: f64, square: f64, bend: f64) -> f64 {
    let convex = square + bend;
    -gradient / if convex > 0.1 * square { convex } else { square }
}

/// The least determinant of the second derivatives of half the squared distance, in units of that
/// of the first fundamental form.
const LEAST_CONVEX: f64 = 1e-3;

/// The Newton step of a quadratic model, made convex by more of the first fundamental form.
fn newton_step(gradient: [f64; 2], form: [f64; 3], bend: [f64; 3]) -> Option<[f64; 2]> {
    let area = form[0] * form[2] - form[1] * form[1];
    // At poles one derivative vanishes: the other direction alone is moved, below.
    let is_pole = form[0].min(form[2]) <= 1e-20 * form[0].max(form[2]);
    let is_regular = !is_pole && area > 1e-14 * form[0] * form[2];
    for share in [1.0, 0.5, 0.0] {
        let [a, b, c] = [0, 1, 2].map(|i| form[i] + share * bend[i]);
        let determinant = a * c - b * b;
        if is_regular && a > 0.0 && c > 0.0 && determinant > LEAST_CONVEX * area {
            let step = [
                (b * gradient[1] - c * gradient[0]) / determinant,
                (b * gradient[0] - a * gradient[1]) / determinant,
            ];
            return step.iter().all(|s| s.is_finite()).then_some(step);
        }
    }
    let least = 1e-20 * form[0].max(form[2]);
    let step = [0, 1].map(|i| if form[2 * i] > least { -gradient[i] / form[2 * i] } else { 0.0 });
    step.iter().all(|s| s.is_finite()).then_some(step)
}
