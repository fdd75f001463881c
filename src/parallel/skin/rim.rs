//! Sizes beside edges that stay.

use crate::ground::kernel::tree::{Tree, bounds};
use crate::ground::progress::Work;
use crate::ground::size::{SizeField, Source, SourceTree};
use crate::{Point, Vector};
use csg::Aabb;

/// Growth of the size away from edges that stay and are shorter, and its decrease away from those
/// that are longer.
const GRADING: f64 = 0.4;

/// The least size beside an edge that stays, in units of its length.
///
/// The two other sides of a triangle at such an edge are longer than it together. If they were to
/// be shorter, they would be halved again and again, and the triangle become flatter each time:
/// edges of up to 1.4 sizes are not split, so the limit is 0.36.
const LEAST: f64 = 0.5;

/// Edges that stay, and the limits of sizes that follow.
pub(super) struct Rim {
    above: SourceTree,
    /// The boxes in which each edge limits sizes from below.
    near: Tree,
    edges: Vec<Source>,
}

impl Rim {
    /// `edges` are the middles and lengths of edges that stay, in the box `around`.
    pub fn new(around: Aabb, edges: Vec<Source>) -> Self {
        let reach = |edge: &Source| {
            let way = Vector::repeat(0.5 * edge.size + LEAST * edge.size / GRADING);
            bounds(&[edge.point - way, edge.point + way])
        };
        let boxes: Vec<Aabb> = edges.iter().map(reach).collect();
        Self {
            above: SourceTree::new(around, GRADING, f64::INFINITY, &edges),
            near: Tree::new(&boxes),
            edges,
        }
    }

    /// The size nearest to a wanted one that fits the edges near a point.
    fn limited(&self, size: f64, point: &Point) -> f64 {
        let mut least: f64 = 0.0;
        self.near.find(point, |edge| {
            let Source { point: middle, size: length } = self.edges[edge as usize];
            let away = ((point - middle).norm() - 0.5 * length).max(0.0);
            least = least.max(LEAST * length - GRADING * away);
            false
        });
        size.min(self.above.size_at(point)).max(least)
    }
}

/// The wanted size, limited by the edges that stay.
pub(super) struct AtRim<'a> {
    pub base: &'a dyn SizeField,
    pub rim: &'a Rim,
}

impl SizeField for AtRim<'_> {
    fn work(&self) -> &Work<'_> {
        self.base.work()
    }

    fn size_at(&self, point: &Point) -> f64 {
        self.rim.limited(self.base.size_at(point), point)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ground::size::UniformSize;

    #[test]
    fn sizes_are_limited_near_edges_that_stay_and_as_wanted_far_away() {
        let edge = |x: f64, size: f64| Source { point: Point::new(x, 0.0, 0.0), size };
        let around = Aabb { min: Point::new(-10.0, -10.0, -10.0), max: Point::new(10.0, 10.0, 10.0) };
        let rim = Rim::new(around, vec![edge(-5.0, 2.0), edge(5.0, 0.1)]);
        let at =
            |h: f64, x: f64| AtRim { base: &UniformSize(h), rim: &rim }.size_at(&Point::new(x, 0.0, 0.0));
        assert_eq!(at(0.2, -5.0), 1.0, "half the long edge");
        assert_eq!(at(0.2, -4.0), 1.0, "its end");
        assert!((at(0.2, -3.0) - 0.6).abs() < 1e-12);
        assert_eq!(at(0.2, 0.0), 0.2);
        assert_eq!(at(1.5, -5.0), 1.5, "between the edge and its half");
        assert!((at(1.5, 5.0) - 0.1).abs() < 0.02, "the short edge: {}", at(1.5, 5.0));
    }
}
