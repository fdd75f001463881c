//! Steiner points leave the surface again.
//!
//! A point p that splits a triangle or an edge of the surface is taken off it so (George, Borouchaki, Saltel
//! 2003, section 5): the **ball** of p, all tets at it, falls into **sectors** between the facets at p. The
//! facets at p are replaced by facets without it; then each sector is a polyhedron, seen from p but for
//! these new facets, in whose planes p lies. A point a little inside sees them too. So each sector is
//! filled anew, from one of its own vertices if one sees all of it, else from a new point inside.
//!
//! ```text
//!   u───p───v        u───────v         Outside of the bodies there is no sector any more, so a point
//!    ╲  │  ╱    ─►    ╲╲ q ╱╱          on the outer skin leaves one new point or none, a point on an
//!     ╲ │ ╱            ╲╲│╱╱           interface one on either side.
//!       w                w
//! ```

use super::carve::is_even;
use super::clearance::{Plane, most_inside};
use super::constraints::Constraints;
use super::inside;
use super::polygon::{Shadow, triangulate};
use super::stuck;
use super::tetrahedra::{NONE, Tetrahedra, sorted};
use crate::kernel::fixed::Fixed;
use crate::kernel::predicates::Sign;
use crate::kernel::quality::mean_ratio;
use crate::kernel::simplex::area_vector;
use crate::{Point, Vector};
use std::cmp::Reverse;
use std::collections::{BTreeMap, BTreeSet};

/// A sector is filled from one of its own vertices, without a new point, if the worst mean ratio is at least
/// this; else from where it is better. A sliver of 0.001 is worse to mend than one vertex more.
pub(super) const GOOD_ENOUGH: f64 = 0.05;

/// How often points that do not leave are tried again after those inside beside them have moved.
const STUCK: usize = 3;

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
    fresh: Vec<[u32; 3]>,
    /// The triangles of the surface that they are parts of, outward.
    sides: Vec<[u32; 3]>,
}

/// What a sector is filled from.
#[derive(Clone, Copy, Debug)]
enum Apex {
    Own(u32),
    New(Point),
    NewExact(Fixed),
}

/// Takes all Steiner points off the surface. Returns the new points inside, and the
/// points that stayed.
pub(super) fn relocate(
    mesh: &mut Tetrahedra,
    constraints: &mut Constraints,
    triangles: &[[u32; 3]],
    steiner: &[u32],
) -> (Vec<u32>, Vec<u32>) {
    let mut inside = Vec::new();
    let mut left: Vec<u32> = steiner.to_vec();
    let mut balls = Balls::of(mesh, steiner);
    let mut in_vain = 0;
    while !left.is_empty() && in_vain < STUCK {
        let before = left.len();
        // The smallest ball first, of equal ones that of the last point: so they stay small.
        let mut queue: BTreeSet<(usize, Reverse<u32>)> =
            left.iter().map(|&p| (balls.size(mesh, p), Reverse(p))).collect();
        let mut stuck = Vec::new();
        while let Some((size, Reverse(p))) = queue.pop_first() {
            let now = balls.size(mesh, p);
            if now > size {
                queue.insert((now, Reverse(p)));
            } else if !take_off(mesh, constraints, triangles, p, in_vain > 0, &mut inside, &mut balls) {
                stuck.push(p);
            }
        }
        left = stuck;
        if left.len() < before {
            in_vain = 0;
        } else {
            in_vain += 1;
            let mut made = Vec::new();
            inside::make_room(mesh, constraints, &left, &mut inside, &mut made);
            balls.add(mesh, &made);
        }
    }
    (inside, left)
}

