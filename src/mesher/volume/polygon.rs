//! Ear clipping of planar polygons with exact predicates.

use super::tetrahedra::Tetrahedra;
use crate::Point;
use crate::ground::kernel::predicates::Sign;
use crate::ground::kernel::simplex::area_vector;

/// A coordinate plane and its orientation, such that a triangle's projection is counter-clockwise.
#[derive(Clone, Copy, Debug)]
pub(super) struct Projection([usize; 2]);

impl Projection {
    /// The coordinate plane with the largest projection of the triangle.
    pub fn of(corners: [&Point; 3]) -> Self {
        let normal = area_vector(corners[0], corners[1], corners[2]);
        let axis = normal.iamax();
        let (i, j) = ((axis + 1) % 3, (axis + 2) % 3);
        Self(if normal[axis] > 0.0 { [i, j] } else { [j, i] })
    }
}

/// Triangulates a counter-clockwise polygon by clipping the best-shaped ear first; `None` if there
/// is no ear.
pub(super) fn triangulate(
    mesh: &Tetrahedra,
    projection: Projection,
    polygon: &[u32],
) -> Option<Vec<[u32; 3]>> {
    let mut left = polygon.to_vec();
    let mut triangles = Vec::with_capacity(left.len().saturating_sub(2));
    while left.len() >= 3 {
        let n = left.len();
        let (mut best, mut best_shape) = (None, f64::NEG_INFINITY);
        for i in 0..n {
            let ear = [left[(i + n - 1) % n], left[i], left[(i + 1) % n]];
            let shape = shape(mesh, ear);
            if shape > best_shape && is_ear(mesh, projection, &left, ear) {
                (best, best_shape) = (Some((i, ear)), shape);
            }
        }
        let (i, ear) = best?;
        triangles.push(ear);
        left.remove(i);
    }
    Some(triangles)
}

/// Twice the area over the squared longest edge: larger is better.
fn shape(mesh: &Tetrahedra, triangle: [u32; 3]) -> f64 {
    let [a, b, c] = triangle.map(|v| mesh.point(v));
    let longest = (b - a).norm_squared().max((c - b).norm_squared()).max((a - c).norm_squared());
    area_vector(a, b, c).norm() / longest
}

fn is_ear(mesh: &Tetrahedra, projection: Projection, polygon: &[u32], ear: [u32; 3]) -> bool {
    let [a, b, c] = ear;
    mesh.turn(projection.0, ear) == Sign::Positive
        && polygon.iter().filter(|v| !ear.contains(v)).all(|&v| {
            [[a, b], [b, c], [c, a]]
                .iter()
                .any(|&[s, t]| mesh.turn(projection.0, [s, t, v]) == Sign::Negative)
        })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_polygon_with_a_notch_and_a_point_on_its_side_is_triangulated() {
        let points: Vec<Point> = [[0., 0.], [2., 0.], [4., 0.], [4., 3.], [2., 1.], [0., 3.]]
            .map(|[x, y]| Point::new(1.0, x, y))
            .to_vec();
        let projection = Projection::of([&points[0], &points[2], &points[3]]);
        let mesh = Tetrahedra::new(points);
        let triangles = triangulate(&mesh, projection, &[0, 1, 2, 3, 4, 5]).unwrap();
        assert_eq!(triangles.len(), 4);
        for t in triangles {
            assert_eq!(mesh.turn(projection.0, t), Sign::Positive);
        }
        assert_eq!(triangulate(&mesh, projection, &[0, 1, 2]), None);
    }
}
