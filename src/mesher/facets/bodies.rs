//! Whether points are in the bodies of facets.

use super::FacetModel;
use crate::Point;
use crate::ground::kernel::tree::{Tree, bounds};
use csg::Aabb;

/// The outer facets of all bodies, for tests of points.
#[derive(Debug)]
pub struct FacetBodies {
    tree: Tree,
    facets: Vec<[Point; 3]>,
    /// An x beyond all facets.
    beyond: f64,
}

impl FacetBodies {
    /// Collects the facets with a body on one side only.
    pub fn new(model: &FacetModel) -> Self {
        let is_outer = |patch| model.patch(patch).outside.is_none();
        let triangles = model.triangles.iter().filter(|t| is_outer(t.patch));
        let facets: Vec<[Point; 3]> =
            triangles.map(|t| t.vertices.map(|v| model.points[v.index()])).collect();
        let tree = Tree::new(&facets.iter().map(bounds).collect::<Vec<Aabb>>());
        let beyond = model.bounds.max.x + model.bounds.diagonal();
        Self { tree, facets, beyond }
    }

    /// Whether a point is in a body. Rounding decides for points within rounding of a facet, and
    /// for those whose ray along x meets an edge.
    pub fn contain(&self, point: &Point) -> bool {
        let mut is_inside = false;
        self.tree.along(point, &Point::new(self.beyond, point.y, point.z), |facet| {
            is_inside ^= is_before(point, &self.facets[facet as usize]);
            true
        });
        is_inside
    }
}

/// Whether the ray from a point along x meets a facet.
fn is_before(point: &Point, [a, b, c]: &[Point; 3]) -> bool {
    let area = |p: &Point, q: &Point| (p.y - point.y) * (q.z - point.z) - (p.z - point.z) * (q.y - point.y);
    let [u, v, w] = [area(b, c), area(c, a), area(a, b)];
    let sum = u + v + w;
    let is_met = (u >= 0.0 && v >= 0.0 && w >= 0.0) || (u <= 0.0 && v <= 0.0 && w <= 0.0);
    is_met && sum != 0.0 && (u * a.x + v * b.x + w * c.x) / sum > point.x
}
