//! Placement of interior points by the size field: frontal Delaunay refinement (Rebay 1993).
//!
//! A tet is **fine** if its circumsphere is not much larger than that of a regular tet of the
//! wanted size. The **front** consists of the faces between coarse tets and fine ones or the
//! boundary. The ideal point of a front face is on its axis, at the height at which the new edges
//! have the wanted length. It is inserted by a Delaunay cavity that stops at the boundary, unless
//! it is too close to another vertex or to the boundary. The front moves inward in waves; tets
//! still coarse afterwards get their circumcentre, with the same distance checks. In regions of
//! constant size, lattice points were inserted before (`lattice`).
//!
//! Sizes come from `sizes`. The arguments about circumspheres hold for Delaunay meshes only, so the
//! mesh is made Delaunay first (`legalize`) as far as the boundary allows.

use super::blocks::Block;
use super::cavity::{Cavity, Walk, walk};
use super::front::Wall;
use super::legalize::legalize;
use super::tetrahedra::Tetrahedra;
use crate::ground::kernel::hilbert::random_rounds;
use crate::ground::kernel::simplex::{area_vector, squared_distance};
use crate::ground::size::SizeField;
use crate::mesher::half_face::NONE;
use crate::{Point, Vector};
use rayon::prelude::*;

/// The circumradius of a regular tet of edge 1.
const REGULAR: f64 = 0.612_372_435_695_794_5;

/// A tet is fine if its circumradius is at most this many times that of a regular tet of the wanted
/// size.
///
/// 1.3 gives 1.04 times the tets of a space filled with regular ones on the shaft's surface, and
/// edges 7 % too long; 1.2 gives 1.25 times the tets, 1.5 gives 0.83 times and worse shapes.
const FINE: f64 = 1.3;

/// Least distance between vertices, as a fraction of the wanted size.
///
/// 0.8 gives the best 5th percentile of dihedral angles on the shaft's surface, 28.7 degrees; 0.65
/// gives 27.1, and 0.9 leaves large tets (26.4 degrees, edges 15 % too long).
const NEAREST: f64 = 0.8;

/// Least distance of a vertex from the boundary, as a fraction of the wanted size (a regular tet
/// has height 0.82). Ideal points are usually farther away; it matters if the surface is too
/// coarse.
const NEAREST_FACE: f64 = 0.4;

/// Least distance of a vertex from a facet, as a fraction of the facet's least height.
///
/// If a facet is much coarser than the wanted size, a layer of small tets next to it could be
/// joined to its few corners only by flat tets and long edges.
const NEAREST_COARSE: f64 = 0.2;

/// The size field has a dip in a fine tet if its circumradius exceeds that of a fine tet of the
/// size at its centroid by this factor.
const DIP: f64 = 1.5;

/// With more slots than this without a tet they are removed first, because blocks do not use them.
/// The Delaunay mesh of the surface of a crankshaft has three of them for each tet inside.
const MOST_FREE: usize = 100_000;

/// The working state of the point placement.
pub(super) struct Filler<'a> {
    pub(super) mesh: &'a mut Tetrahedra,
    pub(super) size: &'a dyn SizeField,
    pub(super) scale: f64,
    /// The wanted size at each vertex, in the mesher's units.
    pub(super) sizes: Vec<f64>,
    /// The state of each tet, by slot.
    pub(super) states: Vec<State>,
    pub(super) cavity: Cavity,
    pub(super) limits: Limits,
    /// Tets that were fine before the size at one of their vertices was lowered.
    pub(super) lowered: Vec<u32>,
    /// Tets in a block whose points have to wait, because the cavities reach the seam.
    pub(super) waiting: Vec<u32>,
    /// If given, points elsewhere are rejected.
    pub(super) wall: Option<Wall>,
    /// The reason if the placement stops early.
    pub(super) stopped: Option<Stopped>,
}

/// Limits of the placement; see [`Settings`](super::Settings).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Limits {
    pub growth: f64,
    pub max_tets: usize,
}

/// Refinement state of a tet.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub(super) enum State {
    /// Larger than wanted.
    #[default]
    Coarse,
    /// Larger than wanted, but all its ideal points were rejected: the front continues behind it.
    Rejected,
    /// Larger than wanted, but its ideal points and its circumcentre were rejected.
    Settled,
    /// Not larger than wanted.
    Fine,
}

