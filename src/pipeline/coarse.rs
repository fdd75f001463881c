//! Makes one classified, refinable tetrahedral mesh of a geometry, on one rank.

use super::close::{self, CloseSurfaces, TooClose};
use super::expected;
use super::retries::{Budget, CORRECTIONS};
use super::room_error::RoomError;
use crate::Point;
use crate::ground::error::{ErrorKind, HasKind};
use crate::ground::mesh::QualitySummary;
use crate::ground::mesh::{Class, Mesh, Segment, VertexId, are_sides};
use crate::ground::progress::{Cancelled, Work};
use crate::ground::size::{GeometricSamples, GeometricSize, SizeField, SizeSettings, Source};
use crate::ground::size::{PeriodicSize, WatchedSize};
use crate::mesher::facets::SharpPlaces;
use crate::mesher::improve::{self, Effort, GeometrySmoothness, Smoothness};
use crate::mesher::model::CsgModel;
use crate::mesher::surface::closeness::{ThinRegions, Walls, thin_regions};
use crate::mesher::surface::curves::{CurveError, crowded, mesh_curves};
use crate::mesher::surface::narrow::narrow;
use crate::mesher::surface::{self, SurfaceError, SurfaceMesh};
use crate::mesher::volume::{self, ClosedSurface, SurfaceFaults, VolumeError};
use crate::parallel::refine::EdgeDisplacements;
use csg::features::{Named, Pair, Place};
use csg::{BodyId, PatchId};

/// Why there is no coarse mesh.
#[derive(Debug, thiserror::Error)]
pub enum CoarseError {
    /// A curve could not be divided into segments.
    #[error(transparent)]
    Curve(#[from] CurveError),
    /// A patch could not be meshed.
    #[error(transparent)]
    Surface(#[from] SurfaceError),
    /// Curves remain too close to each other, however short their segments.
    #[error(
        "an edge between surfaces of {} comes too near another at {place} for any segments that were tried: surfaces \
         touch there to a high order, or leave too narrow a face; move one of them or let them overlap",
        Pair(.first, .second)
    )]
    TooNear {
        /// One surface.
        first: Named,
        /// The other.
        second: Named,
        /// Where the curves are too close.
        place: Place,
    },
    /// Surfaces are so close to each other that only very small elements keep them apart.
    #[error(transparent)]
    TooClose(#[from] TooClose),
    /// The surface mesh does not bound the bodies.
    #[error(
        "the surface mesh does not bound the bodies: {faults}; surfaces may touch there, or leave too thin a wall: move one of them"
    )]
    NotClosed {
        /// The faults.
        faults: SurfaceFaults,
        /// Edge midpoints of triangles that intersect others.
        crossing: Vec<Point>,
    },
    /// The input triangles do not bound bodies.
    #[error(
        "{} intersect, or touch without being the same: {count} pairs, the first at ({}, {}, {}); no option repairs this: \
         where surfaces touch, give both the same triangles there (join them in the program that made them), or keep them \
         apart",
        triangles_of(.files), first.x, first.y, first.z
    )]
    FacetsMeet {
        /// The files of the first pair if they differ.
        files: Option<Box<[String; 2]>>,
        /// Number of pairs of triangles.
        count: usize,
        /// Where the first pair intersects.
        first: Point,
    },
    /// A body could not be filled.
    #[error(transparent)]
    Volume(VolumeError),
    /// More tets are expected than the memory can hold.
    #[error(transparent)]
    Room(#[from] RoomError),
    /// The observer cancelled the run.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// Names triangles that intersect.
fn triangles_of(files: &Option<Box<[String; 2]>>) -> String {
    match files.as_deref() {
        Some([a, b]) => format!("triangles of {a} and {b}"),
        None => "the surface's own triangles".into(),
    }
}

impl From<VolumeError> for CoarseError {
    fn from(error: VolumeError) -> Self {
        match error {
            VolumeError::Cancelled(cancelled) => Self::Cancelled(cancelled),
            error => Self::Volume(error),
        }
    }
}

impl HasKind for CoarseError {
    fn kind(&self) -> ErrorKind {
        match self {
            Self::TooClose(_) | Self::FacetsMeet { .. } => ErrorKind::Input,
            Self::Room(_) => ErrorKind::Resources,
            Self::Cancelled(_) => ErrorKind::Cancelled,
            _ => ErrorKind::NoMesh,
        }
    }
}

impl CoarseError {
    /// Sources that lower the sizes where a finer mesh may help. `segments` are the ends of the
    /// initial segments, `size` is the size field that was used.
    pub(super) fn remedy(&self, segments: &[[Point; 2]], size: &dyn SizeField) -> Vec<Source> {
        match self {
            Self::Surface(SurfaceError::TooCoarse { segments: long, .. }) => {
                let shorter = |&s: &usize| {
                    let [a, b] = segments[s];
                    Source { point: nalgebra::center(&a, &b), size: LOWERED * (b - a).norm() }
                };
                long.iter().map(shorter).collect()
            }
            _ => self.places().iter().map(|&point| smaller_at(point, size)).collect(),
        }
    }

    /// Places where surfaces are too close to each other for the sizes.
    fn places(&self) -> &[Point] {
        match self {
            Self::NotClosed { crossing: places, .. }
            | Self::Volume(VolumeError::NotRecovered { places, .. }) => places,
            _ => &[],
        }
    }
}

/// A source that lowers the size at a place with too little room.
pub(super) fn smaller_at(point: Point, size: &dyn SizeField) -> Source {
    Source { point, size: LOWERED * size.size_at(&point) }
}

/// Statistics of a coarse mesh.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize)]
pub struct CoarseReport {
    /// Vertices.
    pub vertices: u64,
    /// Tets.
    pub tets: u64,
    /// Triangles on patches.
    pub boundary: u64,
    /// Segments on curves.
    pub segments: u64,
    /// Shape quality of the tets.
    pub quality: QualitySummary,
    /// Number of tets that would have been inverted by refinement and snapping, and were repaired.
    pub illegal_repaired: u64,
    /// Number of such tets left.
    pub illegal_left: u64,
    /// Steiner points inside bodies that the boundary recovery needed.
    pub steiner_points: u64,
    /// Number of restarts with smaller sizes, where surfaces were too close to each other or
    /// refined tets would have been inverted.
    pub size_corrections: u64,
    /// Number of edges that refinement curves to avoid inverted or poor tets.
    pub curved_edges: u64,
    /// Thin regions in which the sizes were lowered.
    pub thin_regions: ThinRegions,
    /// Cusps without angle that were cut off bodies.
    pub cut_cusps: Vec<CutCusp>,
    /// Places where the triangles of the input are sharper than 10°.
    pub sharp_places: SharpPlaces,
}

/// A cusp without angle that was cut off bodies.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct CutCusp {
    /// A point where the surfaces touch.
    pub point: [f64; 3],
    /// The radius of the ball around the point, or of the tube around the curve of contact.
    pub radius: f64,
    /// Whether the surfaces touch along a curve.
    pub is_curve: bool,
    /// The number of the body that was cut; null for all.
    pub body: Option<u32>,
}

