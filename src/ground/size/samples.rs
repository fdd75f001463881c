//! Sizes that the surfaces and curves of a geometry impose, at points on them.

use super::geometric::contains;
use super::{NearSurfaces, SizeSettings, Source};
use crate::{Point, Vector};
use csg::solid::prune_in;
use csg::{Body, BodyId, Curve, CurveId, Cutout, Features, Geometry, Interval, Solid, SurfaceId};
use rayon::prelude::*;

/// The samples of a geometry under some settings, without the sources of the settings.
///
/// Fields that differ in these sources can share the samples.
#[derive(Clone, Debug)]
pub struct GeometricSamples {
    /// The size if no source imposes a smaller one.
    pub(super) maximum: f64,
    /// Bodies with a bound of their own.
    pub(super) body_bounds: Vec<(BodyId, f64)>,
    pub(super) sources: Vec<Source>,
    near: Vec<NearSurfaces>,
    short: Option<ShortCurve>,
}

/// A curve that is short compared with the sizes of the patches beside it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ShortCurve {
    /// The curve.
    pub curve: CurveId,
    /// A point on it.
    pub at: Point,
    /// Its length.
    pub length: f64,
    /// The size without it.
    pub size_alone: f64,
}

impl GeometricSamples {
    /// Samples curves and patches.
    pub fn new(geometry: &Geometry, features: &Features, settings: &SizeSettings) -> Self {
        Self::with_roughness(geometry, features, settings, 1.0)
    }

    /// [`new`](Self::new) with distances of neighbouring samples larger by a factor.
    pub(super) fn with_roughness(
        geometry: &Geometry,
        features: &Features,
        settings: &SizeSettings,
        roughness: f64,
    ) -> Self {
        let diagonal = features.bounds.diagonal();
        // If all bodies have bounds, the largest of these bounds all sizes.
        let of_body = |body: &Body| settings.scaled_bound(body.maxh.unwrap_or(f64::INFINITY));
        let maximum = settings
            .scaled_bound(settings.maxh.unwrap_or(f64::INFINITY))
            .min(diagonal * settings.scale)
            .min(geometry.bodies.iter().map(of_body).reduce(f64::max).unwrap_or(f64::INFINITY));
        let body_bounds: Vec<(BodyId, f64)> = geometry
            .bodies
            .iter()
            .enumerate()
            .map(|(i, body)| (BodyId::new(i), of_body(body)))
            .filter(|(_, bound)| *bound < maximum)
            .collect();
        let sampler = Sampler { geometry, features, settings, maximum, body_bounds: &body_bounds, roughness };
        let of_curve = |i: usize| {
            let bound = settings.scaled_bound(features.edge_bound(geometry, CurveId::new(i)));
            let mut sources = Vec::new();
            sampler.sample_curve(&features.curves[i], bound, &mut sources);
            sources
        };
        let of_curves: Vec<Vec<Source>> = (0..features.curves.len()).into_par_iter().map(of_curve).collect();
        let mut sources = of_curves.concat();
        let near = sampler.sample_patches(&mut sources);
        let short = (0..features.curves.len()).map(|i| sampler.shortness(CurveId::new(i)));
        let short = short.min_by(|a, b| (a.length / a.size_alone).total_cmp(&(b.length / b.size_alone)));
        Self { maximum, body_bounds, sources, near, short }
    }

    /// The curve that is shortest compared with the sizes beside it, if there are curves.
    pub(crate) fn shortest_curve(&self) -> Option<&ShortCurve> {
        self.short.as_ref()
    }

    /// Samples at which another surface is so close that it limits the size.
    pub(crate) fn near(&self) -> &[NearSurfaces] {
        &self.near
    }
}

/// The maximum growth of the size from one sample to the next, relative to the size.
///
/// The field between samples is too large by at most half of that. Samples are at most one size
/// apart; with that distance at a grading of 0.7, a ball would lose a quarter of its volume.
const SAMPLE_GROWTH: f64 = 0.3;

/// The maximum number of samples along one step of a curve: meshes of smaller segments fit no
/// memory.
const MOST_SAMPLES: f64 = 1e5;

