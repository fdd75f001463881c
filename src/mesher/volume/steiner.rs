//! Steiner points exactly on the surface.
//!
//! A point on edge ab is a + t(b − a), a point in triangle abc is a + s(b − a) + t(c − a). With
//! dyadic t and s such points have integer coordinates in a sufficiently small unit ([`Fixed`]), so
//! all signs stay exact and no tolerance is needed (with implicit points: Diazzi, Panozzo, Vaxman,
//! Attene 2023, section 4). A point inserted into the tets around a crossing need not be the
//! crossing itself: close to it all walls are visible too, so sufficiently many bits always
//! suffice. Where clearance is largest a few bits suffice, so that position is tried first.

use super::clearance::{Plane, deepest_point};
use super::constraints::{Facet, Place, edges};
use super::crossing::{Crossing, tets_around};
use super::recover::Recovery;
use super::tetrahedra::Tetrahedra;
use crate::ground::kernel::fixed::{Fixed, Volume, bits_of, share, volume};
use crate::ground::kernel::predicates::Sign;
use crate::ground::kernel::simplex::{area_vector, volume6};
use crate::mesher::half_face::NONE;
use crate::{Point, Vector};
use std::collections::BTreeSet;

/// Step in the number of bits if floating point shows no clearance; more are used each time, up to
/// [`MOST_BITS`].
const BITS: usize = 8;

/// The most tets in the cavity of one point.
const MOST_TETS: usize = 64;

/// The most bits of a weight.
const MOST_BITS: usize = 240;

/// The region in which a Steiner point may be placed.
struct Room {
    place: Place,
    /// The directions in which the point may move, with their lengths.
    axes: Vec<Vector>,
    /// The planes that bound the region.
    ends: Vec<Plane>,
}

/// Crossings along an edge, ordered by distance from the middle one.
pub(super) fn middle_first(found: &[Crossing]) -> impl Iterator<Item = Crossing> + use<> {
    let mut order: Vec<(usize, Crossing)> = found.iter().copied().enumerate().collect();
    order.sort_by_key(|(i, _)| (2 * i + 1).abs_diff(found.len()));
    order.into_iter().map(|(_, crossing)| crossing)
}

