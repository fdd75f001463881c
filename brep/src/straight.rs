//! Curves on surfaces along straight lines in their parameters.

use crate::bspline::{Basis, SplineCurve};
use crate::{Surface, Vector};

/// A spline over [0, 1] along a straight line in the parameters of a surface, and its largest
/// distance from the point of the surface there, in the middle of its segments.
///
/// It has the least number of segments for which that distance is at most `room`, by powers of two
/// between the `least` and the `most`.
pub(crate) fn along_straight(
    surface: &Surface,
    [from, to]: [[f64; 2]; 2],
    [least, most]: [usize; 2],
    room: f64,
) -> (SplineCurve<3>, f64) {
    let at = |t: f64| [0, 1].map(|i| from[i] + (to[i] - from[i]) * t);
    let mut segments = least;
    loop {
        let place = |k: usize| k as f64 / segments as f64;
        let node = |k: usize| {
            let [u, v] = at(place(k));
            let d = surface.jet(u, v, 1).d;
            [d[0][0], d[1][0] * (to[0] - from[0]) + d[0][1] * (to[1] - from[1])]
        };
        let curve = cubic(&(0..=segments).map(node).collect::<Vec<_>>());
        let gap = |k: usize| {
            let t = 0.5 * (place(k) + place(k + 1));
            (surface.point(at(t)).coords - curve.jet(t)[0]).norm()
        };
        let gap = (0..segments).map(gap).fold(0.0, f64::max);
        if gap <= room || segments >= most {
            return (curve, gap);
        }
        segments *= 2;
    }
}

/// A cubic spline over [0, 1] through points with derivatives.
fn cubic(nodes: &[[Vector; 2]]) -> SplineCurve<3> {
    let count = nodes.len() - 1;
    let knots: Vec<f64> = (0..=count).map(|k| k as f64 / count as f64).collect();
    let third = 1.0 / (3.0 * count as f64);
    let mut poles = vec![nodes[0][0]];
    for w in nodes.windows(2) {
        poles.extend([w[0][0] + w[0][1] * third, w[1][0] - w[1][1] * third]);
    }
    poles.push(nodes[count][0]);
    let basis = Basis::clamped(3, &knots, 2).expect("the knots of a cubic spline");
    SplineCurve { basis, poles, weights: Vec::new() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::chart::tests::torus;
    use std::f64::consts::TAU;

    #[test]
    fn curves_are_on_their_surface_however_often_they_bend() {
        let torus = torus();
        for (turns, least) in [(0.3, 1), (1.0, 64), (40.0, 64)] {
            let to = [turns * TAU, TAU];
            let (curve, gap) = along_straight(&torus, [[0.0; 2], to], [least, 16_384], 6e-6);
            assert!(gap <= 6e-6, "{gap:e}");
            for k in 0..=1000 {
                let t = f64::from(k) / 1000.0;
                let off = (torus.point([t * to[0], t * to[1]]).coords - curve.jet(t)[0]).norm();
                assert!(off <= 1.01 * gap, "{off:e} instead of {gap:e}");
            }
        }
    }
}
