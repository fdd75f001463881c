//! Insertion of a vertex: dig a cavity, star it from the new vertex (Bowyer 1981; Watson 1981).
//!
//! A cavity holds the tets whose circumsphere has the new point strictly inside, grown from the tet
//! that contains it and never across a locked face. In a Delaunay mesh without locks it is
//! star-shaped about the point as it is, whatever points are cospherical or coplanar: a face in one plane
//! with the point meets both circumspheres beside it in one circle, so both tets are taken or none is.
//! Elsewhere [`Cavity::make_star_shaped`] gives tets back until every face sees the point, exactly.

use super::tetrahedra::{NONE, Tetrahedra};
use crate::Point;
use crate::kernel::predicates::{Sign, insphere, orient3d};

/// A face of the cavity's surface, outward, and what lies behind it.
#[derive(Clone, Copy, Debug)]
struct Wall {
    vertices: [u32; 3],
    behind: u32,
    locked: bool,
}

/// Scratch memory for one insertion after the other.
#[derive(Clone, Debug, Default)]
pub(super) struct Cavity {
    /// The tets of the cavity.
    pub tets: Vec<u32>,
    /// The half-faces, inside, of its surface; filled by [`Cavity::make_star_shaped`].
    pub walls: Vec<u32>,
    /// The tets that fill it, after [`Cavity::fill`].
    pub filled: Vec<u32>,
    replaced: Vec<Wall>,
    table: EdgeTable,
}

/// Where a walk ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Walk {
    /// In this tet or on its surface.
    Inside(u32),
    /// At a locked face, or at the outside of the mesh: the half-face one would have to cross.
    Blocked(u32),
}

/// Walks from tet to tet towards a point (visibility walk: Devillers, Pion, Teillaud 2002), turning the
/// order in which faces are asked with every step, so that no cycle repeats for ever.
pub(super) fn walk(mesh: &Tetrahedra, from: u32, target: &Point) -> Walk {
    let mut tet = from;
    let mut entry = NONE;
    let mut turn = 0u32;
    'step: loop {
        for k in 0..4 {
            let half_face = 4 * tet + ((turn + k) & 3);
            if half_face == entry {
                continue;
            }
            let [a, b, c] = mesh.face(half_face).map(|v| mesh.point(v));
            if orient3d(a, b, c, target) == Sign::Positive {
                let other = mesh.across(half_face);
                if other == NONE || mesh.is_locked(half_face) {
                    return Walk::Blocked(half_face);
                }
                (tet, entry) = (other >> 2, other);
                // Any sequence without short period will do.
                turn = turn.wrapping_mul(5).wrapping_add(tet | 1) >> 1;
                continue 'step;
            }
        }
        return Walk::Inside(tet);
    }
}

impl Cavity {
    /// Takes all tets whose circumsphere holds `point`, from `seed` on, not across locked faces.
    pub fn grow(&mut self, mesh: &mut Tetrahedra, seed: u32, point: &Point) {
        self.tets.clear();
        mesh.clear_marks();
        mesh.mark(seed);
        self.tets.push(seed);
        let mut next = 0;
        while let Some(&t) = self.tets.get(next) {
            next += 1;
            for half_face in 4 * t..4 * t + 4 {
                let other = mesh.across(half_face);
                if other == NONE || mesh.is_marked(other >> 2) || mesh.is_locked(half_face) {
                    continue;
                }
                let [a, b, c, d] = mesh.corners(other >> 2);
                if insphere(a, b, c, d, point) == Sign::Positive {
                    mesh.mark(other >> 2);
                    self.tets.push(other >> 2);
                }
            }
        }
    }

    /// Takes exactly these tets.
    pub fn take(&mut self, mesh: &mut Tetrahedra, tets: &[u32]) {
        self.tets.clear();
        self.tets.extend_from_slice(tets);
        mesh.clear_marks();
        for &t in tets {
            mesh.mark(t);
        }
    }

