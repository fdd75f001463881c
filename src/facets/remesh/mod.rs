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

use super::{FacetModel, FacetSize};
use crate::Point;
use crate::size::{SizeField, Source, SourceTree};
use crate::surface::{SurfaceMesh, crossings};
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

/// What sizes are taken from while a surface is remeshed: the least of three.
struct Sizes<'a> {
    wanted: &'a dyn SizeField,
    /// Bounds the turn along an edge.
    turn: FacetSize,
    /// Where triangles met so far.
    lowered: SourceTree,
}

impl SizeField for Sizes<'_> {
    fn size_at(&self, point: &Point) -> f64 {
        self.wanted.size_at(point).min(self.turn.size_at(point)).min(self.lowered.size_at(point))
    }
}

/// How fast sizes may grow away from places where triangles met.
const LOWERED_GRADING: f64 = 1.0;

/// Rounds of splits until all edges are short enough: each halves them.
const MOST_SPLITS: usize = 40;

/// Times that sizes are lowered where triangles meet, before the mesh is handed out as it is.
const MOST_CORRECTIONS: usize = 14;

/// Rounds over the mesh after sizes were lowered.
const CORRECTING_ROUNDS: usize = 3;

/// A place where triangles meet asks for this part of the size there.
const LOWERED: f64 = 0.6;

/// Makes a surface mesh of a model with edges of about the size wanted.
///
/// Corners are vertices, in their order; then come the vertices on curves, curve by curve, and those on patches. Vertices
/// lie on the facets and polylines up to rounding. Where triangles of patches near each other would intersect, the sizes are lowered
/// and the same mesh is worked on again; [`RemeshReport::crossings`] tells if some are left, as where the facets intersect themselves.
pub fn remesh(
    model: &FacetModel,
    size: &dyn SizeField,
    settings: &RemeshSettings,
) -> (SurfaceMesh, RemeshReport) {
    let tree = |sources: &[Source]| SourceTree::new(model.bounds, LOWERED_GRADING, f64::INFINITY, sources);
    let sizes = Sizes { wanted: size, turn: FacetSize::of_turn(model, settings.turn), lowered: tree(&[]) };
    let mut sheet = Sheet::new(model, sizes);
    let mut lowered = Vec::new();
    let mut report = RemeshReport::default();
    for correction in 0.. {
        report.corrections = correction;
        // What is not near a lower size has been done, so that a few rounds do.
        let rounds = if correction == 0 { settings.rounds } else { settings.rounds.min(CORRECTING_ROUNDS) };
        pass(&mut sheet, rounds, settings, &mut report);
        let mesh = finish::finish(&sheet);
        report.crossings = crossings(&mesh.points, &mesh.triangles);
        // No size mends facets that intersect.
        let hopeless = correction == 0 && !report.crossings.is_empty() && !model.crossings().is_empty();
        if report.crossings.is_empty() || correction == MOST_CORRECTIONS || hopeless {
            report.measure(&sheet);
            return (mesh, report);
        }
        let lower = |&point: &Point| Source { point, size: LOWERED * sheet.size.size_at(&point) };
        lowered.extend(report.crossings.iter().map(lower).collect::<Vec<_>>());
        sheet.size.lowered = tree(&lowered);
        sheet.renew_sizes();
    }
    unreachable!("the loop ends by itself")
}

/// Goes over the whole sheet.
fn pass(sheet: &mut Sheet, rounds: usize, settings: &RemeshSettings, report: &mut RemeshReport) {
    report.flips += flip::flip_all(sheet);
    report.collapses += collapse::collapse_short(sheet, settings.short);
    for _ in 0..rounds {
        for _ in 0..MOST_SPLITS {
            let splits = split::split_long(sheet, settings.long);
            report.splits += splits;
            report.flips += flip::flip_all(sheet);
            if splits == 0 {
                break;
            }
        }
        report.collapses += collapse::collapse_short(sheet, settings.short);
        report.flips += flip::flip_all(sheet);
        report.moves += smooth::smooth_all(sheet);
        report.flips += flip::flip_all(sheet);
        report.moves += smooth::smooth_all(sheet);
    }
    repair::repair(sheet, report);
}