/// The maximum distance of samples on surfaces of varying curvature, as a fraction of the diagonal.
///
/// Finer variations of the curvature are missed.
const COARSEST_SAMPLE: f64 = 1.0 / 32.0;

/// The distance from a surface at which the regions on both sides are found, as a fraction of the
/// diagonal.
const SIDE_STEP: f64 = 1e-6;

/// The distance from the apex of a cone up to which a point is treated as the apex, as a fraction
/// of the diagonal.
///
/// Corners at the apex are within rounding of it; samples are at least a thousandth away.
const APEX: f64 = 1e-6;

/// The smallest cell whose children are sampled in parallel, as a fraction of the longest side of
/// the geometry.
const PARALLEL_CELL: f64 = 1.0 / 8.0;

/// Samples on surfaces.
#[derive(Default)]
struct Samples {
    sources: Vec<(SurfaceId, Source)>,
    /// Where the next surface limits the size, or would need too small a size.
    near: Vec<NearSurfaces>,
}

struct Sampler<'a> {
    geometry: &'a Geometry,
    features: &'a Features,
    settings: &'a SizeSettings,
    maximum: f64,
    body_bounds: &'a [(BodyId, f64)],
    /// The factor of the distances of neighbouring samples.
    roughness: f64,
}

impl Sampler<'_> {
    /// The distance of neighbouring samples for a size.
    fn spacing(&self, size: f64) -> f64 {
        self.roughness * size * (SAMPLE_GROWTH / self.settings.grading).min(1.0)
    }

    /// The size for a curvature (1/length).
    fn size_of_curvature(&self, curvature: f64) -> f64 {
        (self.settings.scale / (self.settings.curvature_safety * curvature)).max(self.settings.minh)
    }

    /// The size that a surface imposes at a point on a curve in it.
    fn size_on(&self, surface: SurfaceId, point: &Point) -> f64 {
        self.surface_bound(surface).min(self.curvature_size(surface, point))
    }

    /// The size that a surface imposes at a point within a patch.
    fn size_within(&self, surface: SurfaceId, point: &Point) -> f64 {
        let least = if self.constant_size(surface) { 0.0 } else { self.least_edge() };
        self.surface_bound(surface).min(self.curvature_size(surface, point).max(least))
    }

    /// The bound of a surface in the file.
    fn surface_bound(&self, surface: SurfaceId) -> f64 {
        let bound = self.geometry.surface_info[surface.index()].maxh.unwrap_or(f64::INFINITY);
        self.settings.scaled_bound(bound)
    }

    /// The size from the curvature of a surface at a point on it.
    fn curvature_size(&self, surface: SurfaceId, point: &Point) -> f64 {
        let shape = &self.geometry.surfaces[surface.index()];
        // The curvature of an apex is undefined; the points near it determine the size.
        let beside = APEX * self.features.bounds.diagonal();
        let is_apex = shape.apex().is_some_and(|apex| (point - apex).norm() <= beside);
        self.size_of_curvature(if is_apex { 0.0 } else { shape.curvature(point) })
    }

    /// The bound of a cutout, infinity if it has none.
    fn cutout_bound(&self, cutout: Option<u32>) -> f64 {
        let bound = cutout.and_then(|i| self.geometry.cutouts[i as usize].maxh);
        bound.map_or(f64::INFINITY, |bound| self.settings.scaled_bound(bound))
    }

    /// The smallest bound of the cutouts of a surface, infinity if there is none.
    fn least_cutout_bound(&self, surface: SurfaceId) -> f64 {
        let cutouts = (0..).zip(&self.geometry.cutouts).filter(|(_, cutout)| cutout.surface == surface);
        cutouts.map(|(i, _)| self.cutout_bound(Some(i))).fold(f64::INFINITY, f64::min)
    }

    /// The length of a curve and the size of the patches beside it.
    fn shortness(&self, id: CurveId) -> ShortCurve {
        let curve = self.features.curve(id);
        let at = curve.trace[0];
        let beside = curve.fins.iter().map(|fin| self.features.patch(fin.patch).surface);
        // A large scale makes sizes larger than the whole geometry.
        let most = self.maximum.min(self.features.bounds.diagonal());
        let size_alone = beside.map(|surface| self.size_on(surface, &at)).fold(most, f64::min);
        ShortCurve { curve: id, at, length: length(&curve.trace), size_alone }
    }

    /// Adds sources along a curve, from its curvature, length and bound, and from the surfaces of
    /// the adjacent patches.
    fn sample_curve(&self, curve: &Curve, bound: f64, sources: &mut Vec<Source>) {
        let trace = &curve.trace;
        let whole = (self.settings.scale * length(trace) / self.settings.segments_per_curve)
            .max(self.settings.minh)
            .min(bound);
        let curvatures = trace_curvatures(trace, curve.ends.is_none());
        for (i, w) in trace.windows(2).enumerate() {
            let beside = curve.fins.iter().map(|fin| self.features.patch(fin.patch));
            let size = beside
                .map(|patch| self.size_on(patch.surface, &w[0]).min(self.cutout_bound(patch.cutout)))
                .fold(whole.min(self.size_of_curvature(curvatures[i].max(curvatures[i + 1]))), f64::min);
            if size >= self.maximum {
                continue;
            }
            let pieces = ((w[1] - w[0]).norm() / self.spacing(size)).ceil().clamp(1.0, MOST_SAMPLES) as usize;
            for piece in 0..=pieces {
                let point = w[0] + (w[1] - w[0]) * (piece as f64 / pieces as f64);
                sources.push(Source { point, size });
            }
        }
    }

    /// Adds sources on the patches whose size is below the maximum.
    ///
    /// Cells around the surfaces are split until they are small relative to the size; each gives
    /// one source.
    fn sample_patches(&self, sources: &mut Vec<Source>) -> Vec<NearSurfaces> {
        let mut surfaces: Vec<SurfaceId> = self.features.patches.iter().map(|p| p.surface).collect();
        surfaces.sort_unstable();
        surfaces.dedup();
        let bounds = &self.features.bounds;
        // A margin, so that no patch is on the boundary of the root cell.
        let edge = 1.02 * (bounds.max - bounds.min).max();
        let bodies = self.geometry.bodies.iter().enumerate();
        let bodies = bodies.map(|(i, body)| (BodyId::new(i), body.solid.clone())).collect();
        let mut samples = Samples::default();
        self.sample_cell(&surfaces, bodies, bounds.center(), edge, &mut samples);
        // By surface, so that neighbours in the order are neighbours on a surface.
        samples.sources.sort_by_key(|sample| sample.0);
        sources.extend(samples.sources.into_iter().map(|sample| sample.1));
        samples.near
    }

    /// Adds sources for those of the `wanted` surfaces that bound the pruned bodies in a cell.
    ///
    /// One descent serves all surfaces. The bodies are pruned as in the search for features: most
    /// of an infinite surface bounds nothing, and few surfaces decide which regions meet at a
    /// sample, however many the bodies have.
    fn sample_cell(
        &self,
        wanted: &[SurfaceId],
        bodies: Vec<(BodyId, Solid)>,
        center: Point,
        edge: f64,
        samples: &mut Samples,
    ) {
        let mut open = wanted.to_vec();
        let cell = [0, 1, 2].map(|i| Interval { lo: center[i] - 0.5 * edge, hi: center[i] + 0.5 * edge });
        open.retain(|surface| self.geometry.surfaces[surface.index()].value_range(&cell).contains_zero());
        // Most cells end here, before the expensive pruning.
        if open.is_empty() {
            return;
        }
        let bodies = self.pruned(bodies, &center, edge);
        let mut here: Vec<SurfaceId> = bodies.iter().flat_map(|body| body.1.surfaces()).collect();
        here.sort_unstable();
        here.dedup();
        open.retain(|surface| here.binary_search(surface).is_ok());
        open.retain(|&surface| self.is_coarse(surface, (&bodies, &here), &center, edge, samples));
        if open.is_empty() {
            return;
        }
        let sample_child = |child: usize, samples: &mut Samples| {
            let side = |axis: usize| if child >> axis & 1 == 1 { 0.25 * edge } else { -0.25 * edge };
            let middle = center + Vector::new(side(0), side(1), side(2));
            self.sample_cell(&open, bodies.clone(), middle, 0.5 * edge, samples);
        };
        let bounds = &self.features.bounds;
        if edge < PARALLEL_CELL * (bounds.max - bounds.min).max() {
            (0..8).for_each(|child| sample_child(child, samples));
            return;
        }
        let of_child = |child: usize| {
            let mut of_child = Samples::default();
            sample_child(child, &mut of_child);
            of_child
        };
        // In the order of the children, as without threads.
        let of_children: Vec<Samples> = (0..8).into_par_iter().map(of_child).collect();
        for of_child in of_children {
            samples.sources.extend(of_child.sources);
            samples.near.extend(of_child.near);
        }
    }

    /// The bodies pruned in a cell, enlarged by the distance at which its samples may be.
    fn pruned(&self, bodies: Vec<(BodyId, Solid)>, center: &Point, edge: f64) -> Vec<(BodyId, Solid)> {
        /// The distance of a sample from the centre in edges, with a margin for rounding.
        const REACH: f64 = 1.01;
        let reach = REACH * edge + 2.0 * self.side_step();
        let cell = [0, 1, 2].map(|i| Interval { lo: center[i] - reach, hi: center[i] + reach });
        prune_in(&self.geometry.surfaces, &cell, bodies)
    }

    /// A length below which neither distances of surfaces nor curvature lower the size, unless the
    /// curvature is constant: near a singular point (apex of a cone) the size tends to zero.
    fn least_edge(&self) -> f64 {
        1e-3 * self.features.bounds.diagonal() * self.settings.scale.min(1.0)
    }

    /// Whether a cell is too large for the size of a surface that may pass through it.
    ///
    /// If it is not and the surface is near, adds its source.
    fn is_coarse(
        &self,
        surface: SurfaceId,
        (bodies, here): (&[(BodyId, Solid)], &[SurfaceId]),
        center: &Point,
        edge: f64,
        samples: &mut Samples,
    ) -> bool {
        let shape = &self.geometry.surfaces[surface.index()];
        let constant = self.constant_size(surface);
        let Ok(point) = shape.project(center) else { return constant || edge >= self.least_edge() };
        if (point - center).norm() > edge {
            return false;
        }
        let own = self.size_within(surface, &point);
        let own = own.min(self.least_body_bound()).min(self.least_cutout_bound(surface));
        let own = own.min(self.maximum);
        if own >= self.maximum && matches!(shape, csg::Surface::Plane(_)) {
            return false;
        }
        let coarsest =
            if constant { f64::INFINITY } else { COARSEST_SAMPLE * self.features.bounds.diagonal() };
        if edge > coarsest.min(self.spacing(own)) {
            return true;
        }
        let near = self.near_surface(surface, (bodies, here), &point, own);
        if let Some(near) = near
            && near.is_resolved
            && edge > self.spacing(near.size)
            && edge >= self.least_edge()
        {
            return true;
        }
        if let Some(size) = self.size_of_sample(surface, bodies, &point) {
            samples.near.extend(near);
            let size = near.filter(|near| near.is_resolved).map_or(size, |near| size.min(near.size));
            if size < self.maximum {
                samples.sources.push((surface, Source { point, size }));
            }
        }
        false
    }

    /// The surface that limits the size most at a point of another by being close to it, if any;
    /// `bodies` are those pruned around the point, `here` their surfaces.
    fn near_surface(
        &self,
        surface: SurfaceId,
        (bodies, here): (&[(BodyId, Solid)], &[SurfaceId]),
        point: &Point,
        size_alone: f64,
    ) -> Option<NearSurfaces> {
        let others = here.iter().copied().filter(|&other| other != surface);
        let sizes = (size_alone, self.settings.scale);
        let near = others.filter_map(|other| {
            let is_boundary = |foot: &Point, step: f64| {
                let [inside, outside] = self.sides(other, bodies, foot, step.min(self.side_step()));
                inside != outside
            };
            NearSurfaces::find(self.geometry, [surface, other], point, sizes, is_boundary)
        });
        near.filter(|near| near.size >= self.settings.minh).min_by(|a, b| a.size.total_cmp(&b.size))
    }

    /// The distance from a surface at which the regions on both sides are found.
    fn side_step(&self) -> f64 {
        SIDE_STEP * self.features.bounds.diagonal()
    }

    fn least_body_bound(&self) -> f64 {
        self.body_bounds.iter().map(|(_, bound)| *bound).fold(f64::INFINITY, f64::min)
    }

    /// Whether the size from curvature is constant on a surface, so that one point is enough.
    fn constant_size(&self, surface: SurfaceId) -> bool {
        matches!(
            self.geometry.surfaces[surface.index()],
            csg::Surface::Plane(_) | csg::Surface::Sphere(_) | csg::Surface::Cylinder(_)
        )
    }

    /// The bodies at a distance `step` behind and in front of a point of a surface, of those pruned
    /// around it.
    fn sides(
        &self,
        surface: SurfaceId,
        bodies: &[(BodyId, Solid)],
        point: &Point,
        step: f64,
    ) -> [Option<BodyId>; 2] {
        let normal = self.geometry.surfaces[surface.index()].normal(point);
        let body_at = |p: Point| bodies.iter().find(|b| contains(self.geometry, &b.1, &p)).map(|b| b.0);
        [point - step * normal, point + step * normal].map(body_at)
    }

    /// The size at a point of a surface, if a patch is there; `bodies` are those pruned around it.
    fn size_of_sample(&self, surface: SurfaceId, bodies: &[(BodyId, Solid)], point: &Point) -> Option<f64> {
        let step = self.side_step();
        let normal = self.geometry.surfaces[surface.index()].normal(point);
        let sides = self.sides(surface, bodies, point, step);
        if sides[0] == sides[1] {
            return None;
        }
        let is_in =
            |cutout: &Cutout, step: f64| contains(self.geometry, &cutout.solid, &(point + step * normal));
        let is_here =
            |cutout: &Cutout| cutout.surface == surface && is_in(cutout, -step) != is_in(cutout, step);
        let cutout = (0..).zip(&self.geometry.cutouts).find(|(_, cutout)| is_here(cutout)).map(|(i, _)| i);
        let bounds = self.body_bounds.iter().filter(|(body, _)| sides.contains(&Some(*body)));
        let on_surface = self.size_within(surface, point).min(self.cutout_bound(cutout));
        Some(bounds.map(|(_, b)| *b).fold(on_surface, f64::min))
    }
}

