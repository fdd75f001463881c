//! Makes one classified, refinable tetrahedral mesh of a geometry, on one rank.

use super::close::{self, CloseSurfaces, TooClose};
use super::coarse_error::CoarseError;
use super::coarse_mesh::{CoarseMesh, CutCusp};
use super::expected;
use super::fill::{Improvement, SURFACE_SHARE, fill};
use super::retries::{Budget, CORRECTIONS, Once};
use crate::Point;
use crate::ground::mesh::{Order, Segment, Touching};
use crate::ground::progress::Work;
use crate::ground::size::{GeometricSamples, GeometricSize, SizeField, SizeSettings, Source};
use crate::ground::size::{PeriodicSize, WatchedSize};
use crate::mesher::improve::{Effort, GeometrySmoothness};
use crate::mesher::model::CsgModel;
use crate::mesher::surface::closeness::{ThinRegions, Walls, thin_regions};
use crate::mesher::surface::curves::{crowded, mesh_curves};
use crate::mesher::surface::narrow::narrow;
use crate::mesher::surface::{self, SurfaceError, SurfaceMesh};
use csg::features::{Named, Place};

/// How a coarse mesh is made.
#[derive(Clone, Debug, Default)]
pub struct CoarseSettings {
    /// The element sizes.
    pub size: SizeSettings,
    /// Effort for the shapes of tets; if `None`, the careful one up to a second of work, else the
    /// standard one.
    pub effort: Option<Effort>,
    /// The order of the elements of the mesh that is refined from it.
    pub order: Order,
    /// Whether the mesh stays as it is. Tets that refinement or curved edges would flatten are not
    /// repaired then, for the sake of better shapes. [`generate`](super::generate()) sets it.
    pub is_final: bool,
}

impl From<SizeSettings> for CoarseSettings {
    fn from(size: SizeSettings) -> Self {
        Self { size, ..Self::default() }
    }
}

/// The size field of the first attempt, which further attempts lower.
struct Initial<'a> {
    samples: GeometricSamples,
    size: GeometricSize<'a>,
    /// The number of sources in the settings, and the grading.
    made_with: (usize, f64),
}

impl<'a> Initial<'a> {
    fn new(model: &'a CsgModel, settings: &SizeSettings) -> Self {
        let CsgModel { geometry, features, .. } = model;
        let samples = GeometricSamples::new(geometry, features, settings);
        let size = GeometricSize::of_samples(geometry, features, settings, &samples);
        Self { samples, size, made_with: (settings.sources.len(), settings.grading) }
    }

