//! Sectors of a vertex star, and the position from which one is filled: its whole boundary must be
//! visible from there.

use super::carve::is_even;
use super::clearance::{Plane, deepest_point};
use super::tetrahedra::Tetrahedra;
use crate::ground::kernel::fixed::Fixed;
use crate::ground::kernel::predicates::Sign;
use crate::ground::kernel::quality::mean_ratio;
use crate::ground::kernel::simplex::area_vector;
use crate::ground::kernel::simplex::ascending;
use crate::mesher::half_face::NONE;
use crate::{Point, Vector};

/// Least worst mean ratio at which a sector is filled from one of its own vertices without trying a
/// new point: a sliver of 0.001 is harder to repair than an additional vertex.
pub(super) const GOOD_ENOUGH: f64 = 0.05;

/// The part of a vertex star between facets.
#[derive(Clone, Debug, Default)]
pub(super) struct Sector {
    pub body: u32,
    pub tets: Vec<u32>,
    /// Its boundary faces once the Steiner point is removed, outward.
    pub skin: Vec<[u32; 3]>,
    /// The half-faces of `tets` that are in `skin`.
    pub walls: Vec<u32>,
    /// Faces of `skin` that replace the facets at the Steiner point p; p lies in their planes.
    pub fresh: Vec<[u32; 3]>,
    /// The surface triangles that contain the faces in `fresh`, outward.
    pub sides: Vec<[u32; 3]>,
}

/// The apex from which a sector is filled.
#[derive(Clone, Copy, Debug)]
pub(super) enum Apex {
    Own(u32),
    New(Point),
    NewExact(Fixed),
}

impl Sector {
    /// A sector of tets of one body without facets between them; `walls` are their outer
    /// half-faces.
    pub fn inside(mesh: &Tetrahedra, body: u32, tets: Vec<u32>, walls: Vec<u32>) -> Self {
        let mut sector = Self { body, tets, walls, ..Self::default() };
        sector.set_skin(mesh);
        sector
    }

    /// The largest distance of its boundary vertices from a point.
    pub fn reach(&self, mesh: &Tetrahedra, from: &Point) -> f64 {
        let distance = |&v: &u32| (mesh.point(v) - from).norm();
        self.skin.iter().flatten().map(distance).fold(0.0, f64::max)
    }

    pub fn set_skin(&mut self, mesh: &Tetrahedra) {
        self.skin.clear();
        self.skin.extend(self.walls.iter().map(|&w| mesh.face(w)));
        for &facet in &self.fresh {
            // A facet opposite to a face of the same corners encloses nothing: both are coplanar up
            // to rounding.
            let turned = |face: &[u32; 3]| ascending(*face) == ascending(facet) && !is_even(*face, facet);
            match self.skin.iter().position(turned) {
                Some(i) => drop(self.skin.swap_remove(i)),
                None => self.skin.push(facet),
            }
        }
    }

    /// The tets between an apex and its boundary.
    pub fn star(&self, mesh: &mut Tetrahedra, apex: Apex) -> Vec<[u32; 4]> {
        self.star_of(match apex {
            Apex::Own(v) => v,
            Apex::New(point) => mesh.add_point(point),
            Apex::NewExact(place) => mesh.add_exact_point(&place),
        })
    }

    /// The tets between a vertex and its boundary.
    pub fn star_of(&self, apex: u32) -> Vec<[u32; 4]> {
        let seen = self.skin.iter().filter(|face| !face.contains(&apex));
        seen.map(|&[a, b, c]| [apex, a, b, c]).collect()
    }

    /// Adds the tets behind walls for which `behind` holds; false if there are none.
    pub fn grow(&mut self, mesh: &Tetrahedra, behind: impl Fn(u32) -> bool) -> bool {
        let before = self.tets.len();
        for wall in self.walls.clone() {
            let beyond = mesh.across(wall);
            if behind(wall) && beyond != NONE && !mesh.is_locked(wall) && !self.tets.contains(&(beyond >> 2))
            {
                self.tets.push(beyond >> 2);
            }
        }
        let half_faces = self.tets[before..].iter().flat_map(|&t| 4 * t..4 * t + 4);
        self.walls.extend(half_faces);
        let inner = |w: &u32| {
            let behind = mesh.across(*w);
            behind != NONE && !mesh.is_locked(*w) && self.tets.contains(&(behind >> 2))
        };
        self.walls.retain(|w| !inner(w));
        self.set_skin(mesh);
        self.tets.len() > before
    }

    /// Whether all vertices of its tets are on its boundary, except those that may be removed.
    pub fn keeps_vertices(&self, mesh: &Tetrahedra, may_go: impl Fn(u32) -> bool) -> bool {
        let on_surface = |v: u32| {
            self.walls.iter().any(|&w| mesh.face(w).contains(&v)) || self.fresh.iter().any(|f| f.contains(&v))
        };
        self.tets.iter().flat_map(|&t| mesh.tets[t as usize]).all(|v| may_go(v) || on_surface(v))
    }
}