/// What became of a point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Placed {
    /// It is a vertex.
    Inserted,
    /// It is too close to another vertex or to the boundary, or outside.
    Rejected,
    /// Its cavity reaches the seam of a block.
    Waits,
}

/// Why the placement stopped early.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Stopped {
    /// The size field returned a size that is not positive.
    BadSize { place: Point, size: f64 },
    /// There are more tets than allowed.
    TooManyTets,
    /// The observer cancelled the run.
    Cancelled,
}

/// Adds points inside all bodies; returns their number.
///
/// # Errors
/// [`Stopped::BadSize`] if the field returns a size that is not positive, [`Stopped::TooManyTets`]
/// if `limits` allow fewer tets than are made, [`Stopped::Cancelled`].
pub(super) fn fill(
    mesh: &mut Tetrahedra,
    size: &dyn SizeField,
    scale: f64,
    limits: Limits,
) -> Result<usize, Stopped> {
    let before = mesh.points.len();
    legalize(mesh);
    if mesh.free.len() > MOST_FREE {
        mesh.remove_free_slots();
    }
    let mut filler = Filler {
        mesh,
        size,
        scale,
        sizes: Vec::new(),
        states: Vec::new(),
        cavity: Cavity::default(),
        limits,
        lowered: Vec::new(),
        waiting: Vec::new(),
        wall: None,
        stopped: None,
    };
    filler.size_vertices();
    if !filler.stops() {
        filler.add_lattices();
        filler.place_points();
    }
    match filler.stopped {
        Some(stopped) => Err(stopped),
        None => Ok(mesh.points.len() - before),
    }
}

