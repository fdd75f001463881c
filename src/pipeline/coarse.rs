//! From a geometry to one classified, refinable tetrahedral mesh, on one rank.

use crate::Point;
use crate::improve::{self, GeometrySmoothness};
use crate::kernel::quality::QualitySummary;
use crate::mesh::{Class, Mesh, Segment, VertexId};
use crate::size::{GeometricSize, SizeField, SizeSettings, Source};
use crate::surface::curves::{CurveError, crowded, mesh_curves};
use crate::surface::{self, SurfaceError, SurfaceMesh};
use crate::volume::{self, ClosedSurface, SurfaceFaults, VolumeError};
use csg::{Features, Geometry, Projector};

/// A geometry with everything that was found out about it.
#[derive(Clone, Debug)]
pub struct Model {
    /// What the file says.
    pub geometry: Geometry,
    /// Its corners, curves and patches.
    pub features: Features,
    /// Projection to them.
    pub projector: Projector,
}

impl Model {
    /// Finds the features of a geometry.
    ///
    /// # Errors
    /// What cannot be meshed, with its place.
    pub fn new(geometry: Geometry) -> Result<Self, csg::FeatureError> {
        let features = Features::find(&geometry)?;
        let projector = Projector::new(&geometry, &features);
        Ok(Self { geometry, features, projector })
    }
}

/// Why there is no coarse mesh.
#[derive(Debug, thiserror::Error)]
pub enum CoarseError {
    /// A curve could not be cut.
    #[error(transparent)]
    Curve(#[from] CurveError),
    /// A patch could not be meshed.
    #[error(transparent)]
    Surface(#[from] SurfaceError),
    /// The surface mesh does not bound the bodies.
    #[error("the surface mesh does not bound the bodies: {0}")]
    NotClosed(#[from] SurfaceFaults),
    /// A body could not be filled.
    #[error(transparent)]
    Volume(#[from] VolumeError),
}

impl CoarseError {
    /// Where a finer mesh may help: sources that ask for it. `segments` are the ends of the segments that
    /// the mesh was begun with, `size` the size field that was used.
    fn remedy(&self, segments: &[[Point; 2]], size: &dyn SizeField) -> Vec<Source> {
        match self {
            Self::Surface(SurfaceError::TooCoarse { segments: long, .. }) => {
                let shorter = |&s: &usize| {
                    let [a, b] = segments[s];
                    Source { point: nalgebra::center(&a, &b), size: LOWERED * (b - a).norm() }
                };
                long.iter().map(shorter).collect()
            }
            Self::NotClosed(faults) => faults.crossings().map(|point| smaller_at(point, size)).collect(),
            Self::Volume(VolumeError::NotRecovered { places, .. }) => {
                places.iter().map(|&point| smaller_at(point, size)).collect()
            }
            _ => Vec::new(),
        }
    }
}

fn smaller_at(point: Point, size: &dyn SizeField) -> Source {
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
}

/// A coarse mesh and what became of it.
#[derive(Clone, Debug, Default)]
pub struct CoarseMesh {
    /// The mesh.
    pub mesh: Mesh,
    /// Its numbers.
    pub report: CoarseReport,
}

/// Times the sizes are lowered where curves or surfaces come too near each other, before the mesher
/// gives up: each divides them by 1.7 or so, so that gaps of a thousandth of the size are still met.
const MOST_CORRECTIONS: u64 = 14;

/// A place that failed asks for this fraction of the size there.
const LOWERED: f64 = 0.6;

/// Makes a coarse mesh with the given sizes. Where it fails for want of room between curves or surfaces, the
/// sizes are lowered there (`settings` keeps the new sources) and it is tried again.
///
/// # Errors
/// What failed in the end, with its place.
pub fn mesh(model: &Model, settings: &mut SizeSettings) -> Result<CoarseMesh, CoarseError> {
    let mut corrections = 0;
    loop {
        let size = GeometricSize::new(&model.geometry, &model.features, settings);
        let curves = mesh_curves(&model.features, &model.projector, &size)?;
        let mut lowered = crowded(&curves, &model.features);
        if lowered.is_empty() || corrections >= MOST_CORRECTIONS {
            let ends = |s: &Segment| s.vertices.map(|v| curves.points[v.index()]);
            let segments: Vec<[Point; 2]> = curves.segments.iter().map(ends).collect();
            let error = match fill(model, curves, &size) {
                Ok(mut coarse) => {
                    coarse.report.size_corrections = corrections;
                    return Ok(coarse);
                }
                Err(error) => error,
            };
            lowered = error.remedy(&segments, &size);
            if lowered.is_empty() || corrections >= MOST_CORRECTIONS {
                return Err(error);
            }
        }
        settings.sources.extend(lowered);
        corrections += 1;
    }
}

/// Fills patches, then bodies, and improves the result.
fn fill(model: &Model, curves: SurfaceMesh, size: &dyn SizeField) -> Result<CoarseMesh, CoarseError> {
    let Model { geometry, features, .. } = model;
    let segments = curves.segments.len() as u64;
    let (surface, _) =
        surface::mesh_patches(geometry, features, curves, size, &surface::Settings::default())?;
    let (mut mesh, volume) = fill_bodies(features, surface, size)?;
    let smoothness = GeometrySmoothness { geometry, features };
    let improved = improve::make_refinable(&mut mesh, size, &smoothness, &improve::Settings::default());
    let report = CoarseReport {
        vertices: mesh.points.len() as u64,
        tets: mesh.tets.len() as u64,
        boundary: mesh.triangles.len() as u64,
        segments,
        illegal_repaired: improved.illegal_before.saturating_sub(improved.illegal_left) as u64,
        illegal_left: improved.illegal_left as u64,
        quality: improved.after,
        steiner_points: volume.steiner_inside as u64,
        size_corrections: 0,
    };
    Ok(CoarseMesh { mesh, report })
}

/// Fills the bodies inside a surface mesh.
fn fill_bodies(
    features: &Features,
    surface: SurfaceMesh,
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

    let regions = triangles.iter().map(|t| {
        let patch = features.patch(t.patch);
        [patch.inside, patch.outside]
    });
    let closed = ClosedSurface::new(
        points[..on_surface].to_vec(),
        triangles.iter().map(|t| t.vertices.map(|v| v.0)).collect(),
        regions.collect(),
    )?
    .with_kept_points(points[on_surface..].to_vec());
    let (filled, report) = volume::mesh(&closed, size, &volume::Settings::default())?;

    classes.resize(filled.points.len(), Class::Corner(csg::CornerId(u32::MAX)));
    for (tet, body) in filled.tets.iter().zip(&filled.bodies) {
        for v in tet.iter().filter(|&&v| v as usize >= order.len()) {
            classes[*v as usize] = Class::Body(*body);
        }
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
