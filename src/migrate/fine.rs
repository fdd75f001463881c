//! A refined part as one that can move and be refined again.

use super::MigrateError;
use super::rebuild::Room;
use crate::dist::{BareMesh, LaidEdge, Side};
use crate::mesh::stream::{BoundaryBlock, MeshStream, NO_TET, TetBlock};
use crate::mesh::{TetId, VertexId};
use crate::refine::RefinedMesh;

/// *Local.* Stores a refined part: its tets, and what its vertices, edges and faces lie on.
///
/// A fine edge is on a curve or patch if it is a piece of a coarse edge there, or lies in a coarse triangle on a patch.
///
/// # Errors
/// Where local ids would pass `u32`, and where memory is short.
pub fn bare(refined: &RefinedMesh) -> Result<BareMesh, MigrateError> {
    let rank = refined.rank();
    let counts = refined.counts();
    if counts.tets >= u64::from(u32::MAX) {
        return Err(MigrateError::TooMany { rank, what: "tets", needed: counts.tets });
    }
    let room = Room { rank, limit: u64::MAX };
    let (vertices, tets) = (counts.vertices as usize, counts.tets as usize);
    let mut mesh = BareMesh {
        rank,
        ranks: refined.ranks(),
        totals: refined.totals(),
        points: room.make(vertices)?,
        vertex_ids: room.make(vertices)?,
        vertex_classes: room.make(vertices)?,
        tets: room.make(tets)?,
        tet_ids: room.make(tets)?,
        tet_bodies: room.make(tets)?,
        sides: room.make(counts.boundary as usize)?,
        ..BareMesh::default()
    };
    put_vertices(refined, &mut mesh);
    let mut block = TetBlock::default();
    for index in 0..refined.tet_blocks() {
        refined.tet_block(index, &mut block);
        let count = block.tets.len();
        mesh.tets.extend(block.tets.iter().map(|tet| tet.map(VertexId)));
        mesh.tet_ids.extend(block.first_id..block.first_id + count as u64);
        mesh.tet_bodies.resize(mesh.tets.len(), block.body.expect("a coarse tet lies in a body"));
    }
    put_boundary(refined, &mut mesh);
    Ok(mesh)
}

fn put_vertices(refined: &RefinedMesh, mesh: &mut BareMesh) {
    let coarse = refined.coarse();
    for index in 0..refined.vertex_blocks() {
        let block = refined.vertex_block(index);
        let class = refined.numbering().block(index).class(coarse);
        mesh.points.extend_from_slice(&refined.vertex_points(index));
        mesh.vertex_ids.extend(block.ids());
        mesh.vertex_classes.resize(mesh.vertex_ids.len(), class);
        if !block.holders.is_empty() {
            block.local.clone().for_each(|v| mesh.shared.push(v, block.holders.iter().copied()));
        }
    }
}

/// The sides of tets on patches, and the edges on curves and patches.
fn put_boundary(refined: &RefinedMesh, mesh: &mut BareMesh) {
    let pieces = refined.numbering().laid_edges(refined.coarse());
    mesh.edges.extend(pieces.map(|(ends, class)| LaidEdge::new(ends.map(VertexId), class)));
    let mut block = BoundaryBlock::default();
    for index in 0..refined.boundary_blocks() {
        refined.boundary_block(index, &mut block);
        let patch = block.patch.expect("a boundary triangle lies on a patch");
        for (&[a, b, c], parents) in block.triangles.iter().zip(&block.parents) {
            mesh.edges.extend(LaidEdge::round([a, b, c].map(VertexId), patch));
            for (&tet, behind) in parents.iter().zip([true, false]).filter(|(tet, _)| **tet != NO_TET) {
                let corners = mesh.tets[tet as usize];
                let face = corners.iter().position(|v| ![a, b, c].contains(&v.0));
                let face = face.expect("a tet has a corner off its face") as u8;
                mesh.sides.push(Side { tet: TetId(tet as u32), face, patch, behind });
            }
        }
    }
    mesh.sides.sort_unstable();
    LaidEdge::sort(&mut mesh.edges);
}
