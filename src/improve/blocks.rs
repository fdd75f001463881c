//! A mesh cut into blocks of neighbouring tets, which are improved apart and put together again.
//!
//! A **block** is a [`Complex`] of its own with its own numbers of vertices: small enough for the cache, and
//! independent of all others, so that blocks run in parallel and the result is the same for any number of threads.
//! The price: a vertex with tets in two blocks cannot move, and no hole crosses the **seam** between blocks. So what is
//! left there is improved in a second **round**, whose blocks are cut elsewhere: only tets near the seam take part.
//!
//! Blocks are stretches of equal length of a Hilbert curve through the vertices (as p4est and others cut meshes
//! among processors: Burstedde, Wilcox, Ghattas 2011), for each round of a curve that begins elsewhere.

use crate::Point;
use crate::improve::complex::{Complex, NONE};
use crate::kernel::hilbert::hilbert_key;
use crate::mesh::{Class, Mesh, VertexId, are_sides, sorted_edge};
use csg::BodyId;
use rayon::prelude::*;

/// The boundary triangles of a mesh, to be found by their vertices.
pub(super) struct Triangles {
    /// Those whose lowest vertex is v are from `starts[v]` to `starts[v + 1]`.
    starts: Vec<u32>,
    /// The other two vertices, and the triangle's place in the mesh.
    others: Vec<([u32; 2], u32)>,
    /// Whether the vertex is on a triangle.
    on_triangle: Vec<bool>,
    /// The segments that are no side of a triangle, sorted, the lower vertex first: edges inside bodies that must stay.
    loose: Vec<[u32; 2]>,
}

impl Triangles {
    /// Sorts the triangles of a mesh.
    pub fn new(mesh: &Mesh) -> Self {
        let mut on_triangle = vec![false; mesh.points.len()];
        let mut starts = vec![0_u32; mesh.points.len() + 1];
        let sorted = |t: usize| {
            let mut key = mesh.triangles[t].vertices.map(|v| v.0);
            key.sort_unstable();
            key
        };
        for t in 0..mesh.triangles.len() {
            let key = sorted(t);
            starts[key[0] as usize + 1] += 1;
            key.iter().for_each(|&v| on_triangle[v as usize] = true);
        }
        for v in 0..mesh.points.len() {
            starts[v + 1] += starts[v];
        }
        let mut others = vec![([0; 2], 0); mesh.triangles.len()];
        let mut next = starts.clone();
        for t in 0..mesh.triangles.len() {
            let [low, middle, high] = sorted(t);
            others[next[low as usize] as usize] = ([middle, high], t as u32);
            next[low as usize] += 1;
        }
        Self { starts, others, on_triangle, loose: loose_segments(mesh) }
    }

    /// The triangle with these vertices; none has a vertex that was added since.
    fn find(&self, mut vertices: [u32; 3]) -> Option<u32> {
        if !vertices.iter().all(|&v| self.on_triangle.get(v as usize) == Some(&true)) {
            return None;
        }
        vertices.sort_unstable();
        let [low, middle, high] = vertices;
        let here = &self.others[self.starts[low as usize] as usize..self.starts[low as usize + 1] as usize];
        here.iter().find(|(others, _)| *others == [middle, high]).map(|(_, t)| *t)
    }
}

/// The segments of a mesh that are no side of a triangle, sorted, the lower vertex first.
fn loose_segments(mesh: &Mesh) -> Vec<[u32; 2]> {
    let is_side = are_sides(&mesh.segments, &mesh.triangles);
    let loose = mesh.segments.iter().zip(is_side).filter(|(_, is_side)| !is_side);
    let mut edges: Vec<[u32; 2]> = loose.map(|(s, _)| sorted_edge(s.vertices).map(|v| v.0)).collect();
    edges.sort_unstable();
    edges
}

/// The tets of a mesh that take part in a round, block after block.
pub(super) struct Cut {
    /// The tets.
    tets: Vec<u32>,
    /// Where each block ends.
    ends: Vec<usize>,
    /// Whether the vertex has tets in two blocks, or also tets that take no part.
    on_seam: Vec<bool>,
}

/// How far the curve of each round begins before the mesh, in units of its size: the cells of the curve,
/// which bound most blocks, are halves, quarters... of twice the mesh, and those of two rounds should not fall together.
const SHIFTS: [f64; 3] = [0.0, 0.37, 0.71];

