//! B-spline bases, curves and surfaces.
//!
//! Source: L. Piegl, W. Tiller, The NURBS Book (1997), chapters 2 to 4. Periodic splines are
//! unrolled: their knots continue beyond both ends of the period, and their first poles are
//! repeated at the end.

use nalgebra::{SVector, Vector4};
use serde::{Deserialize, Serialize};

/// The highest degree (that of OpenCASCADE).
pub const MOST_DEGREE: usize = 25;

/// The highest order of the derivatives that are computed.
pub const MOST_ORDER: usize = 3;

/// The basis functions that do not vanish at a parameter, with their derivatives: `[order][index]`,
/// for degrees below `N`. Most splines have low degrees, and most of the time would go into zeros.
type Functions<const N: usize> = [[f64; N]; MOST_ORDER + 1];
/// The lengths of [`Functions`] for cubic splines, for those of degree 7, and for all.
const LOW: usize = 4;
const MIDDLE: usize = 8;
const ALL: usize = MOST_DEGREE + 1;

/// A spline is closed if its ends differ by at most this (fraction of its size, or of its range of
/// parameters).
pub(crate) const CLOSED: f64 = 1e-9;

/// A B-spline basis over a knot sequence.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Basis {
    degree: usize,
    /// Each knot as often as its multiplicity.
    knots: Vec<f64>,
    is_periodic: bool,
    poles: usize,
}

impl Basis {
    /// A basis for `poles` poles from its different knots and their multiplicities.
    ///
    /// # Errors
    /// A sentence that says which condition the numbers violate.
    pub fn new(
        degree: usize,
        knots: &[f64],
        multiplicities: &[usize],
        poles: usize,
        is_periodic: bool,
    ) -> Result<Self, String> {
        if degree == 0 || degree > MOST_DEGREE {
            return Err(format!("a B-spline has degree {degree}; 1 to {MOST_DEGREE} are possible"));
        }
        if knots.len() < 2 || knots.windows(2).any(|w| w[0] >= w[1] || !w[0].is_finite() || !w[1].is_finite())
        {
            return Err("the knots of a B-spline must be two or more, ascending".into());
        }
        if multiplicities.iter().any(|&m| m == 0 || m > degree + 1) {
            return Err(format!("the multiplicities of knots must be 1 to {}", degree + 1));
        }
        let sum: usize = multiplicities.iter().sum();
        let repeated = knots.iter().zip(multiplicities).flat_map(|(&k, &m)| std::iter::repeat_n(k, m));
        let mut flat: Vec<f64> = repeated.collect();
        if !is_periodic {
            if sum != poles + degree + 1 {
                return Err(format!(
                    "{poles} poles of degree {degree} need {} knots, not {sum}",
                    poles + degree + 1
                ));
            }
            let basis = Self { degree, knots: flat, is_periodic, poles };
            return if basis.is_sound() { Ok(basis) } else { Err("a B-spline has an empty range".into()) };
        }
        let ends = multiplicities[0];
        if ends != multiplicities[multiplicities.len() - 1] || ends > degree {
            return Err("the first and last knot of a periodic B-spline need the same multiplicity".into());
        }
        if sum - ends != poles || poles == 0 {
            return Err(format!("{} poles belong to these periodic knots, not {poles}", sum - ends));
        }
        let period = knots[knots.len() - 1] - knots[0];
        // The period without its last knot, as often as needed on each side.
        let own: Vec<f64> = flat[..sum - ends].to_vec();
        let beyond = degree + 1 - ends;
        let wrapped = |i: usize| own[i % own.len()] + period * (i / own.len()) as f64;
        let after: Vec<f64> = (0..beyond).map(|i| wrapped(ends + i) + period).collect();
        let rounds = beyond.div_ceil(own.len());
        let before: Vec<f64> =
            (0..beyond).map(|i| wrapped(rounds * own.len() - beyond + i) - period * rounds as f64).collect();
        flat = [before, flat, after].concat();
        let basis = Self { degree, knots: flat, is_periodic, poles };
        if basis.is_sound() { Ok(basis) } else { Err("a periodic B-spline has an empty range".into()) }
    }

