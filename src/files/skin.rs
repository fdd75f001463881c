//! The skin of a part, or of some of its tets: the faces with a tet on one side only.
//!
//! A face can be in the skin only if each of its vertices is on the boundary, on an interface to
//! another part, or a vertex of an excluded tet. Only such faces are stored and compared, so memory
//! grows with the skin, not with the tets.

use super::chunks::{items, split};
use crate::ground::kernel::simplex::ascending;
use crate::ground::mesh::stream::{BoundaryBlock, MeshStream, TetBlock};
use crate::ground::mesh::{EDGE_BETWEEN, TET_FACES, TRIANGLE_EDGES};
use csg::{BodyId, PatchId};
use rayon::prelude::*;

/// A face of the skin.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SkinFace {
    /// Its vertices by local index, with outward normal.
    pub vertices: [u32; 3],
    /// For second order, the nodes on its edges by local index, in the order of [`TRIANGLE_EDGES`].
    pub edge_nodes: Option<[u32; 3]>,
    /// The body of its tet.
    pub body: BodyId,
}

/// The skin of the tets of a part for which `keep` (called with their corners) returns true, in the
/// order of the tets.
///
/// Two parallel passes over the tets.
pub fn skin(part: &dyn MeshStream, keep: impl Fn(&[[f64; 3]; 4]) -> bool + Sync) -> Vec<SkinFace> {
    let mut may_be_skin = vec![false; part.points().len()];
    for index in 0..part.vertex_blocks() {
        let block = part.vertex_block(index);
        if block.on_boundary || !block.holders.is_empty() {
            may_be_skin[block.local.start as usize..block.local.end as usize].fill(true);
        }
    }
    let points = part.points();
    let corners = |tet: &[u32; 4]| tet.map(|v| points[v as usize]);
    let left_out = collect(part, |block, found: &mut Vec<u32>| {
        found.extend(block.tets.iter().filter(|tet| !keep(&corners(tet))).flatten());
    });
    left_out.iter().for_each(|&v| may_be_skin[v as usize] = true);

    let mut faces = collect(part, |block, found: &mut Vec<([u32; 3], SkinFace)>| {
        let body = block.body.expect("a tet block has a body");
        for (index, tet) in block.tets.iter().enumerate().filter(|(_, tet)| keep(&corners(tet))) {
            let of_tet = block.edge_nodes.get(index);
            for face in TET_FACES {
                let vertices = face.map(|k| tet[k]);
                if vertices.iter().all(|&v| may_be_skin[v as usize]) {
                    let node = |[i, j]: [usize; 2], nodes: &[u32; 6]| nodes[EDGE_BETWEEN[face[i]][face[j]]];
                    let edge_nodes = of_tet.map(|nodes| TRIANGLE_EDGES.map(|ends| node(ends, nodes)));
                    found.push((ascending(vertices), SkinFace { vertices, edge_nodes, body }));
                }
            }
        }
    });
    // The sort is stable: faces with equal keys, and so the remaining ones, stay in the order of
    // the tets.
    let mut order: Vec<u32> = (0..faces.len() as u32).collect();
    order.par_sort_by_key(|&k| faces[k as usize].0);
    let mut alone = vec![false; faces.len()];
    for same in order.chunk_by(|&a, &b| faces[a as usize].0 == faces[b as usize].0) {
        alone[same[0] as usize] = same.len() == 1;
    }
    let mut alone = alone.into_iter();
    faces.retain(|_| alone.next().expect("one for each face"));
    faces.into_iter().map(|(_, face)| face).collect()
}

/// The patches of faces; `None` for faces on no patch (cut faces).
#[cfg_attr(not(feature = "pictures"), allow(dead_code))]
pub fn patches(part: &dyn MeshStream, faces: &[SkinFace]) -> Vec<Option<PatchId>> {
    let mut known = Vec::new();
    let mut block = BoundaryBlock::default();
    for index in 0..part.boundary_blocks() {
        part.boundary_block(index, &mut block);
        let patch = block.patch.expect("a boundary block has a patch");
        known.extend(block.triangles.iter().map(|triangle| (ascending(*triangle), patch)));
    }
    known.par_sort_unstable();
    let find = |face: &SkinFace| {
        let place = known.binary_search_by_key(&ascending(face.vertices), |(key, _)| *key).ok()?;
        Some(known[place].1)
    };
    faces.par_iter().map(find).collect()
}

/// Concatenates what `find` appends for each tet block, in order.
fn collect<T: Send>(part: &dyn MeshStream, find: impl Fn(&TetBlock, &mut Vec<T>) + Sync) -> Vec<T> {
    const PER_CHUNK: u64 = 1 << 14;
    let blocks = part.tet_blocks();
    let (chunks, per_chunk) = split(blocks, part.counts().tets, PER_CHUNK);
    let found: Vec<Vec<T>> = (0..chunks)
        .into_par_iter()
        .map(|chunk| {
            let (mut block, mut found) = (TetBlock::default(), Vec::new());
            for index in items(chunk, per_chunk, blocks) {
                part.tet_block(index, &mut block);
                find(&block, &mut found);
            }
            found
        })
        .collect();
    found.into_iter().flatten().collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::files::plain::PlainPart;
    use crate::files::testing::{cube, scattered, slabs};

    #[test]
    fn the_skin_of_a_cube_is_its_outer_patches() {
        let part = PlainPart::whole(&cube(4));
        let faces = skin(&part, |_| true);
        assert_eq!(faces.len(), 192);
        let on = patches(&part, &faces);
        assert_eq!(on.iter().filter(|patch| **patch == Some(PatchId(0))).count(), 96);
        assert_eq!(on.iter().filter(|patch| **patch == Some(PatchId(1))).count(), 96);
    }

    #[test]
    fn a_cut_exposes_the_faces_along_it() {
        let part = PlainPart::whole(&cube(4));
        let below = |p: &[[f64; 3]; 4]| p.iter().map(|p| p[0]).sum::<f64>() < 4.0 * 2.0 / 3.0;
        let faces = skin(&part, below);
        let cut = patches(&part, &faces).iter().filter(|patch| patch.is_none()).count();
        assert_eq!((faces.len(), cut), (32 + 4 * 16 + 32, 32));
    }

    #[test]
    fn the_skins_of_parts_close_and_meet() {
        let mesh = cube(4);
        for tet_to_rank in [slabs(&mesh, 3), scattered(&mesh, 3)] {
            let mut cut_faces = 0;
            for rank in 0..3 {
                let part = PlainPart::part(&mesh, &tet_to_rank, 3, rank);
                let faces = skin(&part, |_| true);
                // Closed: each directed edge occurs as often as its opposite.
                let mut edges: Vec<(u32, u32, i32)> = Vec::new();
                for face in &faces {
                    for k in 0..3 {
                        let (a, b) = (face.vertices[k], face.vertices[(k + 1) % 3]);
                        edges.push((a.min(b), a.max(b), if a < b { 1 } else { -1 }));
                    }
                }
                edges.sort_unstable();
                for same in edges.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
                    assert_eq!(same.iter().map(|e| e.2).sum::<i32>(), 0);
                }
                let outer = |patch: &&Option<PatchId>| matches!(patch, Some(PatchId(0 | 1)));
                cut_faces += faces.len() - patches(&part, &faces).iter().filter(outer).count();
            }
            assert!(cut_faces > 0 && cut_faces % 2 == 0, "each cut face is in two skins");
        }
    }
}
