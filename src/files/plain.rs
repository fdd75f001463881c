//! A serial mesh, or one part of it, as a stream, so that writers need only one kind of input.

use crate::ground::kernel::predicates::{Sign, orient3d};
use crate::ground::mesh::stream::{BoundaryBlock, Counts, MeshStream, NO_TET, TetBlock, VertexBlock};
use crate::ground::mesh::{Class, GlobalId, Mesh, Rank, TET_FACES, VertexId};
use csg::{BodyId, PatchId};
use std::ops::Range;

/// Maximum number of tets or triangles in a block: small enough for many threads, large enough for
/// a call.
const BLOCK: usize = 8192;

/// One rank's part of a serial mesh: vertices, tets and boundary triangles in the order of the
/// whole, whose indices are the global ids.
pub struct PlainPart {
    rank: Rank,
    ranks: u32,
    totals: Counts,
    points: Vec<[f64; 3]>,
    vertices: Vec<VertexRun>,
    tets: Vec<[u32; 4]>,
    tet_runs: Vec<TetRun>,
    triangles: Vec<[u32; 3]>,
    parents: Vec<[u64; 2]>,
    triangle_runs: Vec<(Range<usize>, (PatchId, Bodies))>,
}

/// The bodies of a part's own tets behind and in front of a triangle.
type Bodies = [Option<BodyId>; 2];

/// Vertices with consecutive ids on the same ranks.
struct VertexRun {
    local: Range<u32>,
    first_id: GlobalId,
    holders: Vec<Rank>,
    on_boundary: bool,
}

/// Tets with consecutive ids in the same body.
struct TetRun {
    local: Range<usize>,
    first_id: GlobalId,
    body: BodyId,
}

impl PlainPart {
    /// The whole mesh as the only part.
    pub fn whole(mesh: &Mesh) -> Self {
        Self::part(mesh, &vec![0; mesh.tets.len()], 1, 0)
    }

    /// The part of `rank` if each tet belongs to the rank in `tet_to_rank`.
    ///
    /// # Panics
    /// If a boundary triangle is not a face of a tet.
    pub fn part(mesh: &Mesh, tet_to_rank: &[Rank], ranks: u32, rank: Rank) -> Self {
        let holders = holders(mesh, tet_to_rank);
        let ids: Vec<usize> =
            (0..mesh.points.len()).filter(|&v| holders[v].binary_search(&rank).is_ok()).collect();
        let mut to_local = vec![u32::MAX; mesh.points.len()];
        for (local, &v) in ids.iter().enumerate() {
            to_local[v] = local as u32;
        }

        let mut tet_ids = Vec::new();
        let mut tet_to_local = vec![NO_TET; mesh.tets.len()];
        for t in (0..mesh.tets.len()).filter(|&t| tet_to_rank[t] == rank) {
            tet_to_local[t] = tet_ids.len() as u64;
            tet_ids.push(t);
        }
        let local = |v: VertexId| to_local[v.index()];
        let sides = triangle_parents(mesh);
        let mut triangles = Vec::new();
        let mut parents = Vec::new();
        let mut patches = Vec::new();
        for (triangle, sides) in mesh.triangles.iter().zip(&sides) {
            let here = sides.map(|t| if t == NO_TET { NO_TET } else { tet_to_local[t as usize] });
            if here != [NO_TET; 2] {
                triangles.push(triangle.vertices.map(local));
                parents.push(here);
                let body = |k: usize| (here[k] != NO_TET).then(|| mesh.bodies[sides[k] as usize]);
                patches.push((triangle.patch, [body(0), body(1)]));
            }
        }
        Self {
            rank,
            ranks,
            totals: Counts {
                vertices: holders.iter().filter(|h| !h.is_empty()).count() as u64,
                tets: mesh.tets.len() as u64,
                boundary: mesh.triangles.len() as u64,
            },
            points: ids.iter().map(|&v| mesh.points[v].coords.into()).collect(),
            vertices: vertex_runs(mesh, &ids, &holders),
            tets: tet_ids.iter().map(|&t| mesh.tets[t].map(local)).collect(),
            tet_runs: runs(tet_ids.len(), |k| (tet_ids[k] - k, mesh.bodies[tet_ids[k]]))
                .map(|(local, (shift, body))| TetRun { first_id: (local.start + shift) as u64, local, body })
                .collect(),
            triangle_runs: runs(patches.len(), |k| patches[k]).collect(),
            triangles,
            parents,
        }
    }
}