    /// The periodic basis of the first poles of a closed spline, if it is one: its last poles
    /// repeat the first. `is_same` compares two poles.
    pub(crate) fn closed(&self, is_same: impl Fn(usize, usize) -> bool) -> Option<Self> {
        if self.is_periodic || self.poles < 4 {
            return None;
        }
        let (degree, poles, flat) = (self.degree, self.poles, &self.knots);
        let [low, high] = self.range();
        let counted = |of: &[f64]| -> (Vec<f64>, Vec<usize>) {
            of.chunk_by(|a, b| a == b).map(|same| (same[0], same.len())).unzip()
        };
        let (knots, mut counts) = counted(flat);
        let last = counts.len() - 1;
        if counts[0] == degree + 1 && counts[last] == degree + 1 {
            (counts[0], counts[last]) = (degree, degree);
            return is_same(0, poles - 1)
                .then(|| Self::new(degree, &knots, &counts, poles - 1, true).ok())?;
        }
        // Knots continue beyond both ends of the range as after a period.
        let period = high - low;
        let shift = flat.iter().filter(|k| low <= **k && **k < high).count();
        let repeats = |i: usize| (flat[i + shift] - flat[i] - period).abs() <= CLOSED * period;
        let is_periodic = shift < poles
            && flat[degree + 1] > low
            && (0..flat.len() - shift).all(repeats)
            && (0..poles - shift).all(|i| is_same(i, i + shift));
        if !is_periodic {
            return None;
        }
        let inside: Vec<f64> = flat.iter().copied().filter(|k| (low..=high).contains(k)).collect();
        let (knots, counts) = counted(&inside);
        Self::new(degree, &knots, &counts, shift, true).ok()
    }

    /// The basis of a Bézier curve over [0, 1].
    ///
    /// # Errors
    /// A degree out of range.
    pub fn bezier(degree: usize) -> Result<Self, String> {
        Self::clamped(degree, &[0.0, 1.0], 1)
    }

    /// A basis of which splines begin at their first pole and end at their last one, with this
    /// multiplicity of the knots between.
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub fn clamped(degree: usize, knots: &[f64], multiplicity: usize) -> Result<Self, String> {
        let mut multiplicities = vec![multiplicity; knots.len()];
        if let [first, .., last] = &mut multiplicities[..] {
            (*first, *last) = (degree + 1, degree + 1);
        }
        let poles = multiplicities.iter().sum::<usize>().saturating_sub(degree + 1);
        Self::new(degree, knots, &multiplicities, poles, false)
    }

    /// The number of functions: poles, counting repeated ones of a periodic spline.
    fn functions(&self) -> usize {
        self.knots.len() - self.degree - 1
    }

    /// Whether evaluation finds all knots that it needs.
    pub fn is_sound(&self) -> bool {
        let enough = (1..=MOST_DEGREE).contains(&self.degree) && self.knots.len() >= 2 * (self.degree + 1);
        enough
            && self.poles > 0
            && self.knots.iter().all(|k| k.is_finite())
            && self.knots.windows(2).all(|w| w[0] <= w[1])
            && self.range()[0] < self.range()[1]
            && (self.is_periodic || self.poles == self.functions())
    }

    /// The parameters between which the spline is defined; the period, if it is periodic.
    pub fn range(&self) -> [f64; 2] {
        [self.knots[self.degree], self.knots[self.functions()]]
    }

    /// The period, if there is one.
    pub fn period(&self) -> Option<f64> {
        self.is_periodic.then(|| self.range()[1] - self.range()[0])
    }

    /// The different knots inside the range and its ends.
    pub fn breaks(&self) -> Vec<f64> {
        let mut breaks = self.knots[self.degree..=self.functions()].to_vec();
        breaks.dedup();
        breaks
    }

    /// The degree.
    pub fn degree(&self) -> usize {
        self.degree
    }

    /// The number of poles.
    pub fn poles(&self) -> usize {
        self.poles
    }

    /// The index of the pole of the k-th function of a span.
    #[inline]
    fn pole(&self, span: usize, k: usize) -> usize {
        let index = span - self.degree + k;
        if self.is_periodic { index % self.poles } else { index }
    }

    /// The span that contains a parameter, and the parameter moved into the period. Beyond the ends
    /// of a spline that is not periodic, the polynomials of its first and last span continue.
    #[inline]
    fn locate(&self, t: f64) -> (usize, f64) {
        let [low, high] = self.range();
        let mut t = t;
        if self.is_periodic && !(low..=high).contains(&t) {
            t = low + (t - low).rem_euclid(high - low);
        }
        let last = self.functions();
        let after = self.knots[self.degree + 1..last].partition_point(|k| *k <= t) + self.degree;
        (after, t)
    }

