//! From a geometry to one classified, refinable tetrahedral mesh, on one rank.

use super::model::CsgModel;
use crate::Point;
use crate::improve::{self, Effort, GeometrySmoothness, Smoothness};
use crate::kernel::quality::QualitySummary;
use crate::mesh::{Class, Mesh, Segment, VertexId, are_sides};
use crate::periodic::PeriodicSize;
use crate::refine::Bends;
use crate::size::{GeometricSamples, GeometricSize, SizeField, SizeSettings, Source};
use crate::surface::closeness::{ThinWalls, Walls, thin_walls};
use crate::surface::curves::{CurveError, crowded, mesh_curves};
use crate::surface::narrow::narrow;
use crate::surface::{self, SurfaceError, SurfaceMesh};
use crate::volume::{self, ClosedSurface, SurfaceFaults, VolumeError};
use csg::features::{Named, Place};
use csg::{BodyId, PatchId};

/// Why there is no coarse mesh.
#[derive(Debug, thiserror::Error)]
pub enum CoarseError {
    /// A curve could not be cut.
    #[error(transparent)]
    Curve(#[from] CurveError),
    /// A patch could not be meshed.
    #[error(transparent)]
    Surface(#[from] SurfaceError),
    /// Curves that stay too near others, however short their segments.
    #[error(
        "an edge between surfaces of {first} and {second} comes too near another at {place} for any segments that were tried: surfaces \
         touch there to a high order, or leave too narrow a face; move one of them or let them overlap"
    )]
    TooNear {
        /// One surface.
        first: Named,
        /// The other.
        second: Named,
        /// Where.
        place: Place,
    },
    /// The surface mesh does not bound the bodies.
    #[error(
        "the surface mesh does not bound the bodies: {faults}; surfaces may touch there, or leave too thin a wall: move one of them"
    )]
    NotClosed {
        /// What is wrong.
        faults: SurfaceFaults,
        /// The middles of the sides of triangles that cross others.
        crossing: Vec<Point>,
    },
    /// The triangles that were given do not bound bodies.
    #[error(
        "the surface's own triangles intersect, or touch without being the same: {count} places, the first at ({}, {}, {}); where \
         surfaces touch, give both the same triangles there (join them in the program that made them), or keep them apart",
        first.x, first.y, first.z
    )]
    FacetsMeet {
        /// Middles of sides of such triangles.
        count: usize,
        /// The first of them.
        first: Point,
    },
    /// A body could not be filled.
    #[error(transparent)]
    Volume(#[from] VolumeError),
}

impl CoarseError {
    /// Where a finer mesh may help: sources that ask for it. `segments` are the ends of the segments that
    /// the mesh was begun with, `size` the size field that was used.
    pub(super) fn remedy(&self, segments: &[[Point; 2]], size: &dyn SizeField) -> Vec<Source> {
        match self {
            Self::Surface(SurfaceError::TooCoarse { segments: long, .. }) => {
                let shorter = |&s: &usize| {
                    let [a, b] = segments[s];
                    Source { point: nalgebra::center(&a, &b), size: LOWERED * (b - a).norm() }
                };
                long.iter().map(shorter).collect()
            }
            Self::NotClosed { crossing: places, .. }
            | Self::Volume(VolumeError::NotRecovered { places, .. }) => {
                places.iter().map(|&point| smaller_at(point, size)).collect()
            }
            _ => Vec::new(),
        }
    }
}

/// A source for where there is too little room.
pub(super) fn smaller_at(point: Point, size: &dyn SizeField) -> Source {
    Source { point, size: LOWERED * size.size_at(&point) }
}

/// What became of the coarse mesh.
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
    /// Shapes of the tets.
    pub quality: QualitySummary,
    /// Tets that would have flattened when refined and snapped, and were repaired.
    pub illegal_repaired: u64,
    /// Those that are left.
    pub illegal_left: u64,
    /// Points inside that the boundary could not do without.
    pub steiner_points: u64,
    /// Times the mesh was made anew with smaller sizes where surfaces came too near each other, or where
    /// refined tets would have been inverted.
    pub size_corrections: u64,
    /// Edges that refinement bends, so that refined tets are not inverted, or better.
    pub bent_edges: u64,
    /// Walls in which the sizes were lowered since they are thin.
    pub thin_walls: ThinWalls,
}

