//! Parts of a ball, and from where they are filled: the place that sees all of their skin.

use super::carve::is_even;
use super::clearance::{Plane, most_inside};
use super::tetrahedra::{NONE, Tetrahedra, sorted};
use crate::kernel::fixed::Fixed;
use crate::kernel::predicates::Sign;
use crate::kernel::quality::mean_ratio;
use crate::kernel::simplex::area_vector;
use crate::{Point, Vector};

/// A sector is filled from one of its own vertices, without a new point, if the worst mean ratio is at least
/// this; else from where it is better. A sliver of 0.001 is worse to mend than one vertex more.
pub(super) const GOOD_ENOUGH: f64 = 0.05;

/// The part of a ball between facets.
#[derive(Clone, Debug, Default)]
pub(super) struct Sector {
    pub body: u32,
    pub tets: Vec<u32>,
    /// Its surface once p is gone, outward.
    pub skin: Vec<[u32; 3]>,
    /// The half-faces of `tets` that are in `skin`.
    pub walls: Vec<u32>,
    /// Those of `skin` in place of facets at p, which p does not see.
    pub fresh: Vec<[u32; 3]>,
    /// The triangles of the surface that they are parts of, outward.
    pub sides: Vec<[u32; 3]>,
}

/// What a sector is filled from.
#[derive(Clone, Copy, Debug)]
pub(super) enum Apex {
    Own(u32),
    New(Point),
    NewExact(Fixed),
}

impl Sector {
    /// Some tets of a body with no facet among them, and their outer half-faces.
    pub fn inside(mesh: &Tetrahedra, body: u32, tets: Vec<u32>, walls: Vec<u32>) -> Self {
        let mut sector = Self { body, tets, walls, ..Self::default() };
        sector.set_skin(mesh);
        sector
    }

    /// How far it reaches from a place.
    pub fn reach(&self, mesh: &Tetrahedra, from: &Point) -> f64 {
        let distance = |&v: &u32| (mesh.point(v) - from).norm();
        self.skin.iter().flatten().map(distance).fold(0.0, f64::max)
    }

    pub fn set_skin(&mut self, mesh: &Tetrahedra) {
        self.skin.clear();
        self.skin.extend(self.walls.iter().map(|&w| mesh.face(w)));
        for &facet in &self.fresh {
            // Only rounding parted a facet from a face with its corners: nothing is between them.
            let turned = |face: &[u32; 3]| sorted(*face) == sorted(facet) && !is_even(*face, facet);
            match self.skin.iter().position(turned) {
                Some(i) => drop(self.skin.swap_remove(i)),
                None => self.skin.push(facet),
            }
        }
    }

    /// Its tets, all from one apex.
    pub fn star(&self, mesh: &mut Tetrahedra, apex: Apex) -> Vec<[u32; 4]> {
        self.star_of(match apex {
            Apex::Own(v) => v,
            Apex::New(point) => mesh.add_point(point),
            Apex::NewExact(place) => mesh.add_exact_point(&place),
        })
    }

    /// Its tets, all from one vertex.
    pub fn star_of(&self, apex: u32) -> Vec<[u32; 4]> {
        let seen = self.skin.iter().filter(|face| !face.contains(&apex));
        seen.map(|&[a, b, c]| [apex, a, b, c]).collect()
    }

    /// Takes in the tets behind some of its walls; false where there are none to take.
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

    /// Whether every vertex of its tets but those that may go is on its surface.
    pub fn keeps_vertices(&self, mesh: &Tetrahedra, may_go: impl Fn(u32) -> bool) -> bool {
        let on_surface = |v: u32| {
            self.walls.iter().any(|&w| mesh.face(w).contains(&v)) || self.fresh.iter().any(|f| f.contains(&v))
        };
        self.tets.iter().flat_map(|&t| mesh.tets[t as usize]).all(|v| may_go(v) || on_surface(v))
    }
}

/// The vertex of a sector from which it is filled best, and the worst mean ratio so; the latter negative where none sees it all.
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

/// From where to fill a sector.
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
    best.1.or_else(|| beside(mesh, sector, p))
}

/// A place beside p, so near that it sees all walls of its sector: those that p sees, and the facets in whose planes p lies. In exact
/// arithmetic there is one, unless both sides of one facet are in the sector.
fn beside(mesh: &mut Tetrahedra, sector: &Sector, p: u32) -> Option<Apex> {
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

/// A place inside a sector that sees all of its skin, and the worst mean ratio from there.
pub(super) fn find_place(mesh: &Tetrahedra, sector: &Sector, p: u32) -> Option<(f64, Point)> {
    let start = *mesh.point(p);
    let reach = sector.reach(mesh, &start);
    let planes: Vec<Plane> = sector.skin.iter().filter_map(|f| Plane::of(f.map(|v| mesh.point(v)))).collect();
    let axes = [Vector::x() * reach, Vector::y() * reach, Vector::z() * reach];
    let (place, _) = most_inside(&start, &axes, &planes);
    let quality = worst(mesh, &sector.skin, &place, NONE, 0.0);
    if quality < 0.0 {
        return None;
    }
    let (quality, place) = climb(mesh, sector, (quality, place), reach);
    Fixed::of(&place).map(|_| (quality, place))
}

/// Away from the facets at p, as long as the sector reaches.
///
/// The facets lie in one plane or in two, however many pieces of each there are: half-way between two inward
/// normals is inside of both planes, whatever the angle.
pub(super) fn directions(mesh: &Tetrahedra, sector: &Sector, p: u32) -> Vector {
    let reach = sector.reach(mesh, mesh.point(p));
    let inward = sector.sides.iter().fold(Vector::zeros(), |sum, face| {
        let [a, b, c] = face.map(|v| mesh.point(v));
        sum - area_vector(a, b, c).normalize()
    });
    inward.try_normalize(0.0).unwrap_or_else(Vector::zeros) * reach
}

/// Moves a place along the axes as long as the worst mean ratio grows.
fn climb(mesh: &Tetrahedra, sector: &Sector, from: (f64, Point), reach: f64) -> (f64, Point) {
    /// Enough for the steps to shrink well below the distances that matter for shape.
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

/// The worst mean ratio of a sector filled from a point, that of the vertex `own` if it is one; negative if some tet were not positive.
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
