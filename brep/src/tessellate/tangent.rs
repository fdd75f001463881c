//! Curves that touch each other at a corner of a patch, divided alike there.
//!
//! Near such a corner the curves of a file may cross each other by its accuracy, and chords of
//! different lengths cross anyway. So both curves have no vertices until they have crossed, and
//! then opposite ones until chords can no longer cross.

use crate::project::project_to_surface;
use crate::{Curve, EdgeCurve, Fin, Model, On, Point, Surface, Vector, project_to_curve};

/// Curves that cross are at most this far apart before (fraction of the diagonal), or ten times
/// their tolerances.
const CROSSED: f64 = 1e-6;

/// The first place looked at (fraction of a curve), and the factor to the next one.
const FIRST: f64 = 1e-6;
const FACTOR: f64 = 1.5;

/// Chords of curves this far apart, in lengths of the chords, do not cross: the distance between an
/// arc of a radian and its chord is an eighth.
const CLEAR: f64 = 0.25;

/// Sides are compared from this many times the gap between them at their corner on.
const BEYOND: f64 = 10.0;

/// Curves with a larger angle do not touch (radians).
const TOUCHING: f64 = 0.1;

/// Curves are divided alike up to this fraction of them: the rest belongs to their other ends.
const MOST: f64 = 0.5;
/// The most opposite vertices.
const MOST_PAIRS: usize = 1000;

/// Divides the curves of a patch alike where two sides with the same corner touch; `divided` has
/// the parameters of the vertices of each curve, ascending.
pub(super) fn divide_alike(model: &Model, patch: usize, diagonal: f64, divided: &mut [Vec<f64>]) {
    let surface = &model.patches[patch].surface;
    for fins in &model.patches[patch].loops {
        for (k, arriving) in fins.iter().enumerate() {
            let leaving = &fins[(k + 1) % fins.len()];
            let (On::Curve(a), On::Curve(b)) = (arriving.on, leaving.on) else { continue };
            if a == b {
                continue;
            }
            let [one, other] = [(a, arriving, false), (b, leaving, true)]
                .map(|(curve, fin, leaves)| Side::new(model, curve, fin, leaves, &divided[curve]));
            let angle = one.direction().angle(&other.direction());
            if angle.is_nan() || angle > TOUCHING {
                continue;
            }
            let tolerance = model.curves[a].tolerance.max(model.curves[b].tolerance);
            let crossed = (CROSSED * diagonal).max(10.0 * tolerance);
            if let Some(pairs) = opposite(surface, [&one, &other], crossed) {
                divided[a] = one.replaced(pairs.iter().map(|pair| pair[0]));
                divided[b] = other.replaced(pairs.iter().map(|pair| pair[1]));
            }
        }
    }
}

/// A curve as a side of a patch, seen from a corner.
struct Side<'a> {
    model: &'a Model,
    curve: usize,
    fin: &'a Fin,
    /// The parameters at the corner and at the other end.
    ends: [f64; 2],
    /// The parameters of the vertices, ascending.
    divided: Vec<f64>,
}

impl<'a> Side<'a> {
    /// A side that leaves or reaches the corner.
    fn new(model: &'a Model, curve: usize, fin: &'a Fin, leaves: bool, divided: &[f64]) -> Self {
        let [low, high] = model.curves[curve].range;
        let ends = if fin.is_forward == leaves { [low, high] } else { [high, low] };
        Self { model, curve, fin, ends, divided: divided.to_vec() }
    }

    fn parameter(&self, share: f64) -> f64 {
        self.ends[0] + share * (self.ends[1] - self.ends[0])
    }

    fn share(&self, parameter: f64) -> f64 {
        (parameter - self.ends[0]) / (self.ends[1] - self.ends[0])
    }

    fn edge(&self) -> &EdgeCurve {
        &self.model.curves[self.curve]
    }

    fn point(&self, share: f64) -> Point {
        Point::from(self.edge().curve.point(self.parameter(share)))
    }

    /// The direction from the corner.
    fn direction(&self) -> Vector {
        self.edge().curve.jet(self.ends[0])[1] * (self.ends[1] - self.ends[0])
    }