/// How a coarse mesh is made.
#[derive(Clone, Debug, Default)]
pub struct CoarseSettings {
    /// The sizes.
    pub size: SizeSettings,
    /// How much is done for better shapes; without it, as much as takes a second at most, then the standard.
    pub effort: Option<Effort>,
}

impl From<SizeSettings> for CoarseSettings {
    fn from(size: SizeSettings) -> Self {
        Self { size, effort: None }
    }
}

/// Up to so many tets patience costs less than a second, and each may become many.
const FEW_TETS: usize = 100_000;

fn effort_for(tets: usize) -> Effort {
    if tets <= FEW_TETS { Effort::Careful } else { Effort::Standard }
}

/// A coarse mesh and what became of it.
#[derive(Clone, Debug, Default)]
pub struct CoarseMesh {
    /// The mesh.
    pub mesh: Mesh,
    /// What refinement has to bend, by the ids that distribution gives edges.
    pub bends: Bends,
    /// Its numbers.
    pub report: CoarseReport,
}

/// Times the sizes are lowered where curves or surfaces come too near each other, before the mesher
/// gives up: each divides them by 1.7 or so, so that gaps of a thousandth of the size are still met.
pub(super) const MOST_CORRECTIONS: u64 = 14;

/// A place that failed asks for this fraction of the size there.
const LOWERED: f64 = 0.6;

/// Makes a coarse mesh with the given sizes. Where it fails for want of room between curves or surfaces, the
/// sizes are lowered there (`settings` keeps the new sources) and it is tried again.
///
/// # Errors
/// What failed in the end, with its place.
pub fn mesh(model: &CsgModel, settings: &mut CoarseSettings) -> Result<CoarseMesh, CoarseError> {
    let samples = GeometricSamples::new(&model.geometry, &model.features, &settings.size);
    corrected(settings, |settings, allowed| attempt(model, &samples, settings, allowed))
}

/// How one attempt at a coarse mesh ended.
pub(super) enum Attempt {
    Made(Box<CoarseMesh>),
    /// Walls were found to be thin: sources for those that can be resolved.
    Thin(Vec<Source>, ThinWalls),
    /// It takes smaller sizes.
    Lower(Vec<Source>),
    Failed(CoarseError),
}

/// What an attempt may answer beside a mesh.
#[derive(Clone, Copy)]
pub(super) struct Allowed {
    /// That it takes smaller sizes.
    pub lower: bool,
    /// That walls are thin: only the first time, as each time may lower the sizes as far as the settings allow.
    pub thin: bool,
}

