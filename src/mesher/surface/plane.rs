//! Constrained Delaunay triangulation in the plane; the only file that uses spade.

use spade::{ConstrainedDelaunayTriangulation, HasPosition, Point2, Triangulation};

/// A vertex that stores its number.
struct Numbered {
    position: Point2<f64>,
    number: u32,
}

impl HasPosition for Numbered {
    type Scalar = f64;
    fn position(&self) -> Point2<f64> {
        self.position
    }
}

/// Smaller coordinates are replaced by zero, because spade rejects values below 2⁻¹⁴².
const TINY: f64 = 1e-40;

/// The constrained Delaunay triangulation of the convex hull of `points`, as counter-clockwise
/// triangles.
///
/// Edges that cross others or pass through points are not edges of the result, and of points at the
/// same position only one is used; the caller must check.
///
/// `None` if a coordinate is not finite or too large.
pub(crate) fn triangulate(points: &[[f64; 2]], edges: &[[u32; 2]]) -> Option<Vec<[u32; 3]>> {
    let clean = |x: f64| if x.abs() < TINY { 0.0 } else { x };
    let vertices = points
        .iter()
        .enumerate()
        .map(|(k, p)| Numbered { position: Point2::new(clean(p[0]), clean(p[1])), number: k as u32 })
        .collect();
    let edges = edges.iter().map(|e| e.map(|v| v as usize)).collect();
    let cdt: ConstrainedDelaunayTriangulation<Numbered> =
        ConstrainedDelaunayTriangulation::try_bulk_load_cdt(vertices, edges, |_| ()).ok()?;
    Some(cdt.inner_faces().map(|face| face.vertices().map(|v| v.data().number)).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_required_diagonal_is_an_edge() {
        let square = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
        for diagonal in [[0, 2], [1, 3]] {
            let triangles = triangulate(&square, &[diagonal]).expect("plain numbers");
            assert_eq!(triangles.len(), 2);
            assert!(triangles.iter().all(|t| diagonal.iter().all(|v| t.contains(v))));
        }
    }
}