/// Takes one point off the surface if all its sectors can be filled without it; by `search` where no place sees the whole of one.
fn take_off(
    mesh: &mut Tetrahedra,
    constraints: &mut Constraints,
    triangles: &[[u32; 3]],
    p: u32,
    search: bool,
    inside: &mut Vec<u32>,
    balls: &mut Balls,
) -> bool {
    let old = constraints.facets_at(p);
    let mut fans: BTreeMap<u32, Vec<[u32; 3]>> = BTreeMap::new();
    for &f in &old {
        let facet = &constraints.facets[f as usize];
        fans.entry(facet.triangle).or_default().push(facet.vertices);
    }
    let mut patches: BTreeMap<u32, Vec<[u32; 3]>> = BTreeMap::new();
    for (&triangle, fan) in &fans {
        let shadow = Shadow::of(triangles[triangle as usize].map(|v| mesh.point(v)));
        let on_line = |ear| constraints.on_one_edge(ear);
        match triangulate(mesh, shadow, &outline(fan, p), on_line) {
            Some(patch) => patches.insert(triangle, patch),
            None => return false,
        };
    }
    let mut sectors = sectors(mesh, constraints, triangles, p, &balls.ball(mesh, p), &patches);
    let points = mesh.points.len();
    let mut new = Vec::new();
    for sector in &mut sectors {
        let tets = match grow_and_find(mesh, sector, p) {
            Some(apex) => Some(sector.star(mesh, apex)),
            None if search => stuck::fill(mesh, sector, p),
            None => None,
        };
        let Some(tets) = tets else {
            mesh.forget_points(points);
            return false;
        };
        new.extend(tets.into_iter().map(|tet| (tet, sector.body)));
    }
    let mut ball: Vec<u32> = sectors.iter().flat_map(|s| s.tets.iter().copied()).collect();
    ball.sort_unstable();
    if ball.windows(2).any(|pair| pair[0] == pair[1]) {
        // Two sectors took in the same tet.
        mesh.forget_points(points);
        return false;
    }
    let fresh: Vec<[u32; 3]> = patches.values().flatten().map(|&face| sorted(face)).collect();
    let is_facet = |face| fresh.contains(&sorted(face)) || constraints.facet(face).is_some();
    let mut made = Vec::new();
    if !mesh.rebuild(&ball, &new, &is_facet, &mut made) {
        mesh.forget_points(points);
        return false;
    }
    balls.add(mesh, &made);
    inside.extend(points as u32..mesh.points.len() as u32);
    mesh.at_vertex[p as usize] = NONE;
    for f in old {
        constraints.remove(f);
    }
    for (triangle, patch) in patches {
        for vertices in patch {
            constraints.add(vertices, triangle);
        }
    }
    true
}

/// The vertices round a point in its facets of one triangle, in the triangle's sense; they begin at
/// its edge if the point lies on one.
fn outline(fan: &[[u32; 3]], p: u32) -> Vec<u32> {
    let links: Vec<[u32; 2]> = fan
        .iter()
        .map(|&[a, b, c]| {
            if a == p {
                [b, c]
            } else if b == p {
                [c, a]
            } else {
                [a, b]
            }
        })
        .collect();
    let start = links.iter().map(|l| l[0]).find(|v| links.iter().all(|l| l[1] != *v));
    let mut outline = vec![start.unwrap_or(links[0][0])];
    while let Some(link) = links.iter().find(|l| Some(&l[0]) == outline.last()) {
        if link[1] == outline[0] {
            break;
        }
        outline.push(link[1]);
    }
    outline
}

/// The sectors of the ball of p, with the patches in place of the facets at p.
fn sectors(
    mesh: &Tetrahedra,
    constraints: &Constraints,
    triangles: &[[u32; 3]],
    p: u32,
    ball: &[u32],
    patches: &BTreeMap<u32, Vec<[u32; 3]>>,
) -> Vec<Sector> {
    let mut sector_of: BTreeMap<u32, usize> = BTreeMap::new();
    let mut sectors: Vec<Sector> = Vec::new();
    for &first in ball {
        if sector_of.contains_key(&first) {
            continue;
        }
        let mut sector = Sector { body: mesh.bodies[first as usize], tets: vec![first], ..Sector::default() };
        sector_of.insert(first, sectors.len());
        let mut next = 0;
        let mut sides: Vec<(u32, bool)> = Vec::new();
        while let Some(&t) = sector.tets.get(next) {
            next += 1;
            for half_face in 4 * t..4 * t + 4 {
                let face = mesh.face(half_face);
                let other = mesh.across(half_face);
                if !face.contains(&p) {
                    sector.walls.push(half_face);
                } else if mesh.is_locked(half_face) {
                    let facet = constraints.facet(face).expect("a locked face is a facet");
                    let facet = &constraints.facets[facet as usize];
                    sides.push((facet.triangle, is_even(face, facet.vertices)));
                } else if sector_of.insert(other >> 2, sectors.len()).is_none() {
                    sector.tets.push(other >> 2);
                }
            }
        }
        sides.sort_unstable();
        sides.dedup();
        for (triangle, outward) in sides {
            let turned = |&[a, b, c]: &[u32; 3]| if outward { [a, b, c] } else { [a, c, b] };
            sector.sides.push(turned(&triangles[triangle as usize]));
            sector.fresh.extend(patches[&triangle].iter().map(turned));
        }
        sector.set_skin(mesh);
        sectors.push(sector);
    }
    sectors
}