    /// The functions at a parameter and their derivatives up to `order`; returns the span.
    ///
    /// Piegl, Tiller, algorithm A2.3: each derivative is a difference of functions of lower degree.
    #[inline]
    fn evaluate<const N: usize>(&self, t: f64, order: usize, out: &mut Functions<N>) -> usize {
        let (span, t) = self.locate(t);
        let p = self.degree;
        let knots = &self.knots;
        // Functions of the degree p - k, for each order k of a derivative.
        let mut lower = [[0.0; N]; MOST_ORDER + 1];
        let mut row = [0.0; N];
        row[0] = 1.0;
        for d in 1..=p {
            if p - (d - 1) <= MOST_ORDER {
                lower[p - (d - 1)] = row;
            }
            let mut carried = 0.0;
            for k in 0..d {
                let (right, left) = (knots[span + k + 1], knots[span + 1 + k - d]);
                let share = row[k] / (right - left);
                row[k] = carried + (right - t) * share;
                carried = (t - left) * share;
            }
            row[d] = carried;
        }
        out[0] = row;
        for order in 1..=order.min(MOST_ORDER) {
            if order > p {
                out[order] = [0.0; N];
                continue;
            }
            // Raise the functions of degree p - order step by step to derivatives of degree p.
            let mut row = lower[order];
            for d in p - order + 1..=p {
                let mut next = [0.0; N];
                for k in 0..d {
                    let share = d as f64 * row[k] / (knots[span + k + 1] - knots[span + 1 + k - d]);
                    next[k] -= share;
                    next[k + 1] += share;
                }
                row = next;
            }
            out[order] = row;
        }
        span
    }
}

/// A B-spline curve, rational if it has weights.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SplineCurve<const D: usize> {
    /// The basis.
    pub basis: Basis,
    /// The poles.
    #[serde(bound(
        serialize = "SVector<f64, D>: Serialize",
        deserialize = "SVector<f64, D>: Deserialize<'de>"
    ))]
    pub poles: Vec<SVector<f64, D>>,
    /// One positive weight a pole, or none.
    pub weights: Vec<f64>,
}

impl<const D: usize> SplineCurve<D> {
    /// Moves both ends of a curve without weights to other places, and all between by the linear
    /// interpolation of these moves: splines reproduce linear functions if each pole has the value
    /// at the mean of its knots (Greville 1969).
    pub(crate) fn move_ends(&mut self, ends: [SVector<f64, D>; 2]) {
        let [low, high] = self.basis.range();
        let moves = [ends[0] - self.jet(low)[0], ends[1] - self.jet(high)[0]];
        let degree = self.basis.degree;
        for (k, pole) in self.poles.iter_mut().enumerate() {
            let mean = self.basis.knots[k + 1..=k + degree].iter().sum::<f64>() / degree as f64;
            let share = (mean - low) / (high - low);
            *pole += moves[0] * (1.0 - share) + moves[1] * share;
        }
    }

    /// The value and the first three derivatives.
    pub fn jet(&self, t: f64) -> [SVector<f64, D>; 4] {
        match self.basis.degree {
            ..LOW => self.jet_within::<LOW>(t),
            LOW..MIDDLE => self.jet_within::<MIDDLE>(t),
            _ => self.jet_within::<ALL>(t),
        }
    }

    /// The same for degrees below `N`.
    fn jet_within<const N: usize>(&self, t: f64) -> [SVector<f64, D>; 4] {
        let mut functions: Functions<N> = [[0.0; N]; MOST_ORDER + 1];
        let span = self.basis.evaluate(t, MOST_ORDER, &mut functions);
        let (mut sums, mut weights) = ([SVector::zeros(); 4], [0.0; 4]);
        for k in 0..=self.basis.degree {
            let pole = self.basis.pole(span, k);
            let weight = self.weights.get(pole).copied().unwrap_or(1.0);
            for (order, of_order) in functions.iter().enumerate() {
                let share = of_order[k] * weight;
                sums[order] += self.poles[pole] * share;
                weights[order] += share;
            }
        }
        if self.weights.is_empty() {
            return sums;
        }
        // Leibniz: sums = weights · value, order by order.
        let mut out = [SVector::zeros(); 4];
        for n in 0..4 {
            let mut rest = sums[n];
            for i in 1..=n {
                rest -= out[n - i] * (BINOMIAL[n][i] * weights[i]);
            }
            out[n] = rest / weights[0];
        }
        out
    }
}

