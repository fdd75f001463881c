//! New points for a recovery that no flip can end.
//!
//! A **Steiner point** splits a missing edge or facet where it meets the mesh. **Helping points** stand off the
//! surface: where it is flat up to rounding, the Delaunay mesh stacks slivers on it that nothing can rearrange;
//! points on both sides, inside the slivers' circumspheres, make them go.

use super::cavity::{Walk, walk};
use super::clearance::{Plane, most_inside};
use super::constraints::{Facet, Place, edges};
use super::crossing::{Crossing, crossings, tets_around};
use super::recover::{DEEPEST, Recovery};
use super::tetrahedra::{NO_BODY, NONE};
use crate::kernel::predicates::{Sign, orient3d};
use crate::kernel::simplex::{area_vector, volume6};
use crate::{Point, Vector};

/// Helping points stand off the surface by this fraction of the root of a triangle's doubled area, then by half of it, and so
/// on. Not a round number, so that they do not lie on the other side of a plate.
const STAND_OFF: f64 = 0.37;

/// Steiner points keep this far from the ends of their edge or the sides of their facet, as a fraction of its length. What is 10⁻¹⁷ from a
/// vertex of the surface, as happens where an edge passes by others as closely, lies by rounding in front of the facets there or behind
/// them; sheets that are 10⁻⁹ of the diagonal apart have crossings at least as far from the vertices.
const OFF_ENDS: f64 = 1e-10;

/// The edge or facet that a Steiner point is to split.
pub(super) struct Room {
    pub place: Place,
    /// The directions in which the point may move.
    pub axes: Vec<Vector>,
    /// How far.
    pub ends: Vec<Plane>,
}

impl Room {
    fn is_off_ends(&self, point: &Point) -> bool {
        let least = OFF_ENDS * self.axes.iter().map(Vector::norm).fold(0.0, f64::max);
        self.ends.iter().all(|end| end.depth(point) >= least)
    }
}

/// Crossings along an edge, that in the middle first.
pub(super) fn middle_first(found: &[Crossing]) -> impl Iterator<Item = Crossing> + use<> {
    let mut order: Vec<(usize, Crossing)> = found.iter().copied().enumerate().collect();
    order.sort_by_key(|(i, _)| (2 * i + 1).abs_diff(found.len()));
    order.into_iter().map(|(_, crossing)| crossing)
}

