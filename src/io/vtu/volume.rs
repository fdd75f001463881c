//! The tets of a part.

use super::arrays::{Kind, Piece, PieceFile, Section};
use crate::io::chunks::{items, split, write_chunks};
use crate::io::{WriteError, body_number};
use crate::mesh::Names;
use crate::mesh::stream::{MeshStream, TetBlock};
use std::path::Path;

/// VTK's number for a tet.
const VTK_TETRA: u64 = 10;
/// VTK's name for what tells copies (1) from originals (0), of points as of cells.
const GHOST_TYPE: &str = "vtkGhostType";
/// Tets or vertices that one thread turns to bytes at a time.
const PER_CHUNK: u64 = 1 << 14;

/// The arrays of a part's tets.
pub(super) fn piece(part: &dyn MeshStream) -> Piece {
    let counts = part.counts();
    let mut piece = Piece::new(counts.vertices, counts.tets, 4);
    piece.add(Section::PointData, "GlobalNodeId", Kind::I64, counts.vertices);
    if part.ranks() > 1 {
        piece.add(Section::PointData, GHOST_TYPE, Kind::U8, counts.vertices);
    }
    if !part.links().is_empty() {
        piece.add(Section::PointData, "PeriodicId", Kind::I64, counts.vertices);
    }
    piece.add(Section::CellData, "GlobalElementId", Kind::I64, counts.tets);
    piece.add(Section::CellData, "BodyId", Kind::I32, counts.tets);
    piece.add(Section::CellData, "PartitionId", Kind::I32, counts.tets);
    if part.ghosts().is_some() {
        piece.add(Section::CellData, GHOST_TYPE, Kind::U8, counts.tets);
    }
    piece.attributes = vec![
        (Section::PointData, " GlobalIds=\"GlobalNodeId\""),
        (Section::CellData, " GlobalIds=\"GlobalElementId\""),
    ];
    piece
}

/// Writes the file; returns its length.
pub(super) fn write(
    piece: &Piece,
    part: &dyn MeshStream,
    names: &Names,
    path: &Path,
) -> Result<u64, WriteError> {
    let file = piece.create(path)?;
    let blocks = part.vertex_blocks();
    let (vertex_chunks, vertices_per_chunk) = split(blocks, part.counts().vertices, PER_CHUNK);
    write_chunks([&mut file.array("Points")?.0], vertex_chunks, |chunk, [points]| {
        for index in items(chunk, vertices_per_chunk, blocks) {
            points.extend_from_slice(bytemuck::cast_slice(&part.vertex_points(index)));
        }
        Ok(())
    })?;

    let (mut connectivity, id) = file.array("connectivity")?;
    let files = [&mut connectivity, &mut file.array("GlobalElementId")?.0, &mut file.array("BodyId")?.0];
    let (chunks, per_chunk) = split(part.tet_blocks(), part.counts().tets, PER_CHUNK);
    write_chunks(files, chunks, |chunk, [connectivity, ids, bodies]| {
        let mut block = TetBlock::default();
        for index in items(chunk, per_chunk, part.tet_blocks()) {
            part.tet_block(index, &mut block);
            let body = body_number(block.body, names)?;
            for (tet, global) in block.tets.iter().zip(block.first_id..) {
                tet.iter().for_each(|&v| id.push(v.into(), connectivity));
                Kind::I64.push(global, ids);
                Kind::I32.push(body, bodies);
            }
        }
        Ok(())
    })?;
    file.fill_cells(4, VTK_TETRA)?;
    let ghost = |tet: u64| part.ghosts().and_then(|ghosts| ghosts.tet(tet));
    let owner = |tet: u64| ghost(tet).map_or(part.rank(), |ghost| ghost.owner);
    file.fill("PartitionId", |tet| u64::from(owner(tet)) + 1)?;
    if part.ghosts().is_some() {
        file.fill_array(file.cell_array(GHOST_TYPE)?, |tet| u64::from(ghost(tet).is_some()))?;
    }

    let (chunks, per_chunk) = (vertex_chunks, vertices_per_chunk);
    write_chunks([&mut file.array("GlobalNodeId")?.0], chunks, |chunk, [ids]| {
        for index in items(chunk, per_chunk, blocks) {
            part.vertex_block(index).ids().for_each(|global| Kind::I64.push(global, ids));
        }
        Ok(())
    })?;
    if !part.links().is_empty() {
        write_periodic_ids(&file, part)?;
    }
    if part.ranks() > 1 {
        write_chunks([&mut file.array(GHOST_TYPE)?.0], chunks, |chunk, [ghosts]| {
            for index in items(chunk, per_chunk, blocks) {
                let block = part.vertex_block(index);
                let copy = |global| block.owner(global, part.rank()) != part.rank();
                ghosts.extend(block.ids().map(|global| u8::from(copy(global))));
            }
            Ok(())
        })?;
    }
    file.finish()
}

/// For each vertex the id of the vertex that it is, at the end, the periodic image of; its own if it is none.
fn write_periodic_ids(file: &PieceFile, part: &dyn MeshStream) -> Result<(), WriteError> {
    let mut ids: Vec<u64> =
        (0..part.vertex_blocks()).flat_map(|index| part.vertex_block(index).ids()).collect();
    for (local, origin) in part.origins() {
        ids[local as usize] = origin;
    }
    file.array("PeriodicId")?.0.write(bytemuck::cast_slice(&ids))
}