    /// Gives tets back until the whole surface of the cavity sees `point` strictly from inside.
    ///
    /// False where `seed` would have to go, or where a vertex or a locked face would be lost. Afterwards
    /// `walls` holds the surface.
    pub fn make_star_shaped(&mut self, mesh: &mut Tetrahedra, seed: u32, point: &Point) -> bool {
        loop {
            self.find_walls(mesh);
            let before = self.tets.len();
            for &wall in &self.walls {
                let [a, b, c] = mesh.face(wall).map(|v| mesh.point(v));
                if mesh.is_marked(wall >> 2) && orient3d(a, b, c, point) != Sign::Negative {
                    if wall >> 2 == seed {
                        return false;
                    }
                    mesh.unmark(wall >> 2);
                }
            }
            self.tets.retain(|&t| mesh.is_marked(t));
            if self.tets.len() == before {
                return self.is_simple(mesh);
            }
        }
    }

    /// Collects the surface of the marked tets.
    fn find_walls(&mut self, mesh: &Tetrahedra) {
        self.walls.clear();
        for &t in &self.tets {
            for half_face in 4 * t..4 * t + 4 {
                let other = mesh.across(half_face);
                if other == NONE || !mesh.is_marked(other >> 2) || mesh.is_locked(half_face) {
                    self.walls.push(half_face);
                }
            }
        }
    }

    /// Whether the cavity is a ball without a vertex inside: n tets have n + 3 vertices then, and its
    /// surface has 2·(n + 3) − 4 = 2n + 2 triangles; a vertex inside means fewer of them.
    fn is_simple(&self, mesh: &Tetrahedra) -> bool {
        // Star-shaped, so a ball; with w walls it has w / 2 + 2 vertices on its surface. Count all of them.
        let mut vertices: Vec<u32> = self.tets.iter().flat_map(|&t| mesh.tets[t as usize]).collect();
        vertices.sort_unstable();
        vertices.dedup();
        self.walls.len() == 2 * vertices.len() - 4
    }

    /// Stars the cavity from a vertex: new tets (vertex, wall), in `filled`.
    ///
    /// Correct signs are the caller's promise; see [`Cavity::make_star_shaped`].
    pub fn fill(&mut self, mesh: &mut Tetrahedra, vertex: u32, body: u32) {
        self.replaced.clear();
        for &t in &self.tets {
            for half_face in 4 * t..4 * t + 4 {
                let behind = mesh.across(half_face);
                let locked = mesh.is_locked(half_face);
                if behind == NONE || !mesh.is_marked(behind >> 2) || locked {
                    self.replaced.push(Wall { vertices: mesh.face(half_face), behind, locked });
                }
            }
        }
        for &t in &self.tets {
            mesh.remove_tet(t);
        }
        self.table.reset(self.replaced.len());
        self.filled.clear();
        for wall in &self.replaced {
            let [a, b, c] = wall.vertices;
            let t = mesh.add_tet([vertex, a, b, c], body);
            self.filled.push(t);
            mesh.link(4 * t, wall.behind);
            mesh.locked[t as usize] = u8::from(wall.locked);
            for (i, edge) in [(1, [b, c]), (2, [a, c]), (3, [a, b])] {
                if let Some(other) = self.table.meet(edge, 4 * t + i) {
                    mesh.link(4 * t + i, other);
                }
            }
        }
    }
}

/// Brings together the two half-faces over each edge of a cavity's surface: open addressing, linear probes.
#[derive(Clone, Debug, Default)]
struct EdgeTable {
    slots: Vec<(u64, u32)>,
    shift: u32,
}

impl EdgeTable {
    /// Never a pair of different vertices.
    const EMPTY: u64 = u64::MAX;

    /// Empties the table and makes room for the edges of `faces` triangles.
    fn reset(&mut self, faces: usize) {
        let size = (4 * faces).next_power_of_two().max(16);
        self.slots.clear();
        self.slots.resize(size, (Self::EMPTY, NONE));
        self.shift = 64 - size.ilog2();
    }

    /// The half-face that came with this edge before, or `None` if this is the first.
    #[inline]
    fn meet(&mut self, [a, b]: [u32; 2], half_face: u32) -> Option<u32> {
        let key = u64::from(a.min(b)) << 32 | u64::from(a.max(b));
        let mut slot = (key.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> self.shift) as usize;
        loop {
            let (found, other) = self.slots[slot];
            if found == key {
                return Some(other);
            }
            if found == Self::EMPTY {
                self.slots[slot] = (key, half_face);
                return None;
            }
            slot = (slot + 1) & (self.slots.len() - 1);
        }
    }
}
