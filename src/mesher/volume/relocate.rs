//! Moves Steiner points off the surface (George, Borouchaki, Saltel 2003, section 5).
//!
//! The facets at a Steiner point p divide its star into **sectors**. The facets are replaced by
//! facets without p; then each sector is a polyhedron whose faces are visible from p, except the
//! new facets, because p lies in their planes. From a point slightly inside they are visible too.
//! So each sector is retetrahedralised, from one of its own vertices if its whole boundary is
//! visible from it, else from a new point inside.
//!
//! ```text
//!   u───p───v        u───────v         Outside the bodies there is no sector, so a point on an
//!    ╲  │  ╱    ─►    ╲╲ q ╱╱          outer boundary leaves at most one new point, and a point
//!     ╲ │ ╱            ╲╲│╱╱           on an interface at most one on either side.
//!       w                w
//! ```

use super::carve::is_even;
use super::constraints::Constraints;
use super::polygon::{Projection, triangulate};
use super::sector::{Sector, find_apex};
use super::tetrahedra::Tetrahedra;
use crate::ground::kernel::simplex::ascending;
use crate::mesher::half_face::NONE;
use std::cmp::Reverse;
use std::collections::{BTreeMap, BTreeSet};

/// Moves all Steiner points off the surface; returns the new points inside, and the points that
/// stayed on the surface.
pub(super) fn relocate(
    mesh: &mut Tetrahedra,
    constraints: &mut Constraints,
    triangles: &[[u32; 3]],
    steiner: &[u32],
) -> (Vec<u32>, Vec<u32>) {
    let mut inside = Vec::new();
    let mut left: Vec<u32> = steiner.to_vec();
    let mut stars = Stars::of(mesh, steiner);
    loop {
        let before = left.len();
        // The smallest star first, ties by the last point: so stars stay small.
        let mut queue: BTreeSet<(usize, Reverse<u32>)> =
            left.iter().map(|&p| (stars.size(mesh, p), Reverse(p))).collect();
        let mut stuck = Vec::new();
        while let Some((size, Reverse(p))) = queue.pop_first() {
            let now = stars.size(mesh, p);
            if now > size {
                queue.insert((now, Reverse(p)));
            } else if !move_off(mesh, constraints, triangles, p, &mut inside, &mut stars) {
                stuck.push(p);
            }
        }
        left = stuck;
        if left.is_empty() || left.len() == before {
            return (inside, left);
        }
    }
}

/// Moves one point off the surface; false if a sector cannot be filled without it.
fn move_off(
    mesh: &mut Tetrahedra,
    constraints: &mut Constraints,
    triangles: &[[u32; 3]],
    p: u32,
    inside: &mut Vec<u32>,
    stars: &mut Stars,
) -> bool {
    let old = constraints.facets_at(p);
    let mut fans: BTreeMap<u32, Vec<[u32; 3]>> = BTreeMap::new();
    for &f in &old {
        let facet = &constraints.facets[f as usize];
        fans.entry(facet.triangle).or_default().push(facet.vertices);
    }
    let mut patches: BTreeMap<u32, Vec<[u32; 3]>> = BTreeMap::new();
    for (&triangle, fan) in &fans {
        let projection = Projection::of(triangles[triangle as usize].map(|v| mesh.point(v)));
        match triangulate(mesh, projection, &outline(fan, p)) {
            Some(patch) => patches.insert(triangle, patch),
            None => return false,
        };
    }
    let star = stars.star(mesh, p);
    let points = mesh.points.len();
    let mut new = Vec::new();
    for sector in sectors(mesh, constraints, triangles, p, &star, &patches) {
        let Some(apex) = find_apex(mesh, &sector, p) else {
            mesh.forget_points(points);
            return false;
        };
        new.extend(sector.star(mesh, apex).into_iter().map(|tet| (tet, sector.body)));
    }
    let fresh: Vec<[u32; 3]> = patches.values().flatten().map(|&face| ascending(face)).collect();
    let is_facet = |face| fresh.contains(&ascending(face)) || constraints.facet(face).is_some();
    let mut made = Vec::new();
    if !mesh.rebuild(&star, &new, &is_facet, &mut made) {
        mesh.forget_points(points);
        return false;
    }
    stars.add(mesh, &made);
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

/// The polygon around a point in its facets of one triangle, oriented as the triangle; it starts at
/// the triangle's edge if the point lies on one.
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

/// The sectors of the star of p, with the patches in place of the facets at p.
fn sectors(
    mesh: &Tetrahedra,
    constraints: &Constraints,
    triangles: &[[u32; 3]],
    p: u32,
    star: &[u32],
    patches: &BTreeMap<u32, Vec<[u32; 3]>>,
) -> Vec<Sector> {
    let mut sector_of: BTreeMap<u32, usize> = BTreeMap::new();
    let mut sectors: Vec<Sector> = Vec::new();
    for &first in star {
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

/// The tets at each Steiner point. A walk through faces would miss tets that the boundary
/// separates.
struct Stars {
    /// May contain removed tets and duplicates.
    tets: BTreeMap<u32, Vec<u32>>,
}

impl Stars {
    fn of(mesh: &Tetrahedra, points: &[u32]) -> Self {
        let mut stars = Self { tets: points.iter().map(|&p| (p, Vec::new())).collect() };
        if !points.is_empty() {
            stars.add(mesh, &mesh.alive().collect::<Vec<_>>());
        }
        stars
    }

    /// Adds new tets to the stars of their vertices.
    fn add(&mut self, mesh: &Tetrahedra, tets: &[u32]) {
        for &t in tets {
            for v in mesh.tets[t as usize] {
                if let Some(star) = self.tets.get_mut(&v) {
                    star.push(t);
                }
            }
        }
    }

    fn size(&mut self, mesh: &Tetrahedra, p: u32) -> usize {
        self.star(mesh, p).len()
    }

    fn star(&mut self, mesh: &Tetrahedra, p: u32) -> Vec<u32> {
        let star = self.tets.get_mut(&p).expect("a Steiner point");
        star.retain(|&t| mesh.is_alive(t) && mesh.tets[t as usize].contains(&p));
        star.sort_unstable();
        star.dedup();
        star.clone()
    }
}
