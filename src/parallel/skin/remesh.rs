//! Remeshing of the faces of a skin on patches by the size field.
//!
//! A refined skin is as fine as the coarse mesh, and its triangles are as narrow: across a strip of
//! a coarse triangle's width there are as many pieces as along its long sides. Only interfaces need
//! the triangles of the lattice, because both ranks must have the same ones. So each rank remeshes
//! the rest of its skin ([`mesher::facets`](crate::mesher::facets)), without messages: all vertices
//! and edges that another rank may have stay, and so do corners and periodic faces. The result is
//! projected to the geometry.

use super::extract::sorted_ends;
use super::free::{Free, NONE};
use super::rim::{AtRim, Rim};
use super::{FillError, Skin, SkinTriangle};
use crate::Point;
use crate::ground::comm::{CommError, Communicator};
use crate::ground::mesh::{Class, GlobalId};
use crate::ground::projector::Projector;
use crate::ground::size::SizeField;
use crate::mesher::facets::{Constraints, FacetModel, RemeshSettings, remesh};
use crate::mesher::surface::SurfaceMesh;
use csg::{PatchId, ProjectionFailed};
use std::collections::HashSet;

/// Rounds of remeshing. The skin is close to what is wanted.
const ROUNDS: usize = 3;

/// The most times that sizes are lowered where remeshed triangles intersect: if that does not help
/// soon, it makes them more.
const CORRECTIONS: usize = 2;

/// Why a skin cannot be remeshed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum RemeshError {
    /// A vertex has no place on the geometry.
    #[error(transparent)]
    Projection(#[from] ProjectionFailed),
    /// The remeshed triangles intersect.
    #[error("{count} pairs of remeshed triangles intersect, one near ({}, {}, {})", at.x, at.y, at.z)]
    Crossing {
        /// The number of intersections.
        count: usize,
        /// The place of one.
        at: Point,
    },
    /// The remeshed skin cannot be filled.
    #[error(transparent)]
    Fill(#[from] FillError),
}

/// The triangles of a skin on patches that may be remeshed, ready for several sizes.
pub struct FreeFaces<'a> {
    free: Free<'a>,
    projector: &'a Projector,
    model: FacetModel,
    constraints: Constraints,
    rim: Rim,
}

impl<'a> FreeFaces<'a> {
    /// *Local.* All triangles of a skin on patches, except on those to `stay`, and those that
    /// another rank may have; `None` if nothing may change.
    pub fn of(skin: &'a Skin, projector: &'a Projector, stay: &HashSet<PatchId>) -> Option<Self> {
        // The faces of a mesh without geometry are its geometry.
        if *projector == Projector::Flat {
            return None;
        }
        let free = Free::of(skin, projector, stay)?;
        let (model, constraints) = free.model();
        let rim = Rim::new(model.bounds, free.rim());
        Some(Self { free, projector, model, constraints, rim })
    }

    /// *Local.* The skin with these triangles remeshed by the size field.
    ///
    /// # Errors
    /// [`RemeshError`] if the result is not valid.
    pub fn remeshed(&self, size: &dyn SizeField) -> Result<Skin, RemeshError> {
        let size = AtRim { base: size, rim: &self.rim };
        let settings =
            RemeshSettings { rounds: ROUNDS, corrections: CORRECTIONS, ..RemeshSettings::default() };
        let how = (&settings, &self.constraints);
        let snap = |surface: &mut SurfaceMesh| self.snap(surface);
        let (surface, report) = remesh(&self.model, &size, how, &snap, &|_| false)?;
        match report.crossings.first() {
            Some(&at) => Err(RemeshError::Crossing { count: report.crossings.len(), at }),
            None => Ok(self.free.replaced(&surface)),
        }
    }

    /// Moves vertices onto the geometry.
    fn snap(&self, surface: &mut SurfaceMesh) -> Result<(), ProjectionFailed> {
        for (point, class) in surface.points.iter_mut().zip(&surface.classes) {
            *point = match self.free.class(*class) {
                Class::Curve(curve) => self.projector.project_curve(curve, point)?,
                Class::Patch(patch) => self.projector.project_patch(patch, point)?,
                Class::Corner(_) | Class::Body(_) => *point,
            };
        }
        Ok(())
    }
}

