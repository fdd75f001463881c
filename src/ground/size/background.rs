//! Sizes on a background mesh.

use crate::Point;
use crate::ground::kernel::nearest;
use crate::ground::kernel::simplex::volume6;
use crate::ground::kernel::tree::Tree;
use crate::ground::mesh::TET_FACES;
use csg::Aabb;

/// How far outside a tet, in barycentric coordinates, a point still counts as inside: rounding.
const OUTSIDE: f64 = -1e-12;

/// Why sizes on a background mesh cannot be used.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum BackgroundError {
    /// There are no tets.
    #[error("the background mesh has no tets")]
    Empty,
    /// There is not one size for each point.
    #[error("the background mesh has {points} points and {sizes} sizes: it needs one for each")]
    Sizes {
        /// The number of points.
        points: usize,
        /// The number of sizes.
        sizes: usize,
    },
    /// A coordinate is not finite.
    #[error("point {point} of the background mesh has a coordinate that is not finite")]
    NotFinite {
        /// The point, from 0.
        point: usize,
    },
    /// A size is not a positive finite number.
    #[error("point {point} of the background mesh has the size {size}: sizes are positive numbers")]
    Size {
        /// The point, from 0.
        point: usize,
        /// Its size.
        size: f64,
    },
    /// A tet has a point that does not exist.
    #[error("tet {tet} of the background mesh has the point {point} of {points}")]
    Index {
        /// The tet, from 0.
        tet: usize,
        /// The point.
        point: u32,
        /// The number of points.
        points: usize,
    },
}

/// Sizes at the points of a tetrahedral mesh, linear in each tet.
pub(super) struct Background {
    points: Vec<Point>,
    tets: Vec<[u32; 4]>,
    sizes: Vec<f64>,
    tree: Tree,
}

impl Background {
    pub(super) fn new(
        points: &[[f64; 3]],
        tets: &[[u32; 4]],
        sizes: &[f64],
    ) -> Result<Self, BackgroundError> {
        if tets.is_empty() {
            return Err(BackgroundError::Empty);
        }
        if points.len() != sizes.len() {
            return Err(BackgroundError::Sizes { points: points.len(), sizes: sizes.len() });
        }
        if let Some(point) = points.iter().position(|point| !point.iter().all(|x| x.is_finite())) {
            return Err(BackgroundError::NotFinite { point });
        }
        if let Some(point) = sizes.iter().position(|size| !(size.is_finite() && *size > 0.0)) {
            return Err(BackgroundError::Size { point, size: sizes[point] });
        }
        for (tet, vertices) in tets.iter().enumerate() {
            if let Some(&point) = vertices.iter().find(|&&vertex| vertex as usize >= points.len()) {
                return Err(BackgroundError::Index { tet, point, points: points.len() });
            }
        }
        let points: Vec<Point> = points.iter().map(|&point| point.into()).collect();
        let around = |tet: &[u32; 4]| {
            let [first, rest @ ..] = tet.map(|vertex| points[vertex as usize]);
            let (min, max) = rest.iter().fold((first, first), |(low, high), p| (low.inf(p), high.sup(p)));
            Aabb { min, max }
        };
        let tree = Tree::new(&tets.iter().map(around).collect::<Vec<_>>());
        Ok(Self { points, tets: tets.to_vec(), sizes: sizes.to_vec(), tree })
    }

    fn corners(&self, tet: u32) -> [Point; 4] {
        self.tets[tet as usize].map(|vertex| self.points[vertex as usize])
    }

    /// The size at a point; outside the mesh that of its nearest point.
    pub(super) fn at(&self, point: &Point) -> f64 {
        let mut weights = [0.0; 4];
        let inside = self.tree.find(point, |tet| match barycentric(&self.corners(tet), point) {
            Some(found) if found.iter().all(|weight| *weight >= OUTSIDE) => {
                weights = found;
                true
            }
            _ => false,
        });
        let tet = inside.unwrap_or_else(|| {
            let squared = |tet: u32| self.nearest(tet, point).0;
            let (tet, _) = self.tree.nearest(point, squared).expect("there are tets");
            weights = self.nearest(tet, point).1;
            tet
        });
        let sizes = self.tets[tet as usize].map(|vertex| self.sizes[vertex as usize]);
        weights.iter().zip(sizes).map(|(weight, size)| weight * size).sum()
    }

