//! Surfaces of triangles as what is to be meshed.

use super::coarse::{self, Attempt, CoarseError, CoarseMesh};
use super::input::InputSettings;
use crate::Point;
use crate::error::Failure;
use crate::facets::{FacetModel, FacetSize, FacetSmoothness, Facets, keep, remesh};
use crate::geometry::Projector;
use crate::improve::Smoothness;
use crate::io::surface::{self, Surface};
use crate::mesh::{Class, Names};
use crate::size::SizeSettings;
use crate::surface::SurfaceMesh;
use csg::{CornerId, PatchId};
use std::path::Path;

/// Solids bounded by facets, with what their files name.
#[derive(Clone, Debug)]
pub struct FacetSolid {
    /// Bodies, patches, curves and corners.
    pub model: FacetModel,
    /// Numbers and names of the bodies and patches.
    pub names: Names,
    /// Points inside that are to be vertices.
    pub kept_points: Vec<Point>,
    /// Whether the facets themselves are the surface mesh.
    pub keep_surface: bool,
}

impl FacetSolid {
    /// Reads one or several surfaces.
    ///
    /// # Errors
    /// Files that cannot be read, or whose triangles bound no bodies, with the place.
    pub fn read(
        paths: &[impl AsRef<Path>],
        settings: &InputSettings,
        note: &mut dyn FnMut(&str),
    ) -> Result<Self, Failure> {
        let mut surfaces = Vec::new();
        for path in paths {
            let surface = surface::read(path.as_ref()).map_err(Failure::input)?;
            surface.notes.iter().for_each(|text| note(&format!("{}: {text}", path.as_ref().display())));
            surfaces.push(surface);
        }
        let facets: Vec<Facets> = surfaces.iter().map(facets_of).collect();
        let model = FacetModel::new(&facets, &settings.facets).map_err(|error| match paths {
            [path] => Failure::input(format!("{}: {error}", path.as_ref().display())),
            _ => Failure::input(error),
        })?;
        let stems: Vec<String> =
            paths.iter().map(|p| p.as_ref().file_stem().unwrap_or_default().to_string_lossy().into()).collect();
        let names = names(&model, &surfaces, &stems);
        let kept_points = surfaces.into_iter().flat_map(|surface| surface.loose_points).collect();
        Ok(Self { model, names, kept_points, keep_surface: settings.keep_surface })
    }

    /// Projection to patches and curves. Facets that are kept need none: what lies between points of a facet lies on it.
    pub fn projector(&self) -> Projector {
        if self.keep_surface { Projector::Flat } else { self.model.projector.clone().into() }
    }
}

