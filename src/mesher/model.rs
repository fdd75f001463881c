//! A CSG geometry with its features and its projector.

use crate::Point;
use csg::features::{CutCusp, find_and_cut_cusps};
use csg::{Features, Geometry, SurfaceId};

/// A geometry with its features, ready for meshing.
#[derive(Clone, Debug)]
pub struct CsgModel {
    /// The parsed geometry.
    pub geometry: Geometry,
    /// Its corners, curves and patches.
    pub features: Features,
    /// Projection onto patches, curves and corners.
    pub projector: csg::Projector,
    /// The parts of bodies that were left out because they have no angle.
    pub cut_cusps: Vec<CutCusp>,
}

impl CsgModel {
    /// Finds the features of a geometry.
    ///
    /// # Errors
    /// [`csg::FeatureError`] with a position, if the geometry has features that cannot be meshed.
    pub fn new(mut geometry: Geometry) -> Result<Self, csg::FeatureError> {
        let (features, cut_cusps) = find_and_cut_cusps(&mut geometry)?;
        let projector = csg::Projector::new(&geometry, &features);
        Ok(Self { geometry, features, projector, cut_cusps })
    }

    /// Whether a point is in a body.
    pub(crate) fn contains(&self, point: &Point) -> bool {
        let positive = |surface: SurfaceId| self.geometry.surfaces[surface.index()].value(point) > 0.0;
        self.geometry.bodies.iter().any(|body| body.solid.contains(&positive))
    }
}
