//! The size field of a geometry and a user's settings.

use super::{Closeness, Evaluation, GeometricSamples, GradedSize, Preset, SizeField, SizeFunction, Source};
use crate::Point;
use csg::{BodyId, Features, Geometry, Solid};

/// The user's settings of the size field.
#[derive(Clone, Debug)]
pub struct SizeSettings {
    /// Upper bound everywhere (length), if any.
    pub maxh: Option<f64>,
    /// Lower bound of the sizes from curvature, short curves and grading (length).
    pub minh: f64,
    /// Elements per radius of curvature.
    pub curvature_safety: f64,
    /// The minimum number of segments of a curve.
    pub segments_per_curve: f64,
    /// Growth of the size per unit of distance.
    pub grading: f64,
    /// How far sizes are lowered in thin regions.
    pub closeness: Closeness,
    /// The factor of all sizes, used to reach a target number of tets.
    ///
    /// The bounds `maxh` are multiplied only by factors below 1.
    pub scale: f64,
    /// Further sources, which `scale` does not change.
    pub sources: Vec<Source>,
    /// A further upper bound by position, if any.
    pub function: Option<SizeFunction>,
}

/// The largest size in thin regions that a scale leads to, in units of the thickness: that of one
/// layer of prisms with a smallest dihedral angle of 15° (see [`Preset::closeness`]). Without it,
/// the walls of coarse meshes nearly touch: the heat exchanger of
/// `benches/results/coarser-2026-11-23.md` had angles of 0.3° for two thirds of the tets.
const FLATTEST: f64 = 4.3;

impl From<Preset> for SizeSettings {
    fn from(preset: Preset) -> Self {
        Self {
            maxh: None,
            minh: 0.0,
            curvature_safety: preset.curvature_safety(),
            segments_per_curve: preset.segments_per_curve(),
            grading: preset.grading(),
            closeness: preset.closeness(),
            scale: 1.0,
            sources: Vec::new(),
            function: None,
        }
    }
}

impl Default for SizeSettings {
    fn default() -> Self {
        Preset::default().into()
    }
}

impl SizeSettings {
    /// How far sizes are lowered in thin regions, under [`scale`](Self::scale).
    ///
    /// With a scale above 1, thin regions get fewer tets too, up to a fixed limit; with a scale
    /// below 1, they do not need more.
    pub fn scaled_closeness(&self) -> Closeness {
        let (Closeness { ratio, most }, scale) = (self.closeness, self.scale.max(1.0));
        Closeness { ratio: ratio.max((ratio * scale).min(FLATTEST)), most: most * scale }
    }

    /// The largest size in a body with a bound in the file, or without one.
    pub(crate) fn bound_of(&self, body: Option<f64>) -> f64 {
        self.scaled_bound(self.maxh.unwrap_or(f64::INFINITY).min(body.unwrap_or(f64::INFINITY)))
    }

    /// A bound by the user or the file, under [`scale`](Self::scale).
    pub(super) fn scaled_bound(&self, bound: f64) -> f64 {
        bound * self.scale.min(1.0)
    }
}

/// Sizes from the bounds in the file, curvature, short curves and the user's settings.
#[derive(Clone, Debug)]
pub struct GeometricSize<'a> {
    geometry: &'a Geometry,
    graded: GradedSize,
    /// Bodies with a bound of their own.
    body_bounds: Vec<(BodyId, f64)>,
    function: Option<SizeFunction>,
}

impl<'a> GeometricSize<'a> {
    /// Samples curves and patches and builds the field.
    pub fn new(geometry: &'a Geometry, features: &Features, settings: &SizeSettings) -> Self {
        Self::evaluated(geometry, features, settings, Evaluation::Fine)
    }

    /// [`new`](Self::new), evaluated as needed.
    pub(crate) fn evaluated(
        geometry: &'a Geometry,
        features: &Features,
        settings: &SizeSettings,
        evaluation: Evaluation,
    ) -> Self {
        let roughness = evaluation.roughness();
        let samples = GeometricSamples::with_roughness(geometry, features, settings, roughness);
        Self::of(geometry, features, settings, &samples, evaluation)
    }

