//! Lengths of curves.

use crate::{CurveId, Point, Projector};

/// Relative accuracy at which a length is accepted.
const ACCURATE: f64 = 1e-12;

/// Most halvings of a step of the trace.
const MOST_HALVINGS: usize = 10;

impl Projector {
    /// The length of a curve along its trace, accurate to rounding where the curve is smooth.
    ///
    /// Points between those of the trace are projections of points of the chords. The lengths of
    /// polygons through 2ᵏ such points are extrapolated (Romberg 1955).
    pub fn curve_length(&self, curve: CurveId, trace: &[Point]) -> f64 {
        let at = |p: Point| self.project_curve(curve, &p).unwrap_or(p);
        trace.windows(2).map(|ends| step_length([ends[0], ends[1]], &at)).sum()
    }
}

/// The length of the curve between two points; `at` projects to it.
fn step_length([from, to]: [Point; 2], at: &dyn Fn(Point) -> Point) -> f64 {
    let mut row = vec![(to - from).norm()];
    for halvings in 1..=MOST_HALVINGS {
        let pieces = 1_u32 << halvings;
        let point = |i: u32| match i {
            0 => from,
            i if i == pieces => to,
            i => at(from + (to - from) * (f64::from(i) / f64::from(pieces))),
        };
        let mut next = vec![(0..pieces).map(|i| (point(i + 1) - point(i)).norm()).sum::<f64>()];
        let mut power = 1.0;
        for (k, before) in row.iter().enumerate() {
            power *= 4.0;
            next.push(next[k] + (next[k] - before) / (power - 1.0));
        }
        let change = (next[halvings] - row[halvings - 1]).abs();
        row = next;
        if change <= ACCURATE * row[halvings] {
            break;
        }
    }
    row[row.len() - 1]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Features;

    /// The lengths of the curves of a geometry, ascending.
    fn lengths(text: &str) -> Vec<f64> {
        let geometry = crate::language::parse_geometry(text, "a.geo").unwrap().geometry;
        let features = Features::find(&geometry).unwrap();
        let projector = Projector::new(&geometry, &features);
        let of = |(i, curve): (usize, &crate::Curve)| projector.curve_length(CurveId::new(i), &curve.trace);
        let mut lengths: Vec<f64> = features.curves.iter().enumerate().map(of).collect();
        lengths.sort_unstable_by(f64::total_cmp);
        lengths
    }

    #[test]
    fn lengths_of_circles_and_ellipses_are_exact() {
        let cut = "algebraic3d\nsolid c = cylinder (0,0,0; 0,0,1; 1) and plane (0,0,0; 0,0,-1) \
                   and plane (0,0,3; 0,1,1);\ntlo c;\n";
        // The ellipse has the semi-axes 1 and √2; its perimeter is 4·√2·E(1/√2).
        let ellipse = 4.0 * 2.0_f64.sqrt() * 1.350_643_881_047_675_5;
        for (found, exact) in lengths(cut).into_iter().zip([std::f64::consts::TAU, ellipse]) {
            assert!((found / exact - 1.0).abs() < 1e-11, "{found}, {exact}");
        }
    }
}
