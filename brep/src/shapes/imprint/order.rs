//! The order of edges around a corner on a surface.

use super::regions::{Half, Sheet};
use crate::chart::Parameters;
use crate::{Point, Vector};

/// Directions around a corner are those of points this far along the strips (fraction of the
/// shortest there), ...
const AROUND: f64 = 0.1;
/// ... or this many times as far as strips start beside the corner, ...
const BEYOND: f64 = 10.0;
/// ... but not further than this (fraction of the shortest there).
const FARTHEST: f64 = 0.5;

/// Normals this far apart (radians) beside a corner are on both sides of a crease.
const CREASE: f64 = 0.5;

impl Sheet<'_> {
    /// Half-edges from a corner, counterclockwise.
    pub fn sorted(&self, corner: usize, halves: Vec<Half>) -> Option<Vec<Half>> {
        let first = &self.strips[halves[0] / 2].nodes;
        let [u, v] = if halves[0].is_multiple_of(2) { first[0] } else { first[first.len() - 1] };
        let normal = self.chart.normal([u, v])?;
        let point = self.shapes.corners[corner].point;
        let shortest = halves.iter().map(|half| self.strips[half / 2].length).fold(f64::INFINITY, f64::min);
        let off = halves.iter().map(|&half| (self.start(half) - point).norm()).fold(0.0, f64::max);
        let step = (AROUND * shortest).max(BEYOND * off).min(FARTHEST * shortest);
        let ahead: Vec<Point> = halves.iter().map(|&half| self.ahead(half, step)).collect();
        let angles = self.around_crease([u, v], &normal, &halves, &ahead);
        let angles = angles.or_else(|| {
            let ways: Vec<Vector> = ahead.iter().map(|ahead| ahead - point).collect();
            let x = (ways[0] - normal * normal.dot(&ways[0])).try_normalize(0.0)?;
            let y = normal.cross(&x);
            Some(ways.iter().map(|way| way.dot(&y).atan2(way.dot(&x))).collect::<Vec<f64>>())
        });
        let mut keyed: Vec<(f64, Half)> = angles?.into_iter().zip(halves).collect();
        keyed.sort_by(|a, b| a.0.total_cmp(&b.0));
        Some(keyed.into_iter().map(|(_, half)| half).collect())
    }

    /// The angles of half-edges around a place of a crease, in the parameters: seen along the
    /// normal of one side of it, those on the other side may be anywhere. `None` if there is none.
    fn around_crease(
        &self,
        at: Parameters,
        normal: &Vector,
        halves: &[Half],
        ahead: &[Point],
    ) -> Option<Vec<f64>> {
        let way = |(&half, ahead): (&Half, &Point)| {
            let nodes = &self.strips[half / 2].nodes;
            let last = nodes.len() - 1;
            let [from, beside] = if half.is_multiple_of(2) { [0, 1] } else { [last, last - 1] };
            [nodes[from], self.chart.near(ahead, nodes[beside])]
        };
        let ways: Vec<[Parameters; 2]> = halves.iter().zip(ahead).map(way).collect();
        let bends =
            |way: &[Parameters; 2]| self.chart.normal(way[1]).is_some_and(|n| n.angle(normal) > CREASE);
        if !ways.iter().any(bends) {
            return None;
        }
        let scale = self.chart.derivatives(at).map(|along| along.norm());
        let angle = |[p, q]: &[Parameters; 2]| ((q[1] - p[1]) * scale[1]).atan2((q[0] - p[0]) * scale[0]);
        Some(ways.iter().map(angle).collect())
    }

    /// Where the curve of a half-edge starts: beside its corner in files that are less accurate.
    fn start(&self, half: Half) -> Point {
        let edge = &self.shapes.curves[self.strips[half / 2].curve];
        Point::from(edge.curve.point(edge.range[half % 2]))
    }

    /// A point of a half-edge at a distance from its start.
    fn ahead(&self, half: Half, step: f64) -> Point {
        let edge = &self.shapes.curves[self.strips[half / 2].curve];
        let [from, to] = if half.is_multiple_of(2) { edge.range } else { [edge.range[1], edge.range[0]] };
        let at = |share: f64| Point::from(edge.curve.point(from + share * (to - from)));
        let start = at(0.0);
        let (mut near, mut far) = (0.0, 0.5);
        for _ in 0..30 {
            let middle = 0.5 * (near + far);
            if (at(middle) - start).norm() < step { near = middle } else { far = middle }
        }
        at(far)
    }
}

#[cfg(test)]
mod tests {
    use super::super::regions::divided;
    use crate::bspline::{Basis, SplineCurve};
    use crate::shapes::tests::{Solids, X, Y, Z};
    use crate::{Curve, Surface, Vector};

    #[test]
    fn a_face_is_divided_along_a_sharp_crease() {
        // Two walls of one surface with less than a right angle between them.
        let profile = [X * -1.0 + Z * 0.1, Vector::zeros(), X * -0.2 + Z];
        let basis = Basis::clamped(1, &[0.0, 1.0, 2.0], 1).unwrap();
        let curve = Curve::Spline(SplineCurve { basis, poles: profile.to_vec(), weights: Vec::new() });
        let mut solids = Solids::default();
        // Its ends rise along the crease.
        let low = [profile[0] + Y * 0.5, profile[1], profile[2] + Y * 0.1];
        let around = [low[0], low[1], low[2], low[2] + Y, low[1] + Y, low[0] + Y];
        solids.polygon(Surface::Extrusion { curve, direction: Y }, &around);
        let crease = solids.line(1, 4);
        let parts = divided(&solids.into_shapes(), 0, &[crease], 2.0).expect("the crease divides it");
        let mut lengths: Vec<usize> = parts.iter().map(|loops| loops[0].len()).collect();
        lengths.sort_unstable();
        assert_eq!(lengths, [4, 4]);
    }
}