impl Recovery<'_> {
    /// Inserts a Steiner point on a surface or kept edge where its segment (a, b) crosses the mesh.
    pub(super) fn split_exactly(
        &mut self,
        edge: [u32; 2],
        [a, b]: [u32; 2],
        crossing: Crossing,
        others: &[Crossing],
    ) -> Option<u32> {
        let tets = tets_around(self.mesh, crossing);
        let more: BTreeSet<u32> = others.iter().flat_map(|&c| tets_around(self.mesh, c)).collect();
        let plane = self.plane_of(edge, crossing, &tets)?;
        let point = self.crossing_point(a, b, crossing);
        let room = self.room_on_line(edge, [a, b]);
        let [from, to] = edge.map(|v| *self.mesh.point(v));
        let along = to - from;
        let part = |p: &Point| [(p - from).dot(&along) / along.norm_squared()];
        let exact = |mesh: &Tetrahedra| {
            let [p, q] = edge.map(|v| volume_between(mesh, plane, v));
            [share(p, [p, q], MOST_BITS)]
        };
        self.star_exactly((&tets, &more), edge, (&point, &room), part, exact)
    }

    /// The point of segment ab at a crossing, rounded.
    pub(super) fn crossing_point(&self, a: u32, b: u32, crossing: Crossing) -> Point {
        let [p, q] = [a, b].map(|v| *self.mesh.point(v));
        let fraction = match crossing {
            Crossing::Face(half_face) => {
                let [x, y, z] = self.mesh.face(half_face).map(|v| self.mesh.point(v));
                let (below, above) = (volume6(x, y, z, &p), volume6(x, y, z, &q));
                below / (below - above)
            }
            Crossing::Edge(_, [u, v]) => {
                // Intersection of ab with the plane that contains uv and the common normal of both
                // edges.
                let [u, v] = [u, v].map(|v| *self.mesh.point(v));
                let normal = (v - u).cross(&(v - u).cross(&(q - p)));
                (u - p).dot(&normal) / (q - p).dot(&normal)
            }
            Crossing::Vertex(v) => (self.mesh.point(v) - p).norm() / (q - p).norm(),
        };
        p + (q - p) * fraction.clamp(0.0, 1.0)
    }

    fn room_on_line(&self, edge: [u32; 2], [a, b]: [u32; 2]) -> Room {
        let [p, q] = [a, b].map(|v| self.mesh.point(v));
        let ends = [Plane::across(&(p - q), p), Plane::across(&(q - p), q)];
        Room { place: Place::Edge(edge), axes: vec![q - p], ends: ends.into_iter().flatten().collect() }
    }

    /// Three vertices whose plane the edge crosses at the crossing.
    fn plane_of(&self, [a, _]: [u32; 2], crossing: Crossing, tets: &[u32]) -> Option<[u32; 3]> {
        match crossing {
            Crossing::Face(half_face) => Some(self.mesh.face(half_face)),
            Crossing::Edge(_, [u, v]) => {
                let around = tets.iter().flat_map(|&t| self.mesh.tets[t as usize]);
                let beside = |w: &u32| ![u, v].contains(w) && self.mesh.side([u, v, a], *w) != Sign::Zero;
                around.into_iter().find(beside).map(|w| [u, v, w])
            }
            Crossing::Vertex(_) => None,
        }
    }

    /// Inserts a Steiner point in a surface triangle where a mesh edge pierces it.
    pub(super) fn pierce_exactly(
        &mut self,
        facet: Facet,
        tet: u32,
        [u, v]: [u32; 2],
        more: &BTreeSet<u32>,
    ) -> Option<u32> {
        let tets = tets_around(self.mesh, Crossing::Edge(tet, [u, v]));
        let triangle = facet.vertices;
        let point = self.piercing_point(triangle, [u, v]);
        let room = self.room_in_facet(facet);
        let corners = triangle.map(|v| *self.mesh.point(v));
        let part = |p: &Point| {
            let [a, b, c] = &corners;
            let normal = area_vector(a, b, c);
            [area_vector(a, p, c), area_vector(a, b, p)].map(|n| n.dot(&normal) / normal.norm_squared())
        };
        let exact = |mesh: &Tetrahedra| {
            let [a, b, c] = triangle;
            let [p, q, r] = [[b, c], [c, a], [a, b]].map(|[x, y]| volume_between(mesh, [u, v, x], y));
            [q, r].map(|side| share(side, [p, q, r], MOST_BITS))
        };
        self.star_exactly((&tets, more), triangle, (&point, &room), part, exact)
    }

    /// The point where an edge pierces a face, rounded.
    fn piercing_point(&self, face: [u32; 3], [u, v]: [u32; 2]) -> Point {
        let [x, y, z] = face.map(|v| self.mesh.point(v));
        let [p, q] = [u, v].map(|v| self.mesh.point(v));
        let (below, above) = (volume6(x, y, z, p), volume6(x, y, z, q));
        p + (q - p) * (below / (below - above)).clamp(0.0, 1.0)
    }

    fn room_in_facet(&self, facet: Facet) -> Room {
        let [a, b, c] = facet.vertices.map(|v| self.mesh.point(v));
        let normal = area_vector(a, b, c);
        let beside = |[p, q]: [&Point; 2]| Plane::across(&(q - p).cross(&normal), p);
        let ends = [[a, b], [b, c], [c, a]].into_iter().filter_map(beside).collect();
        let across = normal.cross(&(b - a)).try_normalize(0.0).unwrap_or_else(Vector::zeros);
        let axes = vec![b - a, across * (b - a).norm().max((c - a).norm())];
        Room { place: Place::Triangle(facet.triangle), axes, ends }
    }

    /// Inserts a point of the edge or triangle `corners` into `tets`.
    ///
    /// It is placed near the position of most clearance in `room`, or else close enough to the
    /// crossing. `part` returns the weights of all corners but the first for a position, `exact`
    /// the weights of the crossing, bit by bit.
    fn star_exactly<const N: usize, const K: usize>(
        &mut self,
        (tets, more): (&[u32], &BTreeSet<u32>),
        corners: [u32; N],
        (near, room): (&Point, &Room),
        part: impl Fn(&Point) -> [f64; K],
        exact: impl Fn(&Tetrahedra) -> [Vec<bool>; K],
    ) -> Option<u32> {
        if tets.is_empty() || self.steiner.len() >= self.most_steiner {
            return None;
        }
        self.cavity.set_tets(self.mesh, tets);
        let corners = corners.map(|v| self.mesh.place(v));
        let ways: [Fixed; K] = std::array::from_fn(|k| corners[k + 1].minus(&corners[0]));
        let walls = self.cavity.walls.iter().filter_map(|&wall| Plane::of(self.mesh.face_points(wall)));
        let planes: Vec<Plane> = walls.chain(room.ends.iter().copied()).collect();
        let (best, radius) = deepest_point(near, &room.axes, &planes);
        let reach = room.axes.iter().map(Vector::norm).fold(0.0, f64::max);
        if radius > 0.0 {
            // The position may be off by a quarter of the radius.
            let bits =
                ((reach / radius).log2().ceil() + 2.0).clamp(1.0, f64::from(f64::MANTISSA_DIGITS)) as usize;
            let weights = part(&best).map(|t| bits_of(t.clamp(0.0, 1.0), bits));
            let place = corners[0].along(ways, weights.each_ref().map(|bits| &bits[..]));
            if let Some(p) = place.and_then(|place| self.star_from(tets, more, &place, room.place)) {
                return Some(p);
            }
        }
        let weights = exact(self.mesh);
        (BITS..=MOST_BITS).step_by(BITS).find_map(|bits| {
            let place = corners[0].along(ways, weights.each_ref().map(|all| &all[..bits]))?;
            self.star_from(tets, more, &place, room.place)
        })
    }

    /// Inserts a vertex at an exact position if all walls of the cavity are visible from it.
    fn star_from(&mut self, tets: &[u32], more: &BTreeSet<u32>, at: &Fixed, place: Place) -> Option<u32> {
        let points = self.mesh.points.len();
        let p = self.mesh.add_exact_point(at);
        let sees = |&wall: &u32| self.mesh.side(self.mesh.face(wall), p) == Sign::Negative;
        if !self.cavity.walls.iter().all(sees) {
            self.mesh.forget_points(points);
            return None;
        }
        self.extend_cavity(tets, more, p);
        let body = self.mesh.bodies[tets[0] as usize];
        self.cavity.fill(self.mesh, p, body);
        self.constraints.set_place(p, place);
        self.steiner.push(p);
        Some(p)
    }

    /// Enlarges the cavity by tets of `more` while all walls are visible from p and kept edges stay
    /// on its boundary.
    fn extend_cavity(&mut self, tets: &[u32], more: &BTreeSet<u32>, p: u32) {
        let mut tets = tets.to_vec();
        self.cavity.set_tets(self.mesh, &tets);
        let mut open = self.cavity.walls.clone();
        while let Some(wall) = open.pop() {
            let behind = self.mesh.across(wall);
            let t = behind >> 2;
            if behind == NONE || tets.len() == MOST_TETS || !more.contains(&t) || tets.contains(&t) {
                continue;
            }
            let outer = |h: &u32| !tets.contains(&(self.mesh.across(*h) >> 2));
            let walls: Vec<u32> = (4 * t..4 * t + 4).filter(|h| *h != behind).filter(outer).collect();
            if walls.iter().any(|&h| self.mesh.side(self.mesh.face(h), p) != Sign::Negative) {
                continue;
            }
            tets.push(t);
            self.cavity.set_tets(self.mesh, &tets);
            if self.cavity.is_simple() && self.keeps_edges(&tets) {
                open.extend(walls);
            } else {
                tets.pop();
            }
        }
        self.cavity.set_tets(self.mesh, &tets);
    }

    /// Whether all facets and kept edges of some tets are on the boundary of their union.
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
}

fn volume_between(mesh: &Tetrahedra, [a, b, c]: [u32; 3], d: u32) -> Volume {
    volume([a, b, c, d].map(|v| mesh.place(v)).each_ref())
}
