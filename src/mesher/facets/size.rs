//! The size field derived from facets.
//!
//! Curvature is that of the interpolated normals over facets: along a side, the change of the
//! patch's normal per length (compare Rusinkiewicz 2004, who fits a tensor to these). Slivers are
//! ignored, because their neighbours cover the same area.

use super::{BluntEnd, FacetCurve, FacetModel, close_curves};
use crate::ground::kernel::simplex::area_vector;
use crate::ground::projector::facets::normals::SLIVER_HEIGHT;
use crate::ground::size::{
    Closeness, Evaluation, GradedSize, SizeField, SizeFunction, SizeSettings, Source, thinned,
};
use crate::{Point, Vector};
use rayon::prelude::*;

/// Sizes from the curvature of facets and curves, from short curves, and from the user's settings.
#[derive(Clone, Debug)]
pub struct FacetSize {
    graded: GradedSize,
    function: Option<SizeFunction>,
}

/// Distance of neighbouring sources, in units of the size there.
const SPACING: f64 = 1.0;

/// The most sources along the side of one facet: sizes below a thousandth of it come from noise.
const MOST_SOURCES: f64 = 1000.0;

/// Sides and curve steps shorter than this many roundings have no reliable curvature.
const SHORT_SIDE: f64 = 200.0;

impl FacetSize {
    /// Samples facets and curves for sources: curvature, short curves, and curves close to each
    /// other.
    pub fn new(model: &FacetModel, settings: &SizeSettings) -> Self {
        Self::evaluated(model, settings, Evaluation::Fine)
    }

    /// [`new`](Self::new), evaluated as needed.
    pub(crate) fn evaluated(model: &FacetModel, settings: &SizeSettings, evaluation: Evaluation) -> Self {
        let maximum = largest_size(model, settings);
        let mut sources = settings.sources.clone();
        sample_facets(model, settings, maximum, &mut sources);
        sample_curves(model, settings, maximum, &mut sources);
        let mut sources = thinned(sources);
        close_curves::sample(model, settings, maximum, &mut sources);
        let graded = GradedSize::new(model.bounds, settings.grading, maximum, &thinned(sources), evaluation);
        Self { graded, function: settings.function.clone() }
    }

    /// The size field for facets that are kept: that of the user alone.
    ///
    /// The volume mesher limits sizes by the growth from the kept edges. Finer tets than those at
    /// curved or narrow places of a coarse surface could not be connected to it.
    pub fn of_kept(model: &FacetModel, settings: &SizeSettings) -> Self {
        let maximum = largest_size(model, settings);
        let sources = thinned(settings.sources.clone());
        let graded = GradedSize::new(model.bounds, settings.grading, maximum, &sources, Evaluation::Fine);
        Self { graded, function: settings.function.clone() }
    }

    /// The size field for which patches and curves turn by `turn` (radians) along an edge.
    pub(super) fn of_turn(model: &FacetModel, turn: f64) -> Self {
        let settings = SizeSettings {
            maxh: None,
            minh: 0.0,
            curvature_safety: 1.0 / turn,
            segments_per_curve: f64::MIN_POSITIVE,
            grading: TURN_GRADING,
            closeness: Closeness::OFF,
            scale: 1.0,
            sources: Vec::new(),
            function: None,
        };
        Self::new(model, &settings)
    }
}

/// Growth of sizes limited by curvature only: a flat patch next to a round one soon has large
/// triangles.
const TURN_GRADING: f64 = 1.0;

impl SizeField for FacetSize {
    fn size_at(&self, point: &Point) -> f64 {
        let size = self.graded.size_at(point);
        self.function.as_ref().map_or(size, |function| function.bound(size, point))
    }
}

/// The size far from all sources, which no other exceeds.
pub fn largest_size(model: &FacetModel, settings: &SizeSettings) -> f64 {
    let bound = settings.maxh.unwrap_or(f64::INFINITY) * settings.scale.min(1.0);
    bound.min(model.bounds.diagonal() * settings.scale)
}

fn size_of_curvature(settings: &SizeSettings, curvature: f64) -> f64 {
    (settings.scale / (settings.curvature_safety * curvature)).max(settings.minh)
}

/// Adds sources on facets whose curvature needs a size below `maximum`.
fn sample_facets(model: &FacetModel, settings: &SizeSettings, maximum: f64, sources: &mut Vec<Source>) {
    let of_piece = |(patch, facets, normals): (usize, &[[Point; 3]], &[[Vector; 3]])| {
        let blunt: Vec<&BluntEnd> = model.blunt.iter().filter(|end| end.patch == patch).collect();
        let mut added = Vec::new();
        for (corners, normals) in facets.iter().zip(normals) {
            let size = size_of_curvature(settings, curvature(corners, normals, model.rounding));
            if size < maximum && !blunt.iter().any(|end| end.has(corners)) {
                sample_facet(corners, size, &mut added);
            }
        }
        added
    };
    let pieces: Vec<_> = model.projector.facets().collect();
    let added: Vec<Vec<Source>> = pieces.into_par_iter().map(of_piece).collect();
    sources.extend(added.concat());
}

