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
use super::constraints::Constraints;
use super::polygon::{Shadow, triangulate};
use super::sector::{Sector, find_apex};
use super::tetrahedra::{NONE, Tetrahedra, sorted};
use std::cmp::Reverse;
use std::collections::{BTreeMap, BTreeSet};

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
    loop {
        let before = left.len();
        // The smallest ball first, of equal ones that of the last point: so they stay small.
        let mut queue: BTreeSet<(usize, Reverse<u32>)> =
            left.iter().map(|&p| (balls.size(mesh, p), Reverse(p))).collect();
        let mut stuck = Vec::new();
        while let Some((size, Reverse(p))) = queue.pop_first() {
            let now = balls.size(mesh, p);
            if now > size {
                queue.insert((now, Reverse(p)));
            } else if !take_off(mesh, constraints, triangles, p, &mut inside, &mut balls) {
                stuck.push(p);
            }
        }
        left = stuck;
        if left.is_empty() || left.len() == before {
            return (inside, left);
        }
    }
}

/// Takes one point off the surface if all its sectors can be filled without it.
fn take_off(
    mesh: &mut Tetrahedra,
    constraints: &mut Constraints,
    triangles: &[[u32; 3]],
    p: u32,
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
        match triangulate(mesh, shadow, &outline(fan, p)) {
            Some(patch) => patches.insert(triangle, patch),
            None => return false,
        };
    }
    let ball = balls.ball(mesh, p);
    let points = mesh.points.len();
    let mut new = Vec::new();
    for sector in sectors(mesh, constraints, triangles, p, &ball, &patches) {
        let Some(apex) = find_apex(mesh, &sector, p) else {
            mesh.forget_points(points);
            return false;
        };
        new.extend(sector.star(mesh, apex).into_iter().map(|tet| (tet, sector.body)));
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
