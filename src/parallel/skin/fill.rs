//! Meshing of the interior of a skin.

use super::remesh::{FreeFaces, RemeshError};
use super::{LatticeSkin, Skin, SkinTriangle};
use crate::ground::mesh::stream::{MeshStream, TetBlock};
use crate::ground::mesh::{BoundaryTriangle, Class, Mesh, Segment, Touching, VertexId};
use crate::ground::projector::Projector;
use crate::ground::size::SizeField;
use crate::mesher::improve::{self, Smoothness};
use crate::mesher::volume::{self, ClosedSurface, SurfaceFaults, VolumeError};
use crate::parallel::distribution::DistMesh;
use crate::parallel::refine::{self, RefineError, refine};
use csg::{BodyId, CornerId};

/// The tets of a part. Vertices are those of its skin, in their order, then the interior ones.
#[derive(Clone, Debug, Default)]
pub struct Filled {
    /// The tets, by vertex.
    pub tets: Vec<[u32; 4]>,
    /// The bodies of the tets.
    pub bodies: Vec<BodyId>,
    /// Coordinates of the interior vertices.
    pub inside: Vec<[f64; 3]>,
    /// The error of the volume mesher if the tets are those of the lattice instead.
    pub refused: Option<FillError>,
    /// Why the skin was not remeshed, if that failed.
    pub kept: Option<RemeshError>,
}

/// How tets are improved.
#[derive(Clone, Copy)]
pub struct Improvement<'a> {
    /// The settings.
    pub settings: &'a improve::Settings,
    /// If the tets will be refined, the smoothness of the geometry, because tets with all edges in
    /// one tangent plane would be flattened.
    pub smoothness: Option<&'a dyn Smoothness>,
}

/// Why the interior of a skin cannot be meshed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum FillError {
    /// The skin does not bound a region.
    #[error(transparent)]
    Surface(#[from] SurfaceFaults),
    /// The volume mesher failed.
    #[error(transparent)]
    Volume(#[from] VolumeError),
    /// Interior edges were split, so the part would not conform to its neighbours.
    #[error("{0} prescribed interior edges were split")]
    CutEdges(usize),
}

/// *Local.* Remeshes the `free` faces of a skin by the size field, and fills it; also returns the
/// remeshed skin. Where that fails, or no faces are free, [`fill_or_refine`].
///
/// # Errors
/// [`RefineError`] if the lattice is not valid.
pub fn remesh_and_fill(
    mesh: &DistMesh,
    projector: &Projector,
    (skin, free): (&LatticeSkin, Option<&FreeFaces>),
    size: &dyn SizeField,
    how: Improvement,
) -> Result<(Option<Skin>, Filled), RefineError> {
    let in_remeshed = |free: &FreeFaces| {
        let remeshed = free.remeshed(size)?;
        let filled = fill(&remeshed, size, how)?;
        Ok((remeshed, filled))
    };
    let kept = match free.map(in_remeshed) {
        Some(Ok((remeshed, filled))) => return Ok((Some(remeshed), filled)),
        Some(Err(error)) => Some(error),
        None => None,
    };
    let filled = fill_or_refine(mesh, projector, skin, size, how)?;
    Ok((None, Filled { kept, ..filled }))
}

/// *Local.* [`fill`], or the tets of the lattice if the volume mesher rejects the skin.
///
/// # Errors
/// [`RefineError`] if the lattice is not valid either.
pub fn fill_or_refine(
    mesh: &DistMesh,
    projector: &Projector,
    skin: &LatticeSkin,
    size: &dyn SizeField,
    how: Improvement,
) -> Result<Filled, RefineError> {
    match fill(&skin.skin, size, how) {
        Ok(filled) => Ok(filled),
        Err(refused) => {
            let filled = fill_by_lattice(mesh, projector, skin)?;
            Ok(Filled { refused: Some(refused), ..filled })
        }
    }
}

/// *Local.* Meshes the interior of a skin by a size field and improves the tets.
///
/// # Errors
/// [`FillError`] if the skin is not closed or the volume mesher fails.
pub fn fill(skin: &Skin, size: &dyn SizeField, how: Improvement) -> Result<Filled, FillError> {
    if skin.triangles.is_empty() {
        return Ok(Filled::default());
    }
    let surface = closed(skin)?;
    let (filled, report) = volume::mesh(&surface, size, &volume::Settings::default())?;
    if report.on_kept_edges > 0 {
        return Err(FillError::CutEdges(report.on_kept_edges));
    }
    let patched = |t: &SkinTriangle| {
        let (patch, _) = t.patch?;
        Some(BoundaryTriangle { vertices: t.vertices.map(VertexId), patch })
    };
    // Of the classes only the distinction between fixed and movable vertices matters here.
    let mut classes = vec![Class::Corner(CornerId(0)); skin.points.len()];
    classes.resize(filled.points.len(), Class::Body(BodyId(0)));
    let segment = |&(ends, class): &([u32; 2], Class)| Segment::of_class(ends.map(VertexId), class);
    let mut made = Mesh {
        points: filled.points,
        classes,
        tets: filled.tets.into_iter().map(|t| t.map(VertexId)).collect(),
        bodies: filled.bodies,
        triangles: skin.triangles.iter().filter_map(patched).collect(),
        segments: skin.edges.iter().filter_map(segment).collect(),
    };
    improve::improve_for(&mut made, size, how.smoothness, how.settings);
    Ok(Filled {
        tets: made.tets.into_iter().map(|t| t.map(|v| v.0)).collect(),
        bodies: made.bodies,
        inside: made.points[skin.points.len()..].iter().map(|p| [p.x, p.y, p.z]).collect(),
        refused: None,
        kept: None,
    })
}

/// The surface of a part with its interior vertices and edges. Bodies whose triangles intersect
/// were found to touch before, when the coarse mesh was made.
fn closed(skin: &Skin) -> Result<ClosedSurface, SurfaceFaults> {
    let (on_triangles, inside) = skin.points.split_at(skin.on_triangles);
    let beside: Vec<[Option<BodyId>; 2]> = skin.triangles.iter().map(|t| t.beside).collect();
    let surface = |touching: &Touching| {
        let corners = skin.triangles.iter().map(|t| t.vertices).collect();
        ClosedSurface::of_touching(on_triangles.to_vec(), corners, beside.clone(), touching)
    };
    let loose = skin.loose_edges();
    let can_be_apart = inside.is_empty() && loose.is_empty();
    let bounded = surface(&Touching::default()).or_else(|faults| {
        let mut touching = Touching::default();
        for [a, b] in faults.crossings().filter(|_| can_be_apart) {
            touching.add(beside[a as usize], beside[b as usize]);
        }
        if touching.is_empty() { Err(faults) } else { surface(&touching) }
    })?;
    Ok(bounded.with_kept_points(inside.to_vec()).with_kept_edges(loose))
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