impl CutCusp {
    fn of(model: &CsgModel) -> Vec<Self> {
        let body = |id: csg::BodyId| model.geometry.bodies[id.index()].number;
        let cusps = model.cut_cusps.iter().map(|cusp| Self {
            point: cusp.place.0.into(),
            radius: cusp.radius,
            is_curve: cusp.is_curve,
            body: cusp.body.as_ref().map(|cut| body(cut.0)),
        });
        cusps.collect()
    }
}

/// How a coarse mesh is made.
#[derive(Clone, Debug, Default)]
pub struct CoarseSettings {
    /// The element sizes.
    pub size: SizeSettings,
    /// Effort for the shapes of tets; if `None`, the careful one up to a second of work, else the
    /// standard one.
    pub effort: Option<Effort>,
}

impl From<SizeSettings> for CoarseSettings {
    fn from(size: SizeSettings) -> Self {
        Self { size, effort: None }
    }
}

/// Up to this many tets the careful effort takes less than a second, and refinement multiplies its
/// effect.
const FEW_TETS: usize = 100_000;

fn effort_for(tets: usize) -> Effort {
    if tets <= FEW_TETS { Effort::Careful } else { Effort::Standard }
}

/// A coarse mesh with its statistics.
#[derive(Clone, Debug, Default)]
pub struct CoarseMesh {
    /// The mesh.
    pub mesh: Mesh,
    /// Edge displacements for refinement, by the edge ids that distribution assigns.
    pub displacements: EdgeDisplacements,
    /// Its statistics.
    pub report: CoarseReport,
}

