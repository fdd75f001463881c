//! Vertex insertion: remove a cavity and fill it with tets from the new vertex (Bowyer 1981; Watson
//! 1981).
//!
//! The cavity is the set of tets whose circumsphere strictly contains the new point, grown from the
//! tet that contains it and never across a locked face. In a Delaunay mesh without locked faces the
//! cavity is star-shaped about the point, also in degenerate cases: if a face is coplanar with the
//! point, both circumspheres next to it cut that plane in the same circle, so either both tets are
//! in the cavity or neither is. In other meshes [`Cavity::make_star_shaped`] removes tets from the
//! cavity until every face is visible from the point, by exact predicates.

use super::crossing::edges_of_tet;
use super::tetrahedra::Tetrahedra;
use crate::Point;
use crate::ground::kernel::predicates::{Sign, orient3d};
use crate::mesher::half_face::NONE;

/// A face of the cavity's boundary, oriented outward, and the half-face behind it.
#[derive(Clone, Copy, Debug)]
struct Wall {
    vertices: [u32; 3],
    /// Local numbers of the vertices in the cavity.
    numbers: [u32; 3],
    behind: u32,
    locked: bool,
}

/// A cavity; its buffers are reused from one insertion to the next.
#[derive(Clone, Debug, Default)]
pub(super) struct Cavity {
    /// The tets of the cavity.
    pub tets: Vec<u32>,
    /// The half-faces of its boundary, on the inner side.
    pub walls: Vec<u32>,
    /// The vertices of its tets, without duplicates.
    pub vertices: Vec<u32>,
    /// The tets that replace it, after [`Cavity::fill`].
    pub filled: Vec<u32>,
    /// Whether it reaches the seam of a block, after [`Cavity::grow`].
    pub meets_seam: bool,
    numbers: Numbers,
    replaced: Vec<Wall>,
    edges: EdgeTable,
}

/// Result of a point location walk.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Walk {
    /// The point is in this tet or on its boundary.
    Inside(u32),
    /// The walk stopped at this half-face, which is locked or on the boundary of the mesh.
    Blocked(u32),
}

/// Locates a point by a visibility walk (Devillers, Pion, Teillaud 2002).
///
/// The order in which faces are tested changes with every step. In a Delaunay mesh the walk always
/// terminates; in others it can cycle, so it counts as blocked after more steps than there are
/// tets.
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
                // Any sequence without a short period works.
                turn = turn.wrapping_mul(5).wrapping_add(tet | 1) >> 1;
                continue 'step;
            }
        }
        return Walk::Inside(tet);
    }
    Walk::Blocked(entry)
}

impl Cavity {
    /// Grows the cavity from `seed`: all tets whose circumsphere contains `point`, not across
    /// locked faces.
    pub fn grow(&mut self, mesh: &mut Tetrahedra, seed: u32, point: &Point) {
        mesh.clear_marks();
        self.numbers.clear(mesh.points.len());
        self.tets.clear();
        self.walls.clear();
        self.vertices.clear();
        self.meets_seam = false;
        mesh.mark(seed);
        self.tets.push(seed);
        for v in mesh.tets[seed as usize] {
            self.number_vertex(v);
        }
        let mut next = 0;
        while let Some(&t) = self.tets.get(next) {
            next += 1;
            let across = mesh.across[t as usize];
            let locked = mesh.locked[t as usize];
            for (i, other) in (0u32..).zip(across) {
                let is_locked = locked >> i & 1 == 1;
                if other == NONE || is_locked {
                    self.walls.push(4 * t + i);
                    self.meets_seam |= !is_locked;
                } else if !mesh.is_marked(other >> 2) {
                    if mesh.is_in_sphere(other >> 2, point) {
                        mesh.mark(other >> 2);
                        self.tets.push(other >> 2);
                        self.number_vertex(mesh.apex(other));
                    } else {
                        self.walls.push(4 * t + i);
                    }
                }
            }
        }
    }

