//! New points for a recovery that no flip can end.
//!
//! A **Steiner point** splits a missing edge or facet where it meets the mesh. **Helping points** stand off the
//! surface: where it is flat up to rounding, the Delaunay mesh stacks slivers on it that nothing can rearrange;
//! points on both sides, inside the slivers' circumspheres, make them go.

use super::cavity::{Walk, walk};
use super::constraints::edges;
use super::crossing::{Crossing, crossings, tets_around};
use super::recover::{DEEPEST, Recovery};
use super::tetrahedra::{NO_BODY, NONE};
use crate::Point;
use crate::kernel::predicates::{Sign, orient3d};
use crate::kernel::quality::mean_ratio;
use crate::kernel::simplex::{area_vector, volume6};

/// Helping points stand off the surface by this fraction of the root of a triangle's doubled area, then by half of it, and so
/// on. Not a round number, so that they do not lie on the other side of a plate.
const STAND_OFF: f64 = 0.37;

/// Where Steiner points are put between two crossings: the middle first.
const WAYS: [f64; 3] = [0.5, 0.25, 0.75];

/// Whether a point and a half-face that it lies behind make a tet that is positive and whose mean ratio is `least` or more
/// (by rounding that of a positive tet may be below 0).
fn sees_well(point: &Point, [a, b, c]: [&Point; 3], least: f64) -> bool {
    orient3d(a, b, c, point) == Sign::Negative && mean_ratio(point, a, b, c).max(0.0) >= least
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

    /// Puts a Steiner point on a missing edge where it crosses the mesh, the crossing in the middle first.
    pub(super) fn split_edge(&mut self, a: u32, b: u32) -> Option<u32> {
        let mut found = std::mem::take(&mut self.found);
        crossings(self.mesh, a, b, &mut self.star, &mut found);
        let mut order: Vec<usize> = (0..found.len()).collect();
        order.sort_by_key(|&i| (2 * i + 1).abs_diff(found.len()));
        let added = order.into_iter().find_map(|i| {
            let point = self.crossing_point(a, b, found[i]);
            let tets = tets_around(self.mesh, found[i]);
            self.add_steiner(&tets, point)
        });
        let added = added.or_else(|| self.split_between(a, b, &found));
        self.found = found;
        let p = added?;
        self.constraints.set_on_edge(a, b, p);
        let split: Vec<u32> = self
            .constraints
            .facets_at(a)
            .into_iter()
            .filter(|&f| self.constraints.facets[f as usize].vertices.contains(&b))
            .collect();
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

    /// Puts a Steiner point on a missing edge inside a tet that it goes through, the longest way first. Where the edge
    /// passes close by other edges its crossings let no point be put on them: shorter pieces are easier.
    fn split_between(&mut self, a: u32, b: u32, found: &[Crossing]) -> Option<u32> {
        let first = match *found.first()? {
            Crossing::Face(first) => first,
            // The way to an edge lies in the face between: a little beside the crossing there is more room.
            Crossing::Edge(tet, edge) => {
                let to = self.crossing_point(a, b, found[0]);
                let opposite =
                    self.mesh.tets[tet as usize].iter().position(|v| *v != a && !edge.contains(v))?;
                let tets = tets_around(self.mesh, Crossing::Face(4 * tet + opposite as u32));
                return WAYS.iter().find_map(|part| {
                    let point = self.mesh.point(a) + (to - self.mesh.point(a)) * *part;
                    self.add_steiner(&tets, point)
                });
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
        ways.into_iter().find_map(|(_, point, tet)| self.add_steiner(&[tet], point))
    }

    /// Stars tets from a new point. Tets behind faces that do not see it are taken in first: near slivers the
    /// point may be, by rounding, on the wrong side of some.
    fn add_steiner(&mut self, tets: &[u32], point: Point) -> Option<u32> {
        /// More than a split of an edge with its usual ring needs, by far.
        const MOST_TETS: usize = 64;
        let mut tets = tets.to_vec();
        if tets.is_empty() || self.steiner.len() >= self.most_steiner {
            return None;
        }
        loop {
            self.cavity.take(self.mesh, &tets);
            if self.cavity.make_star_shaped(self.mesh, tets[0], &point)
                && self.cavity.tets.len() == tets.len()
                && self.walls_are_seen_well(&point)
            {
                break;
            }
            let grown = self.behind_unseen(&tets, &point)?;
            tets.extend(grown);
            if tets.len() > MOST_TETS {
                return None;
            }
        }
        if !self.keeps_edges(&tets) {
            return None;
        }
        let p = self.mesh.add_point(point);
        self.cavity.fill(self.mesh, p, NO_BODY);
        self.steiner.push(p);
        self.counts.steiner += 1;
        Some(p)
    }

    fn walls_are_seen_well(&self, point: &Point) -> bool {
        self.cavity.walls.iter().all(|&wall| {
            let [a, b, c] = self.mesh.face(wall).map(|v| self.mesh.point(v));
            sees_well(point, [a, b, c], self.flips.flat)
        })
    }

    /// The tets behind those faces around `tets` that do not see a point well; `None` if there are none, or one of the
    /// faces must stay.
    fn behind_unseen(&self, tets: &[u32], point: &Point) -> Option<Vec<u32>> {
        let mut behind = Vec::new();
        for half_face in tets.iter().flat_map(|&t| 4 * t..4 * t + 4) {
            let other = self.mesh.across(half_face);
            let [a, b, c] = self.mesh.face(half_face).map(|v| self.mesh.point(v));
            if (other != NONE && tets.contains(&(other >> 2))) || sees_well(point, [a, b, c], self.flips.flat)
            {
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
    fn keeps_edges(&self, tets: &[u32]) -> bool {
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
        for (tet, edge) in edges {
            let point = self.piercing_point(facet.vertices, edge);
            let tets = tets_around(self.mesh, Crossing::Edge(tet, edge));
            if let Some(p) = self.add_steiner(&tets, point) {
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
