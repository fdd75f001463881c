//! Finds sizes for a requested number of tets.

use super::coarse::{CoarseError, CoarseMesh, CoarseSettings};
use super::estimate;
use super::model::Model;
use super::retries::{Budget, TARGETS};
use crate::ground::progress::Work;

/// Whether a coarse mesh has the requested number of tets.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Outcome {
    /// In the accepted range: up to 1.5 times the number for a coarse mesh, 1.3 times in total.
    Reached,
    /// The coarsest mesh of the geometry has more tets.
    Least,
    /// No size gives a number in the range: this is the next larger one.
    Jumped,
}

/// The number to aim at, relative to the target: inside the accepted range, which begins near 1.
const AIM: f64 = 1.15;

/// Number of trials that use the estimate.
const TRUSTED_TRIES: usize = 4;

/// Scales beyond this have no effect on the mesh.
const LARGEST_SCALE: f64 = 1e3;

/// A bracket of scales narrower than this factor is not divided further.
const NARROW: f64 = 1.002;

/// Makes a coarse mesh whose number of tets `fits`, near the `target` or up to half above it, by
/// scaling all sizes; otherwise the one with the least number above the target.
///
/// Upper bounds set by the user or the file (`maxh`) are respected.
///
/// # Errors
/// Those of [`Model::coarse_mesh`].
pub fn mesh_to_target(
    model: &Model,
    settings: &mut CoarseSettings,
    target: u64,
    fits: &dyn Fn(u64) -> bool,
    budget: &Budget,
    work: &Work,
) -> Result<(CoarseMesh, Outcome), CoarseError> {
    let goal = AIM * target as f64;
    let sources = settings.size.sources.len();
    let mut fine: Option<(f64, CoarseMesh)> = None;
    let mut coarse: Option<(f64, f64)> = None;
    let mut finest_failure: Option<CoarseError> = None;
    for tries in 0..TARGETS {
        work.proceed()?;
        if tries > 0 && budget.is_spent() {
            break;
        }
        settings.size.sources.truncate(sources);
        let made = match model.coarse_mesh(settings, budget, work) {
            Ok(made) => made,
            Err(error @ (CoarseError::Room(_) | CoarseError::Cancelled(_))) => return Err(error),
            // The sizes are too large for the geometry despite all corrections: treat this as too
            // few tets.
            Err(error) => {
                coarse = Some((settings.size.scale, 0.5 * target as f64));
                finest_failure = Some(error);
                settings.size.scale =
                    next_scale(settings.size.scale, goal, 0.5 * goal, None, fine.as_ref(), coarse);
                continue;
            }
        };
        let count = made.report.tets as f64;
        if fits(made.report.tets) {
            return Ok((made, Outcome::Reached));
        }
        let scale = settings.size.scale;
        // If estimates do not narrow the bracket, continue without them.
        let expected = (tries < TRUSTED_TRIES)
            .then(|| estimate::scale_for(model, settings, &made, sources, goal))
            .flatten();
        if made.report.tets < target {
            coarse = Some((scale, count));
        } else {
            if scale >= LARGEST_SCALE {
                return Ok((made, Outcome::Least));
            }
            fine = Some((scale, made));
        }
        if let (Some((low, _)), Some((high, _))) = (&fine, coarse)
            && high / low < NARROW
        {
            break;
        }
        settings.size.scale = next_scale(scale, goal, count, expected, fine.as_ref(), coarse);
    }
    match (fine, finest_failure) {
        (Some((scale, made)), _) => {
            settings.size.scale = scale;
            Ok((made, Outcome::Jumped))
        }
        (None, Some(error)) => Err(error),
        (None, None) => model.coarse_mesh(settings, budget, work).map(|made| (made, Outcome::Jumped)),
    }
}

/// The scale to try next: the `expected` one if it is inside the bracket, else from the number of
/// tets, which goes with the third power of the scale.
fn next_scale(
    scale: f64,
    goal: f64,
    count: f64,
    expected: Option<f64>,
    fine: Option<&(f64, CoarseMesh)>,
    coarse: Option<(f64, f64)>,
) -> f64 {
    match (fine, coarse) {
        (Some((low, made)), Some((high, few))) => {
            // Linear between the logarithms, kept away from the ends so that the bracket shrinks.
            let (low_log, high_log) = (low.ln(), high.ln());
            let (many, few) = ((made.report.tets as f64).ln(), few.max(1.0).ln());
            let share = match expected {
                Some(expected) => (expected.ln() - low_log) / (high_log - low_log),
                None => (many - goal.ln()) / (many - few),
            };
            (low_log + share.clamp(0.15, 0.85) * (high_log - low_log)).exp()
        }
        // Still too many: coarsen ever faster, because some numbers hardly depend on the sizes.
        (Some(_), None) => (scale * (count / goal).cbrt().max(1.5).powi(2).min(16.0)).min(LARGEST_SCALE),
        _ => {
            let finer = expected.map_or((count / goal).cbrt(), |expected| expected / scale);
            scale * finer.clamp(0.05, 0.9)
        }
    }
}
