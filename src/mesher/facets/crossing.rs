//! Facets that intersect.

use super::FacetModel;
use crate::ground::kernel::nearest::in_segment;
use crate::ground::kernel::simplex::area_vector;
use crate::ground::mesh::have_common_body;
use crate::mesher::volume::intersections;
use crate::{Point, Vector};
use csg::PatchId;

/// Intersections deeper than this many roundings of the coordinates are no rounding.
const DEEP: f64 = 100.0;

/// Two facets that intersect outside a common corner or edge.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Crossing {
    /// The patches of the facets.
    pub patches: [PatchId; 2],
    /// A point of the intersection.
    pub at: Point,
    /// About how far one of them must move to be free of the other (length).
    pub depth: f64,
}

impl Crossing {
    /// Two triangles of some patches that intersect at a point.
    pub fn of(patches: [PatchId; 2], triangles: &[[Point; 3]; 2], at: Point) -> Self {
        Self { patches, at, depth: depth(triangles, &at) }
    }
}

impl FacetModel {
    /// Pairs of facets that intersect improperly, by exact predicates, except those of bodies that
    /// touch. Remeshing may remove such intersections if they come from rounding; kept facets with
    /// intersections are rejected by the volume mesher.
    pub fn intersections(&self) -> Vec<Crossing> {
        let triangles: Vec<[u32; 3]> = self.triangles.iter().map(|t| t.vertices.map(|v| v.0)).collect();
        let crossing = |(pair, at): ([u32; 2], Point)| {
            let corners = pair.map(|t| triangles[t as usize].map(|v| self.points[v as usize]));
            Crossing::of(pair.map(|t| self.triangles[t as usize].patch), &corners, at)
        };
        let mut crossings: Vec<Crossing> =
            intersections(&self.points, &triangles).into_iter().map(crossing).collect();
        crossings.retain(|crossing| !self.may_meet(crossing.patches));
        crossings
    }

    /// Whether an intersection is deeper than rounding of the coordinates explains, or the accuracy
    /// that the file states for the edges of faces of one body.
    ///
    /// Where edges of a narrow corner are off their place by more than it is wide, its facets fold,
    /// but not the larger triangles of a mesh.
    pub fn is_deep(&self, crossing: &Crossing) -> bool {
        let [a, b] = crossing.patches.map(|patch| self.patch(patch).inaccuracy);
        let inaccuracy = if self.are_of_different_bodies(crossing) { 0.0 } else { a.max(b) };
        crossing.depth > inaccuracy.max(DEEP * self.rounding)
    }

    /// Whether facets of two patches may intersect, because they are of bodies that touch.
    pub fn may_meet(&self, patches: [PatchId; 2]) -> bool {
        let [a, b] = patches.map(|patch| self.bodies_beside(patch));
        self.touching.may_meet(a, b)
    }

    /// Whether no body is beside both patches of facets that intersect.
    pub fn are_of_different_bodies(&self, crossing: &Crossing) -> bool {
        let [a, b] = crossing.patches.map(|id| self.bodies_beside(id));
        !have_common_body(a, b)
    }
}

/// About how far one of two triangles that intersect at a point must move to be free of the other:
/// out of its plane on the nearer side, or past its nearest edge.
fn depth(pair: &[[Point; 3]; 2], at: &Point) -> f64 {
    let [one, other] = pair;
    let past_edges = [one, other].map(|t| {
        let distance = |k: usize| in_segment(at, &t[k], &t[(k + 1) % 3]).1.sqrt();
        (0..3).map(distance).fold(f64::INFINITY, f64::min)
    });
    let out = beyond(one, other).min(beyond(other, one));
    // The point is on an edge of one triangle, which goes through the other.
    out.min(past_edges[0].max(past_edges[1]))
}

/// The least distance by which a triangle must move along the normal of another one to be on one
/// side of its plane; 0 for a triangle without area.
fn beyond(triangle: &[Point; 3], plane: &[Point; 3]) -> f64 {
    let normal =
        area_vector(&plane[0], &plane[1], &plane[2]).try_normalize(0.0).unwrap_or_else(Vector::zeros);
    let heights = triangle.map(|p| normal.dot(&(p - plane[0])));
    let [above, below] = [1.0, -1.0].map(|sign| heights.iter().map(|h| sign * h).fold(0.0, f64::max));
    above.min(below)
}

#[cfg(test)]
mod tests {
    use super::super::samples::Soup;
    use super::super::{FacetModel, Settings};
    use crate::Point;

    /// A brick, and a tetrahedron whose corner is this deep in a side of it.
    fn brick_and_corner(depth: f64) -> FacetModel {
        let mut soup = Soup::default();
        soup.brick([0.0; 3], [1.0, 3.0, 3.0], false);
        let [a, b, c, d] =
            [[1.0 - depth, 1.6, 1.5], [2.0, 1.0, 1.0], [2.0, 2.1, 1.2], [2.0, 1.5, 2.0]].map(Point::from);
        [[a, c, b], [a, d, c], [a, b, d], [b, c, d]].into_iter().for_each(|t| soup.add(t));
        FacetModel::new(&[soup.facets], &Settings::default()).unwrap()
    }

    #[test]
    fn the_depth_of_an_intersection_is_the_way_out_of_it() {
        for depth in [0.25, 1e-3, 1e-9] {
            let model = brick_and_corner(depth);
            let found = model.intersections();
            let deepest = found.iter().map(|crossing| crossing.depth).fold(0.0, f64::max);
            assert!(!found.is_empty() && deepest <= depth * (1.0 + 1e-6), "{depth}: {found:?}");
            assert!(deepest > 0.1 * depth, "{depth}: {found:?}");
            assert!(found.iter().any(|crossing| model.is_deep(crossing)));
        }
    }

    #[test]
    fn faces_of_one_body_may_intersect_as_deep_as_their_edges_are_off() {
        let mut model = brick_and_corner(1e-3);
        let is_deep =
            |model: &FacetModel| model.intersections().iter().any(|crossing| model.is_deep(crossing));
        let body = model.patches[0].inside;
        for (inside, inaccuracy, deep) in [(body, 1e-2, false), (body, 1e-5, true), (None, 1e-2, true)] {
            model.patches.iter_mut().for_each(|patch| patch.inaccuracy = inaccuracy);
            model.patches.iter_mut().skip(1).for_each(|patch| patch.inside = inside);
            assert_eq!(is_deep(&model), deep, "{inaccuracy}");
        }
    }
}
