//! The wanted size at vertices and at points between them.
//!
//! The size at a vertex is that of the field, or of the boundary edges if that is less, and at most
//! the size at any other vertex plus the growth from there. So the gradient of any field is limited
//! (Borouchaki, Hecht, Frey 1998), also if the field jumps or is infinite; on the coarse side of a
//! jump sizes are smaller than requested.

use super::points::{Filler, State};
use super::tetrahedra::Tetrahedra;
use crate::Point;
use crate::mesher::half_face::NONE;
use rayon::prelude::*;

/// Sizes are lowered only if they are too large by this factor.
const LOWER: f64 = 1.05;

/// Boundary edges made for a size h vary; the field is not reduced if it is up to this many times
/// the mean edge at a vertex.
const SKIN_TOLERANCE: f64 = 1.25;

/// The sum and the number of boundary edge lengths at each vertex, each edge counted once per
/// locked half-face.
fn skin_edges(mesh: &Tetrahedra) -> Vec<(f64, u32)> {
    let mut skin = vec![(0.0, 0u32); mesh.points.len()];
    for half_face in mesh.alive().flat_map(|t| 4 * t..4 * t + 4).filter(|&h| mesh.is_locked(h)) {
        let [a, b, c] = mesh.face(half_face);
        for [u, v] in [[a, b], [b, c], [c, a]] {
            let length = (mesh.point(u) - mesh.point(v)).norm();
            for w in [u, v] {
                skin[w as usize].0 += length;
                skin[w as usize].1 += 1;
            }
        }
    }
    skin
}

impl Filler<'_> {
    /// Initialises the size at each vertex: that of the field or of the boundary edges if that is
    /// less. If both are infinite, it is the size grown from the neighbours.
    pub(super) fn size_vertices(&mut self) {
        let has_tets = |v: usize| self.mesh.at_vertex[v] != NONE;
        let field = |v: usize| if has_tets(v) { self.field_size(&self.mesh.points[v]) } else { 0.0 };
        self.sizes = (0..self.mesh.points.len()).into_par_iter().map(field).collect();
        for (v, (sum, count)) in skin_edges(self.mesh).into_iter().enumerate() {
            if self.mesh.at_vertex[v] != NONE {
                let point = self.mesh.points[v];
                self.note_size(&point, self.sizes[v]);
            }
            if count > 0 {
                self.sizes[v] = self.sizes[v].min(SKIN_TOLERANCE * sum / f64::from(count));
            }
        }
        let mut infinite: Vec<u32> =
            (0u32..).zip(&self.sizes).filter(|&(_, &size)| size == f64::INFINITY).map(|(v, _)| v).collect();
        let mut star = Vec::new();
        while !infinite.is_empty() {
            let before = infinite.len();
            infinite.retain(|&v| {
                self.mesh.star(v, &mut star);
                let size = star.iter().fold(f64::INFINITY, |size, &t| {
                    let growth =
                        |u: u32| self.limits.growth * (self.mesh.point(u) - self.mesh.point(v)).norm();
                    let from = |u: u32| self.sizes[u as usize] + growth(u);
                    self.mesh.tets[t as usize].iter().fold(size, |size, &u| size.min(from(u)))
                });
                self.sizes[v as usize] = size;
                size.is_infinite()
            });
            assert!(infinite.len() < before, "vertices {infinite:?} are not connected to the surface");
        }
    }

    /// The value of the size field, in the mesher's scaled units.
    pub(super) fn field_size(&self, point: &Point) -> f64 {
        self.size.size_at(&(point / self.scale)) * self.scale
    }

    /// The wanted size at a vertex.
    pub(super) fn at(&self, vertex: u32) -> f64 {
        self.sizes[vertex as usize]
    }

    /// The wanted size at a point in or near a tet.
    pub(super) fn size_near(&self, t: u32, point: &Point) -> f64 {
        let requested = self.field_size(point);
        self.grown_size(t, point, requested)
    }

    /// The size at a point, limited by the growth from the corners of a tet.
    pub(super) fn grown_size(&self, t: u32, point: &Point, requested: f64) -> f64 {
        self.mesh.tets[t as usize].iter().fold(requested, |size, &v| self.grown(size, v, point))
    }

    /// The size at a point, limited by the growth from one vertex.
    #[inline]
    pub(super) fn grown(&self, size: f64, vertex: u32, point: &Point) -> f64 {
        let from = self.at(vertex);
        // NaN is preserved, to be reported.
        if from < size {
            size.min(from + self.limits.growth * (point - self.mesh.point(vertex)).norm())
        } else {
            size
        }
    }

    /// Limits the sizes of all vertices by the growth from others; see [`Filler::lower_from`].
    pub(super) fn lower_all(&mut self) {
        let lowers = |&t: &u32| {
            let tet = self.mesh.tets[t as usize];
            self.mesh.is_alive(t) && tet.iter().any(|&v| tet.iter().any(|&u| self.limit(v, u).is_some()))
        };
        let slots = 0..self.mesh.tets.len() as u32;
        // Usually there is none. Those before the first change nothing.
        let Some(first) = slots.clone().into_par_iter().find_first(lowers) else { return };
        let mut open = Vec::new();
        for t in first..slots.end {
            if self.mesh.is_alive(t) {
                let tet = self.mesh.tets[t as usize];
                tet.iter().for_each(|&v| self.lower(v, &tet, &mut open));
            }
        }
        self.lower_from(open);
    }

    /// Limits the sizes of the vertices around a cavity by the growth from the vertex in it.
    pub(super) fn lower_around(&mut self, vertex: u32) {
        let mut open = Vec::new();
        let around = std::mem::take(&mut self.cavity.vertices);
        self.lower(vertex, &around, &mut open);
        self.cavity.vertices = around;
        self.lower_from(open);
    }

    /// Propagates lowered sizes to neighbours (gradient limiting: Borouchaki, Hecht, Frey 1998);
    /// tets that become coarse are added to `lowered`.
    pub(super) fn lower_from(&mut self, mut open: Vec<u32>) {
        let (mut star, mut neighbours) = (Vec::new(), Vec::new());
        while let Some(v) = open.pop() {
            self.mesh.star(v, &mut star);
            neighbours.clear();
            neighbours.extend(star.iter().flat_map(|&t| self.mesh.tets[t as usize]));
            neighbours.sort_unstable();
            neighbours.dedup();
            self.lower(v, &neighbours, &mut open);
            // Before the front starts, tets have no state.
            for &t in &star {
                if (t as usize) < self.states.len() && self.state(t) == State::Fine && !self.is_fine(t) {
                    self.states[t as usize] = State::Coarse;
                    self.lowered.push(t);
                }
            }
        }
    }

    /// Limits the sizes of neighbours by the growth from a vertex; appends those that changed to
    /// `lowered`.
    fn lower(&mut self, vertex: u32, neighbours: &[u32], lowered: &mut Vec<u32>) {
        for &v in neighbours {
            if let Some(grown) = self.limit(vertex, v) {
                self.sizes[v as usize] = grown;
                lowered.push(v);
            }
        }
    }

    /// The size to which the growth from one vertex lowers that of another, if it does.
    #[inline]
    fn limit(&self, from: u32, at: u32) -> Option<f64> {
        if self.at(at) <= self.at(from) * LOWER {
            return None;
        }
        let grown = self.at(from) + self.limits.growth * (self.mesh.point(at) - self.mesh.point(from)).norm();
        (self.at(at) > grown * LOWER).then_some(grown)
    }
}

