//! The model: any kind of input of the mesher.

use super::coarse::{CoarseError, CoarseMesh, CoarseReport, CoarseSettings};
use super::facet_model::FacetSolid;
use super::retries::Budget;
use crate::ground::mesh::QualitySummary;
use crate::ground::mesh::periodic::Link;
use crate::ground::mesh::{Mesh, Names};
use crate::ground::progress::Work;
use crate::ground::projector::Projector;
use crate::ground::size::{GeometricSize, SizeField, SizeSettings};
use crate::mesher::facets::FacetSize;
use crate::mesher::model::CsgModel;
use csg::Geometry;

/// The input of the mesher.
#[derive(Clone, Debug)]
pub enum Model {
    /// Solids of analytic surfaces.
    Csg(Box<CsgModel>),
    /// Solids bounded by triangles.
    Facets(Box<FacetSolid>),
    /// An existing mesh without geometry.
    Given(Box<GivenMesh>),
}

/// An existing coarse mesh; its boundary faces are its only geometry.
#[derive(Clone, Debug)]
pub struct GivenMesh {
    /// The mesh.
    pub mesh: Mesh,
    /// Numbers and names of its bodies and boundaries.
    pub names: Names,
    /// Its patches that are periodic copies of others.
    pub links: Vec<Link>,
}

/// Number of entities of a geometry.
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
    /// A geometry that cannot be meshed, with the location.
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

    /// Number of its entities.
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

    /// The size field of the first coarse mesh, before sizes are lowered; `None` for an existing
    /// mesh.
    pub(super) fn size_field(&self, settings: &SizeSettings) -> Option<Box<dyn SizeField + '_>> {
        match self {
            Self::Csg(model) => {
                Some(Box::new(GeometricSize::new(&model.geometry, &model.features, settings)))
            }
            Self::Facets(solid) => Some(Box::new(FacetSize::new(&solid.model, settings))),
            Self::Given(_) => None,
        }
    }

    /// Makes a coarse mesh with the given sizes, see [`coarse::mesh`](super::coarse::mesh). An
    /// existing mesh is used unchanged.
    ///
    /// # Errors
    /// The last failure, with its location.
    pub fn coarse_mesh(
        &self,
        settings: &mut CoarseSettings,
        budget: &Budget,
        work: &Work,
    ) -> Result<CoarseMesh, CoarseError> {
        match self {
            Self::Csg(model) => super::coarse::mesh(model, settings, budget, work),
            Self::Facets(solid) => solid.coarse_mesh(settings, budget, work),
            Self::Given(given) => Ok(given.coarse_mesh()),
        }
    }
}

impl GivenMesh {
    fn entities(&self) -> Entities {
        use crate::ground::mesh::Class;
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
