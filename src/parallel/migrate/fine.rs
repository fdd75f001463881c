//! Conversion of a refined part to one that can migrate and be refined again.

use super::MigrateError;
use super::rebuild::Room;
use crate::ground::mesh::stream::{BoundaryBlock, MeshStream, NO_TET, TetBlock};
use crate::ground::mesh::{Order, TetId, VertexId};
use crate::parallel::distribution::{BareMesh, ClassifiedEdge, Side};
use crate::parallel::refine::RefinedMesh;

/// *Local.* Stores the tets of a refined part and the classification of its vertices, edges and
/// faces.
///
/// A fine edge is classified on a curve or patch if it subdivides a coarse edge there, or is in a
/// coarse triangle on a patch.
///
/// # Errors
/// [`MigrateError::TooMany`] if local ids exceed `u32`, [`MigrateError::OutOfMemory`].
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
        edge_nodes: room.make(if refined.order() == Order::Second { tets } else { 0 })?,
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
        mesh.edge_nodes.extend(block.edge_nodes.iter().map(|nodes| nodes.map(VertexId)));
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

/// Adds the sides of tets on patches, and the edges on curves and patches.
fn put_boundary(refined: &RefinedMesh, mesh: &mut BareMesh) {
    let edges = refined.numbering().classified_edges(refined.coarse());
    mesh.edges.extend(edges.map(|(ends, class)| ClassifiedEdge::new(ends.map(VertexId), class)));
    let mut block = BoundaryBlock::default();
    for index in 0..refined.boundary_blocks() {
        refined.boundary_block(index, &mut block);
        let patch = block.patch.expect("a boundary triangle lies on a patch");
        for (&[a, b, c], parents) in block.triangles.iter().zip(&block.parents) {
            mesh.edges.extend(ClassifiedEdge::of_triangle([a, b, c].map(VertexId), patch));
            for (&tet, behind) in parents.iter().zip([true, false]).filter(|(tet, _)| **tet != NO_TET) {
                let corners = mesh.tets[tet as usize];
                let face = corners.iter().position(|v| ![a, b, c].contains(&v.0));
                let face = face.expect("a tet has a corner opposite its face") as u8;
                mesh.sides.push(Side { tet: TetId(tet as u32), face, patch, behind });
            }
        }
    }
    mesh.sides.sort_unstable();
    ClassifiedEdge::sort(&mut mesh.edges);
}