#[cfg(test)]
mod tests {
    use super::super::samples::*;
    use super::super::{Settings, VolumeMesh, mesh};
    use super::*;
    use crate::ground::mesh::TET_EDGES;
    use crate::ground::size::SizeField;

    struct Field<F>(F);

    impl<F: Fn(&Point) -> f64 + Sync> SizeField for Field<F> {
        fn size_at(&self, point: &Point) -> f64 {
            (self.0)(point)
        }
    }

    /// The meshed unit cube with this number of squares per edge.
    fn filled_cube(squares: usize, field: impl Fn(&Point) -> f64 + Sync) -> VolumeMesh {
        let mut soup = Soup::default();
        soup.brick([0.; 3], [1.; 3], squares, INSIDE);
        let surface = soup.surface().unwrap();
        let (mesh, _) = mesh(&surface, &Field(field), &Settings::default()).unwrap();
        check_fills(&surface, &mesh);
        mesh
    }

    /// The least and greatest ratio of edge length to size, for edges whose midpoints are at least
    /// `inside` from the boundary.
    fn lengths(mesh: &VolumeMesh, inside: f64, field: impl Fn(&Point) -> f64) -> [f64; 2] {
        let mut range = [f64::INFINITY, 0.0];
        for tet in &mesh.tets {
            for [i, j] in TET_EDGES {
                let [p, q] = [tet[i], tet[j]].map(|v| mesh.points[v as usize]);
                let middle = nalgebra::center(&p, &q);
                if middle.iter().all(|&x| x > inside && x < 1.0 - inside) {
                    let length = (p - q).norm() / field(&middle);
                    range = [range[0].min(length), f64::max(range[1], length)];
                }
            }
        }
        range
    }

    /// Distance from the boundary at which small tets begin if the field is finer, in lengths of
    /// boundary edges.
    const AWAY: f64 = 0.25;

    #[test]
    fn away_from_coarse_facets_edges_follow_a_field_of_any_shape() {
        let center = Point::new(0.4, 0.45, 0.6);
        let ball = move |p: &Point| if (p - center).norm() < 0.15 { 0.012 } else { 0.3 };
        let line = |p: &Point| (0.3 * (p.x - 0.5).hypot(p.y - 0.5)).clamp(0.008, 1.0);
        let layer = |p: &Point| (0.5 * (p.z - 0.5).abs()).clamp(0.03, 1.0);
        let jump = |p: &Point| if p.x + 0.3 * p.y < 0.65 { 0.03 } else { 0.3 };
        let fields: [&(dyn Fn(&Point) -> f64 + Sync); 4] = [&ball, &line, &layer, &jump];
        for (i, field) in fields.into_iter().enumerate() {
            for squares in [2, 5] {
                let mesh = filled_cube(squares, field);
                let [_, most] = lengths(&mesh, AWAY / squares as f64, field);
                assert!(most < 2.0, "field {i}, {squares} squares: {most}");
            }
        }
    }

    #[test]
    fn sizes_grow_smoothly_from_a_jump_of_the_field() {
        let center = Point::new(0.4, 0.45, 0.6);
        let limited = |p: &Point| (0.03 + 0.3 * ((p - center).norm() - 0.15).max(0.0)).min(0.3);
        let mesh = filled_cube(4, |p| if (p - center).norm() < 0.15 { 0.03 } else { 0.3 });
        let [least, most] = lengths(&mesh, AWAY / 4.0, limited);
        assert!(least > 0.5 && most < 2.0, "{least} {most}");
    }
}