impl Cut {
    /// Cuts the tets round the vertices of some `seeds`, or all tets, into blocks of at most `block` tets.
    pub fn new(mesh: &Mesh, seeds: Option<&[u32]>, round: usize, block: usize) -> Self {
        let mut tets: Vec<u32> = match seeds {
            Some(seeds) => around(mesh, seeds),
            None => (0..mesh.tets.len() as u32).collect(),
        };
        sort_along_curve(mesh, &mut tets, SHIFTS[round % SHIFTS.len()]);
        let blocks = tets.len().div_ceil(block.max(1));
        let ends: Vec<usize> = (1..=blocks).map(|b| tets.len() * b / blocks).collect();
        let mut cut = Self { tets, ends, on_seam: Vec::new() };
        cut.find_seam(mesh);
        cut
    }

    /// Marks the vertices that more than one block has, the tets which take no part being a block too.
    fn find_seam(&mut self, mesh: &Mesh) {
        let mut first = vec![NONE; mesh.points.len()];
        self.on_seam = vec![false; mesh.points.len()];
        let mut visit = |t: u32, block: u32| {
            for v in mesh.tets[t as usize] {
                if first[v.index()] == NONE {
                    first[v.index()] = block;
                } else if first[v.index()] != block {
                    self.on_seam[v.index()] = true;
                }
            }
        };
        for block in 0..self.ends.len() {
            let begin = if block == 0 { 0 } else { self.ends[block - 1] };
            self.tets[begin..self.ends[block]].iter().for_each(|&t| visit(t, block as u32));
        }
        if self.tets.len() < mesh.tets.len() {
            let mut takes_part = vec![false; mesh.tets.len()];
            self.tets.iter().for_each(|&t| takes_part[t as usize] = true);
            let rest = (0..mesh.tets.len() as u32).filter(|&t| !takes_part[t as usize]);
            rest.for_each(|t| visit(t, self.ends.len() as u32));
        }
    }

    /// The number of blocks.
    pub fn blocks(&self) -> usize {
        self.ends.len()
    }

    fn tets_of(&self, block: usize) -> &[u32] {
        let begin = if block == 0 { 0 } else { self.ends[block - 1] };
        &self.tets[begin..self.ends[block]]
    }
}

/// The tets that have a vertex of one of the `seeds`, ascending.
fn around(mesh: &Mesh, seeds: &[u32]) -> Vec<u32> {
    let mut near = vec![false; mesh.points.len()];
    for &t in seeds {
        mesh.tets[t as usize].iter().for_each(|v| near[v.index()] = true);
    }
    (0..mesh.tets.len() as u32).filter(|&t| mesh.tets[t as usize].iter().any(|v| near[v.index()])).collect()
}

/// Sorts tets by where their first vertices come on a Hilbert curve through a cube twice as wide as the mesh, which
/// begins `shift` before it.
fn sort_along_curve(mesh: &Mesh, tets: &mut Vec<u32>, shift: f64) {
    /// Cells along each side of the cube.
    const CELLS: f64 = (1 << 21) as f64;
    let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    for p in &mesh.points {
        for k in 0..3 {
            low[k] = low[k].min(p[k]);
            high[k] = high[k].max(p[k]);
        }
    }
    let side = (0..3).map(|k| high[k] - low[k]).fold(0.0, f64::max);
    let scale = if side > 0.0 { 0.5 * CELLS / side } else { 0.0 };
    let cell = |x: f64, k: usize| ((x - low[k] + shift * side) * scale).clamp(0.0, CELLS - 1.0) as u32;
    let mut used = vec![false; mesh.points.len()];
    tets.iter().for_each(|&t| used[mesh.tets[t as usize][0].index()] = true);
    let mut keys: Vec<(u64, u32)> =
        (0..used.len() as u32).filter(|&v| used[v as usize]).map(|v| (0, v)).collect();
    keys.par_iter_mut().for_each(|(key, v)| {
        let p = &mesh.points[*v as usize];
        *key = hilbert_key([0, 1, 2].map(|k| cell(p[k], k)));
    });
    keys.par_sort_unstable();

    let mut place = vec![0_u32; mesh.points.len()];
    keys.iter().enumerate().for_each(|(k, &(_, v))| place[v as usize] = k as u32);
    let place_of = |t: u32| place[mesh.tets[t as usize][0].index()] as usize;
    // By counting.
    let mut next = vec![0_u32; keys.len() + 1];
    tets.iter().for_each(|&t| next[place_of(t) + 1] += 1);
    for k in 0..keys.len() {
        next[k + 1] += next[k];
    }
    let mut sorted = vec![0; tets.len()];
    for &t in tets.iter() {
        let slot = &mut next[place_of(t)];
        sorted[*slot as usize] = t;
        *slot += 1;
    }
    *tets = sorted;
}

