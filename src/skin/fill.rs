//! Tets inside a skin.

use super::{LatticeSkin, Skin, SkinTriangle};
use crate::dist::DistMesh;
use crate::geometry::Projector;
use crate::improve::{self, improve};
use crate::mesh::stream::{MeshStream, TetBlock};
use crate::mesh::{BoundaryTriangle, Class, Mesh, Segment, VertexId};
use crate::refine::{self, RefineError, refine};
use crate::size::SizeField;
use crate::volume::{self, ClosedSurface};
use csg::{BodyId, CornerId, CurveId};

/// The tets of a part: the vertices of its skin come first, in their order, then those inside.
#[derive(Clone, Debug, Default)]
pub struct Filled {
    /// Tets by vertex.
    pub tets: Vec<[u32; 4]>,
    /// Their bodies.
    pub bodies: Vec<BodyId>,
    /// Coordinates of the vertices inside.
    pub inside: Vec<[f64; 3]>,
    /// Why these are the tets of the lattice, if they are.
    pub refused: Option<String>,
}

/// *Local.* [`fill`], or where the volume mesher refuses a skin, the tets of the lattice.
///
/// # Errors
/// Only where the lattice is not valid either.
pub fn fill_or_refine(
    mesh: &DistMesh,
    projector: &Projector,
    skin: &LatticeSkin,
    size: &dyn SizeField,
    settings: &improve::Settings,
) -> Result<Filled, RefineError> {
    match fill(&skin.skin, size, settings) {
        Ok(filled) => Ok(filled),
        Err(refused) => {
            let filled = fill_by_lattice(mesh, projector, skin)?;
            Ok(Filled { refused: Some(refused), ..filled })
        }
    }
}

/// *Local.* Meshes the inside of a skin by a size field, and improves it.
///
/// # Errors
/// What the volume mesher refuses, in words.
pub fn fill(skin: &Skin, size: &dyn SizeField, settings: &improve::Settings) -> Result<Filled, String> {
    if skin.triangles.is_empty() {
        return Ok(Filled::default());
    }
    let (on_triangles, inside) = skin.points.split_at(skin.on_triangles);
    let corners = skin.triangles.iter().map(|t| t.vertices).collect();
    let beside = skin.triangles.iter().map(|t| t.beside).collect();
    let loose = skin.loose_edges();
    let surface = ClosedSurface::new(on_triangles.to_vec(), corners, beside)
        .map_err(|faults| faults.to_string())?
        .with_kept_points(inside.to_vec())
        .with_kept_edges(loose.clone());
    let (filled, report) =
        volume::mesh(&surface, size, &volume::Settings::default()).map_err(|error| error.to_string())?;
    if report.on_kept_edges > 0 {
        return Err(format!("{} edges inside were cut in two", report.on_kept_edges));
    }
    let patched = |t: &SkinTriangle| {
        let (patch, _) = t.patch?;
        Some(BoundaryTriangle { vertices: t.vertices.map(VertexId), patch })
    };
    // All that matters of a class here is whether the vertex may move.
    let mut classes = vec![Class::Corner(CornerId(0)); skin.points.len()];
    classes.resize(filled.points.len(), Class::Body(BodyId(0)));
    let segment = |ends: [u32; 2]| Segment { vertices: ends.map(VertexId), curve: CurveId(0) };
    let mut made = Mesh {
        points: filled.points,
        classes,
        tets: filled.tets.into_iter().map(|t| t.map(VertexId)).collect(),
        bodies: filled.bodies,
        triangles: skin.triangles.iter().filter_map(patched).collect(),
        segments: loose.into_iter().map(segment).collect(),
    };
    improve(&mut made, size, settings);
    Ok(Filled {
        tets: made.tets.into_iter().map(|t| t.map(|v| v.0)).collect(),
        bodies: made.bodies,
        inside: made.points[skin.points.len()..].iter().map(|p| [p.x, p.y, p.z]).collect(),
        refused: None,
    })
}

/// The tets of the lattice.
fn fill_by_lattice(
    mesh: &DistMesh,
    projector: &Projector,
    skin: &LatticeSkin,
) -> Result<Filled, RefineError> {
    const NONE: u32 = u32::MAX;
    let LatticeSkin { skin, numbering, lattice } = skin;
    let refined = refine(mesh.clone(), projector, numbering.lattice().n(), &refine::Settings::default())?;
    let mut place = vec![NONE; numbering.vertices() as usize];
    (0..).zip(lattice).for_each(|(new, &v)| place[v as usize] = new);
    let mut filled = Filled::default();
    for (v, new) in place.iter_mut().enumerate().filter(|(_, new)| **new == NONE) {
        *new = (skin.points.len() + filled.inside.len()) as u32;
        filled.inside.push(refined.points()[v]);
    }
    let mut block = TetBlock::default();
    for index in 0..refined.tet_blocks() {
        refined.tet_block(index, &mut block);
        filled.tets.extend(block.tets.iter().map(|tet| tet.map(|v| place[v as usize])));
        filled.bodies.resize(filled.tets.len(), mesh.tet_bodies[index]);
    }
    Ok(filled)
}