/// The tets at each Steiner point. A walk through faces would miss some where the outside parts them.
struct Balls {
    /// Some may have gone, or come twice.
    tets: BTreeMap<u32, Vec<u32>>,
}

impl Balls {
    fn of(mesh: &Tetrahedra, points: &[u32]) -> Self {
        let mut balls = Self { tets: points.iter().map(|&p| (p, Vec::new())).collect() };
        if !points.is_empty() {
            balls.add(mesh, &mesh.alive().collect::<Vec<_>>());
        }
        balls
    }

    /// Takes in new tets.
    fn add(&mut self, mesh: &Tetrahedra, tets: &[u32]) {
        for &t in tets {
            for v in mesh.tets[t as usize] {
                if let Some(ball) = self.tets.get_mut(&v) {
                    ball.push(t);
                }
            }
        }
    }

    fn size(&mut self, mesh: &Tetrahedra, p: u32) -> usize {
        self.ball(mesh, p).len()
    }

    fn ball(&mut self, mesh: &Tetrahedra, p: u32) -> Vec<u32> {
        let ball = self.tets.get_mut(&p).expect("a Steiner point");
        ball.retain(|&t| mesh.is_alive(t) && mesh.tets[t as usize].contains(&p));
        ball.sort_unstable();
        ball.dedup();
        ball.clone()
    }
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

    fn set_skin(&mut self, mesh: &Tetrahedra) {
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
    fn star(&self, mesh: &mut Tetrahedra, apex: Apex) -> Vec<[u32; 4]> {
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

    /// Takes in the tets behind those walls that a point does not see, or behind all; false where there are none to take.
    pub fn grow(&mut self, mesh: &Tetrahedra, point: Option<&Point>) -> bool {
        let unseen =
            |wall: u32| point.is_none_or(|point| mesh.side_of(mesh.face(wall), point) != Sign::Negative);
        let before = self.tets.len();
        for wall in self.walls.clone() {
            let behind = mesh.across(wall);
            if unseen(wall) && behind != NONE && !mesh.is_locked(wall) && !self.tets.contains(&(behind >> 2))
            {
                self.tets.push(behind >> 2);
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

/// From where to fill a sector. As long as no place sees it all it takes in tets behind walls: where points lie on one line or
/// in one plane up to rounding, slivers of no thickness stand between p and what it should see.
fn grow_and_find(mesh: &mut Tetrahedra, sector: &mut Sector, p: u32) -> Option<Apex> {
    /// Each time the walls around move one tet away; what lies that far is no matter of rounding.
    const GROWTHS: usize = 8;
    /// Where to look from: these fractions of the sector's size off the surface. The first sees over what rounding
    /// leaves in the way (10⁻¹⁶ of the size or a few times more) and over hardly more than that.
    const OFF: [f64; 4] = [1e-12, 1e-9, 1e-6, 0.01];
    if let Some(apex) = find_apex(mesh, sector, p) {
        return Some(apex);
    }
    let inward = directions(mesh, sector, p);
    let start = sector.clone();
    for off in OFF {
        sector.clone_from(&start);
        for _ in 0..GROWTHS {
            let grown = sector.grow(mesh, Some(&(mesh.point(p) + inward * off)));
            if !grown || !sector.keeps_vertices(mesh, |v| v == p) {
                break;
            }
            if let Some(apex) = find_apex(mesh, sector, p) {
                return Some(apex);
            }
        }
    }
    *sector = start;
    None
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

/// From where to fill a sector as it is.
fn find_apex(mesh: &mut Tetrahedra, sector: &Sector, p: u32) -> Option<Apex> {
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
    best.1.or_else(|| mesh.has_rounded().then(|| beside(mesh, sector, p)).flatten())
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