/// Factor applied to the size where an attempt failed.
const LOWERED: f64 = 0.6;

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
    let samples = GeometricSamples::new(&model.geometry, &model.features, &settings.size);
    let initial = GeometricSize::of_samples(&model.geometry, &model.features, &settings.size, &samples);
    if let Some(warning) = close::warning(model, &samples) {
        work.note(&warning);
    }
    let mut coarse = corrected(settings, budget, work, |settings, allowed| {
        attempt(model, (&samples, &initial), settings, allowed, (budget, work))
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
    /// Whether no sizes were lowered so far, so that a gap is news.
    pub first: bool,
    /// Thin regions: only in the first attempt, because each time may lower the sizes as far as the
    /// settings allow.
    pub thin: bool,
}

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
        let lower = corrections < CORRECTIONS && !budget.is_spent();
        let allowed = Allowed { lower, first: corrections == 0, thin: thin_regions.is_none() };
        match attempt(settings, allowed) {
            Attempt::Made(mut coarse) => {
                coarse.report.size_corrections = corrections;
                coarse.report.thin_regions = thin_regions.unwrap_or_default();
                return Ok(*coarse);
            }
            Attempt::Thin(sources, found) => {
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
    Lower(Vec<Source>, Option<CloseSurfaces>),
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
            return Err(Unmeshed::Lower(lower, gap));
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

fn attempt(
    model: &CsgModel,
    (samples, initial): (&GeometricSamples, &dyn SizeField),
    settings: &CoarseSettings,
    allowed: Allowed,
    (budget, work): (&Budget, &Work),
) -> Attempt {
    let CsgModel { geometry, features, projector, .. } = model;
    let own = GeometricSize::of_samples(geometry, features, &settings.size, samples);
    let periodic = PeriodicSize::new(&own, features, settings.size.grading);
    let size: &dyn SizeField = if features.identified.is_empty() { &own } else { &periodic };
    let size = &WatchedSize::new(size, work);
    let expected = expected::tets(&features.bounds, size, expected::FEW, || |p: &Point| model.contains(p));
    if let Err(error) = budget.expect(expected, work) {
        return Attempt::Failed(error.into());
    }
    let (surface, segments) = match mesh_surface(model, Sizes { size, initial }, allowed.lower) {
        Ok(made) => made,
        Err(Unmeshed::Lower(sources, gap)) => {
            if let (true, Some(gap)) = (allowed.first, gap) {
                gap.warn(work);
            }
            return Attempt::Lower(sources);
        }
        Err(Unmeshed::Failed(error)) => return Attempt::Failed(error),
    };
    let regions = |id| [features.patch(id).inside, features.patch(id).outside];
    if allowed.thin {
        let project = |patch, point: &Point| projector.project_patch(patch, point).unwrap_or(*point);
        let closeness = settings.size.scaled_closeness();
        let walls = Walls { mesh: &surface, regions: &regions, project: &project, size, closeness };
        let (sources, found) = thin_regions(&walls);
        if found.places > 0 {
            return Attempt::Thin(sources, found);
        }
    }
    let smoothness = GeometrySmoothness { geometry, features };
    match fill(surface, regions, size, Some(&smoothness), settings.effort) {
        Ok(made) => Attempt::Made(Box::new(made)),
        Err(error) => match CloseSurfaces::unresolved(model, samples, error.places()) {
            Some(walls) => Attempt::Failed(TooClose::new(walls).into()),
            None => Unmeshed::of(error, &segments, size, allowed.lower).into(),
        },
    }
}

/// Fraction of the time after which the surface mesh is done, for a coarse mesh of 100,000 tets.
const SURFACE_SHARE: f64 = 0.2;
/// Fraction of the time after which the bodies are filled.
const VOLUME_SHARE: f64 = 0.4;

/// Fills the bodies inside a surface mesh, and improves the result. `regions` returns the bodies
/// behind and in front of a patch. Without `smoothness` the boundary is not moved.
pub(super) fn fill(
    surface: SurfaceMesh,
    regions: impl Fn(PatchId) -> [Option<BodyId>; 2],
    size: &dyn SizeField,
    smoothness: Option<&dyn Smoothness>,
    effort: Option<Effort>,
) -> Result<CoarseMesh, CoarseError> {
    size.work().proceed()?;
    size.work().step(SURFACE_SHARE, VOLUME_SHARE, 1);
    let (mut mesh, volume) = fill_bodies(surface, regions, size)?;
    size.work().proceed()?;
    size.work().step(VOLUME_SHARE, 1.0, 1);
    let settings = improve::Settings::of(effort.unwrap_or_else(|| effort_for(mesh.tets.len())));
    let improved = match smoothness {
        Some(smoothness) => improve::make_refinable(&mut mesh, size, smoothness, &settings),
        None => improve::improve(&mut mesh, size, &settings),
    };
    size.work().proceed()?;
    let report = CoarseReport {
        vertices: mesh.points.len() as u64,
        tets: mesh.tets.len() as u64,
        boundary: mesh.triangles.len() as u64,
        segments: mesh.segments.len() as u64,
        illegal_repaired: improved.illegal_before.saturating_sub(improved.illegal_left) as u64,
        illegal_left: improved.illegal_left as u64,
        quality: improved.after,
        steiner_points: volume.steiner_inside as u64,
        ..CoarseReport::default()
    };
    Ok(CoarseMesh { mesh, report, displacements: EdgeDisplacements::default() })
}

/// Fills the bodies inside a surface mesh.
fn fill_bodies(
    surface: SurfaceMesh,
    regions: impl Fn(PatchId) -> [Option<BodyId>; 2],
    size: &dyn SizeField,
) -> Result<(Mesh, volume::Report), CoarseError> {
    // User points inside a body are on no triangle: the volume mesher receives them separately and
    // numbers them after the others.
    let mut used = vec![false; surface.points.len()];
    for triangle in &surface.triangles {
        triangle.vertices.iter().for_each(|v| used[v.index()] = true);
    }
    let order: Vec<usize> = {
        let (on, inside): (Vec<usize>, Vec<usize>) = (0..used.len()).partition(|&v| used[v]);
        on.into_iter().chain(inside).collect()
    };
    let on_surface = used.iter().filter(|&&used| used).count();
    let mut old_to_new = vec![VertexId::default(); used.len()];
    order.iter().enumerate().for_each(|(new, &old)| old_to_new[old] = VertexId::new(new));
    let renumbered = |v: VertexId| old_to_new[v.index()];

    let points: Vec<Point> = order.iter().map(|&v| surface.points[v]).collect();
    let mut classes: Vec<Class> = order.iter().map(|&v| surface.classes[v]).collect();
    let mut triangles = surface.triangles;
    triangles.iter_mut().for_each(|t| t.vertices = t.vertices.map(renumbered));
    let mut segments = surface.segments;
    segments.iter_mut().for_each(|s| s.vertices = s.vertices.map(renumbered));
    let is_side = are_sides(&segments, &triangles);
    let (sides, loose): (Vec<_>, Vec<_>) = segments.into_iter().zip(is_side).partition(|(_, side)| *side);
    let [mut segments, loose] =
        [sides, loose].map(|part| part.into_iter().map(|(s, _)| s).collect::<Vec<_>>());

    let corners: Vec<[u32; 3]> = triangles.iter().map(|t| t.vertices.map(|v| v.0)).collect();
    let beside = triangles.iter().map(|t| regions(t.patch)).collect();
    let closed = ClosedSurface::new(points[..on_surface].to_vec(), corners.clone(), beside)
        .map_err(|faults| {
            let crossing = volume::middles_of_sides(&points, &corners, faults.crossings());
            CoarseError::NotClosed { faults, crossing }
        })?
        .with_kept_points(points[on_surface..].to_vec())
        .with_kept_edges(loose.iter().map(|s| s.vertices.map(|v| v.0)).collect());
    let (filled, report) = volume::mesh(&closed, size, &volume::Settings::default())?;

    classes.resize(filled.points.len(), Class::Corner(csg::CornerId(u32::MAX)));
    for (tet, body) in filled.tets.iter().zip(&filled.bodies) {
        for v in tet.iter().filter(|&&v| v as usize >= order.len()) {
            classes[*v as usize] = Class::Body(*body);
        }
    }
    for (edge, i) in filled.kept_edges {
        let curve = loose[i as usize].curve;
        for v in edge.into_iter().filter(|&v| v as usize >= order.len()) {
            classes[v as usize] = Class::Curve(curve);
        }
        segments.push(Segment { vertices: edge.map(VertexId), curve });
    }
    let mesh = Mesh {
        points: filled.points,
        classes,
        tets: filled.tets.into_iter().map(|t| t.map(VertexId)).collect(),
        bodies: filled.bodies,
        triangles,
        segments,
    };
    Ok((mesh, report))
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