impl Recovery<'_> {
    /// The point of the edge a, b at a crossing, rounded.
    pub(super) fn crossing_point(&self, a: u32, b: u32, crossing: Crossing) -> Point {
        let [p, q] = [a, b].map(|v| *self.mesh.point(v));
        let fraction = match crossing {
            Crossing::Face(half_face) => {
                let [x, y, z] = self.mesh.face(half_face).map(|v| self.mesh.point(v));
                let (below, above) = (volume6(x, y, z, &p), volume6(x, y, z, &q));
                below / (below - above)
            }
            Crossing::Edge(_, [u, v]) => {
                // Where the plane through u, v and across both edges cuts a, b.
                let [u, v] = [u, v].map(|v| *self.mesh.point(v));
                let normal = (v - u).cross(&(v - u).cross(&(q - p)));
                (u - p).dot(&normal) / (q - p).dot(&normal)
            }
            Crossing::Vertex(v) => (self.mesh.point(v) - p).norm() / (q - p).norm(),
        };
        p + (q - p) * fraction.clamp(0.0, 1.0)
    }

    /// Puts a Steiner point on a missing edge where it crosses the mesh.
    pub(super) fn split_edge(&mut self, a: u32, b: u32) -> Option<u32> {
        let mut found = std::mem::take(&mut self.found);
        crossings(self.mesh, a, b, &mut self.star, &mut found);
        let split = self.constraints.facets_at_edge(a, b);
        let triangle = self.constraints.facets[*split.first()? as usize].triangle;
        let room = self.room_on_edge(a, b, triangle);
        let added = self.split_at(a, b, &found, &room);
        self.found = found;
        let p = added?;
        for f in split {
            let facet = self.constraints.facets[f as usize];
            self.constraints.remove(f);
            for end in [a, b] {
                let half = facet.vertices.map(|v| if v == end { p } else { v });
                self.constraints.add(half, facet.triangle);
            }
        }
        Some(p)
    }

    /// Puts a Steiner point on a missing edge at one of its crossings, that in the middle first, else between two.
    pub(super) fn split_at(&mut self, a: u32, b: u32, found: &[Crossing], room: &Room) -> Option<u32> {
        let added = middle_first(found).find_map(|crossing| {
            let point = self.crossing_point(a, b, crossing);
            let tets = tets_around(self.mesh, crossing);
            self.add_steiner(&tets, point, room)
        });
        added.or_else(|| self.split_between(a, b, found, room))
    }

    /// Puts a Steiner point on a missing edge inside a tet that it goes through, the longest way first. Where the edge
    /// passes close by other edges its crossings let no point be put on them: shorter pieces are easier.
    fn split_between(&mut self, a: u32, b: u32, found: &[Crossing], room: &Room) -> Option<u32> {
        let first = match *found.first()? {
            Crossing::Face(first) => first,
            // The way to an edge lies in the face between: a little beside the crossing there is more room.
            Crossing::Edge(tet, edge) => {
                let to = self.crossing_point(a, b, found[0]);
                let opposite =
                    self.mesh.tets[tet as usize].iter().position(|v| *v != a && !edge.contains(v))?;
                let tets = tets_around(self.mesh, Crossing::Face(4 * tet + opposite as u32));
                return self.add_steiner(&tets, nalgebra::center(self.mesh.point(a), &to), room);
            }
            Crossing::Vertex(_) => return None,
        };
        let mut places = vec![(*self.mesh.point(a), first >> 2)];
        for &crossing in found {
            if let Crossing::Face(half_face) = crossing {
                places.push((self.crossing_point(a, b, crossing), self.mesh.across(half_face) >> 2));
            }
        }
        let ends: Vec<Point> = places.iter().skip(1).map(|p| p.0).collect();
        let mut ways: Vec<(f64, Point, u32)> = std::iter::zip(&places, &ends)
            .map(|((from, tet), to)| ((to - from).norm(), nalgebra::center(from, to), *tet))
            .collect();
        // A way that ends at an edge or vertex is not among them, the last one is.
        if let (Some((from, tet)), Some(Crossing::Face(_))) = (places.last(), found.last()) {
            let to = self.mesh.point(b);
            ways.push(((to - from).norm(), nalgebra::center(from, to), *tet));
        }
        ways.sort_by(|one, other| other.0.total_cmp(&one.0));
        ways.into_iter().find_map(|(_, point, tet)| self.add_steiner(&[tet], point, room))
    }

    fn room_on_edge(&self, a: u32, b: u32, triangle: u32) -> Room {
        let place = self.constraints.edge_of(a, b).map_or(Place::Triangle(triangle), Place::Edge);
        self.room_on_line(a, b, place)
    }

    pub(super) fn room_on_line(&self, a: u32, b: u32, place: Place) -> Room {
        let [p, q] = [a, b].map(|v| self.mesh.point(v));
        let ends = [Plane::across(&(p - q), p), Plane::across(&(q - p), q)];
        Room { place, axes: vec![q - p], ends: ends.into_iter().flatten().collect() }
    }

    pub(super) fn room_in_facet(&self, facet: Facet) -> Room {
        let [a, b, c] = facet.vertices.map(|v| self.mesh.point(v));
        let normal = area_vector(a, b, c);
        let beside = |[p, q]: [&Point; 2]| Plane::across(&(q - p).cross(&normal), p);
        let ends = [[a, b], [b, c], [c, a]].into_iter().filter_map(beside).collect();
        let across = normal.cross(&(b - a)).try_normalize(0.0).unwrap_or_else(Vector::zeros);
        let axes = vec![b - a, across * (b - a).norm().max((c - a).norm())];
        Room { place: Place::Triangle(facet.triangle), axes, ends }
    }

    /// Stars tets from a new point near `point`, where it has most room. Tets behind faces that do not see it are taken in first:
    /// near slivers the point may be, by rounding, on the wrong side of some.
    pub(super) fn add_steiner(&mut self, tets: &[u32], point: Point, room: &Room) -> Option<u32> {
        /// More than a split of an edge with its usual ring needs, by far.
        const MOST_TETS: usize = 64;
        let mut tets = tets.to_vec();
        if tets.is_empty() || self.steiner.len() >= self.most_steiner {
            return None;
        }
        let point = loop {
            self.cavity.take(self.mesh, &tets);
            let planes: Vec<Plane> = self
                .cavity
                .walls
                .iter()
                .filter_map(|&wall| Plane::of(self.mesh.face_points(wall)))
                .chain(room.ends.iter().copied())
                .collect();
            // The crossing lies in the plane of what is crossed: flips could make flat tets of these later.
            let best = most_inside(&point, &room.axes, &planes).0;
            let fits = |p: &Point| room.is_off_ends(p) && self.is_star_shaped(&tets, p, room.place);
            if let Some(seen) = [best, point].into_iter().find(fits) {
                break seen;
            }
            let grown = self.behind_unseen(&tets, &point, room.place)?;
            tets.extend(grown);
            if tets.len() > MOST_TETS {
                return None;
            }
        };
        if !self.keeps_edges(&tets) {
            return None;
        }
        let p = self.mesh.add_point(point);
        let body = self.mesh.bodies[tets[0] as usize];
        self.cavity.fill(self.mesh, p, body);
        self.constraints.set_place(p, room.place);
        self.steiner.push(p);
        self.counts.steiner += 1;
        Some(p)
    }

    /// Whether all walls around tets see a point; the cavity is these tets then.
    fn is_star_shaped(&mut self, tets: &[u32], point: &Point, place: Place) -> bool {
        self.cavity.take(self.mesh, tets);
        self.cavity.walls.iter().all(|&wall| self.sees(point, place, wall))
            && self.cavity.make_star_shaped(self.mesh, tets[0], point)
    }

    /// Whether a point and a half-face that it lies behind make a tet that is positive, and not by rounding alone.
    fn sees(&self, point: &Point, place: Place, half_face: u32) -> bool {
        let [a, b, c] = self.mesh.face_points(half_face);
        orient3d(a, b, c, point) == Sign::Negative
            && !self.constraints.is_flat(&self.mesh.face(half_face), Some(place))
    }

    /// The tets behind those faces around `tets` that do not see a point; `None` if there are none, or one of the
    /// faces must stay.
    fn behind_unseen(&self, tets: &[u32], point: &Point, place: Place) -> Option<Vec<u32>> {
        let mut behind = Vec::new();
        for half_face in tets.iter().flat_map(|&t| 4 * t..4 * t + 4) {
            let other = self.mesh.across(half_face);
            if (other != NONE && tets.contains(&(other >> 2))) || self.sees(point, place, half_face) {
                continue;
            }
            if other == NONE || self.constraints.facet(self.mesh.face(half_face)).is_some() {
                return None;
            }
            behind.push(other >> 2);
        }
        behind.sort_unstable();
        behind.dedup();
        (!behind.is_empty()).then_some(behind)
    }

    /// Whether the facets and their edges among some tets are all on the surface of the cavity they make.
    pub(super) fn keeps_edges(&self, tets: &[u32]) -> bool {
        let outer = |h: &u32| {
            let other = self.mesh.across(*h);
            other == NONE || !tets.contains(&(other >> 2))
        };
        let half_faces = || tets.iter().flat_map(|&t| 4 * t..4 * t + 4);
        let kept: Vec<[u32; 2]> = half_faces().filter(outer).flat_map(|h| edges(self.mesh.face(h))).collect();
        half_faces().filter(|h| !outer(h)).all(|h| {
            let face = self.mesh.face(h);
            self.constraints.facet(face).is_none()
                && edges(face).iter().all(|e| !self.constraints.has_edge(e[0], e[1]) || kept.contains(e))
        })
    }

    /// Where an edge pierces a face, rounded.
    pub(super) fn piercing_point(&self, face: [u32; 3], [u, v]: [u32; 2]) -> Point {
        let [x, y, z] = face.map(|v| self.mesh.point(v));
        let [p, q] = [u, v].map(|v| self.mesh.point(v));
        let (below, above) = (volume6(x, y, z, p), volume6(x, y, z, q));
        p + (q - p) * (below / (below - above)).clamp(0.0, 1.0)
    }

    /// Puts a Steiner point on a missing facet where an edge pierces it. True where nothing is left to do now.
    pub(super) fn split_facet(&mut self, f: u32) -> bool {
        if self.recover_facet(f, DEEPEST) {
            return true;
        }
        let Some(edges) = self.obstacles(f) else { return false };
        let facet = self.constraints.facets[f as usize];
        let room = self.room_in_facet(facet);
        for (tet, edge) in edges {
            let point = self.piercing_point(facet.vertices, edge);
            let tets = tets_around(self.mesh, Crossing::Edge(tet, edge));
            if let Some(p) = self.add_steiner(&tets, point, &room) {
                self.constraints.remove(f);
                let [a, b, c] = facet.vertices;
                for part in [[a, b, p], [b, c, p], [c, a, p]] {
                    self.constraints.add(part, facet.triangle);
                }
                return true;
            }
        }
        false
    }

    /// Adds points over and under the middle of some facets, not across facets that are there. False if none could be.
    pub(super) fn add_helping_points(&mut self, facets: &[u32], halvings: u32) -> bool {
        self.lock_present_facets();
        let before = self.helping.len();
        for &f in facets {
            let [a, b, c] = self.constraints.facets[f as usize].vertices.map(|v| *self.mesh.point(v));
            let normal = area_vector(&a, &b, &c);
            let center = Point::from((a.coords + b.coords + c.coords) / 3.0);
            let away = normal * (STAND_OFF * 0.5f64.powi(halvings as i32) / normal.norm().sqrt());
            for point in [center + away, center - away] {
                self.add_helping_point(self.constraints.facets[f as usize].vertices[0], point);
            }
        }
        self.helping.len() > before
    }

    /// Inserts a point near a vertex as into a Delaunay mesh, keeping facets.
    fn add_helping_point(&mut self, near: u32, point: Point) {
        self.mesh.star(near, &mut self.star);
        let inside = self.star.iter().find_map(|&t| match walk(self.mesh, t, &point) {
            Walk::Inside(seed) => Some(seed),
            Walk::Blocked(_) => None,
        });
        let Some(seed) = inside else { return };
        if self.mesh.corners(seed).iter().any(|p| **p == point) {
            return;
        }
        self.cavity.grow(self.mesh, seed, &point);
        if self.cavity.make_star_shaped(self.mesh, seed, &point) {
            let p = self.mesh.add_point(point);
            self.cavity.fill(self.mesh, p, NO_BODY);
            self.helping.push(p);
        }
    }
}