/// Ranges of at most [`BLOCK`] indices with equal keys.
fn runs<K: PartialEq>(len: usize, key: impl Fn(usize) -> K) -> impl Iterator<Item = (Range<usize>, K)> {
    let mut start = 0;
    std::iter::from_fn(move || {
        if start == len {
            return None;
        }
        let first = key(start);
        let end = (start + 1..len.min(start + BLOCK)).find(|&k| key(k) != first);
        let range = start..end.unwrap_or(len.min(start + BLOCK));
        start = range.end;
        Some((range, first))
    })
}

/// The ranks that have each vertex, ascending.
fn holders(mesh: &Mesh, tet_to_rank: &[Rank]) -> Vec<Vec<Rank>> {
    let mut holders = vec![Vec::new(); mesh.points.len()];
    for (tet, &rank) in mesh.tets.iter().zip(tet_to_rank) {
        for v in tet {
            if let Err(place) = holders[v.index()].binary_search(&rank) {
                holders[v.index()].insert(place, rank);
            }
        }
    }
    holders
}

fn vertex_runs(mesh: &Mesh, ids: &[usize], holders: &[Vec<Rank>]) -> Vec<VertexRun> {
    let on_boundary = |v: usize| !matches!(mesh.classes[v], Class::Body(_));
    runs(ids.len(), |k| (ids[k] - k, &holders[ids[k]], on_boundary(ids[k])))
        .map(|(local, (shift, holders, on_boundary))| VertexRun {
            first_id: (local.start + shift) as u64,
            local: local.start as u32..local.end as u32,
            holders: if holders.len() > 1 { holders.clone() } else { Vec::new() },
            on_boundary,
        })
        .collect()
}

/// For each boundary triangle, the tets behind and in front of it.
fn triangle_parents(mesh: &Mesh) -> Vec<[u64; 2]> {
    let sorted = |mut face: [VertexId; 3]| {
        face.sort();
        face
    };
    let mut order: Vec<([VertexId; 3], usize)> =
        mesh.triangles.iter().enumerate().map(|(k, t)| (sorted(t.vertices), k)).collect();
    order.sort_unstable();

    let mut parents = vec![[NO_TET; 2]; mesh.triangles.len()];
    for (t, tet) in mesh.tets.iter().enumerate() {
        for (apex, face) in TET_FACES.iter().enumerate() {
            let face = face.map(|k| tet[k]);
            let Ok(place) = order.binary_search_by_key(&sorted(face), |(face, _)| *face) else { continue };
            let triangle = order[place].1;
            let [a, b, c] = mesh.triangles[triangle].vertices.map(|v| &mesh.points[v.index()]);
            let behind = orient3d(a, b, c, &mesh.points[tet[apex].index()]) == Sign::Negative;
            parents[triangle][usize::from(!behind)] = t as u64;
        }
    }
    for (triangle, parents) in mesh.triangles.iter().zip(&parents) {
        assert_ne!(*parents, [NO_TET; 2], "{triangle:?} is no face of a tet");
    }
    parents
}

impl MeshStream for PlainPart {
    fn rank(&self) -> Rank {
        self.rank
    }

    fn ranks(&self) -> u32 {
        self.ranks
    }

    fn counts(&self) -> Counts {
        Counts {
            vertices: self.points.len() as u64,
            tets: self.tets.len() as u64,
            boundary: self.triangles.len() as u64,
        }
    }

    fn totals(&self) -> Counts {
        self.totals
    }

    fn points(&self) -> &[[f64; 3]] {
        &self.points
    }

    fn vertex_blocks(&self) -> usize {
        self.vertices.len()
    }

    fn vertex_block(&self, index: usize) -> VertexBlock<'_> {
        let run = &self.vertices[index];
        VertexBlock {
            local: run.local.clone(),
            first_id: run.first_id,
            holders: &run.holders,
            on_boundary: run.on_boundary,
        }
    }

    fn tet_blocks(&self) -> usize {
        self.tet_runs.len()
    }

    fn tet_block(&self, index: usize, block: &mut TetBlock) {
        let run = &self.tet_runs[index];
        block.tets.clear();
        block.tets.extend_from_slice(&self.tets[run.local.clone()]);
        block.first_id = run.first_id;
        block.first_local = run.local.start as u64;
        block.body = Some(run.body);
    }

    fn boundary_blocks(&self) -> usize {
        self.triangle_runs.len()
    }

    fn boundary_block(&self, index: usize, block: &mut BoundaryBlock) {
        let (range, (patch, bodies)) = &self.triangle_runs[index];
        block.triangles.clear();
        block.triangles.extend_from_slice(&self.triangles[range.clone()]);
        block.parents.clear();
        block.parents.extend_from_slice(&self.parents[range.clone()]);
        block.bodies = *bodies;
        block.patch = Some(*patch);
    }
}
