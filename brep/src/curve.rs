//! Curves in space and in the parameters of surfaces.

use crate::bspline::SplineCurve;
use crate::{Placement, Vector};
use nalgebra::SVector;
use serde::{Deserialize, Serialize};

/// A curve with its parametrisation, in `D` dimensions.
///
/// Axes carry the radii as their lengths, so a similarity maps each kind to itself and keeps the
/// parameters.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(bound(serialize = "SVector<f64, D>: Serialize", deserialize = "SVector<f64, D>: Deserialize<'de>"))]
pub enum Curve<const D: usize> {
    /// start + t · direction
    Line {
        /// The point of parameter 0.
        start: SVector<f64, D>,
        /// The derivative.
        direction: SVector<f64, D>,
    },
    /// center + cos t · x + sin t · y: circles and ellipses.
    Ellipse {
        /// The center.
        center: SVector<f64, D>,
        /// The half axes.
        axes: [SVector<f64, D>; 2],
    },
    /// apex + t² · x + t · y
    Parabola {
        /// The apex.
        apex: SVector<f64, D>,
        /// The two vectors.
        axes: [SVector<f64, D>; 2],
    },
    /// center + cosh t · x + sinh t · y
    Hyperbola {
        /// The center.
        center: SVector<f64, D>,
        /// The half axes.
        axes: [SVector<f64, D>; 2],
    },
    /// A Bézier or B-spline curve.
    Spline(SplineCurve<D>),
    /// A curve at a constant distance from another one: in the plane to the right of it, in space
    /// along the cross product of its tangent and a direction.
    Offset {
        /// The other curve.
        basis: Box<Curve<D>>,
        /// The distance.
        distance: f64,
        /// The direction; zero in the plane.
        direction: SVector<f64, D>,
    },
}

impl<const D: usize> Curve<D> {
    /// The value and the first three derivatives.
    pub fn jet(&self, t: f64) -> [SVector<f64, D>; 4] {
        match self {
            Self::Line { start, direction } => {
                [start + direction * t, *direction, SVector::zeros(), SVector::zeros()]
            }
            Self::Ellipse { center, axes: [x, y] } => {
                let (sine, cosine) = t.sin_cos();
                let (value, first) = (x * cosine + y * sine, y * cosine - x * sine);
                [center + value, first, -value, -first]
            }
            Self::Parabola { apex, axes: [x, y] } => {
                [apex + x * (t * t) + y * t, x * (2.0 * t) + y, x * 2.0, SVector::zeros()]
            }
            Self::Hyperbola { center, axes: [x, y] } => {
                let (sine, cosine) = (t.sinh(), t.cosh());
                let (value, first) = (x * cosine + y * sine, x * sine + y * cosine);
                [center + value, first, value, first]
            }
            Self::Spline(spline) => spline.jet(t),
            Self::Offset { basis, distance, direction } => {
                let [a, b, c] = offset(&basis.jet(t), *distance, direction);
                // The third derivative needs the fourth of the basis: a difference of second ones
                // suffices, because only searches for nearest points use it.
                let step = 1e-5 * (1.0 + t.abs());
                let [before, after] =
                    [-step, step].map(|h| offset(&basis.jet(t + h), *distance, direction)[2]);
                [a, b, c, (after - before) / (2.0 * step)]
            }
        }
    }

    /// The point of a parameter.
    #[inline]
    pub fn point(&self, t: f64) -> SVector<f64, D> {
        self.jet(t)[0]
    }

    /// The largest coordinate from which a point is computed: rounding is relative to it.
    pub(crate) fn largest_term(&self, t: f64) -> f64 {
        match self {
            Self::Line { start, direction } => start.amax().max(t.abs() * direction.amax()),
            Self::Ellipse { center, axes: [x, y] } => center.amax().max(x.amax()).max(y.amax()),
            Self::Parabola { apex, axes: [x, y] } => {
                apex.amax().max(t * t * x.amax()).max(t.abs() * y.amax())
            }
            Self::Hyperbola { center, axes: [x, y] } => center.amax().max(t.cosh() * x.amax().max(y.amax())),
            Self::Offset { basis, .. } => basis.largest_term(t),
            Self::Spline(_) => 0.0,
        }
    }