impl Filler<'_> {
    /// The working state in a block of the mesh; tets have states there if they have them here.
    pub(super) fn in_block<'b>(&self, block: &'b mut Block) -> Filler<'b>
    where
        Self: 'b,
    {
        Filler {
            sizes: block.vertices.iter().map(|&v| self.at(v)).collect(),
            states: block.tets.iter().filter_map(|&t| self.states.get(t as usize).copied()).collect(),
            mesh: &mut block.mesh,
            cavity: Cavity::default(),
            lowered: Vec::new(),
            waiting: Vec::new(),
            stopped: None,
            ..*self
        }
    }

    /// Stops the placement if `size` is not positive.
    pub(super) fn note_size(&mut self, point: &Point, size: f64) {
        if size.is_nan() || size <= 0.0 {
            let stopped = Stopped::BadSize { place: point / self.scale, size: size / self.scale };
            self.stopped = self.stopped.or(Some(stopped));
        }
    }

    /// Whether to stop early; also checks the number of tets.
    pub(super) fn stops(&mut self) -> bool {
        if self.mesh.len() > self.limits.max_tets {
            self.stopped = self.stopped.or(Some(Stopped::TooManyTets));
        }
        if self.size.work().is_cancelled() {
            self.stopped = self.stopped.or(Some(Stopped::Cancelled));
        }
        self.stopped.is_some()
    }

    /// Updates the states of some tets.
    fn update_states(&mut self, tets: impl IntoIterator<Item = u32>) {
        self.states.resize(self.mesh.tets.len(), State::Coarse);
        for t in tets {
            if self.mesh.is_alive(t) {
                self.mesh.keep_sphere(t);
                self.states[t as usize] = if self.is_fine(t) { State::Fine } else { State::Coarse };
            }
        }
    }

    /// Sets the states of all tets.
    pub(super) fn set_states(&mut self) {
        self.mesh.keep_spheres();
        let state = |t: u32| {
            if self.mesh.is_alive(t) && self.is_fine(t) { State::Fine } else { State::Coarse }
        };
        self.states = (0..self.mesh.tets.len() as u32).into_par_iter().map(state).collect();
    }

    pub(super) fn is_fine(&self, t: u32) -> bool {
        let radius2 = self.mesh.sphere(t).squared_radius();
        let [a, b, c, d] = self.mesh.tets[t as usize];
        let [a, b, c, d] = [self.at(a), self.at(b), self.at(c), self.at(d)];
        radius2 <= (FINE * REGULAR * 0.25 * (a + b + c + d)).powi(2)
    }

    pub(super) fn state(&self, t: u32) -> State {
        self.states[t as usize]
    }

    /// The coarse tets that are wanted, in random rounds along the Hilbert curve; later waves
    /// inherit this order.
    ///
    /// The curve makes neighbouring tets follow each other, for the cache: 2 million tets in the
    /// shaft take 3.7 s instead of 5.7 s. The rounds keep cavities small if tets extend from
    /// boundary to boundary: in a ball all tets have nearly the same circumsphere. With an infinite
    /// field, time then grows by 2.25 per doubling of the surface, instead of 2.5 in one pass along
    /// the curve.
    pub(super) fn in_random_rounds(&self, is_wanted: impl Fn(u32) -> bool) -> Vec<u32> {
        let is_coarse = |&t: &u32| self.state(t) == State::Coarse && is_wanted(t);
        let coarse: Vec<u32> = self.mesh.alive().filter(is_coarse).collect();
        let places: Vec<Point> =
            coarse.iter().map(|&t| *self.mesh.point(self.mesh.tets[t as usize][0])).collect();
        random_rounds(&places).into_iter().map(|i| coarse[i as usize]).collect()
    }

    /// Runs the front, then inserts circumcentres, then fills dips of the size field; repeats until
    /// there is no dip. Blocks come first if many points are expected.
    fn place_points(&mut self) {
        self.lower_all();
        self.set_states();
        self.advance_in_blocks();
        let mut open = self.in_random_rounds(|_| true);
        loop {
            self.advance(open);
            self.finish();
            open = self.fill_dips();
            if open.is_empty() {
                break;
            }
        }
    }

    /// Inserts ideal points in waves until no front is left.
    pub(super) fn advance(&mut self, mut coarse: Vec<u32>) {
        while !coarse.is_empty() {
            let mut next = Vec::new();
            let mut moved = false;
            for t in coarse {
                if self.stops() {
                    return;
                }
                // The slot may hold another tet by now, which is in the next wave too; that is
                // harmless.
                if !self.mesh.is_alive(t) || self.state(t) != State::Coarse {
                    continue;
                }
                let mut has_front = false;
                let inserted = (4 * t..4 * t + 4).any(|h| {
                    self.is_front(h) && {
                        has_front = true;
                        let (point, size) = self.ideal_point(h);
                        self.insert_and_update(t, point, size)
                    }
                });
                moved |= has_front;
                if inserted {
                    next.extend(
                        self.cavity.filled.iter().filter(|&&t| self.states[t as usize] == State::Coarse),
                    );
                } else if has_front {
                    self.states[t as usize] = State::Rejected;
                } else {
                    next.push(t);
                }
                next.append(&mut self.lowered);
            }
            if !moved {
                break;
            }
            coarse = next;
        }
    }

    /// Inserts circumcentres of the tets that are still too large.
    ///
    /// Away from the boundary this leaves no large tet: the circumcentre of a Delaunay tet is no
    /// closer to any vertex than to its own, so if it is rejected the circumradius is below
    /// [`NEAREST`] times the size there. Next to facets much coarser than the wanted size long
    /// edges remain, because circumcentres are behind the facets or too close to them; see
    /// [`NEAREST_COARSE`].
    pub(super) fn finish(&mut self) {
        let is_open =
            |&t: &u32| self.mesh.is_alive(t) && !matches!(self.state(t), State::Fine | State::Settled);
        let mut open: Vec<u32> = (0..self.mesh.tets.len() as u32).into_par_iter().filter(is_open).collect();
        while let Some(t) = open.pop() {
            if self.stops() {
                return;
            }
            if !self.mesh.is_alive(t) || self.state(t) == State::Fine {
                continue;
            }
            let center = self.mesh.sphere(t).center();
            // This size is at least the wanted one, and takes far less time.
            if self.is_outside_wall(&center, self.grown_size(t, &center, f64::INFINITY)) {
                continue;
            }
            let size = self.size_near(t, &center);
            if self.insert_and_update(t, center, size) {
                open.extend_from_slice(&self.cavity.filled);
                open.append(&mut self.lowered);
            }
        }
    }

    /// Inserts centroids of fine tets where the size field is much smaller than at the corners;
    /// returns the coarse tets made.
    ///
    /// This finds every dip of the field that is as wide as a tet around it.
    fn fill_dips(&mut self) -> Vec<u32> {
        let dip = |t: u32| {
            if !self.mesh.is_alive(t) || self.state(t) != State::Fine {
                return None;
            }
            let middle = self.mesh.centroid(t);
            let size = self.size_near(t, &middle);
            let wanted = FINE * REGULAR * DIP * size;
            // Invalid sizes are included, so that they are reported.
            (size.is_nan() || self.mesh.sphere(t).squared_radius() > wanted * wanted)
                .then_some((t, middle, size))
        };
        let dips: Vec<(u32, Point, f64)> =
            (0..self.mesh.tets.len() as u32).into_par_iter().filter_map(dip).collect();
        let mut coarse = Vec::new();
        for (t, middle, size) in dips {
            if self.stops() {
                break;
            }
            if self.mesh.is_alive(t) && self.insert_and_update(t, middle, size) {
                coarse.extend_from_slice(&self.cavity.filled);
                coarse.append(&mut self.lowered);
            }
        }
        coarse.retain(|&t| self.mesh.is_alive(t) && self.state(t) == State::Coarse);
        coarse
    }

    /// Whether a face of a coarse tet is on the front.
    fn is_front(&self, half_face: u32) -> bool {
        let other = self.mesh.across(half_face);
        other == NONE || self.mesh.is_locked(half_face) || self.state(other >> 2) != State::Coarse
    }

    /// The ideal point of a front face, inside its tet, and the wanted size there.
    fn ideal_point(&self, half_face: u32) -> (Point, f64) {
        let [a, b, c] = self.mesh.face_points(half_face);
        let (u, v) = (b - a, c - a);
        let normal: Vector = -area_vector(a, b, c);
        let squares = normal.norm_squared();
        let to_center = (u.norm_squared() * v - v.norm_squared() * u).cross(&u.cross(&v)) / (2.0 * squares);
        let (center, radius2) = (a + to_center, to_center.norm_squared());
        let inward = normal / squares.sqrt();
        let at_face = self.mesh.face(half_face).iter().map(|&v| self.at(v)).sum::<f64>() / 3.0;
        let (mut point, mut size) = (center, at_face);
        // The position depends on the size at the position: two fixed-point iterations suffice.
        for _ in 0..2 {
            let height = (size * size - radius2).max(0.25 * size * size).sqrt();
            point = center + inward * height;
            size = self.size_near(half_face >> 2, &point);
        }
        (point, size)
    }

    /// Like [`Filler::insert`], and updates the states and sizes of the new tets.
    fn insert_and_update(&mut self, t: u32, point: Point, size: f64) -> bool {
        let placed = self.insert(t, point, size);
        let inserted = placed == Placed::Inserted;
        if placed == Placed::Waits {
            self.waiting.push(t);
        }
        if inserted {
            let filled = std::mem::take(&mut self.cavity.filled);
            self.update_states(filled.iter().copied());
            self.cavity.filled = filled;
            self.lower_around(self.mesh.points.len() as u32 - 1);
        }
        inserted
    }

    /// Inserts a point near tet `t`, unless it is too close to a vertex or the boundary; the new
    /// tets are in `cavity.filled`.
    pub(super) fn insert(&mut self, t: u32, point: Point, size: f64) -> Placed {
        // The circumcentre of a flat tet may not be finite; sizes there are meaningless.
        if ![point.x, point.y, point.z].iter().all(|x| x.is_finite()) {
            return Placed::Rejected;
        }
        self.note_size(&point, size);
        if self.stopped.is_some()
            || self.is_outside_wall(&point, size)
            || self.is_corner_near(t, &point, size)
        {
            return Placed::Rejected;
        }
        let seed = match walk(self.mesh, t, &point) {
            Walk::Inside(seed) => seed,
            Walk::Blocked(face) if self.mesh.is_seam(face) => return Placed::Waits,
            Walk::Blocked(_) => return Placed::Rejected,
        };
        if seed != t && self.is_corner_near(seed, &point, size) {
            return Placed::Rejected;
        }
        self.cavity.grow(self.mesh, seed, &point);
        let size = self.cavity.vertices.iter().fold(size, |size, &v| self.grown(size, v, &point));
        if self.cavity.vertices.iter().any(|&v| self.is_near(v, &point, size)) {
            return Placed::Rejected;
        }
        if self.cavity.meets_seam {
            return Placed::Waits;
        }
        if !self.cavity.make_star_shaped(self.mesh, seed, &point)
            || self.cavity.walls.iter().any(|&w| self.is_skin_near(w, &point, size))
        {
            return Placed::Rejected;
        }
        let body = self.mesh.bodies[seed as usize];
        let v = self.mesh.add_point(point);
        self.sizes.push(size);
        self.cavity.fill(self.mesh, v, body);
        Placed::Inserted
    }

    fn is_outside_wall(&self, point: &Point, size: f64) -> bool {
        self.wall.is_some_and(|wall| !wall.contains(point, size))
    }

    /// Whether a vertex is too close to a new point, by the wanted size there.
    #[inline]
    fn is_near(&self, vertex: u32, point: &Point, size: f64) -> bool {
        let near = NEAREST * size;
        (point - self.mesh.point(vertex)).norm_squared() < near * near
    }

    fn is_corner_near(&self, t: u32, point: &Point, size: f64) -> bool {
        let [a, b, c, d] = self.mesh.tets[t as usize];
        self.is_near(a, point, size)
            || self.is_near(b, point, size)
            || self.is_near(c, point, size)
            || self.is_near(d, point, size)
    }

    fn is_skin_near(&self, wall: u32, point: &Point, size: f64) -> bool {
        if !self.mesh.is_locked(wall) {
            return false;
        }
        let [a, b, c] = self.mesh.face_points(wall);
        let normal = area_vector(a, b, c);
        let area2 = normal.norm();
        let height = (a - point).dot(&normal) / area2;
        let longest2 = (b - a).norm_squared().max((c - b).norm_squared()).max((a - c).norm_squared());
        let coarse = NEAREST_COARSE * area2 / longest2.sqrt();
        height < NEAREST_FACE * size
            || (height < coarse && squared_distance(point, [a, b, c]) < coarse * coarse)
    }
}