/// The own vertex from which a sector is filled best, and the worst mean ratio; negative if no
/// vertex sees the whole boundary.
pub(super) fn best_own(mesh: &Tetrahedra, sector: &Sector) -> (f64, u32) {
    let mut own: Vec<u32> = sector.skin.iter().flatten().copied().collect();
    own.sort_unstable();
    own.dedup();
    let mut best = (f64::NEG_INFINITY, NONE);
    for &v in &own {
        let quality = worst(mesh, &sector.skin, mesh.point(v), v, best.0);
        if quality > best.0 {
            best = (quality, v);
        }
    }
    best
}

/// The best apex for filling a sector: an own vertex, a new point, or an exact point close to p.
pub(super) fn find_apex(mesh: &mut Tetrahedra, sector: &Sector, p: u32) -> Option<Apex> {
    if sector.skin.is_empty() {
        return Some(Apex::Own(p));
    }
    let (quality, own) = best_own(mesh, sector);
    let mut best = (quality, (own != NONE).then_some(Apex::Own(own)));
    if best.0 >= GOOD_ENOUGH {
        return best.1;
    }
    if let Some((quality, point)) = find_place(mesh, sector, p)
        && quality > best.0
    {
        best = (quality, Some(Apex::New(point)));
    }
    best.1.or_else(|| point_near(mesh, sector, p))
}

/// A point so close to p that it sees all walls of the sector: those visible from p, and the facets
/// in whose planes p lies. In exact arithmetic it exists, unless both sides of a facet are in the
/// sector.
fn point_near(mesh: &mut Tetrahedra, sector: &Sector, p: u32) -> Option<Apex> {
    let inward = directions(mesh, sector, p);
    let place = mesh.place(p);
    let points = mesh.points.len();
    let mut way = Fixed::of(&Point::from(inward))?;
    loop {
        way = way.nearly_halved()?;
        let near = place.plus(&way);
        let v = mesh.add_exact_point(&near);
        let sees = sector.skin.iter().all(|&face| mesh.side(face, v) == Sign::Negative);
        mesh.forget_points(points);
        if sees {
            return Some(Apex::NewExact(near));
        }
    }
}

/// A point that sees the whole boundary of a sector, and the worst mean ratio from there.
pub(super) fn find_place(mesh: &Tetrahedra, sector: &Sector, p: u32) -> Option<(f64, Point)> {
    let start = *mesh.point(p);
    let reach = sector.reach(mesh, &start);
    let planes: Vec<Plane> = sector.skin.iter().filter_map(|f| Plane::of(f.map(|v| mesh.point(v)))).collect();
    let axes = [Vector::x() * reach, Vector::y() * reach, Vector::z() * reach];
    let (place, _) = deepest_point(&start, &axes, &planes);
    let quality = worst(mesh, &sector.skin, &place, NONE, 0.0);
    if quality < 0.0 {
        return None;
    }
    let (quality, place) = climb(mesh, sector, (quality, place), reach);
    Fixed::of(&place).map(|_| (quality, place))
}

/// The inward direction from the facets at p, with the length of the sector's extent.
///
/// The facets lie in at most two planes: the bisector of two inward normals is inside both, for any
/// angle.
pub(super) fn directions(mesh: &Tetrahedra, sector: &Sector, p: u32) -> Vector {
    let reach = sector.reach(mesh, mesh.point(p));
    let inward = sector.sides.iter().fold(Vector::zeros(), |sum, face| {
        let [a, b, c] = face.map(|v| mesh.point(v));
        sum - area_vector(a, b, c).normalize()
    });
    inward.try_normalize(0.0).unwrap_or_else(Vector::zeros) * reach
}

/// Coordinate search: moves a point along the axes while the worst mean ratio increases.
fn climb(mesh: &Tetrahedra, sector: &Sector, from: (f64, Point), reach: f64) -> (f64, Point) {
    /// Enough halvings of the step to go well below distances relevant for shape.
    const STEPS: usize = 60;
    let mut best = from;
    let mut step = 0.25 * reach;
    for _ in 0..STEPS {
        let before = best.0;
        for way in [Vector::x(), Vector::y(), Vector::z()] {
            for sign in [1.0, -1.0] {
                let point = best.1 + way * (sign * step);
                let quality = worst(mesh, &sector.skin, &point, NONE, best.0);
                if quality > best.0 {
                    best = (quality, point);
                }
            }
        }
        if best.0 == before {
            step *= 0.5;
        }
    }
    best
}

/// The worst mean ratio of a sector filled from a point, or from its vertex `own` unless that is
/// `NONE`.
///
/// Minus infinity if some tet is not positive; stops early if the ratio is below `floor`.
pub(super) fn worst(mesh: &Tetrahedra, skin: &[[u32; 3]], apex: &Point, own: u32, floor: f64) -> f64 {
    let mut worst = f64::INFINITY;
    for face in skin.iter().filter(|face| !face.contains(&own)) {
        let side = if own == NONE { mesh.side_of(*face, apex) } else { mesh.side(*face, own) };
        if side != Sign::Negative {
            return f64::NEG_INFINITY;
        }
        let [a, b, c] = face.map(|v| mesh.point(v));
        worst = worst.min(mean_ratio(apex, a, b, c).max(0.0));
        if worst < floor {
            return worst;
        }
    }
    worst
}
