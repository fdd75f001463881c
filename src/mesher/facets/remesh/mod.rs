//! Remeshing of a triangulated surface by local changes on its facets.
//!
//! Short edges are collapsed, long ones split, edges flipped and vertices moved on the facets
//! (Botsch, Kobbelt 2004), with lengths in units of a size field (Dunyach, Vanderhaeghe, Barthe,
//! Botsch 2013). Every change keeps a valid surface: each triangle must stay close to its facets
//! and keep their orientation. So slivers disappear wherever a change is an improvement, and no
//! parametrisation is needed. Vertices on curves are stored as arc-length positions and never leave
//! the curve; corners are fixed. The alternative, charts of patches (as
//! [`surface`](crate::mesher::surface) has for analytic surfaces), needs a parametrisation without
//! folds, which noisy facets do not allow.

mod changes;
mod collapse;
mod constraints;
#[cfg(test)]
mod deviation;
mod finish;
mod flip;
mod polyline;
mod repair;
mod report;
mod sheet;
mod smooth;
mod split;

pub use constraints::{Constraints, Piece};
#[cfg(test)]
pub use deviation::deviation;
pub use report::RemeshReport;

use super::{Crossing, FacetModel, FacetSize};
use crate::Point;
use crate::ground::progress::Work;
use crate::ground::size::{SizeField, Source, SourceTree};
use crate::mesher::surface::{SurfaceMesh, crossings};
use sheet::Sheet;

/// Settings of remeshing.
#[derive(Clone, Debug, PartialEq)]
pub struct RemeshSettings {
    /// Rounds of collapses, splits, flips and moves.
    pub rounds: usize,
    /// Largest turn of a patch along an edge (radians), for any size field: limits the size to turn
    /// / curvature.
    pub turn: f64,
    /// Edges shorter than this are collapsed (units of the wanted size).
    pub short: f64,
    /// Edges longer than this are split (units of the wanted size).
    pub long: f64,
    /// The most times that sizes are lowered at intersections before the mesh is returned as it is.
    pub corrections: usize,
}

impl Default for RemeshSettings {
    fn default() -> Self {
        Self { rounds: 6, turn: 1.1, short: 0.7, long: 1.4, corrections: 14 }
    }
}

/// The size field during remeshing: the least of three fields.
struct Sizes<'a> {
    wanted: &'a dyn SizeField,
    /// Limits the turn along an edge.
    turn: FacetSize,
    /// Lowers sizes at intersections of triangles found so far.
    lowered: SourceTree,
}

impl SizeField for Sizes<'_> {
    fn work(&self) -> &Work<'_> {
        self.wanted.work()
    }

    fn size_at(&self, point: &Point) -> f64 {
        self.wanted.size_at(point).min(self.turn.size_at(point)).min(self.lowered.size_at(point))
    }
}

/// Growth of sizes away from intersections.
const LOWERED_GRADING: f64 = 1.0;

/// The most rounds of splits until all edges are short enough; each halves long edges, except that
/// two rounds may be needed in thin triangles.
const MOST_SPLITS: usize = 80;

/// After this many corrections in a row with more intersections than before, the mesh is returned
/// as it is: smaller triangles only fold more often.
const MOST_WORSE: usize = 3;

/// Rounds over the mesh after sizes were lowered.
const CORRECTING_ROUNDS: usize = 3;

/// Factor by which sizes are lowered at intersections.
const LOWERED: f64 = 0.6;