    /// The period, if the curve is periodic.
    pub fn period(&self) -> Option<f64> {
        match self {
            Self::Ellipse { .. } => Some(std::f64::consts::TAU),
            Self::Spline(spline) => spline.basis.period(),
            Self::Offset { basis, .. } => basis.period(),
            Self::Line { .. } | Self::Parabola { .. } | Self::Hyperbola { .. } => None,
        }
    }

    /// The parameters inside a range where a derivative may jump.
    pub fn breaks(&self, [low, high]: [f64; 2]) -> Vec<f64> {
        match self {
            Self::Spline(spline) => {
                let breaks = spline.basis.breaks();
                match spline.basis.period() {
                    None => breaks.into_iter().filter(|t| low < *t && *t < high).collect(),
                    Some(period) => {
                        let first = ((low - breaks[breaks.len() - 1]) / period).floor() as i64;
                        let last = ((high - breaks[0]) / period).ceil() as i64;
                        // A range of an edge is not longer than a period.
                        let rounds = first..=last.min(first + 4);
                        let mut all: Vec<f64> = rounds
                            .flat_map(|k| breaks.iter().map(move |t| t + period * k as f64))
                            .filter(|t| low < *t && *t < high)
                            .collect();
                        all.dedup();
                        all
                    }
                }
            }
            Self::Offset { basis, .. } => basis.breaks([low, high]),
            _ => Vec::new(),
        }
    }

    /// Whether evaluation finds all poles that it needs.
    pub fn is_sound(&self) -> bool {
        match self {
            Self::Spline(s) => {
                s.basis.is_sound()
                    && s.poles.len() == s.basis.poles()
                    && (s.weights.is_empty() || s.weights.len() == s.poles.len())
            }
            Self::Offset { basis, .. } => basis.is_sound(),
            _ => true,
        }
    }
}

impl Curve<3> {
    /// The image under a similarity, with the same parameters.
    pub fn placed(&self, by: &Placement) -> Self {
        let point = |p: &Vector| by.point(&(*p).into()).coords;
        let axes = |axes: &[Vector; 2]| axes.map(|a| by.vector(&a));
        match self {
            Self::Line { start, direction } => {
                Self::Line { start: point(start), direction: by.vector(direction) }
            }
            Self::Ellipse { center, axes: a } => Self::Ellipse { center: point(center), axes: axes(a) },
            Self::Parabola { apex, axes: a } => Self::Parabola { apex: point(apex), axes: axes(a) },
            Self::Hyperbola { center, axes: a } => Self::Hyperbola { center: point(center), axes: axes(a) },
            Self::Spline(spline) => Self::Spline(SplineCurve {
                poles: spline.poles.iter().map(point).collect(),
                ..spline.clone()
            }),
            Self::Offset { basis, distance, direction } => {
                // A reflection reverses cross products.
                let sign = if by.is_mirrored() { -1.0 } else { 1.0 };
                Self::Offset {
                    basis: Box::new(basis.placed(by)),
                    distance: distance * by.scale() * sign,
                    direction: by.vector(direction),
                }
            }
        }
    }
}

/// The offset of a curve, by its jet, and two derivatives.
fn offset<const D: usize>(
    jet: &[SVector<f64, D>; 4],
    distance: f64,
    direction: &SVector<f64, D>,
) -> [SVector<f64, D>; 3] {
    // The side on which the offset is, as a linear function of the tangent.
    let side = |t: &SVector<f64, D>| {
        let mut out = SVector::zeros();
        if D == 2 {
            (out[0], out[1]) = (t[1], -t[0]);
        } else {
            for k in 0..3 {
                let (i, j) = ((k + 1) % 3, (k + 2) % 3);
                out[k] = t[i] * direction[j] - t[j] * direction[i];
            }
        }
        out
    };
    let [n, n1, n2] = unit_jet([side(&jet[1]), side(&jet[2]), side(&jet[3])]);
    [jet[0] + n * distance, jet[1] + n1 * distance, jet[2] + n2 * distance]
}

/// n / |n| with its first and second derivative along one parameter.
fn unit_jet<const D: usize>([n, n1, n2]: [SVector<f64, D>; 3]) -> [SVector<f64, D>; 3] {
    let length = n.norm().max(f64::MIN_POSITIVE);
    let unit = n / length;
    let rate = unit.dot(&n1);
    let first = (n1 - unit * rate) / length;
    let second_rate = first.dot(&n1) + unit.dot(&n2);
    let second = (n2 - first * (2.0 * rate) - unit * second_rate) / length;
    [unit, first, second]
}
