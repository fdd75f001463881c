//! Points inside, placed by the size field.
//!
//! Frontal Delaunay refinement (Rebay 1993). A tet is **fine** if its circumsphere is not much larger than that of
//! a regular tet of the wanted size. The **front** are the faces between fine tets, or the boundary, and
//! tets that are not. Over a front face stands the ideal point: on its axis, so far that the new edges have the
//! wanted length. It is inserted by a Delaunay cavity that stops at the boundary, unless it is too near to
//! another vertex or to the boundary. Wave by wave the front moves inward; what is still coarse when it has
//! passed gets its circumcentre, under the same filter. Where the size is level, a lattice went in before (`lattice`).
//!
//! Sizes are those of `sizes`. The mesh is made Delaunay first (`legalize`), as far as the skin lets it be: what is said here of
//! circumspheres relies on it.

use super::cavity::{Cavity, Walk, walk};
use super::legalize::legalize;
use super::tetrahedra::{NONE, Tetrahedra};
use crate::kernel::hilbert::random_rounds;
use crate::kernel::simplex::{area_vector, squared_distance};
use crate::size::SizeField;
use crate::{Point, Vector};
use rayon::prelude::*;

/// The circumradius of a regular tet of edge 1.
const REGULAR: f64 = 0.612_372_435_695_794_5;

/// A tet is fine up to this many times the circumradius of a regular tet of the wanted size. On the shaft's skin 1.2
/// gives 1.25 times the tets of a space full of regular ones, with edges of the wanted length in the mean; 1.3 gives 1.04
/// times as many and edges 7 % longer, 1.5 gives 0.83 times as many, less well shaped.
const FINE: f64 = 1.3;

/// No vertex is inserted nearer to another than this fraction of the wanted size. From 0.65 to 0.8 the worst twentieth of
/// the dihedral angles on the shaft's skin grows from 27.1 to 28.7 degrees; 0.9 leaves holes (26.4 degrees, edges
/// 15 % too long in the mean).
const NEAREST: f64 = 0.8;

/// No vertex is inserted nearer to the boundary than this fraction of the wanted size (a regular tet is 0.82 high). From
/// 0.3 to 0.5 nothing changes on the skins tried, where ideal points are far enough; it matters where a skin is too coarse.
const NEAREST_FACE: f64 = 0.4;

/// No vertex is inserted nearer to a facet than this fraction of its least height either. Beside a skin much coarser than the wanted size a
/// layer of small tets right at it can only be joined to the few corners of the skin by flat tets and by edges as long as the skin's.
const NEAREST_COARSE: f64 = 0.2;

/// The field dips in a tet where its circumradius is more than this many times that of a fine tet of the size in its middle.
const DIP: f64 = 1.5;

/// The working state of the point placement.
pub(super) struct Filler<'a> {
    pub(super) mesh: &'a mut Tetrahedra,
    pub(super) size: &'a dyn SizeField,
    pub(super) scale: f64,
    /// The wanted size at each vertex, in the mesher's units.
    pub(super) sizes: Vec<f64>,
    /// By slot.
    pub(super) states: Vec<State>,
    pub(super) cavity: Cavity,
    pub(super) limits: Limits,
    /// Tets that were fine before the size at a vertex of theirs was lowered.
    pub(super) lowered: Vec<u32>,
    /// Why the placement stops early, if it does.
    stopped: Option<Stopped>,
}

/// What the placement keeps to, see [`Settings`](super::Settings).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Limits {
    pub growth: f64,
    pub max_tets: usize,
}

/// How far a tet is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub(super) enum State {
    /// To be made smaller.
    #[default]
    Coarse,
    /// Too large, but no ideal point of it was accepted: the front passes on.
    Settled,
    /// As small as wanted.
    Fine,
}

/// Why no more points are placed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Stopped {
    /// The size field gave a size that is not positive.
    BadSize { place: Point, size: f64 },
    /// There are more tets than allowed.
    TooManyTets,
}

/// Adds points inside all bodies; returns how many.
pub(super) fn fill(
    mesh: &mut Tetrahedra,
    size: &dyn SizeField,
    scale: f64,
    limits: Limits,
) -> Result<usize, Stopped> {
    let before = mesh.points.len();
    legalize(mesh);
    let mut filler = Filler {
        mesh,
        size,
        scale,
        sizes: Vec::new(),
        states: Vec::new(),
        cavity: Cavity::default(),
        limits,
        lowered: Vec::new(),
        stopped: None,
    };
    filler.size_vertices();
    if !filler.stops() {
        filler.add_lattices();
        filler.place();
    }
    match filler.stopped {
        Some(stopped) => Err(stopped),
        None => Ok(mesh.points.len() - before),
    }
}