/// Attempts until no sizes need to be lowered, or may be: the attempts are told whether they may ask for it.
pub(super) fn corrected(
    settings: &mut CoarseSettings,
    attempt: impl Fn(&CoarseSettings, Allowed) -> Attempt,
) -> Result<CoarseMesh, CoarseError> {
    let mut corrections = 0;
    let mut thin_walls = None;
    loop {
        let allowed = Allowed { lower: corrections < MOST_CORRECTIONS, thin: thin_walls.is_none() };
        match attempt(settings, allowed) {
            Attempt::Made(mut coarse) => {
                coarse.report.size_corrections = corrections;
                coarse.report.thin_walls = thin_walls.unwrap_or_default();
                return Ok(*coarse);
            }
            Attempt::Thin(sources, found) => {
                settings.size.sources.extend(sources);
                thin_walls = Some(found);
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
    /// It takes smaller sizes.
    Lower(Vec<Source>),
    Failed(CoarseError),
}

impl Unmeshed {
    /// What to do about an error, if sizes may be lowered; `segments` are the ends of those on curves.
    fn of(error: CoarseError, segments: &[[Point; 2]], size: &dyn SizeField, may_lower: bool) -> Self {
        let lower = if may_lower { error.remedy(segments, size) } else { Vec::new() };
        if lower.is_empty() { Self::Failed(error) } else { Self::Lower(lower) }
    }
}

impl From<Unmeshed> for Attempt {
    fn from(unmeshed: Unmeshed) -> Self {
        match unmeshed {
            Unmeshed::Lower(sources) => Self::Lower(sources),
            Unmeshed::Failed(error) => Self::Failed(error),
        }
    }
}

/// Meshes the surface of a geometry; also the ends of the segments on its curves.
pub(super) fn mesh_surface(
    model: &CsgModel,
    size: &dyn SizeField,
    may_lower: bool,
) -> Result<(SurfaceMesh, Vec<[Point; 2]>), Unmeshed> {
    let CsgModel { geometry, features, projector } = model;
    let curves = mesh_curves(features, projector, size).map_err(|error| Unmeshed::Failed(error.into()))?;
    if may_lower {
        let mut lower = crowded(&curves, features, size);
        lower.extend(narrow(&curves, features, projector, size));
        if !lower.is_empty() {
            return Err(Unmeshed::Lower(lower));
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
    samples: &GeometricSamples,
    settings: &CoarseSettings,
    allowed: Allowed,
) -> Attempt {
    let CsgModel { geometry, features, projector } = model;
    let own = GeometricSize::of_samples(geometry, features, &settings.size, samples);
    let periodic = PeriodicSize::new(&own, features, settings.size.grading);
    let size: &dyn SizeField = if features.identified.is_empty() { &own } else { &periodic };
    let (surface, segments) = match mesh_surface(model, size, allowed.lower) {
        Ok(made) => made,
        Err(unmeshed) => return unmeshed.into(),
    };
    let regions = |id| [features.patch(id).inside, features.patch(id).outside];
    if allowed.thin {
        let project = |patch, point: &Point| projector.project_patch(patch, point).unwrap_or(*point);
        let closeness = settings.size.scaled_closeness();
        let walls = Walls { mesh: &surface, regions: &regions, project: &project, size, closeness };
        let (sources, found) = thin_walls(&walls);
        if found.places > 0 {
            return Attempt::Thin(sources, found);
        }
    }
    let smoothness = GeometrySmoothness { geometry, features };
    match fill(surface, regions, size, Some(&smoothness), settings.effort) {
        Ok(made) => Attempt::Made(Box::new(made)),
        Err(error) => Unmeshed::of(error, &segments, size, allowed.lower).into(),
    }
}

/// Fills the bodies inside a surface mesh, and improves the result. `regions` are the bodies behind and in front of a patch;
/// without `smoothness` all of the boundary stays as flat as it is.
pub(super) fn fill(
    surface: SurfaceMesh,
    regions: impl Fn(PatchId) -> [Option<BodyId>; 2],
    size: &dyn SizeField,
    smoothness: Option<&dyn Smoothness>,
    effort: Option<Effort>,
) -> Result<CoarseMesh, CoarseError> {
    let (mut mesh, volume) = fill_bodies(surface, regions, size)?;
    let settings = improve::Settings::of(effort.unwrap_or_else(|| effort_for(mesh.tets.len())));
    let improved = match smoothness {
        Some(smoothness) => improve::make_refinable(&mut mesh, size, smoothness, &settings),
        None => improve::improve(&mut mesh, size, &settings),
    };
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
    Ok(CoarseMesh { mesh, report, bends: Bends::default() })
}

/// Fills the bodies inside a surface mesh.
fn fill_bodies(
    surface: SurfaceMesh,
    regions: impl Fn(PatchId) -> [Option<BodyId>; 2],
    size: &dyn SizeField,
) -> Result<(Mesh, volume::Report), CoarseError> {
    // Points of the user inside a body are on no triangle: the volume mesher gets them apart, and puts
    // them behind the others.
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
    use crate::size::UniformSize;

    #[test]
    fn curves_that_may_not_be_cut_finer_are_told_by_their_solids() {
        let ring = "algebraic3d\n\
            solid rod = cylinder (0, 0, 0; 0, 0, 1; 1);\n\
            solid hole = orthobrick (-0.7, -0.7, -1; 0.7, 0.7, 2);\n\
            solid ring = rod and not hole and plane (0, 0, 0; 0, 0, -1) and plane (0, 0, 1; 0, 0, 1);\n\
            tlo ring;\n";
        let geometry = csg::language::parse_geometry(ring, "ring.geo").unwrap().geometry;
        let model = CsgModel::new(geometry).unwrap();
        let Err(Unmeshed::Failed(error)) = mesh_surface(&model, &UniformSize(1.0), false) else {
            panic!("segments as long as the radius cross")
        };
        let CoarseError::TooNear { place: Place(at), .. } = &error else { panic!("{error}") };
        assert!((0.8..1.0).contains(&at.coords.xy().norm()), "{at}");
        assert!(error.to_string().contains("solid `rod` (line 2)"), "{error}");
    }
}
