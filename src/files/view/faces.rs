//! Matches the faces of tets with each other and with boundary triangles.

use super::{NO_PATCH, OUTSIDE};
use crate::ground::kernel::simplex::ascending;
use crate::ground::mesh::TET_FACES;
use crate::ground::mesh::stream::{BoundaryBlock, MeshStream};
use rayon::prelude::*;

/// The triangles of a part on patches, sorted by their ascending vertices.
pub(super) fn on_patches(stream: &dyn MeshStream) -> Vec<([u32; 3], u32)> {
    let mut found = Vec::new();
    let mut block = BoundaryBlock::default();
    for index in 0..stream.boundary_blocks() {
        stream.boundary_block(index, &mut block);
        let patch = block.patch.expect("a boundary block has a patch").0;
        found.extend(block.triangles.iter().map(|triangle| (ascending(*triangle), patch)));
    }
    found.par_sort_unstable();
    found
}

/// For the faces of each tet opposite its corners: the tet behind, or what `alone` says of a face
/// without one; and the patch.
pub(super) fn of_tets(
    tets: &[[u32; 4]],
    boundary: &[([u32; 3], u32)],
    alone: impl Fn(&[u32; 3]) -> i32,
) -> (Vec<[i32; 4]>, Vec<[i32; 4]>) {
    let face = |at: u32| {
        let (tet, opposite) = (at as usize / 4, at as usize % 4);
        ascending(TET_FACES[opposite].map(|k| tets[tet][k]))
    };
    let mut faces: Vec<([u32; 3], u32)> =
        (0..4 * tets.len() as u32).into_par_iter().map(|at| (face(at), at)).collect();
    faces.par_sort_unstable();
    let mut neighbours = vec![[OUTSIDE; 4]; tets.len()];
    for same in faces.chunk_by(|a, b| a.0 == b.0) {
        match *same {
            [(_, a), (_, b)] => {
                neighbours[a as usize / 4][a as usize % 4] = (b / 4) as i32;
                neighbours[b as usize / 4][b as usize % 4] = (a / 4) as i32;
            }
            // More than two tets at a face overlap: all are drawn.
            _ => same.iter().for_each(|(key, at)| {
                neighbours[*at as usize / 4][*at as usize % 4] = alone(key);
            }),
        }
    }
    let patch = |at: u32| match boundary.binary_search_by_key(&face(at), |(key, _)| *key) {
        Ok(place) => boundary[place].1 as i32,
        Err(_) => NO_PATCH,
    };
    let patches =
        (0..tets.len() as u32).into_par_iter().map(|tet| [0, 1, 2, 3].map(|k| patch(4 * tet + k))).collect();
    (neighbours, patches)
}
