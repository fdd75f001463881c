//! Vertices whose positions are not representable in double precision, and exact predicates for
//! them.

use super::tetrahedra::Tetrahedra;
use crate::Point;
use crate::ground::kernel::fixed::{Fixed, orient2d_fixed, orient3d_fixed, orient3d_rounded};
use crate::ground::kernel::predicates::{Sign, orient2d, orient3d};

impl Tetrahedra {
    /// Adds a vertex without tets at an exact position.
    pub fn add_exact_point(&mut self, place: &Fixed) -> u32 {
        let rounded = place.rounded();
        let v = self.add_point(rounded);
        if Fixed::of(&rounded) != Some(*place) {
            self.exact.resize(self.points.len(), None);
            self.exact[v as usize] = Some(Box::new(*place));
        }
        v
    }

    /// The exact position of a vertex, if it differs from its rounded one.
    fn exact(&self, vertex: u32) -> Option<&Fixed> {
        self.exact.get(vertex as usize)?.as_deref()
    }

    /// Whether the coordinates of all vertices fit [`Fixed`], so that exact points on their edges
    /// and triangles are representable.
    pub fn fits_exact(&self) -> bool {
        self.points.iter().all(|p| Fixed::of(p).is_some())
    }

    /// Whether the stored point of a vertex is only a rounding of its exact position.
    pub fn is_rounded(&self, vertex: u32) -> bool {
        self.exact(vertex).is_some()
    }

    /// Moves a vertex to an exact position.
    pub fn put_at(&mut self, vertex: u32, place: &Fixed) {
        let rounded = place.rounded();
        self.points[vertex as usize] = rounded;
        let is_rounded = Fixed::of(&rounded) != Some(*place);
        if is_rounded && self.exact.len() <= vertex as usize {
            self.exact.resize(self.points.len(), None);
        }
        if let Some(exact) = self.exact.get_mut(vertex as usize) {
            *exact = is_rounded.then(|| Box::new(*place));
        }
    }

    /// Makes the rounded positions the exact ones.
    pub fn forget_exact(&mut self) {
        self.exact.clear();
    }

    /// Moves a vertex to its rounded position if all its tets stay positive; uses the marks.
    pub fn round_in_place(&mut self, vertex: u32) -> bool {
        let Some(place) = self.exact.get_mut(vertex as usize).and_then(Option::take) else { return true };
        let mut star = Vec::new();
        self.star(vertex, &mut star);
        let stays = star.iter().all(|&t| self.is_positive(self.tets[t as usize]));
        if !stays {
            self.exact[vertex as usize] = Some(place);
        }
        stays
    }

    /// The exact position of a vertex.
    ///
    /// # Panics
    /// If its coordinates are too large or too small for [`Fixed`].
    pub fn place(&self, vertex: u32) -> Fixed {
        match self.exact(vertex) {
            Some(place) => *place,
            None => Fixed::of(self.point(vertex)).expect("coordinates that fit"),
        }
    }

    /// The sign of the volume of the tet of four vertices.
    pub(super) fn exact_side(&self, tet: [u32; 4]) -> Sign {
        let [a, b, c, d] = tet.map(|v| self.point(v));
        if tet.iter().all(|&v| !self.is_rounded(v)) {
            return orient3d(a, b, c, d);
        }
        orient3d_rounded([a, b, c, d])
            .unwrap_or_else(|| orient3d_fixed(tet.map(|v| self.place(v)).each_ref()))
    }

    /// The sign of the volume of the tet of a face and a point; zero if it is unknown because the
    /// coordinates do not fit [`Fixed`].
    pub fn side_of(&self, face: [u32; 3], point: &Point) -> Sign {
        let [a, b, c] = face.map(|v| self.point(v));
        if face.iter().all(|&v| !self.is_rounded(v)) {
            return orient3d(a, b, c, point);
        }
        orient3d_rounded([a, b, c, point]).unwrap_or_else(|| {
            let [a, b, c] = face.map(|v| self.place(v));
            Fixed::of(point).map_or(Sign::Zero, |point| orient3d_fixed([&a, &b, &c, &point]))
        })
    }

    /// The orientation of three vertices projected on a coordinate plane.
    pub fn turn(&self, [i, j]: [usize; 2], triangle: [u32; 3]) -> Sign {
        if triangle.iter().any(|&v| self.is_rounded(v)) {
            orient2d_fixed([i, j], triangle.map(|v| self.place(v)).each_ref())
        } else {
            let [a, b, c] = triangle.map(|v| self.point(v)).map(|p| [p[i], p[j]]);
            orient2d(a, b, c)
        }
    }
}