    /// Sets the cavity to exactly these tets.
    pub fn set_tets(&mut self, mesh: &mut Tetrahedra, tets: &[u32]) {
        self.tets.clear();
        self.tets.extend_from_slice(tets);
        mesh.clear_marks();
        for &t in tets {
            mesh.mark(t);
        }
        self.collect_boundary(mesh);
    }

    /// Shrinks the cavity until its whole boundary is strictly visible from `point`.
    ///
    /// False if that would remove `seed`, or if a vertex or an edge that must stay would be inside.
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
            self.collect_boundary(mesh);
        }
    }

    /// Recomputes the boundary and the vertices from the marked tets.
    fn collect_boundary(&mut self, mesh: &Tetrahedra) {
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
                self.number_vertex(mesh.apex(half_face));
            }
        }
    }

    /// Gives a vertex the next local number, unless it has one.
    #[inline]
    fn number_vertex(&mut self, vertex: u32) {
        if self.numbers.assign(vertex, self.vertices.len() as u32) {
            self.vertices.push(vertex);
        }
    }

    /// Whether no vertex is inside the cavity. A star-shaped cavity is a topological ball, so its
    /// boundary of w triangles has w/2 + 2 vertices; a larger count means an interior vertex.
    pub fn is_simple(&self) -> bool {
        self.walls.len() + 4 == 2 * self.vertices.len()
    }

    /// Whether no kept edge is in the interior.
    fn keeps_edges(&self, mesh: &Tetrahedra) -> bool {
        if !mesh.has_kept_edges() {
            return true;
        }
        let on_surface = |a, b| self.walls.iter().any(|&w| [a, b].iter().all(|v| mesh.face(w).contains(v)));
        let mut edges = self.tets.iter().flat_map(|&t| edges_of_tet(mesh.tets[t as usize]));
        edges.all(|[a, b]| !mesh.is_kept(a, b) || on_surface(a, b))
    }

    /// Fills the cavity with tets (vertex, wall); they are listed in `filled`.
    ///
    /// The caller guarantees that every wall is visible from the vertex; see
    /// [`Cavity::make_star_shaped`].
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
            // There are usually more walls than tets, so the slots of the removed tets are reused
            // directly.
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

/// Local numbers of vertices, cleared in constant time by a moving base.
#[derive(Clone, Debug, Default)]
struct Numbers {
    /// The number of vertex v is `stamps[v] - base` if that is not negative.
    stamps: Vec<u32>,
    base: u32,
    next: u32,
}

impl Numbers {
    /// Clears all numbers and makes room for `vertices` vertices.
    #[inline]
    fn clear(&mut self, vertices: usize) {
        self.base = self.next;
        if self.base > u32::MAX / 2 {
            self.stamps.fill(0);
            self.base = 0;
        }
        // With base 0 the initial stamp 0 would be a valid number.
        self.base = self.base.max(1);
        self.next = self.base;
        self.stamps.resize(vertices.max(self.stamps.len()), 0);
    }

    /// Assigns a number to a vertex; numbers must come in ascending order. False if the vertex has
    /// one.
    #[inline]
    fn assign(&mut self, vertex: u32, number: u32) -> bool {
        let stamp = &mut self.stamps[vertex as usize];
        let fresh = *stamp < self.base;
        if fresh {
            *stamp = self.base + number;
            self.next = *stamp + 1;
        }
        fresh
    }

    /// The number of a vertex, which must have one.
    #[inline]
    fn of(&self, vertex: u32) -> u32 {
        self.stamps[vertex as usize] - self.base
    }
}

/// The half-face at each directed edge of the cavity's boundary: a square table indexed by local
/// vertex numbers.
///
/// It is never cleared, because only entries written in the same insertion are read.
#[derive(Clone, Debug, Default)]
struct EdgeTable {
    square: Vec<u32>,
    shift: u32,
}

/// Log2 of the most vertices: the largest table takes 4 MiB. A typical cavity has 20 vertices;
/// thousands occur if many points lie on one sphere.
const LARGEST_SHIFT: u32 = 10;

impl EdgeTable {
    /// Makes room for edges between this many vertices; false if they are too many for a table.
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

/// Links the new tets of a cavity with too many vertices for [`EdgeTable`]: sorting brings the two
/// sides of each edge together.
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
