//! What is to be meshed.

use super::coarse::{CoarseError, CoarseMesh, CoarseReport, CoarseSettings};
use super::facet_model::FacetSolid;
use crate::facets::FacetSize;
use crate::geometry::Projector;
use crate::kernel::quality::QualitySummary;
use crate::mesh::{Mesh, Names};
use crate::periodic::Link;
use crate::size::{GeometricSize, SizeField, SizeSettings};
use csg::{Features, Geometry};

/// What is to be meshed, or came meshed.
#[derive(Clone, Debug)]
pub enum Model {
    /// Solids of surfaces.
    Csg(Box<CsgModel>),
    /// Solids of triangles.
    Facets(Box<FacetSolid>),
    /// A mesh that came without its geometry.
    Given(Box<GivenMesh>),
}

/// A geometry with everything that was found out about it.
#[derive(Clone, Debug)]
pub struct CsgModel {
    /// What the file says.
    pub geometry: Geometry,
    /// Its corners, curves and patches.
    pub features: Features,
    /// Projection to them.
    pub projector: csg::Projector,
}

impl CsgModel {
    /// Finds the features of a geometry.
    ///
    /// # Errors
    /// What cannot be meshed, with its place.
    pub fn new(geometry: Geometry) -> Result<Self, csg::FeatureError> {
        let features = Features::find(&geometry)?;
        let projector = csg::Projector::new(&geometry, &features);
        Ok(Self { geometry, features, projector })
    }
}

/// A coarse mesh as it came: its boundary is all that is known of its geometry.
#[derive(Clone, Debug)]
pub struct GivenMesh {
    /// The mesh.
    pub mesh: Mesh,
    /// Numbers and names of its bodies and boundaries.
    pub names: Names,
    /// Its patches that are periodic images of others.
    pub links: Vec<Link>,
}

/// How many entities a geometry has.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct Entities {
    /// Bodies.
    pub bodies: usize,
    /// Corners.
    pub corners: usize,
    /// Curves.
    pub curves: usize,
    /// Patches.
    pub patches: usize,
}

impl Model {
    /// Finds the features of a geometry.
    ///
    /// # Errors
    /// What cannot be meshed, with its place.
    pub fn from_csg(geometry: Geometry) -> Result<Self, csg::FeatureError> {
        Ok(Self::Csg(Box::new(CsgModel::new(geometry)?)))
    }

    /// Projection to its patches and curves.
    pub fn projector(&self) -> Projector {
        match self {
            Self::Csg(model) => model.projector.clone().into(),
            Self::Facets(solid) => solid.projector(),
            Self::Given(_) => Projector::Flat,
        }
    }

    /// Numbers and names of its bodies and boundaries.
    pub fn names(&self) -> Names {
        match self {
            Self::Csg(model) => super::names(&model.geometry, &model.features),
            Self::Facets(solid) => solid.names.clone(),
            Self::Given(given) => given.names.clone(),
        }
    }

    /// How many entities it has.
    pub fn entities(&self) -> Entities {
        match self {
            Self::Csg(model) => Entities {
                bodies: model.geometry.bodies.len(),
                corners: model.features.corners.len(),
                curves: model.features.curves.len(),
                patches: model.features.patches.len(),
            },
            Self::Facets(solid) => Entities {
                bodies: solid.model.bodies.len(),
                corners: solid.model.corners.len(),
                curves: solid.model.curves.len(),
                patches: solid.model.patches.len(),
            },
            Self::Given(given) => given.entities(),
        }
    }

    /// The sizes that a coarse mesh is made by, before they are lowered anywhere; `None` of a given mesh.
    pub(super) fn size_field(&self, settings: &SizeSettings) -> Option<Box<dyn SizeField + '_>> {
        match self {
            Self::Csg(model) => {
                Some(Box::new(GeometricSize::new(&model.geometry, &model.features, settings)))
            }
            Self::Facets(solid) => Some(Box::new(FacetSize::new(&solid.model, settings))),
            Self::Given(_) => None,
        }
    }

    /// Makes a coarse mesh with the given sizes; see [`coarse::mesh`](super::coarse::mesh). A given mesh is taken as it is.
    ///
    /// # Errors
    /// What failed in the end, with its place.
    pub fn coarse_mesh(&self, settings: &mut CoarseSettings) -> Result<CoarseMesh, CoarseError> {
        match self {
            Self::Csg(model) => super::coarse::mesh(model, settings),
            Self::Facets(solid) => solid.coarse_mesh(settings),
            Self::Given(given) => Ok(given.coarse_mesh()),
        }
    }
}

impl GivenMesh {
    fn entities(&self) -> Entities {
        use crate::mesh::Class;
        let corners = self.mesh.classes.iter().filter(|class| matches!(class, Class::Corner(_))).count();
        let curves = self.mesh.segments.iter().map(|s| s.curve.index() + 1).max().unwrap_or(0);
        let Names { bodies, patches } = &self.names;
        Entities { bodies: bodies.len(), corners, curves, patches: patches.len() }
    }

    fn coarse_mesh(&self) -> CoarseMesh {
        let mesh = self.mesh.clone();
        let report = CoarseReport {
            vertices: mesh.points.len() as u64,
            tets: mesh.tets.len() as u64,
            boundary: mesh.triangles.len() as u64,
            segments: mesh.segments.len() as u64,
            quality: QualitySummary::of(&mesh),
            ..CoarseReport::default()
        };
        CoarseMesh { mesh, report, ..CoarseMesh::default() }
    }
}