    /// The size field under settings that differ at most by corrections; `None` if it is this one.
    fn lowered(&self, model: &'a CsgModel, settings: &SizeSettings) -> Option<GeometricSize<'a>> {
        let CsgModel { geometry, features, .. } = model;
        ((settings.sources.len(), settings.grading) != self.made_with)
            .then(|| GeometricSize::of_samples(geometry, features, settings, &self.samples))
    }
}

/// Makes a coarse mesh with the given sizes. Where it fails for lack of room between curves or
/// surfaces, the sizes are lowered and the mesh is made again; `settings` keeps the new sources.
///
/// # Errors
/// The last failure, with its location.
pub fn mesh(
    model: &CsgModel,
    settings: &mut CoarseSettings,
    budget: &Budget,
    work: &Work,
) -> Result<CoarseMesh, CoarseError> {
    let initial = Initial::new(model, &settings.size);
    budget.warn(Once::Walls, || close::warning(model, &initial.samples), work);
    let mut coarse = corrected(settings, budget, work, |settings, allowed| {
        attempt(model, &initial, settings, allowed, (budget, work))
    })?;
    coarse.report.cut_cusps = CutCusp::of(model);
    Ok(coarse)
}

/// The result of one attempt at a coarse mesh.
pub(super) enum Attempt {
    Made(Box<CoarseMesh>),
    /// Thin regions were found: sources for those that can be resolved.
    Thin(Vec<Source>, ThinRegions),
    /// Smaller sizes are needed.
    Lower(Vec<Source>),
    Failed(CoarseError),
}

/// What an attempt may return instead of a mesh.
#[derive(Clone, Copy)]
pub(super) struct Allowed {
    /// A request for smaller sizes.
    pub lower: bool,
    /// Thin regions: only in the first attempt, because each time may lower the sizes as far as the
    /// settings allow.
    pub thin: bool,
}

/// The largest growth of the size per unit of distance in a geometry with thin regions.
///
/// Two independent triangulations bound a layer of tets, so the triangles on both sides must be of
/// nearly the same size. A heat exchanger with tubes of a tenth of their radius and sizes of 2.2
/// thicknesses has a smallest dihedral angle of 11.6° with a growth of 0.7 and of 15.1° with 0.4
/// (`benches/results/coarser-2026-11-23.md`).
const THIN_GRADING: f64 = 0.4;

/// Repeats `attempt` until no sizes need to be lowered, or none may be.
pub(super) fn corrected(
    settings: &mut CoarseSettings,
    budget: &Budget,
    work: &Work,
    attempt: impl Fn(&CoarseSettings, Allowed) -> Attempt,
) -> Result<CoarseMesh, CoarseError> {
    let mut corrections = 0;
    let mut thin_regions = None;
    loop {
        work.proceed()?;
        budget.spend();
        let lower = corrections < CORRECTIONS && budget.has_meshes();
        let allowed = Allowed { lower, thin: thin_regions.is_none() };
        match attempt(settings, allowed) {
            Attempt::Made(mut coarse) => {
                budget.made(coarse.report.tets);
                coarse.report.size_corrections = corrections;
                coarse.report.thin_regions = thin_regions.unwrap_or_default();
                return Ok(*coarse);
            }
            Attempt::Thin(sources, found) => {
                if !sources.is_empty() {
                    settings.size.grading = settings.size.grading.min(THIN_GRADING);
                }
                settings.size.sources.extend(sources);
                thin_regions = Some(found);
            }
            Attempt::Lower(sources) => {
                settings.size.sources.extend(sources);
                corrections += 1;
            }
            Attempt::Failed(error) => return Err(error),
        }
    }
}

/// Why there is no surface mesh, or none that can be filled.
pub(super) enum Unmeshed {
    /// Smaller sizes are needed, because of a very narrow gap if one is given.
    Lower(Vec<Source>, Option<Box<CloseSurfaces>>),
    Failed(CoarseError),
}

impl Unmeshed {
    /// Lowers the sizes after an error if that is allowed and may help; `segments` are the ends of
    /// those on curves.
    fn of(error: CoarseError, segments: &[[Point; 2]], size: &dyn SizeField, may_lower: bool) -> Self {
        let lower = if may_lower { error.remedy(segments, size) } else { Vec::new() };
        if lower.is_empty() { Self::Failed(error) } else { Self::Lower(lower, None) }
    }
}

impl From<Unmeshed> for Attempt {
    fn from(unmeshed: Unmeshed) -> Self {
        match unmeshed {
            Unmeshed::Lower(sources, _) => Self::Lower(sources),
            Unmeshed::Failed(error) => Self::Failed(error),
        }
    }
}

/// The sizes of an attempt.
#[derive(Clone, Copy)]
pub(super) struct Sizes<'a> {
    pub size: &'a dyn SizeField,
    /// The same without corrections.
    pub initial: &'a dyn SizeField,
}

/// Meshes the surface of a geometry; also returns the ends of the segments on its curves.
pub(super) fn mesh_surface(
    model: &CsgModel,
    sizes: Sizes,
    may_lower: bool,
) -> Result<(SurfaceMesh, Vec<[Point; 2]>), Unmeshed> {
    let CsgModel { geometry, features, projector, .. } = model;
    let Sizes { size, initial } = sizes;
    size.work().step(0.0, SURFACE_SHARE, features.patches.len() as u64);
    let curves = mesh_curves(features, projector, size).map_err(|error| Unmeshed::Failed(error.into()))?;
    if may_lower {
        let crowded = crowded(&curves, features, size);
        let gap = crowded.gap(features, projector);
        let gap = gap.map(|gap| CloseSurfaces::of_edges(model, &gap, initial)).transpose();
        let gap = gap.map_err(|error| Unmeshed::Failed(error.into()))?;
        let mut lower: Vec<Source> = crowded.places.into_iter().map(|place| place.source).collect();
        lower.extend(narrow(&curves, features, projector, [size, initial]));
        if !lower.is_empty() {
            return Err(Unmeshed::Lower(lower, gap.map(Box::new)));
        }
    }
    let ends = |s: &Segment| s.vertices.map(|v| curves.points[v.index()]);
    let segments: Vec<[Point; 2]> = curves.segments.iter().map(ends).collect();
    match surface::mesh_patches(geometry, features, curves, size, &surface::Settings::default()) {
        Ok((surface, _)) => Ok((surface, segments)),
        Err(SurfaceError::TooCoarse { curve, at, .. }) if !may_lower => {
            let [first, second] = features.curve(curve).surfaces.map(|s| Named::surface(geometry, s));
            Err(Unmeshed::Failed(CoarseError::TooNear { first, second, place: Place(at) }))
        }
        Err(error) => Err(Unmeshed::of(error.into(), &segments, size, may_lower)),
    }
}

