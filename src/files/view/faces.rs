//! Matches the faces of tets with each other and with boundary triangles.

use super::{NO_PATCH, OUTSIDE};
use crate::ground::kernel::simplex::ascending;
use crate::ground::mesh::TET_FACES;
use crate::ground::mesh::stream::{BoundaryBlock, MeshStream};
use rayon::prelude::*;

/// A triangle on a patch, by its ascending vertices, and the patch.
type OnPatch = ([u32; 3], u32);

/// The triangles of a part on patches whose vertices are among `used` (ascending), by positions in
/// it; sorted.
pub(super) fn on_patches(stream: &dyn MeshStream, used: &[u32]) -> Vec<OnPatch> {
    let place = |vertex: u32| used.binary_search(&vertex).ok().map(|place| place as u32);
    let read = |block: &mut BoundaryBlock, index: usize| {
        stream.boundary_block(index, block);
        let patch = block.patch.expect("a boundary block has a patch").0;
        let known = |&[a, b, c]: &[u32; 3]| Some((ascending([place(a)?, place(b)?, place(c)?]), patch));
        block.triangles.iter().filter_map(known).collect::<Vec<OnPatch>>()
    };
    let blocks = (0..stream.boundary_blocks()).into_par_iter();
    let mut found: Vec<OnPatch> = blocks.map_init(BoundaryBlock::default, read).flatten_iter().collect();
    found.par_sort_unstable();
    found
}

/// For the faces of each tet opposite its corners: the tet behind, and the patch or [`NO_PATCH`].
/// Without a tet behind it is [`OUTSIDE`] for a face on a patch, and `alone` of any other face.
pub(super) fn of_tets(
    tets: &[[u32; 4]],
    boundary: &[OnPatch],
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
    let mut patches = vec![[NO_PATCH; 4]; tets.len()];
    let mut rest = boundary;
    for same in faces.chunk_by(|a, b| a.0 == b.0) {
        // Both lists are sorted by vertices.
        rest = &rest[rest.partition_point(|(key, _)| *key < same[0].0)..];
        let patch = rest.first().filter(|(key, _)| *key == same[0].0).map(|(_, patch)| *patch as i32);
        for (_, at) in same {
            patches[*at as usize / 4][*at as usize % 4] = patch.unwrap_or(NO_PATCH);
        }
        match *same {
            [(_, a), (_, b)] => {
                neighbours[a as usize / 4][a as usize % 4] = (b / 4) as i32;
                neighbours[b as usize / 4][b as usize % 4] = (a / 4) as i32;
            }
            // More than two tets at a face overlap: all are drawn.
            _ => same.iter().for_each(|(key, at)| {
                let behind = if patch.is_some() { OUTSIDE } else { alone(key) };
                neighbours[*at as usize / 4][*at as usize % 4] = behind;
            }),
        }
    }
    (neighbours, patches)
}
