//! Vertices at places that are no doubles, and signs with them.

use super::tetrahedra::Tetrahedra;
use crate::Point;
use crate::kernel::fixed::{Fixed, orient2d_fixed, orient3d_fixed, orient3d_rounded};
use crate::kernel::predicates::{Sign, orient2d, orient3d};

impl Tetrahedra {
    /// Adds a vertex without tets at an exact place.
    pub fn add_exact_point(&mut self, place: &Fixed) -> u32 {
        let rounded = place.rounded();
        let v = self.add_point(rounded);
        if Fixed::of(&rounded) != Some(*place) {
            self.exact.resize(self.points.len(), None);
            self.exact[v as usize] = Some(Box::new(*place));
        }
        v
    }

    /// The exact place of a vertex, if that differs from its rounded one.
    fn exact(&self, vertex: u32) -> Option<&Fixed> {
        self.exact.get(vertex as usize)?.as_deref()
    }

    /// Whether the coordinates of all vertices are such that exact places on their edges and triangles can be told.
    pub fn fits_exact(&self) -> bool {
        self.points.iter().all(|p| Fixed::of(p).is_some())
    }

    /// Whether a vertex is only near the point it has.
    pub fn is_rounded(&self, vertex: u32) -> bool {
        self.exact(vertex).is_some()
    }

    /// Puts a vertex elsewhere.
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

    /// From now on all vertices are where their points are.
    pub fn forget_exact(&mut self) {
        self.exact.clear();
    }

    /// Puts a vertex at its rounded place if all tets at it stay positive so; uses the marks.
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

    /// The exact place of a vertex.
    ///
    /// # Panics
    /// Where its coordinates are too large or too small for [`Fixed`].
    pub fn place(&self, vertex: u32) -> Fixed {
        match self.exact(vertex) {
            Some(place) => *place,
            None => Fixed::of(self.point(vertex)).expect("coordinates that fit"),
        }
    }

    /// The sign of the volume of four vertices.
    pub(super) fn exact_side(&self, tet: [u32; 4]) -> Sign {
        let [a, b, c, d] = tet.map(|v| self.point(v));
        if tet.iter().all(|&v| !self.is_rounded(v)) {
            return orient3d(a, b, c, d);
        }
        orient3d_rounded([a, b, c, d])
            .unwrap_or_else(|| orient3d_fixed(tet.map(|v| self.place(v)).each_ref()))
    }

    /// The sign of the volume between a face and a point; zero where that is not known, as its coordinates do not fit [`Fixed`].
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

    /// The sign of the area of three vertices' shadow on a coordinate plane.
    pub fn turn(&self, [i, j]: [usize; 2], triangle: [u32; 3]) -> Sign {
        if triangle.iter().any(|&v| self.is_rounded(v)) {
            orient2d_fixed([i, j], triangle.map(|v| self.place(v)).each_ref())
        } else {
            let [a, b, c] = triangle.map(|v| self.point(v)).map(|p| [p[i], p[j]]);
            orient2d(a, b, c)
        }
    }
}