/// **Collective.** The number of triangles on patches of the whole mesh, if each rank has the
/// second skin in place of the first, which is that of a lattice with `of_lattice` triangles.
/// Triangles that two ranks have are in both skins.
///
/// # Errors
/// [`CommError`] if another rank fails.
pub fn boundary(comm: &dyn Communicator, skins: [&Skin; 2], of_lattice: u64) -> Result<u64, CommError> {
    let on_patches = |skin: &Skin| skin.triangles.iter().filter(|t| t.patch.is_some()).count() as u64;
    let [before, after] = comm.all_reduce_sum_u64(skins.map(on_patches))?;
    Ok(of_lattice + after - before)
}

impl Free<'_> {
    /// The class in the geometry of a class in the model; corners are as they were.
    fn class(&self, class: Class) -> Class {
        match class {
            Class::Curve(piece) => Class::Curve(self.chains[piece.index()].1.of.expect("a free curve")),
            Class::Patch(group) => Class::Patch(self.groups[group.index()].0.0),
            other => other,
        }
    }

    /// The skin with other free triangles.
    fn replaced(&self, surface: &SurfaceMesh) -> Skin {
        let old = self.skin;
        let corners: Vec<u32> = self.corners().collect();
        let added = corners.len()..surface.points.len();
        let goes = |v: &u32| self.vertices.binary_search(v).is_ok() && !self.is_fixed[*v as usize];
        let on: Vec<u32> = (0..old.on_triangles as u32).filter(|v| !goes(v)).collect();
        let inside: Vec<u32> = (old.on_triangles as u32..old.points.len() as u32).collect();
        let mut skin = Skin { on_triangles: on.len() + added.len(), ..Skin::default() };
        skin.push_vertices(old, &on);
        for v in added.clone() {
            // Only shared vertices need their names.
            skin.names.push(GlobalId::MAX);
            skin.points.push(surface.points[v]);
            skin.classes.push(self.class(surface.classes[v]));
        }
        skin.push_vertices(old, &inside);

        let mut places = Places { old: vec![NONE; old.points.len()], new: Vec::new() };
        (0..).zip(&on).for_each(|(new, &v)| places.old[v as usize] = new);
        (skin.on_triangles as u32..).zip(&inside).for_each(|(new, &v)| places.old[v as usize] = new);
        places.new.extend(corners.iter().map(|&v| places.old[v as usize]));
        places.new.extend((on.len() as u32..).take(added.len()));

        for (v, holders) in old.shared.iter() {
            skin.shared.push(places.old[v as usize], holders.iter().copied());
        }
        skin.triangles = self.replaced_triangles(surface, &places);
        skin.edges = self.replaced_edges(surface, &places);
        skin
    }

    /// The triangles that stay, and the remeshed ones.
    fn replaced_triangles(&self, surface: &SurfaceMesh, places: &Places) -> Vec<SkinTriangle> {
        let kept = self.skin.triangles.iter().zip(&self.is_free).filter(|(_, free)| !**free).map(|(t, _)| *t);
        let kept = kept.map(|t| SkinTriangle { vertices: t.vertices.map(|v| places.old[v as usize]), ..t });
        let new = surface.triangles.iter().map(|t| {
            let (patch, beside) = self.groups[t.patch.index()];
            SkinTriangle { vertices: t.vertices.map(|v| places.new[v.index()]), beside, patch: Some(patch) }
        });
        kept.chain(new).collect()
    }

    /// The edges that stay, and those on remeshed curves.
    fn replaced_edges(&self, surface: &SurfaceMesh, places: &Places) -> Vec<([u32; 2], Class)> {
        let kept = self.skin.edges.iter().filter_map(|&(ends, class)| {
            let placed = ends.map(|v| places.old[v as usize]);
            let stays = !placed.contains(&NONE) && self.sides.binary_search(&sorted_ends(ends)).is_err();
            stays.then_some((placed, class))
        });
        let new = surface.segments.iter().filter_map(|segment| {
            let piece = &self.chains[segment.curve.index()].1;
            let curve = piece.of.filter(|_| !piece.is_fixed)?;
            Some((segment.vertices.map(|v| places.new[v.index()]), Class::Curve(curve)))
        });
        kept.chain(new).collect()
    }
}

/// Where vertices are in a remeshed skin.
struct Places {
    /// The place of each vertex of the skin before; [`NONE`] if it is gone.
    old: Vec<u32>,
    /// The place of each vertex of the remeshed triangles.
    new: Vec<u32>,
}

impl Skin {
    /// Appends vertices of another skin, without their holders.
    fn push_vertices(&mut self, other: &Self, vertices: &[u32]) {
        self.names.extend(vertices.iter().map(|&v| other.names[v as usize]));
        self.points.extend(vertices.iter().map(|&v| other.points[v as usize]));
        self.classes.extend(vertices.iter().map(|&v| other.classes[v as usize]));
    }
}
