//! The file with the tets of a part, followed by its triangles if they share the file.

use super::Boundary;
use super::arrays::{Kind, Piece, PieceFile, Section};
use super::boundary::Triangles;
use super::fields::{self, Field, On};
use crate::files::chunks::{items, split, write_chunks};
use crate::files::node_order::{VTK, arranged};
use crate::files::{WriteError, body_number};
use crate::ground::mesh::Names;
use crate::ground::mesh::stream::{MeshStream, TetBlock};
use std::path::Path;

/// VTK's array that marks copies (1) of points or cells.
const GHOST_TYPE: &str = "vtkGhostType";
/// MFEM's name for the body numbers.
const MATERIAL: &str = "material";
/// The id of triangles: -1.
const NO_ID: u64 = u64::MAX;
/// Tets or vertices that one thread encodes at a time.
const PER_CHUNK: u64 = 1 << 14;

/// Describes the arrays of a part's tets with fields, and of its triangles with [`Boundary::In`],
/// which has no fields.
///
/// MFEM takes the first cell array as the element attributes if `Scalars` names it `material`.
pub(super) fn piece(part: &dyn MeshStream, boundary: Boundary, fields: &[Field<'_>]) -> Piece {
    let counts = part.counts();
    let (mixed, several) = (boundary == Boundary::In, part.ranks() > 1);
    let mut piece =
        Piece::new(counts.vertices, counts.tets, if mixed { counts.boundary } else { 0 }, part.order());
    piece.attributes = vec![(Section::PointData, " GlobalIds=\"GlobalNodeId\"")];
    piece.add(Section::PointData, "GlobalNodeId", Kind::I64, counts.vertices);
    if several {
        piece.add(Section::PointData, GHOST_TYPE, Kind::U8, counts.vertices);
    }
    if !part.links().is_empty() {
        piece.add(Section::PointData, "PeriodicId", Kind::I64, counts.vertices);
    }
    fields::add(&mut piece, fields, On::Points, counts.vertices);
    // MFEM reads only files of one part without triangles.
    let for_mfem = !mixed && !several;
    piece.hides_fields = for_mfem;
    // Triangles have no ids, so a mixed file cannot declare `GlobalIds` for its cells.
    let attributes = match (for_mfem, mixed) {
        (true, _) => " Scalars=\"material\" GlobalIds=\"GlobalElementId\"",
        (false, false) => " GlobalIds=\"GlobalElementId\"",
        (false, true) => "",
    };
    piece.attributes.push((Section::CellData, attributes));
    let cells = piece.cells;
    let mut add = |name, kind| piece.add(Section::CellData, name, kind, cells);
    if for_mfem {
        add(MATERIAL, Kind::I32);
    }
    add("GlobalElementId", Kind::I64);
    add("BodyId", Kind::I32);
    if mixed {
        add("BoundaryId", Kind::I32);
    }
    add("PartitionId", Kind::I32);
    if part.ghosts().is_some() || (mixed && several) {
        add(GHOST_TYPE, Kind::U8);
    }
    fields::add(&mut piece, fields, On::Cells, cells);
    piece
}

/// Writes the file and returns its length.
pub(super) fn write(
    piece: &Piece,
    part: &dyn MeshStream,
    names: &Names,
    fields: &[Field<'_>],
    path: &Path,
) -> Result<u64, WriteError> {
    let file = piece.create(path)?;
    let blocks = part.vertex_blocks();
    let (vertex_chunks, vertices_per_chunk) = split(blocks, part.counts().vertices, PER_CHUNK);
    write_chunks([&mut file.array("Points")?.0], vertex_chunks, part.work(), |chunk, [points]| {
        for index in items(chunk, vertices_per_chunk, blocks) {
            points.extend_from_slice(bytemuck::cast_slice(&part.vertex_points(index)));
        }
        Ok(())
    })?;

    write_cells(&file, part, names)?;

    let (chunks, per_chunk) = (vertex_chunks, vertices_per_chunk);
    write_chunks([&mut file.array("GlobalNodeId")?.0], chunks, part.work(), |chunk, [ids]| {
        for index in items(chunk, per_chunk, blocks) {
            part.vertex_block(index).ids().for_each(|global| Kind::I64.push(global, ids));
        }
        Ok(())
    })?;
    if !part.links().is_empty() {
        write_periodic_ids(&file, part)?;
    }
    if part.ranks() > 1 {
        write_chunks([&mut file.array(GHOST_TYPE)?.0], chunks, part.work(), |chunk, [ghosts]| {
            for index in items(chunk, per_chunk, blocks) {
                let block = part.vertex_block(index);
                let copy = |global| block.owner(global, part.rank()) != part.rank();
                ghosts.extend(block.ids().map(|global| u8::from(copy(global))));
            }
            Ok(())
        })?;
    }
    fields::write(&file, fields)?;
    file.finish()
}

/// Writes all cell arrays: tets are streamed, triangles come from memory.
fn write_cells(file: &PieceFile, part: &dyn MeshStream, names: &Names) -> Result<(), WriteError> {
    let tets = part.counts().tets;
    write_tets(file, part, names)?;
    file.fill_cells(tets)?;
    // Triangles are never ghosts.
    let ghost = |cell: u64| part.ghosts().filter(|_| cell < tets)?.tet(cell);
    let owner = |cell: u64| ghost(cell).map_or(part.rank(), |ghost| ghost.owner);
    file.fill("PartitionId", |cell| u64::from(owner(cell)) + 1)?;

    let mixed = file.cell_array("BoundaryId")?.is_some();
    let copies = if mixed { write_triangles(file, part, names)? } else { Vec::new() };
    if let Some(array) = file.cell_array(GHOST_TYPE)? {
        let copy = |triangle: u64| copies[triangle as usize].into();
        file.fill_array(array, |cell| cell.checked_sub(tets).map_or(ghost(cell).is_some().into(), copy))?;
    }
    Ok(())
}

/// Writes the vertices, ids and bodies of tets.
fn write_tets(file: &PieceFile, part: &dyn MeshStream, names: &Names) -> Result<(), WriteError> {
    let (mut connectivity, id) = file.array("connectivity")?;
    let (mut ids, mut bodies) = (file.array("GlobalElementId")?.0, file.array("BodyId")?.0);
    let (chunks, per_chunk) = split(part.tet_blocks(), part.counts().tets, PER_CHUNK);
    let format = |chunk: usize, connectivity: &mut Vec<u8>, ids: &mut Vec<u8>, bodies: &mut Vec<u8>| {
        let mut block = TetBlock::default();
        for index in items(chunk, per_chunk, part.tet_blocks()) {
            part.tet_block(index, &mut block);
            let body = body_number(block.body, names)?;
            for (index, (tet, global)) in block.tets.iter().zip(block.first_id..).enumerate() {
                let edges = arranged(block.edge_nodes_of(index), &VTK);
                tet.iter().copied().chain(edges).for_each(|v| id.push(v.into(), connectivity));
                Kind::I64.push(global, ids);
                Kind::I32.push(body, bodies);
            }
        }
        Ok(())
    };
    match file.cell_array(MATERIAL)? {
        Some((mut materials, _)) => {
            let files = [&mut connectivity, &mut ids, &mut bodies, &mut materials];
            write_chunks(files, chunks, part.work(), |chunk, [connectivity, ids, bodies, materials]| {
                format(chunk, connectivity, ids, bodies)?;
                materials.extend_from_slice(bodies);
                Ok(())
            })
        }
        None => {
            let files = [&mut connectivity, &mut ids, &mut bodies];
            write_chunks(files, chunks, part.work(), |chunk, [connectivity, ids, bodies]| {
                format(chunk, connectivity, ids, bodies)
            })
        }
    }
}

/// Writes the arrays of the triangles that follow the tets; returns which triangles are copies.
fn write_triangles(file: &PieceFile, part: &dyn MeshStream, names: &Names) -> Result<Vec<u8>, WriteError> {
    let counts = part.counts();
    let (mut connectivity, id) =
        file.array_from("connectivity", part.order().tet_nodes() as u64 * counts.tets)?;
    let triangles = Triangles::of(part, names, id, u64::from)?;
    connectivity.write(&triangles.connectivity)?;
    let (mut bodies, kind) = file.array_from("BodyId", counts.tets)?;
    let mut none = Vec::new();
    (0..counts.boundary).for_each(|_| kind.push(0, &mut none));
    bodies.write(&none)?;
    let (mut ids, kind) = file.array_from("GlobalElementId", counts.tets)?;
    none.clear();
    (0..counts.boundary).for_each(|_| kind.push(NO_ID, &mut none));
    ids.write(&none)?;
    let number = |triangle: u64| triangles.numbers[triangle as usize].into();
    file.fill("BoundaryId", |cell| cell.checked_sub(counts.tets).map_or(0, number))?;
    Ok(triangles.copies)
}

/// Writes for each vertex the global id of its periodic master, or its own id if it has none.
fn write_periodic_ids(file: &PieceFile, part: &dyn MeshStream) -> Result<(), WriteError> {
    let mut ids: Vec<u64> =
        (0..part.vertex_blocks()).flat_map(|index| part.vertex_block(index).ids()).collect();
    for (local, origin) in part.masters() {
        ids[local as usize] = origin;
    }
    file.array("PeriodicId")?.0.write(bytemuck::cast_slice(&ids))
}
