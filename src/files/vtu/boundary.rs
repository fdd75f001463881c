//! The triangles on patches of a part.

use super::arrays::{Kind, Piece, Section};
use super::fields::{self, Field, On};
use crate::files::{WriteError, patch_number};
use crate::ground::mesh::stream::{BoundaryBlock, MeshStream, NO_TET};
use crate::ground::mesh::{Names, Order};
use std::path::Path;

/// A vertex that no triangle uses.
const UNUSED: u32 = u32::MAX;

/// The vertices of a part's boundary triangles, renumbered.
pub(super) struct Surface {
    /// The surface vertex of each local vertex, or [`UNUSED`].
    to_surface: Vec<u32>,
    vertices: u64,
    triangles: u64,
    several_parts: bool,
    order: Order,
}

impl Surface {
    pub fn of(part: &dyn MeshStream) -> Self {
        let mut to_surface = vec![UNUSED; part.points().len()];
        let mut block = BoundaryBlock::default();
        for index in 0..part.boundary_blocks() {
            part.boundary_block(index, &mut block);
            let nodes = block.triangles.as_flattened().iter().chain(block.edge_nodes.as_flattened());
            nodes.for_each(|&v| to_surface[v as usize] = 0);
        }
        let mut vertices = 0;
        for place in to_surface.iter_mut().filter(|place| **place != UNUSED) {
            *place = vertices;
            vertices += 1;
        }
        Self {
            to_surface,
            vertices: vertices.into(),
            triangles: part.counts().boundary,
            several_parts: part.ranks() > 1,
            order: part.order(),
        }
    }

    /// Describes the arrays of the triangles, with the fields on points.
    pub fn piece(&self, fields: &[Field<'_>]) -> Piece {
        let mut piece = Piece::new(self.vertices, 0, self.triangles, self.order);
        piece.add(Section::PointData, "GlobalNodeId", Kind::I64, self.vertices);
        fields::add(&mut piece, fields, On::Points, self.vertices);
        piece.add(Section::CellData, "BoundaryId", Kind::I32, self.triangles);
        piece.add(Section::CellData, "PartitionId", Kind::I32, self.triangles);
        if self.several_parts {
            piece.add(Section::CellData, "vtkGhostType", Kind::U8, self.triangles);
        }
        piece.attributes = vec![(Section::PointData, " GlobalIds=\"GlobalNodeId\"")];
        piece
    }

    /// Writes the file and returns its length. Surfaces are small compared to volumes, so one whole
    /// array at a time is in memory.
    pub fn write(
        &self,
        piece: &Piece,
        part: &dyn MeshStream,
        names: &Names,
        fields: &[Field<'_>],
        path: &Path,
    ) -> Result<u64, WriteError> {
        // A part may keep only some of its points, and its boundary uses no others.
        let used = |v: &u32| self.to_surface.get(*v as usize).is_some_and(|place| *place != UNUSED);
        let file = piece.create(path)?;
        let vertices = (0..part.points().len() as u32).filter(used);
        let points: Vec<[f64; 3]> = vertices.clone().map(|v| part.points()[v as usize]).collect();
        file.array("Points")?.0.write(bytemuck::cast_slice(&points))?;

        let mut ids = Vec::new();
        for index in 0..part.vertex_blocks() {
            let block = part.vertex_block(index);
            let globals = block.local.zip(block.first_id..).filter(|(v, _)| used(v));
            globals.for_each(|(_, global)| Kind::I64.push(global, &mut ids));
        }
        file.array("GlobalNodeId")?.0.write(&ids)?;

        let (mut connectivity, id) = file.array("connectivity")?;
        let triangles = Triangles::of(part, names, id, |v| self.to_surface[v as usize].into())?;
        connectivity.write(&triangles.connectivity)?;
        file.fill("BoundaryId", |cell| triangles.numbers[cell as usize].into())?;
        if self.several_parts {
            file.array("vtkGhostType")?.0.write(&triangles.copies)?;
        }
        file.fill("PartitionId", |_| u64::from(part.rank()) + 1)?;
        file.fill_cells(0)?;
        fields::write_at(&file, fields, vertices)?;
        file.finish()
    }
}

/// The boundary triangles in the form of the file.
pub(super) struct Triangles {
    /// Their vertices in binary.
    pub connectivity: Vec<u8>,
    /// Their boundary numbers.
    pub numbers: Vec<u32>,
    /// 1 for copies of triangles that another part has as well and that count there.
    pub copies: Vec<u8>,
}

impl Triangles {
    /// Collects those of a part; `vertex` maps local indices to numbers in the file.
    pub fn of(
        part: &dyn MeshStream,
        names: &Names,
        kind: Kind,
        vertex: impl Fn(u32) -> u64,
    ) -> Result<Self, WriteError> {
        let mut triangles = Self { connectivity: Vec::new(), numbers: Vec::new(), copies: Vec::new() };
        let mut block = BoundaryBlock::default();
        for index in 0..part.boundary_blocks() {
            part.boundary_block(index, &mut block);
            let number = patch_number(block.patch, names)? as u32;
            for (index, (corners, parents)) in block.triangles.iter().zip(&block.parents).enumerate() {
                let nodes = corners.iter().chain(block.edge_nodes_of(index));
                nodes.for_each(|&v| kind.push(vertex(v), &mut triangles.connectivity));
                triangles.numbers.push(number);
                // An outer patch has its body behind it. If there is no tet behind, the other part
                // has the original.
                triangles.copies.push(u8::from(parents[0] == NO_TET));
            }
        }
        Ok(triangles)
    }
}