    /// The parameters of the surface there.
    fn on_surface(&self, share: f64) -> [f64; 2] {
        let own = |curve: &Curve<2>| {
            curve.point(self.fin.parameter(self.parameter(share), self.edge().range)).into()
        };
        self.fin.curve.as_ref().map_or([0.0; 2], own)
    }

    /// The share of the curve nearest to a point, near `start`.
    fn nearest(&self, point: &Point, start: f64) -> f64 {
        let edge = self.edge();
        self.share(project_to_curve(&edge.curve, edge.range, point, self.parameter(start)).parameter)
    }

    /// The share of the curve between the vertices around a place.
    fn step(&self, share: f64) -> f64 {
        let t = self.parameter(share);
        let after = self.divided.partition_point(|&at| at <= t).clamp(1, self.divided.len() - 1);
        (self.share(self.divided[after]) - self.share(self.divided[after - 1])).abs()
    }

    /// The parameters with these shares instead of the vertices from the corner to the last of
    /// them.
    fn replaced(&self, shares: impl Iterator<Item = f64> + Clone) -> Vec<f64> {
        let last = shares.clone().fold(0.0, f64::max);
        let kept = |t: &f64| *t == self.ends[0] || self.share(*t) > last;
        let mut all: Vec<f64> = self.divided.iter().copied().filter(kept).collect();
        all.extend(shares.map(|share| self.parameter(share)));
        all.sort_by(f64::total_cmp);
        all.dedup();
        all
    }
}

/// Places of two sides opposite each other.
struct Pair {
    shares: [f64; 2],
    /// How far the other side is to the left of the first one, on the surface.
    left: f64,
    /// The distance of the place of the first side from the corner.
    away: f64,
}

impl Pair {
    /// The place of one side with this share, and that of the other, nearest to it, near `start`.
    fn new(surface: &Surface, [one, other]: [&Side; 2], share: f64, start: f64) -> Self {
        let jet = one.edge().curve.jet(one.parameter(share));
        let point = Point::from(jet[0]);
        let there = other.nearest(&point, start);
        let [u, v] = project_to_surface(surface, &point, one.on_surface(share)).parameters;
        let normal = surface.jet(u, v, 1).normal();
        let left = normal.and_then(|normal| normal.cross(&jet[1]).try_normalize(0.0));
        let across = other.point(there) - point;
        let away = (point - one.point(0.0)).norm();
        Self { shares: [share, there], left: left.map_or(0.0, |left| left.dot(&across)), away }
    }

    fn is_near(&self) -> bool {
        self.shares.iter().all(|share| (0.0..=MOST).contains(share))
    }

    /// Whether a chord of the first side that is so long and ends here cannot cross one of the
    /// other.
    fn is_clear(&self, length: f64) -> bool {
        self.left.abs() > CLEAR * length
    }
}