fn length(trace: &[Point]) -> f64 {
    trace.windows(2).map(|w| (w[1] - w[0]).norm()).sum()
}

/// The curvature at each point of a trace: that of the circle through it and its neighbours.
fn trace_curvatures(trace: &[Point], closed: bool) -> Vec<f64> {
    let last = trace.len() - 1;
    let at = |i: usize| {
        let (before, after) = match i {
            0 if closed => (last - 1, 1),
            _ if i == last && closed => (last - 1, 1),
            0 => (0, 1),
            _ if i == last => (last - 1, last),
            _ => (i - 1, i + 1),
        };
        let (u, v) = (trace[i] - trace[before], trace[after] - trace[i]);
        let w = trace[after] - trace[before];
        let product = u.norm() * v.norm() * w.norm();
        if product > 0.0 { 2.0 * u.cross(&v).norm() / product } else { 0.0 }
    };
    (0..=last).map(at).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_circle_has_the_curvature_of_its_radius() {
        let trace: Vec<Point> = (0..=32)
            .map(|i| f64::from(i % 32) * std::f64::consts::TAU / 32.0)
            .map(|a| Point::new(2.0 * a.cos(), 2.0 * a.sin(), 1.0))
            .collect();
        for curvature in trace_curvatures(&trace, true) {
            assert!((curvature - 0.5).abs() < 1e-9, "{curvature}");
        }
    }

    #[test]
    fn a_straight_trace_of_two_points_has_no_curvature() {
        let trace = [Point::new(0., 0., 0.), Point::new(1., 0., 0.)];
        assert_eq!(trace_curvatures(&trace, false), [0.0, 0.0]);
    }
}
