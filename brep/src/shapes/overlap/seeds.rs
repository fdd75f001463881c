//! Places where triangles of two faces cross.

use crate::shapes::imprint::overlap;
use crate::tessellate::Tessellation;
use crate::{Point, Vector};

/// A triangle of a face with the parameters of its corners.
pub(super) struct Facet {
    points: [Point; 3],
    parameters: [[f64; 2]; 3],
    bounds: [Point; 2],
}

impl Facet {
    /// The parameters of its middle.
    fn middle(&self) -> [f64; 2] {
        [0, 1].map(|i| self.parameters.iter().map(|p| p[i]).sum::<f64>() / 3.0)
    }

    /// Where a segment passes through it.
    fn hit(&self, [p, q]: [Point; 2]) -> Option<Point> {
        let [a, b, c] = self.points;
        let normal = (b - a).cross(&(c - a));
        let [s, t] = [p, q].map(|x| normal.dot(&(x - a)));
        if (s < 0.0) == (t < 0.0) {
            return None;
        }
        let at = p + (q - p) * (s / (s - t));
        let left = |from: Point, to: Point| normal.dot(&(to - from).cross(&(at - from))) >= 0.0;
        (left(a, b) && left(b, c) && left(c, a)).then_some(at)
    }

    fn sides(&self) -> [[Point; 2]; 3] {
        let [a, b, c] = self.points;
        [[a, b], [b, c], [c, a]]
    }
}

/// The triangles of all patches, and the boxes around each patch.
pub(super) struct Facets {
    pub of: Vec<Vec<Facet>>,
    pub bounds: Vec<[Point; 2]>,
}

impl Facets {
    pub fn new(tessellation: &Tessellation, patches: usize) -> Self {
        let mut of: Vec<Vec<Facet>> = (0..patches).map(|_| Vec::new()).collect();
        for triangle in &tessellation.triangles {
            let points = triangle.vertices.map(|v| tessellation.points[v as usize]);
            let [a, b, c] = points;
            let bounds = [a.inf(&b).inf(&c), a.sup(&b).sup(&c)];
            of[triangle.patch as usize].push(Facet { points, parameters: triangle.parameters, bounds });
        }
        let bounds = of.iter().map(|facets| around(facets.iter().map(|facet| facet.bounds))).collect();
        Self { of, bounds }
    }

    /// The common part of the boxes of two patches; `None` if they are more than `room` apart.
    pub fn common(&self, [a, b]: [usize; 2], room: f64) -> Option<[Point; 2]> {
        let [a, b] = [&self.bounds[a], &self.bounds[b]];
        let (low, high) = (a[0].sup(&b[0]).map(|x| x - room), a[1].inf(&b[1]).map(|x| x + room));
        (0..3).all(|axis| low[axis] <= high[axis]).then_some([low, high])
    }

    /// Whether points are in a box that is at most `room` from that of a patch.
    pub fn is_near(&self, patch: usize, points: impl Iterator<Item = Point>, room: f64) -> bool {
        let [low, high] = around(points.map(|point| [point; 2]));
        let there = self.bounds[patch];
        (0..3).all(|i| low[i] <= there[1][i] + room && there[0][i] <= high[i] + room)
    }

    /// Places where triangles of two patches cross, each with parameters on both near it.
    pub fn crossings(&self, [a, b]: [usize; 2]) -> Vec<(Point, [[f64; 2]; 2])> {
        let Some(common) = self.common([a, b], 0.0) else { return Vec::new() };
        let near = |patch: usize| {
            let mut near: Vec<&Facet> =
                self.of[patch].iter().filter(|facet| overlap(&facet.bounds, &common)).collect();
            near.sort_by(|s, t| s.bounds[0].x.total_cmp(&t.bounds[0].x));
            near
        };
        let (of_a, of_b) = (near(a), near(b));
        let mut found = Vec::new();
        let mut first = 0;
        let widest = of_b.iter().map(|facet| facet.bounds[1].x - facet.bounds[0].x).fold(0.0, f64::max);
        for one in of_a {
            while first < of_b.len() && of_b[first].bounds[0].x + widest < one.bounds[0].x {
                first += 1;
            }
            let beside = of_b[first..].iter().take_while(|other| other.bounds[0].x <= one.bounds[1].x);
            for other in beside.filter(|other| overlap(&one.bounds, &other.bounds)) {
                let hits = one.sides().into_iter().filter_map(|side| other.hit(side));
                let hits: Vec<Point> =
                    hits.chain(other.sides().into_iter().filter_map(|side| one.hit(side))).collect();
                if let Some(first) = hits.first() {
                    let sum: Vector = hits.iter().map(|hit| hit - first).sum();
                    found.push((first + sum / hits.len() as f64, [one.middle(), other.middle()]));
                }
            }
        }
        found
    }
}

/// The box around boxes.
fn around(boxes: impl Iterator<Item = [Point; 2]>) -> [Point; 2] {
    let least = Point::from(Vector::repeat(f64::INFINITY));
    boxes.fold([least, -least], |[low, high], bounds| [low.inf(&bounds[0]), high.sup(&bounds[1])])
}