#[cfg(test)]
mod tests {
    use super::super::samples::*;
    use super::super::{Settings, VolumeMesh, mesh};
    use super::*;
    use crate::ground::mesh::TET_EDGES;
    use crate::ground::size::UniformSize;

    /// Sizes from 0.001 at the centre of the unit cube, growing by 0.3 per distance.
    struct Steep;

    impl SizeField for Steep {
        fn size_at(&self, point: &Point) -> f64 {
            (0.3 * (point - Point::new(0.5, 0.5, 0.5)).norm()).clamp(0.001, 1.0)
        }
    }

    /// The lengths of the edges of tets in a region, each divided by `size` at its midpoint.
    fn lengths_of(
        mesh: &VolumeMesh,
        is_there: impl Fn(&Point) -> bool,
        size: impl Fn(&Point) -> f64,
    ) -> Vec<f64> {
        let corners = mesh.tets.iter().map(|tet| tet.map(|v| mesh.points[v as usize]));
        corners
            .filter(|tet| tet.iter().all(&is_there))
            .flat_map(|tet| TET_EDGES.map(|e| e.map(|i| tet[i])))
            .map(|[p, q]| (p - q).norm() / size(&nalgebra::center(&p, &q)))
            .collect()
    }

    fn least_and_most(lengths: &[f64]) -> (f64, f64) {
        lengths.iter().fold((f64::INFINITY, 0.0), |(least, most), &l| (least.min(l), l.max(most)))
    }