/// Binomial coefficients.
const BINOMIAL: [[f64; 4]; 4] =
    [[1.0, 0.0, 0.0, 0.0], [1.0, 1.0, 0.0, 0.0], [1.0, 2.0, 1.0, 0.0], [1.0, 3.0, 3.0, 1.0]];

/// A tensor-product B-spline surface, rational if it has weights other than 1.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SplineSurface {
    /// The bases in both directions.
    pub bases: [Basis; 2],
    /// Weighted poles with their weights; those of one u are consecutive.
    pub poles: Vec<Vector4<f64>>,
    /// Whether the weights differ.
    pub is_rational: bool,
}

impl SplineSurface {
    /// The value and the derivatives up to a total `order`.
    pub fn jet(&self, u: f64, v: f64, order: usize) -> crate::surface::Jet {
        match self.bases[0].degree.max(self.bases[1].degree) {
            ..LOW => self.jet_within::<LOW>(u, v, order),
            LOW..MIDDLE => self.jet_within::<MIDDLE>(u, v, order),
            _ => self.jet_within::<ALL>(u, v, order),
        }
    }

    /// The same for degrees below `N`.
    fn jet_within<const N: usize>(&self, u: f64, v: f64, order: usize) -> crate::surface::Jet {
        let [mut in_u, mut in_v]: [Functions<N>; 2] = [[[0.0; N]; MOST_ORDER + 1]; 2];
        let [basis_u, basis_v] = &self.bases;
        let span_u = basis_u.evaluate(u, order, &mut in_u);
        let span_v = basis_v.evaluate(v, order, &mut in_v);
        let mut sums = [[Vector4::zeros(); 4]; 4];
        let stride = basis_v.poles();
        for k in 0..=basis_u.degree {
            let row = &self.poles[basis_u.pole(span_u, k) * stride..][..stride];
            let mut along = [Vector4::zeros(); 4];
            for l in 0..=basis_v.degree {
                let pole = row[basis_v.pole(span_v, l)];
                for j in 0..=order {
                    along[j] += pole * in_v[j][l];
                }
            }
            for (i, of_order) in in_u.iter().enumerate().take(order + 1) {
                for j in 0..=order - i {
                    sums[i][j] += along[j] * of_order[k];
                }
            }
        }
        let mut jet = crate::surface::Jet::default();
        for i in 0..=order {
            for j in 0..=order - i {
                let mut rest = sums[i][j].xyz();
                if self.is_rational {
                    for a in 0..=i {
                        for b in (0..=j).filter(|b| a + b > 0) {
                            rest -= jet.d[i - a][j - b] * (BINOMIAL[i][a] * BINOMIAL[j][b] * sums[a][b].w);
                        }
                    }
                    rest /= sums[0][0].w;
                }
                jet.d[i][j] = rest;
            }
        }
        jet
    }

    /// The surface, periodic in the directions in which it is closed.
    pub(crate) fn closed(self) -> Self {
        let [rows, columns] = [0, 1].map(|k| self.bases[k].poles());
        let pole = |i: usize, j: usize| self.poles[i * columns + j];
        let size = self.poles.iter().map(|p| (p - self.poles[0]).amax()).fold(0.0, f64::max);
        let is_same = |a: Vector4<f64>, b: Vector4<f64>| (a - b).amax() <= CLOSED * size;
        let [in_u, in_v] = &self.bases;
        let closed_u = in_u.closed(|a, b| (0..columns).all(|j| is_same(pole(a, j), pole(b, j))));
        let closed_v = in_v.closed(|a, b| (0..rows).all(|i| is_same(pole(i, a), pole(i, b))));
        let bases = [closed_u.unwrap_or(in_u.clone()), closed_v.unwrap_or(in_v.clone())];
        let [u, v] = [0, 1].map(|k| bases[k].poles());
        let poles = (0..u).flat_map(|i| (0..v).map(move |j| (i, j))).map(|(i, j)| pole(i, j)).collect();
        Self { bases, poles, ..self }
    }

    /// Whether evaluation finds all poles that it needs.
    pub fn is_sound(&self) -> bool {
        self.bases.iter().all(Basis::is_sound)
            && self.bases[0].poles().checked_mul(self.bases[1].poles()) == Some(self.poles.len())
    }
}
