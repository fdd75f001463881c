//! The input of the mesher.

use super::error::{Error, InputError};
use super::facet_model::FacetSolid;
use super::input;
use super::inspect::Inspection;
use super::model::{Entities, Model};
use super::options;
use super::settings::InputSettings;
use crate::files::arrays::{MeshArrays, SurfaceArrays};
use crate::files::{surface, volume};
use crate::ground::mesh::Names;
use std::path::Path;
use std::str::FromStr;

/// The input of the mesher: solids of analytic surfaces, solids bounded by triangles, or an
/// existing tetrahedral mesh.
///
/// A geometry consists of **bodies**, which are meshed, **patches** between and around them,
/// **curves** where patches meet, and **corners** where curves end.
#[derive(Clone, Debug)]
pub struct Geometry {
    pub(crate) model: Model,
    notes: Vec<String>,
}

impl From<Model> for Geometry {
    fn from(model: Model) -> Self {
        Self { model, notes: Vec::new() }
    }
}

/// Reads the text of a geometry, not a path: see [`Geometry::from_text`].
impl FromStr for Geometry {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self, Error> {
        Self::from_text(text)
    }
}

impl Geometry {
    /// Reads a file: a geometry (`.geo`, `.brep`), triangles (`.stl`, `.off`, `.obj`, `.ply`,
    /// `.poly`, `.smesh`), or a mesh (`.msh`, `.vol`, `.mesh`, `.meshb`, `.vtu`, `.pvtu`, `.ele`,
    /// the folder of an Elmer mesh).
    ///
    /// # Errors
    /// A file that cannot be read or meshed, with the location.
    pub fn from_file(path: impl AsRef<Path>) -> Result<Self, Error> {
        Self::from_files(&[path], &InputSettings::default())
    }

    /// Reads one file, several surfaces, each of which becomes a body, or several CAD files.
    ///
    /// # Errors
    /// Those of [`from_file`](Self::from_file), or several files that are not all surfaces or all
    /// CAD files.
    pub fn from_files(paths: &[impl AsRef<Path>], settings: &InputSettings) -> Result<Self, Error> {
        Self::read(paths, settings, &mut |_| ())
    }

    /// [`from_files`](Self::from_files), which passes each note on as it arises: those before an
    /// error too.
    ///
    /// # Errors
    /// Those of [`from_files`](Self::from_files).
    pub fn read(
        paths: &[impl AsRef<Path>],
        settings: &InputSettings,
        note: &mut dyn FnMut(&str),
    ) -> Result<Self, Error> {
        let mut notes = Vec::new();
        let mut keep = |text: &str| {
            note(text);
            notes.push(text.to_owned());
        };
        options::refuse_impossible_input(settings)?;
        let model = input::read(paths, settings, &mut keep)?;
        Ok(Self { model, notes })
    }

    /// Reads the text of a geometry in NETGEN's CSG language.
    ///
    /// # Errors
    /// Syntax errors, and geometries that cannot be meshed, with the location.
    pub fn from_text(text: &str) -> Result<Self, Error> {
        let parsed = csg::language::parse_geometry(text, "geometry")?;
        let mut notes: Vec<String> = parsed.warnings.iter().map(ToString::to_string).collect();
        let Self { model, notes: of_features } = Self::from_csg(parsed.geometry)?;
        notes.extend(of_features);
        Ok(Self { model, notes })
    }

    /// Takes a geometry built by the program.
    ///
    /// # Errors
    /// A geometry that cannot be meshed, with the location.
    pub fn from_csg(geometry: csg::Geometry) -> Result<Self, Error> {
        let model = Model::from_csg(geometry)?;
        let notes = model.cut_cusps().iter().map(ToString::to_string).collect();
        Ok(Self { model, notes })
    }

    /// Takes closed triangulated surfaces.
    ///
    /// # Errors
    /// Inconsistent arrays, and triangles that do not bound bodies, with the location.
    pub fn from_surface(surface: &SurfaceArrays, settings: &InputSettings) -> Result<Self, Error> {
        options::refuse_impossible_input(settings)?;
        let mut surface = surface::of_arrays(surface).map_err(InputError::from)?;
        let notes = std::mem::take(&mut surface.notes);
        let solid = FacetSolid::of(vec![surface], &["body".to_owned()], settings)?;
        Ok(Self { model: Model::Facets(Box::new(solid)), notes })
    }

    /// Takes an existing tetrahedral mesh, which can be partitioned and refined; its boundary faces
    /// stay flat.
    ///
    /// # Errors
    /// Inconsistent arrays, faces of more than two tets, inverted tets.
    pub fn from_mesh(mesh: &MeshArrays) -> Result<Self, Error> {
        let mut mesh = volume::of_arrays(mesh).map_err(InputError::from)?;
        let notes = std::mem::take(&mut mesh.notes);
        Ok(Self { model: input::given(mesh, None)?, notes })
    }

    /// Repairs, additions and omissions while reading, one sentence each.
    pub fn notes(&self) -> &[String] {
        &self.notes
    }

    /// Numbers and names of the bodies and patches.
    pub fn names(&self) -> Names {
        self.model.names()
    }

    /// Number of bodies, patches, curves and corners.
    pub fn entities(&self) -> Entities {
        self.model.entities()
    }

    /// Whether it is an existing tetrahedral mesh.
    pub fn is_mesh(&self) -> bool {
        matches!(self.model, Model::Given(_))
    }

    /// The smallest element size that its coordinates resolve (length); `None` for a tetrahedral
    /// mesh.
    pub fn least_size(&self) -> Option<f64> {
        self.model.least_size()
    }

    /// Its bodies, patches, curves and corners in detail; `None` for a tetrahedral mesh.
    pub fn inspect(&self) -> Option<Inspection> {
        match &self.model {
            Model::Csg(model) => Some(Inspection::of_csg(model)),
            Model::Facets(solid) => Some(Inspection::of_facets(solid)),
            Model::Given(_) => None,
        }
    }
}