/// Shares of two sides at vertices opposite each other, from the corner on; `None` if the sides do
/// not touch at the corner, or are further apart than `crossed` before they cross.
fn opposite(surface: &Surface, sides: [&Side; 2], crossed: f64) -> Option<Vec<[f64; 2]>> {
    let [one, other] = sides;
    let mut places = vec![Pair::new(surface, sides, FIRST, 0.0)];
    // The curves of a file do not meet exactly: near the corner this is all that keeps them apart.
    let gap = (one.point(0.0) - other.point(0.0)).norm();
    let is_clear = |pair: &Pair| pair.away > BEYOND * gap && pair.is_clear(pair.away);
    while let Some(last) = places.last().filter(|last| last.is_near() && !is_clear(last)) {
        let next = Pair::new(surface, sides, FACTOR * last.shares[0], last.shares[1]);
        places.push(next);
    }
    // The first place after the last crossing.
    let crosses = |w: &[Pair]| (w[0].left > 0.0) != (w[1].left > 0.0);
    let crossing = places.windows(2).rposition(crosses).map_or(0, |k| k + 1);
    if places.iter().take(crossing).any(|place| place.left.abs() > crossed) {
        return None;
    }
    let first = one.step(0.0).min(other.step(0.0));
    let is_first = |(k, place): &(usize, Pair)| *k >= crossing && place.shares[0] >= first;
    let (_, mut pair) = places.into_iter().enumerate().find(is_first)?;
    let (mut pairs, mut before) = (Vec::new(), 0.0);
    while pair.is_near() && !pair.is_clear(pair.away - before) && pairs.len() < MOST_PAIRS {
        let [share, there] = pair.shares;
        pairs.push(pair.shares);
        before = pair.away;
        let longest = share + one.step(share).min(share);
        let excess = (Pair::new(surface, sides, longest, there).shares[1] - there) / other.step(there);
        pair = Pair::new(surface, sides, share + (longest - share) / excess.max(1.0), there);
    }
    (!pairs.is_empty()).then_some(pairs)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tessellate::{Settings, Tessellation, volume};
    use crate::{BrepError, Unit};

    /// The prism over y ≥ 1 − √(1 − x²), y ≤ x²/2 + x²(x − 0.1)/2: the sides touch at x = 0 and
    /// cross at 0.1, by less than the accuracy that the file states.
    fn crossed_tip(accuracy: &str, ends: [&str; 2]) -> Model {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../geometries/step/crossed_tip.step");
        let mut text = std::fs::read_to_string(path).unwrap();
        let changes = [
            ("LENGTH_MEASURE(1.E-03)".to_owned(), format!("LENGTH_MEASURE({accuracy})")),
            (
                format!("#71 = CARTESIAN_POINT('',({},0.))", MET),
                format!("#71 = CARTESIAN_POINT('',({},0.))", ends[0]),
            ),
            (
                format!("#246 = CARTESIAN_POINT('',({},0.5))", MET),
                format!("#246 = CARTESIAN_POINT('',({},0.5))", ends[1]),
            ),
        ];
        for (old, new) in changes {
            assert!(text.contains(&old), "{old}");
            text = text.replace(&old, &new);
        }
        Model::read_step(text.as_bytes(), Unit::OfFile).unwrap()
    }

    /// The place of the end of the upper side.
    const MET: &str = "0.,0.";

    #[test]
    fn sides_that_cross_at_their_corner_by_the_accuracy_of_the_file_are_divided_alike() {
        assert_divided_alike(crossed_tip("1.E-03", [MET; 2]));
    }

    #[test]
    fn sides_whose_ends_differ_at_their_corner_are_divided_alike() {
        assert_divided_alike(crossed_tip("1.E-03", ["0.,-1.E-06"; 2]));
        assert_divided_alike(crossed_tip("1.E-03", ["-1.E-06,1.E-06", "0.,1.E-06"]));
    }

    /// Asserts that vertices of both sides are opposite each other beyond the place where they
    /// cross.
    fn assert_divided_alike(mut model: Model) {
        let made = Tessellation::of(&mut model, &Settings::default()).unwrap();
        // OpenCASCADE's volume.
        assert!((volume(&model, &made, 0) / 0.021823804500403 - 1.0).abs() < 0.01);
        let is_at_tip = |corner: usize| model.corners[corner].point.xy().coords.norm() < 1e-9;
        let first = |curve: &usize| {
            let (edge, line) = (&model.curves[*curve], &made.lines[*curve]);
            let next = if is_at_tip(edge.ends[0]) { 1 } else { line.len() - 2 };
            made.points[line[next].0 as usize]
        };
        let touching = (0..model.curves.len())
            .filter(|&curve| model.curves[curve].ends.iter().filter(|&&end| is_at_tip(end)).count() == 1);
        for below in [false, true] {
            let points: Vec<Point> =
                touching.clone().map(|c| first(&c)).filter(|p| (p.z < 0.25) == below).collect();
            let &[a, b] = &points[..] else { panic!("{points:?}") };
            assert!(a.x > 0.1 && (a - b).norm() < 0.01 * a.x, "{a} is opposite {b}");
        }
    }

    #[test]
    fn sides_that_cross_by_more_are_refused_with_the_face() {
        let made = Tessellation::of(&mut crossed_tip("1.E-07", [MET; 2]), &Settings::default());
        assert!(matches!(made, Err(BrepError::Face { face: 4 | 5, .. })), "{made:?}");
    }
}
