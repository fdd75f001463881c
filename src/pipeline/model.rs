//! The model: any kind of input of the mesher.

use super::coarse::{self, CoarseSettings};
use super::coarse_error::CoarseError;
use super::coarse_mesh::{CoarseMesh, CoarseReport};
use super::expected;
use super::facet_model::FacetSolid;
use super::retries::Budget;
use crate::Point;
use crate::ground::kernel::random::Random;
use crate::ground::mesh::QualitySummary;
use crate::ground::mesh::periodic::Link;
use crate::ground::mesh::{Mesh, Names};
use crate::ground::progress::Work;
use crate::ground::projector::Projector;
use crate::ground::size::{Evaluation, GeometricSize, LEAST_SIZE, SizeField, SizeSettings};
use crate::mesher::model::CsgModel;
use csg::{Aabb, Geometry, SurfaceId};

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

    /// The cusps without angle that were cut off its bodies.
    pub fn cut_cusps(&self) -> &[csg::features::CutCusp] {
        match self {
            Self::Csg(model) => &model.cut_cusps,
            Self::Facets(_) | Self::Given(_) => &[],
        }
    }

    /// Projection to its patches and curves.
    pub fn projector(&self) -> Projector {
        match self {
            Self::Csg(model) => model.projector.clone().into(),
            Self::Facets(solid) => solid.projector(),
            Self::Given(_) => Projector::Flat,
        }
    }

    /// Whether it has surfaces that its meshes approximate. Otherwise its projector is
    /// [`Projector::Flat`]: the faces of the given mesh are the surface.
    pub fn has_surfaces(&self) -> bool {
        match self {
            Self::Csg(_) => true,
            Self::Facets(solid) => !solid.keep_surface,
            Self::Given(_) => false,
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

    /// The box around a geometry; `None` for an existing mesh.
    fn extent(&self) -> Option<&Aabb> {
        match self {
            Self::Csg(model) => Some(&model.features.bounds),
            Self::Facets(solid) => Some(&solid.model.bounds),
            Self::Given(_) => None,
        }
    }

    /// The smallest size that coordinates resolve; `None` for an existing mesh.
    pub(super) fn least_size(&self) -> Option<f64> {
        self.extent().map(|bounds| LEAST_SIZE * bounds.diagonal())
    }

    /// A lower estimate of the number of coarse tets for the upper bounds of the sizes alone,
    /// without curvature and sources; and the least of these bounds.
    pub(super) fn least_tets(&self, settings: &SizeSettings) -> (f64, f64) {
        /// Largest mean volume of tets of edge length 1: twice that of the regular tet.
        const LARGEST: f64 = 0.24;
        let Some(extent) = self.extent() else { return (0.0, f64::INFINITY) };
        let of_body = |body: &csg::Body| settings.bound_of(body.maxh);
        let bounds: Vec<f64> = match self {
            Self::Csg(model) => model.geometry.bodies.iter().map(of_body).collect(),
            _ => vec![settings.bound_of(None)],
        };
        let least = bounds.iter().copied().fold(f64::INFINITY, f64::min);
        // Volumes take some time: none is larger than that of the box.
        if (extent.max - extent.min).product() < ALWAYS_FEW * LARGEST * least.powi(3) {
            return (0.0, least);
        }
        let volumes = match self {
            Self::Csg(model) => sampled_volumes(model),
            Self::Facets(solid) => vec![solid.volume()],
            Self::Given(_) => Vec::new(),
        };
        let tets = volumes.iter().zip(&bounds).map(|(volume, h)| volume / (LARGEST * h.powi(3)));
        (tets.sum(), least)
    }

    /// The size field of the first coarse mesh, before sizes are lowered; `None` for an existing
    /// mesh.
    pub(super) fn size_field(
        &self,
        settings: &SizeSettings,
        evaluation: Evaluation,
    ) -> Option<Box<dyn SizeField + '_>> {
        match self {
            Self::Csg(model) => {
                let CsgModel { geometry, features, .. } = &**model;
                Some(Box::new(GeometricSize::evaluated(geometry, features, settings, evaluation)))
            }
            Self::Facets(solid) => Some(Box::new(solid.size_field(settings, evaluation))),
            Self::Given(_) => None,
        }
    }

    /// The number of coarse tets that the sizes let expect, 0 if there are few; `None` for an
    /// existing mesh.
    pub(super) fn expected_tets(&self, settings: &SizeSettings) -> Option<f64> {
        let size = self.size_field(settings, Evaluation::Rough)?;
        match self {
            Self::Csg(model) => Some(coarse::expected_tets(model, &*size, expected::FEW)),
            Self::Facets(solid) => Some(solid.expected_tets(&*size, expected::FEW)),
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
            Self::Csg(model) => coarse::mesh(model, settings, budget, work),
            Self::Facets(solid) => solid.coarse_mesh(settings, budget, work),
            Self::Given(given) => Ok(given.coarse_mesh()),
        }
    }
}

/// So many coarse tets fit any machine.
const ALWAYS_FEW: f64 = 1e6;

/// Volumes of the bodies, by random points in their common box: small bodies may be missed.
fn sampled_volumes(CsgModel { geometry, features, .. }: &CsgModel) -> Vec<f64> {
    const SAMPLES: usize = 2000;
    let Aabb { min, max } = features.bounds;
    let mut random = Random::new(1);
    let mut volumes = vec![0.0; geometry.bodies.len()];
    for _ in 0..SAMPLES {
        let point = Point::from((max - min).map(|width| width * random.unit()) + min.coords);
        let positive = |surface: SurfaceId| geometry.surfaces[surface.index()].value(&point) > 0.0;
        if let Some(body) = geometry.bodies.iter().position(|body| body.solid.contains(&positive)) {
            volumes[body] += (max - min).product() / SAMPLES as f64;
        }
    }
    volumes
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
