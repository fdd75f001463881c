//! A better mesh of a triangulated surface: by local changes of the triangles given, on their facets.
//!
//! Short edges are collapsed, long ones split, edges flipped and vertices moved on the facets (Botsch, Kobbelt 2004), the
//! lengths in units of a size field (Dunyach, Vanderhaeghe, Barthe, Botsch 2013). Every change keeps a valid surface: it must
//! leave each triangle near its facets and turned as they are, so slivers go wherever a change makes things better, and nothing has to be
//! parametrised. Vertices on curves are numbers along them and never leave them; corners stay. The other way, charts of patches (as
//! [`surface`](crate::surface) has for analytic ones), needs a parametrisation without folds, which noisy facets do not offer.

mod collapse;
mod deviation;
mod finish;
mod flip;
mod rail;
mod repair;
mod report;
mod sheet;
mod smooth;
mod split;

pub use deviation::deviation;
pub use report::RemeshReport;

use super::model::crossings;
use super::{FacetModel, FacetSize};
use crate::Point;
use crate::size::{SizeField, Source};
use crate::surface::SurfaceMesh;
use sheet::Sheet;

/// How facets are remeshed.
#[derive(Clone, Debug, PartialEq)]
pub struct RemeshSettings {
    /// Rounds of collapses, splits, flips and moves.
    pub rounds: usize,
    /// The most that a patch may turn along an edge (radians), whatever the size field wants: bounds the size by turn / curvature.
    pub turn: f64,
    /// Edges are collapsed below this (units of the wanted size).
    pub short: f64,
    /// Edges are split above this (units of the wanted size).
    pub long: f64,
}

impl Default for RemeshSettings {
    fn default() -> Self {
        Self { rounds: 6, turn: 1.1, short: 0.7, long: 1.4 }
    }
}

/// The smaller of two sizes.
struct Smaller<'a>(&'a dyn SizeField, FacetSize);

impl SizeField for Smaller<'_> {
    fn size_at(&self, point: &Point) -> f64 {
        self.0.size_at(point).min(self.1.size_at(point))
    }
}

/// Rounds of splits until all edges are short enough: each halves them.
const MOST_SPLITS: usize = 40;

/// Times that sizes are lowered where triangles meet, before the mesh is handed out as it is.
const MOST_CORRECTIONS: usize = 14;

/// A place where triangles meet asks for this part of the size there.
const LOWERED: f64 = 0.6;

/// Makes a surface mesh of a model with edges of about the size wanted.
///
/// Corners are vertices, in their order; then come the vertices on curves, curve by curve, and those on patches. Vertices
/// lie on the facets and polylines up to rounding. Where triangles of patches near each other would intersect, the sizes are lowered;
/// [`RemeshReport::crossings`] tells if some are left, as where the facets intersect themselves.
pub fn remesh(
    model: &FacetModel,
    size: &dyn SizeField,
    settings: &RemeshSettings,
) -> (SurfaceMesh, RemeshReport) {
    let mut lowered = Vec::new();
    for correction in 0.. {
        let size = Smaller(size, FacetSize::of_turn(model, settings.turn, &lowered));
        let mut report = RemeshReport { corrections: correction, ..RemeshReport::default() };
        let mesh = pass(model, &size, settings, &mut report);
        report.crossings = crossings(&mesh.points, &mesh.triangles);
        if report.crossings.is_empty() || correction == MOST_CORRECTIONS {
            return (mesh, report);
        }
        // No size mends facets that intersect.
        if correction == 0 && !model.crossings().is_empty() {
            return (mesh, report);
        }
        let lower = |&point: &Point| Source { point, size: LOWERED * size.size_at(&point) };
        lowered.extend(report.crossings.iter().map(lower));
    }
    unreachable!("the loop ends by itself")
}

/// Remeshes once.
fn pass(
    model: &FacetModel,
    size: &dyn SizeField,
    settings: &RemeshSettings,
    report: &mut RemeshReport,
) -> SurfaceMesh {
    let mut sheet = Sheet::new(model, size);
    report.flips += flip::flip_all(&mut sheet);
    report.collapses += collapse::collapse_short(&mut sheet, settings.short);
    for _ in 0..settings.rounds {
        for _ in 0..MOST_SPLITS {
            let splits = split::split_long(&mut sheet, settings.long);
            report.splits += splits;
            report.flips += flip::flip_all(&mut sheet);
            if splits == 0 {
                break;
            }
        }
        report.collapses += collapse::collapse_short(&mut sheet, settings.short);
        report.flips += flip::flip_all(&mut sheet);
        report.moves += smooth::smooth_all(&mut sheet);
        report.flips += flip::flip_all(&mut sheet);
        report.moves += smooth::smooth_all(&mut sheet);
    }
    repair::repair(&mut sheet, report);
    report.measure(&sheet);
    finish::finish(&sheet)
}