/// The number of tets that a size field lets expect, see [`expected::tets`].
pub(super) fn expected_tets(model: &CsgModel, size: &dyn SizeField, few: f64) -> f64 {
    expected::tets(&model.features.bounds, size, few, || |p: &Point| model.contains(p))
}

fn attempt(
    model: &CsgModel,
    initial: &Initial,
    settings: &CoarseSettings,
    allowed: Allowed,
    (budget, work): (&Budget, &Work),
) -> Attempt {
    let CsgModel { geometry, features, projector, .. } = model;
    let lowered = initial.lowered(model, &settings.size);
    let own = lowered.as_ref().unwrap_or(&initial.size);
    let periodic = PeriodicSize::new(own, features, settings.size.grading);
    let size: &dyn SizeField = if features.identified.is_empty() { own } else { &periodic };
    let size = &WatchedSize::new(size, work);
    let expected = expected_tets(model, size, expected::FEW);
    if let Err(error) = budget.expect(expected, work) {
        return Attempt::Failed(error.into());
    }
    let (surface, segments) = match mesh_surface(model, Sizes { size, initial: &initial.size }, allowed.lower)
    {
        Ok(made) => made,
        Err(Unmeshed::Lower(sources, gap)) => {
            budget.warn(Once::Edges, || gap.and_then(|gap| gap.warning()), work);
            return Attempt::Lower(sources);
        }
        Err(Unmeshed::Failed(error)) => return Attempt::Failed(error),
    };
    let regions = |id| [features.patch(id).inside, features.patch(id).outside];
    if allowed.thin {
        let project = |patch, point: &Point| projector.project_patch(patch, point).unwrap_or(*point);
        let closeness = settings.size.scaled_closeness();
        let (mesh, is_ignored) = (&surface, &|_| false);
        let (regions, touching, project) = (&regions, &Touching::default(), &project);
        let (sources, found) =
            thin_regions(&Walls { mesh, is_ignored, regions, touching, project, size, closeness });
        if found.places > 0 {
            return Attempt::Thin(sources, found);
        }
    }
    let smoothness = GeometrySmoothness { geometry, features };
    let CoarseSettings { effort, is_final, .. } = *settings;
    let how = Improvement { effort, is_final, smoothness: Some(&smoothness) };
    match fill(surface, regions, &Touching::default(), size, &how) {
        Ok(made) => Attempt::Made(Box::new(made)),
        Err(error) => match CloseSurfaces::unresolved(model, &initial.samples, error.places()) {
            Some(walls) => Attempt::Failed(TooClose::new(walls).into()),
            None => Unmeshed::of(error, &segments, size, allowed.lower).into(),
        },
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ground::size::UniformSize;

    #[test]
    fn curves_that_stay_too_near_are_reported_with_their_solids() {
        let ring = "algebraic3d\n\
            solid rod = cylinder (0, 0, 0; 0, 0, 1; 1);\n\
            solid hole = orthobrick (-0.7, -0.7, -1; 0.7, 0.7, 2);\n\
            solid ring = rod and not hole and plane (0, 0, 0; 0, 0, -1) and plane (0, 0, 1; 0, 0, 1);\n\
            tlo ring;\n";
        let geometry = csg::language::parse_geometry(ring, "ring.geo").unwrap().geometry;
        let model = CsgModel::new(geometry).unwrap();
        let Err(Unmeshed::Failed(error)) =
            mesh_surface(&model, Sizes { size: &UniformSize(1.0), initial: &UniformSize(1.0) }, false)
        else {
            panic!("segments as long as the radius cross")
        };
        let CoarseError::TooNear { place: Place(at), .. } = &error else { panic!("{error}") };
        assert!((0.8..1.0).contains(&at.coords.xy().norm()), "{at}");
        assert!(error.to_string().contains("solid `rod` (line 2)"), "{error}");
    }
}