impl Filler<'_> {
    /// Stops the placement if this is no size.
    pub(super) fn note_size(&mut self, point: &Point, size: f64) {
        if size.is_nan() || size <= 0.0 {
            let stopped = Stopped::BadSize { place: point / self.scale, size: size / self.scale };
            self.stopped = self.stopped.or(Some(stopped));
        }
    }

    /// Whether to stop early.
    pub(super) fn stops(&mut self) -> bool {
        if self.mesh.len() > self.limits.max_tets {
            self.stopped = self.stopped.or(Some(Stopped::TooManyTets));
        }
        self.stopped.is_some()
    }

    /// Finds out how far some tets are.
    fn judge(&mut self, tets: impl IntoIterator<Item = u32>) {
        self.states.resize(self.mesh.tets.len(), State::Coarse);
        for t in tets {
            if self.mesh.is_alive(t) {
                self.mesh.keep_sphere(t);
                self.states[t as usize] = if self.is_fine(t) { State::Fine } else { State::Coarse };
            }
        }
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

    /// The coarse tets, near ones near each other, in random rounds along the Hilbert curve. Later waves inherit the order of the first. Along the curve it keeps
    /// the work in the cache: 2 million tets in the shaft take 3.7 s instead of 5.7 s. In rounds it keeps cavities small where tets
    /// reach from skin to skin: in a ball all have nearly the same circumsphere. With an infinite field time then grows by 2.25 for
    /// each doubling of the skin, along the curve at once by 2.5. (Circumcentres of the largest tets first, as separators, cost as much as they save.)
    fn in_random_rounds(&self) -> Vec<u32> {
        let is_coarse = |t: &u32| self.state(*t) == State::Coarse;
        let coarse: Vec<u32> = self.mesh.alive().filter(is_coarse).collect();
        let places: Vec<Point> =
            coarse.iter().map(|&t| *self.mesh.point(self.mesh.tets[t as usize][0])).collect();
        random_rounds(&places).into_iter().map(|i| coarse[i as usize]).collect()
    }

    /// The front, what it leaves, and where the field dips; this again until there is no dip.
    fn place(&mut self) {
        self.lower_all();
        self.judge(0..self.mesh.tets.len() as u32);
        let mut open = self.in_random_rounds();
        loop {
            self.advance(open);
            self.finish();
            open = self.fill_dips();
            if open.is_empty() {
                break;
            }
        }
    }

    /// Waves of ideal points, until no front is left.
    fn advance(&mut self, mut coarse: Vec<u32>) {
        while !coarse.is_empty() {
            let mut next = Vec::new();
            let mut moved = false;
            for t in coarse {
                if self.stops() {
                    return;
                }
                // A slot may hold another tet by now, which is in the next wave too: no harm, it is coarse as well.
                if !self.mesh.is_alive(t) || self.state(t) != State::Coarse {
                    continue;
                }
                let mut has_front = false;
                let inserted = (4 * t..4 * t + 4).any(|h| {
                    self.is_front(h) && {
                        has_front = true;
                        let (point, size) = self.ideal_point(h);
                        self.insert_and_judge(t, point, size)
                    }
                });
                moved |= has_front;
                if inserted {
                    next.extend(
                        self.cavity.filled.iter().filter(|&&t| self.states[t as usize] == State::Coarse),
                    );
                } else if has_front {
                    self.states[t as usize] = State::Settled;
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

    /// Circumcentres of what is still too large.
    ///
    /// Away from the boundary that leaves no hole: the circumcentre of a Delaunay tet is as far from all vertices as from its own, so
    /// where it is refused the circumradius is below [`NEAREST`] times the size there. Beside a skin that is much coarser than the
    /// wanted size long edges remain, where circumcentres lie behind the skin or too near to it: see [`NEAREST_COARSE`].
    fn finish(&mut self) {
        let mut open: Vec<u32> = self.mesh.alive().collect();
        while let Some(t) = open.pop() {
            if self.stops() {
                return;
            }
            if !self.mesh.is_alive(t) || self.state(t) == State::Fine {
                continue;
            }
            let center = self.mesh.sphere(t).center();
            let size = self.size_near(t, &center);
            if self.insert_and_judge(t, center, size) {
                open.extend_from_slice(&self.cavity.filled);
                open.append(&mut self.lowered);
            }
        }
    }

    /// Middles of fine tets where the field asks for much less than at the corners; the tets that are coarse then.
    ///
    /// So no dip of the field is overlooked that is as wide as a tet around it.
    fn fill_dips(&mut self) -> Vec<u32> {
        let fine: Vec<u32> = self.mesh.alive().filter(|&t| self.state(t) == State::Fine).collect();
        let dip = |&t: &u32| {
            let [a, b, c, d] = self.mesh.corners(t);
            let middle = Point::from((a.coords + b.coords + c.coords + d.coords) * 0.25);
            let size = self.size_near(t, &middle);
            let wanted = FINE * REGULAR * DIP * size;
            // What is no size at all is noted, too.
            (size.is_nan() || self.mesh.sphere(t).squared_radius() > wanted * wanted)
                .then_some((t, middle, size))
        };
        let dips: Vec<(u32, Point, f64)> = fine.par_iter().filter_map(dip).collect();
        let mut coarse = Vec::new();
        for (t, middle, size) in dips {
            if self.stops() {
                break;
            }
            if self.mesh.is_alive(t) && self.insert_and_judge(t, middle, size) {
                coarse.extend_from_slice(&self.cavity.filled);
                coarse.append(&mut self.lowered);
            }
        }
        coarse.retain(|&t| self.mesh.is_alive(t) && self.state(t) == State::Coarse);
        coarse
    }

    /// Whether the front is at this face of a coarse tet.
    fn is_front(&self, half_face: u32) -> bool {
        let other = self.mesh.across(half_face);
        other == NONE || self.mesh.is_locked(half_face) || self.state(other >> 2) != State::Coarse
    }

    /// The point over a face, into its tet, whose edges to the face have the wanted length; and that length.
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
        // The size at the point decides where it is, and where it is decides the size: twice is enough.
        for _ in 0..2 {
            let height = (size * size - radius2).max(0.25 * size * size).sqrt();
            point = center + inward * height;
            size = self.size_near(half_face >> 2, &point);
        }
        (point, size)
    }

    /// As [`Filler::insert`], and finds out how far the new tets are.
    fn insert_and_judge(&mut self, t: u32, point: Point, size: f64) -> bool {
        let inserted = self.insert(t, point, size);
        if inserted {
            let filled = std::mem::take(&mut self.cavity.filled);
            self.judge(filled.iter().copied());
            self.cavity.filled = filled;
            self.lower_around(self.mesh.points.len() as u32 - 1);
        }
        inserted
    }

    /// Inserts a point near tet `t` unless it is too near to something; the new tets are in `cavity.filled`.
    pub(super) fn insert(&mut self, t: u32, point: Point, size: f64) -> bool {
        // The circumcentre of a flat tet may be nowhere: what the field says there is nothing.
        if ![point.x, point.y, point.z].iter().all(|x| x.is_finite()) {
            return false;
        }
        self.note_size(&point, size);
        if self.stopped.is_some() || self.is_corner_near(t, &point, size) {
            return false;
        }
        let Walk::Inside(seed) = walk(self.mesh, t, &point) else { return false };
        if seed != t && self.is_corner_near(seed, &point, size) {
            return false;
        }
        self.cavity.grow(self.mesh, seed, &point);
        let size = self.cavity.vertices.iter().fold(size, |size, &v| self.grown(size, v, &point));
        if self.cavity.vertices.iter().any(|&v| self.is_near(v, &point, size))
            || !self.cavity.make_star_shaped(self.mesh, seed, &point)
            || self.cavity.walls.iter().any(|&w| self.is_skin_near(w, &point, size))
        {
            return false;
        }
        let body = self.mesh.bodies[seed as usize];
        let v = self.mesh.add_point(point);
        self.sizes.push(size);
        self.cavity.fill(self.mesh, v, body);
        true
    }

    /// Whether a vertex is too near to a new point, by the wanted size there.
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
    use crate::mesh::TET_EDGES;
    use crate::size::UniformSize;

    /// From 0.001 in the middle of the unit cube to 1.
    struct Steep;

    impl SizeField for Steep {
        fn size_at(&self, point: &Point) -> f64 {
            (0.3 * (point - Point::new(0.5, 0.5, 0.5)).norm()).clamp(0.001, 1.0)
        }
    }

    /// The lengths of the edges of tets at certain places, each in units of the size that `size` has for its middle.
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
    fn a_size_that_falls_by_a_thousand_leaves_no_hole() {
        for squares in [1, 4] {
            let mut soup = Soup::default();
            soup.brick([0.; 3], [1.; 3], squares, INSIDE);
            let surface = soup.surface().unwrap();
            let (mesh, _) = mesh(&surface, &Steep, &Settings::default()).unwrap();
            check_fills(&surface, &mesh);
            // Beside the skin, which is coarser than the field, no tet can follow it.
            let middle = Point::new(0.5, 0.5, 0.5);
            let inside = lengths_of(&mesh, |p| (p - middle).norm() < 0.3, |p| Steep.size_at(p));
            let (least, most) = least_and_most(&inside);
            assert!(inside.len() > 50_000 && least > 0.5 && most < 3.0, "{} {least} {most}", inside.len());
        }
    }

    #[test]
    fn a_skin_of_four_orders_of_magnitude_is_filled_in_smooth_steps() {
        let surface = graded_ball(90, 60, 1e-4).surface().unwrap();
        let (mesh, report) = mesh(&surface, &UniformSize(f64::INFINITY), &Settings::default()).unwrap();
        check_fills(&surface, &mesh);
        assert!(report.points_inside > 1000);
        // The fine pole is at (0, 0, 1): sizes grow by 0.3 per unit of distance from it, or less, and by the skin where that is finer.
        let pole = Point::new(0.0, 0.0, 1.0);
        let inside = lengths_of(&mesh, |p| p.coords.norm() < 0.99, |p| 0.3 * (p - pole).norm());
        let (_, most) = least_and_most(&inside);
        assert!(inside.len() > 10_000 && most < 3.0, "{} {most}", inside.len());
    }
}