    /// Builds the field from samples that were taken with the same settings, except for their
    /// sources.
    pub fn of_samples(
        geometry: &'a Geometry,
        features: &Features,
        settings: &SizeSettings,
        samples: &GeometricSamples,
    ) -> Self {
        Self::of(geometry, features, settings, samples, Evaluation::Fine)
    }

    fn of(
        geometry: &'a Geometry,
        features: &Features,
        settings: &SizeSettings,
        samples: &GeometricSamples,
        evaluation: Evaluation,
    ) -> Self {
        let sources = [&*settings.sources, &*samples.sources].concat();
        let graded =
            GradedSize::new(features.bounds, settings.grading, samples.maximum, &sources, evaluation);
        Self {
            geometry,
            graded,
            body_bounds: samples.body_bounds.clone(),
            function: settings.function.clone(),
        }
    }
}

impl SizeField for GeometricSize<'_> {
    fn size_at(&self, point: &Point) -> f64 {
        let inside =
            |body: &BodyId| contains(self.geometry, &self.geometry.bodies[body.index()].solid, point);
        let size = self.graded.size_at(point);
        let size = self.function.as_ref().map_or(size, |function| function.bound(size, point));
        self.body_bounds
            .iter()
            .filter(|(body, bound)| *bound < size && inside(body))
            .fold(size, |size, (_, bound)| size.min(*bound))
    }
}

pub(super) fn contains(geometry: &Geometry, solid: &Solid, point: &Point) -> bool {
    solid.contains(&|surface| geometry.surfaces[surface.index()].value(point) > 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn small_spheres_and_the_walls_of_deep_holes_have_sizes_of_their_curvature() {
        let text = "algebraic3d
            solid plate = orthobrick (0, 0, 0; 1, 1, 0.1);
            solid ball = sphere (0.5, 0.5, 0; 0.001);
            solid hole = cylinder (0.2, 0.3, 0; 0.2, 0.3, 1; 0.002);
            solid main = plate and not ball and not hole;
            tlo main;";
        let geometry = csg::language::parse_geometry(text, "small.geo").unwrap().geometry;
        let features = Features::find(&geometry).unwrap();
        for scale in [1.0, 0.15] {
            let settings = SizeSettings { scale, ..SizeSettings::default() };
            let size = GeometricSize::new(&geometry, &features, &settings);
            let of_radius = |radius: f64| scale * radius / settings.curvature_safety;
            for (place, radius) in [([0.5, 0.5, 0.001], 0.001), ([0.2, 0.302, 0.05], 0.002)] {
                let found = size.size_at(&Point::from(place)) / of_radius(radius);
                assert!((0.9..1.3).contains(&found), "{found} of the size, scale {scale}, at {place:?}");
            }
        }
    }

    #[test]
    fn a_scale_coarsens_thin_regions_up_to_one_layer_of_good_prisms() {
        let at = |ratio: f64, scale: f64| {
            let closeness = Closeness { ratio, most: 8.0 };
            SizeSettings { closeness, scale, ..SizeSettings::default() }.scaled_closeness()
        };
        assert_eq!(at(2.0, 0.5), Closeness { ratio: 2.0, most: 8.0 });
        assert_eq!(at(2.0, 1.5), Closeness { ratio: 3.0, most: 12.0 });
        assert_eq!(at(2.0, 100.0).ratio, FLATTEST);
        assert_eq!(at(6.0, 100.0).ratio, 6.0, "a larger ratio was requested");
        assert_eq!(at(f64::INFINITY, 100.0).ratio, f64::INFINITY);
        let prism = (2.0 / (3.0_f64.sqrt() * FLATTEST)).atan().to_degrees();
        assert!((14.9..15.1).contains(&prism), "{prism}°");
    }
}