    /// The squared distance of the nearest point of a tet's boundary, and its barycentric
    /// coordinates in the tet.
    fn nearest(&self, tet: u32, point: &Point) -> (f64, [f64; 4]) {
        let corners = self.corners(tet);
        let of_face = |face: [usize; 3]| {
            let triangle = face.map(|corner| corners[corner]);
            let on_face = nearest::in_triangle(point, &triangle);
            let mut weights = [0.0; 4];
            (0..3).for_each(|k| weights[face[k]] = on_face[k]);
            ((nearest::at(&triangle, on_face) - point).norm_squared(), weights)
        };
        let faces = TET_FACES.map(of_face);
        faces.into_iter().min_by(|a, b| a.0.total_cmp(&b.0)).expect("a tet has faces")
    }
}

/// The barycentric coordinates of a point, unless the tet is flat.
fn barycentric(corners: &[Point; 4], point: &Point) -> Option<[f64; 4]> {
    let volume = |[a, b, c, d]: &[Point; 4]| volume6(a, b, c, d);
    let whole = volume(corners);
    let weight = |corner: usize| {
        let mut replaced = *corners;
        replaced[corner] = *point;
        volume(&replaced) / whole
    };
    (whole != 0.0).then(|| [0, 1, 2, 3].map(weight))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two tets over the triangle (0, 0, 0), (1, 0, 0), (0, 1, 0), and a flat one.
    const POINTS: [[f64; 3]; 5] =
        [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, -1.0]];
    const TETS: [[u32; 4]; 3] = [[0, 1, 2, 3], [0, 2, 1, 4], [0, 3, 4, 1]];

    fn linear(p: [f64; 3]) -> f64 {
        4.0 + p[0] - 2.0 * p[1] + 0.5 * p[2]
    }

    #[test]
    fn sizes_are_linear_inside_and_continue_outside() {
        let sizes = POINTS.map(linear);
        let background = Background::new(&POINTS, &TETS, &sizes).unwrap();
        for inside in [[0.2, 0.3, 0.1], [0.2, 0.3, -0.4], [0.0, 0.0, 1.0], [0.5, 0.5, 0.0], [0.25, 0.0, 0.0]]
        {
            let size = background.at(&inside.into());
            assert!((size - linear(inside)).abs() < 1e-12, "{inside:?}: {size}");
        }
        // Nearest to a corner, an edge and a face.
        let outside = [([0.0, 0.0, 7.0], [0.0, 0.0, 1.0]), ([0.4, -2.0, 0.0], [0.4, 0.0, 0.0])];
        for (point, nearest) in outside.into_iter().chain([([-1.0, 0.2, 0.3], [0.0, 0.2, 0.3])]) {
            let size = background.at(&point.into());
            assert!((size - linear(nearest)).abs() < 1e-12, "{point:?}: {size}");
        }
    }

    #[test]
    fn wrong_arrays_are_refused() {
        let sizes = [1.0; 5];
        let refused = |points: &[[f64; 3]], tets: &[[u32; 4]], sizes: &[f64]| {
            Background::new(points, tets, sizes).err().expect("it is wrong")
        };
        assert_eq!(refused(&POINTS, &[], &sizes), BackgroundError::Empty);
        assert_eq!(refused(&POINTS, &TETS, &sizes[1..]), BackgroundError::Sizes { points: 5, sizes: 4 });
        assert_eq!(
            refused(&POINTS, &[[0, 1, 2, 5]], &sizes),
            BackgroundError::Index { tet: 0, point: 5, points: 5 }
        );
        for size in [0.0, -1.0, f64::INFINITY] {
            let wrong = [1.0, 1.0, size, 1.0, 1.0];
            assert_eq!(refused(&POINTS, &TETS, &wrong), BackgroundError::Size { point: 2, size });
        }
        let mut points = POINTS;
        points[3][1] = f64::NAN;
        assert_eq!(refused(&points, &TETS, &sizes), BackgroundError::NotFinite { point: 3 });
    }
}