/// Adds sources on a facet, in rows parallel to its longest side.
fn sample_facet(corners: &[Point; 3], size: f64, sources: &mut Vec<Source>) {
    let length = |k: usize| (corners[(k + 2) % 3] - corners[(k + 1) % 3]).norm();
    let k = (0..3).max_by(|&i, &j| length(i).total_cmp(&length(j))).unwrap_or(0);
    let [apex, from, to] = [0, 1, 2].map(|i| corners[(k + i) % 3]);
    let rows = intervals((apex - from).norm().min((apex - to).norm()), size);
    for row in 0..=rows {
        let up = row as f64 / rows as f64;
        let [a, b] = [from, to].map(|p| p + (apex - p) * up);
        let columns = intervals((b - a).norm(), size);
        let on = |column: usize| a + (b - a) * (column as f64 / columns as f64);
        sources.extend((0..=columns).map(|column| Source { point: on(column), size }));
    }
}

/// The curvature of a patch on one facet, from its normals at the corners; 0 for slivers.
fn curvature(corners: &[Point; 3], normals: &[Vector; 3], rounding: f64) -> f64 {
    let area = area_vector(&corners[0], &corners[1], &corners[2]).norm();
    let side =
        |k: usize| (corners[(k + 2) % 3] - corners[(k + 1) % 3], normals[(k + 2) % 3] - normals[(k + 1) % 3]);
    let longest = (0..3).map(|k| side(k).0.norm()).fold(0.0, f64::max);
    if area <= SLIVER_HEIGHT * rounding * longest {
        return 0.0;
    }
    (0..3)
        .map(side)
        .filter(|(along, _)| along.norm() > SHORT_SIDE * rounding)
        .map(|(along, turn)| turn.dot(&along).abs() / along.norm_squared())
        .fold(0.0, f64::max)
}

fn intervals(length: f64, size: f64) -> usize {
    (length / (SPACING * size)).ceil().clamp(1.0, MOST_SOURCES) as usize
}

/// Adds sources along curves, by their length and curvature.
fn sample_curves(model: &FacetModel, settings: &SizeSettings, maximum: f64, sources: &mut Vec<Source>) {
    for curve in &model.curves {
        let points: Vec<Point> = curve.vertices.iter().map(|&v| model.points[v as usize]).collect();
        let length: f64 = points.windows(2).map(|w| (w[1] - w[0]).norm()).sum();
        let whole = (settings.scale * length / settings.segments_per_curve).max(settings.minh);
        // Short edges of a composite curve bend it, but not for the elements.
        let curvatures = if curve.small.is_empty() {
            curvatures(&points, curve.ends.is_none(), SHORT_SIDE * model.rounding)
        } else {
            let mut all = vec![0.0; points.len()];
            for run in runs(curve) {
                let own = curvatures(&points[run.clone()], false, SHORT_SIDE * model.rounding);
                all[run].iter_mut().zip(own).for_each(|(all, own)| *all = f64::max(*all, own));
            }
            all
        };
        for (i, w) in points.windows(2).enumerate().filter(|(i, _)| !curve.is_small(*i)) {
            let curvature = curvatures[i].max(curvatures[i + 1]);
            let size = whole.min(size_of_curvature(settings, curvature));
            if size < maximum {
                let count = intervals((w[1] - w[0]).norm(), size);
                let on = |k: usize| w[0] + (w[1] - w[0]) * (k as f64 / count as f64);
                sources.extend((0..=count).map(|k| Source { point: on(k), size }));
            }
        }
    }
}

/// The points of a curve between its short edges.
fn runs(curve: &FacetCurve) -> impl Iterator<Item = std::ops::Range<usize>> {
    let steps: Vec<usize> = (0..curve.vertices.len() - 1).filter(|&i| !curve.is_small(i)).collect();
    let runs: Vec<_> = steps.chunk_by(|a, b| b - a == 1).map(|run| run[0]..run[run.len() - 1] + 2).collect();
    runs.into_iter()
}

/// The curvature of a polyline at its points, by the circle through the point and two points on
/// either side at least `shortest` away.
fn curvatures(points: &[Point], closed: bool, shortest: f64) -> Vec<f64> {
    let count = points.len() - 1;
    let away = |i: usize, forward: bool| {
        let mut at = i;
        for _ in 0..count {
            at = match (forward, at) {
                (true, k) if k < count => k + 1,
                (true, _) if closed => 1,
                (false, k) if k > 0 => k - 1,
                (false, _) if closed => count - 1,
                _ => return None,
            };
            if (points[at] - points[i]).norm() >= shortest {
                return Some(points[at]);
            }
        }
        None
    };
    let at = |i: usize| {
        let (Some(p), Some(q)) = (away(i, false), away(i, true)) else { return 0.0 };
        let (u, v, w) = (points[i] - p, q - points[i], q - p);
        let product = u.norm() * v.norm() * w.norm();
        if product > 0.0 { 2.0 * u.cross(&v).norm() / product } else { 0.0 }
    };
    (0..points.len()).map(at).collect()
}
