//! Division of a mesh into blocks of neighbouring tets, which are improved independently and merged
//! again.
//!
//! A **block** is a [`Complex`] with its own vertex numbers: small enough for the cache, and
//! independent of all others, so that blocks run in parallel and the result is the same for any
//! number of threads. In return, a vertex with tets in two blocks cannot move, and no cavity
//! crosses the **seam** between blocks. So a second **round** improves what is left there, with
//! other blocks and only with tets near the seam.
//!
//! Blocks are intervals of equal length of a Hilbert curve through the vertices (as p4est and
//! others partition meshes: Burstedde, Wilcox, Ghattas 2011); each round shifts the curve.

use crate::Point;
use crate::ground::kernel::hilbert::hilbert_key;
use crate::ground::mesh::{Class, Mesh, VertexId, are_sides, sorted_edge};
use crate::mesher::half_face::NONE;
use crate::mesher::improve::complex::Complex;
use csg::BodyId;
use rayon::prelude::*;

/// The boundary triangles of a mesh, for lookup by vertices.
pub(super) struct Triangles {
    /// The triangles with lowest vertex v are `others[starts[v]..starts[v + 1]]`.
    starts: Vec<u32>,
    /// The other two vertices, and the index of the triangle in the mesh.
    others: Vec<([u32; 2], u32)>,
    /// Whether each vertex is on a triangle.
    on_triangle: Vec<bool>,
    /// The segments that are not sides of triangles, sorted, the lower vertex first: edges inside
    /// bodies that must stay.
    interior_segments: Vec<[u32; 2]>,
}

impl Triangles {
    /// Builds the lookup table (counting sort).
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
        Self { starts, others, on_triangle, interior_segments: find_interior_segments(mesh) }
    }

    /// The triangle with these vertices; vertices added later are on no triangle.
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

/// The segments of a mesh that are not sides of triangles, sorted, the lower vertex first.
fn find_interior_segments(mesh: &Mesh) -> Vec<[u32; 2]> {
    let is_side = are_sides(&mesh.segments, &mesh.triangles);
    let interior_segments = mesh.segments.iter().zip(is_side).filter(|(_, is_side)| !is_side);
    let mut edges: Vec<[u32; 2]> =
        interior_segments.map(|(s, _)| sorted_edge(s.vertices).map(|v| v.0)).collect();
    edges.sort_unstable();
    edges
}

/// The tets that take part in a round, block by block.
pub(super) struct Cut {
    /// The tets.
    tets: Vec<u32>,
    /// The end of each block in `tets`.
    ends: Vec<usize>,
    /// Whether each vertex has tets in two blocks, or also tets outside the round.
    on_seam: Vec<bool>,
}

/// Shift of the curve in each round, in units of the mesh's size. The cells of the curve, which
/// bound most blocks, are halves, quarters, … of twice the mesh, so the shifts make those of
/// different rounds differ.
const SHIFTS: [f64; 3] = [0.0, 0.37, 0.71];

impl Cut {
    /// Divides the tets around the vertices of the `seeds`, or all tets, into blocks of at most
    /// `block` tets.
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

    /// Whether a vertex of a block is on a seam. `vertices` are those that the block had at first;
    /// added ones are not.
    pub fn is_on_seam(&self, vertices: &[u32], vertex: u32) -> bool {
        vertices.get(vertex as usize).is_some_and(|&vertex| self.on_seam[vertex as usize])
    }

    /// Marks the vertices with tets in more than one block; tets outside the round count as one
    /// block.
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

/// The tets that share a vertex with one of the `seeds`, ascending.
fn around(mesh: &Mesh, seeds: &[u32]) -> Vec<u32> {
    let mut near = vec![false; mesh.points.len()];
    for &t in seeds {
        mesh.tets[t as usize].iter().for_each(|v| near[v.index()] = true);
    }
    (0..mesh.tets.len() as u32).filter(|&t| mesh.tets[t as usize].iter().any(|v| near[v.index()])).collect()
}

/// Sorts tets by the position of their first vertices on a Hilbert curve through a cube twice as
/// wide as the mesh, whose origin is `shift` before that of the mesh.
fn sort_along_curve(mesh: &Mesh, tets: &mut Vec<u32>, shift: f64) {
    /// The number of cells along each side of the cube.
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
    // Counting sort.
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

/// Some tets of a mesh as a complex, with the vertices' numbers in the mesh.
pub(super) struct Block {
    /// The tets; their first vertices are those of `vertices`, in that order.
    pub complex: Complex,
    /// The mesh's numbers of the vertices. Added vertices follow them in the complex.
    pub vertices: Vec<u32>,
    /// Whether each of `vertices` was free to move.
    was_free: Vec<bool>,
    /// The boundary triangles that are faces of the block.
    pub triangles: Vec<u32>,
}

impl Block {
    /// Extracts block number `block` of a mesh.
    ///
    /// `to_block` has one entry per vertex of the mesh; all are [`NONE`], before and after.
    ///
    /// # Panics
    /// Like [`Complex::new`].
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
        let kept = triangles.interior_segments.iter().map(here).filter(|edge| !edge.contains(&NONE));
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

    /// The changes of the improved block, to be merged into the mesh. `is_bad` selects, by score,
    /// the tets that still need improvement.
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
            if is_bad(complex.scores[t as usize]) && tet.iter().any(|&v| cut.is_on_seam(&vertices, v)) {
                finished.left.push(finished.tets.len() as u32);
            }
            finished.tets.push(tet);
            finished.bodies.push(body);
        }
        // Added vertices that vanished again get no number.
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

/// Flag of an added vertex, which gets its number in the mesh when all blocks are done.
const ADDED: u32 = 1 << 31;

/// The changes of an improved block.
#[derive(Default)]
pub(super) struct Finished {
    /// Vertices of the mesh with their new positions.
    moved: Vec<(u32, Point)>,
    /// Vertices of the mesh that lost all tets.
    gone: Vec<u32>,
    /// New vertices.
    added: Vec<(Point, BodyId)>,
    /// The tets, with vertices of the mesh or flagged [`ADDED`].
    tets: Vec<[u32; 4]>,
    bodies: Vec<BodyId>,
    /// The tets on the seam that still need improvement.
    left: Vec<u32>,
}

/// Merges all blocks into the mesh and marks vertices without tets in `gone`; returns the tets on
/// the seam that still need improvement.
pub(super) fn merge_blocks(
    mesh: &mut Mesh,
    cut: Cut,
    blocks: Vec<Finished>,
    gone: &mut Vec<bool>,
) -> Vec<u32> {
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

/// Removes the vertices marked `gone`; the others keep their order.
pub(super) fn remove_unused(mesh: &mut Mesh, gone: &[bool]) {
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

/// A mesh as one complex with the mesh's numbers.
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
    assert_eq!(met, mesh.triangles.len(), "some boundary triangle is not a face of a tet");
    complex
}
