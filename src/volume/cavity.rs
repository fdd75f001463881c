//! Insertion of a vertex: dig a cavity, star it from the new vertex (Bowyer 1981; Watson 1981).
//!
//! A cavity holds the tets whose circumsphere has the new point strictly inside, grown from the tet
//! that contains it and never across a locked face. In a Delaunay mesh without locks it is
//! star-shaped about the point as it is, whatever points are cospherical or coplanar: a face in one plane
//! with the point meets both circumspheres beside it in one circle, so both tets are taken or none is.
//! Elsewhere [`Cavity::make_star_shaped`] gives tets back until every face sees the point, exactly.

use super::crossing::edges_of_tet;
use super::tetrahedra::{NONE, Tetrahedra};
use crate::Point;
use crate::kernel::predicates::{Sign, orient3d};

/// A face of the cavity's surface, outward, and what lies behind it.
#[derive(Clone, Copy, Debug)]
struct Wall {
    vertices: [u32; 3],
    /// The numbers of the vertices in the cavity.
    numbers: [u32; 3],
    behind: u32,
    locked: bool,
}

/// Scratch memory for one insertion after the other.
#[derive(Clone, Debug, Default)]
pub(super) struct Cavity {
    /// The tets of the cavity.
    pub tets: Vec<u32>,
    /// The half-faces, inside, of its surface.
    pub walls: Vec<u32>,
    /// The vertices of its tets, each once.
    pub vertices: Vec<u32>,
    /// The tets that fill it, after [`Cavity::fill`].
    pub filled: Vec<u32>,
    numbers: Numbers,
    replaced: Vec<Wall>,
    edges: EdgeTable,
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
/// order in which faces are asked with every step. In a Delaunay mesh it always arrives; elsewhere it might go round
/// in circles, and is taken for blocked after more steps than there are tets.
pub(super) fn walk(mesh: &Tetrahedra, from: u32, target: &Point) -> Walk {
    let mut tet = from;
    let mut entry = NONE;
    let mut turn = 0u32;
    'step: for _ in 0..=mesh.tets.len() {
        for k in 0..4 {
            let half_face = 4 * tet + ((turn + k) & 3);
            if half_face == entry {
                continue;
            }
            let [a, b, c] = mesh.face_points(half_face);
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
    Walk::Blocked(entry)
}

impl Cavity {
    /// Takes all tets whose circumsphere holds `point`, from `seed` on, not across locked faces.
    pub fn grow(&mut self, mesh: &mut Tetrahedra, seed: u32, point: &Point) {
        mesh.clear_marks();
        self.numbers.clear(mesh.points.len());
        self.tets.clear();
        self.walls.clear();
        self.vertices.clear();
        mesh.mark(seed);
        self.tets.push(seed);
        for v in mesh.tets[seed as usize] {
            self.meet(v);
        }
        let mut next = 0;
        while let Some(&t) = self.tets.get(next) {
            next += 1;
            let across = mesh.across[t as usize];
            let locked = mesh.locked[t as usize];
            for (i, other) in (0u32..).zip(across) {
                if other == NONE || locked >> i & 1 == 1 {
                    self.walls.push(4 * t + i);
                } else if !mesh.is_marked(other >> 2) {
                    if mesh.is_in_sphere(other >> 2, point) {
                        mesh.mark(other >> 2);
                        self.tets.push(other >> 2);
                        self.meet(mesh.apex(other));
                    } else {
                        self.walls.push(4 * t + i);
                    }
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
        self.look_again(mesh);
    }

    /// Gives tets back until the whole surface of the cavity sees `point` strictly from inside.
    ///
    /// False where `seed` would have to go, or where a vertex or a locked face would be lost.
    pub fn make_star_shaped(&mut self, mesh: &mut Tetrahedra, seed: u32, point: &Point) -> bool {
        loop {
            let mut all_see = true;
            for &wall in &self.walls {
                let [a, b, c] = mesh.face_points(wall);
                if mesh.is_marked(wall >> 2) && orient3d(a, b, c, point) != Sign::Negative {
                    if wall >> 2 == seed {
                        return false;
                    }
                    mesh.unmark(wall >> 2);
                    all_see = false;
                }
            }
            if all_see {
                return self.is_simple() && self.keeps_edges(mesh);
            }
            self.tets.retain(|&t| mesh.is_marked(t));
            self.look_again(mesh);
        }
    }

    /// Collects the surface and the vertices of the marked tets.
    fn look_again(&mut self, mesh: &Tetrahedra) {
        self.walls.clear();
        self.vertices.clear();
        self.numbers.clear(mesh.points.len());
        for i in 0..self.tets.len() {
            let t = self.tets[i];
            for half_face in 4 * t..4 * t + 4 {
                let other = mesh.across(half_face);
                if other == NONE || !mesh.is_marked(other >> 2) || mesh.is_locked(half_face) {
                    self.walls.push(half_face);
                }
                self.meet(mesh.apex(half_face));
            }
        }
    }

    /// Numbers a vertex unless it has a number.
    #[inline]
    fn meet(&mut self, vertex: u32) {
        if self.numbers.give(vertex, self.vertices.len() as u32) {
            self.vertices.push(vertex);
        }
    }

    /// Whether the cavity is a ball without a vertex inside. Star-shaped, it is a ball; so its surface of w triangles has
    /// w / 2 + 2 vertices, and there are no others.
    pub fn is_simple(&self) -> bool {
        self.walls.len() + 4 == 2 * self.vertices.len()
    }

    /// Whether no edge that must stay is inside.
    fn keeps_edges(&self, mesh: &Tetrahedra) -> bool {
        if !mesh.has_kept_edges() {
            return true;
        }
        let on_surface = |a, b| self.walls.iter().any(|&w| [a, b].iter().all(|v| mesh.face(w).contains(v)));
        let mut edges = self.tets.iter().flat_map(|&t| edges_of_tet(mesh.tets[t as usize]));
        edges.all(|[a, b]| !mesh.is_kept(a, b) || on_surface(a, b))
    }

    /// Stars the cavity from a vertex: new tets (vertex, wall), in `filled`.
    ///
    /// Correct signs are the caller's promise; see [`Cavity::make_star_shaped`].
    pub fn fill(&mut self, mesh: &mut Tetrahedra, vertex: u32, body: u32) {
        self.replaced.clear();
        self.replaced.extend(self.walls.iter().map(|&wall| {
            let [a, b, c] = mesh.face(wall);
            Wall {
                vertices: [a, b, c],
                numbers: [self.numbers.of(a), self.numbers.of(b), self.numbers.of(c)],
                behind: mesh.across(wall),
                locked: mesh.is_locked(wall),
            }
        }));
        self.filled.clear();
        for (i, wall) in self.replaced.iter().enumerate() {
            // Nearly always there are more walls than tets: their slots are taken as they are.
            let t = self.tets.get(i).copied().unwrap_or_else(|| mesh.free_slot());
            let [a, b, c] = wall.vertices;
            mesh.write_tet(t, [vertex, a, b, c], body);
            mesh.locked[t as usize] = u8::from(wall.locked);
            mesh.link(4 * t, wall.behind);
            self.filled.push(t);
        }
        for &t in self.tets.iter().skip(self.walls.len()) {
            mesh.remove_tet(t);
        }
        if !self.edges.reset(self.vertices.len()) {
            return link_by_sorting(mesh, &self.replaced, &self.filled);
        }
        for (wall, &t) in self.replaced.iter().zip(&self.filled) {
            let [a, b, c] = wall.numbers;
            self.edges.put(b, c, 4 * t + 1);
            self.edges.put(c, a, 4 * t + 2);
            self.edges.put(a, b, 4 * t + 3);
        }
        for (wall, &t) in self.replaced.iter().zip(&self.filled) {
            let [a, b, c] = wall.numbers;
            let row = &mut mesh.across[t as usize];
            row[1] = self.edges.get(c, b);
            row[2] = self.edges.get(a, c);
            row[3] = self.edges.get(b, a);
        }
    }
}

/// Numbers for the few vertices at hand, taken away from all at once.
#[derive(Clone, Debug, Default)]
struct Numbers {
    /// A vertex has the number `stamps[v] - base` where that is not negative.
    stamps: Vec<u32>,
    base: u32,
    next: u32,
}

impl Numbers {
    /// Takes all numbers away; there are `vertices` vertices.
    #[inline]
    fn clear(&mut self, vertices: usize) {
        self.base = self.next;
        if self.base > u32::MAX / 2 {
            self.stamps.fill(0);
            self.base = 0;
        }
        // Stamp 0 would be a number in the very first round.
        self.base = self.base.max(1);
        self.next = self.base;
        self.stamps.resize(vertices.max(self.stamps.len()), 0);
    }

    /// Gives a vertex its number, the next one in turn; false if it has one.
    #[inline]
    fn give(&mut self, vertex: u32, number: u32) -> bool {
        let stamp = &mut self.stamps[vertex as usize];
        let fresh = *stamp < self.base;
        if fresh {
            *stamp = self.base + number;
            self.next = *stamp + 1;
        }
        fresh
    }

    /// The number of a vertex that has one.
    #[inline]
    fn of(&self, vertex: u32) -> u32 {
        self.stamps[vertex as usize] - self.base
    }
}

/// Which half-face stands on each directed edge of a cavity's surface: a square table by the numbers of its ends. Never cleared,
/// for only what was put is asked for.
#[derive(Clone, Debug, Default)]
struct EdgeTable {
    square: Vec<u32>,
    shift: u32,
}

/// The table of the largest cavity takes 4 MiB. A usual cavity has 20 vertices; thousands come together where many points
/// lie on one sphere.
const LARGEST_SHIFT: u32 = 10;

impl EdgeTable {
    /// Makes room for edges between this many vertices; false where they are too many for a table.
    fn reset(&mut self, vertices: usize) -> bool {
        self.shift = vertices.next_power_of_two().ilog2();
        let fits = self.shift <= LARGEST_SHIFT;
        if fits && self.square.len() < 1 << (2 * self.shift) {
            self.square.resize(1 << (2 * self.shift), NONE);
        }
        fits
    }

    #[inline(always)]
    fn put(&mut self, from: u32, to: u32, half_face: u32) {
        self.square[(from << self.shift | to) as usize] = half_face;
    }

    #[inline(always)]
    fn get(&self, from: u32, to: u32) -> u32 {
        self.square[(from << self.shift | to) as usize]
    }
}

/// As the table does, for a cavity with very many vertices: each edge comes twice, and sorting brings the two together.
#[cold]
fn link_by_sorting(mesh: &mut Tetrahedra, walls: &[Wall], tets: &[u32]) {
    let mut sides: Vec<([u32; 2], u32)> = Vec::with_capacity(3 * walls.len());
    for (wall, &t) in walls.iter().zip(tets) {
        let [a, b, c] = wall.numbers;
        let sorted = [[b, c], [c, a], [a, b]].map(|[p, q]| [p.min(q), p.max(q)]);
        sides.extend(sorted.into_iter().zip(4 * t + 1..));
    }
    sides.sort_unstable();
    for pair in sides.chunks_exact(2) {
        mesh.link(pair[0].1, pair[1].1);
    }
}