/// Some tets of a mesh as a complex, and what its vertices are called in the mesh.
pub(super) struct Block {
    /// The tets; those of the mesh's vertices come first that it uses, in the order of `vertices`.
    pub complex: Complex,
    /// The vertices in the mesh. Vertices that were added since come behind.
    pub vertices: Vec<u32>,
    /// Whether each of them can move and was not added since.
    was_free: Vec<bool>,
    /// The boundary triangles that are faces of the block.
    pub triangles: Vec<u32>,
}

impl Block {
    /// Takes block number `block` out of a mesh. `to_block`, one entry a vertex of the mesh, holds [`NONE`] only,
    /// before and after.
    ///
    /// # Panics
    /// As [`Complex::new`].
    pub fn new(mesh: &Mesh, triangles: &Triangles, cut: &Cut, block: usize, to_block: &mut [u32]) -> Self {
        let mut vertices = Vec::new();
        let mut tets = Vec::with_capacity(cut.tets_of(block).len());
        let mut bodies = Vec::with_capacity(cut.tets_of(block).len());
        for &t in cut.tets_of(block) {
            tets.push(mesh.tets[t as usize].map(|v| {
                let here = &mut to_block[v.index()];
                if *here == NONE {
                    *here = vertices.len() as u32;
                    vertices.push(v.0);
                }
                *here
            }));
            bodies.push(mesh.bodies[t as usize]);
        }
        let here = |edge: &[u32; 2]| edge.map(|v| to_block[v as usize]);
        let kept = triangles.loose.iter().map(here).filter(|edge| !edge.contains(&NONE));
        let mut kept_edges: Vec<[u32; 2]> = kept.map(|[a, b]| [a.min(b), a.max(b)]).collect();
        kept_edges.sort_unstable();
        vertices.iter().for_each(|&v| to_block[v as usize] = NONE);
        let points = vertices.iter().map(|&v| mesh.points[v as usize]).collect();
        let is_free =
            |&v: &u32| !cut.on_seam[v as usize] && matches!(mesh.classes[v as usize], Class::Body(_));
        let mut free: Vec<bool> = vertices.iter().map(is_free).collect();
        kept_edges.iter().flatten().for_each(|&v| free[v as usize] = false);
        let mut met = Vec::new();
        let mut complex = Complex::new(points, free, tets, bodies, |face| {
            let triangle = triangles.find(face.map(|v| vertices[v as usize]));
            met.extend(triangle);
            triangle.is_some()
        });
        complex.kept_edges = kept_edges;
        let was_free = complex.free.clone();
        Self { complex, vertices, was_free, triangles: met }
    }

    /// What the mesh must know of the improved block. `is_bad` finds the tets that are still to be improved.
    pub fn finish(self, cut: &Cut, is_bad: impl Fn(f64) -> bool) -> Finished {
        let Self { complex, vertices, was_free, .. } = self;
        let old = vertices.len();
        let mut finished = Finished::default();
        for (v, &vertex) in vertices.iter().enumerate() {
            if !was_free[v] {
                continue;
            }
            if complex.is_used(v as u32) {
                finished.moved.push((vertex, complex.points[v]));
            } else {
                finished.gone.push(vertex);
            }
        }
        let mut new_body = vec![None; complex.points.len() - old];
        for t in complex.living() {
            let (tet, body) = (complex.tets[t as usize], complex.bodies[t as usize]);
            for v in tet.into_iter().filter(|&v| v as usize >= old) {
                new_body[v as usize - old] = Some(body);
            }
            let on_seam = |&v: &u32| (v as usize) < old && cut.on_seam[vertices[v as usize] as usize];
            if is_bad(complex.scores[t as usize]) && tet.iter().any(on_seam) {
                finished.left.push(finished.tets.len() as u32);
            }
            finished.tets.push(tet);
            finished.bodies.push(body);
        }
        // New vertices that vanished again get no number.
        let mut to_mesh: Vec<u32> = vertices;
        for (k, body) in new_body.into_iter().enumerate() {
            to_mesh.push(NONE);
            if let Some(body) = body {
                to_mesh[old + k] = ADDED | finished.added.len() as u32;
                finished.added.push((complex.points[old + k], body));
            }
        }
        for tet in &mut finished.tets {
            *tet = tet.map(|v| to_mesh[v as usize]);
        }
        finished
    }
}