/// Makes a surface mesh of a model, with edges of about the wanted size.
///
/// Corners are the first vertices, in their order, followed by the vertices on curves, curve by
/// curve, and those on patches. Vertices lie on the facets and polylines up to rounding, from where
/// `snap` moves them onto the surfaces that these stand for. If triangles of close patches then
/// intersect, unless their bodies `touch` there, the sizes are lowered and the mesh is refined
/// further as long as that helps; [`RemeshReport::crossings`] lists intersections that remain, for
/// example because the facets themselves intersect. If the work of the size field is cancelled, the
/// mesh is returned as it is.
///
/// # Errors
/// Those of `snap`.
pub fn remesh<E: Send>(
    model: &FacetModel,
    size: &dyn SizeField,
    (settings, constraints): (&RemeshSettings, &Constraints),
    snap: &Snap<E>,
    touch: &Touch,
) -> Result<(SurfaceMesh, RemeshReport), E> {
    // In a thread of the pool, so that no call of the pool waits for another thread to wake up.
    rayon::scope(|_| remesh_in_pool(model, size, (settings, constraints), snap, touch))
}

/// Moves the vertices of a surface mesh.
type Snap<'a, E> = dyn Fn(&mut SurfaceMesh) -> Result<(), E> + Sync + 'a;

/// Whether triangles may intersect.
type Touch<'a> = dyn Fn(&Crossing) -> bool + Sync + 'a;

fn remesh_in_pool<E>(
    model: &FacetModel,
    size: &dyn SizeField,
    (settings, constraints): (&RemeshSettings, &Constraints),
    snap: &Snap<E>,
    touch: &Touch,
) -> Result<(SurfaceMesh, RemeshReport), E> {
    let tree = |sources: &[Source]| SourceTree::new(model.bounds, LOWERED_GRADING, f64::INFINITY, sources);
    let sizes = Sizes { wanted: size, turn: FacetSize::of_turn(model, settings.turn), lowered: tree(&[]) };
    let mut sheet = Sheet::new(model, sizes, constraints);
    let mut lowered = Vec::new();
    let mut report = RemeshReport::default();
    let (mut before, mut worse) = (usize::MAX, 0);
    for correction in 0.. {
        report.corrections = correction;
        // Only regions with lowered sizes change, so a few rounds suffice.
        let rounds = if correction == 0 { settings.rounds } else { settings.rounds.min(CORRECTING_ROUNDS) };
        pass(&mut sheet, rounds, settings, &mut report);
        let mut mesh = finish::finish(&sheet);
        snap(&mut mesh)?;
        report.crossings = crossings(&mesh.points, &mesh.triangles, |pair, at| {
            let corners = pair.map(|t| t.vertices.map(|v| mesh.points[v.index()]));
            touch(&Crossing::of(pair.map(|t| t.patch), &corners, *at))
        });
        // No size removes intersections of the facets themselves.
        let is_input_crossed =
            correction == 0 && !report.crossings.is_empty() && !model.intersections().is_empty();
        worse = if report.crossings.len() > before { worse + 1 } else { 0 };
        before = report.crossings.len();
        let is_last = correction == settings.corrections
            || worse == MOST_WORSE
            || is_input_crossed
            || sheet.size.work().is_cancelled();
        if report.crossings.is_empty() || is_last {
            report.measure(&sheet);
            return Ok((mesh, report));
        }
        let lower = |&point: &Point| Source { point, size: LOWERED * sheet.size.size_at(&point) };
        lowered.extend(report.crossings.iter().map(lower).collect::<Vec<_>>());
        sheet.size.lowered = tree(&lowered);
        sheet.update_sizes();
    }
    unreachable!("the loop ends by itself")
}

/// One pass over the whole sheet: splits, collapses, flips and moves, then repairs.
fn pass(sheet: &mut Sheet, rounds: usize, settings: &RemeshSettings, report: &mut RemeshReport) {
    report.flips += flip::flip_all(sheet);
    report.collapses += collapse::collapse_short(sheet, settings.short);
    for _ in 0..rounds {
        if sheet.size.work().is_cancelled() {
            return;
        }
        for _ in 0..MOST_SPLITS {
            let splits = split::split_long(sheet, settings.long);
            report.splits += splits;
            report.flips += flip::flip_all(sheet);
            if splits == 0 || sheet.size.work().is_cancelled() {
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
