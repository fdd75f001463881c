//! Nearest points on whole curves and surfaces, without a start value.
//!
//! Newton's method starts from the nearest of many samples, of which there are several between any
//! two knots; analytic kinds have closed forms.

use crate::bspline::Basis;
use crate::curve::Curve;
use crate::project::{CurveFoot, Domain, SurfaceFoot, project_to_curve, project_to_surface, project_within};
use crate::surface::{Profile, Surface};
use crate::{Point, Vector};
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// Searches start from this many samples: the nearest ones.
const STARTS: usize = 4;
/// The most samples in one direction of a surface.
const MOST_SAMPLES: usize = 400;
/// Samples of an ellipse.
const AROUND: u32 = 64;

impl Curve<3> {
    /// The parameters between which the curve is defined, or its period; `None` if it is unbounded.
    pub fn domain(&self) -> Option<[f64; 2]> {
        match self {
            Self::Ellipse { .. } => Some([0.0, TAU]),
            Self::Spline(spline) => Some(spline.basis.range()),
            Self::Offset { basis, .. } => basis.domain(),
            Self::Line { .. } | Self::Parabola { .. } | Self::Hyperbola { .. } => None,
        }
    }

    /// Parameters that find all parts of the curve: several between any two knots. Of an unbounded
    /// curve those of the points that have the height of `point` over its axis.
    fn samples(&self, point: &Point) -> Vec<f64> {
        let along = |origin: &Vector, axis: &Vector| (point.coords - origin).dot(axis) / axis.norm_squared();
        match self {
            Self::Line { start, direction } => vec![along(start, direction)],
            Self::Parabola { apex, axes: [_, y] } => vec![along(apex, y), 0.0],
            Self::Hyperbola { center, axes: [_, y] } => vec![along(center, y).asinh(), 0.0],
            Self::Ellipse { center, axes: [x, y] } => {
                let nearest = along(center, y).atan2(along(center, x)).rem_euclid(TAU);
                let around = (0..AROUND).map(|k| TAU * f64::from(k) / f64::from(AROUND));
                std::iter::once(nearest).chain(around).collect()
            }
            Self::Spline(spline) => between_knots(&spline.basis, 2),
            Self::Offset { basis, .. } => basis.samples(point),
        }
    }
}

/// Parameters between any two knots, at least `fewest` and as many more as the degree, and the end.
fn between_knots(basis: &Basis, fewest: usize) -> Vec<f64> {
    let breaks = basis.breaks();
    let each = (basis.degree() + fewest).min((MOST_SAMPLES / breaks.len()).max(fewest));
    let between = |w: &[f64]| {
        let [a, b] = [w[0], w[1]];
        (0..each).map(move |k| a + (b - a) * k as f64 / each as f64)
    };
    let last = breaks[breaks.len() - 1];
    breaks.windows(2).flat_map(between).chain([last]).collect()
}

/// The smallest items by a key, at most [`STARTS`].
fn smallest<T: Copy>(items: Vec<T>, key: impl Fn(&T) -> f64) -> Vec<T> {
    let mut keyed: Vec<(f64, T)> = items.into_iter().map(|item| (key(&item), item)).collect();
    keyed.sort_by(|a, b| a.0.total_cmp(&b.0));
    keyed.into_iter().take(STARTS).map(|(_, item)| item).collect()
}

/// The items, in ascending order of a parameter, that are nearer than those beside them.
fn local_minima<T: Copy>(items: Vec<T>, key: impl Fn(&T) -> f64) -> Vec<T> {
    let keys: Vec<f64> = items.iter().map(key).collect();
    let is_least =
        |k: &usize| (*k == 0 || keys[*k] <= keys[k - 1]) && (k + 1 == keys.len() || keys[*k] <= keys[k + 1]);
    (0..items.len()).filter(is_least).map(|k| items[k]).collect()
}

/// The point of a whole curve that is nearest to a point. The parameter of a periodic one is inside
/// of its period.
pub fn nearest_on_curve(curve: &Curve<3>, point: &Point) -> CurveFoot {
    let range = match (curve.period(), curve.domain()) {
        // Searches may cross the ends of a period.
        (Some(period), Some([low, high])) => [low - period, high + period],
        (None, Some(domain)) => domain,
        _ => [f64::NEG_INFINITY, f64::INFINITY],
    };
    let distance = |t: &f64| (curve.point(*t) - point.coords).norm();
    let mut samples = curve.samples(point);
    samples.sort_by(f64::total_cmp);
    let feet = smallest(local_minima(samples, distance), distance)
        .into_iter()
        .map(|start| project_to_curve(curve, range, point, start));
    let mut foot = feet
        .min_by(|a, b| (a.point - point).norm().total_cmp(&(b.point - point).norm()))
        .expect("a curve has samples");
    if let (Some(period), Some([low, _])) = (curve.period(), curve.domain()) {
        foot.parameter = low + (foot.parameter - low).rem_euclid(period);
    }
    foot
}

/// The point of a whole surface that is nearest to a point, up to local minima between samples.
pub fn nearest_on_surface(surface: &Surface, point: &Point) -> SurfaceFoot {
    let distance = |p: &[f64; 2]| (surface.point(*p) - point).norm();
    let feet = smallest(starts(surface, point), distance)
        .into_iter()
        .map(|start| project_to_surface(surface, point, start));
    let mut foot = feet
        .min_by(|a, b| (a.point - point).norm().total_cmp(&(b.point - point).norm()))
        .expect("a surface has samples");
    // Searches may end several periods away.
    for (parameter, period) in foot.parameters.iter_mut().zip(surface.periods()) {
        *parameter -= period.map_or(0.0, |period| period * (*parameter / period).round());
    }
    foot
}