/// The mark of a vertex that was added, and gets its number in the mesh when all blocks are done.
const ADDED: u32 = 1 << 31;

/// What became of a block.
#[derive(Default)]
pub(super) struct Finished {
    /// Vertices of the mesh and where they are now.
    moved: Vec<(u32, Point)>,
    /// Vertices of the mesh without tets.
    gone: Vec<u32>,
    /// New vertices.
    added: Vec<(Point, BodyId)>,
    /// The tets, with vertices of the mesh or [`ADDED`] ones.
    tets: Vec<[u32; 4]>,
    bodies: Vec<BodyId>,
    /// Those of the tets that were bad and on the seam.
    left: Vec<u32>,
}

/// Puts all blocks of a cut back into the mesh, and marks vertices without tets as `gone`. Gives the tets at the seam that are left to be improved.
pub(super) fn put_back(mesh: &mut Mesh, cut: Cut, blocks: Vec<Finished>, gone: &mut Vec<bool>) -> Vec<u32> {
    if cut.tets.len() == mesh.tets.len() {
        mesh.tets.clear();
        mesh.bodies.clear();
    } else {
        let mut takes_part = vec![false; mesh.tets.len()];
        cut.tets.iter().for_each(|&t| takes_part[t as usize] = true);
        let mut keep = takes_part.iter();
        mesh.tets.retain(|_| keep.next() == Some(&false));
        let mut keep = takes_part.iter();
        mesh.bodies.retain(|_| keep.next() == Some(&false));
    }
    drop(cut);
    let mut left = Vec::new();
    for block in blocks {
        let first_added = mesh.points.len() as u32;
        assert!(first_added < ADDED, "more than 2^31 vertices");
        for (v, at) in block.moved {
            mesh.points[v as usize] = at;
        }
        for (at, body) in block.added {
            mesh.points.push(at);
            mesh.classes.push(Class::Body(body));
        }
        gone.resize(mesh.points.len(), false);
        block.gone.iter().for_each(|&v| gone[v as usize] = true);
        let first_tet = mesh.tets.len() as u32;
        left.extend(block.left.iter().map(|&t| first_tet + t));
        let number = |v: u32| VertexId(if v & ADDED == 0 { v } else { first_added + (v & !ADDED) });
        mesh.tets.extend(block.tets.iter().map(|t| t.map(number)));
        mesh.bodies.extend(block.bodies);
    }
    left
}

/// Takes the vertices that are gone out of the mesh; the others keep their order.
pub(super) fn forget(mesh: &mut Mesh, gone: &[bool]) {
    if !gone.contains(&true) {
        return;
    }
    let mut old_to_new = vec![VertexId(NONE); mesh.points.len()];
    let mut kept = 0;
    for v in (0..gone.len()).filter(|&v| !gone[v]) {
        old_to_new[v] = VertexId::new(kept);
        mesh.points[kept] = mesh.points[v];
        mesh.classes[kept] = mesh.classes[v];
        kept += 1;
    }
    mesh.points.truncate(kept);
    mesh.classes.truncate(kept);
    mesh.tets.par_iter_mut().for_each(|t| *t = t.map(|v| old_to_new[v.index()]));
    for triangle in &mut mesh.triangles {
        triangle.vertices = triangle.vertices.map(|v| old_to_new[v.index()]);
    }
    for segment in &mut mesh.segments {
        segment.vertices = segment.vertices.map(|v| old_to_new[v.index()]);
    }
}

/// A mesh as one complex with the mesh's own numbers.
#[cfg(test)]
pub(super) fn whole(mesh: &Mesh) -> Complex {
    let triangles = Triangles::new(mesh);
    let mut met = 0;
    let complex = Complex::new(
        mesh.points.clone(),
        mesh.classes.iter().map(|c| matches!(c, Class::Body(_))).collect(),
        mesh.tets.iter().map(|t| t.map(|v| v.0)).collect(),
        mesh.bodies.clone(),
        |face| {
            let is_kept = triangles.find(face).is_some();
            met += usize::from(is_kept);
            is_kept
        },
    );
    assert_eq!(met, mesh.triangles.len(), "boundary triangles that are no tet's face");
    complex
}