    #[test]
    fn a_size_that_decreases_by_a_thousand_leaves_no_large_tet() {
        for squares in [1, 4] {
            let mut soup = Soup::default();
            soup.brick([0.; 3], [1.; 3], squares, INSIDE);
            let surface = soup.surface().unwrap();
            let (mesh, _) = mesh(&surface, &Steep, &Settings::default()).unwrap();
            check_fills(&surface, &mesh);
            // Next to the boundary, which is coarser than the field, tets cannot follow it.
            let middle = Point::new(0.5, 0.5, 0.5);
            let inside = lengths_of(&mesh, |p| (p - middle).norm() < 0.3, |p| Steep.size_at(p));
            let (least, most) = least_and_most(&inside);
            assert!(inside.len() > 50_000 && least > 0.5 && most < 3.0, "{} {least} {most}", inside.len());
        }
    }

    #[test]
    fn a_surface_of_four_orders_of_magnitude_is_filled_with_smooth_grading() {
        let surface = graded_ball(90, 60, 1e-4).surface().unwrap();
        let (mesh, report) = mesh(&surface, &UniformSize(f64::INFINITY), &Settings::default()).unwrap();
        check_fills(&surface, &mesh);
        assert!(report.points_inside > 1000);
        // The fine pole is at (0, 0, 1): sizes grow by at most 0.3 per distance from it.
        let pole = Point::new(0.0, 0.0, 1.0);
        let inside = lengths_of(&mesh, |p| p.coords.norm() < 0.99, |p| 0.3 * (p - pole).norm());
        let (_, most) = least_and_most(&inside);
        assert!(inside.len() > 10_000 && most < 3.0, "{} {most}", inside.len());
    }
}