/// The parameters of the point in a domain of a surface that is nearest to a point.
pub(crate) fn nearest_within(surface: &Surface, domain: Domain, point: &Point) -> [f64; 2] {
    let distance = |p: &[f64; 2]| (surface.point(*p) - point).norm();
    smallest(starts(surface, point), distance)
        .into_iter()
        .map(|start| project_within(surface, domain, point, start))
        .min_by(|a, b| distance(a).total_cmp(&distance(b)))
        .expect("a surface has samples")
}

/// Parameters from which the search for a nearest point starts.
fn starts(surface: &Surface, point: &Point) -> Vec<[f64; 2]> {
    let nearest_of = |all| local_minima(all, |p: &[f64; 2]| (surface.point(*p) - point).norm());
    match surface {
        Surface::Plane { .. } => vec![[0.0; 2]],
        Surface::Round { profile, .. } => {
            let [x, y, z] = surface.local(point).expect("a surface of revolution");
            let radius = x.hypot(y);
            let u = y.atan2(x);
            match *profile {
                Profile::Line { slope: [0.0, b], .. } => vec![[u, z / b]],
                // The line on either side of the axis.
                Profile::Line { radius: own, slope: [a, b] } => [(radius, u), (-radius, u + PI)]
                    .map(|(r, u)| [u, ((r - own) * a + z * b) / (a * a + b * b)])
                    .to_vec(),
                Profile::Circle { major: 0.0, .. } => vec![[u, z.atan2(radius)]],
                Profile::Circle { major, .. } => {
                    [(radius, u), (-radius, u + PI)].map(|(r, u)| [u, z.atan2(r - major)]).to_vec()
                }
            }
        }
        Surface::Extrusion { curve, direction } => {
            // The samples of unbounded curves suit a point in their plane.
            let height = |u: f64| (point.coords - curve.point(u)).dot(direction) / direction.norm_squared();
            let flat = curve.samples(point).first().map_or(*point, |&u| point - direction * height(u));
            let mut all = curve.samples(&flat);
            all.sort_by(f64::total_cmp);
            nearest_of(all.into_iter().map(|u| [u, height(u)]).collect())
        }
        Surface::Revolution { curve, origin, axis } => {
            let radial = |p: Vector| p - origin - axis * axis.dot(&(p - origin));
            let angle = |v: f64| {
                let (from, to) = (radial(curve.point(v)), radial(point.coords));
                axis.dot(&from.cross(&to)).atan2(from.dot(&to))
            };
            let mut all = curve.samples(point);
            if curve.domain().is_none() {
                // The nearest circle is about as far away as the point is from the axis, or less.
                let reach = |&v: &f64| {
                    let [at, speed, ..] = curve.jet(v);
                    let lengths = (point.coords - origin).norm() + (at - origin).norm();
                    lengths / speed.norm().max(f64::MIN_POSITIVE)
                };
                let (middle, reach) = (all[0], all.iter().map(reach).fold(0.0, f64::max));
                all.extend((-100..=100).map(|k| middle + reach * f64::from(k) / 100.0));
            }
            all.sort_by(f64::total_cmp);
            nearest_of(all.into_iter().map(|v| [angle(v), v]).collect())
        }
        Surface::Spline(spline) => {
            let [in_u, in_v] = [0, 1].map(|k| between_knots(&spline.bases[k], 1));
            in_u.iter().flat_map(|&u| in_v.iter().map(move |&v| [u, v])).collect()
        }
        Surface::Offset { basis, .. } => starts(basis, point),
    }
}

impl Surface {
    /// The coordinates of a point in the axes of a surface of revolution with a closed form.
    pub(crate) fn local(&self, point: &Point) -> Option<[f64; 3]> {
        let Self::Round { origin, axes, .. } = self else { return None };
        Some(axes.map(|axis| (point.coords - origin).dot(&axis) / axis.norm_squared()))
    }

    /// The parameters at the lower or upper end in one direction at which the surface has no length
    /// in the other one.
    pub(crate) fn pole(&self, direction: usize, is_upper: bool, least: f64) -> Option<f64> {
        let end = |[low, high]: [f64; 2]| if is_upper { high } else { low };
        let at = match self {
            Self::Round { profile: Profile::Circle { major: 0.0, .. }, .. } if direction == 1 => {
                end([-FRAC_PI_2, FRAC_PI_2])
            }
            Self::Round { profile: Profile::Line { radius, slope: [a, _] }, .. } if direction == 1 => {
                // The tip is above where the radius shrinks upward.
                ((*a < 0.0) == is_upper && *a != 0.0).then_some(-radius / a)?
            }
            Self::Revolution { curve, .. } if direction == 1 => end(curve.domain()?),
            Self::Spline(spline) => end(spline.bases[direction].range()),
            _ => return None,
        };
        let parameters = if direction == 1 { [0.1, at] } else { [at, 0.1] };
        let d = self.jet(parameters[0], parameters[1], 1).d;
        let across = if direction == 1 { d[1][0] } else { d[0][1] };
        (across.norm() < least).then_some(at)
    }
}
